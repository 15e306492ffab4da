//! States and events of studies, as they follow from their jobs.

use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::resource::{StudyJob, StudyStatus};
use crate::engine::progress::Progress;
use crate::http::job_sets::set_events::{Moment, SetView};
use crate::queue::store::JobHead;
use crate::study::part::StudyPart;

/// Data of an event of a study.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct StudyEvent {
    /// State of the study.
    pub status: StudyStatus,
    /// Number of the study's jobs, the reference included.
    pub runs: usize,
    /// Number of the study's jobs that had ended at the time of the event.
    pub runs_done: usize,
    /// Job that the event reports, in its state at the time; null for `restarted` and for the event that ends the stream.
    pub job: Option<StudyJob>,
    /// Progress of that job; null where it has just started.
    pub progress: Option<Progress>,
    /// Path of the table of the runs so far, which exists once the reference has succeeded.
    pub table: String,
}

/// View on studies: the part of each of its jobs.
pub struct StudyView(Vec<(Uuid, StudyPart)>);

impl StudyView {
    /// Creates the view on a study of these jobs in their order, each with its part.
    pub fn new(parts: Vec<(Uuid, StudyPart)>) -> Self {
        Self(parts)
    }
}

impl SetView for StudyView {
    type Status = StudyStatus;
    type Event = StudyEvent;

    fn status(&self, jobs: &[Option<&JobHead>]) -> StudyStatus {
        let jobs = self.0.iter().zip(jobs).map(|((id, part), head)| StudyJob::new(*id, part, *head));
        StudyStatus::of(&jobs.collect::<Vec<_>>())
    }

    fn event(&self, moment: Moment<'_, StudyStatus>) -> StudyEvent {
        let Moment { set, status, total: runs, ended: runs_done, job, progress } = moment;
        let job = job.and_then(|(place, head)| Some(StudyJob::new(head.id, &self.0.get(place)?.1, Some(head))));
        StudyEvent { status, runs, runs_done, job, progress, table: format!("/v1/studies/{set}/files/study.csv") }
    }
}

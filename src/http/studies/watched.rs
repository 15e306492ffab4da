//! Studies whose events are followed live, with one reader per study, whatever the number of streams.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use tokio::sync::watch;
use utoipa::ToSchema;
use uuid::Uuid;

use super::part::StudyPart;
use super::resource::{StudyJob, StudyStatus};
use crate::engine::progress::Progress;
use crate::queue::store::{JobHead, JobStatus, StudyProgress, StudyStep};

/// Studies that have open streams now.
#[derive(Default)]
pub struct WatchedStudies {
    readers: Mutex<HashMap<Uuid, watch::Sender<Arc<StudyNow>>>>,
}

impl WatchedStudies {
    /// Returns the number of studies that have a reader.
    pub fn count(&self) -> usize {
        self.lock().len()
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, HashMap<Uuid, watch::Sender<Arc<StudyNow>>>> {
        // a map of senders is never left half changed
        self.readers.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

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

/// Ids of a study's jobs in order, each with the job's part in the study.
pub struct StudyJobs {
    pub study: Uuid,
    pub parts: Vec<(Uuid, StudyPart)>,
}

/// Events of a study up to now, and its state.
#[derive(Clone)]
pub struct StudyNow {
    /// Starts and ends of the study's jobs, and the end of the study; their ids count 1, 2, 3 ... in this order.
    pub told: Vec<(&'static str, StudyEvent)>,
    pub status: StudyStatus,
    /// Newest pass of one of the study's jobs, with the number of passes reported before; `None` before the first one that came
    /// while a stream was open.
    pub pass: Option<(u64, StudyEvent)>,
    /// Steps reported in `told`; those of jobs that were deleted meanwhile stay.
    steps: Vec<StudyStep>,
}

impl StudyNow {
    /// Creates the state of a study that had no streams so far.
    pub fn new(jobs: &StudyJobs, progress: &StudyProgress) -> Self {
        let mut now = Self { told: Vec::new(), status: StudyStatus::Queued, pass: None, steps: Vec::new() };
        now.take(jobs, progress);
        now
    }

    /// Adds the starts and ends since the last call; true if there were any.
    pub fn take(&mut self, jobs: &StudyJobs, progress: &StudyProgress) -> bool {
        let heads: HashMap<Uuid, &JobHead> = progress.jobs.iter().map(|head| (head.id, head)).collect();
        let told = self.told.len();
        // deleted jobs count as ended, as in the study's resource
        let mut done = jobs.parts.len() - heads.len();
        for step in &progress.steps {
            done += usize::from(step.ended.is_some());
            if self.steps.contains(step) {
                continue;
            }
            self.steps.push(*step);
            let (Some(head), Some(mut job)) = (heads.get(&step.job), jobs.job(step.job, &heads)) else { continue };
            job.status = Some(step.ended.unwrap_or(JobStatus::Running));
            job.stopped_by = job.stopped_by.filter(|_| step.ended.is_some());
            let event = StudyEvent {
                job: Some(job),
                progress: step.ended.map(|_| head.progress),
                ..jobs.event(StudyStatus::Running, done)
            };
            self.told.push((if step.ended.is_some() { ENDED } else { STARTED }, event));
        }
        let was_final = self.status.is_final();
        let as_they_are: Vec<StudyJob> = jobs.all(&heads).collect();
        self.status = StudyStatus::of(&as_they_are);
        if self.status.is_final() && !was_final {
            self.told.push((self.status.name(), jobs.event(self.status, jobs.parts.len())));
        }
        self.told.len() > told
    }

    /// Creates an event that reports the study as it is, and none of its jobs.
    pub fn as_event(&self, jobs: &StudyJobs) -> StudyEvent {
        jobs.event(self.status, self.told.last().map_or(0, |(_, event)| event.runs_done))
    }

    /// Adds a pass of a job that runs.
    pub fn take_pass(&mut self, jobs: &StudyJobs, progress: &StudyProgress, of: Uuid) {
        let heads: HashMap<Uuid, &JobHead> = progress.jobs.iter().map(|head| (head.id, head)).collect();
        let (Some(head), Some(job)) = (heads.get(&of), jobs.job(of, &heads)) else { return };
        let ended = progress.steps.iter().filter(|step| step.ended.is_some()).count();
        let event = StudyEvent {
            job: Some(job),
            progress: Some(head.progress),
            ..jobs.event(StudyStatus::Running, jobs.parts.len() - heads.len() + ended)
        };
        let number = self.pass.as_ref().map_or(0, |(number, _)| number + 1);
        self.pass = Some((number, event));
    }
}

impl StudyJobs {
    fn job(&self, id: Uuid, heads: &HashMap<Uuid, &JobHead>) -> Option<StudyJob> {
        let (_, part) = self.parts.iter().find(|(job, _)| *job == id)?;
        Some(StudyJob::new(id, part, heads.get(&id).copied()))
    }

    fn all<'a>(&'a self, heads: &'a HashMap<Uuid, &JobHead>) -> impl Iterator<Item = StudyJob> + 'a {
        self.parts.iter().map(|(id, part)| StudyJob::new(*id, part, heads.get(id).copied()))
    }

    fn event(&self, status: StudyStatus, runs_done: usize) -> StudyEvent {
        let table = format!("/v1/studies/{}/files/study.csv", self.study);
        StudyEvent { status, runs: self.parts.len(), runs_done, job: None, progress: None, table }
    }
}

/// Name of the event of a job that has started.
pub const STARTED: &str = "started";
/// Name of the event of a job that has done a pass.
pub const PASS: &str = "pass";
/// Name of the event sent when events that were sent before are lost; it is followed by the last event that there is.
pub const RESTARTED: &str = "restarted";
/// Name of the event of a job that has ended.
pub const ENDED: &str = "ended";

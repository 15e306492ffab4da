//! Events of a study, which follow from the starts, passes and ends of its jobs.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::resource::{StudyJob, StudyStatus};
use crate::engine::progress::Progress;
use crate::http::watched::SentEvent;
use crate::queue::store::{JobHead, JobStatus, StudyProgress, StudyStep};
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

/// Events of a study up to now.
pub struct StudyEvents {
    pub study: Uuid,
    /// Ids of the study's jobs in order, each with the job's part in the study.
    parts: Vec<(Uuid, StudyPart)>,
    now: Mutex<Now>,
}

/// Present state of a study that is followed.
struct Now {
    status: StudyStatus,
    /// Starts and ends of the study's jobs, and the end of the study; their ids count 1, 2, 3 ... in this order.
    told: Vec<SentEvent>,
    /// Steps that were reported; those of jobs that were deleted meanwhile stay.
    steps: Vec<StudyStep>,
    /// Number of jobs that had ended at the last event.
    runs_done: usize,
}

impl StudyEvents {
    /// Creates a study of these jobs, none of which has started.
    pub fn new(study: Uuid, parts: Vec<(Uuid, StudyPart)>) -> Self {
        let now = Now { status: StudyStatus::Queued, told: Vec::new(), steps: Vec::new(), runs_done: 0 };
        Self { study, parts, now: Mutex::new(now) }
    }

    /// Returns the id of the newest event, and the state of the study.
    pub fn newest_with_status(&self) -> (i64, StudyStatus) {
        let now = self.lock();
        (now.told.len() as i64, now.status)
    }

    /// Returns at most `most` starts and ends after an id.
    pub fn told_after(&self, after: i64, most: usize) -> Vec<SentEvent> {
        self.lock().told.iter().skip(after.unsigned_abs() as usize).take(most).cloned().collect()
    }

    /// Adds the starts and ends since the last call, and returns their events.
    pub fn take(&self, progress: &StudyProgress) -> Vec<SentEvent> {
        let heads = heads(progress);
        let mut now = self.lock();
        let told = now.told.len();
        // deleted jobs count as ended, as in the study's resource
        let mut done = self.parts.len() - heads.len();
        for step in &progress.steps {
            done += usize::from(step.ended.is_some());
            if now.steps.contains(step) {
                continue;
            }
            now.steps.push(*step);
            let (Some(head), Some(part)) = (heads.get(&step.job), self.part(step.job)) else { continue };
            let mut job = StudyJob::new(step.job, part, Some(head));
            job.status = Some(step.ended.unwrap_or(JobStatus::Running));
            job.stopped_by = job.stopped_by.filter(|_| step.ended.is_some());
            let event = StudyEvent {
                job: Some(job),
                progress: step.ended.map(|_| head.progress),
                ..self.event(StudyStatus::Running, done)
            };
            now.tell(if step.ended.is_some() { ENDED } else { STARTED }, &event);
        }
        let was_final = now.status.is_final();
        let jobs = self.parts.iter().map(|(id, part)| StudyJob::new(*id, part, heads.get(id).copied()));
        now.status = StudyStatus::of(&jobs.collect::<Vec<_>>());
        if now.status.is_final() && !was_final {
            let status = now.status;
            now.tell(status.name(), &self.event(status, self.parts.len()));
            now.told.last_mut().into_iter().for_each(|last| last.is_final = true);
        }
        now.told[told..].to_vec()
    }

    /// Creates an event that reports the study as it is, and none of its jobs.
    pub fn as_event(&self) -> StudyEvent {
        let now = self.lock();
        self.event(now.status, now.runs_done)
    }

    /// Creates the event of a pass of a job that runs, which is sent live only.
    pub fn pass(&self, progress: &StudyProgress, of: Uuid) -> Option<SentEvent> {
        let heads = heads(progress);
        let (head, part) = (*heads.get(&of)?, self.part(of)?);
        let ended = progress.steps.iter().filter(|step| step.ended.is_some()).count();
        let event = StudyEvent {
            job: Some(StudyJob::new(of, part, Some(head))),
            progress: Some(head.progress),
            ..self.event(StudyStatus::Running, self.parts.len() - heads.len() + ended)
        };
        Some(SentEvent::new(None, PASS, &event))
    }

    /// Returns the part of a job in the study; `None` if it is no job of the study.
    pub fn part(&self, job: Uuid) -> Option<&StudyPart> {
        self.parts.iter().find(|(id, _)| *id == job).map(|(_, part)| part)
    }

    fn event(&self, status: StudyStatus, runs_done: usize) -> StudyEvent {
        let table = format!("/v1/studies/{}/files/study.csv", self.study);
        StudyEvent { status, runs: self.parts.len(), runs_done, job: None, progress: None, table }
    }

    fn lock(&self) -> MutexGuard<'_, Now> {
        // events are added last
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Now {
    /// Adds an event with the next id.
    fn tell(&mut self, name: &str, event: &StudyEvent) {
        self.runs_done = event.runs_done;
        self.told.push(SentEvent::new(Some(self.told.len() as i64 + 1), name, event));
    }
}

fn heads(progress: &StudyProgress) -> HashMap<Uuid, &JobHead> {
    progress.jobs.iter().map(|head| (head.id, head)).collect()
}

/// Name of the event of a job that has started.
pub const STARTED: &str = "started";
/// Name of the event of a job that has done a pass.
pub const PASS: &str = "pass";
/// Name of the event sent when events that were sent before are lost; it is followed by the last event that there is.
pub const RESTARTED: &str = "restarted";
/// Name of the event of a job that has ended.
pub const ENDED: &str = "ended";

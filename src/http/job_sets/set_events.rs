//! Events of a set of jobs, which follow from the starts, passes and ends of its jobs.

use std::collections::HashMap;
use std::sync::{Mutex, MutexGuard, PoisonError};

use serde::Serialize;
use uuid::Uuid;

use crate::engine::progress::Progress;
use crate::http::watched::SentEvent;
use crate::queue::store::{JobHead, JobStatus, SetProgress, SetStep};

/// Name of the event of a job that has started.
pub const STARTED: &str = "started";
/// Name of the event of a job that has done a pass.
pub const PASS: &str = "pass";
/// Name of the event sent when events that were sent before are lost; it is followed by the last event that there is.
pub const RESTARTED: &str = "restarted";
/// Name of the event of a job that has ended.
pub const ENDED: &str = "ended";

/// State of a set, which follows from the states of its jobs.
pub trait SetStatus: Copy + Send + Sync + 'static {
    /// State before any job has begun.
    const QUEUED: Self;
    /// State in which some jobs have begun, and not all have ended.
    const RUNNING: Self;

    /// Returns the name in JSON, which for a final state is also the name of the event that ends the stream.
    fn name(self) -> &'static str;

    /// True once all jobs have ended.
    fn is_final(self) -> bool;
}

/// View of a kind on its sets: their states, and the form of their events. Jobs are named by their places in the set.
pub trait SetView: Send + Sync + 'static {
    /// State of such a set.
    type Status: SetStatus;
    /// Data of its events.
    type Event: Serialize;

    /// Derives the state of the set from its jobs, in their order; a job that was deleted is `None`.
    fn status(&self, jobs: &[Option<&JobHead>]) -> Self::Status;

    /// Describes a moment of the set.
    fn event(&self, moment: Moment<'_, Self::Status>) -> Self::Event;
}

/// Moment of a set that an event reports.
pub struct Moment<'a, S> {
    /// Id of the set.
    pub set: Uuid,
    /// State of the set.
    pub status: S,
    /// Number of jobs of the set.
    pub total: usize,
    /// Number of its jobs that had ended.
    pub ended: usize,
    /// Job that is reported, by its place and in its state at the time; `None` where the set alone is.
    pub job: Option<(usize, &'a JobHead)>,
    /// Progress of that job; `None` where it has just started.
    pub progress: Option<Progress>,
}

/// Events of a set up to now.
pub struct SetEvents<V: SetView> {
    /// Id of the set.
    pub set: Uuid,
    members: Vec<Uuid>,
    view: V,
    now: Mutex<Now<V::Status>>,
}

/// Present state of a set that is followed.
struct Now<S> {
    status: S,
    /// Starts and ends of the set's jobs, and the end of the set; their ids count 1, 2, 3 ... in this order.
    told: Vec<SentEvent>,
    /// Steps reported in `told`; those of jobs that were deleted meanwhile stay.
    steps: Vec<SetStep>,
    /// Number of jobs that had ended at the last event.
    ended: usize,
}

impl<V: SetView> SetEvents<V> {
    /// Creates a set of these jobs, none of which has started.
    pub fn new(set: Uuid, members: Vec<Uuid>, view: V) -> Self {
        let now = Now { status: V::Status::QUEUED, told: Vec::new(), steps: Vec::new(), ended: 0 };
        Self { set, members, view, now: Mutex::new(now) }
    }

    /// Returns the id of the newest event, and true if no event can come after it.
    pub fn newest_event(&self) -> (i64, bool) {
        let now = self.lock();
        (now.told.len() as i64, now.status.is_final())
    }

    /// Returns at most `most` starts and ends after an id.
    pub fn told_after(&self, after: i64, most: usize) -> Vec<SentEvent> {
        self.lock().told.iter().skip(after.unsigned_abs() as usize).take(most).cloned().collect()
    }

    /// Adds the starts and ends since the last call, and returns their events.
    pub fn take(&self, progress: &SetProgress) -> Vec<SentEvent> {
        let heads = heads(progress);
        let mut now = self.lock();
        let told = now.told.len();
        // deleted jobs count as ended, as in the set's resource
        let mut ended = self.members.len() - heads.len();
        for step in &progress.steps {
            ended += usize::from(step.ended.is_some());
            if now.steps.contains(step) {
                continue;
            }
            now.steps.push(*step);
            let (Some(head), Some(place)) = (heads.get(&step.job), self.place(step.job)) else { continue };
            let status = step.ended.unwrap_or(JobStatus::Running);
            let stopped_by = head.stopped_by.filter(|_| step.ended.is_some());
            let then = JobHead { status, stopped_by, ..(*head).clone() };
            let progress = step.ended.map(|_| head.progress);
            let event = self.event(V::Status::RUNNING, ended, Some((place, &then)), progress);
            now.tell(if step.ended.is_some() { ENDED } else { STARTED }, &event, ended);
        }
        let was_final = now.status.is_final();
        let jobs: Vec<_> = self.members.iter().map(|id| heads.get(id).copied()).collect();
        now.status = self.view.status(&jobs);
        if now.status.is_final() && !was_final {
            let (status, total) = (now.status, self.members.len());
            now.tell(status.name(), &self.event(status, total, None, None), total);
            now.told.last_mut().into_iter().for_each(|last| last.is_final = true);
        }
        now.told[told..].to_vec()
    }

    /// Creates an event that reports the set as it is, and none of its jobs.
    pub fn as_event(&self) -> V::Event {
        let now = self.lock();
        self.event(now.status, now.ended, None, None)
    }

    /// Creates the event of a pass of a job that runs, which is sent live only.
    pub fn pass(&self, progress: &SetProgress, of: Uuid) -> Option<SentEvent> {
        let heads = heads(progress);
        let (head, place) = (*heads.get(&of)?, self.place(of)?);
        let ended = progress.steps.iter().filter(|step| step.ended.is_some()).count();
        let ended = self.members.len() - heads.len() + ended;
        let event = self.event(V::Status::RUNNING, ended, Some((place, head)), Some(head.progress));
        Some(SentEvent::new(None, PASS, &event))
    }

    /// True for a job of the set.
    pub fn has(&self, job: Uuid) -> bool {
        self.place(job).is_some()
    }

    fn place(&self, job: Uuid) -> Option<usize> {
        self.members.iter().position(|id| *id == job)
    }

    fn event(
        &self,
        status: V::Status,
        ended: usize,
        job: Option<(usize, &JobHead)>,
        progress: Option<Progress>,
    ) -> V::Event {
        self.view.event(Moment { set: self.set, status, total: self.members.len(), ended, job, progress })
    }

    fn lock(&self) -> MutexGuard<'_, Now<V::Status>> {
        // events are added last
        self.now.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<S> Now<S> {
    /// Adds an event with the next id.
    fn tell(&mut self, name: &str, event: &impl Serialize, ended: usize) {
        self.ended = ended;
        self.told.push(SentEvent::new(Some(self.told.len() as i64 + 1), name, event));
    }
}

fn heads(progress: &SetProgress) -> HashMap<Uuid, &JobHead> {
    progress.jobs.iter().map(|head| (head.id, head)).collect()
}

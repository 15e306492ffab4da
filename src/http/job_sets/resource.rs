//! Sets of jobs in the form of JSON answers.

use std::collections::HashMap;

use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::set_events::{Moment, SetStatus, SetView};
use crate::engine::progress::{Progress, StoppedBy};
use crate::queue::store::*;

/// Set of jobs with the state of each.
#[derive(Serialize, ToSchema)]
pub struct JobSetResource {
    #[serde(flatten)]
    pub summary: JobSetSummary,
    /// Jobs in the order in which they were posted.
    pub jobs: Vec<SetJob>,
}

/// A set of jobs in a list.
#[derive(Serialize, ToSchema)]
pub struct JobSetSummary {
    pub id: Uuid,
    /// Name of the set, as it was posted.
    pub name: Option<String>,
    pub status: JobSetStatus,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    /// Number of jobs.
    pub total: usize,
    /// Number of jobs that have ended, deleted ones included.
    pub ended: usize,
    pub counts: JobCounts,
    pub links: JobSetLinks,
}

/// State of a set of jobs, which follows from the states of its jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobSetStatus {
    /// No job of it has begun.
    Queued,
    /// Some of its jobs have begun, and not all have ended.
    Running,
    /// All of its jobs have ended; `counts` says how.
    Finished,
}

/// Numbers of the jobs of a set by their states.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, ToSchema)]
pub struct JobCounts {
    pub queued: usize,
    pub running: usize,
    pub succeeded: usize,
    pub failed: usize,
    pub cancelled: usize,
    /// Jobs that were deleted alone.
    pub deleted: usize,
}

/// A job of a set.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct SetJob {
    /// Place of the job among those of the set, from 0.
    pub index: usize,
    pub id: Uuid,
    /// Name of the job, from its document; null where it was deleted.
    pub name: Option<String>,
    /// State of the job; null where it was deleted.
    pub status: Option<JobStatus>,
    /// Reason why the job ended.
    pub stopped_by: Option<StoppedBy>,
    /// Progress of the job; null where it was deleted, and in the event of its start.
    pub progress: Option<Progress>,
    /// Path of the job.
    pub link: String,
}

/// Paths of the resources that belong to a set of jobs.
#[derive(Serialize, ToSchema)]
pub struct JobSetLinks {
    #[serde(rename = "self")]
    pub this: String,
    /// Path of the stream of the set's events.
    pub events: String,
    pub cancel: String,
}

/// Data of an event of a set of jobs.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct JobSetEvent {
    /// State of the set.
    pub status: JobSetStatus,
    /// Number of jobs.
    pub total: usize,
    /// Number of jobs that had ended at the time of the event.
    pub ended: usize,
    /// Job that the event reports, in its state at the time; null for `restarted` and for `finished`.
    pub job: Option<SetJob>,
}

impl JobSetResource {
    /// Describes a set with the heads of its jobs that were not deleted.
    pub fn new(set: &JobSet, heads: &HashMap<Uuid, JobHead>) -> Self {
        let jobs = set.members.iter().enumerate();
        let jobs = jobs.map(|(index, member)| SetJob::new(index, member.job, heads.get(&member.job)));
        Self { summary: JobSetSummary::new(set, heads), jobs: jobs.collect() }
    }
}

impl JobSetSummary {
    /// Summarises a set from the heads of its jobs that were not deleted.
    pub fn new(set: &JobSet, heads: &HashMap<Uuid, JobHead>) -> Self {
        let counts = JobCounts::of(set.members.iter().map(|member| heads.get(&member.job)));
        let this = format!("/v1/job_sets/{}", set.id);
        Self {
            id: set.id,
            name: set.name.clone(),
            status: counts.status(),
            created_at: Timestamp::from_millisecond(set.created_at).ok(),
            total: set.members.len(),
            ended: counts.ended(),
            counts,
            links: JobSetLinks { events: format!("{this}/events"), cancel: format!("{this}/cancel"), this },
        }
    }
}

impl JobCounts {
    /// Counts jobs; `None` stands for one that was deleted.
    fn of<'a>(jobs: impl Iterator<Item = Option<&'a JobHead>>) -> Self {
        let mut counts = Self::default();
        for job in jobs {
            *match job.map(|head| head.status) {
                Some(JobStatus::Queued) => &mut counts.queued,
                Some(JobStatus::Running) => &mut counts.running,
                Some(JobStatus::Succeeded) => &mut counts.succeeded,
                Some(JobStatus::Failed) => &mut counts.failed,
                Some(JobStatus::Cancelled) => &mut counts.cancelled,
                None => &mut counts.deleted,
            } += 1;
        }
        counts
    }

    fn ended(self) -> usize {
        self.succeeded + self.failed + self.cancelled + self.deleted
    }

    fn status(self) -> JobSetStatus {
        match (self.queued, self.running, self.ended()) {
            (0, 0, _) => JobSetStatus::Finished,
            (_, 0, 0) => JobSetStatus::Queued,
            _ => JobSetStatus::Running,
        }
    }
}

impl SetJob {
    fn new(index: usize, id: Uuid, head: Option<&JobHead>) -> Self {
        Self {
            index,
            id,
            name: head.and_then(|head| head.name.clone()),
            status: head.map(|head| head.status),
            stopped_by: head.and_then(|head| head.stopped_by),
            progress: head.map(|head| head.progress),
            link: format!("/v1/jobs/{id}"),
        }
    }
}

impl SetStatus for JobSetStatus {
    const QUEUED: Self = Self::Queued;
    const RUNNING: Self = Self::Running;

    fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Finished => "finished",
        }
    }

    fn is_final(self) -> bool {
        self == Self::Finished
    }
}

/// View on sets of jobs that are for themselves.
pub struct JobsView;

impl SetView for JobsView {
    type Status = JobSetStatus;
    type Event = JobSetEvent;

    fn status(&self, jobs: &[Option<&JobHead>]) -> JobSetStatus {
        JobCounts::of(jobs.iter().copied()).status()
    }

    fn event(&self, moment: Moment<'_, JobSetStatus>) -> JobSetEvent {
        let Moment { status, total, ended, job, progress, .. } = moment;
        let job = job.map(|(index, head)| SetJob { progress, ..SetJob::new(index, head.id, Some(head)) });
        JobSetEvent { status, total, ended, job }
    }
}

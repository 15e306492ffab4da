//! Sets of jobs in a store: jobs that are posted, followed, cancelled and deleted together.

use serde_json::Value;
use uuid::Uuid;

use super::new_members::NewMembers;
use super::owner::Owner;
use super::records::{JobHead, JobStatus, MostWaiting};

/// Purpose of a set of jobs. Each kind has its own routes and its own keys of requests.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SetKind {
    /// Jobs that somebody has posted together.
    Jobs,
    /// Jobs that are compared with each other.
    Study,
}

impl SetKind {
    /// Returns the name in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::Jobs => "jobs",
            Self::Study => "study",
        }
    }

    /// Finds the kind with this name; `None` for any other word.
    pub fn from_name(name: &str) -> Option<Self> {
        [Self::Jobs, Self::Study].into_iter().find(|kind| kind.name() == name)
    }

    /// Returns the name in sentences.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Jobs => "job set",
            Self::Study => "study",
        }
    }
}

/// Set of jobs to be queued together.
pub struct NewJobSet {
    /// Owner of the set and its jobs.
    pub owner: Owner,
    /// Purpose of the set.
    pub kind: SetKind,
    /// Name, free text.
    pub name: Option<String>,
    /// Data that the kind keeps beside the jobs, as JSON.
    pub about: String,
    /// Header `Idempotency-Key` of the request; a key of an owner names one body of each kind.
    pub idempotency_key: Option<String>,
    /// Hash of the canonical body, which distinguishes a repeated request from a reused key.
    pub body_hash: String,
    /// Client that posted the set.
    pub client: String,
    /// Ids of the uploaded files that the jobs name.
    pub uploads: Vec<String>,
    /// Jobs in their order.
    pub jobs: NewMembers,
}

/// Bounds of the jobs of a set.
pub struct SetBounds {
    /// Largest numbers of jobs that may wait.
    pub most: MostWaiting,
    /// Bytes that one job may take at its peak.
    pub memory_bytes: u64,
    /// Largest `stop.max_seconds` of a job.
    pub most_seconds: f64,
}

/// Set of jobs as it is stored.
#[derive(Clone, Debug)]
pub struct JobSet {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Purpose of the set.
    pub kind: SetKind,
    /// Name, free text.
    pub name: Option<String>,
    /// Data that the kind keeps beside the jobs, as JSON.
    pub about: String,
    /// Hash of the canonical body.
    pub body_hash: String,
    /// Time at which the set was posted, in milliseconds since 1970.
    pub created_at: i64,
    /// Jobs of the set in the order in which they were queued.
    pub members: Vec<SetMember>,
}

/// Job of a set.
#[derive(Clone, Debug)]
pub struct SetMember {
    /// Id of the job.
    pub job: Uuid,
    /// Purpose of the job in the set, by its kind.
    pub part: Value,
    /// Results that the set has extracted from the job; `None` before that was done after the job's end.
    pub found: Option<Value>,
}

/// Progress of the jobs of a set at one moment.
pub struct SetProgress {
    /// Jobs of the set that were not deleted, oldest first.
    pub jobs: Vec<JobHead>,
    /// Starts and ends of the jobs, in order.
    pub steps: Vec<SetStep>,
}

/// Start or end of a job of a set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SetStep {
    /// Id of the job.
    pub job: Uuid,
    /// State in which the job ended; `None` where it has started.
    pub ended: Option<JobStatus>,
}

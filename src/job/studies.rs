//! What a store knows of studies: which jobs belong together, and what each is for.

use serde_json::Value;
use uuid::Uuid;

use super::records::{JobHead, JobStatus, NewJob};

/// Jobs to be queued together.
pub struct NewStudy {
    /// Free text of the job's document.
    pub name: Option<String>,
    /// The request as understood, defaults filled in.
    pub request: Value,
    /// The methods that refuse the job, with their reasons.
    pub refused: Value,
    /// Confidence of its errors and intervals.
    pub confidence: f64,
    /// Header `Idempotency-Key` of the request; a key names one body.
    pub idempotency_key: Option<String>,
    /// Hash of the canonical body, which tells a repetition from a reuse of the key.
    pub body_hash: String,
    /// The jobs in their order, each with the part that it has in the study.
    pub jobs: Vec<(Value, NewJob)>,
}

/// A study as it is stored.
#[derive(Clone, Debug)]
pub struct StoredStudy {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Free text of the job's document.
    pub name: Option<String>,
    /// The request as understood.
    pub request: Value,
    /// The methods that refuse the job, with their reasons.
    pub refused: Value,
    /// Confidence of its errors and intervals.
    pub confidence: f64,
    /// Hash of the canonical body.
    pub body_hash: String,
    /// When it was posted, in milliseconds since 1970.
    pub created_at: i64,
    /// Its jobs by their ids, in the order in which they were queued, each with the part that it has in the study.
    pub parts: Vec<(Uuid, Value)>,
}

/// What became of a study that was to be queued.
pub enum StudySubmission {
    /// All of its jobs wait.
    New(StoredStudy),
    /// The key was used before with the same body.
    Repeated(StoredStudy),
    /// The key was used before with another body.
    KeyReused,
    /// There is no room for all of its jobs; none waits.
    QueueFull,
    /// A mesh of the job was deleted meanwhile.
    MeshGone(String),
}

/// How far the jobs of a study are, at one moment.
pub struct StudyProgress {
    /// Its jobs that were not deleted, oldest first.
    pub jobs: Vec<JobHead>,
    /// What happened to them, in order.
    pub steps: Vec<StudyStep>,
}

/// A job of a study has started or ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StudyStep {
    /// Id of the job.
    pub job: Uuid,
    /// The state in which it ended; `None` where it has started.
    pub ended: Option<JobStatus>,
}

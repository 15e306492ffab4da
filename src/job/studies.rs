//! What a store knows of studies: which jobs belong together, and what each is for.

use std::ops::Range;

use serde_json::Value;
use uuid::Uuid;

use super::records::{JobHead, JobStatus};
use super::shared_fields::{OwnFields, SharedFields};
use crate::document::Warning;
use crate::document::result::Known;

/// Jobs to be queued together.
pub struct NewStudy {
    /// Free text of the job's document.
    pub name: Option<String>,
    /// The request as understood, defaults filled in, JSON.
    pub request: String,
    /// The methods that refuse the job, with their reasons.
    pub refused: Value,
    /// Confidence of its errors and intervals.
    pub confidence: f64,
    /// Header `Idempotency-Key` of the request; a key names one body.
    pub idempotency_key: Option<String>,
    /// Hash of the canonical body, which tells a repetition from a reuse of the key.
    pub body_hash: String,
    /// Who posted it.
    pub client: String,
    /// Uploaded meshes that the jobs name.
    pub meshes: Vec<String>,
    /// What the documents of the jobs have in common as they are posted.
    pub submitted: SharedFields,
    /// What they have in common as they are understood.
    pub document: SharedFields,
    /// What the plans of the jobs have in common.
    pub plan: SharedFields,
    /// The jobs in their order.
    pub jobs: Vec<NewStudyJob>,
}

/// A job to be queued with a study; the fields of its own are those of [`super::records::NewJob`] without what the study has.
#[derive(Clone)]
pub struct NewStudyJob {
    /// The part that it has in the study.
    pub part: Value,
    /// Its document as it would be posted.
    pub submitted: OwnFields,
    /// Its document as understood, defaults filled in.
    pub document: OwnFields,
    /// What is simulated and what is not, and why.
    pub plan: OwnFields,
    /// What is known of the results before the first pass.
    pub known: Known,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Passes of chunk 0.
    pub first_chunk: Range<u64>,
}

/// A study as it is stored.
#[derive(Clone, Debug)]
pub struct StoredStudy {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Free text of the job's document.
    pub name: Option<String>,
    /// The request as understood, JSON.
    pub request: String,
    /// The methods that refuse the job, with their reasons.
    pub refused: Value,
    /// Confidence of its errors and intervals.
    pub confidence: f64,
    /// Hash of the canonical body.
    pub body_hash: String,
    /// When it was posted, in milliseconds since 1970.
    pub created_at: i64,
    /// Its jobs in the order in which they were queued.
    pub jobs: Vec<StudyMember>,
}

/// A job of a study.
#[derive(Clone, Debug)]
pub struct StudyMember {
    /// Id of the job.
    pub job: Uuid,
    /// The part that it has in the study.
    pub part: Value,
    /// What its results are to the study; `None` before somebody has looked after its end.
    pub found: Option<Value>,
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
    /// With all of its jobs, more of its client would wait than may; none waits.
    ClientFull,
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

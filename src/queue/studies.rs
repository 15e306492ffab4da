//! Studies in a store: the jobs that belong together, and the part of each.

use std::ops::Range;

use serde_json::Value;
use uuid::Uuid;

use super::owner::Owner;
use super::records::{JobHead, JobStatus};
use super::shared_fields::{OwnFields, SharedFields};
use crate::document::Warning;
use crate::document::result::Known;

/// Study: jobs to be queued together.
pub struct NewStudy {
    /// Owner of the study and its jobs.
    pub owner: Owner,
    /// Name in the job's document, free text.
    pub name: Option<String>,
    /// Request with all defaults filled in, as JSON.
    pub request: String,
    /// Methods that refuse the job, with their reasons.
    pub refused: Value,
    /// Confidence of its errors and intervals.
    pub confidence: f64,
    /// Header `Idempotency-Key` of the request; a key of an owner names one body.
    pub idempotency_key: Option<String>,
    /// Hash of the canonical body, which distinguishes a repeated request from a reused key.
    pub body_hash: String,
    /// Client that posted the study.
    pub client: String,
    /// Ids of the uploaded files that the jobs name.
    pub uploads: Vec<String>,
    /// Fields that the documents of the jobs have in common as they are posted.
    pub submitted: SharedFields,
    /// Fields that the documents of the jobs have in common with defaults filled in.
    pub document: SharedFields,
    /// Fields that the plans of the jobs have in common.
    pub plan: SharedFields,
    /// Jobs in their order.
    pub jobs: Vec<NewStudyJob>,
}

/// Job to be queued with a study; its own fields are those of [`super::records::NewJob`] without those of the study.
#[derive(Clone)]
pub struct NewStudyJob {
    /// Part of the job in the study.
    pub part: Value,
    /// Document of the job as it would be posted.
    pub submitted: OwnFields,
    /// Document of the job with all defaults filled in.
    pub document: OwnFields,
    /// Plan: what is simulated and what is not, and why.
    pub plan: OwnFields,
    /// Results that are known before the first pass.
    pub known: Known,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Passes of chunk 0.
    pub first_chunk: Range<u64>,
}

/// Study as it is stored.
#[derive(Clone, Debug)]
pub struct StoredStudy {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Name in the job's document, free text.
    pub name: Option<String>,
    /// Request with all defaults filled in, as JSON.
    pub request: String,
    /// Methods that refuse the job, with their reasons.
    pub refused: Value,
    /// Confidence of its errors and intervals.
    pub confidence: f64,
    /// Hash of the canonical body.
    pub body_hash: String,
    /// Time at which the study was posted, in milliseconds since 1970.
    pub created_at: i64,
    /// Jobs of the study in the order in which they were queued.
    pub jobs: Vec<StudyMember>,
}

/// Job of a study.
#[derive(Clone, Debug)]
pub struct StudyMember {
    /// Id of the job.
    pub job: Uuid,
    /// Part of the job in the study.
    pub part: Value,
    /// Results that the study has extracted from the job; `None` before that was done after the job's end.
    pub found: Option<Value>,
}

/// Outcome of queueing a study.
pub enum StudySubmission {
    /// All jobs of the study wait.
    New(StoredStudy),
    /// The key was used before with the same body.
    Repeated(StoredStudy),
    /// The key was used before with another body.
    KeyReused,
    /// There is no room for all jobs of the study; none waits.
    QueueFull,
    /// With all jobs of the study, more jobs of its client would wait than allowed; none waits.
    ClientFull,
    /// An uploaded file of the jobs was deleted meanwhile.
    UploadGone(String),
}

/// Progress of the jobs of a study at one moment.
pub struct StudyProgress {
    /// Jobs of the study that were not deleted, oldest first.
    pub jobs: Vec<JobHead>,
    /// Starts and ends of the jobs, in order.
    pub steps: Vec<StudyStep>,
}

/// Start or end of a job of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct StudyStep {
    /// Id of the job.
    pub job: Uuid,
    /// State in which the job ended; `None` where it has started.
    pub ended: Option<JobStatus>,
}

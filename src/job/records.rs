//! What a store knows of jobs, their files and meshes: rows, and what becomes of requests to change them.

use std::ops::Range;

use bytes::Bytes;
use serde_json::Value;
use uuid::Uuid;

use super::predictions::Predictions;
use super::progress::{Progress, StoppedBy};
use super::spent::Spent;
use crate::document::Warning;
use crate::document::result::{Known, PlanResult};

/// State of a job, from `queued` to one of the three final ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobStatus {
    /// No chunk of it was claimed yet.
    Queued,
    /// A worker has claimed a chunk of it; between two chunks it stays so.
    Running,
    /// Its rule ended it, and results are there.
    Succeeded,
    /// It ended by a failure, which its problem tells.
    Failed,
    /// Somebody ended it.
    Cancelled,
}

impl JobStatus {
    /// All states, the final ones last.
    pub const ALL: [Self; 5] = [Self::Queued, Self::Running, Self::Succeeded, Self::Failed, Self::Cancelled];

    /// The name in JSON and in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// The state of a name; `None` for any other word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.name() == name)
    }

    /// A final status never changes again.
    pub fn is_final(self) -> bool {
        matches!(self, Self::Succeeded | Self::Failed | Self::Cancelled)
    }
}

/// A job without its long fields. Times are milliseconds since 1970.
#[derive(Clone, Debug)]
pub struct JobHead {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Free text of the document.
    pub name: Option<String>,
    /// State of the job.
    pub status: JobStatus,
    /// True once somebody asked to cancel it; the worker may not have heard yet.
    pub cancel_requested: bool,
    /// Passes done, and their cost and accuracy.
    pub progress: Progress,
    /// What ended the job; `None` before its end, and where its passes failed.
    pub stopped_by: Option<StoppedBy>,
    /// Sequence number of the newest event.
    pub last_seq: i64,
    /// When it was posted.
    pub created_at: i64,
    /// When its first chunk was claimed.
    pub started_at: Option<i64>,
    /// When it came to a final state.
    pub finished_at: Option<i64>,
}

/// A job with everything that one who asks for it is told.
#[derive(Clone, Debug)]
pub struct Job {
    /// State, progress and times.
    pub head: JobHead,
    /// The document as understood.
    pub document: Value,
    /// The plan, as JSON.
    pub plan: Value,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Hash of the canonical body.
    pub body_hash: String,
    /// What is known of the results; of a job that ended with passes, all of them in short.
    pub summary: Option<Value>,
    /// What each method would take, as a pilot foretold; `None` where nobody asked.
    pub predictions: Option<Predictions>,
    /// Why it failed; `None` unless it did.
    pub problem: Option<JobProblem>,
}

/// State from which rendering a job goes on.
#[derive(Clone, Debug)]
pub struct JobSource {
    /// The document as it was posted: what [`crate::job::prepare::prepare`] takes.
    pub submitted: String,
    /// Merged state of all ended chunks; `None` before the first one has ended.
    pub state: Option<StateFile>,
    /// Render time of the merged chunks.
    pub merged_spent: Spent,
}

/// Why a job failed.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
pub struct JobProblem {
    /// Short words, the same for all failures of a kind.
    pub title: String,
    /// What happened to this job.
    pub detail: String,
}

/// The merged state of a job as a stored file.
#[derive(Clone, Debug, PartialEq)]
pub struct StateFile {
    /// Key of the file in the object store.
    pub key: String,
    /// blake3 of the content, hexadecimal.
    pub hash: String,
}

/// A job to be queued.
#[derive(Clone)]
pub struct NewJob {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Free text of the document.
    pub name: Option<String>,
    /// The document as it was posted.
    pub submitted: String,
    /// The document as understood, defaults filled in.
    pub document: Value,
    /// What is simulated and what is not, and why.
    pub plan: PlanResult,
    /// What is known of the results before the first pass.
    pub known: Known,
    /// What each method would take, where a pilot was asked.
    pub predictions: Option<Predictions>,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Header `Idempotency-Key` of the request; a key names one body.
    pub idempotency_key: Option<String>,
    /// Hash of the canonical body, which tells a repetition from a reuse of the key.
    pub body_hash: String,
    /// Name of what it computes, equal where results are; `None` where no other job's results are its own.
    pub computation: Option<String>,
    /// Uploaded meshes that the document names.
    pub meshes: Vec<String>,
    /// Passes of chunk 0.
    pub first_chunk: Range<u64>,
    /// Who posted it: clients take turns, and the jobs of each that wait are limited.
    pub client: String,
}

/// Largest numbers of jobs that may wait, beside one that is rendered.
#[derive(Clone, Copy, Debug)]
pub struct MostWaiting {
    /// Jobs of all clients together.
    pub jobs: u64,
    /// Jobs of one client.
    pub of_client: u64,
}

/// What became of a job that was to be queued.
pub enum Submission {
    /// It waits.
    New(Job),
    /// The key was used before with the same body.
    Repeated(Job),
    /// The key was used before with another body.
    KeyReused,
    /// As many jobs wait as may.
    QueueFull,
    /// Refusal of a job whose client has as many waiting as it may.
    ClientFull,
    /// A mesh of the document was deleted meanwhile.
    MeshGone(String),
}

/// Jobs that a list has.
#[derive(Clone, Copy, Debug, Default)]
pub struct JobFilter {
    /// Only jobs in this state.
    pub status: Option<JobStatus>,
    /// Only jobs older than this one.
    pub before: Option<Uuid>,
    /// Largest number of jobs.
    pub limit: u32,
}

/// Ended jobs that are looked for; those of studies are never among them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndedFilter {
    /// Only jobs that ended so; `None`: in any way.
    pub status: Option<JobStatus>,
    /// Only jobs that ended before this time, in milliseconds since 1970.
    pub before: Option<i64>,
    /// Largest number of jobs.
    pub limit: u32,
}

/// A job, or a study, that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Id of the job or study.
    pub id: Uuid,
    /// Time of its end in milliseconds since 1970; of a study that of its last job.
    pub at: i64,
}

/// Something that happened to a job; a job's events are never changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Number within the job, from 1 without gaps.
    pub seq: i64,
    /// Kind of the event, e.g. `pass`.
    pub name: String,
    /// JSON of the kind's schema.
    pub data: Value,
}

/// Names of the events that end a job's stream.
pub fn is_final_event(name: &str) -> bool {
    JobStatus::from_name(name).is_some_and(JobStatus::is_final)
}

/// A stored file of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Artifact {
    /// E.g. `grids/workplane.json`.
    pub name: String,
    /// Key of the file in the object store; empty where the row has the content.
    pub key: String,
    /// blake3 of the content, hexadecimal.
    pub hash: String,
    /// Length in bytes.
    pub size: u64,
    /// Type that the file is served as.
    pub media_type: String,
    /// The content, where the store keeps it beside the name; `None` where it is at the key.
    pub content: Option<Bytes>,
}

impl Artifact {
    /// A file whose content the store keeps itself.
    pub fn in_store(name: String, media_type: &str, content: Bytes) -> Self {
        let hash = blake3::hash(&content).to_hex().to_string();
        let (size, media_type) = (content.len() as u64, media_type.to_owned());
        Self { name, key: String::new(), hash, size, media_type, content: Some(content) }
    }
}

/// An uploaded mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Id of the content: equal files have equal ids.
    pub id: String,
    /// Key of the file in the object store.
    pub key: String,
    /// Length of the file in bytes.
    pub size: u64,
    /// Number of triangles, faces with more corners divided.
    pub triangles: u64,
    /// Names of its materials, in the order of first use.
    pub materials: Vec<String>,
    /// When it was uploaded first, in milliseconds since 1970.
    pub created_at: i64,
}

/// What became of a wish to cancel a job.
#[derive(Clone, Debug, PartialEq)]
pub enum CancelOutcome {
    /// There is no such job.
    NotFound,
    /// Finished before: nothing to cancel.
    Finished(JobStatus),
    /// It ends, or has ended by this.
    Accepted,
}

/// What became of a wish to delete a mesh.
#[derive(Clone, Debug, PartialEq)]
pub enum MeshDeletion {
    /// There is no such mesh.
    NotFound,
    /// A queued or running job uses it.
    InUse,
    /// Gone from the store; its file is at this key.
    Deleted(String),
}

//! Records of jobs, their files and uploads in a store, and the outcomes of requests to change them.

use bytes::Bytes;
use serde_json::Value;
use uuid::Uuid;

use crate::document::Warning;
use crate::document::hbjson::ModelReport;
use crate::document::limits::JOBS_OF_SET;
use crate::document::result::{Known, PlanResult};
use crate::document::weather::WeatherReport;
use crate::engine::progress::{Progress, StoppedBy};
use crate::engine::spent::Spent;
use crate::predict::predictions::Predictions;
use crate::queue::owner::Owner;

/// State of a job, from `queued` to one of the three final ones.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobStatus {
    /// No chunk of the job was claimed yet.
    Queued,
    /// A worker has claimed a chunk of the job; the state stays so between two chunks.
    Running,
    /// The job was ended by its stop rule, and has results.
    Succeeded,
    /// The job ended by a failure, which its problem describes.
    Failed,
    /// A user ended the job.
    Cancelled,
}

impl JobStatus {
    /// All states, the final ones last.
    pub const ALL: [Self; 5] = [Self::Queued, Self::Running, Self::Succeeded, Self::Failed, Self::Cancelled];

    /// Returns the name in JSON and in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// Finds the state with this name; `None` for any other word.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|status| status.name() == name)
    }

    /// True if the state is final: it never changes again.
    pub fn is_final(self) -> bool {
        matches!(self, Self::Succeeded | Self::Failed | Self::Cancelled)
    }
}

/// Job without its long fields. Times are milliseconds since 1970.
#[derive(Clone, Debug)]
pub struct JobHead {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Name of the job, free text from its document.
    pub name: Option<String>,
    /// State of the job.
    pub status: JobStatus,
    /// True once a user has cancelled the job; its worker may not have noticed yet.
    pub cancel_requested: bool,
    /// Passes done, and their cost and accuracy.
    pub progress: Progress,
    /// Reason why the job ended; `None` before its end, and where its passes failed.
    pub stopped_by: Option<StoppedBy>,
    /// Sequence number of the newest event.
    pub last_seq: i64,
    /// Time at which the job was posted.
    pub created_at: i64,
    /// Time at which its first chunk was claimed.
    pub started_at: Option<i64>,
    /// Time at which it came to a final state.
    pub finished_at: Option<i64>,
}

/// Job with everything that is returned to a request for it.
#[derive(Clone, Debug)]
pub struct Job {
    /// State, progress and times.
    pub head: JobHead,
    /// Document with all defaults filled in.
    pub document: Value,
    /// The plan, as JSON.
    pub plan: Value,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Hash of the canonical body.
    pub body_hash: String,
    /// Results that are known so far; of a job that ended with passes, the summary of all of them.
    pub summary: Option<Value>,
    /// Times that each method would take, as a pilot predicted; `None` where none was requested.
    pub predictions: Option<Predictions>,
    /// Reason why the job failed; `None` unless it did.
    pub problem: Option<JobProblem>,
}

/// State from which rendering of a job continues.
#[derive(Clone, Debug)]
pub struct JobSource {
    /// Owner of the job and of the meshes that it uses.
    pub owner: Owner,
    /// Document as it was posted, as [`crate::present::prepared::prepare`] takes it.
    pub submitted: String,
    /// Merged state of all ended chunks; `None` before the first one has ended.
    pub state: Option<StateFile>,
    /// Render time of the merged chunks.
    pub merged_spent: Spent,
}

/// Reason why a job failed.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
pub struct JobProblem {
    /// Short title, the same for all failures of a kind.
    pub title: String,
    /// Details of this job's failure.
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

/// Job to be queued.
#[derive(Clone)]
pub struct NewJob {
    /// Version 7, so that ids ascend with the time of creation.
    pub id: Uuid,
    /// Owner of the job.
    pub owner: Owner,
    /// Name of the job, free text from its document.
    pub name: Option<String>,
    /// Document as it was posted.
    pub submitted: String,
    /// Document with all defaults filled in.
    pub document: Value,
    /// Plan: what is simulated and what is not, and why.
    pub plan: PlanResult,
    /// Results that are known before the first pass.
    pub known: Known,
    /// Times that each method would take, where a pilot was requested.
    pub predictions: Option<Predictions>,
    /// Notes on the document and on its methods.
    pub warnings: Vec<Warning>,
    /// Header `Idempotency-Key` of the request; a key of an owner names one body.
    pub idempotency_key: Option<String>,
    /// Hash of the canonical body, which distinguishes a repeated request from a reused key.
    pub body_hash: String,
    /// Identity of the computation, equal for jobs with equal results; `None` where no other job's results can be used.
    pub computation: Option<String>,
    /// Ids of the uploaded files that the document names.
    pub uploads: Vec<String>,
    /// Client that posted the job: clients take turns, and the number of waiting jobs of each is limited.
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

impl MostWaiting {
    /// Returns the largest number of jobs of one set: all of them must be able to wait, beside one that is rendered.
    pub fn of_set(self) -> usize {
        let waiting = usize::try_from(self.jobs.min(self.of_client)).unwrap_or(usize::MAX);
        waiting.saturating_add(1).min(*JOBS_OF_SET.end())
    }
}

/// Outcome of queueing a job, or a set of jobs.
pub enum Submission<T> {
    /// It waits.
    New(T),
    /// The key was used before with the same body.
    Repeated(T),
    /// Nothing is queued.
    Refused(NotQueued),
}

/// Reason why a job, or a set of jobs, is not queued.
#[derive(Clone, Debug, PartialEq)]
pub enum NotQueued {
    /// The key was used before with another body.
    KeyReused,
    /// With it, more jobs would wait than allowed.
    QueueFull,
    /// With it, more jobs of its client would wait than allowed.
    ClientFull,
    /// An uploaded file of the document was deleted meanwhile.
    UploadGone(String),
}

/// Selection of the jobs of a list.
#[derive(Clone, Copy, Debug, Default)]
pub struct JobFilter {
    /// Only jobs in this state.
    pub status: Option<JobStatus>,
    /// Largest id, not included: only jobs older than this one are listed.
    pub before: Option<Uuid>,
    /// Largest number of jobs.
    pub limit: u32,
}

/// Filter of ended jobs; those of sets never pass it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EndedFilter {
    /// Only jobs that ended with this status; `None`: all that have ended.
    pub status: Option<JobStatus>,
    /// Only jobs that ended before this time, in milliseconds since 1970.
    pub before: Option<i64>,
    /// Largest number of jobs.
    pub limit: u32,
}

/// A job, or a set of jobs, that has ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ended {
    /// Id of the job or set.
    pub id: Uuid,
    /// Time of its end in milliseconds since 1970; of a set that of its last job.
    pub at: i64,
}

/// Event of a job; events are never changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Number within the job, from 1 without gaps.
    pub seq: i64,
    /// Kind of the event, e.g. `pass`.
    pub name: String,
    /// JSON of the kind's schema.
    pub data: Value,
}

/// True for the names of events that end a job's stream.
pub fn is_final_event(name: &str) -> bool {
    JobStatus::from_name(name).is_some_and(JobStatus::is_final)
}

/// A stored file of a job.
#[derive(Clone, Debug, PartialEq)]
pub struct Artifact {
    /// Name, e.g. `grids/workplane.json`.
    pub name: String,
    /// Key of the file in the object store; empty where the row has the content.
    pub key: String,
    /// blake3 of the content, hexadecimal.
    pub hash: String,
    /// Length in bytes.
    pub size: u64,
    /// Media type with which the file is served.
    pub media_type: String,
    /// Content, where the store keeps it beside the name; `None` where it is at the key.
    pub content: Option<Bytes>,
}

impl Artifact {
    /// Makes a file whose content the store keeps itself.
    pub fn in_store(name: String, media_type: &str, content: Bytes) -> Self {
        let hash = blake3::hash(&content).to_hex().to_string();
        let (size, media_type) = (content.len() as u64, media_type.to_owned());
        Self { name, key: String::new(), hash, size, media_type, content: Some(content) }
    }
}

/// Kind of an uploaded file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum UploadKind {
    /// OBJ file.
    Mesh,
    /// EPW or WEA file.
    Weather,
    /// Array of NumPy.
    Array,
    /// Honeybee model.
    Model,
}

impl UploadKind {
    /// Returns the name in the database.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Weather => "weather",
            Self::Array => "array",
            Self::Model => "model",
        }
    }

    /// Returns the name in sentences.
    pub fn noun(self) -> &'static str {
        match self {
            Self::Mesh => "mesh",
            Self::Weather => "weather file",
            Self::Array => "array",
            Self::Model => "model",
        }
    }
}

/// An uploaded file.
#[derive(Clone, Debug, PartialEq)]
pub struct UploadedFile {
    /// Owner of this upload.
    pub owner: Owner,
    /// Id made from the content: equal files have equal ids, also those of different owners.
    pub id: String,
    /// Key of the file in the object store.
    pub key: String,
    /// Length of the file in bytes.
    pub size: u64,
    /// Content of the file in short, by its kind.
    pub about: About,
    /// Time of the first upload, in milliseconds since 1970.
    pub created_at: i64,
}

/// Content of an uploaded file in short.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum About {
    /// Size and materials of a mesh.
    Mesh(AboutMesh),
    /// Report on a weather file.
    Weather(Box<WeatherReport>),
    /// Shape of an array.
    Array(AboutArray),
    /// Rooms of a model.
    Model(ModelReport),
}

impl About {
    /// Returns the kind of the file.
    pub fn kind(&self) -> UploadKind {
        match self {
            Self::Mesh(_) => UploadKind::Mesh,
            Self::Weather(_) => UploadKind::Weather,
            Self::Array(_) => UploadKind::Array,
            Self::Model(_) => UploadKind::Model,
        }
    }
}

/// Size and materials of a mesh.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct AboutMesh {
    /// Number of triangles, after faces with more corners were divided.
    pub triangles: u64,
    /// Names of its materials, in the order of first use.
    pub materials: Vec<String>,
}

/// Shape of an array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct AboutArray {
    /// Number of rows.
    pub rows: u64,
    /// Number of columns.
    pub columns: u64,
}

/// Outcome of a request to cancel a job.
#[derive(Clone, Debug, PartialEq)]
pub enum CancelOutcome {
    /// There is no such job.
    NotFound,
    /// The job had ended before: there is nothing to cancel.
    Finished(JobStatus),
    /// The job ends soon, or this request has ended it.
    Accepted,
}

/// Outcome of a request to delete an uploaded file.
#[derive(Clone, Debug, PartialEq)]
pub enum UploadDeletion {
    /// There is no such file.
    NotFound,
    /// A job needs it: of a mesh one that has not ended, of other files any.
    InUse,
    /// The file is gone from the store; its content is at this key.
    Deleted(String),
}

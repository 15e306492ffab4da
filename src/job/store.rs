//! What the queue, the results and the uploads are kept in: the trait that `db` implements, and its rows.

use std::collections::HashSet;
use std::ops::Range;
use std::time::Duration;

use async_trait::async_trait;
use serde_json::{Map, Value};
use tokio::sync::broadcast;
use uuid::Uuid;

use crate::document::Warning;
use crate::job::progress::{PassReport, Progress, StoppedBy};

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum JobStatus {
    Queued,
    Running,
    Succeeded,
    Failed,
    Cancelled,
}

impl JobStatus {
    pub const ALL: [Self; 5] = [Self::Queued, Self::Running, Self::Succeeded, Self::Failed, Self::Cancelled];

    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Succeeded => "succeeded",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

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
    pub id: Uuid,
    pub name: Option<String>,
    pub status: JobStatus,
    pub cancel_requested: bool,
    pub progress: Progress,
    pub stopped_by: Option<StoppedBy>,
    /// Sequence number of the newest event.
    pub last_seq: i64,
    pub created_at: i64,
    pub started_at: Option<i64>,
    pub finished_at: Option<i64>,
}

#[derive(Clone, Debug)]
pub struct Job {
    pub head: JobHead,
    /// The document as understood.
    pub document: Value,
    pub plan: Value,
    pub warnings: Vec<Warning>,
    /// Hash of the canonical body.
    pub body_hash: String,
    /// What is known of the results; of a job that ended with passes, all of them in short.
    pub summary: Option<Value>,
    pub problem: Option<JobProblem>,
}

/// State from which rendering a job goes on.
#[derive(Clone, Debug)]
pub struct JobSource {
    /// The document as it was posted: what [`crate::job::prepare::prepare`] takes.
    pub submitted: String,
    pub cancel_requested: bool,
    pub state: Option<StateFile>,
    /// Render seconds of the merged chunks.
    pub merged_seconds: f64,
}

/// Why a job failed.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize, utoipa::ToSchema)]
pub struct JobProblem {
    pub title: String,
    pub detail: String,
}

/// The merged state of a job as a stored file.
#[derive(Clone, Debug, PartialEq)]
pub struct StateFile {
    pub key: String,
    pub hash: String,
}

/// A job to be queued.
pub struct NewJob {
    pub name: Option<String>,
    pub submitted: String,
    pub document: Value,
    pub plan: Value,
    /// What is known of the results before the first pass.
    pub known: Map<String, Value>,
    pub warnings: Vec<Warning>,
    pub idempotency_key: Option<String>,
    pub body_hash: String,
    /// Uploaded meshes that the document names.
    pub meshes: Vec<String>,
    /// Passes of chunk 0.
    pub first_chunk: Range<u64>,
}

pub enum Submission {
    New(Job),
    /// The key was used before with the same body.
    Repeated(Job),
    /// The key was used before with another body.
    KeyReused,
    QueueFull,
    /// A mesh of the document was deleted meanwhile.
    MeshGone(String),
}

#[derive(Clone, Copy, Debug, Default)]
pub struct JobFilter {
    pub status: Option<JobStatus>,
    /// Only jobs older than this one.
    pub before: Option<Uuid>,
    pub limit: u32,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    pub seq: i64,
    pub name: String,
    pub data: Value,
}

/// Names of the events that end a job's stream.
pub fn is_final_event(name: &str) -> bool {
    JobStatus::from_name(name).is_some_and(JobStatus::is_final)
}

#[derive(Clone, Debug, PartialEq)]
pub struct Artifact {
    /// E.g. `grids/workplane.json`.
    pub name: String,
    /// Key of the file in the object store.
    pub key: String,
    /// blake3 of the content, hexadecimal.
    pub hash: String,
    pub size: u64,
    pub media_type: String,
}

#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    /// Id of the content: equal files have equal ids.
    pub id: String,
    pub key: String,
    pub size: u64,
    pub triangles: u64,
    pub materials: Vec<String>,
    pub created_at: i64,
}

#[derive(Clone, Debug, PartialEq)]
pub enum CancelOutcome {
    NotFound,
    /// Finished before: nothing to cancel.
    Finished(JobStatus),
    Accepted,
}

#[derive(Clone, Debug, PartialEq)]
pub enum MeshDeletion {
    NotFound,
    /// A queued or running job uses it.
    InUse,
    /// Gone from the store; its file is at this key.
    Deleted(String),
}

/// Processes that may die in a row while they render one chunk without getting further; then its job fails.
pub const MAX_DEATHS: u64 = 3;

/// Which waiting chunk a claim takes. Without wishes: the first chunk of the oldest job that has not begun, else the chunk
/// that has waited longest, so that jobs take turns.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// The job whose turn is not over: its chunk comes first.
    pub stay_with: Option<Uuid>,
    /// Chunks on which more processes have died in a row are left alone for now.
    pub most_deaths: u64,
}

impl Default for Turn {
    fn default() -> Self {
        Self { stay_with: None, most_deaths: MAX_DEATHS }
    }
}

/// What a start took back from the process before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TakenBack {
    /// Chunks that were leased and are ready again.
    pub ready: u64,
    /// Jobs that failed because [`MAX_DEATHS`] processes have died over them.
    pub failed: Vec<Uuid>,
}

/// Record that the store keeps of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StoreRecord {
    /// Shared with the folder of the artifacts; `None` in a new store, and in one from before there were identities.
    pub identity: Option<String>,
    /// The process before this one ended by itself.
    pub ended_well: bool,
    /// About when something was written last, in milliseconds since 1970; 0 in a new store.
    pub newest_write_ms: i64,
    /// Files that were written before are never swept.
    pub sweep_from_ms: i64,
}

/// A claimed chunk of passes. `owner` and `attempt` fence it: once the lease is lost, nothing can be written with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Lease {
    pub job: Uuid,
    pub chunk: u64,
    pub owner: String,
    pub attempt: i64,
    /// Number of times that this chunk has failed before.
    pub failures: u64,
    /// True if there were other chunks to be done when this one was claimed.
    pub others_wait: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beat {
    Keep,
    Cancel,
    Lost,
}

/// Reports of a running chunk, in order.
#[derive(Clone, Debug)]
pub enum Report {
    Pass(PassReport),
    /// A kept progress image.
    Image {
        view: String,
        passes: u64,
        artifact: Artifact,
    },
}

/// Ways in which a chunk ends.
pub enum Completion {
    Continue { state: StateFile, progress: Progress, next_index: u64, next: Range<u64> },
    Finish(Finish),
}

pub struct Finish {
    /// Status of the ended job, one of the final ones.
    pub status: JobStatus,
    pub stopped_by: Option<StoppedBy>,
    /// `None` leaves the progress as it was.
    pub progress: Option<Progress>,
    /// `None` leaves what was known before.
    pub summary: Option<Value>,
    pub problem: Option<JobProblem>,
    pub artifacts: Vec<Artifact>,
    /// The last pass that counts: its row and event are there at the end, however few of the passes before are.
    pub last_pass: Option<PassReport>,
}

#[derive(Clone, Debug, PartialEq)]
pub enum Committed {
    /// `obsolete` are the keys of state files that are no longer needed.
    Yes {
        obsolete: Vec<String>,
    },
    LeaseLost,
}

/// Something changed in the store; a hint to read it again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// There is a chunk to claim.
    Queue,
    /// A job has new events.
    Job(Uuid),
    /// A job shall stop: cancelled or deleted.
    Stop(Uuid),
}

#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    #[error("the store cannot be reached or is busy: {0}")]
    Unavailable(String),
    #[error("the store failed: {0}")]
    Failed(String),
}

/// Jobs, chunks, events, artifacts and meshes, durable. Every method is one transaction.
#[async_trait]
pub trait Store: Send + Sync + 'static {
    /// Hints of what changed, from now on.
    fn changes(&self) -> broadcast::Receiver<Change>;

    /// Proves that the store can be written to, by a write.
    async fn ready(&self) -> Result<(), StoreError>;

    async fn record(&self) -> Result<StoreRecord, StoreError>;
    /// Gives the store its identity from now on.
    async fn set_identity(&self, identity: &str) -> Result<(), StoreError>;
    /// Files that were written before `milliseconds` since 1970 are never swept.
    async fn set_sweep_from(&self, milliseconds: i64) -> Result<(), StoreError>;
    /// A process serves this store, or has ended as it should.
    async fn set_serving(&self, serving: bool) -> Result<(), StoreError>;
    /// Looks for damage in the whole store.
    async fn check(&self) -> Result<(), StoreError>;

    /// Queues a job: its row, its first chunk and the events `queued` and `planned`. At most `max_queued` jobs may wait
    /// behind the one that is rendered.
    async fn submit(&self, job: NewJob, max_queued: u64) -> Result<Submission, StoreError>;
    async fn job_of_key(&self, idempotency_key: &str) -> Result<Option<Job>, StoreError>;
    async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError>;
    async fn job_source(&self, id: Uuid) -> Result<Option<JobSource>, StoreError>;
    async fn job_head(&self, id: Uuid) -> Result<Option<JobHead>, StoreError>;
    /// Jobs that pass the filter, newest first.
    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobHead>, StoreError>;
    async fn count(&self, status: JobStatus) -> Result<u64, StoreError>;
    /// Number of jobs that have not ended.
    async fn unfinished(&self) -> Result<u64, StoreError>;
    /// A job that was never claimed is cancelled at once, any other one by its worker.
    async fn cancel(&self, id: Uuid) -> Result<CancelOutcome, StoreError>;
    /// Deletes a job; true if there was one.
    async fn delete(&self, id: Uuid) -> Result<bool, StoreError>;
    /// Events after sequence number `after`, in order.
    async fn events(&self, id: Uuid, after: i64, limit: u32) -> Result<Vec<Event>, StoreError>;
    /// At most `limit` rows of the convergence table after pass `after`, in order.
    async fn convergence(&self, id: Uuid, after: u64, limit: u32) -> Result<Vec<PassReport>, StoreError>;
    /// About `points` rows of it from the first to the last, evenly spread.
    async fn convergence_outline(&self, id: Uuid, points: u32) -> Result<Vec<PassReport>, StoreError>;
    async fn artifact(&self, id: Uuid, name: &str) -> Result<Option<Artifact>, StoreError>;

    /// Keeps the mesh that is there already when the content was uploaded before.
    async fn add_mesh(&self, mesh: Mesh) -> Result<Mesh, StoreError>;
    async fn mesh(&self, id: &str) -> Result<Option<Mesh>, StoreError>;
    async fn delete_mesh(&self, id: &str) -> Result<MeshDeletion, StoreError>;

    /// A chunk that is ready, whose lease is over, or that this owner had before and did not end.
    async fn claim(&self, owner: &str, lease: Duration, turn: Turn) -> Result<Option<Lease>, StoreError>;
    async fn heartbeat(&self, lease: &Lease, extend: Duration) -> Result<Beat, StoreError>;
    /// Convergence rows, progress and events of a running chunk; `false` when the lease is lost.
    async fn report(&self, lease: &Lease, reports: &[Report]) -> Result<bool, StoreError>;
    /// The chunk is done: its last reports, progress, the next chunk or the job's end, and the event, in one transaction.
    async fn complete(
        &self,
        lease: &Lease,
        reports: &[Report],
        completion: &Completion,
    ) -> Result<Committed, StoreError>;
    /// The job's state is damaged: back to the state before it, or to the first pass, with the event `restarted`.
    async fn rewind(&self, lease: &Lease, reason: &str) -> Result<Committed, StoreError>;
    /// Gives the chunk back undone, without counting a failure.
    async fn release(&self, lease: &Lease) -> Result<(), StoreError>;
    /// Gives the chunk back undone, with a failure counted.
    async fn fail_attempt(&self, lease: &Lease, error: &str) -> Result<(), StoreError>;
    /// At a start, when no other process can have a lease: makes every leased chunk ready again. `died`: the process that
    /// had them did not end by itself, which counts against chunks that got no further in it.
    async fn take_back(&self, died: bool) -> Result<TakenBack, StoreError>;

    /// Keys of the object store that rows point to.
    async fn referenced_keys(&self) -> Result<HashSet<String>, StoreError>;
}

//! Store of the queue, the results and the uploads: the trait that `db` implements, and the types by which chunks are leased, reported and
//! ended.

use std::collections::HashSet;
use std::sync::Arc;
use std::time::Duration;

use async_trait::async_trait;
use serde_json::Value;
use tokio::sync::broadcast;
use uuid::Uuid;

use crate::engine::ahead::RangeAhead;
use crate::engine::progress::{PassReport, Progress, StoppedBy};
pub use crate::queue::ahead::*;
use crate::queue::events::{Pass, Phase};
pub use crate::queue::job_sets::*;
pub use crate::queue::new_members::*;
use crate::queue::owner::Owner;
pub use crate::queue::records::*;

/// Number of processes that may die in a row while they render one chunk without getting further; then its job fails.
pub const MAX_DEATHS: u64 = 3;

/// Number of slices that a job may have in the short lane without an end of its chunk; then it waits for the main lane.
pub const MOST_SLICES: u64 = 3;

/// Preferences of a claim among the waiting chunks. Without any, it takes the first chunk of the oldest job that has not begun, else the
/// chunk that has waited longest, so that jobs take turns.
#[derive(Clone, Copy, Debug)]
pub struct Turn {
    /// Job whose turn is not over: its chunk comes first.
    pub stay_with: Option<Uuid>,
    /// True if a later chunk goes before first ones.
    pub later_first: bool,
    /// True if jobs with fewer slices go first, and those with [`MOST_SLICES`] are left alone.
    pub short: bool,
    /// Number of processes that may have died in a row on a chunk; chunks with more deaths are left alone for now.
    pub most_deaths: u64,
}

impl Default for Turn {
    fn default() -> Self {
        Self { stay_with: None, later_first: false, short: false, most_deaths: MAX_DEATHS }
    }
}

/// Work that a start took back from the process before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TakenBack {
    /// Number of chunks that were leased and are ready again.
    pub ready: u64,
    /// Jobs that failed because [`MAX_DEATHS`] processes have died over them.
    pub failed: Vec<Uuid>,
}

/// Record that the store keeps of itself.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StoreRecord {
    /// Identity shared with the folder of the artifacts; `None` in a new store, and in one from before there were identities.
    pub identity: Option<String>,
    /// True if the process before this one shut down in order.
    pub ended_well: bool,
    /// Time of about the last write, in milliseconds since 1970; 0 in a new store.
    pub newest_write_ms: i64,
    /// Time in milliseconds since 1970; files that were written before it are never deleted as orphans.
    pub sweep_from_ms: i64,
}

/// Claimed chunk of passes. `owner` and `attempt` fence it: once the lease is lost, nothing can be written with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Lease {
    /// Job that the chunk belongs to.
    pub job: Uuid,
    /// Number of the chunk within its job, from 0.
    pub chunk: u64,
    /// Name of the worker that has it.
    pub owner: String,
    /// Number of times that the chunk was claimed, this one included.
    pub attempt: i64,
    /// Number of times that this chunk has failed before.
    pub failures: u64,
    /// Number of slices that the job has had in the short lane without an end of its chunk.
    pub slices: u64,
    /// True if there were other chunks to be done when this one was claimed.
    pub others_wait: bool,
    /// True if a user had cancelled the job by then.
    pub cancel_requested: bool,
}

/// Answer to a heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beat {
    /// The lease is extended: the worker continues.
    Keep,
    /// The lease is extended, but the job shall end.
    Cancel,
    /// Another worker has the chunk, or it is gone: nothing more can be written.
    Lost,
}

/// Reports of a running chunk, in order.
#[derive(Clone, Debug)]
pub enum Report {
    /// Pass with its row of the convergence table and its event, if it is one that is reported.
    Pass(Pass),
    /// Progress image that is kept.
    Image {
        /// Name of the view.
        view: String,
        /// Number of passes that the image shows.
        passes: u64,
        /// File of the image.
        artifact: Artifact,
    },
    /// Phase that begins after the passes.
    Phase(Phase),
}

/// Ways in which a chunk ends.
pub enum Completion {
    /// Another chunk follows.
    Continue {
        /// Merged state of all chunks up to this one.
        state: StateFile,
        /// Progress of the job after the chunk: the next one has the number of its chunks, and begins after its passes.
        progress: Progress,
        /// Ranges of passes that others may compute meanwhile.
        ahead: Vec<RangeAhead>,
    },
    /// The job ends with this chunk.
    Finish(Finish),
}

/// End of a job.
pub struct Finish {
    /// Kind of the end, with its reason and progress.
    pub end: JobEnd,
    /// Summary of the results; `None` leaves the one before.
    pub summary: Option<Value>,
    /// Files of the results.
    pub artifacts: Vec<Artifact>,
    /// Last pass that counts: its row and event are there at the end, however few of the passes before are.
    pub last_pass: Option<Box<Pass>>,
}

impl Finish {
    /// Makes the end of a job that failed for a reason of its own, without results.
    pub fn failed(title: impl Into<String>, detail: impl Into<String>) -> Self {
        let problem = JobProblem { title: title.into(), detail: detail.into() };
        let end = JobEnd::Failed { problem, stopped_by: None, progress: None };
        Self { end, summary: None, artifacts: Vec::new(), last_pass: None }
    }
}

/// Ways in which a job ends.
#[derive(Clone, Debug, PartialEq)]
pub enum JobEnd {
    /// The job has all results.
    Succeeded {
        /// Limit that the job reached.
        stopped_by: StoppedBy,
        /// Progress up to the last pass.
        progress: Progress,
    },
    /// A user stopped the job.
    Cancelled {
        /// Progress up to the last pass.
        progress: Progress,
    },
    /// The job has no results.
    Failed {
        /// Reason of the failure.
        problem: JobProblem,
        /// Limit that the job reached, where it did not fail before.
        stopped_by: Option<StoppedBy>,
        /// Progress; `None` leaves it as it was.
        progress: Option<Progress>,
    },
}

impl JobEnd {
    /// Returns the status of the ended job.
    pub fn status(&self) -> JobStatus {
        match self {
            Self::Succeeded { .. } => JobStatus::Succeeded,
            Self::Cancelled { .. } => JobStatus::Cancelled,
            Self::Failed { .. } => JobStatus::Failed,
        }
    }

    /// Returns the reason why the job ended; `None` where its passes failed.
    pub fn stopped_by(&self) -> Option<StoppedBy> {
        match self {
            Self::Succeeded { stopped_by, .. } => Some(*stopped_by),
            Self::Cancelled { .. } => Some(StoppedBy::Cancelled),
            Self::Failed { stopped_by, .. } => *stopped_by,
        }
    }

    /// Returns the progress up to the last pass; `None` where it stays as it was.
    pub fn progress(&self) -> Option<&Progress> {
        match self {
            Self::Succeeded { progress, .. } | Self::Cancelled { progress } => Some(progress),
            Self::Failed { progress, .. } => progress.as_ref(),
        }
    }

    /// Returns the reason why the job failed, if it did.
    pub fn problem(&self) -> Option<&JobProblem> {
        match self {
            Self::Failed { problem, .. } => Some(problem),
            _ => None,
        }
    }
}

/// Outcome of committing the end of a chunk.
#[derive(Clone, Debug, PartialEq)]
pub enum Committed {
    /// The end is written; `obsolete` are the keys of state files that are no longer needed.
    Yes {
        /// Keys of the files, whose rows are gone with the commit.
        obsolete: Vec<String>,
    },
    /// Another worker has the chunk: nothing was written.
    LeaseLost,
}

/// Change in the store; a hint to read it again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// There is a chunk to claim.
    Queue,
    /// There is a range of passes to claim, or a chunk need not wait for one any more.
    Ahead,
    /// A job has new events.
    Job(Uuid),
    /// A job may have ended: sent before the events that say so.
    Ended(Uuid),
    /// A job shall stop: cancelled or deleted.
    Stop(Uuid),
}

/// Failure of the store, split by what a caller can do.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// Trying again may work.
    #[error("the store cannot be reached or is busy: {0}")]
    Unavailable(String),
    /// Trying again will not help: a row cannot be read, or a query is refused.
    #[error("the store failed: {0}")]
    Failed(String),
}

/// Durable store of jobs, chunks, events, artifacts and uploads. Every method is one transaction. What it writes is durable when it
/// returns, unless it says otherwise or has a lease: what is lost of a worker's claims and reports is done again.
///
/// An opened store sees everything, as worker, retention and start of the service need it. Clients are served by [`Self::of`]: jobs,
/// sets and uploads of other owners are not found there, listed, cancelled or deleted. Counts, chunks, totals and the store's
/// record are those of the whole service anyway. A job takes the results of an equal one of its owner.
#[async_trait]
pub trait Store:
    JobStore + ResultStore + SetStore + UploadStore + ChunkStore + PassesAhead + Send + Sync + 'static
{
    /// Returns this store as one owner sees it.
    fn of(&self, owner: Owner) -> Arc<dyn Store>;
    /// Writes everything out, and releases the store for other processes.
    async fn close(&self);

    /// Returns hints of all changes from now on.
    fn changes(&self) -> broadcast::Receiver<Change>;

    /// Proves that the store can be written to, by a write, which makes everything that was committed before durable.
    async fn ready(&self) -> Result<(), StoreError>;

    /// Keeps some space of the disk for the start, cancellations and deletions on a full disk, which use it when there is none.
    async fn keep_reserve(&self) -> Result<(), StoreError>;

    /// Reads the record that the store keeps of itself.
    async fn record(&self) -> Result<StoreRecord, StoreError>;
    /// Gives the store its identity from now on.
    async fn set_identity(&self, identity: &str) -> Result<(), StoreError>;
    /// Protects files that were written before `milliseconds` since 1970 from deletion as orphans.
    async fn set_sweep_from(&self, milliseconds: i64) -> Result<(), StoreError>;
    /// Records that a process serves this store, or has ended as it should.
    async fn set_serving(&self, serving: bool) -> Result<(), StoreError>;
    /// Looks for damage in the whole store.
    async fn check(&self) -> Result<(), StoreError>;
}

/// Jobs of a [`Store`].
#[async_trait]
pub trait JobStore {
    /// Queues a job: its row, its first chunk and the events `queued` and `planned`. At most `most` jobs may wait behind the one that is
    /// rendered. The new job is buffered: its readers wait until it is durable, as [`Self::sync`] does.
    async fn submit(&self, job: NewJob, most: MostWaiting) -> Result<Submission<Job>, StoreError>;
    /// Returns once everything that was written of a job is durable. Nothing that its [`ChunkStore::complete`] made obsolete may be deleted
    /// before.
    async fn sync(&self, job: Uuid) -> Result<(), StoreError>;
    /// Finds the job that was posted with this key; `None` if there is none, or no more.
    async fn job_of_key(&self, idempotency_key: &str) -> Result<Option<Job>, StoreError>;
    /// Finds a job that has ended and whose results are those of this one, since their documents are equal; `None` if there is none.
    async fn ended_equal(&self, id: Uuid) -> Result<Option<Uuid>, StoreError>;
    /// Reads a job by its id; `None` if there is none.
    async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError>;
    /// Reads the state from which rendering of a job continues; `None` if there is no such job.
    async fn job_source(&self, id: Uuid) -> Result<Option<JobSource>, StoreError>;
    /// Reads a job without its long fields; `None` if there is none.
    async fn job_head(&self, id: Uuid) -> Result<Option<JobHead>, StoreError>;
    /// Lists the jobs that pass the filter, newest first.
    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobHead>, StoreError>;
    /// Counts the jobs in a state.
    async fn count(&self, status: JobStatus) -> Result<u64, StoreError>;
    /// Counts the jobs that have not ended.
    async fn unfinished(&self) -> Result<u64, StoreError>;
    /// Counts the jobs of a client that have not ended.
    async fn unfinished_of(&self, client: &str) -> Result<u64, StoreError>;
    /// Cancels a job: at once if it was never claimed, otherwise through its worker.
    async fn cancel(&self, id: Uuid) -> Result<CancelOutcome, StoreError>;
    /// Deletes a job; true if there was one.
    async fn delete(&self, id: Uuid) -> Result<bool, StoreError>;
    /// Returns single jobs that have ended, the earliest end first.
    async fn ended_jobs(&self, filter: EndedFilter) -> Result<Vec<Ended>, StoreError>;
}

/// Events, passes and files of the jobs of a [`Store`].
#[async_trait]
pub trait ResultStore {
    /// Reads at most `limit` events after sequence number `after`, in order.
    async fn events(&self, id: Uuid, after: i64, limit: u32) -> Result<Vec<Event>, StoreError>;
    /// Reads at most `limit` rows of the convergence table after pass `after`, in order.
    async fn convergence(&self, id: Uuid, after: u64, limit: u32) -> Result<Vec<PassReport>, StoreError>;
    /// Reads about `points` rows of the convergence table from the first to the last, evenly spread.
    async fn convergence_outline(&self, id: Uuid, points: u32) -> Result<Vec<PassReport>, StoreError>;
    /// Finds a file of a job by its name; `None` if the job has none of this name.
    async fn artifact(&self, id: Uuid, name: &str) -> Result<Option<Artifact>, StoreError>;
    /// Lists all files of a job.
    async fn artifacts(&self, id: Uuid) -> Result<Vec<Artifact>, StoreError>;
    /// Returns the bytes of the files of all jobs, wherever they are kept.
    async fn stored_bytes(&self) -> Result<u64, StoreError>;
    /// Returns the keys of the object store that rows point to.
    async fn referenced_keys(&self) -> Result<HashSet<String>, StoreError>;
}

/// Sets of jobs of a [`Store`].
#[async_trait]
pub trait SetStore {
    /// Queues all jobs of a set behind the first chunks of other jobs, or none of them; at most `most` jobs may wait.
    async fn submit_set(&self, set: NewJobSet, most: MostWaiting) -> Result<Submission<JobSet>, StoreError>;
    /// Finds the set of a kind that was posted with this key; `None` if there is none, or no more.
    async fn set_of_key(&self, kind: SetKind, idempotency_key: &str) -> Result<Option<JobSet>, StoreError>;
    /// Reads a set of any kind by its id; `None` if there is none.
    async fn job_set(&self, id: Uuid) -> Result<Option<JobSet>, StoreError>;
    /// Lists the ids of at most `limit` sets of a kind older than `before`, newest first.
    async fn job_sets(&self, kind: SetKind, before: Option<Uuid>, limit: u32) -> Result<Vec<Uuid>, StoreError>;
    /// Lists the jobs of a set that were not deleted, oldest first.
    async fn jobs_of_set(&self, id: Uuid) -> Result<Vec<JobHead>, StoreError>;
    /// Reads how far a set's jobs are, and in which order they started and ended.
    async fn set_progress(&self, id: Uuid) -> Result<SetProgress, StoreError>;
    /// Cancels all jobs of a set that have not ended, as [`JobStore::cancel`] does; returns their ids, none where all had ended.
    async fn cancel_set(&self, id: Uuid) -> Result<Vec<Uuid>, StoreError>;
    /// Keeps the results that a set has extracted from its jobs. This is buffered: they can be extracted again.
    async fn keep_found(&self, set: Uuid, found: &[(Uuid, Value)]) -> Result<(), StoreError>;
    /// Deletes a set whose jobs are deleted, for they cannot be read without it; returns true if there was one.
    async fn delete_set(&self, id: Uuid) -> Result<bool, StoreError>;
    /// Returns at most `limit` sets all of whose jobs have ended, before a time in milliseconds since 1970 if one is given, the earliest
    /// end first.
    async fn ended_sets(&self, before: Option<i64>, limit: u32) -> Result<Vec<Ended>, StoreError>;
}

/// Uploaded files of a [`Store`].
#[async_trait]
pub trait UploadStore {
    /// Adds an uploaded file; keeps and returns the one that is there already when the content was uploaded before.
    async fn add_upload(&self, file: UploadedFile) -> Result<UploadedFile, StoreError>;
    /// Reads the record of an uploaded file by its id; `None` if there is none of this kind.
    async fn upload(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError>;
    /// Records that the content of a file was uploaded again, and returns the record; `None` if there is none of this kind.
    async fn uploaded_again(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError>;
    /// Deletes the uploaded files that no job uses and whose last upload was before a time in milliseconds since 1970; returns their keys.
    async fn delete_unused_uploads(&self, before: i64) -> Result<Vec<String>, StoreError>;
    /// Deletes an uploaded file of a kind, unless a job needs it: a mesh until the job ends, others as long as the job is there.
    async fn delete_upload(&self, kind: UploadKind, id: &str) -> Result<UploadDeletion, StoreError>;
}

/// Chunks of a [`Store`], which workers claim.
#[async_trait]
pub trait ChunkStore {
    /// Claims a chunk of any owner that is ready, whose lease is over, or that this owner had before and did not end.
    async fn claim(&self, owner: &str, lease: Duration, turn: Turn) -> Result<Option<Lease>, StoreError>;
    /// Extends a lease by `extend` from now, and returns whether the job shall end.
    async fn heartbeat(&self, lease: &Lease, extend: Duration) -> Result<Beat, StoreError>;
    /// Writes convergence rows, progress and events of a running chunk; returns `false` when the lease is lost.
    async fn report(&self, lease: &Lease, reports: &[Report]) -> Result<bool, StoreError>;
    /// Ends a chunk: writes its last reports, progress, the next chunk or the job's end, and the event, in one transaction. This is
    /// buffered; readers of the job wait until it is durable, as [`JobStore::sync`] does.
    async fn complete(
        &self,
        lease: &Lease,
        reports: &[Report],
        completion: &Completion,
    ) -> Result<Committed, StoreError> {
        Ok(self.complete_and_claim(lease, reports, completion, None).await?.0)
    }
    /// Ends a chunk as [`Self::complete`] does, and claims another one by the same owner for some time if `next` is given, in one transaction.
    async fn complete_and_claim(
        &self,
        lease: &Lease,
        reports: &[Report],
        completion: &Completion,
        next: Option<(Duration, Turn)>,
    ) -> Result<(Committed, Option<Lease>), StoreError>;
    /// Goes back from a damaged state of the job to the state before it, or to the first pass, with the event `restarted`.
    async fn rewind(&self, lease: &Lease, reason: &str) -> Result<Committed, StoreError>;
    /// Gives the chunk back undone, without counting a failure.
    async fn release(&self, lease: &Lease) -> Result<(), StoreError>;
    /// Gives the chunk back undone, with this number of slices counted.
    async fn put_aside(&self, lease: &Lease, slices: u64) -> Result<(), StoreError>;
    /// Gives the chunk back undone, with a failure counted.
    async fn fail_attempt(&self, lease: &Lease, error: &str) -> Result<(), StoreError>;
    /// Makes every leased chunk ready again, at a start, when no other process can have a lease. `died`: the process that had them did not
    /// end by itself, which counts against chunks that got no further in it.
    async fn take_back(&self, died: bool) -> Result<TakenBack, StoreError>;
}

/// Store of ranges ahead. Every method is one transaction; what is lost of it in a power failure is computed again. A range whose
/// lease is over is its chunk's.
#[async_trait]
pub trait PassesAhead {
    /// Claims the range that has waited longest, of jobs that nobody has cancelled.
    async fn claim_ahead(&self, owner: &str, lease: Duration) -> Result<Option<AheadLease>, StoreError>;
    /// Extends a lease by `extend` from now; false when it is lost, or the job was cancelled.
    async fn beat_ahead(&self, lease: &AheadLease, extend: Duration) -> Result<bool, StoreError>;
    /// Keeps the outcomes of the passes of a range up to pass `end`, not included; the rest waits again. False when the lease is lost.
    async fn keep_ahead(&self, lease: &AheadLease, end: u64, file: &StateFile) -> Result<bool, StoreError>;
    /// Gives a range back undone.
    async fn return_ahead(&self, lease: &AheadLease, to: GivenBack) -> Result<(), StoreError>;
    /// Returns the ranges ahead of a claimed chunk from its next pass `from`; one that begins there and has no outcomes is the chunk's.
    async fn ahead(&self, lease: &Lease, from: u64) -> Result<Ahead, StoreError>;
}

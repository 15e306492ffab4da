//! The worker: claims chunks, renders them on its own rayon pool, and commits their results.
//!
//! The async side (leases, events, files) and the rendering side (a rayon pool) meet in [`running`]: the pool reports its passes over a
//! channel that never blocks it, and the async side stops it by a shared signal.
//!
//! Jobs take [`turns`] of about 2 s: long enough that a small job is done in one, and that switching between jobs costs little.
//!
//! A process that dies while it renders may have been killed by the job. The store counts the deaths in a row over one chunk in which no
//! attempt got further than the attempts before it. Someone who kills the process every few moments must not make sound jobs fail, so after
//! the first such death the chunk is taken only by a process that has run for a while ([`turns`]); meanwhile other jobs are rendered. After
//! [`MAX_DEATHS`] the next start fails the job.

mod ahead;
mod chunk;
mod commit;
mod equal;
mod interrupted;
mod kept;
mod lanes;
mod leased;
mod open_chunks;
mod pool;
mod reports;
mod running;
mod turns;

use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use tokio::sync::broadcast;
use tokio::time::{Instant, sleep};
use tokio_util::sync::CancellationToken;
use tokio_util::task::TaskTracker;
use uuid::Uuid;

use self::ahead::AheadWorker;
use self::chunk::Ended;
use self::commit::{Commits, IDLE_POLL, LEASE, RETRY_PAUSE};
use self::interrupted::{Interrupted, hopeless};
use self::kept::{Current, KeptJobs};
use self::lanes::{Lane, lanes};
pub use self::open_chunks::WorkerLimits;
use self::open_chunks::{AheadOfChunk, OpenChunks};
use self::pool::RenderPool;
use self::reports::Reports;
use self::running::RunningChunk;
use self::turns::Turns;
use crate::engine::cancel::{Stop, StopReason};
use crate::engine::checkpoint;
use crate::engine::spent::Spent;
use crate::estimate::Estimate;
use crate::present::prepared::{Prepared, prepare};
use crate::queue::artifacts::Artifacts;
use crate::queue::files::FileError;
use crate::queue::live::{LiveJob, LiveJobs};
use crate::queue::store::*;
use crate::queue::uploads::Uploads;

/// Largest number of rows of the convergence table from which a forecast continues: more than there are.
const MOST_TOLD: u32 = 1000;
/// A job fails once one of its chunks has panicked this many times.
const MAX_FAILURES: u64 = 3;

/// Worker that renders the jobs of a store one at a time, and, beside one whose passes take long, others that are short, and passes ahead.
pub struct Worker {
    main: LaneWorker,
    short: LaneWorker,
    ahead: Vec<AheadWorker>,
}

impl Worker {
    /// Creates a worker with `RAYON_NUM_THREADS` threads, or as many as there are processors, and half as many more for the short lane, and
    /// for each further open chunk of a job.
    pub fn new(
        store: Arc<dyn Store>,
        artifacts: Artifacts,
        uploads: Uploads,
        live: Arc<LiveJobs>,
        limits: WorkerLimits,
        shutdown: CancellationToken,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let (main_lane, short_lane) = lanes(limits.memory_bytes);
        let main_pool = RenderPool::new()?;
        let short_pool = main_pool.beside("short")?;
        // each takes back its own chunks, and not those of another
        let owner = |name: &str| format!("{}-{name}-{}", std::process::id(), Uuid::new_v4());
        let commits = || Commits { store: store.clone(), artifacts: artifacts.clone(), ends: TaskTracker::new() };
        let worker = |lane: Lane, pool| {
            let name = if lane.is_short() { "short" } else { "main" };
            LaneWorker {
                store: store.clone(),
                commits: commits(),
                uploads: uploads.clone(),
                live: live.clone(),
                pool,
                owner: owner(name),
                open: OpenChunks::new(limits),
                shutdown: shutdown.clone(),
                turns: Turns::new(Instant::now(), lane.is_short()),
                lane,
                kept: KeptJobs::default(),
                shown: None,
            }
        };
        let ahead_worker = |_| {
            Ok(AheadWorker {
                commits: commits(),
                uploads: uploads.clone(),
                live: live.clone(),
                pool: main_pool.beside("ahead")?,
                owner: owner("ahead"),
                shutdown: shutdown.clone(),
                prepared: None,
            })
        };
        let ahead = (1..limits.open_chunks).map(ahead_worker).collect::<Result<_, _>>()?;
        Ok(Self { main: worker(main_lane, main_pool), short: worker(short_lane, short_pool), ahead })
    }

    /// Runs until the service shuts down.
    pub async fn run(self) {
        let ahead = futures::future::join_all(self.ahead.into_iter().map(AheadWorker::run));
        futures::future::join3(self.main.run(), self.short.run(), ahead).await;
    }
}

/// Worker of one lane, which renders its jobs one at a time.
struct LaneWorker {
    lane: Lane,
    store: Arc<dyn Store>,
    commits: Commits,
    uploads: Uploads,
    live: Arc<LiveJobs>,
    pool: RenderPool,
    owner: String,
    shutdown: CancellationToken,
    turns: Turns,
    open: OpenChunks,
    kept: KeptJobs,
    /// Job that readers see as running.
    shown: Option<(Uuid, Arc<LiveJob>)>,
}

/// Claimed chunk to be rendered, with the changes of the store since before the claim.
struct Claimed {
    lease: Lease,
    /// Turn that the claim was made for.
    turn: Turn,
    changes: broadcast::Receiver<Change>,
    stops: broadcast::Receiver<Change>,
}

/// Outcome of the work on a chunk.
enum Worked {
    /// End of the job, with which another chunk may have been claimed.
    FinishedJob(Option<Claimed>),
    /// Job with more chunks to render, or whose chunk was given back.
    MoreToDo,
}

impl LaneWorker {
    /// Runs until the service shuts down.
    async fn run(mut self) {
        tracing::info!(owner = self.owner, threads = self.pool.threads(), "worker started");
        let mut next = None;
        while !self.shutdown.is_cancelled() {
            if !self.lane.may_claim() {
                self.hide();
                self.kept.clear();
                self.lane.until_it_may_claim(&self.shutdown).await;
                continue;
            }
            let claimed = match next.take() {
                Some(claimed) => claimed,
                None => match self.claim().await {
                    Some(claimed) => claimed,
                    None => continue,
                },
            };
            let Claimed { lease, turn, mut changes, stops } = claimed;
            self.turns.taken(turn, &lease, Instant::now());
            self.lane.renders();
            let worked = self.work(&lease, stops).await;
            self.lane.has_rendered();
            match worked {
                Worked::FinishedJob(None) if !lease.others_wait => self.idle(&mut changes).await,
                Worked::FinishedJob(claimed) => next = claimed,
                Worked::MoreToDo => {}
            }
        }
        if let Some(Claimed { lease, .. }) = next
            && let Err(error) = self.store.release(&lease).await
        {
            tracing::error!(%error, "returning the chunk to the queue failed");
        }
        self.hide();
        self.commits.ends.close();
        self.commits.ends.wait().await;
    }

    /// Claims the next chunk; `None` after a pause in which there was none.
    async fn claim(&mut self) -> Option<Claimed> {
        // both listen from before the claim, so that later changes are not missed
        let (mut changes, stops) = (self.store.changes(), self.store.changes());
        let turn = self.turns.next(Instant::now());
        match self.store.claim(&self.owner, LEASE, turn).await {
            Ok(Some(lease)) => return Some(Claimed { lease, turn, changes, stops }),
            Ok(None) => self.idle(&mut changes).await,
            Err(error) => {
                tracing::warn!(%error, "claiming a chunk failed");
                self.pause(RETRY_PAUSE).await;
            }
        }
        None
    }

    /// Removes the job of this lane from those that readers see as running.
    fn hide(&mut self) {
        if let Some((job, live)) = self.shown.take() {
            self.live.end(job, &live);
        }
    }

    async fn idle(&mut self, changes: &mut broadcast::Receiver<Change>) {
        self.hide();
        // a chunk that waits for passes ahead of it comes back soon
        if !self.open.are_several() {
            self.kept.clear();
        }
        let poll = sleep(self.turns.until_steadier(Instant::now()).unwrap_or(IDLE_POLL));
        tokio::pin!(poll);
        loop {
            tokio::select! {
                () = self.shutdown.cancelled() => return,
                // the next claim takes what was left
                () = &mut poll => return,
                () = self.lane.stirs() => return,
                change = changes.recv() => match change {
                    Ok(Change::Queue | Change::Ahead | Change::Stop(_)) | Err(broadcast::error::RecvError::Lagged(_)) => return,
                    Ok(_) => {}
                    Err(broadcast::error::RecvError::Closed) => {
                        self.pause(IDLE_POLL).await;
                        return;
                    }
                },
            }
        }
    }

    async fn pause(&self, duration: Duration) {
        tokio::select! {
            () = self.shutdown.cancelled() => {}
            () = sleep(duration) => {}
        }
    }

    #[tracing::instrument(skip_all, fields(job = %lease.job, chunk = lease.chunk, attempt = lease.attempt))]
    async fn work(&mut self, lease: &Lease, stops: broadcast::Receiver<Change>) -> Worked {
        let interrupted = match self.render_and_commit(lease, stops).await {
            Ok(worked) => return worked,
            Err(interrupted) => interrupted,
        };
        self.hide();
        let after = match interrupted {
            Interrupted::LeaseLost => {
                tracing::warn!("the lease is lost, or the job was deleted");
                self.commits.delete_files_of_deleted(lease.job).await
            }
            Interrupted::Shutdown => self.store.release(lease).await,
            Interrupted::PutAside(slices) => self.store.put_aside(lease, slices).await,
            Interrupted::Store(error) => self.give_back_and_pause(lease, &error).await,
            Interrupted::Artifact(error) => self.give_back_and_pause(lease, &error).await,
            Interrupted::Damaged(reason) => self.commits.rewind(lease, reason).await,
            Interrupted::Hopeless(problem) => self.fail_job(lease, problem).await,
            Interrupted::Panicked(message) => {
                tracing::error!(message, "the render panicked");
                if lease.failures + 1 < MAX_FAILURES {
                    self.store.fail_attempt(lease, &message).await
                } else {
                    let detail = format!("chunk {} panicked {MAX_FAILURES} times: {message}", lease.chunk);
                    self.fail_job(lease, JobProblem { title: "The render panicked".into(), detail }).await
                }
            }
        };
        if let Err(error) = after {
            // the next claim of this worker takes the chunk again
            tracing::error!(%error, "returning the chunk to the queue failed");
            self.pause(RETRY_PAUSE).await;
        }
        Worked::MoreToDo
    }

    async fn give_back_and_pause(
        &self,
        lease: &Lease,
        error: &(dyn std::fmt::Display + Sync),
    ) -> Result<(), StoreError> {
        tracing::error!(%error, "the chunk could not be stored");
        self.pause(RETRY_PAUSE).await;
        self.store.release(lease).await
    }

    async fn fail_job(&self, lease: &Lease, problem: JobProblem) -> Result<(), StoreError> {
        tracing::error!(status = "failed", problem.detail, "job finished");
        let finish = Finish::failed(problem.title, problem.detail);
        let committed = self.store.complete(lease, &[], &Completion::Finish(finish)).await?;
        self.commits.settle(lease, committed).await?;
        metrics::counter!("skyduct_jobs_finished_total", "status" => "failed").increment(1);
        Ok(())
    }

    async fn render_and_commit(
        &mut self,
        lease: &Lease,
        mut stops: broadcast::Receiver<Change>,
    ) -> Result<Worked, Interrupted> {
        let job = lease.job;
        if self.commits.take_over(lease).await? {
            drop(self.live.take_prepared(job));
            return Ok(Worked::FinishedJob(None));
        }
        let shown = self.shown.as_ref().is_some_and(|(shown, _)| *shown == job);
        if !shown {
            self.hide();
        }
        let stop = Stop::default();
        if lease.cancel_requested {
            stop.raise(StopReason::Cancelled);
        }
        let current = match self.kept.take(job, lease.chunk) {
            Some(current) => {
                let live = if shown { current.live } else { self.live.start(job, current.prepared.clone()) };
                Current { live, ..current }
            }
            None => {
                let load = self.load(lease, stop.clone());
                self.commits.leased(lease, &self.shutdown, (&stop, &mut stops), load).await?
            }
        };
        self.shown = Some((job, current.live.clone()));
        if !lease.cancel_requested && current.prepared.memory().total() > self.lane.most_memory() {
            return Err(Interrupted::PutAside(MOST_SLICES));
        }
        let ahead = match self.open.beside(&current.prepared) {
            0 => AheadOfChunk::default(),
            _ => self.commits.ahead_of(lease, current.merged.passes).await?,
        };
        let (commits, shutdown, reports) = (&self.commits, &self.shutdown, Reports::default());
        let (open, slice) = (self.open, self.lane.slice(lease.slices));
        let running = RunningChunk { lease, commits, shutdown, stop, reports, ahead, open, slice };
        let (current, ended, reports) = running.render(&self.pool, current, stops).await?;
        let finished = matches!(ended, Ended::Finish { .. });
        let (changes, stops) = (self.store.changes(), self.store.changes());
        let turn = self.turns.next(Instant::now());
        // the short lane claims only while the main one is busy
        let next = Some(turn).filter(|_| lease.others_wait && !self.lane.is_short());
        let claimed = self.commits.commit(lease, &current, ended, reports, next).await?;
        if finished {
            self.hide();
            return Ok(Worked::FinishedJob(claimed.map(|lease| Claimed { lease, turn, changes, stops })));
        }
        self.kept.keep(current);
        Ok(Worked::MoreToDo)
    }

    /// Loads the job of a lease with everything that was computed before. A job without passes that `stop` ends meanwhile is not made ready.
    async fn load(&self, lease: &Lease, stop: Stop) -> Result<Current, Interrupted> {
        // the store has nothing more of a new job that is prepared already
        if lease.chunk == 0
            && let Some(prepared) = self.live.take_prepared(lease.job)
        {
            let begun = self.pool.run(move || (prepared.empty_estimate_unless(stop.flag()), prepared));
            let (merged, prepared) = begun.await?;
            return Ok(self.begin(lease, prepared, merged, 0, Spent::NOTHING));
        }
        let source = self.store.job_source(lease.job).await?.ok_or(Interrupted::LeaseLost)?;
        let state = match &source.state {
            Some(state) => match self.commits.artifacts.read_checked(&state.key, &state.hash).await {
                Ok(bytes) => Some(bytes),
                Err(FileError::Damaged { .. }) => {
                    return Err(Interrupted::Damaged("the stored checkpoint is damaged"));
                }
                Err(FileError::NotFound(_)) => {
                    return Err(Interrupted::Damaged("the stored checkpoint is missing"));
                }
                Err(error) => return Err(error.into()),
            },
            None => None,
        };
        let bytes = state.as_ref().map_or(0, |state| state.len() as u64);
        let meshes = self.uploads.seen_by(self.store.of(source.owner));
        let meshes = meshes.for_document(tokio::runtime::Handle::current(), Arc::default());
        let submitted = source.submitted;
        let handed_over = self.live.take_prepared(lease.job);
        let loaded = self.pool.run(move || {
            let prepared = match handed_over {
                Some(prepared) => prepared,
                None => Arc::new(prepare(submitted.as_bytes(), &meshes).map_err(|errors| errors.to_string())?),
            };
            let merged = match state {
                Some(bytes) => checkpoint::decode(prepared.empty_estimate(), &bytes),
                None => Ok(prepared.empty_estimate_unless(stop.flag())),
            };
            Ok::<_, String>((prepared, merged))
        });
        let (prepared, merged) = loaded.await?.map_err(|detail| hopeless("The job cannot be prepared", detail))?;
        let merged = merged.map_err(|error| {
            tracing::warn!(error, "the stored checkpoint cannot be read");
            Interrupted::Damaged("the stored checkpoint is of another version")
        })?;
        let mut current = self.begin(lease, prepared, merged, bytes, source.merged_spent);
        // passes of earlier processes included
        let told = self.store.convergence_outline(lease.job, MOST_TOLD).await?;
        let merged = current.merged.passes;
        told.iter().filter(|pass| pass.passes <= merged).for_each(|pass| current.forecaster.take(pass));
        Ok(current)
    }

    /// Begins with a job that was not rendered lately, from the estimate of its earlier chunks, its size in bytes and its time.
    fn begin(&self, lease: &Lease, prepared: Arc<Prepared>, merged: Estimate, bytes: u64, spent: Spent) -> Current {
        if lease.chunk == 0 {
            tracing::info!(name = prepared.name, method = prepared.method_names(), "job started");
            if let Some(waited) = age(lease.job).filter(|_| lease.attempt == 1) {
                metrics::histogram!("skyduct_job_wait_seconds").record(waited);
            }
        }
        let live = self.live.start(lease.job, prepared.clone());
        let forecaster = prepared.forecaster();
        Current {
            job: lease.job,
            prepared,
            live,
            merged,
            bytes,
            spent,
            next_chunk: lease.chunk,
            is_loaded: true,
            forecaster,
        }
    }
}

/// Seconds since a job was submitted, which its id tells; `None` for one whose id is of another kind.
fn age(job: Uuid) -> Option<f64> {
    let (seconds, nanoseconds) = job.get_timestamp()?.to_unix();
    let submitted = Duration::new(seconds, nanoseconds);
    Some(SystemTime::now().duration_since(UNIX_EPOCH).ok()?.saturating_sub(submitted).as_secs_f64())
}

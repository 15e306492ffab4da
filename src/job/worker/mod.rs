//! The worker: claims chunks, renders them on its own rayon pool, and commits what they add up to.
//!
//! The async side (leases, events, files) and the rendering side (a rayon pool) meet in [`ChunkRun`]: the pool tells what it
//! has done over a channel that never blocks it, the async side says over an atomic that it shall stop.
//!
//! Jobs take turns of about [`TURN`]: long enough that a small job is done in one, and that changing over costs little.
//!
//! A process that dies while it renders may have died of the job. The store counts the deaths in a row over one chunk in which
//! no attempt got further than the attempts before it. Whoever kills the process every few moments must not ruin sound jobs by
//! that, so after the first such death the chunk is taken only by a process that has proven steady ([`STEADY_AFTER`]);
//! meanwhile other jobs go on. After [`MAX_DEATHS`] the next start fails the job.

mod chunk;
mod kept;
mod reports;

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use bytes::Bytes;
use futures::{FutureExt, StreamExt, TryStreamExt};
use tokio::sync::{broadcast, mpsc, oneshot};
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep, sleep_until};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use self::chunk::{ABANDON, CANCEL, ChunkRun, News, Outcome, RUN, progress_of};
use self::kept::{Current, KeptJobs};
use self::reports::Reports;
use crate::job::artifacts::{ArtifactError, Artifacts};
use crate::job::live::LiveJobs;
use crate::job::meshes::Meshes;
use crate::job::run::{self, StoppedBy};
use crate::job::store::*;

/// Time without a heartbeat after which a worker has lost its chunk.
const LEASE: Duration = Duration::from_secs(60);
const HEARTBEAT: Duration = Duration::from_secs(15);
/// Hints wake an idle worker; this is for a lease that ran out, or a hint that was lost.
const IDLE_POLL: Duration = Duration::from_secs(60);
/// Render time of a job after which it lets the next one go on, at the end of its chunk.
const TURN: Duration = Duration::from_secs(2);
/// Age of a process before it takes a chunk over which one process, or two in a row, have died.
const STEADY_AFTER: [Duration; MAX_DEATHS as usize - 1] = [Duration::from_secs(2), Duration::from_secs(10)];
/// Files of one job that are written at the same time.
const FILES_AT_ONCE: usize = 8;
/// Pause after the store failed.
const RETRY_PAUSE: Duration = Duration::from_secs(5);
/// Number of panics of one chunk that fail its job.
const MAX_FAILURES: u64 = 3;
/// After these passes a progress image is kept.
pub const PREVIEW_PASSES: [u64; 6] = [1, 4, 16, 64, 256, 1024];

/// Renders the jobs of a store, one at a time.
pub struct Worker {
    store: Arc<dyn Store>,
    artifacts: Artifacts,
    meshes: Meshes,
    live: Arc<LiveJobs>,
    pool: rayon::ThreadPool,
    owner: String,
    shutdown: CancellationToken,
    started: Instant,
    /// The job whose turn it is, and since when.
    turn: Option<(Uuid, Instant)>,
    kept: KeptJobs,
    /// The job that readers see as running.
    shown: Option<Uuid>,
}

/// Reason why a chunk was not committed.
enum Interrupted {
    /// Somebody else has it, or the job is gone.
    LeaseLost,
    Shutdown,
    Store(StoreError),
    Artifact(ArtifactError),
    /// The stored state of the job is of no use, for this reason.
    Damaged(&'static str),
    /// The job cannot be rendered, now or ever.
    Hopeless(JobProblem),
    Panicked(String),
}

impl From<StoreError> for Interrupted {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

impl From<ArtifactError> for Interrupted {
    fn from(error: ArtifactError) -> Self {
        Self::Artifact(error)
    }
}

impl Worker {
    /// `RAYON_NUM_THREADS` threads, or as many as there are processors.
    pub fn new(
        store: Arc<dyn Store>,
        artifacts: Artifacts,
        meshes: Meshes,
        live: Arc<LiveJobs>,
        shutdown: CancellationToken,
    ) -> Result<Self, rayon::ThreadPoolBuildError> {
        let pool = rayon::ThreadPoolBuilder::new().thread_name(|index| format!("render-{index}")).build()?;
        let owner = format!("{}-{}", std::process::id(), Uuid::new_v4());
        let started = Instant::now();
        let kept = KeptJobs::default();
        Ok(Self { store, artifacts, meshes, live, pool, owner, shutdown, started, turn: None, kept, shown: None })
    }

    /// Renders chunks until shut down.
    pub async fn run(mut self) {
        tracing::info!(owner = self.owner, threads = self.pool.current_num_threads(), "worker started");
        let mut changes = self.store.changes();
        while !self.shutdown.is_cancelled() {
            match self.store.claim(&self.owner, LEASE, self.next_turn()).await {
                Ok(Some(lease)) => {
                    if self.next_turn().stay_with != Some(lease.job) {
                        self.turn = Some((lease.job, Instant::now()));
                    }
                    self.work(&lease).await;
                }
                Ok(None) => {
                    self.show(None);
                    self.kept.clear();
                    self.idle(&mut changes).await;
                }
                Err(error) => {
                    tracing::warn!(%error, "claim failed");
                    self.pause(RETRY_PAUSE).await;
                }
            }
        }
        self.show(None);
    }

    fn next_turn(&self) -> Turn {
        let turn = self.turn.filter(|(_, since)| since.elapsed() < TURN);
        let age = self.started.elapsed();
        let most_deaths = STEADY_AFTER.iter().filter(|after| age >= **after).count() as u64;
        Turn { stay_with: turn.map(|(job, _)| job), most_deaths }
    }

    /// Readers see this job as running, and no other one.
    fn show(&mut self, job: Option<Uuid>) {
        if let Some(other) = self.shown.filter(|shown| Some(*shown) != job) {
            self.live.end(other);
        }
        self.shown = job;
    }

    async fn idle(&self, changes: &mut broadcast::Receiver<Change>) {
        let age = self.started.elapsed();
        let steady = STEADY_AFTER.iter().find_map(|after| after.checked_sub(age));
        let poll = sleep(steady.unwrap_or(IDLE_POLL));
        tokio::pin!(poll);
        loop {
            tokio::select! {
                () = self.shutdown.cancelled() => return,
                // the next claim takes what was left
                () = &mut poll => return,
                change = changes.recv() => match change {
                    Ok(Change::Queue) | Err(broadcast::error::RecvError::Lagged(_)) => return,
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
    async fn work(&mut self, lease: &Lease) {
        let Err(interrupted) = self.render_and_commit(lease).await else { return };
        self.show(None);
        let after = match interrupted {
            Interrupted::LeaseLost => {
                tracing::warn!("the lease is lost, or the job was deleted");
                self.delete_files_of_deleted(lease.job).await
            }
            Interrupted::Shutdown => self.store.release(lease).await,
            Interrupted::Store(error) => self.give_back_and_pause(lease, &error).await,
            Interrupted::Artifact(error) => self.give_back_and_pause(lease, &error).await,
            Interrupted::Damaged(reason) => self.rewind(lease, reason).await,
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
            tracing::error!(%error, "giving the chunk back failed");
            self.pause(RETRY_PAUSE).await;
        }
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
        let finish = Finish {
            status: JobStatus::Failed,
            stopped_by: None,
            progress: None,
            summary: None,
            problem: Some(problem),
            artifacts: Vec::new(),
            last_pass: None,
        };
        self.delete_obsolete(self.store.complete(lease, &[], &Completion::Finish(finish)).await?).await;
        metrics::counter!("skyduct_jobs_finished_total", "status" => "failed").increment(1);
        Ok(())
    }

    /// Deletes what was stored after the job's files had been deleted with it.
    async fn delete_files_of_deleted(&self, job: Uuid) -> Result<(), StoreError> {
        if self.store.job_head(job).await?.is_none()
            && let Err(error) = self.artifacts.delete_job(job).await
        {
            tracing::warn!(%error, "deleting files failed");
        }
        Ok(())
    }

    /// Passes whose state is damaged are rendered again.
    async fn rewind(&self, lease: &Lease, reason: &str) -> Result<(), StoreError> {
        tracing::warn!(reason, "rendering again from the last sound state");
        self.delete_obsolete(self.store.rewind(lease, reason).await?).await;
        Ok(())
    }

    /// Deletes files that nothing points to any more; a failure costs only space, until a later start sweeps.
    async fn delete_obsolete(&self, committed: Committed) {
        let Committed::Yes { obsolete } = committed else { return };
        for key in obsolete {
            if let Err(error) = self.artifacts.delete(&key).await {
                tracing::warn!(%error, key, "deleting a file failed");
            }
        }
    }

    async fn render_and_commit(&mut self, lease: &Lease) -> Result<(), Interrupted> {
        // listened to before the look: a cancel is seen by one or the other
        let changes = self.store.changes();
        let job = lease.job;
        let shown = self.shown == Some(job);
        if !shown {
            self.show(None);
        }
        let (current, cancel_requested) = match self.kept.take(job, lease.chunk) {
            Some(current) => {
                let head = self.store.job_head(job).await?.ok_or(Interrupted::LeaseLost)?;
                let live = if shown { current.live } else { self.live.start(job, current.prepared.clone()) };
                (Current { live, ..current }, head.cancel_requested)
            }
            None => self.load(lease).await?,
        };
        self.shown = Some(job);
        let (current, outcome, reports) = self.render(lease, current, cancel_requested, changes).await?;
        let finished = matches!(outcome, Outcome::Finish { .. });
        self.commit(lease, &current, outcome, reports).await?;
        if finished {
            self.show(None);
        } else {
            self.kept.keep(current);
        }
        Ok(())
    }

    /// The job of a lease with everything that was computed before, and whether it was asked to stop.
    async fn load(&self, lease: &Lease) -> Result<(Current, bool), Interrupted> {
        let source = self.store.job_source(lease.job).await?.ok_or(Interrupted::LeaseLost)?;
        let state = match &source.state {
            Some(state) => match self.artifacts.read_checked(&state.key, &state.hash).await {
                Ok(bytes) => Some(bytes),
                Err(ArtifactError::Damaged { .. }) => return Err(Interrupted::Damaged("the stored state is damaged")),
                Err(ArtifactError::NotFound(_)) => return Err(Interrupted::Damaged("the stored state is missing")),
                Err(error) => return Err(error.into()),
            },
            None => None,
        };
        let bytes = state.as_ref().map_or(0, |state| state.len() as u64);
        let meshes = self.meshes.for_document(tokio::runtime::Handle::current(), Arc::default());
        let submitted = source.submitted;
        let loaded = match (self.live.take_prepared(lease.job), state) {
            (Some(prepared), None) => {
                let merged = Ok(prepared.empty_estimate());
                Ok((prepared, merged))
            }
            (handed_over, state) => {
                self.on_pool(move || {
                    let prepared = match handed_over {
                        Some(prepared) => prepared,
                        None => {
                            Arc::new(run::prepare(submitted.as_bytes(), &meshes).map_err(|errors| errors.to_string())?)
                        }
                    };
                    let merged = match state {
                        Some(bytes) => run::decode(&prepared, &bytes),
                        None => Ok(prepared.empty_estimate()),
                    };
                    Ok::<_, String>((prepared, merged))
                })
                .await?
            }
        };
        let (prepared, merged) = loaded.map_err(|detail| hopeless("The job cannot be prepared", detail))?;
        let merged = merged.map_err(|error| {
            tracing::warn!(error, "the stored state cannot be read");
            Interrupted::Damaged("the stored state is of another version")
        })?;
        if lease.chunk == 0 {
            tracing::info!(name = prepared.name, method = prepared.method_names(), "job started");
        }
        let live = self.live.start(lease.job, prepared.clone());
        let seconds = source.merged_seconds;
        let current = Current { job: lease.job, prepared, live, merged, bytes, seconds, next_chunk: lease.chunk };
        Ok((current, source.cancel_requested))
    }

    /// Renders the chunk on the pool, keeps the lease meanwhile and passes on what the pool tells.
    async fn render(
        &self,
        lease: &Lease,
        current: Current,
        cancel_requested: bool,
        mut changes: broadcast::Receiver<Change>,
    ) -> Result<(Current, Outcome, Reports), Interrupted> {
        let stop = Arc::new(AtomicU8::new(RUN));
        let (tell, mut told) = mpsc::unbounded_channel();
        let (job, live_jobs) = (lease.job, self.live.clone());
        let run = ChunkRun { current, stop: stop.clone(), tell, chunk: lease.chunk };
        let mut rendering = Box::pin(self.on_pool(move || run.run(cancel_requested)));
        // the lease is fresh
        let mut beat = interval_at(Instant::now() + HEARTBEAT, HEARTBEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut reports = Reports::default();
        let result = loop {
            tokio::select! {
                biased;
                result = &mut rendering => break result,
                () = self.shutdown.cancelled(), if stop.load(Ordering::Relaxed) != ABANDON => {
                    stop.store(ABANDON, Ordering::Relaxed);
                }
                _ = beat.tick() => self.heartbeat(lease, &stop).await,
                change = changes.recv() => match change {
                    Ok(Change::Stop(id)) if id == job => self.heartbeat(lease, &stop).await,
                    Err(broadcast::error::RecvError::Lagged(_)) => self.heartbeat(lease, &stop).await,
                    _ => {}
                },
                () = sleep_until(reports.due()), if reports.is_waiting() => {
                    self.send(lease, &mut reports, &stop).await;
                }
                Some(news) = told.recv() => self.collect(lease, &mut reports, news).await,
            }
        };
        while let Ok(news) = told.try_recv() {
            self.collect(lease, &mut reports, news).await;
        }
        if stop.load(Ordering::Relaxed) == ABANDON {
            live_jobs.end(job);
            return Err(if self.shutdown.is_cancelled() { Interrupted::Shutdown } else { Interrupted::LeaseLost });
        }
        let rendered = match result {
            Ok(rendered) => rendered,
            Err(panicked) => {
                live_jobs.end(job);
                return Err(panicked);
            }
        };
        let (current, outcome) = rendered;
        match outcome {
            Ok(outcome) => Ok((current, outcome, reports)),
            Err(error) => {
                live_jobs.end(job);
                retry(|| self.store.report(lease, &reports.waiting)).await?;
                Err(hopeless("The render failed", error.to_string()))
            }
        }
    }

    async fn heartbeat(&self, lease: &Lease, stop: &AtomicU8) {
        match self.store.heartbeat(lease, LEASE).await {
            Ok(Beat::Keep) => {}
            Ok(Beat::Cancel) => {
                // shutting down or a lost lease comes first
                let _ = stop.compare_exchange(RUN, CANCEL, Ordering::Relaxed, Ordering::Relaxed);
            }
            Ok(Beat::Lost) => stop.store(ABANDON, Ordering::Relaxed),
            Err(error) => tracing::warn!(%error, "heartbeat failed"),
        }
    }

    async fn collect(&self, lease: &Lease, reports: &mut Reports, news: News) {
        match news {
            News::Pass(report) => {
                metrics::counter!("skyduct_passes_total").increment(1);
                reports.push(Report::Pass(report));
            }
            News::Images { passes, images } => {
                for (view, png) in images {
                    let name = format!("views/{view}.pass{passes}.png");
                    match self.artifacts.put_of_chunk(lease, &name, "image/png", png.into()).await {
                        Ok(artifact) => {
                            reports.files.push(artifact.key.clone());
                            reports.push(Report::Image { view, passes, artifact });
                        }
                        // the job is worth more than a progress image
                        Err(error) => tracing::warn!(%error, name, "storing a progress image failed"),
                    }
                }
            }
        }
    }

    async fn send(&self, lease: &Lease, reports: &mut Reports, stop: &AtomicU8) {
        match self.store.report(lease, &reports.waiting).await {
            Ok(true) => reports.clear(),
            Ok(false) => {
                stop.store(ABANDON, Ordering::Relaxed);
                reports.clear();
            }
            Err(error) => {
                tracing::warn!(%error, "reporting passes failed");
                reports.postpone(RETRY_PAUSE);
            }
        }
    }

    /// Files first, all at once, then the row that points to them: the disk is waited for twice.
    async fn commit(
        &self,
        lease: &Lease,
        current: &Current,
        outcome: Outcome,
        mut reports: Reports,
    ) -> Result<(), Interrupted> {
        let progress = progress_of(current);
        let completion = match outcome {
            Outcome::Continue { state, next } => {
                let files = [("state".to_owned(), "application/octet-stream", state)];
                let state = self.put_all(lease, &files, &mut reports).await?.pop();
                let state = state.map(|file| StateFile { key: file.key, hash: file.hash });
                let state = state.ok_or_else(|| ArtifactError::NotFound("the new state".into()))?;
                Completion::Continue { state, progress, next_index: current.next_chunk, next }
            }
            Outcome::Finish { stopped_by, summary, files, last_pass } => {
                let reason = current.prepared.no_results(stopped_by, &current.merged);
                let problem = reason.map(|detail| JobProblem { title: "The job ran out of time".into(), detail });
                let files: Vec<_> =
                    files.into_iter().map(|file| (file.name, file.media_type, Bytes::from(file.bytes))).collect();
                let artifacts = self.put_all(lease, &files, &mut reports).await?;
                let status = match (stopped_by, &problem) {
                    (StoppedBy::Cancelled, _) => JobStatus::Cancelled,
                    (_, Some(_)) => JobStatus::Failed,
                    (_, None) => JobStatus::Succeeded,
                };
                Completion::Finish(Finish {
                    status,
                    stopped_by: Some(stopped_by),
                    progress: Some(progress),
                    summary,
                    problem,
                    artifacts,
                    last_pass,
                })
            }
        };
        match retry(|| self.store.complete(lease, &reports.waiting, &completion)).await? {
            Committed::LeaseLost => return Err(Interrupted::LeaseLost),
            committed => self.delete_obsolete(committed).await,
        }
        if let Completion::Finish(finish) = &completion {
            tracing::info!(
                name = current.prepared.name,
                method = current.prepared.method_names(),
                status = finish.status.name(),
                stopped_by = finish.stopped_by.map(StoppedBy::name),
                passes = progress.passes,
                seconds = progress.seconds,
                "job finished"
            );
            metrics::counter!("skyduct_jobs_finished_total", "status" => finish.status.name()).increment(1);
        }
        metrics::gauge!("skyduct_job_photons").set(progress.photons as f64);
        Ok(())
    }

    /// Stores files (name, media type, content) and waits until they and the chunk's progress images are on the disk.
    async fn put_all(
        &self,
        lease: &Lease,
        files: &[(String, &'static str, Bytes)],
        reports: &mut Reports,
    ) -> Result<Vec<Artifact>, ArtifactError> {
        let artifacts = retry(|| put_files(self.artifacts.clone(), lease.clone(), files.to_vec())).await?;
        let keys: Vec<String> = artifacts.iter().map(|file| &file.key).chain(&reports.files).cloned().collect();
        retry(|| self.artifacts.make_durable(&keys)).await?;
        reports.files.clear();
        Ok(artifacts)
    }

    /// Runs on the render pool; a panic there comes back as an error.
    async fn on_pool<T: Send + 'static>(&self, work: impl FnOnce() -> T + Send + 'static) -> Result<T, Interrupted> {
        let (sender, receiver) = oneshot::channel();
        self.pool.spawn(move || {
            // what a panic leaves half done is dropped with it
            let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(work));
            let _ = sender.send(result.map_err(|panic| panic_message(panic.as_ref())));
        });
        match receiver.await {
            Ok(result) => result.map_err(Interrupted::Panicked),
            Err(_) => Err(Interrupted::Panicked("the render thread is gone".into())),
        }
    }
}

/// Stores files, some at a time.
async fn put_files(
    artifacts: Artifacts,
    lease: Lease,
    files: Vec<(String, &'static str, Bytes)>,
) -> Result<Vec<Artifact>, ArtifactError> {
    let mut puts = Vec::with_capacity(files.len());
    for (name, media_type, bytes) in files {
        let (artifacts, lease) = (artifacts.clone(), lease.clone());
        puts.push(async move { artifacts.put_of_chunk(&lease, &name, media_type, bytes).await }.boxed());
    }
    futures::stream::iter(puts).buffered(FILES_AT_ONCE).try_collect().await
}

/// Tries up to five times, with growing pauses: what fails is a busy or full disk, and a chunk is worth waiting for.
async fn retry<T, E: std::fmt::Display, F: Future<Output = Result<T, E>>>(
    mut action: impl FnMut() -> F,
) -> Result<T, E> {
    let mut pause = Duration::from_millis(100);
    for _ in 0..4 {
        match action().await {
            Ok(value) => return Ok(value),
            Err(error) => tracing::warn!(%error, "trying again"),
        }
        sleep(pause).await;
        pause *= 3;
    }
    action().await
}

fn hopeless(title: &str, detail: String) -> Interrupted {
    Interrupted::Hopeless(JobProblem { title: title.to_owned(), detail })
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    if let Some(text) = panic.downcast_ref::<&str>() {
        (*text).to_owned()
    } else if let Some(text) = panic.downcast_ref::<String>() {
        text.clone()
    } else {
        "no message".to_owned()
    }
}

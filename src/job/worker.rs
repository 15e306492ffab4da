//! The worker: claims chunks, renders them on its own rayon pool, and commits what they add up to.
//!
//! The async side (leases, events, files) and the rendering side (a rayon pool) meet in [`ChunkRun`]: the pool tells what it
//! has done over a channel that never blocks it, the async side says over an atomic that it shall stop.

use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::time::Duration;

use tokio::sync::{broadcast, mpsc, oneshot};
use tokio::time::{Instant, MissedTickBehavior, interval, sleep, sleep_until};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use crate::estimate::Estimate;
use crate::job::artifacts::{ArtifactError, Artifacts};
use crate::job::live::{LiveJob, LiveJobs};
use crate::job::meshes::Meshes;
use crate::job::run::{self, Observer, PassReport, Prepared, RenderError, ResultFile, StoppedBy};
use crate::job::store::*;

/// A worker that is not heard of for so long has lost its chunk.
const LEASE: Duration = Duration::from_secs(60);
const HEARTBEAT: Duration = Duration::from_secs(15);
/// Hints wake an idle worker; this is for a lease that ran out, or a hint that was lost.
const IDLE_POLL: Duration = Duration::from_secs(60);
/// Passes are reported together, at most this late.
const REPORT_DELAY: Duration = Duration::from_millis(100);
/// Pause after the store failed.
const RETRY_PAUSE: Duration = Duration::from_secs(5);
/// A chunk that panicked so often fails its job.
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
    current: Option<Current>,
}

/// The job whose chunk was rendered last, so that its next chunk need not be loaded.
struct Current {
    job: Uuid,
    prepared: Arc<Prepared>,
    live: Arc<LiveJob>,
    /// Everything of chunks before `next_chunk`.
    merged: Estimate,
    seconds: f64,
    next_chunk: u64,
}

/// Why a chunk was not committed.
enum Interrupted {
    /// Somebody else has it, or the job is gone.
    LeaseLost,
    Shutdown,
    Store(StoreError),
    Artifact(ArtifactError),
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
        Ok(Self { store, artifacts, meshes, live, pool, owner, shutdown, current: None })
    }

    /// Until shut down.
    pub async fn run(mut self) {
        tracing::info!(owner = self.owner, threads = self.pool.current_num_threads(), "worker started");
        let mut changes = self.store.changes();
        while !self.shutdown.is_cancelled() {
            match self.store.claim(&self.owner, LEASE).await {
                Ok(Some(lease)) => self.work(&lease).await,
                Ok(None) => {
                    self.forget_current();
                    self.idle(&mut changes).await;
                }
                Err(error) => {
                    tracing::warn!(%error, "claim failed");
                    self.pause(RETRY_PAUSE).await;
                }
            }
        }
        self.forget_current();
    }

    async fn idle(&self, changes: &mut broadcast::Receiver<Change>) {
        let poll = sleep(IDLE_POLL);
        tokio::pin!(poll);
        loop {
            tokio::select! {
                () = self.shutdown.cancelled() => return,
                () = &mut poll => {
                    if let Err(error) = self.store.reclaim(false).await {
                        tracing::warn!(%error, "looking for lost leases failed");
                    }
                    return;
                }
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
        self.forget_current();
        let after = match interrupted {
            Interrupted::LeaseLost => {
                tracing::warn!("the lease is lost, or the job was deleted");
                Ok(())
            }
            Interrupted::Shutdown => self.store.release(lease).await,
            Interrupted::Store(error) => self.give_back_and_pause(lease, &error).await,
            Interrupted::Artifact(error) => self.give_back_and_pause(lease, &error).await,
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
            // the lease runs out, and then the chunk is claimed again
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
        };
        if let Committed::Yes { obsolete: Some(key) } = self.store.complete(lease, &Completion::Finish(finish)).await? {
            self.delete_file(&key).await;
        }
        metrics::counter!("skyduct_jobs_finished_total", "status" => "failed").increment(1);
        Ok(())
    }

    /// Deletes a file that nothing points to; a failure costs only space, until the next start sweeps.
    async fn delete_file(&self, key: &str) {
        if let Err(error) = self.artifacts.delete(key).await {
            tracing::warn!(%error, key, "deleting a file failed");
        }
    }

    fn forget_current(&mut self) {
        if let Some(current) = self.current.take() {
            self.live.end(current.job);
        }
    }

    async fn render_and_commit(&mut self, lease: &Lease) -> Result<(), Interrupted> {
        let cancel_requested = self.store.job_head(lease.job).await?.ok_or(Interrupted::LeaseLost)?.cancel_requested;
        let current = match self.current.take() {
            Some(current) if current.job == lease.job && current.next_chunk == lease.chunk => current,
            other => {
                self.current = other;
                self.forget_current();
                self.load(lease).await?
            }
        };
        let job = lease.job;
        let (current, outcome) = self.render(lease, current, cancel_requested).await?;
        let finished = matches!(outcome, Outcome::Finish { .. });
        self.commit(lease, &current, outcome).await?;
        if finished {
            self.live.end(job);
        } else {
            self.current = Some(current);
        }
        Ok(())
    }

    /// The job of a lease with everything that was computed before.
    async fn load(&self, lease: &Lease) -> Result<Current, Interrupted> {
        let job = self.store.job(lease.job).await?.ok_or(Interrupted::LeaseLost)?;
        let state = match &job.state {
            Some(state) => Some(self.artifacts.read_checked(&state.key, &state.hash).await.map_err(damaged)?),
            None => None,
        };
        let meshes = self.meshes.for_document(tokio::runtime::Handle::current(), Arc::default());
        let submitted = job.submitted;
        let handed_over = self.live.take_prepared(lease.job);
        let loaded = self
            .on_pool(move || {
                let prepared = match handed_over {
                    Some(prepared) => prepared,
                    None => Arc::new(run::prepare(submitted.as_bytes(), &meshes).map_err(|errors| errors.to_string())?),
                };
                let merged = match state {
                    Some(bytes) => run::decode(&prepared, &bytes)?,
                    None => prepared.empty_estimate(),
                };
                Ok::<_, String>((prepared, merged))
            })
            .await?;
        let (prepared, merged) = loaded.map_err(|detail| hopeless("The job cannot be prepared", detail))?;
        if lease.chunk == 0 {
            tracing::info!(name = prepared.name, method = prepared.method_names(), "job started");
        }
        let live = self.live.start(lease.job, prepared.clone());
        let seconds = job.merged_seconds;
        Ok(Current { job: lease.job, prepared, live, merged, seconds, next_chunk: lease.chunk })
    }

    /// Renders the chunk on the pool, keeps the lease meanwhile and passes on what the pool tells.
    async fn render(
        &self,
        lease: &Lease,
        current: Current,
        cancel_requested: bool,
    ) -> Result<(Current, Outcome), Interrupted> {
        let mut changes = self.store.changes();
        let stop = Arc::new(AtomicU8::new(RUN));
        let (tell, mut told) = mpsc::unbounded_channel();
        let (job, live_jobs) = (lease.job, self.live.clone());
        let run = ChunkRun { current, stop: stop.clone(), tell, chunk: lease.chunk };
        let mut rendering = Box::pin(self.on_pool(move || run.run(cancel_requested)));
        let mut beat = interval(HEARTBEAT);
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
        retry(|| self.store.report(lease, &reports.waiting)).await?;
        let (current, outcome) = rendered;
        match outcome {
            Ok(outcome) => Ok((current, outcome)),
            Err(error) => {
                live_jobs.end(job);
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
                    match self.artifacts.put_of_chunk(lease, &name, "image/png", png).await {
                        Ok(artifact) => reports.push(Report::Image { view, passes, artifact }),
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

    /// Files first, then the row that points to them.
    async fn commit(&self, lease: &Lease, current: &Current, outcome: Outcome) -> Result<(), Interrupted> {
        let progress = progress_of(current);
        let completion = match outcome {
            Outcome::Continue { state, next } => {
                let file = self.put(lease, "state", "application/octet-stream", state).await?;
                let state = StateFile { key: file.key, hash: file.hash };
                Completion::Continue { state, progress, next_index: current.next_chunk, next }
            }
            Outcome::Finish { stopped_by, summary, files } => {
                let reason = current.prepared.no_results(stopped_by, &current.merged);
                let problem = reason.map(|detail| JobProblem { title: "The job ran out of time".into(), detail });
                let mut artifacts = Vec::with_capacity(files.len());
                for file in files {
                    artifacts.push(self.put(lease, &file.name, file.media_type, file.bytes).await?);
                }
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
                })
            }
        };
        match retry(|| self.store.complete(lease, &completion)).await? {
            Committed::LeaseLost => return Err(Interrupted::LeaseLost),
            Committed::Yes { obsolete: Some(key) } => self.delete_file(&key).await,
            Committed::Yes { obsolete: None } => {}
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

    async fn put(
        &self,
        lease: &Lease,
        name: &str,
        media_type: &str,
        bytes: Vec<u8>,
    ) -> Result<Artifact, ArtifactError> {
        retry(|| self.artifacts.put_of_chunk(lease, name, media_type, bytes.clone())).await
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

/// What the async side asks of a running chunk.
const RUN: u8 = 0;
/// Stop within a pass; what was computed counts.
const CANCEL: u8 = 1;
/// Stop within a pass; what was computed is dropped.
const ABANDON: u8 = 2;

/// A chunk on the render pool.
struct ChunkRun {
    current: Current,
    stop: Arc<AtomicU8>,
    tell: mpsc::UnboundedSender<News>,
    chunk: u64,
}

enum News {
    Pass(PassReport),
    Images { passes: u64, images: Vec<(String, Vec<u8>)> },
}

enum Outcome {
    Continue { state: Vec<u8>, next: std::ops::Range<u64> },
    Finish { stopped_by: StoppedBy, summary: Option<serde_json::Value>, files: Vec<ResultFile> },
}

struct PassObserver<'a> {
    prepared: &'a Prepared,
    live: &'a LiveJob,
    stop: &'a AtomicU8,
    tell: &'a mpsc::UnboundedSender<News>,
}

impl Observer for PassObserver<'_> {
    fn cancelled(&self) -> bool {
        self.stop.load(Ordering::Relaxed) != RUN
    }

    fn pass_done(&self, report: &PassReport, merged: &Estimate) {
        self.live.publish(merged);
        // the receiver outlives the render
        let _ = self.tell.send(News::Pass(*report));
        if PREVIEW_PASSES.contains(&report.passes) {
            let images = self.prepared.preview_images(merged);
            if !images.is_empty() {
                let _ = self.tell.send(News::Images { passes: report.passes, images });
            }
        }
    }
}

impl ChunkRun {
    fn run(self, cancel_requested: bool) -> (Current, Result<Outcome, RenderError>) {
        let Self { mut current, stop, tell, chunk } = self;
        let outcome = render_chunk(&mut current, &stop, &tell, chunk, cancel_requested);
        current.live.publish(&current.merged);
        (current, outcome)
    }
}

fn render_chunk(
    current: &mut Current,
    stop: &AtomicU8,
    tell: &mpsc::UnboundedSender<News>,
    chunk: u64,
    cancel_requested: bool,
) -> Result<Outcome, RenderError> {
    let prepared = current.prepared.clone();
    if cancel_requested {
        return finish(current, StoppedBy::Cancelled);
    }
    let observer = PassObserver { prepared: &prepared, live: &current.live, stop, tell };
    let rendered = prepared.render_chunk(chunk, &current.merged, current.seconds, &observer)?;
    if stop.load(Ordering::Relaxed) == ABANDON {
        // not committed: an outcome is not needed
        return Ok(Outcome::Finish { stopped_by: StoppedBy::Cancelled, summary: None, files: Vec::new() });
    }
    run::merge(&mut current.merged, &rendered.estimate);
    current.seconds += rendered.seconds;
    current.next_chunk = chunk + 1;
    let stopped = rendered.ended.or_else(|| prepared.stop_after(chunk, &current.merged));
    match (stopped, prepared.chunk(chunk + 1)) {
        (None, Some(next)) => Ok(Outcome::Continue { state: run::encode(&current.merged), next }),
        (stopped, _) => finish(current, stopped.unwrap_or(StoppedBy::MaxPasses)),
    }
}

fn finish(current: &Current, stopped_by: StoppedBy) -> Result<Outcome, RenderError> {
    if current.merged.passes == 0 {
        return Ok(Outcome::Finish { stopped_by, summary: None, files: Vec::new() });
    }
    let files = current.prepared.kept_files(&current.merged)?;
    let summary = current.prepared.summary_json(&current.merged, current.seconds);
    Ok(Outcome::Finish { stopped_by, summary: Some(summary), files })
}

fn progress_of(current: &Current) -> Progress {
    let accuracy = current.prepared.accuracy(&current.merged);
    Progress {
        passes: current.merged.passes,
        photons: current.merged.photons,
        rays: current.merged.rays,
        seconds: current.seconds,
        relative_error: accuracy.grids.filter(|error| error.is_finite()),
        view_relative_error: accuracy.views.filter(|error| error.is_finite()),
        chunks: current.next_chunk,
    }
}

/// Reports that wait to be written together.
#[derive(Default)]
struct Reports {
    waiting: Vec<Report>,
    due: Option<Instant>,
}

impl Reports {
    fn push(&mut self, report: Report) {
        self.waiting.push(report);
        self.due.get_or_insert_with(|| Instant::now() + REPORT_DELAY);
    }

    fn is_waiting(&self) -> bool {
        self.due.is_some()
    }

    fn due(&self) -> Instant {
        self.due.unwrap_or_else(Instant::now)
    }

    fn clear(&mut self) {
        self.waiting.clear();
        self.due = None;
    }

    fn postpone(&mut self, by: Duration) {
        self.due = Some(Instant::now() + by);
    }
}

/// Up to five times, with growing pauses: what fails is a busy or full disk, and a chunk is worth waiting for.
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

fn damaged(error: ArtifactError) -> Interrupted {
    match error {
        ArtifactError::Failed(_) => Interrupted::Artifact(error),
        error => hopeless("The stored state cannot be read", error.to_string()),
    }
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

//! End of a chunk: its files and its rows are written durably.

use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use futures::{FutureExt, StreamExt, TryStreamExt};
use tokio::time::sleep;
use tokio_util::task::TaskTracker;
use tracing::Instrument;
use uuid::Uuid;

use super::chunk::{Ended, progress_of};
use super::interrupted::Interrupted;
use super::kept::Current;
use super::reports::Reports;
use crate::engine::progress::StoppedBy;
use crate::queue::artifacts::Artifacts;
use crate::queue::files::FileError;
use crate::queue::store::*;

/// Time without a heartbeat after which a worker loses its chunk.
pub(super) const LEASE: Duration = Duration::from_secs(60);

/// Time between two extensions of a lease.
pub(super) const HEARTBEAT: Duration = Duration::from_secs(15);

/// Pause after a failure of the store.
pub(super) const RETRY_PAUSE: Duration = Duration::from_secs(5);
/// Longest pause of an idle worker between two claims, for a lease that expired or a hint that was lost; otherwise hints wake it.
pub(super) const IDLE_POLL: Duration = Duration::from_secs(60);
/// Number of files of one job that are written at the same time.
const FILES_AT_ONCE: usize = 8;

/// Size of all files of a job in bytes up to which the store keeps them in rows: a folder, a file and three waits for the disk cost as much
/// as all else of a short job's end, and a longer row makes the database's log longer than the files would be.
const MOST_BYTES_IN_STORE: usize = 64 << 10;

/// Stores in which a chunk's end is written.
#[derive(Clone)]
pub(super) struct Commits {
    pub store: Arc<dyn Store>,
    pub artifacts: Artifacts,
    /// Ends of jobs that wait for the disk while other jobs are rendered.
    pub ends: TaskTracker,
}

impl Commits {
    /// Commits the end of a chunk: files first, all at once, then the row that points to them, so that the disk is waited for twice. When
    /// the job ends and a `turn` is given, another chunk is claimed in the same transaction.
    pub async fn commit(
        &self,
        lease: &Lease,
        current: &Current,
        ended: Ended,
        mut reports: Reports,
        turn: Option<Turn>,
    ) -> Result<Option<Lease>, Interrupted> {
        let progress = progress_of(current);
        let completion = match ended {
            Ended::Continue { state, ahead } => {
                let files = [("state".to_owned(), "application/octet-stream", state)];
                let state = self.put_all(lease, &files, &mut reports).await?.pop();
                let state = state.map(|file| StateFile { key: file.key, hash: file.hash });
                let state = state.ok_or_else(|| FileError::NotFound("the new checkpoint".into()))?;
                Completion::Continue { state, progress, ahead }
            }
            Ended::Finish { stopped_by, summary, files, last_pass } => {
                let reason = current.prepared.no_results(stopped_by, &current.merged);
                let problem = reason.map(|detail| JobProblem { title: "The job ran out of time".into(), detail });
                let files: Vec<_> = files.into_iter().map(|file| (file.name, file.media_type, file.bytes)).collect();
                let (in_store, in_files) = if are_small(&files) { (files, Vec::new()) } else { (Vec::new(), files) };
                let mut artifacts = self.put_all(lease, &in_files, &mut reports).await?;
                let kept = |(name, media_type, bytes)| Artifact::in_store(name, media_type, bytes);
                artifacts.extend(in_store.into_iter().map(kept));
                let end = match (stopped_by, problem) {
                    (StoppedBy::Cancelled, _) => JobEnd::Cancelled { progress },
                    (_, Some(problem)) => {
                        JobEnd::Failed { problem, stopped_by: Some(stopped_by), progress: Some(progress) }
                    }
                    (_, None) => JobEnd::Succeeded { stopped_by, progress },
                };
                Completion::Finish(Finish { end, summary, artifacts, last_pass })
            }
        };
        // retries only end the chunk, without a claim
        let mut turn = turn.filter(|_| matches!(completion, Completion::Finish(_)));
        let end_chunk = || {
            let next = turn.take().map(|turn| (LEASE, turn));
            self.store.complete_and_claim(lease, &reports.waiting, &completion, next)
        };
        let (committed, claimed) = retry(end_chunk).await?;
        if committed == Committed::LeaseLost {
            return Err(Interrupted::LeaseLost);
        }
        metrics::gauge!("skyduct_job_photons").set(progress.photons as f64);
        let Completion::Finish(finish) = completion else {
            self.settle(lease, committed).await?;
            return Ok(None);
        };
        // the next job need not wait for the disk, too
        let (commits, lease, prepared) = (self.clone(), lease.clone(), current.prepared.clone());
        let told = async move {
            if let Err(error) = commits.settle(&lease, committed).await {
                tracing::error!(%error, "the end of the job may not survive a power failure");
            }
            tracing::info!(
                name = prepared.name,
                method = prepared.method_names(),
                status = finish.end.status().name(),
                stopped_by = finish.end.stopped_by().map(StoppedBy::name),
                passes = progress.passes,
                seconds = (1e3 * progress.seconds).round() / 1e3,
                "job finished"
            );
            metrics::histogram!("skyduct_job_seconds", "status" => finish.end.status().name()).record(progress.seconds);
            metrics::counter!("skyduct_jobs_finished_total", "status" => finish.end.status().name()).increment(1);
        };
        self.ends.spawn(told.in_current_span());
        Ok(claimed)
    }

    /// Waits until the end of a chunk is durable, then deletes the files that are not needed any more.
    pub async fn settle(&self, lease: &Lease, committed: Committed) -> Result<(), StoreError> {
        retry(|| self.store.sync(lease.job)).await?;
        self.delete_obsolete(committed).await;
        Ok(())
    }

    /// Stores files (name, media type, content) and waits until they and the chunk's progress images are on the disk.
    async fn put_all(
        &self,
        lease: &Lease,
        files: &[(String, &'static str, Bytes)],
        reports: &mut Reports,
    ) -> Result<Vec<Artifact>, FileError> {
        let artifacts = retry(|| put_files(self.artifacts.clone(), lease.clone(), files.to_vec())).await?;
        let keys: Vec<String> = artifacts.iter().map(|file| &file.key).chain(&reports.files).cloned().collect();
        retry(|| self.artifacts.sync(&keys)).await?;
        reports.files.clear();
        Ok(artifacts)
    }

    /// Goes back to the last sound state, after which passes are rendered again.
    pub async fn rewind(&self, lease: &Lease, reason: &str) -> Result<(), StoreError> {
        tracing::warn!(reason, "rendering again from the last undamaged checkpoint");
        self.delete_obsolete(self.store.rewind(lease, reason).await?).await;
        Ok(())
    }

    /// Deletes files that were stored after their job had been deleted with its other files.
    pub async fn delete_files_of_deleted(&self, job: Uuid) -> Result<(), StoreError> {
        if self.store.job_head(job).await?.is_none()
            && let Err(error) = self.artifacts.delete_job(job).await
        {
            tracing::warn!(%error, "deleting files failed");
        }
        Ok(())
    }

    /// Deletes files that nothing points to any more; a failure costs only space, until a later start sweeps.
    pub async fn delete_obsolete(&self, committed: Committed) {
        let Committed::Yes { obsolete } = committed else { return };
        for key in obsolete {
            if let Err(error) = self.artifacts.delete(&key).await {
                tracing::warn!(%error, key, "deleting a file failed");
            }
        }
    }
}

/// True if all files of a job are tables that take less in the store than as files of their own.
fn are_small(files: &[(String, &'static str, Bytes)]) -> bool {
    let bytes: usize = files.iter().map(|(.., bytes)| bytes.len()).sum();
    bytes <= MOST_BYTES_IN_STORE && files.iter().all(|(_, media_type, _)| *media_type == "application/json")
}

/// Stores files of a chunk, [`FILES_AT_ONCE`] at a time.
async fn put_files(
    artifacts: Artifacts,
    lease: Lease,
    files: Vec<(String, &'static str, Bytes)>,
) -> Result<Vec<Artifact>, FileError> {
    let mut puts = Vec::with_capacity(files.len());
    for (name, media_type, bytes) in files {
        let (artifacts, lease) = (artifacts.clone(), lease.clone());
        puts.push(async move { artifacts.put_of_chunk(&lease, &name, media_type, bytes).await }.boxed());
    }
    futures::stream::iter(puts).buffered(FILES_AT_ONCE).try_collect().await
}

/// Tries an action up to five times, with growing pauses: the usual cause of a failure is a busy or full disk, and a chunk is worth the
/// wait.
pub(super) async fn retry<T, E: std::fmt::Display, F: Future<Output = Result<T, E>>>(
    mut action: impl FnMut() -> F,
) -> Result<T, E> {
    let mut pause = Duration::from_millis(100);
    for _ in 0..4 {
        match action().await {
            Ok(value) => return Ok(value),
            Err(error) => tracing::warn!(%error, "storing failed; trying again"),
        }
        sleep(pause).await;
        pause *= 3;
    }
    action().await
}

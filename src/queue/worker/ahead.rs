//! Worker that computes passes ahead of their jobs' chunks.

use std::sync::Arc;
use std::time::Duration;

use tokio::runtime::Handle;
use tokio::sync::broadcast;
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::commit::{Commits, HEARTBEAT, IDLE_POLL, LEASE, RETRY_PAUSE, retry};
use super::interrupted::{Interrupted, hopeless};
use super::open_chunks::AheadOfChunk;
use super::pool::RenderPool;
use crate::engine::ahead::Outcomes;
use crate::engine::cancel::{Stop, StopReason};
use crate::present::prepared::{Prepared, prepare};
use crate::queue::files::FileError;
use crate::queue::live::LiveJobs;
use crate::queue::store::*;
use crate::queue::uploads::Uploads;

/// Time after which the outcomes of passes are kept: about this much work is lost when a process ends.
const KEPT_AFTER: Duration = Duration::from_secs(2);

impl Commits {
    /// Reads what lies ahead of a claimed chunk whose next pass is `from`. Outcomes that cannot be read are computed again.
    pub async fn ahead_of(&self, lease: &Lease, from: u64) -> Result<AheadOfChunk, Interrupted> {
        let Ahead { outcomes, until } = self.store.ahead(lease, from).await?;
        let Some(file) = outcomes else { return Ok(AheadOfChunk { outcomes: None, until }) };
        let outcomes = match self.artifacts.read_checked(&file.key, &file.hash).await {
            Ok(bytes) => Some(bytes),
            Err(error @ (FileError::Damaged { .. } | FileError::NotFound(_))) => {
                tracing::warn!(%error, "passes that were computed ahead are computed again");
                None
            }
            Err(error) => return Err(error.into()),
        };
        Ok(AheadOfChunk { outcomes, until })
    }
}

/// Worker that computes one range of passes after the other.
pub(super) struct AheadWorker {
    pub commits: Commits,
    pub uploads: Uploads,
    pub live: Arc<LiveJobs>,
    pub pool: RenderPool,
    pub owner: String,
    pub shutdown: CancellationToken,
    /// Job of the last range.
    pub prepared: Option<(Uuid, Arc<Prepared>)>,
}

impl AheadWorker {
    /// Runs until the service shuts down.
    pub async fn run(mut self) {
        while !self.shutdown.is_cancelled() {
            // listens from before the claim, so that later changes are not missed
            let changes = self.commits.store.changes();
            match self.commits.store.claim_ahead(&self.owner, LEASE).await {
                Ok(Some(lease)) => self.work(&lease, changes).await,
                Ok(None) => self.idle(changes).await,
                Err(error) => {
                    tracing::warn!(%error, "claiming passes failed");
                    self.pause(RETRY_PAUSE).await;
                }
            }
        }
    }

    async fn pause(&self, duration: Duration) {
        tokio::select! {
            () = self.shutdown.cancelled() => {}
            () = sleep(duration) => {}
        }
    }

    async fn idle(&mut self, mut changes: broadcast::Receiver<Change>) {
        self.prepared = None;
        let stirred = async {
            while let Ok(change) = changes.recv().await {
                if change == Change::Ahead {
                    return;
                }
            }
        };
        tokio::select! {
            () = self.pause(IDLE_POLL) => {}
            () = stirred => {}
        }
    }

    #[tracing::instrument(skip_all, fields(job = %lease.job, passes = ?lease.range.passes))]
    async fn work(&mut self, lease: &AheadLease, changes: broadcast::Receiver<Change>) {
        let back = match self.compute_and_keep(lease, changes).await {
            Ok(()) | Err(Interrupted::LeaseLost) => return,
            Err(Interrupted::Shutdown) => GivenBack::ToWorkers,
            Err(reason) => {
                tracing::error!(?reason, "passes could not be computed ahead");
                GivenBack::ToChunk
            }
        };
        if let Err(error) = self.commits.store.return_ahead(lease, back).await {
            // its chunk takes it once the lease is over
            tracing::error!(%error, "returning passes to the queue failed");
        }
    }

    async fn compute_and_keep(
        &mut self,
        lease: &AheadLease,
        changes: broadcast::Receiver<Change>,
    ) -> Result<(), Interrupted> {
        let prepared = match &self.prepared {
            Some((job, prepared)) if *job == lease.job => prepared.clone(),
            _ => self.load(lease.job).await?,
        };
        self.prepared = Some((lease.job, prepared.clone()));
        let (outcomes, hash) = self.compute(lease, prepared, changes).await?;
        let Commits { store, artifacts, .. } = &self.commits;
        let key = format!("jobs/{}/ahead-{}-{}", lease.job, lease.range.passes.start, self.owner);
        retry(|| artifacts.put(&key, outcomes.bytes.clone())).await?;
        let file = StateFile { key, hash };
        if !retry(|| store.keep_ahead(lease, outcomes.passes.end, &file)).await? {
            artifacts.delete(&file.key).await?;
        }
        Ok(())
    }

    async fn load(&self, job: Uuid) -> Result<Arc<Prepared>, Interrupted> {
        if let Some(live) = self.live.get(job) {
            return Ok(live.prepared.clone());
        }
        let source = self.commits.store.job_source(job).await?.ok_or(Interrupted::LeaseLost)?;
        let meshes = self.uploads.seen_by(self.commits.store.of(source.owner));
        let meshes = meshes.for_document(Handle::current(), Arc::default());
        let prepared = self.pool.run(move || prepare(source.submitted.as_bytes(), &meshes)).await?;
        prepared.map(Arc::new).map_err(|errors| hopeless("The job cannot be prepared", errors.to_string()))
    }

    /// Computes the passes of a lease on the pool, and extends it meanwhile. Returns their outcomes with the hash of these.
    async fn compute(
        &self,
        lease: &AheadLease,
        prepared: Arc<Prepared>,
        mut changes: broadcast::Receiver<Change>,
    ) -> Result<(Outcomes, String), Interrupted> {
        let stop = Stop::default();
        let (range, stopped) = (lease.range.clone(), stop.clone());
        let mut computing = Box::pin(self.pool.run(move || {
            let outcomes = prepared.compute_ahead(&range, &stopped, KEPT_AFTER)?;
            let hash = blake3::hash(&outcomes.bytes).to_hex().to_string();
            Some((outcomes, hash))
        }));
        let mut beat = interval_at(Instant::now() + HEARTBEAT, HEARTBEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                biased;
                computed = &mut computing => {
                    let lost = if self.shutdown.is_cancelled() { Interrupted::Shutdown } else { Interrupted::LeaseLost };
                    return computed?.ok_or(lost);
                }
                () = self.shutdown.cancelled(), if stop.reason().is_none() => stop.raise(StopReason::Abandoned),
                _ = beat.tick() => self.beat(lease, &stop).await,
                change = changes.recv() => match change {
                    Ok(Change::Stop(id) | Change::Ended(id)) if id == lease.job => self.beat(lease, &stop).await,
                    Err(broadcast::error::RecvError::Lagged(_)) => self.beat(lease, &stop).await,
                    _ => {}
                },
            }
        }
    }

    async fn beat(&self, lease: &AheadLease, stop: &Stop) {
        match self.commits.store.beat_ahead(lease, LEASE).await {
            Ok(true) => {}
            Ok(false) => stop.raise(StopReason::Abandoned),
            Err(error) => tracing::warn!(%error, "renewing the lease of passes failed"),
        }
    }
}

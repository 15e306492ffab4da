//! Chunk that the pool renders: its lease is extended, and the reports of the pool are passed on.

use std::time::Duration;

use tokio::sync::{broadcast, mpsc};
use tokio::time::{Instant, MissedTickBehavior, interval_at, sleep_until};
use tokio_util::sync::CancellationToken;

use super::chunk::{ChunkRun, Ended, News};
use super::commit::{Commits, HEARTBEAT, LEASE, RETRY_PAUSE, retry};
use super::interrupted::{Interrupted, hopeless};
use super::kept::Current;
use super::open_chunks::{AheadOfChunk, OpenChunks};
use super::pool::RenderPool;
use super::reports::{REPORT_DELAY, Reports};
use crate::engine::cancel::{Stop, StopReason, deadline};
use crate::present::outputs::progress_image;
use crate::queue::store::*;

/// Leased chunk that is being rendered.
pub(super) struct RunningChunk<'a> {
    pub lease: &'a Lease,
    pub commits: &'a Commits,
    pub shutdown: &'a CancellationToken,
    pub stop: Stop,
    pub reports: Reports,
    pub ahead: AheadOfChunk,
    pub open: OpenChunks,
    /// Time after which the chunk is put aside; `None` where it is rendered to its end.
    pub slice: Option<Duration>,
}

impl RunningChunk<'_> {
    /// Renders the chunk on the pool. Returns the job after it, how it ended, and its reports that are not written yet.
    pub async fn render(
        mut self,
        pool: &RenderPool,
        current: Current,
        mut changes: broadcast::Receiver<Change>,
    ) -> Result<(Current, Ended, Reports), Interrupted> {
        let (tell, mut told) = mpsc::unbounded_channel();
        let seconds = current.prepared.stop.max_seconds - current.spent.seconds;
        // a deadline that no clock reaches never comes
        let deadline = deadline(seconds).map(Instant::from_std);
        if deadline.is_some_and(|deadline| deadline <= Instant::now()) {
            self.stop.raise(StopReason::OutOfTime);
        }
        let slice_ends = self.slice.map(|slice| Instant::now() + slice);
        let mut put_aside = None;
        let ahead = std::mem::take(&mut self.ahead);
        let run = ChunkRun { current, ahead, open: self.open, stop: self.stop.clone(), tell };
        let mut rendering = Box::pin(pool.run(move || run.run()));
        // the lease is fresh
        let mut beat = interval_at(Instant::now() + HEARTBEAT, HEARTBEAT);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut look = interval_at(Instant::now() + REPORT_DELAY, REPORT_DELAY);
        look.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let result = loop {
            let in_time = self.stop.reason().is_none();
            tokio::select! {
                biased;
                result = &mut rendering => break result,
                () = self.shutdown.cancelled(), if self.stop.reason() != Some(StopReason::Abandoned) => {
                    self.stop.raise(StopReason::Abandoned);
                }
                () = sleep_until(deadline.unwrap_or_else(Instant::now)), if in_time && deadline.is_some() => {
                    self.stop.raise(StopReason::OutOfTime);
                }
                () = sleep_until(slice_ends.unwrap_or_else(Instant::now)), if in_time && slice_ends.is_some() => {
                    put_aside = Some(1);
                    self.stop.raise(StopReason::Abandoned);
                }
                _ = beat.tick() => self.heartbeat().await,
                change = changes.recv() => match change {
                    Ok(Change::Stop(id)) if id == self.lease.job => self.heartbeat().await,
                    // those with fewer slices go first
                    Ok(Change::Queue) if in_time && self.slice.is_some() && self.lease.slices > 0 => {
                        put_aside = Some(0);
                        self.stop.raise(StopReason::Abandoned);
                    }
                    Err(broadcast::error::RecvError::Lagged(_)) => self.heartbeat().await,
                    _ => {}
                },
                // reports are only polled: most jobs end before the first look
                _ = look.tick() => {
                    self.collect(&mut told).await;
                    if self.reports.are_due() {
                        self.send().await;
                    }
                }
            }
        };
        self.collect(&mut told).await;
        let interrupted = || match put_aside {
            _ if self.shutdown.is_cancelled() => Interrupted::Shutdown,
            Some(slices) => Interrupted::PutAside(slices),
            None => Interrupted::LeaseLost,
        };
        if self.stop.reason() == Some(StopReason::Abandoned) {
            return Err(interrupted());
        }
        let (current, ended) = result?;
        match ended {
            Ok(Some(ended)) => Ok((current, ended, self.reports)),
            Ok(None) => Err(interrupted()),
            Err(error) => {
                retry(|| self.commits.store.report(self.lease, &self.reports.waiting)).await?;
                Err(hopeless("The render failed", error.to_string()))
            }
        }
    }

    async fn heartbeat(&self) {
        match self.commits.store.heartbeat(self.lease, LEASE).await {
            Ok(Beat::Keep) => {}
            Ok(Beat::Cancel) => self.stop.raise(StopReason::Cancelled),
            Ok(Beat::Lost) => self.stop.raise(StopReason::Abandoned),
            Err(error) => tracing::warn!(%error, "renewing the lease of the chunk failed"),
        }
    }

    /// Takes all reports that the pool has sent.
    async fn collect(&mut self, told: &mut mpsc::UnboundedReceiver<News>) {
        while let Ok(news) = told.try_recv() {
            self.take(news).await;
        }
    }

    async fn take(&mut self, news: News) {
        match news {
            News::Pass(pass) => {
                metrics::counter!("skyduct_passes_total").increment(1);
                self.reports.push(Report::Pass(*pass));
            }
            News::Phase(phase) => self.reports.push(Report::Phase(phase)),
            News::Images { passes, images } => {
                for (view, png) in images {
                    let name = progress_image(&view, passes);
                    match self.commits.artifacts.put_of_chunk(self.lease, &name, "image/png", png.into()).await {
                        Ok(artifact) => {
                            self.reports.files.push(artifact.key.clone());
                            self.reports.push(Report::Image { view, passes, artifact });
                        }
                        // the job is worth more than a progress image
                        Err(error) => tracing::warn!(%error, name, "storing a progress image failed"),
                    }
                }
            }
        }
    }

    async fn send(&mut self) {
        match self.commits.store.report(self.lease, &self.reports.waiting).await {
            Ok(true) => self.reports.clear(),
            Ok(false) => {
                self.stop.raise(StopReason::Abandoned);
                self.reports.clear();
            }
            Err(error) => {
                tracing::warn!(%error, "reporting passes failed");
                self.reports.postpone(RETRY_PAUSE);
            }
        }
    }
}

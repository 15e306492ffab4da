//! Work that a leased chunk needs before its passes.

use std::pin::pin;

use tokio::sync::broadcast;
use tokio::time::{Instant, interval_at};
use tokio_util::sync::CancellationToken;

use super::commit::{Commits, HEARTBEAT, LEASE};
use super::interrupted::Interrupted;
use crate::engine::cancel::{Stop, StopReason};
use crate::queue::store::*;

impl Commits {
    /// Waits for `work` and extends the lease meanwhile; a lost lease or `shutdown` ends the wait. Raises `stop` where the work is no longer
    /// wanted, which one of the `changes` may say.
    pub async fn leased<T>(
        &self,
        lease: &Lease,
        shutdown: &CancellationToken,
        (stop, changes): (&Stop, &mut broadcast::Receiver<Change>),
        work: impl Future<Output = Result<T, Interrupted>>,
    ) -> Result<T, Interrupted> {
        let mut work = pin!(work);
        // the lease is fresh
        let mut beat = interval_at(Instant::now() + HEARTBEAT, HEARTBEAT);
        loop {
            tokio::select! {
                biased;
                done = &mut work => return done,
                () = shutdown.cancelled() => {
                    stop.raise(StopReason::Abandoned);
                    return Err(Interrupted::Shutdown);
                }
                _ = beat.tick() => {}
                change = changes.recv() => match change {
                    Ok(Change::Stop(id)) if id == lease.job => {}
                    Err(broadcast::error::RecvError::Lagged(_)) => {}
                    Err(broadcast::error::RecvError::Closed) => {
                        // nothing is told any more
                        beat.tick().await;
                    }
                    Ok(_) => continue,
                },
            }
            match self.store.heartbeat(lease, LEASE).await {
                Ok(Beat::Lost) => {
                    stop.raise(StopReason::Abandoned);
                    return Err(Interrupted::LeaseLost);
                }
                Ok(Beat::Cancel) => stop.raise(StopReason::Cancelled),
                Ok(Beat::Keep) => {}
                Err(error) => tracing::warn!(%error, "renewing the lease of the chunk failed"),
            }
        }
    }
}

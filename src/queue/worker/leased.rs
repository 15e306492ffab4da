//! Work that a leased chunk needs before its passes.

use std::pin::pin;

use tokio::time::{Instant, interval_at};
use tokio_util::sync::CancellationToken;

use super::commit::{Commits, HEARTBEAT, LEASE};
use super::interrupted::Interrupted;
use crate::queue::store::*;

impl Commits {
    /// Waits for `work` and extends the lease meanwhile; a lost lease or `shutdown` ends the wait.
    pub async fn leased<T>(
        &self,
        lease: &Lease,
        shutdown: &CancellationToken,
        work: impl Future<Output = Result<T, Interrupted>>,
    ) -> Result<T, Interrupted> {
        let mut work = pin!(work);
        // the lease is fresh
        let mut beat = interval_at(Instant::now() + HEARTBEAT, HEARTBEAT);
        loop {
            tokio::select! {
                biased;
                done = &mut work => return done,
                () = shutdown.cancelled() => return Err(Interrupted::Shutdown),
                _ = beat.tick() => match self.store.heartbeat(lease, LEASE).await {
                    Ok(Beat::Lost) => return Err(Interrupted::LeaseLost),
                    // a job that is cancelled ends with its first pass
                    Ok(Beat::Keep | Beat::Cancel) => {}
                    Err(error) => tracing::warn!(%error, "renewing the lease of the chunk failed"),
                },
            }
        }
    }
}

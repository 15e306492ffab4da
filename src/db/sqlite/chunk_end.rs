//! End of a chunk with the claim of the next one, in one transaction.

use std::time::Duration;

use crate::queue::durability::Durability;
use crate::queue::store::*;

use super::sql::store_error;
use super::{SqliteStore, commit, queue};

impl SqliteStore {
    /// Ends a chunk, and claims another one for the same owner in the same transaction if `next` is given.
    pub(super) async fn end_chunk(
        &self,
        lease: &Lease,
        reports: &[Report],
        completion: &Completion,
        next: Option<(Duration, Turn)>,
    ) -> Result<(Committed, Option<Lease>), StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let committed = commit::complete(&mut tx, lease, reports, completion).await?;
        if committed == Committed::LeaseLost {
            tx.rollback().await.map_err(store_error)?;
            return Ok((committed, None));
        }
        let claimed = match next {
            Some((duration, turn)) => queue::claim(&mut tx, &lease.owner, duration, turn).await?,
            None => None,
        };
        self.commit_held(tx, lease.job).await?;
        // listeners that read the job now wait until the commit is durable
        match completion {
            Completion::Finish(_) => self.tell(Change::Ended(lease.job)),
            Completion::Continue { ahead, .. } if !ahead.is_empty() => self.tell(Change::Ahead),
            Completion::Continue { .. } => {}
        }
        self.tell(Change::Job(lease.job));
        if let Some(claimed) = &claimed {
            self.tell(Change::Job(claimed.job));
        }
        Ok((committed, claimed))
    }
}

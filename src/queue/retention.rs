//! Retention: ended jobs and sets of jobs are deleted once they are too old, or once their files take too much space, and uploaded files once they are
//! too old and no job uses them.

use std::time::Duration;

use jiff::Timestamp;
use serde::Deserialize;
use tokio_util::sync::CancellationToken;

use super::deletion::Deletion;
use super::store::{EndedFilter, StoreError};

/// Time between two searches for jobs and files to delete.
pub const PERIOD: Duration = Duration::from_secs(60);

/// Jobs or sets that are looked up at once.
const AT_ONCE: u32 = 100;

/// Milliseconds of a day.
const DAY_MS: f64 = 86_400_000.0;

/// Bounds of what is kept of ended jobs and sets of jobs; absent ones delete nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Retention {
    /// Days after its end at which a job, or a set with its jobs, is deleted, and after its last upload a file that no job uses; > 0.
    pub days: Option<f64>,
    /// Bytes that the results of all jobs may take; those that ended first are deleted first.
    pub bytes: Option<u64>,
}

/// Number of jobs, sets and uploaded files that were deleted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Deleted {
    /// Single jobs.
    pub jobs: u64,
    /// Sets, each with its jobs.
    pub sets: u64,
    /// Uploaded files.
    pub uploads: u64,
}

impl Retention {
    /// Refuses bounds that make no sense: field, bound and value.
    pub fn check(self) -> Result<(), String> {
        match self.days {
            Some(days) if days.is_nan() || days <= 0.0 => Err(format!("days: must be more than 0, but is {days}")),
            _ => Ok(()),
        }
    }

    /// Deletes what is too old at this moment, and then the oldest until the rest is small enough; ends early once `shutdown` is cancelled. A job
    /// that cannot be deleted is logged and left.
    pub async fn delete(
        self,
        from: &Deletion,
        now: Timestamp,
        shutdown: &CancellationToken,
    ) -> Result<Deleted, StoreError> {
        let mut deleted = Deleted::default();
        if let Some(days) = self.days {
            let before = now.as_millisecond() - (days * DAY_MS).min(now.as_millisecond() as f64) as i64;
            while deleted.oldest(from, Some(before), None, shutdown).await? > 0 {}
            deleted.uploads = from.unused_uploads(before).await?;
        }
        if let Some(bytes) = self.bytes {
            while deleted.oldest(from, None, Some(bytes), shutdown).await? > 0 {}
        }
        Ok(deleted)
    }
}

impl Deleted {
    /// Deletes some of what ended first: before a time in milliseconds since 1970 if one is given, and no more than until the rest takes this
    /// number of bytes. Returns how many were deleted.
    async fn oldest(
        &mut self,
        from: &Deletion,
        before: Option<i64>,
        bytes: Option<u64>,
        shutdown: &CancellationToken,
    ) -> Result<u64, StoreError> {
        if self.is_enough(from, bytes, shutdown).await? {
            return Ok(0);
        }
        let jobs = from.store.ended_jobs(EndedFilter { status: None, before, limit: AT_ONCE }).await?;
        let sets = from.store.ended_sets(before, AT_ONCE).await?;
        let jobs = jobs.into_iter().map(|ended| (ended.at, ended.id, false));
        let mut all: Vec<_> = jobs.chain(sets.into_iter().map(|ended| (ended.at, ended.id, true))).collect();
        all.sort_unstable();
        all.truncate(AT_ONCE as usize);
        let mut gone = 0;
        for (_, id, is_set) in all {
            let deleted = if is_set { from.set(id).await } else { from.job(id).await };
            match deleted {
                Ok(was_there) => {
                    let kind = if is_set { &mut self.sets } else { &mut self.jobs };
                    *kind += u64::from(was_there);
                    gone += 1;
                }
                Err(error) => tracing::warn!(%error, %id, "an ended job or set could not be deleted"),
            }
            if self.is_enough(from, bytes, shutdown).await? {
                break;
            }
        }
        Ok(gone)
    }

    /// True if nothing more must be deleted now.
    async fn is_enough(
        &self,
        from: &Deletion,
        bytes: Option<u64>,
        shutdown: &CancellationToken,
    ) -> Result<bool, StoreError> {
        let is_small = match bytes {
            Some(bytes) => from.store.stored_bytes().await? <= bytes,
            None => false,
        };
        Ok(is_small || shutdown.is_cancelled())
    }
}

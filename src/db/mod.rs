//! The store in SQL; the only place with queries.
//!
//! The SQL keeps to what SQLite and PostgreSQL share: `$n` placeholders, `UPDATE ... FROM`, `RETURNING`, `ON CONFLICT`.
//! Only the clock expression ([`now_ms`]) and the lock clause of the claim differ between the two.

mod jobs;
mod meshes;
mod queue;
mod rows;

use std::collections::HashSet;
use std::path::Path;
use std::time::Duration;

use async_trait::async_trait;
use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use sqlx::{Sqlite, SqlitePool, Transaction};
use tokio::sync::broadcast;
use uuid::Uuid;

use crate::job::run::PassReport;
use crate::job::store::*;

/// Milliseconds since 1970 by the database's clock: only this clock is ever compared with a lease.
macro_rules! now_ms {
    () => {
        "CAST(unixepoch('subsec') * 1000 AS INTEGER)"
    };
}
pub(crate) use now_ms;

/// Hints that a slow listener may miss; it is then told that it lagged, and reads the store.
const CHANGES_KEPT: usize = 1024;

/// Older versions can corrupt the database when a checkpoint meets a WAL reset.
const OLDEST_SQLITE: (u32, u32, u32) = (3, 51, 3);

/// Jobs in one SQLite file: one writing connection, several reading ones.
pub struct SqliteStore {
    writer: SqlitePool,
    readers: SqlitePool,
    changes: broadcast::Sender<Change>,
}

impl SqliteStore {
    /// Opens or creates the database file and brings its tables up to date.
    pub async fn open(file: &Path) -> Result<Self, StoreError> {
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            // NORMAL may lose the last commits when the power fails
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(Duration::from_secs(5))
            .foreign_keys(true);
        let writer = SqlitePoolOptions::new()
            .max_connections(1)
            .acquire_timeout(Duration::from_secs(10))
            .idle_timeout(None)
            .max_lifetime(None)
            .connect_with(options.clone())
            .await
            .map_err(store_error)?;
        let version: String =
            sqlx::query_scalar("SELECT sqlite_version()").fetch_one(&writer).await.map_err(store_error)?;
        check_version(&version)?;
        sqlx::migrate!("migrations/sqlite")
            .run(&writer)
            .await
            .map_err(|error| StoreError::Failed(format!("{}: {error}", file.display())))?;
        let readers = SqlitePoolOptions::new()
            .max_connections(4)
            .acquire_timeout(Duration::from_secs(10))
            .idle_timeout(None)
            .max_lifetime(None)
            .connect_with(options.read_only(true))
            .await
            .map_err(store_error)?;
        Ok(Self { writer, readers, changes: broadcast::channel(CHANGES_KEPT).0 })
    }

    /// A transaction that takes the write lock at once: a read that is followed by a write cannot be overtaken.
    async fn begin(&self) -> Result<Transaction<'static, Sqlite>, StoreError> {
        self.writer.begin_with("BEGIN IMMEDIATE").await.map_err(store_error)
    }

    fn tell(&self, change: Change) {
        // an error means that nobody listens
        let _ = self.changes.send(change);
    }

    /// Writes everything out and closes the connections.
    pub async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
    }
}

fn check_version(version: &str) -> Result<(), StoreError> {
    let mut numbers = version.split('.').map(|part| part.parse::<u32>().unwrap_or(0));
    let mut next = || numbers.next().unwrap_or(0);
    let found = (next(), next(), next());
    if found < OLDEST_SQLITE {
        let (major, minor, patch) = OLDEST_SQLITE;
        return Err(StoreError::Failed(format!(
            "SQLite {version} is linked; {major}.{minor}.{patch} or newer is needed"
        )));
    }
    Ok(())
}

fn store_error(error: sqlx::Error) -> StoreError {
    let unavailable = match &error {
        sqlx::Error::PoolTimedOut | sqlx::Error::PoolClosed | sqlx::Error::Io(_) => true,
        // SQLITE_BUSY, SQLITE_LOCKED, SQLITE_IOERR, SQLITE_FULL, SQLITE_CANTOPEN; the low byte is the primary code
        sqlx::Error::Database(database) => database
            .code()
            .and_then(|code| code.parse::<u32>().ok())
            .is_some_and(|code| matches!(code & 0xff, 5 | 6 | 10 | 13 | 14)),
        _ => false,
    };
    if unavailable { StoreError::Unavailable(error.to_string()) } else { StoreError::Failed(error.to_string()) }
}

#[async_trait]
impl Store for SqliteStore {
    fn changes(&self) -> broadcast::Receiver<Change> {
        self.changes.subscribe()
    }

    async fn ready(&self) -> Result<(), StoreError> {
        let one: i64 = sqlx::query_scalar("SELECT 1").fetch_one(&self.readers).await.map_err(store_error)?;
        debug_assert_eq!(one, 1);
        Ok(())
    }

    async fn submit(&self, job: NewJob, max_queued: u64) -> Result<Submission, StoreError> {
        let mut tx = self.begin().await?;
        let submission = jobs::submit(&mut tx, job, max_queued).await?;
        if let Submission::New(job) = &submission {
            tx.commit().await.map_err(store_error)?;
            self.tell(Change::Job(job.head.id));
            self.tell(Change::Queue);
        }
        Ok(submission)
    }

    async fn job_of_key(&self, idempotency_key: &str) -> Result<Option<Job>, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        jobs::job_of_key(&mut connection, idempotency_key).await
    }

    async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        jobs::job(&mut connection, id).await
    }

    async fn job_head(&self, id: Uuid) -> Result<Option<JobHead>, StoreError> {
        jobs::head(&self.readers, id).await
    }

    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobHead>, StoreError> {
        jobs::list(&self.readers, filter).await
    }

    async fn count(&self, status: JobStatus) -> Result<u64, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        jobs::count(&mut connection, status).await
    }

    async fn cancel(&self, id: Uuid) -> Result<CancelOutcome, StoreError> {
        let mut tx = self.begin().await?;
        let outcome = jobs::cancel(&mut tx, id).await?;
        tx.commit().await.map_err(store_error)?;
        if outcome == CancelOutcome::Accepted {
            self.tell(Change::Stop(id));
            self.tell(Change::Job(id));
        }
        Ok(outcome)
    }

    async fn delete(&self, id: Uuid) -> Result<bool, StoreError> {
        let deleted = jobs::delete(&self.writer, id).await?;
        if deleted {
            self.tell(Change::Stop(id));
            self.tell(Change::Job(id));
        }
        Ok(deleted)
    }

    async fn events(&self, id: Uuid, after: i64, limit: u32) -> Result<Vec<Event>, StoreError> {
        jobs::events(&self.readers, id, after, limit).await
    }

    async fn convergence(&self, id: Uuid) -> Result<Vec<PassReport>, StoreError> {
        jobs::convergence(&self.readers, id).await
    }

    async fn artifact(&self, id: Uuid, name: &str) -> Result<Option<Artifact>, StoreError> {
        jobs::artifact(&self.readers, id, name).await
    }

    async fn add_mesh(&self, mesh: Mesh) -> Result<Mesh, StoreError> {
        let mut tx = self.begin().await?;
        let kept = meshes::add(&mut tx, mesh).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(kept)
    }

    async fn mesh(&self, id: &str) -> Result<Option<Mesh>, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        meshes::mesh(&mut connection, id).await
    }

    async fn delete_mesh(&self, id: &str) -> Result<MeshDeletion, StoreError> {
        let mut tx = self.begin().await?;
        let deletion = meshes::delete(&mut tx, id).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(deletion)
    }

    async fn claim(&self, owner: &str, lease: Duration) -> Result<Option<Lease>, StoreError> {
        let mut tx = self.begin().await?;
        let claimed = queue::claim(&mut tx, owner, lease).await?;
        tx.commit().await.map_err(store_error)?;
        if let Some(lease) = &claimed {
            self.tell(Change::Job(lease.job));
        }
        Ok(claimed)
    }

    async fn heartbeat(&self, lease: &Lease, extend: Duration) -> Result<Beat, StoreError> {
        let mut tx = self.begin().await?;
        let beat = queue::heartbeat(&mut tx, lease, extend).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(beat)
    }

    async fn report(&self, lease: &Lease, reports: &[Report]) -> Result<bool, StoreError> {
        let mut tx = self.begin().await?;
        let held = queue::report(&mut tx, lease, reports).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Job(lease.job));
        Ok(held)
    }

    async fn complete(&self, lease: &Lease, completion: &Completion) -> Result<Committed, StoreError> {
        let mut tx = self.begin().await?;
        let committed = queue::complete(&mut tx, lease, completion).await?;
        if committed != Committed::LeaseLost {
            tx.commit().await.map_err(store_error)?;
            self.tell(Change::Job(lease.job));
        }
        Ok(committed)
    }

    async fn release(&self, lease: &Lease) -> Result<(), StoreError> {
        queue::release(&self.writer, lease).await?;
        self.tell(Change::Queue);
        Ok(())
    }

    async fn fail_attempt(&self, lease: &Lease, error: &str) -> Result<(), StoreError> {
        queue::fail_attempt(&self.writer, lease, error).await?;
        self.tell(Change::Queue);
        Ok(())
    }

    async fn reclaim(&self, all: bool) -> Result<u64, StoreError> {
        let reclaimed = queue::reclaim(&self.writer, all).await?;
        if reclaimed > 0 {
            self.tell(Change::Queue);
        }
        Ok(reclaimed)
    }

    async fn referenced_keys(&self) -> Result<HashSet<String>, StoreError> {
        jobs::referenced_keys(&self.readers).await
    }
}

#[cfg(test)]
mod tests {
    use super::check_version;

    #[test]
    fn old_sqlite_is_refused() {
        for version in ["3.51.3", "3.51.10", "3.52.0", "4.0.0"] {
            assert!(check_version(version).is_ok(), "{version}");
        }
        for version in ["3.51.2", "3.40.1", "3.6.23.1", "", "x"] {
            assert!(check_version(version).is_err(), "{version}");
        }
    }
}

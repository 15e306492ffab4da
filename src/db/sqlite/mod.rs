//! Store of jobs in SQLite.
//!
//! The SQL keeps to what SQLite and PostgreSQL share: `$n` placeholders, `UPDATE ... FROM`, `RETURNING`, `ON CONFLICT`.
//! Only the clock expression (`sql::now_ms`), the order of events of several jobs and of ranges ahead (`rowid`), and the lock clause of the
//! claim differ between the two.

mod ahead;
pub(crate) mod backup;
mod change;
mod commit;
mod guard;
mod job_sets;
mod jobs;
mod log;
mod migrations;
mod queue;
mod reserve;
mod results;
mod rows;
mod sql;
mod store;
mod uploads;

use std::fs::File;
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use sqlx::sqlite::{SqliteAutoVacuum, SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions, SqliteSynchronous};
use sqlx::{AssertSqlSafe, ConnectOptions, Connection, Executor, Sqlite, SqlitePool, Transaction};
use tokio::sync::broadcast;
use uuid::Uuid;

use self::guard::{check_names, check_version, lock};
use self::log::Log;
use self::migrations::migrations;
use self::reserve::Reserve;
use self::sql::store_error;
use crate::queue::durability::Durability;
use crate::queue::file_lock::FileLock;
use crate::queue::owner::Owner;
use crate::queue::store::*;
use crate::queue::to_its_end::to_its_end;

/// Number of changes kept for a slow listener; one that is further behind gets an error and reads the store instead.
const CHANGES_KEPT: usize = 1024;

/// Size in bytes to which the write-ahead log is cut when it begins anew: several times its usual size between two checkpoints.
const LARGEST_IDLE_LOG: u64 = 16 << 20;

/// Store of jobs in one SQLite file, with one writing connection and several reading ones; clones share them.
#[derive(Clone)]
pub struct SqliteStore {
    /// Owner whose jobs, sets and uploads are seen; `None` for all.
    owner: Option<Owner>,
    writer: SqlitePool,
    readers: SqlitePool,
    log: Arc<Log>,
    reserve: Reserve,
    changes: broadcast::Sender<Change>,
    /// Lock that keeps other processes out until the store is closed.
    lock: Arc<Mutex<Option<FileLock>>>,
    /// Largest size of the database in pages; 0 for no limit.
    most_pages: Arc<AtomicU32>,
}

impl SqliteStore {
    /// Opens or creates the database file and brings its tables up to date. Only one process at a time can have it open, by
    /// whatever path.
    pub async fn open(file: &Path) -> Result<Self, StoreError> {
        let failed = |error: &dyn std::fmt::Display| StoreError::Failed(format!("{}: {error}", file.display()));
        // SQLite makes its other files as readable as this one
        let created =
            File::options().create(true).append(true).mode(0o600).open(file).map_err(|error| failed(&error))?;
        let new = created.metadata().map_err(|error| failed(&error))?.len() == 0;
        check_names(&created, file)?;
        drop(created);
        let file = &file.canonicalize().map_err(|error| failed(&error))?;
        let lock = lock(file)?;
        let reserve = Reserve::of(file);
        reserve.give_if_needed();
        let options = SqliteConnectOptions::new()
            .filename(file)
            .create_if_missing(true)
            .journal_mode(SqliteJournalMode::Wal)
            // NORMAL may lose the last commits when the power fails
            .synchronous(SqliteSynchronous::Full)
            .busy_timeout(Duration::from_secs(5))
            // what a large transaction made of the log is given back to the disk
            .pragma("journal_size_limit", LARGEST_IDLE_LOG.to_string())
            .foreign_keys(true);
        if new {
            // must come before the first table
            let first = options.clone().auto_vacuum(SqliteAutoVacuum::Incremental).connect().await;
            first.map_err(store_error)?.close().await.map_err(store_error)?;
        }
        let writer = SqlitePoolOptions::new()
            .max_connections(1)
            // sqlx looks at each connection when it comes back, which is enough
            .test_before_acquire(false)
            .acquire_timeout(Duration::from_secs(10))
            .idle_timeout(None)
            .max_lifetime(None)
            // When the disk is full or fails, SQLite ends the transaction by itself. sqlx then still counts it as open and
            // refuses to begin another one for ever: such a connection is closed, and the next user gets a new one. So is one
            // whose rollback is still under way, which spares every other transaction a journey to its thread.
            .after_release(|connection, _| Box::pin(async move { Ok(!connection.is_in_transaction()) }))
            .connect_with(options.clone())
            .await
            .map_err(store_error)?;
        let version: String =
            sqlx::query_scalar("SELECT sqlite_version()").fetch_one(&writer).await.map_err(store_error)?;
        check_version(&version)?;
        migrations().run(&writer).await.map_err(|error| StoreError::Failed(format!("{}: {error}", file.display())))?;
        let readers = SqlitePoolOptions::new()
            .max_connections(4)
            .test_before_acquire(false)
            .acquire_timeout(Duration::from_secs(10))
            .idle_timeout(None)
            .max_lifetime(None)
            .connect_with(options.read_only(true))
            .await
            .map_err(store_error)?;
        let log = Arc::new(Log::of(file, writer.clone()));
        let changes = broadcast::channel(CHANGES_KEPT).0;
        let lock = Arc::new(Mutex::new(Some(lock)));
        Ok(Self { owner: None, writer, readers, log, reserve, changes, lock, most_pages: Arc::default() })
    }

    /// Commits a buffered write of a job, which readers of the job see once it is durable.
    async fn commit_held(&self, tx: Transaction<'static, Sqlite>, job: Uuid) -> Result<(), StoreError> {
        let log = self.log.clone();
        let commit = async move {
            let commit = log.hold(job);
            let committed = tx.commit().await.map_err(store_error);
            log.committed(job, commit);
            committed
        };
        to_its_end(commit).await
    }

    /// Begins a transaction that takes the write lock at once, so that no other write comes between a read and the write that
    /// follows it. A buffered one spares the wait for the disk: a claim that is lost leaves a chunk that is ready, and a lost report is
    /// made again.
    async fn begin(&self, durability: Durability) -> Result<Transaction<'static, Sqlite>, StoreError> {
        let statement = match durability {
            Durability::Committed => "PRAGMA synchronous = FULL; BEGIN IMMEDIATE",
            Durability::Buffered => "PRAGMA synchronous = NORMAL; BEGIN IMMEDIATE",
        };
        let mut tx = self.writer.begin_with(statement).await.map_err(store_error)?;
        let most_pages = self.most_pages.load(Ordering::Relaxed);
        if most_pages > 0 {
            let limit = format!("PRAGMA max_page_count = {most_pages}");
            tx.execute(AssertSqlSafe(limit)).await.map_err(store_error)?;
        }
        Ok(tx)
    }

    /// Begins a transaction as [`Self::begin`] does, for a change that makes space or ends what takes it: it may use the reserve of a full disk.
    async fn begin_on_full_disk(&self) -> Result<Transaction<'static, Sqlite>, StoreError> {
        self.reserve.give_if_needed();
        self.begin(Durability::Committed).await
    }

    /// Limits the database to a number of pages from now on, as a full disk would; 0 takes the limit away.
    pub fn limit_pages(&self, most_pages: u32) {
        let unlimited = 4_294_967_294;
        self.most_pages.store(if most_pages == 0 { unlimited } else { most_pages }, Ordering::Relaxed);
    }
}

//! Write-ahead log on the disk: commits wait for it together, without holding the connection that writes.
//!
//! With `synchronous = FULL`, a commit of SQLite waits for the disk while it holds the only writing connection. This takes longer
//! than a short job, and no other job could be queued, claimed or ended meanwhile. With `NORMAL`, a commit has written everything
//! to the log when it returns, and leaves out the wait alone (<https://sqlite.org/pragma.html#pragma_synchronous>). One `fdatasync`
//! of that file then makes all commits before it durable. Where the log began anew in between, the checkpoint has waited for the
//! database itself.
//!
//! Readers see a commit before it is durable. What it says of a job is held back until then: see [`Log::hold`].

use std::collections::HashMap;
use std::fs::File;
use std::io;
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use sqlx::{Row, SqlitePool};
use uuid::Uuid;

use super::sql::store_error;
use crate::queue::store::StoreError;

pub(super) struct Log {
    path: PathBuf,
    /// Locked while the disk is waited for, even when the caller has gone away.
    file: Arc<Mutex<LogFile>>,
    /// Writing connection, for a checkpoint in case the disk refuses the log.
    writer: SqlitePool,
    /// Number of waits for the disk that have begun.
    begun: AtomicU64,
    /// Number of the last wait that succeeded; locked while a wait is under way.
    safe_by: tokio::sync::Mutex<u64>,
    /// Number of commits that were held back.
    commits: AtomicU64,
    /// Jobs with a commit that may not be durable yet.
    held: Mutex<HashMap<Uuid, Held>>,
}

/// Log as a file of the disk.
#[derive(Default)]
struct LogFile {
    /// Open file: the system reports to it all failures since it was opened, even those that SQLite met first.
    open: Option<File>,
    /// True from a failure until the log begins anew: what the disk has refused it may have dropped, and another wait would succeed.
    is_refused: bool,
}

/// Newest commit of a job, held back from readers.
struct Held {
    commit: u64,
    /// Number of the last wait that may have missed the commit: one with a higher number makes it durable. `None` while the commit is
    /// under way.
    missed: Option<u64>,
}

impl Log {
    /// Creates the log of a database that no other process has open.
    pub fn of(database: &Path, writer: SqlitePool) -> Self {
        let mut file = database.as_os_str().to_owned();
        file.push("-wal");
        let (begun, commits, held) = (AtomicU64::new(0), AtomicU64::new(0), Mutex::default());
        let (path, file, safe_by) = (file.into(), Arc::default(), tokio::sync::Mutex::new(0));
        Self { path, file, writer, begun, safe_by, commits, held }
    }

    /// Returns once a wait for the disk with a number above `missed` has succeeded. Callers that wait at the same time share one sync
    /// of the disk.
    async fn wait_after(&self, missed: u64) -> Result<(), StoreError> {
        let mut safe_by = self.safe_by.lock().await;
        if *safe_by > missed {
            return Ok(());
        }
        let number = self.begun.fetch_add(1, Ordering::SeqCst) + 1;
        if self.is_refused().await? {
            self.checkpoint().await?;
            lock(&self.file).is_refused = false;
        }
        *safe_by = number;
        self.held().retain(|_, held| held.missed.is_none_or(|missed| missed >= number));
        Ok(())
    }

    fn begun(&self) -> u64 {
        self.begun.load(Ordering::SeqCst)
    }

    /// Waits for the disk; true if it refuses the log, or has done so before.
    async fn is_refused(&self) -> Result<bool, StoreError> {
        let (path, file) = (self.path.clone(), self.file.clone());
        let refused = tokio::task::spawn_blocking(move || {
            let mut file = lock(&file);
            if !file.is_refused
                && let Err(error) = file.sync(&path)
            {
                tracing::warn!(%error, file = %path.display(), "the write-ahead log cannot be synced to the disk; it is \
                                                                written into the database instead");
                file.is_refused = true;
            }
            file.is_refused
        });
        refused.await.map_err(|error| StoreError::Unavailable(error.to_string()))
    }

    /// Writes everything in the log to the database, waits for the disk, and makes the log empty: commits behind a part that the disk has
    /// lost would be lost with it.
    async fn checkpoint(&self) -> Result<(), StoreError> {
        let row = sqlx::query("PRAGMA wal_checkpoint(TRUNCATE)").fetch_one(&self.writer).await.map_err(store_error)?;
        let [busy, in_log, written] = [0, 1, 2].map(|column| row.try_get::<i64, _>(column));
        match (busy.map_err(store_error)?, in_log.map_err(store_error)?, written.map_err(store_error)?) {
            (0, in_log, written) if in_log == written => Ok(()),
            _ => Err(StoreError::Unavailable("the write-ahead log cannot be written into the database now".to_owned())),
        }
    }

    /// Holds back from readers what is committed of a job from now on, until it is durable. Returns the number of the commit.
    pub fn hold(&self, job: Uuid) -> u64 {
        let commit = self.commits.fetch_add(1, Ordering::SeqCst);
        self.held().insert(job, Held { commit, missed: None });
        commit
    }

    /// Notes that a commit that is held back has ended, well or not: the next wait that begins makes it durable. Another commit of the job
    /// may have followed meanwhile.
    pub fn committed(&self, job: Uuid, commit: u64) {
        let missed = self.begun();
        if let Some(held) = self.held().get_mut(&job).filter(|held| held.commit == commit) {
            held.missed = Some(missed);
        }
    }

    /// Returns once everything that was committed of a job, or that a caller has just read of it, is durable.
    pub async fn sync(&self, job: Uuid) -> Result<(), StoreError> {
        let missed = self.held().get(&job).map(|held| held.missed);
        match missed {
            // if the commit is under way, its part that was read is in the log already
            Some(missed) => self.wait_after(missed.unwrap_or_else(|| self.begun())).await,
            None => Ok(()),
        }
    }

    /// Waits as [`Self::sync`] does, for all jobs.
    pub async fn sync_all(&self) -> Result<(), StoreError> {
        let last = self.held().values().map(|held| held.missed.unwrap_or_else(|| self.begun())).max();
        match last {
            Some(missed) => self.wait_after(missed).await,
            None => Ok(()),
        }
    }

    fn held(&self) -> MutexGuard<'_, HashMap<Uuid, Held>> {
        lock(&self.held)
    }
}

impl LogFile {
    /// Waits until everything in the log at `path` is on the disk.
    fn sync(&mut self, path: &Path) -> io::Result<()> {
        let newest = File::open(path)?;
        // SQLite makes a new one after the last connection was closed
        let open = match self.open.take() {
            Some(open) if open.metadata()?.ino() == newest.metadata()?.ino() => open,
            _ => newest,
        };
        self.open.insert(open).sync_data()
    }
}

/// Locks a mutex, also after a panic of another thread: the data behind these locks is never left half changed.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions};
    use sqlx::{ConnectOptions, Connection};

    use super::*;

    async fn database(folder: &Path) -> (PathBuf, SqlitePool) {
        let file = folder.join("a.db");
        let options = SqliteConnectOptions::new().filename(&file).create_if_missing(true);
        let options = options.journal_mode(SqliteJournalMode::Wal).busy_timeout(Duration::ZERO);
        let writer = SqlitePoolOptions::new().max_connections(1).connect_with(options).await.unwrap();
        sqlx::query("CREATE TABLE t (x)").execute(&writer).await.unwrap();
        (file, writer)
    }

    /// Each caller waits for a sync of the disk that begins after its commit, and callers that wait meanwhile share the next one.
    #[tokio::test]
    async fn waits_are_shared() {
        let folder = tempfile::tempdir().unwrap();
        let (file, writer) = database(folder.path()).await;
        let log = Log::of(&file, writer);
        let job = Uuid::from_u128(1);
        let commit = || {
            log.committed(job, log.hold(job));
        };
        commit();
        let running = log.safe_by.lock().await;
        let waits = futures::future::join_all((0..10).map(|_| log.sync(job)));
        let all = async {
            tokio::task::yield_now().await;
            drop(running);
        };
        let (ended, ()) = tokio::join!(waits, all);
        assert!(ended.into_iter().all(|ended| ended.is_ok()));
        assert_eq!((log.begun(), *log.safe_by.lock().await), (1, 1));
        commit();
        log.sync(job).await.unwrap();
        assert_eq!(log.begun(), 2, "what may have been missed is waited for anew");
    }

    #[tokio::test]
    async fn who_reads_a_held_job_waits_once() {
        let folder = tempfile::tempdir().unwrap();
        let (file, writer) = database(folder.path()).await;
        let log = Log::of(&file, writer);
        let [job, other] = [1, 2].map(Uuid::from_u128);
        let first = log.hold(job);
        log.sync(other).await.unwrap();
        assert_eq!(log.begun(), 0);
        log.sync(job).await.unwrap();
        assert_eq!(log.begun(), 1, "its commit may be in the log");
        let commit = log.hold(job);
        log.committed(job, first);
        assert!(log.held()[&job].missed.is_none(), "the second commit is under way");
        log.committed(job, commit);
        log.sync_all().await.unwrap();
        assert_eq!(log.begun(), 2);
        assert!(log.held().is_empty(), "it is safe");
        log.sync(job).await.unwrap();
        log.sync_all().await.unwrap();
        assert_eq!(log.begun(), 2);
    }

    /// A log that the disk has refused is written into the database before a wait ends, even if the disk would take it later.
    #[tokio::test]
    async fn a_log_that_is_refused_goes_to_the_database() {
        let folder = tempfile::tempdir().unwrap();
        let (file, writer) = database(folder.path()).await;
        let mut reader = SqliteConnectOptions::new().filename(&file).connect().await.unwrap();
        let mut reading = reader.begin().await.unwrap();
        sqlx::query("SELECT * FROM t").fetch_all(&mut *reading).await.unwrap();
        sqlx::query("INSERT INTO t VALUES ('a row that is looked for')").execute(&writer).await.unwrap();
        let contains = || std::fs::read(&file).unwrap().windows(10).any(|text| text == b"a row that");
        let log = Log::of(&file, writer);
        let refused = Log { path: folder.path().join("none"), ..log };
        assert!(matches!(refused.wait_after(0).await, Err(StoreError::Unavailable(_))), "the reader needs the log");
        reading.commit().await.unwrap();
        let log = Log { path: folder.path().join("a.db-wal"), ..refused };
        assert!(!contains());
        log.wait_after(0).await.unwrap();
        assert!(contains());
        assert_eq!(std::fs::metadata(&log.path).unwrap().len(), 0, "it begins anew");
        log.wait_after(2).await.unwrap();
    }
}

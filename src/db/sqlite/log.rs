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
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use sqlx::{Row, SqlitePool};
use uuid::Uuid;

use super::sql::store_error;
use crate::queue::store::StoreError;

pub(super) struct Log {
    file: PathBuf,
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
        Self { file: file.into(), writer, begun, safe_by: tokio::sync::Mutex::new(0), commits, held }
    }

    /// Returns once a wait for the disk with a number above `missed` has succeeded. Callers that wait at the same time share one sync
    /// of the disk.
    async fn wait_after(&self, missed: u64) -> Result<(), StoreError> {
        let mut safe_by = self.safe_by.lock().await;
        if *safe_by > missed {
            return Ok(());
        }
        let number = self.begun.fetch_add(1, Ordering::SeqCst) + 1;
        if let Err(error) = self.sync_file().await {
            tracing::warn!(%error, file = %self.file.display(), "the write-ahead log cannot be synced to the disk; it \
                                                                 is written into the database instead");
            self.checkpoint().await?;
        }
        *safe_by = number;
        self.held().retain(|_, held| held.missed.is_none_or(|missed| missed >= number));
        Ok(())
    }

    fn begun(&self) -> u64 {
        self.begun.load(Ordering::SeqCst)
    }

    async fn sync_file(&self) -> std::io::Result<()> {
        let file = self.file.clone();
        tokio::task::spawn_blocking(move || File::open(file)?.sync_data()).await.map_err(std::io::Error::other)?
    }

    /// Writes everything in the log to the database and waits for the disk; a disk that has refused the log may have lost it.
    async fn checkpoint(&self) -> Result<(), StoreError> {
        let row = sqlx::query("PRAGMA wal_checkpoint(FULL)").fetch_one(&self.writer).await.map_err(store_error)?;
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
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use sqlx::sqlite::{SqliteConnectOptions, SqliteJournalMode, SqlitePoolOptions};

    use super::*;

    async fn database(folder: &Path) -> (PathBuf, SqlitePool) {
        let file = folder.join("a.db");
        let options = SqliteConnectOptions::new().filename(&file).create_if_missing(true);
        let options = options.journal_mode(SqliteJournalMode::Wal);
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

    /// A log that the disk refuses is written into the database before the wait ends.
    #[tokio::test]
    async fn a_log_that_is_refused_goes_to_the_database() {
        let folder = tempfile::tempdir().unwrap();
        let (file, writer) = database(folder.path()).await;
        sqlx::query("INSERT INTO t VALUES ('a row that is looked for')").execute(&writer).await.unwrap();
        let contains = || std::fs::read(&file).unwrap().windows(10).any(|text| text == b"a row that");
        let log = Log { file: folder.path().join("none"), ..Log::of(&file, writer) };
        assert!(!contains());
        log.wait_after(0).await.unwrap();
        assert!(contains());
    }
}

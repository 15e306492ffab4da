//! The write-ahead log on the disk: commits wait for it together, beside the connection that writes.
//!
//! A commit of SQLite with `synchronous = FULL` waits for the disk with the only writing connection in its hands, which takes longer
//! than a short job: nobody could queue, claim or end another one meanwhile. With `NORMAL` a commit has written everything to the
//! log when it returns, and leaves out the wait alone (<https://sqlite.org/pragma.html#pragma_synchronous>). One `fdatasync` of that
//! file then makes up for it, for all commits before it. Where the log began anew in between, the database itself was waited for
//! before, by the checkpoint.
//!
//! Readers see a commit before it is safe. What tells the end of a job is held back until then: see [`Log::hold`].

use std::collections::HashMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};

use sqlx::{Row, SqlitePool};
use uuid::Uuid;

use super::sql::store_error;
use crate::job::store::StoreError;

pub(super) struct Log {
    file: PathBuf,
    /// For the case that the disk refuses the log.
    writer: SqlitePool,
    /// Number of waits for the disk that have begun.
    begun: AtomicU64,
    /// Number of the last wait that ended well; locked while one goes on.
    safe_by: tokio::sync::Mutex<u64>,
    /// Jobs of which something is or was committed that may not be safe yet, with the last wait that may have missed it; `None` while
    /// the commit goes on.
    held: Mutex<HashMap<Uuid, Option<u64>>>,
}

impl Log {
    /// The log of a database, which one process has open.
    pub fn of(database: &Path, writer: SqlitePool) -> Self {
        let mut file = database.as_os_str().to_owned();
        file.push("-wal");
        let (begun, safe_by, held) = (AtomicU64::new(0), tokio::sync::Mutex::new(0), Mutex::default());
        Self { file: file.into(), writer, begun, safe_by, held }
    }

    /// Returns once everything that was committed before survives the end of the power. Who waits at the same time waits for one
    /// and the same turn of the disk.
    pub async fn wait(&self) -> Result<(), StoreError> {
        self.wait_after(self.begun()).await
    }

    /// Returns once a wait for the disk has ended well that is later than number `missed`.
    async fn wait_after(&self, missed: u64) -> Result<(), StoreError> {
        let mut safe_by = self.safe_by.lock().await;
        if *safe_by > missed {
            return Ok(());
        }
        let number = self.begun.fetch_add(1, Ordering::SeqCst) + 1;
        if let Err(error) = self.sync().await {
            tracing::warn!(%error, file = %self.file.display(), "the disk refuses the log; it is taken into the database");
            self.checkpoint().await?;
        }
        *safe_by = number;
        Ok(())
    }

    fn begun(&self) -> u64 {
        self.begun.load(Ordering::SeqCst)
    }

    async fn sync(&self) -> std::io::Result<()> {
        let file = self.file.clone();
        tokio::task::spawn_blocking(move || File::open(file)?.sync_data()).await.map_err(std::io::Error::other)?
    }

    /// Writes everything in the log to the database and waits for that: what the disk has refused once it may forget.
    async fn checkpoint(&self) -> Result<(), StoreError> {
        let row = sqlx::query("PRAGMA wal_checkpoint(FULL)").fetch_one(&self.writer).await.map_err(store_error)?;
        let [busy, in_log, written] = [0, 1, 2].map(|column| row.try_get::<i64, _>(column));
        match (busy.map_err(store_error)?, in_log.map_err(store_error)?, written.map_err(store_error)?) {
            (0, in_log, written) if in_log == written => Ok(()),
            _ => Err(StoreError::Unavailable("the log cannot be taken into the database now".to_owned())),
        }
    }

    /// What is committed of a job from now on is held back from readers until it is safe.
    pub fn hold(&self, job: Uuid) {
        self.held().insert(job, None);
    }

    /// The commit of a job that is held back has ended.
    pub fn committed(&self, job: Uuid) {
        let missed = self.begun();
        self.held().insert(job, Some(missed));
    }

    /// Nothing of the job need be held back any more.
    pub fn release(&self, job: Uuid) {
        self.held().remove(&job);
    }

    /// Of a job that was read just now: returns once what was read may be told.
    pub async fn told_of(&self, job: Uuid) -> Result<(), StoreError> {
        let held = self.held().get(&job).copied();
        match held {
            // what was read of a commit that goes on is in the log already
            Some(missed) => self.wait_after(missed.unwrap_or_else(|| self.begun())).await,
            None => Ok(()),
        }
    }

    /// As [`Self::told_of`], of any number of jobs.
    pub async fn told_of_all(&self) -> Result<(), StoreError> {
        let last = self.held().values().map(|missed| missed.unwrap_or_else(|| self.begun())).max();
        match last {
            Some(missed) => self.wait_after(missed).await,
            None => Ok(()),
        }
    }

    fn held(&self) -> MutexGuard<'_, HashMap<Uuid, Option<u64>>> {
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

    /// Each waits for a turn of the disk that begins after its commit, and those that wait meanwhile share the next one.
    #[tokio::test]
    async fn waits_are_shared() {
        let folder = tempfile::tempdir().unwrap();
        let (file, writer) = database(folder.path()).await;
        let log = Log::of(&file, writer);
        let running = log.safe_by.lock().await;
        let waits = futures::future::join_all((0..10).map(|_| log.wait()));
        let all = async {
            tokio::task::yield_now().await;
            drop(running);
        };
        let (ended, ()) = tokio::join!(waits, all);
        assert!(ended.into_iter().all(|ended| ended.is_ok()));
        assert_eq!((log.begun(), *log.safe_by.lock().await), (1, 1));
        log.wait().await.unwrap();
        assert_eq!(log.begun(), 2, "what may have been missed is waited for anew");
    }

    #[tokio::test]
    async fn who_reads_a_held_job_waits_once() {
        let folder = tempfile::tempdir().unwrap();
        let (file, writer) = database(folder.path()).await;
        let log = Log::of(&file, writer);
        let [job, other] = [1, 2].map(Uuid::from_u128);
        log.hold(job);
        log.told_of(other).await.unwrap();
        assert_eq!(log.begun(), 0);
        log.told_of(job).await.unwrap();
        assert_eq!(log.begun(), 1, "its commit may be in the log");
        log.committed(job);
        log.told_of_all().await.unwrap();
        assert_eq!(log.begun(), 2);
        log.told_of(job).await.unwrap();
        assert_eq!(log.begun(), 2, "it is safe");
        log.release(job);
        log.told_of_all().await.unwrap();
        assert_eq!(log.begun(), 2);
    }

    /// Where the disk refuses the log, its content is in the database when the wait ends.
    #[tokio::test]
    async fn a_log_that_is_refused_goes_to_the_database() {
        let folder = tempfile::tempdir().unwrap();
        let (file, writer) = database(folder.path()).await;
        sqlx::query("INSERT INTO t VALUES ('a row that is looked for')").execute(&writer).await.unwrap();
        let contains = || std::fs::read(&file).unwrap().windows(10).any(|text| text == b"a row that");
        let log = Log { file: folder.path().join("none"), ..Log::of(&file, writer) };
        assert!(!contains());
        log.wait().await.unwrap();
        assert!(contains());
    }
}

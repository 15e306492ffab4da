//! Copy of a database that may be in use: the service can write to the original meanwhile.

use std::collections::HashSet;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::Duration;

use sqlx::sqlite::SqliteConnectOptions;
use sqlx::{ConnectOptions, Connection, SqliteConnection};

use super::results;
use super::sql::{now_ms, store_error};
use crate::queue::store::StoreError;

/// A copy of a database as it was at one moment.
pub struct DatabaseCopy {
    copy: SqliteConnection,
    original: SqliteConnection,
}

/// Numbers of a copy's rows and files that do not fit together.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Missing {
    /// Number of jobs and uploads that the original has deleted since the copy was made; they are removed from the copy, too.
    pub deleted: u64,
    /// Number of missing files whose job or upload the original still has: its results are damaged.
    pub damaged: u64,
}

impl DatabaseCopy {
    /// Copies the database in `from` to the file `to`, which must not exist. Commits that are made meanwhile are not in the copy.
    pub async fn make(from: &Path, to: &Path) -> Result<Self, StoreError> {
        let failed = |error: &dyn std::fmt::Display| StoreError::Failed(format!("{}: {error}", from.display()));
        let options = |file: &Path| {
            SqliteConnectOptions::new().filename(file).foreign_keys(true).busy_timeout(Duration::from_secs(5))
        };
        let mut original = options(from).connect().await.map_err(|error| failed(&error))?;
        let copied = sqlx::query("VACUUM INTO $1").bind(to.to_string_lossy()).execute(&mut original).await;
        copied.map_err(|error| failed(&error))?;
        // only the owner may read the database and the files that SQLite makes beside it
        std::fs::set_permissions(to, std::fs::Permissions::from_mode(0o600)).map_err(|error| failed(&error))?;
        let copy = options(to).connect().await.map_err(store_error)?;
        Ok(Self { copy, original })
    }

    /// Returns the keys of the files to which rows of the copy refer.
    pub async fn referenced_keys(&mut self) -> Result<HashSet<String>, StoreError> {
        results::referenced_keys(&mut self.copy).await
    }

    /// Counts the jobs in the copy.
    pub async fn jobs(&mut self) -> Result<u64, StoreError> {
        let count: i64 =
            sqlx::query_scalar("SELECT count(*) FROM jobs").fetch_one(&mut self.copy).await.map_err(store_error)?;
        Ok(count.unsigned_abs())
    }

    /// Removes jobs and uploads with a file among the missing ones (`keys`) from the copy, if the original has deleted them
    /// meanwhile. Missing checkpoints of running jobs are ignored: those jobs continue from an earlier one.
    pub async fn without(&mut self, keys: &[String]) -> Result<Missing, StoreError> {
        let mut missing = Missing::default();
        for key in keys {
            for (user, count, delete) in [
                (
                    "SELECT job_id FROM artifacts WHERE key = $1",
                    "SELECT count(*) FROM jobs WHERE id = $1",
                    "DELETE FROM jobs WHERE id = $1",
                ),
                (
                    "SELECT key FROM uploads WHERE key = $1",
                    "SELECT count(*) FROM uploads WHERE key = $1",
                    "DELETE FROM uploads WHERE key = $1",
                ),
            ] {
                let user: Option<String> =
                    sqlx::query_scalar(user).bind(key).fetch_optional(&mut self.copy).await.map_err(store_error)?;
                let Some(user) = user else { continue };
                let known: i64 =
                    sqlx::query_scalar(count).bind(&user).fetch_one(&mut self.original).await.map_err(store_error)?;
                if known > 0 {
                    missing.damaged += 1;
                    continue;
                }
                sqlx::query(delete).bind(&user).execute(&mut self.copy).await.map_err(store_error)?;
                missing.deleted += 1;
            }
        }
        Ok(missing)
    }

    /// Gives the copy an identity of its own and closes it, marked as if the service before had ended well.
    pub async fn finish(mut self, identity: &str) -> Result<(), StoreError> {
        let identified = sqlx::query(concat!("UPDATE store SET identity = $1, serving = 0, written_at = ", now_ms!()))
            .bind(identity)
            .execute(&mut self.copy)
            .await
            .map_err(store_error)?;
        if identified.rows_affected() == 0 {
            return Err(StoreError::Failed(
                "no service of this version has used the database yet: start one on it, then make the backup"
                    .to_owned(),
            ));
        }
        self.copy.close().await.map_err(store_error)?;
        self.original.close().await.map_err(store_error)
    }
}

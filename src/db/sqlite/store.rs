//! Implementation of [`Store`]: the store as a whole, and the record that it keeps of itself.

use std::io;
use std::sync::{Arc, PoisonError};

use async_trait::async_trait;
use sqlx::Row;
use tokio::sync::broadcast;

use super::SqliteStore;
use super::sql::{Scope, Statement, now_ms, run, store_error};
use crate::queue::durability::Durability;
use crate::queue::owner::Owner;
use crate::queue::store::*;

/// Statement that records the present as the time of the newest write.
pub(super) const WRITTEN_NOW: &str = concat!("UPDATE store SET written_at = ", now_ms!());

impl SqliteStore {
    pub(super) fn scope(&self) -> Scope<'_> {
        self.owner.as_ref()
    }

    pub(super) fn tell(&self, change: Change) {
        // an error means that nobody listens
        let _ = self.changes.send(change);
    }

    /// Runs a statement in a transaction of its own, and returns the number of rows that it has changed.
    pub(super) async fn write(&self, durability: Durability, statement: Statement<'_>) -> Result<u64, StoreError> {
        let mut tx = self.begin(durability).await?;
        let rows = run(statement, &mut *tx).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(rows)
    }
}

#[async_trait]
impl Store for SqliteStore {
    fn of(&self, owner: Owner) -> Arc<dyn Store> {
        Arc::new(Self { owner: Some(owner), ..self.clone() })
    }

    async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
        self.lock.lock().unwrap_or_else(PoisonError::into_inner).take();
    }

    fn changes(&self) -> broadcast::Receiver<Change> {
        self.changes.subscribe()
    }

    async fn ready(&self) -> Result<(), StoreError> {
        self.write(Durability::Committed, sqlx::query(WRITTEN_NOW)).await?;
        Ok(())
    }

    async fn keep_reserve(&self) -> Result<(), StoreError> {
        let reserve = self.reserve.clone();
        let kept = tokio::task::spawn_blocking(move || reserve.keep()).await;
        kept.map_err(io::Error::other).flatten().map_err(|error| StoreError::Unavailable(error.to_string()))
    }

    async fn record(&self) -> Result<StoreRecord, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        let newest_write_ms: i64 = sqlx::query_scalar(
            "SELECT max(coalesce((SELECT max(written_at) FROM store), 0), coalesce((SELECT max(created_at) FROM uploads), 0), \
             coalesce((SELECT max(max(created_at, coalesce(started_at, 0), coalesce(finished_at, 0))) FROM jobs), 0))",
        )
        .fetch_one(&mut *connection)
        .await
        .map_err(store_error)?;
        let row = sqlx::query("SELECT identity, serving, sweep_from FROM store")
            .fetch_optional(&mut *connection)
            .await
            .map_err(store_error)?;
        // without a row it is not recorded how the process before ended
        let Some(row) = row else { return Ok(StoreRecord { newest_write_ms, ..StoreRecord::default() }) };
        Ok(StoreRecord {
            identity: Some(row.try_get("identity").map_err(store_error)?),
            ended_well: row.try_get::<i64, _>("serving").map_err(store_error)? == 0,
            newest_write_ms,
            sweep_from_ms: row.try_get("sweep_from").map_err(store_error)?,
        })
    }

    async fn set_identity(&self, identity: &str) -> Result<(), StoreError> {
        let query = concat!(
            "INSERT INTO store (only_row, identity, written_at) VALUES (1, $1, ",
            now_ms!(),
            ") ON CONFLICT (only_row) DO UPDATE SET identity = excluded.identity"
        );
        self.write(Durability::Committed, sqlx::query(query).bind(identity)).await?;
        Ok(())
    }

    async fn set_sweep_from(&self, milliseconds: i64) -> Result<(), StoreError> {
        let query = sqlx::query("UPDATE store SET sweep_from = $1").bind(milliseconds);
        self.write(Durability::Committed, query).await?;
        Ok(())
    }

    async fn set_serving(&self, serving: bool) -> Result<(), StoreError> {
        let query = concat!("UPDATE store SET serving = $1, written_at = ", now_ms!());
        self.write(Durability::Committed, sqlx::query(query).bind(i64::from(serving))).await?;
        Ok(())
    }

    async fn check(&self) -> Result<(), StoreError> {
        let found: String =
            sqlx::query_scalar("PRAGMA quick_check(1)").fetch_one(&self.readers).await.map_err(store_error)?;
        if found == "ok" { Ok(()) } else { Err(StoreError::Failed(format!("the database is damaged: {found}"))) }
    }
}

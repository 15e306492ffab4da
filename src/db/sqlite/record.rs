//! Record that the store keeps of itself: its identity, how its last process ended, and when it was last written to.

use sqlx::{Row, SqliteConnection};

use crate::queue::store::*;

use super::sql::{now_ms, run, store_error};

pub(super) async fn record(connection: &mut SqliteConnection) -> Result<StoreRecord, StoreError> {
    let newest: i64 = sqlx::query_scalar(
        "SELECT max(coalesce((SELECT max(written_at) FROM store), 0), coalesce((SELECT max(created_at) FROM uploads), 0), \
         coalesce((SELECT max(max(created_at, coalesce(started_at, 0), coalesce(finished_at, 0))) FROM jobs), 0))",
    )
    .fetch_one(&mut *connection)
    .await
    .map_err(store_error)?;
    let row = sqlx::query("SELECT identity, serving, sweep_from FROM store")
        .fetch_optional(connection)
        .await
        .map_err(store_error)?;
    let Some(row) = row else {
        // it is not recorded how the process before ended
        return Ok(StoreRecord { newest_write_ms: newest, ..StoreRecord::default() });
    };
    Ok(StoreRecord {
        identity: Some(row.try_get("identity").map_err(store_error)?),
        ended_well: row.try_get::<i64, _>("serving").map_err(store_error)? == 0,
        newest_write_ms: newest,
        sweep_from_ms: row.try_get("sweep_from").map_err(store_error)?,
    })
}

pub(super) async fn set_identity(tx: &mut SqliteConnection, identity: &str) -> Result<(), StoreError> {
    let query = sqlx::query(concat!(
        "INSERT INTO store (only_row, identity, written_at) VALUES (1, $1, ",
        now_ms!(),
        ") ON CONFLICT (only_row) DO UPDATE SET identity = excluded.identity"
    ))
    .bind(identity);
    run(query, tx).await?;
    Ok(())
}

pub(super) async fn set_sweep_from(tx: &mut SqliteConnection, milliseconds: i64) -> Result<(), StoreError> {
    run(sqlx::query("UPDATE store SET sweep_from = $1").bind(milliseconds), tx).await?;
    Ok(())
}

pub(super) async fn set_serving(tx: &mut SqliteConnection, serving: bool) -> Result<(), StoreError> {
    let query =
        sqlx::query(concat!("UPDATE store SET serving = $1, written_at = ", now_ms!())).bind(i64::from(serving));
    run(query, tx).await?;
    Ok(())
}

/// Records the present as the time of the newest write, by a small write.
pub(super) async fn written_now(tx: &mut SqliteConnection) -> Result<(), StoreError> {
    run(sqlx::query(concat!("UPDATE store SET written_at = ", now_ms!())), tx).await?;
    Ok(())
}

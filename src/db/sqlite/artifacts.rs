//! Files of jobs.

use std::collections::HashSet;

use sqlx::{SqliteExecutor, SqlitePool};
use uuid::Uuid;

use crate::queue::store::*;

use super::rows;
use super::sql::{Scope, all, bound, count_of, of_job_in_scope, one, store_error};

pub(super) async fn artifact(
    pool: &SqlitePool,
    scope: Scope<'_>,
    id: Uuid,
    name: &str,
) -> Result<Option<Artifact>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT name, key, hash, size, media_type, content FROM artifacts WHERE ",
        of_job_in_scope!(),
        " AND name = $3"
    ))
    .bind(id.to_string())
    .bind(bound(scope))
    .bind(name);
    one(query, pool, rows::artifact).await
}

pub(super) async fn artifacts(pool: &SqlitePool, scope: Scope<'_>, id: Uuid) -> Result<Vec<Artifact>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT name, key, hash, size, media_type, content FROM artifacts WHERE ",
        of_job_in_scope!(),
        " ORDER BY name"
    ))
    .bind(id.to_string())
    .bind(bound(scope));
    all(query, pool, rows::artifact).await
}

pub(super) async fn referenced_keys(database: impl SqliteExecutor<'_>) -> Result<HashSet<String>, StoreError> {
    let keys: Vec<String> = sqlx::query_scalar(
        "SELECT key FROM artifacts WHERE content IS NULL UNION SELECT key FROM uploads UNION SELECT state_key FROM jobs WHERE state_key IS NOT NULL \
         UNION SELECT previous_state_key FROM jobs WHERE previous_state_key IS NOT NULL \
         UNION SELECT key FROM passes_ahead WHERE key IS NOT NULL",
    )
    .fetch_all(database)
    .await
    .map_err(store_error)?;
    Ok(keys.into_iter().collect())
}

/// Bytes of the files of all jobs.
pub(super) async fn stored_bytes(pool: &SqlitePool) -> Result<u64, StoreError> {
    count_of(sqlx::query("SELECT coalesce(sum(size), 0) FROM artifacts"), pool).await
}

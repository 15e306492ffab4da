//! Files of jobs.

use std::collections::HashSet;

use sqlx::{SqliteExecutor, SqlitePool};
use uuid::Uuid;

use crate::queue::store::*;

use super::rows;
use super::sql::{Scope, bound, of_job_in_scope, store_error};

pub(super) async fn artifact(
    pool: &SqlitePool,
    scope: Scope<'_>,
    id: Uuid,
    name: &str,
) -> Result<Option<Artifact>, StoreError> {
    sqlx::query(concat!(
        "SELECT name, key, hash, size, media_type, content FROM artifacts WHERE ",
        of_job_in_scope!(),
        " AND name = $3"
    ))
    .bind(id.to_string())
    .bind(bound(scope))
    .bind(name)
    .fetch_optional(pool)
    .await
    .map_err(store_error)?
    .as_ref()
    .map(rows::artifact)
    .transpose()
}

pub(super) async fn artifacts(pool: &SqlitePool, scope: Scope<'_>, id: Uuid) -> Result<Vec<Artifact>, StoreError> {
    sqlx::query(concat!(
        "SELECT name, key, hash, size, media_type, content FROM artifacts WHERE ",
        of_job_in_scope!(),
        " ORDER BY name"
    ))
    .bind(id.to_string())
    .bind(bound(scope))
    .fetch_all(pool)
    .await
    .map_err(store_error)?
    .iter()
    .map(rows::artifact)
    .collect()
}

pub(super) async fn referenced_keys(database: impl SqliteExecutor<'_>) -> Result<HashSet<String>, StoreError> {
    let keys: Vec<String> = sqlx::query_scalar(
        "SELECT key FROM artifacts WHERE content IS NULL UNION SELECT key FROM meshes UNION SELECT state_key FROM jobs WHERE state_key IS NOT NULL \
         UNION SELECT previous_state_key FROM jobs WHERE previous_state_key IS NOT NULL",
    )
    .fetch_all(database)
    .await
    .map_err(store_error)?;
    Ok(keys.into_iter().collect())
}

/// Bytes of the files of all jobs.
pub(super) async fn stored_bytes(pool: &SqlitePool) -> Result<u64, StoreError> {
    let bytes: i64 = sqlx::query_scalar("SELECT coalesce(sum(size), 0) FROM artifacts")
        .fetch_one(pool)
        .await
        .map_err(store_error)?;
    Ok(bytes.unsigned_abs())
}

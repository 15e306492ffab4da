//! Chunks: claimed with a lease, kept by heartbeats, completed once.
//!
//! Every statement of a chunk names its owner and attempt: whoever lost the lease changes no row.

use std::time::Duration;

use serde_json::json;
use sqlx::{Row, SqliteConnection, SqlitePool};

use crate::job::store::*;

use super::jobs::{add_artifact, append_event, insert_chunk};
use super::rows::{self, name_of, signed, to_json};
use super::{now_ms, store_error};

/// Appended to the claim's inner query on PostgreSQL: `FOR UPDATE OF c SKIP LOCKED`.
macro_rules! lock_clause {
    () => {
        ""
    };
}

pub(super) async fn claim(
    tx: &mut SqliteConnection,
    owner: &str,
    lease: Duration,
) -> Result<Option<Lease>, StoreError> {
    let row = sqlx::query(concat!(
        "WITH pick AS (SELECT c.job_id, c.idx FROM chunks c JOIN jobs j ON j.id = c.job_id \
         WHERE c.state = 'ready' AND j.status IN ('queued', 'running') ORDER BY c.job_id, c.idx LIMIT 1 ",
        lock_clause!(),
        ") UPDATE chunks SET state = 'leased', attempt = attempt + 1, owner = $1, lease_until = ",
        now_ms!(),
        " + $2 FROM pick WHERE chunks.job_id = pick.job_id AND chunks.idx = pick.idx \
         RETURNING chunks.job_id, chunks.idx, chunks.attempt, chunks.failures"
    ))
    .bind(owner)
    .bind(milliseconds(lease))
    .fetch_optional(&mut *tx)
    .await
    .map_err(store_error)?;
    let Some(row) = row else { return Ok(None) };
    let chunk: i64 = row.try_get(1).map_err(store_error)?;
    let lease = Lease {
        job: rows::uuid(&row, "job_id")?,
        chunk: chunk.unsigned_abs(),
        owner: owner.to_owned(),
        attempt: row.try_get(2).map_err(store_error)?,
        failures: row.try_get::<i64, _>(3).map_err(store_error)?.unsigned_abs(),
    };
    let job = lease.job.to_string();
    let started = sqlx::query(concat!(
        "UPDATE jobs SET status = 'running', started_at = ",
        now_ms!(),
        " WHERE id = $1 AND status = 'queued'"
    ))
    .bind(&job)
    .execute(&mut *tx)
    .await
    .map_err(store_error)?
    .rows_affected();
    if started > 0 {
        append_event(tx, &job, "started", &json!({})).await?;
    }
    Ok(Some(lease))
}

pub(super) async fn heartbeat(tx: &mut SqliteConnection, lease: &Lease, extend: Duration) -> Result<Beat, StoreError> {
    let cancel: Option<i64> = sqlx::query_scalar(concat!(
        "UPDATE chunks SET lease_until = ",
        now_ms!(),
        " + $5 WHERE job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased' \
         RETURNING (SELECT cancel FROM jobs WHERE jobs.id = chunks.job_id)"
    ))
    .bind(lease.job.to_string())
    .bind(signed(lease.chunk))
    .bind(&lease.owner)
    .bind(lease.attempt)
    .bind(milliseconds(extend))
    .fetch_optional(tx)
    .await
    .map_err(store_error)?;
    Ok(match cancel {
        None => Beat::Lost,
        Some(0) => Beat::Keep,
        Some(_) => Beat::Cancel,
    })
}

pub(super) async fn report(tx: &mut SqliteConnection, lease: &Lease, reports: &[Report]) -> Result<bool, StoreError> {
    if !holds(tx, lease).await? {
        return Ok(false);
    }
    let job = lease.job.to_string();
    // a pass that is rendered again after a restart is the same pass: its event was sent
    let mut newest: i64 = sqlx::query_scalar("SELECT coalesce(max(pass), 0) FROM passes WHERE job_id = $1")
        .bind(&job)
        .fetch_one(&mut *tx)
        .await
        .map_err(store_error)?;
    let mut last = None;
    for report in reports {
        match report {
            Report::Pass(pass) => {
                sqlx::query(
                    "INSERT INTO passes (job_id, pass, seconds, photons, rays, relative_error, view_relative_error, mean_lux) \
                     VALUES ($1, $2, $3, $4, $5, $6, $7, $8) ON CONFLICT (job_id, pass) DO UPDATE SET \
                     seconds = excluded.seconds, photons = excluded.photons, rays = excluded.rays, \
                     relative_error = excluded.relative_error, view_relative_error = excluded.view_relative_error, \
                     mean_lux = excluded.mean_lux",
                )
                .bind(&job)
                .bind(signed(pass.passes))
                .bind(pass.seconds)
                .bind(signed(pass.photons))
                .bind(signed(pass.rays))
                .bind(pass.relative_error)
                .bind(pass.view_relative_error)
                .bind(pass.mean_lux)
                .execute(&mut *tx)
                .await
                .map_err(store_error)?;
                if signed(pass.passes) > newest {
                    newest = signed(pass.passes);
                    append_event(tx, &job, "pass", &json!(pass)).await?;
                }
                last = Some(*pass);
            }
            Report::Image { view, passes, artifact } => {
                let known: Option<i64> = sqlx::query_scalar("SELECT 1 FROM artifacts WHERE job_id = $1 AND name = $2")
                    .bind(&job)
                    .bind(&artifact.name)
                    .fetch_optional(&mut *tx)
                    .await
                    .map_err(store_error)?;
                add_artifact(tx, &job, artifact).await?;
                if known.is_none() {
                    append_event(tx, &job, "image", &json!({ "view": view, "passes": passes })).await?;
                }
            }
        }
    }
    if let Some(pass) = last {
        sqlx::query(
            "UPDATE jobs SET passes = $2, photons = $3, rays = $4, seconds = $5, relative_error = $6, \
             view_relative_error = $7 WHERE id = $1",
        )
        .bind(&job)
        .bind(signed(pass.passes))
        .bind(signed(pass.photons))
        .bind(signed(pass.rays))
        .bind(pass.seconds)
        .bind(pass.relative_error)
        .bind(pass.view_relative_error)
        .execute(tx)
        .await
        .map_err(store_error)?;
    }
    Ok(true)
}

async fn holds(tx: &mut SqliteConnection, lease: &Lease) -> Result<bool, StoreError> {
    let held: Option<i64> = sqlx::query_scalar(
        "SELECT 1 FROM chunks WHERE job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased'",
    )
    .bind(lease.job.to_string())
    .bind(signed(lease.chunk))
    .bind(&lease.owner)
    .bind(lease.attempt)
    .fetch_optional(tx)
    .await
    .map_err(store_error)?;
    Ok(held.is_some())
}

pub(super) async fn complete(
    tx: &mut SqliteConnection,
    lease: &Lease,
    completion: &Completion,
) -> Result<Committed, StoreError> {
    let job = lease.job.to_string();
    let done = sqlx::query(
        "UPDATE chunks SET state = 'done', owner = NULL, lease_until = NULL \
         WHERE job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased'",
    )
    .bind(&job)
    .bind(signed(lease.chunk))
    .bind(&lease.owner)
    .bind(lease.attempt)
    .execute(&mut *tx)
    .await
    .map_err(store_error)?
    .rows_affected();
    if done == 0 {
        return Ok(Committed::LeaseLost);
    }
    let obsolete: Option<String> = sqlx::query_scalar("SELECT state_key FROM jobs WHERE id = $1")
        .bind(&job)
        .fetch_one(&mut *tx)
        .await
        .map_err(store_error)?;
    match completion {
        Completion::Continue { state, progress, next_index, next } => {
            set_progress(tx, &job, progress).await?;
            sqlx::query("UPDATE jobs SET state_key = $2, state_hash = $3, merged_seconds = $4 WHERE id = $1")
                .bind(&job)
                .bind(&state.key)
                .bind(&state.hash)
                .bind(progress.seconds)
                .execute(&mut *tx)
                .await
                .map_err(store_error)?;
            insert_chunk(tx, &job, *next_index, next).await?;
        }
        Completion::Finish(finish) => finish_job(tx, &job, finish).await?,
    }
    Ok(Committed::Yes { obsolete })
}

async fn finish_job(tx: &mut SqliteConnection, job: &str, finish: &Finish) -> Result<(), StoreError> {
    if let Some(progress) = &finish.progress {
        set_progress(tx, job, progress).await?;
    }
    for artifact in &finish.artifacts {
        add_artifact(tx, job, artifact).await?;
    }
    let summary = finish.summary.as_ref().map(to_json).transpose()?;
    let problem = finish.problem.as_ref().map(to_json).transpose()?;
    let stopped_by = finish.stopped_by.as_ref().map(name_of).transpose()?;
    sqlx::query(concat!(
        "UPDATE jobs SET status = $2, stopped_by = $3, summary = COALESCE($4, summary), problem = $5, state_key = NULL, state_hash = NULL, \
         finished_at = ",
        now_ms!(),
        " WHERE id = $1"
    ))
    .bind(job)
    .bind(finish.status.name())
    .bind(stopped_by)
    .bind(summary)
    .bind(problem)
    .execute(&mut *tx)
    .await
    .map_err(store_error)?;
    let data = match &finish.problem {
        Some(problem) => json!({ "problem": problem }),
        None => json!({ "stopped_by": finish.stopped_by, "progress": finish.progress }),
    };
    append_event(tx, job, finish.status.name(), &data).await
}

async fn set_progress(tx: &mut SqliteConnection, job: &str, progress: &Progress) -> Result<(), StoreError> {
    sqlx::query(
        "UPDATE jobs SET passes = $2, photons = $3, rays = $4, seconds = $5, relative_error = $6, \
         view_relative_error = $7, chunks_done = $8 WHERE id = $1",
    )
    .bind(job)
    .bind(signed(progress.passes))
    .bind(signed(progress.photons))
    .bind(signed(progress.rays))
    .bind(progress.seconds)
    .bind(progress.relative_error)
    .bind(progress.view_relative_error)
    .bind(signed(progress.chunks))
    .execute(tx)
    .await
    .map_err(store_error)?;
    Ok(())
}

pub(super) async fn release(pool: &SqlitePool, lease: &Lease) -> Result<(), StoreError> {
    sqlx::query(
        "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL \
         WHERE job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased'",
    )
    .bind(lease.job.to_string())
    .bind(signed(lease.chunk))
    .bind(&lease.owner)
    .bind(lease.attempt)
    .execute(pool)
    .await
    .map_err(store_error)?;
    Ok(())
}

pub(super) async fn fail_attempt(pool: &SqlitePool, lease: &Lease, error: &str) -> Result<(), StoreError> {
    sqlx::query(
        "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL, failures = failures + 1, error = $5 \
         WHERE job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased'",
    )
    .bind(lease.job.to_string())
    .bind(signed(lease.chunk))
    .bind(&lease.owner)
    .bind(lease.attempt)
    .bind(error)
    .execute(pool)
    .await
    .map_err(store_error)?;
    Ok(())
}

pub(super) async fn reclaim(pool: &SqlitePool, all: bool) -> Result<u64, StoreError> {
    let reclaimed = sqlx::query(concat!(
        "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL \
         WHERE state = 'leased' AND ($1 = 1 OR lease_until < ",
        now_ms!(),
        ")"
    ))
    .bind(i64::from(all))
    .execute(pool)
    .await
    .map_err(store_error)?
    .rows_affected();
    Ok(reclaimed)
}

fn milliseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_millis()).unwrap_or(i64::MAX)
}

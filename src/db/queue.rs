//! Chunks: claimed with a lease, kept by heartbeats, completed once.
//!
//! Every statement of a chunk names its owner and attempt: whoever lost the lease changes no row.

use std::time::Duration;

use serde_json::json;
use sqlx::{QueryBuilder, Row, SqliteConnection};
use uuid::Uuid;

use crate::job::convergence::is_kept;
use crate::job::run::PassReport;
use crate::job::store::*;

use super::jobs::{ROWS_OF_A_STATEMENT, add_artifact, append_event, append_events, insert_chunk};
use super::record::written_now;
use super::rows::{self, name_of, signed, to_json};
use super::{now_ms, store_error};

/// Appended to the claim's inner query on PostgreSQL: `FOR UPDATE OF c SKIP LOCKED`.
macro_rules! lock_clause {
    () => {
        ""
    };
}

/// Whether a chunk is free: given back, left by a lease that is over, or by this owner itself, who renders one at a time.
macro_rules! free {
    () => {
        concat!("c.deaths <= $3 AND (c.state = 'ready' OR c.owner = $1 OR c.lease_until < ", now_ms!(), ")")
    };
}

/// The waiting chunk that comes next, by $1 (owner), $3 (most deaths) and $4 (job to stay with, or null). The index
/// `chunks_open` gives the order.
macro_rules! next_chunk {
    () => {
        concat!(
            "SELECT job_id, idx FROM (\
             SELECT * FROM (SELECT c.job_id, c.idx, 0 AS choice FROM chunks c \
             WHERE c.job_id = $4 AND c.state <> 'done' AND ",
            free!(),
            " LIMIT 1) UNION ALL \
             SELECT * FROM (SELECT c.job_id, c.idx, 1 AS choice FROM chunks c WHERE c.state <> 'done' AND ",
            free!(),
            " ORDER BY c.line, c.turn, c.job_id LIMIT 1)) ORDER BY choice LIMIT 1 "
        )
    };
}

pub(super) async fn claim(
    tx: &mut SqliteConnection,
    owner: &str,
    lease: Duration,
    turn: Turn,
) -> Result<Option<Lease>, StoreError> {
    let row = sqlx::query(concat!(
        "WITH pick AS (",
        next_chunk!(),
        lock_clause!(),
        ") UPDATE chunks SET state = 'leased', attempt = attempt + 1, progressed = 0, owner = $1, lease_until = ",
        now_ms!(),
        " + $2 FROM pick WHERE chunks.job_id = pick.job_id AND chunks.idx = pick.idx \
         RETURNING chunks.job_id, chunks.idx, chunks.attempt, chunks.failures"
    ))
    .bind(owner)
    .bind(milliseconds(lease))
    .bind(signed(turn.most_deaths))
    .bind(turn.stay_with.map(|job| job.to_string()))
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
    take_reports(tx, lease, reports).await?;
    take_progress(tx, lease, reports).await?;
    Ok(true)
}

/// Rows and events of a lease that is held; answers the newest pass that has a row.
async fn take_reports(tx: &mut SqliteConnection, lease: &Lease, reports: &[Report]) -> Result<i64, StoreError> {
    let job = lease.job.to_string();
    // a pass that is rendered again after a restart is the same pass: its event was sent
    let mut newest = newest_pass(tx, &job).await?;
    let (mut kept, mut events) = (Vec::new(), Vec::new());
    for report in reports {
        match report {
            Report::Pass(pass) if is_kept(pass.passes) => {
                kept.push(pass);
                if signed(pass.passes) > newest {
                    newest = signed(pass.passes);
                    events.push(("pass", json!(pass)));
                }
            }
            Report::Pass(_) => {}
            Report::Image { view, passes, artifact } => {
                let known: Option<i64> = sqlx::query_scalar("SELECT 1 FROM artifacts WHERE job_id = $1 AND name = $2")
                    .bind(&job)
                    .bind(&artifact.name)
                    .fetch_optional(&mut *tx)
                    .await
                    .map_err(store_error)?;
                add_artifact(tx, &job, artifact).await?;
                if known.is_none() {
                    events.push(("image", json!({ "view": view, "passes": passes })));
                }
            }
        }
    }
    add_passes(tx, &job, &kept).await?;
    append_events(tx, &job, &events).await?;
    Ok(newest)
}

/// How far a lease that is held has come.
async fn take_progress(tx: &mut SqliteConnection, lease: &Lease, reports: &[Report]) -> Result<(), StoreError> {
    let job = lease.job.to_string();
    let passes = reports.iter().rev().find_map(|report| match report {
        Report::Pass(pass) => Some(pass),
        Report::Image { .. } => None,
    });
    let Some(pass) = passes else { return Ok(()) };
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
    .execute(&mut *tx)
    .await
    .map_err(store_error)?;
    sqlx::query(
        "UPDATE chunks SET progressed = 1, deaths = 0, reached = $3 WHERE job_id = $1 AND idx = $2 AND reached < $3",
    )
    .bind(&job)
    .bind(signed(lease.chunk))
    .bind(signed(pass.passes))
    .execute(tx)
    .await
    .map_err(store_error)?;
    Ok(())
}

/// A row of the convergence table, and its event unless that was sent before: a pass that is rendered again after a
/// restart is the same pass.
async fn newest_pass(tx: &mut SqliteConnection, job: &str) -> Result<i64, StoreError> {
    sqlx::query_scalar("SELECT coalesce(max(pass), 0) FROM passes WHERE job_id = $1")
        .bind(job)
        .fetch_one(tx)
        .await
        .map_err(store_error)
}

/// Rows of the convergence table; one that is there already is written anew.
async fn add_passes(tx: &mut SqliteConnection, job: &str, passes: &[&PassReport]) -> Result<(), StoreError> {
    for passes in passes.chunks(ROWS_OF_A_STATEMENT) {
        let mut insert = QueryBuilder::new(
            "INSERT INTO passes (job_id, pass, seconds, photons, rays, relative_error, view_relative_error, mean_lux) ",
        );
        insert.push_values(passes, |mut row, pass| {
            row.push_bind(job)
                .push_bind(signed(pass.passes))
                .push_bind(pass.seconds)
                .push_bind(signed(pass.photons))
                .push_bind(signed(pass.rays))
                .push_bind(pass.relative_error)
                .push_bind(pass.view_relative_error)
                .push_bind(pass.mean_lux);
        });
        insert.push(
            " ON CONFLICT (job_id, pass) DO UPDATE SET seconds = excluded.seconds, photons = excluded.photons, \
             rays = excluded.rays, relative_error = excluded.relative_error, \
             view_relative_error = excluded.view_relative_error, mean_lux = excluded.mean_lux",
        );
        insert.build().execute(&mut *tx).await.map_err(store_error)?;
    }
    Ok(())
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
    reports: &[Report],
    completion: &Completion,
) -> Result<Committed, StoreError> {
    if !holds(tx, lease).await? {
        return Ok(Committed::LeaseLost);
    }
    let newest = take_reports(tx, lease, reports).await?;
    // with its progress a chunk that is done says all that its reports say
    if matches!(completion, Completion::Finish(Finish { progress: None, .. })) {
        take_progress(tx, lease, reports).await?;
    }
    let job = lease.job.to_string();
    sqlx::query(
        "UPDATE chunks SET state = 'done', owner = NULL, lease_until = NULL, deaths = 0 WHERE job_id = $1 AND idx = $2",
    )
    .bind(&job)
    .bind(signed(lease.chunk))
    .execute(&mut *tx)
    .await
    .map_err(store_error)?;
    let states = states(tx, &job).await?;
    let obsolete = match completion {
        Completion::Continue { state, progress, next_index, next } => {
            set_progress(tx, &job, progress).await?;
            // the right-hand sides are the values before
            sqlx::query(
                "UPDATE jobs SET previous_state_key = state_key, previous_state_hash = state_hash, \
                 previous_seconds = merged_seconds, state_key = $2, state_hash = $3, merged_seconds = $4 WHERE id = $1",
            )
            .bind(&job)
            .bind(&state.key)
            .bind(&state.hash)
            .bind(progress.seconds)
            .execute(&mut *tx)
            .await
            .map_err(store_error)?;
            insert_chunk(tx, &job, *next_index, next).await?;
            states.previous.into_iter().map(|state| state.key).collect()
        }
        Completion::Finish(finish) => {
            finish_job(tx, &job, finish, newest).await?;
            states.keys()
        }
    };
    written_now(tx).await?;
    Ok(Committed::Yes { obsolete })
}

/// The stored states of a running job.
struct States {
    newest: Option<StateFile>,
    previous: Option<StateFile>,
    previous_seconds: f64,
}

impl States {
    fn keys(self) -> Vec<String> {
        [self.newest, self.previous].into_iter().flatten().map(|state| state.key).collect()
    }
}

async fn states(tx: &mut SqliteConnection, job: &str) -> Result<States, StoreError> {
    let row = sqlx::query(
        "SELECT state_key, state_hash, previous_state_key, previous_state_hash, previous_seconds FROM jobs WHERE id = $1",
    )
    .bind(job)
    .fetch_one(tx)
    .await
    .map_err(store_error)?;
    let file = |key: &str, hash: &str| -> Result<Option<StateFile>, StoreError> {
        let (key, hash): (Option<String>, Option<String>) = (rows::get(&row, key)?, rows::get(&row, hash)?);
        Ok(key.zip(hash).map(|(key, hash)| StateFile { key, hash }))
    };
    Ok(States {
        newest: file("state_key", "state_hash")?,
        previous: file("previous_state_key", "previous_state_hash")?,
        previous_seconds: rows::get(&row, "previous_seconds")?,
    })
}

pub(super) async fn rewind(tx: &mut SqliteConnection, lease: &Lease, reason: &str) -> Result<Committed, StoreError> {
    if !holds(tx, lease).await? {
        return Ok(Committed::LeaseLost);
    }
    let job = lease.job.to_string();
    let mut states = states(tx, &job).await?;
    let (state, chunk, seconds) = match states.previous.take() {
        Some(state) => (Some(state), lease.chunk.saturating_sub(1), states.previous_seconds),
        None => (None, 0, 0.0),
    };
    sqlx::query("DELETE FROM chunks WHERE job_id = $1 AND idx > $2")
        .bind(&job)
        .bind(signed(chunk))
        .execute(&mut *tx)
        .await
        .map_err(store_error)?;
    let kept_passes: i64 = sqlx::query_scalar(
        "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL, failures = 0, deaths = 0, error = $3 \
         WHERE job_id = $1 AND idx = $2 RETURNING pass_from",
    )
    .bind(&job)
    .bind(signed(chunk))
    .bind(reason)
    .fetch_one(&mut *tx)
    .await
    .map_err(store_error)?;
    let (key, hash) = state.map(|state| (state.key, state.hash)).unzip();
    sqlx::query(
        "UPDATE jobs SET state_key = $2, state_hash = $3, merged_seconds = $4, seconds = $4, chunks_done = $5, passes = $6, \
         previous_state_key = NULL, previous_state_hash = NULL, previous_seconds = 0 WHERE id = $1",
    )
    .bind(&job)
    .bind(key)
    .bind(hash)
    .bind(seconds)
    .bind(signed(chunk))
    .bind(kept_passes)
    .execute(&mut *tx)
    .await
    .map_err(store_error)?;
    append_event(tx, &job, "restarted", &json!({ "from_pass": kept_passes + 1, "reason": reason })).await?;
    Ok(Committed::Yes { obsolete: states.keys() })
}

/// `newest`: the newest pass that has a row.
async fn finish_job(tx: &mut SqliteConnection, job: &str, finish: &Finish, newest: i64) -> Result<(), StoreError> {
    if let Some(progress) = &finish.progress {
        set_progress(tx, job, progress).await?;
    }
    if let Some(pass) = &finish.last_pass {
        // no later pass than the last one is there: with its row it has had its event
        if newest < signed(pass.passes) {
            add_passes(tx, job, &[pass]).await?;
            append_event(tx, job, "pass", &json!(pass)).await?;
        }
    }
    for artifact in &finish.artifacts {
        add_artifact(tx, job, artifact).await?;
    }
    let summary = finish.summary.as_ref().map(to_json).transpose()?;
    let problem = finish.problem.as_ref().map(to_json).transpose()?;
    let stopped_by = finish.stopped_by.as_ref().map(name_of).transpose()?;
    sqlx::query(concat!(
        "UPDATE jobs SET status = $2, stopped_by = $3, summary = COALESCE($4, summary), problem = $5, state_key = NULL, \
         state_hash = NULL, previous_state_key = NULL, previous_state_hash = NULL, finished_at = ",
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

pub(super) async fn release(tx: &mut SqliteConnection, lease: &Lease) -> Result<(), StoreError> {
    sqlx::query(
        "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL \
         WHERE job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased'",
    )
    .bind(lease.job.to_string())
    .bind(signed(lease.chunk))
    .bind(&lease.owner)
    .bind(lease.attempt)
    .execute(tx)
    .await
    .map_err(store_error)?;
    Ok(())
}

pub(super) async fn fail_attempt(tx: &mut SqliteConnection, lease: &Lease, error: &str) -> Result<(), StoreError> {
    sqlx::query(
        "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL, failures = failures + 1, error = $5 \
         WHERE job_id = $1 AND idx = $2 AND owner = $3 AND attempt = $4 AND state = 'leased'",
    )
    .bind(lease.job.to_string())
    .bind(signed(lease.chunk))
    .bind(&lease.owner)
    .bind(lease.attempt)
    .bind(error)
    .execute(tx)
    .await
    .map_err(store_error)?;
    Ok(())
}

pub(super) async fn take_back(tx: &mut SqliteConnection, died: bool) -> Result<TakenBack, StoreError> {
    let ready = sqlx::query(
        "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL, \
         deaths = CASE WHEN $1 = 0 THEN deaths WHEN progressed = 1 THEN 0 ELSE deaths + 1 END, \
         turn = CASE WHEN $1 = 0 OR progressed = 1 THEN turn \
         ELSE (SELECT max(o.turn) + 1 FROM chunks o WHERE o.state <> 'done') END \
         WHERE state = 'leased' AND state <> 'done'",
    )
    .bind(i64::from(died))
    .execute(&mut *tx)
    .await
    .map_err(store_error)?
    .rows_affected();
    let given_up: Vec<String> =
        sqlx::query_scalar("UPDATE chunks SET state = 'done' WHERE state <> 'done' AND deaths >= $1 RETURNING job_id")
            .bind(signed(MAX_DEATHS))
            .fetch_all(&mut *tx)
            .await
            .map_err(store_error)?;
    let mut failed = Vec::new();
    for job in given_up {
        let finish = Finish {
            status: JobStatus::Failed,
            stopped_by: None,
            progress: None,
            summary: None,
            problem: Some(JobProblem {
                title: "The process died".into(),
                detail: format!("the process died {MAX_DEATHS} times while rendering it"),
            }),
            artifacts: Vec::new(),
            last_pass: None,
        };
        let newest = newest_pass(tx, &job).await?;
        finish_job(tx, &job, &finish, newest).await?;
        failed.extend(Uuid::parse_str(&job));
    }
    Ok(TakenBack { ready: ready - failed.len() as u64, failed })
}

fn milliseconds(duration: Duration) -> i64 {
    i64::try_from(duration.as_millis()).unwrap_or(i64::MAX)
}

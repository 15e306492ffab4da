//! Writes of a claimed chunk: its reports while it runs, and its end.
//!
//! The first statement of each write names the lease's owner and attempt, so that a worker that has lost the lease changes no row.

use sqlx::{Row, SqliteConnection};

use crate::engine::convergence::is_kept;
use crate::engine::progress::{PassReport, StoppedBy};
use crate::engine::spent::Spent;
use crate::queue::events::{Cancelled, EventData, Failed, Image, Pass, Phase, Restarted, Succeeded};
use crate::queue::store::*;

use super::ahead::keys_before;
use super::change::{JobChange, Line};
use super::rows::{self, to_json};
use super::sql::{count_of, first, held, now_ms, of_lease, one, run, signed, store_error};

/// Writes rows and events of a running chunk; returns false when the lease is lost.
pub(super) async fn report(tx: &mut SqliteConnection, lease: &Lease, reports: &[Report]) -> Result<bool, StoreError> {
    let last = last_pass(reports);
    let query = concat!(
        "UPDATE chunks SET progressed = CASE WHEN reached < $5 THEN 1 ELSE progressed END, \
         deaths = CASE WHEN reached < $5 THEN 0 ELSE deaths END, reached = CASE WHEN reached < $5 THEN $5 ELSE reached END \
         WHERE ",
        held!(),
        " RETURNING (SELECT coalesce(max(pass), 0) FROM passes WHERE passes.job_id = chunks.job_id)"
    );
    let reached = last.map_or(0, |pass| signed(pass.passes));
    let newest: Option<i64> = one(of_lease(query, lease).bind(reached), &mut *tx, first).await?;
    let Some(newest) = newest else { return Ok(false) };
    let job = lease.job.to_string();
    let mut change = JobChange::new(&job);
    take_reports(tx, &job, &mut change, newest, reports, None).await?;
    if let Some(pass) = last {
        change.set_pass(pass);
    }
    change.write(tx).await?;
    Ok(true)
}

fn last_pass(reports: &[Report]) -> Option<&PassReport> {
    reports.iter().rev().find_map(|report| match report {
        Report::Pass(pass) => Some(&pass.report),
        Report::Image { .. } | Report::Phase(_) => None,
    })
}

/// Adds the rows and events of reports to the change, and those of the last pass of a job that ends. `newest` is the newest pass
/// that has a row: the event of a pass that is rendered again after a restart is not sent again.
async fn take_reports<'a>(
    tx: &mut SqliteConnection,
    job: &str,
    change: &mut JobChange<'a>,
    mut newest: i64,
    reports: &'a [Report],
    last: Option<&'a Pass>,
) -> Result<(), StoreError> {
    for report in reports {
        match report {
            Report::Pass(pass) if is_kept(pass.report.passes) => {
                change.pass(&pass.report);
                if signed(pass.report.passes) > newest {
                    newest = signed(pass.report.passes);
                    change.event(pass)?;
                }
            }
            Report::Pass(_) => {}
            Report::Image { view, passes, artifact } => {
                let query = sqlx::query("SELECT 1 FROM artifacts WHERE job_id = $1 AND name = $2")
                    .bind(job)
                    .bind(&artifact.name);
                let known: Option<i64> = one(query, &mut *tx, first).await?;
                change.artifact(artifact);
                if known.is_none() {
                    change.event(&Image { view: view.clone(), passes: *passes })?;
                }
            }
            Report::Phase(phase) => {
                let query =
                    sqlx::query("SELECT 1 FROM events WHERE job_id = $1 AND name = $2").bind(job).bind(Phase::NAME);
                let known: Option<i64> = one(query, &mut *tx, first).await?;
                if known.is_none() {
                    change.event(phase)?;
                }
            }
        }
    }
    // the last pass has its row and event, whether or not passes are thinned there
    if let Some(pass) = last.filter(|pass| signed(pass.report.passes) > newest) {
        change.pass(&pass.report).event(pass)?;
    }
    Ok(())
}

/// Ends a chunk, and either its job with it, or queues the job's next chunk.
pub(super) async fn complete(
    tx: &mut SqliteConnection,
    lease: &Lease,
    reports: &[Report],
    completion: &Completion,
) -> Result<Committed, StoreError> {
    let query = concat!(
        "UPDATE chunks SET state = 'done', owner = NULL, lease_until = NULL, deaths = 0 WHERE ",
        held!(),
        " RETURNING (SELECT coalesce(max(pass), 0) FROM passes WHERE passes.job_id = chunks.job_id), \
         (SELECT state_key FROM jobs WHERE jobs.id = chunks.job_id), \
         (SELECT previous_state_key FROM jobs WHERE jobs.id = chunks.job_id), \
         EXISTS (SELECT 1 FROM passes_ahead WHERE passes_ahead.job_id = chunks.job_id)"
    );
    let ended = of_lease(query, lease).fetch_optional(&mut *tx).await.map_err(store_error)?;
    let Some(ended) = ended else { return Ok(Committed::LeaseLost) };
    let newest: i64 = ended.try_get(0).map_err(store_error)?;
    let state: Option<String> = ended.try_get(1).map_err(store_error)?;
    let previous: Option<String> = ended.try_get(2).map_err(store_error)?;
    let before = match completion {
        Completion::Continue { progress, .. } => signed(progress.passes),
        Completion::Finish(_) => i64::MAX,
    };
    let obsolete = match ended.try_get::<i64, _>(3).map_err(store_error)? {
        0 => Vec::new(),
        _ => keys_before(tx, &lease.job.to_string(), before).await?,
    };

    let job = lease.job.to_string();
    let mut change = JobChange::new(&job);
    change.written_now();
    let states: Vec<String> = match completion {
        Completion::Continue { state, progress, ahead } => {
            take_reports(tx, &job, &mut change, newest, reports, None).await?;
            change
                .chunk([progress.chunks, progress.passes], Line::Later)
                .ahead(before, ahead)
                .set_progress(progress)
                .set_sql("previous_state_key = state_key, previous_state_hash = state_hash")
                .set_sql("previous_seconds = merged_seconds, previous_cpu_seconds = merged_cpu_seconds")
                .set("state_key", &state.key)
                .set("state_hash", &state.hash)
                .set("merged_seconds", progress.seconds)
                .set("merged_cpu_seconds", progress.cpu_seconds);
            change.write(tx).await?;
            previous.into_iter().collect()
        }
        Completion::Finish(finish) => {
            if let (None, Some(pass)) = (finish.end.progress(), last_pass(reports)) {
                change.set_pass(pass);
            }
            take_reports(tx, &job, &mut change, newest, reports, finish.last_pass.as_deref()).await?;
            finish_job(tx, change, finish).await?;
            state.into_iter().chain(previous).collect()
        }
    };
    Ok(Committed::Yes { obsolete: states.into_iter().chain(obsolete).collect() })
}

/// Ends a job, and writes everything else that changes in its row.
pub(super) async fn finish_job<'a>(
    tx: &mut SqliteConnection,
    mut change: JobChange<'a>,
    finish: &'a Finish,
) -> Result<(), StoreError> {
    for artifact in &finish.artifacts {
        change.artifact(artifact);
    }
    if let Some(progress) = finish.end.progress() {
        change.set_progress(progress);
    }
    if let Some(summary) = &finish.summary {
        change.set("summary", to_json(summary)?);
    }
    change
        .set("status", finish.end.status().name())
        .set("stopped_by", finish.end.stopped_by().map(StoppedBy::name))
        .set("problem", finish.end.problem().map(to_json).transpose()?)
        .set_sql("state_key = NULL, state_hash = NULL, previous_state_key = NULL, previous_state_hash = NULL")
        .set_sql(concat!("finished_at = ", now_ms!()))
        .ahead(i64::MAX, &[]);
    match finish.end.clone() {
        JobEnd::Succeeded { stopped_by, progress } => change.event(&Succeeded { stopped_by, progress })?,
        JobEnd::Cancelled { progress } => change.event(&Cancelled { stopped_by: StoppedBy::Cancelled, progress })?,
        JobEnd::Failed { problem, .. } => change.event(&Failed { problem })?,
    };
    change.write(tx).await
}

/// Stored checkpoints of a running job.
struct States {
    newest: Option<StateFile>,
    previous: Option<StateFile>,
    previous_spent: Spent,
}

impl States {
    fn keys(self) -> Vec<String> {
        [self.newest, self.previous].into_iter().flatten().map(|state| state.key).collect()
    }
}

/// Reads the job's checkpoints; `None` when the lease is lost.
async fn states(tx: &mut SqliteConnection, lease: &Lease) -> Result<Option<States>, StoreError> {
    let query = concat!(
        "SELECT state_key, state_hash, previous_state_key, previous_state_hash, previous_seconds, \
         previous_cpu_seconds FROM jobs WHERE id = $1 AND EXISTS (SELECT 1 FROM chunks WHERE ",
        held!(),
        ")"
    );
    let row = of_lease(query, lease).fetch_optional(tx).await.map_err(store_error)?;
    let Some(row) = row else { return Ok(None) };
    let file = |key: &str, hash: &str| -> Result<Option<StateFile>, StoreError> {
        let (key, hash): (Option<String>, Option<String>) = (rows::get(&row, key)?, rows::get(&row, hash)?);
        Ok(key.zip(hash).map(|(key, hash)| StateFile { key, hash }))
    };
    Ok(Some(States {
        newest: file("state_key", "state_hash")?,
        previous: file("previous_state_key", "previous_state_hash")?,
        previous_spent: Spent {
            seconds: rows::get(&row, "previous_seconds")?,
            cpu_seconds: rows::get(&row, "previous_cpu_seconds")?,
        },
    }))
}

/// Returns the number of the last chunk before this one that has a row, whose end was committed last; short chunks have none.
async fn chunk_before(tx: &mut SqliteConnection, lease: &Lease) -> Result<u64, StoreError> {
    count_of(
        sqlx::query("SELECT coalesce(max(idx), 0) FROM chunks WHERE job_id = $1 AND idx < $2")
            .bind(lease.job.to_string())
            .bind(signed(lease.chunk)),
        tx,
    )
    .await
}

/// Goes back to the checkpoint before the newest one, which is damaged, or to the start when there is none.
pub(super) async fn rewind(tx: &mut SqliteConnection, lease: &Lease, reason: &str) -> Result<Committed, StoreError> {
    let Some(mut states) = states(tx, lease).await? else { return Ok(Committed::LeaseLost) };
    let job = lease.job.to_string();
    let (state, chunk, spent) = match states.previous.take() {
        Some(state) => (Some(state), chunk_before(tx, lease).await?, states.previous_spent),
        None => (None, 0, Spent::NOTHING),
    };
    let query = sqlx::query("DELETE FROM chunks WHERE job_id = $1 AND idx > $2").bind(&job).bind(signed(chunk));
    run(query, &mut *tx).await?;
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
    let mut change = JobChange::new(&job);
    change
        .set("state_key", key)
        .set("state_hash", hash)
        .set("merged_seconds", spent.seconds)
        .set("merged_cpu_seconds", spent.cpu_seconds)
        .set("seconds", spent.seconds)
        .set("cpu_seconds", spent.cpu_seconds)
        .set("chunks_done", signed(chunk))
        .set("passes", kept_passes)
        .set_sql(
            "previous_state_key = NULL, previous_state_hash = NULL, previous_seconds = 0, previous_cpu_seconds = 0",
        )
        .event(&Restarted { from_pass: kept_passes.unsigned_abs() + 1, reason: reason.to_owned() })?;
    change.write(tx).await?;
    Ok(Committed::Yes { obsolete: states.keys() })
}

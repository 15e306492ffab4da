//! Jobs: their rows.

use sqlx::{QueryBuilder, SqliteConnection, SqliteExecutor, SqlitePool};
use uuid::Uuid;

use crate::document::Warning;
use crate::document::result::Known;
use crate::engine::progress::{Progress, StoppedBy};
use crate::queue::durability::Durability;
use crate::queue::events::{Cancelled, PlannedBesidePlan, Queued};
use crate::queue::owner::Owner;
use crate::queue::store::*;

use super::change::{JobChange, Line};
use super::rows::{self, head_columns, job_columns, signed, to_json, to_value};
use super::sql::{Scope, all, bound, count_of, first, in_scope, now_ms, of_job_in_scope, one, run};

pub(super) async fn submit(
    tx: &mut SqliteConnection,
    new: NewJob,
    most: MostWaiting,
) -> Result<Submission, StoreError> {
    if let Some(key) = &new.idempotency_key
        && let Some(job) = job_of_key(&mut *tx, Some(&new.owner), key).await?
    {
        return Ok(if job.body_hash == new.body_hash { Submission::Repeated(job) } else { Submission::KeyReused });
    }
    let row = NewRow {
        id: new.id,
        owner: &new.owner,
        name: new.name.as_deref(),
        submitted: &new.submitted,
        document: to_json(&new.document)?,
        plan: to_json(&new.plan)?,
        set: None,
        warnings: &new.warnings,
        idempotency_key: new.idempotency_key.as_deref(),
        body_hash: &new.body_hash,
        computation: new.computation.as_deref(),
        known: &new.known,
        predictions: new.predictions.as_ref().map(to_json).transpose()?,
        line: Line::First,
        client: &new.client,
        uploads: &new.uploads,
    };
    let created_at = match insert(tx, row, most).await? {
        Inserted::At(created_at) => created_at,
        Inserted::QueueFull => return Ok(Submission::QueueFull),
        Inserted::ClientFull => return Ok(Submission::ClientFull),
        Inserted::UploadGone(id) => return Ok(Submission::UploadGone(id)),
    };
    let job = Job {
        head: JobHead {
            id: new.id,
            name: new.name,
            status: JobStatus::Queued,
            cancel_requested: false,
            progress: Progress::default(),
            stopped_by: None,
            last_seq: 2,
            created_at,
            started_at: None,
            finished_at: None,
        },
        document: new.document,
        plan: to_value(&new.plan)?,
        warnings: new.warnings,
        body_hash: new.body_hash,
        summary: Some(to_value(&new.known)?),
        predictions: new.predictions,
        problem: None,
    };
    Ok(Submission::New(job, Durability::Buffered))
}

/// Row of a job to be queued, with its long columns as they are stored.
pub(super) struct NewRow<'a> {
    pub id: Uuid,
    pub owner: &'a Owner,
    pub name: Option<&'a str>,
    pub submitted: &'a str,
    pub document: String,
    pub plan: String,
    /// Id of the set that has the fields missing in `submitted`, `document` and `plan`.
    pub set: Option<String>,
    pub warnings: &'a [Warning],
    pub idempotency_key: Option<&'a str>,
    pub body_hash: &'a str,
    pub computation: Option<&'a str>,
    pub known: &'a Known,
    pub predictions: Option<String>,
    pub line: Line,
    pub client: &'a str,
    pub uploads: &'a [String],
}

/// Outcome of the insertion of a job's row.
pub(super) enum Inserted {
    /// Time at which the job was queued, in milliseconds since 1970.
    At(i64),
    QueueFull,
    ClientFull,
    UploadGone(String),
}

/// Queues a job. Unless it returns [`Inserted::At`], the transaction must be rolled back.
pub(super) async fn insert(
    tx: &mut SqliteConnection,
    row: NewRow<'_>,
    most: MostWaiting,
) -> Result<Inserted, StoreError> {
    let id_text = row.id.to_string();
    let mut insert = QueryBuilder::new(
        "INSERT INTO jobs (id, owner, name, status, submitted, document, plan, set_id, warnings, idempotency_key, body_hash, \
         computation, summary, predictions, client, created_at) SELECT ",
    );
    insert
        .push_bind(&id_text)
        .push(", ")
        .push_bind(row.owner.name())
        .push(", ")
        .push_bind(row.name)
        .push(", 'queued', ")
        .push_bind(row.submitted);
    insert.push(", ").push_bind(row.document).push(", ").push_bind(row.plan).push(", ").push_bind(row.set);
    insert.push(", ").push_bind(to_json(&row.warnings)?);
    insert.push(", ").push_bind(row.idempotency_key).push(", ").push_bind(row.body_hash);
    insert.push(", ").push_bind(row.computation);
    insert.push(", ").push_bind(to_json(row.known)?);
    insert.push(", ").push_bind(row.predictions).push(", ").push_bind(row.client);
    // one of them is rendered, or will be at once
    insert.push(concat!(", ", now_ms!(), " WHERE (SELECT count(*) FROM chunks WHERE state <> 'done') <= "));
    insert.push_bind(signed(most.jobs));
    insert.push(" AND (SELECT count(*) FROM chunks WHERE state <> 'done' AND client = ").push_bind(row.client);
    insert.push(") <= ").push_bind(signed(most.of_client)).push(" RETURNING created_at; ");
    let queued = Queued { job: row.id, name: row.name.map(str::to_owned) };
    let planned = PlannedBesidePlan { warnings: row.warnings, known: row.known };
    let mut change = JobChange::after(&id_text, insert);
    change.chunk([0, 0], row.line).event(&queued)?.event(&planned)?;
    let created = change.write_and_fetch(tx).await?;
    let Some(created) = created.first() else {
        let full = unfinished_of(&mut *tx, row.client).await? > most.of_client;
        return Ok(if full { Inserted::ClientFull } else { Inserted::QueueFull });
    };
    let created_at: i64 = rows::get(created, "created_at")?;
    for upload in row.uploads {
        let query =
            sqlx::query("SELECT 1 FROM uploads WHERE id = $1 AND owner = $2").bind(upload).bind(row.owner.name());
        let known: Option<i64> = one(query, &mut *tx, first).await?;
        if known.is_none() {
            return Ok(Inserted::UploadGone(upload.clone()));
        }
        let query = sqlx::query("INSERT INTO job_uploads (job_id, upload_id) VALUES ($1, $2) ON CONFLICT DO NOTHING")
            .bind(&id_text)
            .bind(upload);
        run(query, &mut *tx).await?;
    }
    Ok(Inserted::At(created_at))
}

pub(super) async fn job_of_key(
    database: impl SqliteExecutor<'_>,
    scope: Scope<'_>,
    key: &str,
) -> Result<Option<Job>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT ",
        head_columns!(),
        ", ",
        job_columns!(),
        " FROM jobs WHERE idempotency_key = $1 AND ",
        in_scope!()
    ))
    .bind(key)
    .bind(bound(scope));
    one(query, database, rows::job).await
}

pub(super) async fn job(pool: &SqlitePool, scope: Scope<'_>, id: Uuid) -> Result<Option<Job>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT ",
        head_columns!(),
        ", ",
        job_columns!(),
        " FROM jobs WHERE id = $1 AND ",
        in_scope!()
    ))
    .bind(id.to_string())
    .bind(bound(scope));
    one(query, pool, rows::job).await
}

pub(super) async fn source(
    database: impl SqliteExecutor<'_>,
    scope: Scope<'_>,
    id: Uuid,
) -> Result<Option<JobSource>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT owner, submitted, set_id, state_key, state_hash, merged_seconds, merged_cpu_seconds, \
         (SELECT d.submitted FROM job_set_documents d WHERE d.set_id = jobs.set_id) AS shared_submitted \
         FROM jobs WHERE id = $1 AND ",
        in_scope!()
    ))
    .bind(id.to_string())
    .bind(bound(scope));
    one(query, database, rows::job_source).await
}

pub(super) async fn head(pool: &SqlitePool, scope: Scope<'_>, id: Uuid) -> Result<Option<JobHead>, StoreError> {
    let query = sqlx::query(concat!("SELECT ", head_columns!(), " FROM jobs WHERE id = $1 AND ", in_scope!()))
        .bind(id.to_string())
        .bind(bound(scope));
    one(query, pool, rows::head).await
}

pub(super) async fn list(pool: &SqlitePool, scope: Scope<'_>, filter: JobFilter) -> Result<Vec<JobHead>, StoreError> {
    // conditions that are not there cannot keep it from an index
    let mut query = QueryBuilder::new(concat!("SELECT ", head_columns!(), " FROM jobs WHERE id < "));
    query.push_bind(before(filter.before));
    if let Some(owner) = scope {
        query.push(" AND owner = ").push_bind(owner.name());
    }
    if let Some(status) = filter.status {
        query.push(" AND status = ").push_bind(status.name());
    }
    query.push(" ORDER BY id DESC LIMIT ").push_bind(i64::from(filter.limit));
    all(query.build(), pool, rows::head).await
}

/// Single jobs that have ended, those that ended first first.
pub(super) async fn ended(pool: &SqlitePool, scope: Scope<'_>, filter: EndedFilter) -> Result<Vec<Ended>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT id, finished_at FROM jobs WHERE finished_at IS NOT NULL AND finished_at < $1 AND set_id IS NULL \
         AND NOT EXISTS (SELECT 1 FROM job_set_members m WHERE m.job_id = jobs.id) \
         AND ($4 IS NULL OR status = $4) AND ",
        in_scope!(),
        " ORDER BY finished_at, id LIMIT $3"
    ))
    .bind(filter.before.unwrap_or(i64::MAX))
    .bind(bound(scope))
    .bind(i64::from(filter.limit))
    .bind(filter.status.map(JobStatus::name));
    all(query, pool, |row| Ok(Ended { id: rows::uuid(row, "id")?, at: rows::get(row, "finished_at")? })).await
}

fn before(id: Option<Uuid>) -> String {
    id.unwrap_or(Uuid::max()).to_string()
}

pub(super) async fn count(pool: &SqlitePool, status: JobStatus) -> Result<u64, StoreError> {
    count_of(sqlx::query("SELECT count(*) FROM jobs WHERE status = $1").bind(status.name()), pool).await
}

pub(super) async fn unfinished(pool: &SqlitePool) -> Result<u64, StoreError> {
    // a job that has not ended has one chunk that is not done
    count_of(sqlx::query("SELECT count(*) FROM chunks WHERE state <> 'done'"), pool).await
}

/// Counts the unfinished chunks of one client, as [`unfinished`] counts those of all.
pub(super) async fn unfinished_of(database: impl SqliteExecutor<'_>, client: &str) -> Result<u64, StoreError> {
    count_of(sqlx::query("SELECT count(*) FROM chunks WHERE state <> 'done' AND client = $1").bind(client), database)
        .await
}

pub(super) async fn cancel(tx: &mut SqliteConnection, scope: Scope<'_>, id: Uuid) -> Result<CancelOutcome, StoreError> {
    let id = id.to_string();
    let query =
        sqlx::query(concat!("SELECT status FROM jobs WHERE id = $1 AND ", in_scope!())).bind(&id).bind(bound(scope));
    let status: Option<String> = one(query, &mut *tx, first).await?;
    let Some(status) = status else { return Ok(CancelOutcome::NotFound) };
    match JobStatus::from_name(&status) {
        Some(JobStatus::Cancelled) => return Ok(CancelOutcome::Accepted),
        Some(status) if status.is_final() => return Ok(CancelOutcome::Finished(status)),
        // a worker renders it, or has rendered passes of it: it makes the result files of these passes
        Some(JobStatus::Running) => {
            for statement in [
                "UPDATE jobs SET cancel = 1 WHERE id = $1",
                "UPDATE chunks SET line = 0 WHERE job_id = $1 AND state <> 'done'",
            ] {
                run(sqlx::query(statement).bind(&id), &mut *tx).await?;
            }
            return Ok(CancelOutcome::Accepted);
        }
        _ => {}
    }
    let query = sqlx::query(concat!(
        "UPDATE jobs SET cancel = 1, status = 'cancelled', stopped_by = 'cancelled', finished_at = ",
        now_ms!(),
        " WHERE id = $1"
    ))
    .bind(&id);
    run(query, &mut *tx).await?;
    run(sqlx::query("DELETE FROM chunks WHERE job_id = $1").bind(&id), &mut *tx).await?;
    let mut change = JobChange::new(&id);
    change.event(&Cancelled { stopped_by: StoppedBy::Cancelled, progress: Progress::default() })?;
    change.write(tx).await?;
    Ok(CancelOutcome::Accepted)
}

/// Largest number of rows that one statement deletes, within some tens of milliseconds.
const ROWS_AT_ONCE: i64 = 5000;

/// Deletes some of a job's rows, oldest first. Returns `None` while rows remain, and once the job is gone whether it was there.
pub(super) async fn delete_some(
    tx: &mut SqliteConnection,
    scope: Scope<'_>,
    id: Uuid,
) -> Result<Option<bool>, StoreError> {
    for statement in [
        concat!(
            "DELETE FROM passes WHERE ",
            of_job_in_scope!(),
            " AND pass IN (SELECT pass FROM passes WHERE job_id = $1 ORDER BY pass LIMIT $3)"
        ),
        concat!(
            "DELETE FROM events WHERE ",
            of_job_in_scope!(),
            " AND seq IN (SELECT seq FROM events WHERE job_id = $1 ORDER BY seq LIMIT $3)"
        ),
    ] {
        let query = sqlx::query(statement).bind(id.to_string()).bind(bound(scope)).bind(ROWS_AT_ONCE);
        let deleted = run(query, &mut *tx).await?;
        if deleted >= ROWS_AT_ONCE.unsigned_abs() {
            return Ok(None);
        }
    }
    let query = sqlx::query(concat!("DELETE FROM jobs WHERE id = $1 AND ", in_scope!()))
        .bind(id.to_string())
        .bind(bound(scope));
    let deleted = run(query, tx).await?;
    Ok(Some(deleted > 0))
}

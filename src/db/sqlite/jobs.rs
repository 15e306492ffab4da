//! Jobs: their rows.

use async_trait::async_trait;
use sqlx::{QueryBuilder, SqliteConnection, SqliteExecutor};
use uuid::Uuid;

use crate::document::Warning;
use crate::document::result::Known;
use crate::engine::progress::{Progress, StoppedBy};
use crate::queue::durability::Durability;
use crate::queue::events::{Cancelled, PlannedBesidePlan, Queued};
use crate::queue::owner::Owner;
use crate::queue::store::*;

use super::SqliteStore;
use super::change::{JobChange, Line};
use super::rows::{self, head_columns, job_columns, to_json, to_value};
use super::sql::{
    Scope, all, bound, count_of, first, in_scope, now_ms, of_job_in_scope, one, run, signed, store_error,
};

/// Statement by which a deletion gives up to 1024 free pages (4 kB each) back to the disk; later deletions give back the rest.
const PAGES_GIVEN_BACK: &str = "PRAGMA incremental_vacuum(1024)";

/// Statement that finds a job of the same owner that has succeeded and whose results are also those of the job $1. A job that its time limit has
/// ended would have other results at another time: it counts only if it ended after the job $1 was created. The newest by its id would be found
/// by reading all jobs that have ended.
const ENDED_EQUAL: &str = "SELECT e.id FROM jobs j JOIN jobs e ON e.computation = j.computation AND e.status = 'succeeded' \
     AND e.owner = j.owner WHERE j.id = $1 AND (e.stopped_by <> 'max_seconds' OR e.finished_at >= j.created_at) ORDER BY e.finished_at DESC LIMIT 1";

#[async_trait]
impl JobStore for SqliteStore {
    async fn submit(&self, job: NewJob, most: MostWaiting) -> Result<Submission<Job>, StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let submission = submit(&mut tx, job, most).await?;
        if let Submission::New(job) = &submission {
            self.commit_held(tx, job.head.id).await?;
            self.tell(Change::Job(job.head.id));
            self.tell(Change::Queue);
        } else {
            tx.rollback().await.map_err(store_error)?;
        }
        if let Submission::Repeated(job) = &submission {
            self.log.sync(job.head.id).await?;
        }
        Ok(submission)
    }

    async fn sync(&self, job: Uuid) -> Result<(), StoreError> {
        self.log.sync(job).await
    }

    async fn job_of_key(&self, idempotency_key: &str) -> Result<Option<Job>, StoreError> {
        let job = job_of_key(&self.readers, self.scope(), idempotency_key).await?;
        if let Some(job) = &job {
            self.log.sync(job.head.id).await?;
        }
        Ok(job)
    }

    async fn ended_equal(&self, id: Uuid) -> Result<Option<Uuid>, StoreError> {
        one(sqlx::query(ENDED_EQUAL).bind(id.to_string()), &self.readers, |row| rows::uuid(row, "id")).await
    }

    async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError> {
        let query =
            concat!("SELECT ", head_columns!(), ", ", job_columns!(), " FROM jobs WHERE id = $1 AND ", in_scope!());
        let query = sqlx::query(query).bind(id.to_string()).bind(bound(self.scope()));
        let job = one(query, &self.readers, rows::job).await?;
        self.log.sync(id).await?;
        Ok(job)
    }

    async fn job_source(&self, id: Uuid) -> Result<Option<JobSource>, StoreError> {
        source(&self.readers, self.scope(), id).await
    }

    async fn job_head(&self, id: Uuid) -> Result<Option<JobHead>, StoreError> {
        let query = concat!("SELECT ", head_columns!(), " FROM jobs WHERE id = $1 AND ", in_scope!());
        let query = sqlx::query(query).bind(id.to_string()).bind(bound(self.scope()));
        let head = one(query, &self.readers, rows::head).await?;
        self.log.sync(id).await?;
        Ok(head)
    }

    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobHead>, StoreError> {
        // conditions that are not there cannot keep it from an index
        let mut query = QueryBuilder::new(concat!("SELECT ", head_columns!(), " FROM jobs WHERE id < "));
        query.push_bind(filter.before.unwrap_or(Uuid::max()).to_string());
        if let Some(owner) = self.scope() {
            query.push(" AND owner = ").push_bind(owner.name());
        }
        if let Some(status) = filter.status {
            query.push(" AND status = ").push_bind(status.name());
        }
        query.push(" ORDER BY id DESC LIMIT ").push_bind(i64::from(filter.limit));
        let jobs = all(query.build(), &self.readers, rows::head).await?;
        self.log.sync_all().await?;
        Ok(jobs)
    }

    async fn ended_jobs(&self, filter: EndedFilter) -> Result<Vec<Ended>, StoreError> {
        let query = sqlx::query(concat!(
            "SELECT id, finished_at FROM jobs WHERE finished_at IS NOT NULL AND finished_at < $1 AND set_id IS NULL \
             AND NOT EXISTS (SELECT 1 FROM job_set_members m WHERE m.job_id = jobs.id) \
             AND ($4 IS NULL OR status = $4) AND ",
            in_scope!(),
            " ORDER BY finished_at, id LIMIT $3"
        ))
        .bind(filter.before.unwrap_or(i64::MAX))
        .bind(bound(self.scope()))
        .bind(i64::from(filter.limit))
        .bind(filter.status.map(JobStatus::name));
        all(query, &self.readers, |row| Ok(Ended { id: rows::uuid(row, "id")?, at: rows::get(row, "finished_at")? }))
            .await
    }

    async fn count(&self, status: JobStatus) -> Result<u64, StoreError> {
        let query = sqlx::query("SELECT count(*) FROM jobs WHERE status = $1").bind(status.name());
        let count = count_of(query, &self.readers).await?;
        self.log.sync_all().await?;
        Ok(count)
    }

    async fn unfinished(&self) -> Result<u64, StoreError> {
        // a job that has not ended has one chunk that is not done
        count_of(sqlx::query("SELECT count(*) FROM chunks WHERE state <> 'done'"), &self.readers).await
    }

    async fn unfinished_of(&self, client: &str) -> Result<u64, StoreError> {
        unfinished_of(&self.readers, client).await
    }

    async fn cancel(&self, id: Uuid) -> Result<CancelOutcome, StoreError> {
        let mut tx = self.begin_on_full_disk().await?;
        let outcome = cancel(&mut tx, self.scope(), id).await?;
        tx.commit().await.map_err(store_error)?;
        self.log.sync(id).await?;
        if outcome == CancelOutcome::Accepted {
            self.tell_cancelled(id);
        }
        Ok(outcome)
    }

    async fn delete(&self, id: Uuid) -> Result<bool, StoreError> {
        // in pieces, so that others can write in between
        let deleted = loop {
            let mut tx = self.begin_on_full_disk().await?;
            let deleted = delete_some(&mut tx, self.scope(), id).await?;
            tx.commit().await.map_err(store_error)?;
            if let Some(deleted) = deleted {
                break deleted;
            }
        };
        if deleted {
            self.tell(Change::Stop(id));
            self.tell(Change::Job(id));
            if let Err(error) = sqlx::query(PAGES_GIVEN_BACK).fetch_all(&self.writer).await {
                tracing::warn!(%error, "giving pages back to the disk failed");
            }
        }
        Ok(deleted)
    }
}

impl SqliteStore {
    /// Tells listeners that a job was cancelled.
    pub(super) fn tell_cancelled(&self, job: Uuid) {
        self.tell(Change::Stop(job));
        self.tell(Change::Ended(job));
        self.tell(Change::Job(job));
    }
}

async fn submit(tx: &mut SqliteConnection, new: NewJob, most: MostWaiting) -> Result<Submission<Job>, StoreError> {
    if let Some(key) = &new.idempotency_key
        && let Some(job) = job_of_key(&mut *tx, Some(&new.owner), key).await?
    {
        let same = job.body_hash == new.body_hash;
        return Ok(if same { Submission::Repeated(job) } else { Submission::Refused(NotQueued::KeyReused) });
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
        Ok(created_at) => created_at,
        Err(refused) => return Ok(Submission::Refused(refused)),
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
    Ok(Submission::New(job))
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

/// Queues a job, and returns the time of that in milliseconds since 1970. If it is refused, the transaction must be rolled back.
pub(super) async fn insert(
    tx: &mut SqliteConnection,
    row: NewRow<'_>,
    most: MostWaiting,
) -> Result<Result<i64, NotQueued>, StoreError> {
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
        return Ok(Err(if full { NotQueued::ClientFull } else { NotQueued::QueueFull }));
    };
    let created_at: i64 = rows::get(created, "created_at")?;
    for upload in row.uploads {
        let query =
            sqlx::query("SELECT 1 FROM uploads WHERE id = $1 AND owner = $2").bind(upload).bind(row.owner.name());
        let known: Option<i64> = one(query, &mut *tx, first).await?;
        if known.is_none() {
            return Ok(Err(NotQueued::UploadGone(upload.clone())));
        }
        let query = sqlx::query("INSERT INTO job_uploads (job_id, upload_id) VALUES ($1, $2) ON CONFLICT DO NOTHING")
            .bind(&id_text)
            .bind(upload);
        run(query, &mut *tx).await?;
    }
    Ok(Ok(created_at))
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

/// Counts the chunks of one client that are not done.
async fn unfinished_of(database: impl SqliteExecutor<'_>, client: &str) -> Result<u64, StoreError> {
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
async fn delete_some(tx: &mut SqliteConnection, scope: Scope<'_>, id: Uuid) -> Result<Option<bool>, StoreError> {
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

#[cfg(test)]
mod tests {
    use sqlx::{AssertSqlSafe, Connection, Row, SqliteConnection};

    use super::*;
    use crate::db::sqlite::migrations::migrations;

    /// Equal jobs are found by an index, so that other jobs that have ended are not read.
    #[tokio::test]
    async fn equal_jobs_are_found_by_their_index() {
        let mut database = SqliteConnection::connect("sqlite::memory:").await.unwrap();
        migrations().run(&mut database).await.unwrap();
        let plan = sqlx::query(AssertSqlSafe(format!("EXPLAIN QUERY PLAN {ENDED_EQUAL}")))
            .bind("")
            .fetch_all(&mut database)
            .await
            .unwrap();
        let plan: Vec<String> = plan.iter().map(|row| row.get("detail")).collect();
        assert!(plan.iter().any(|step| step.contains("SEARCH e USING INDEX jobs_by_computation")), "{plan:?}");
    }
}

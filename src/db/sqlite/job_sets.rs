//! Sets of jobs: their rows, and those of their members.

use async_trait::async_trait;
use serde_json::Value;
use sqlx::sqlite::SqliteRow;
use sqlx::{QueryBuilder, SqliteConnection, SqliteExecutor};
use uuid::Uuid;

use crate::queue::durability::Durability;
use crate::queue::store::*;

use super::SqliteStore;
use super::change::Line;
use super::jobs;
use super::rows::{self, broken, get, head_columns, json, optional_json, to_json, uuid};
use super::sql::{Scope, Statement, all, bound, in_scope, now_ms, one, run, signed, store_error};

#[async_trait]
impl SetStore for SqliteStore {
    async fn submit_set(&self, set: NewJobSet, most: MostWaiting) -> Result<Submission<JobSet>, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let submission = submit(&mut tx, set, most).await?;
        if let Submission::New(set) = &submission {
            tx.commit().await.map_err(store_error)?;
            set.members.iter().for_each(|member| self.tell(Change::Job(member.job)));
            self.tell(Change::Queue);
        } else {
            tx.rollback().await.map_err(store_error)?;
        }
        Ok(submission)
    }

    async fn set_of_key(&self, kind: SetKind, idempotency_key: &str) -> Result<Option<JobSet>, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        of_key(&mut connection, self.scope(), kind, idempotency_key).await
    }

    async fn job_set(&self, id: Uuid) -> Result<Option<JobSet>, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        job_set(&mut connection, self.scope(), id).await
    }

    async fn job_sets(&self, kind: SetKind, before: Option<Uuid>, limit: u32) -> Result<Vec<Uuid>, StoreError> {
        // a condition that is not there cannot keep it from its index
        let mut query = QueryBuilder::new("SELECT id FROM job_sets WHERE kind = ");
        query.push_bind(kind.name()).push(" AND id < ").push_bind(before.unwrap_or(Uuid::max()).to_string());
        if let Some(owner) = self.scope() {
            query.push(" AND owner = ").push_bind(owner.name());
        }
        query.push(" ORDER BY id DESC LIMIT ").push_bind(i64::from(limit));
        all(query.build(), &self.readers, |row| uuid(row, "id")).await
    }

    async fn jobs_of_set(&self, id: Uuid) -> Result<Vec<JobHead>, StoreError> {
        let heads = heads(&self.readers, self.scope(), id).await?;
        self.log.sync_all().await?;
        Ok(heads)
    }

    async fn set_progress(&self, id: Uuid) -> Result<SetProgress, StoreError> {
        // the start is a job's third event, and the end its last one: each is found by the key; times may be equal, rows are written
        // one after the other
        let query = sqlx::query(concat!(
            "SELECT e.job_id, e.name FROM job_set_members s JOIN jobs j ON j.id = s.job_id \
             JOIN events e ON e.job_id = j.id AND e.seq IN (3, j.next_seq - 1) \
             WHERE s.set_id = $1 AND e.name IN ('started', 'succeeded', 'failed', 'cancelled') AND ",
            in_scope!(),
            " ORDER BY e.rowid"
        ));
        let step = |row: &SqliteRow| {
            let name: String = get(row, "name")?;
            Ok(SetStep { job: uuid(row, "job_id")?, ended: JobStatus::from_name(&name) })
        };
        // heads and steps of one moment
        let mut tx = self.readers.begin().await.map_err(store_error)?;
        let jobs = heads(&mut *tx, self.scope(), id).await?;
        let steps = all(query.bind(id.to_string()).bind(bound(self.scope())), &mut *tx, step).await?;
        tx.commit().await.map_err(store_error)?;
        self.log.sync_all().await?;
        Ok(SetProgress { jobs, steps })
    }

    async fn cancel_set(&self, id: Uuid) -> Result<Vec<Uuid>, StoreError> {
        let mut tx = self.begin_on_full_disk().await?;
        let mut cancelled = Vec::new();
        for head in heads(&mut *tx, self.scope(), id).await?.into_iter().filter(|head| !head.status.is_final()) {
            if jobs::cancel(&mut tx, self.scope(), head.id).await? == CancelOutcome::Accepted {
                cancelled.push(head.id);
            }
        }
        tx.commit().await.map_err(store_error)?;
        cancelled.iter().for_each(|job| self.tell_cancelled(*job));
        Ok(cancelled)
    }

    async fn keep_found(&self, set: Uuid, found: &[(Uuid, Value)]) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        for (job, found) in found {
            let query = sqlx::query("UPDATE job_set_members SET found = $3 WHERE set_id = $1 AND job_id = $2");
            run(query.bind(set.to_string()).bind(job.to_string()).bind(to_json(found)?), &mut *tx).await?;
        }
        tx.commit().await.map_err(store_error)
    }

    async fn delete_set(&self, id: Uuid) -> Result<bool, StoreError> {
        let query = sqlx::query(concat!("DELETE FROM job_sets WHERE id = $1 AND ", in_scope!()));
        let query = query.bind(id.to_string()).bind(bound(self.scope()));
        let mut tx = self.begin_on_full_disk().await?;
        let deleted = run(query, &mut *tx).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(deleted > 0)
    }

    async fn ended_sets(&self, before: Option<i64>, limit: u32) -> Result<Vec<Ended>, StoreError> {
        let query = sqlx::query(concat!(
            "SELECT id, ended_at FROM (SELECT s.id AS id, coalesce((SELECT max(j.finished_at) FROM job_set_members m \
             JOIN jobs j ON j.id = m.job_id WHERE m.set_id = s.id), s.created_at) AS ended_at FROM job_sets s \
             WHERE ",
            in_scope!(),
            " AND NOT EXISTS (SELECT 1 FROM job_set_members m JOIN jobs j ON j.id = m.job_id \
             WHERE m.set_id = s.id AND j.finished_at IS NULL)) WHERE ended_at < $1 ORDER BY ended_at, id LIMIT $3"
        ));
        let query = query.bind(before.unwrap_or(i64::MAX)).bind(bound(self.scope())).bind(i64::from(limit));
        all(query, &self.readers, |row| Ok(Ended { id: uuid(row, "id")?, at: get(row, "ended_at")? })).await
    }
}

/// Queues a set with all of its jobs, and returns the outcome with the ids of these jobs.
async fn submit(
    tx: &mut SqliteConnection,
    new: NewJobSet,
    most: MostWaiting,
) -> Result<Submission<JobSet>, StoreError> {
    if let Some(key) = &new.idempotency_key
        && let Some(set) = of_key(tx, Some(&new.owner), new.kind, key).await?
    {
        let same = set.body_hash == new.body_hash;
        return Ok(if same { Submission::Repeated(set) } else { Submission::Refused(NotQueued::KeyReused) });
    }
    let id = Uuid::now_v7();
    let created_at: i64 = sqlx::query_scalar(concat!(
        "INSERT INTO job_sets (id, owner, kind, name, about, idempotency_key, body_hash, created_at) \
         VALUES ($1, $2, $3, $4, $5, $6, $7, ",
        now_ms!(),
        ") RETURNING created_at"
    ))
    .bind(id.to_string())
    .bind(new.owner.name())
    .bind(new.kind.name())
    .bind(&new.name)
    .bind(&new.about)
    .bind(&new.idempotency_key)
    .bind(&new.body_hash)
    .fetch_one(&mut *tx)
    .await
    .map_err(store_error)?;
    let query =
        sqlx::query("INSERT INTO job_set_documents (set_id, submitted, document, plan) VALUES ($1, $2, $3, $4)")
            .bind(id.to_string())
            .bind(to_json(&new.jobs.submitted.into_value())?)
            .bind(to_json(&new.jobs.document.into_value())?)
            .bind(to_json(&new.jobs.plan.into_value())?);
    run(query, &mut *tx).await?;
    let mut members = Vec::with_capacity(new.jobs.list.len());
    for (place, job) in new.jobs.list.into_iter().enumerate() {
        let submitted = to_json(&job.submitted)?;
        let job_id = Uuid::now_v7();
        let row = jobs::NewRow {
            id: job_id,
            owner: &new.owner,
            name: job.name.as_deref(),
            submitted: &submitted,
            document: to_json(&job.document)?,
            plan: to_json(&job.plan)?,
            set: Some(id.to_string()),
            warnings: &job.warnings,
            idempotency_key: None,
            body_hash: "",
            computation: job.computation.as_deref(),
            known: &job.known,
            predictions: None,
            // jobs that are posted alone need not wait for a whole set
            line: Line::Later,
            client: &new.client,
            uploads: &new.uploads,
        };
        let member = match jobs::insert(tx, row, most).await? {
            Ok(_) => SetMember { job: job_id, part: job.part, found: None },
            Err(refused) => return Ok(Submission::Refused(refused)),
        };
        let query = sqlx::query("INSERT INTO job_set_members (set_id, place, job_id, part) VALUES ($1, $2, $3, $4)")
            .bind(id.to_string())
            .bind(signed(place as u64))
            .bind(member.job.to_string())
            .bind(to_json(&member.part)?);
        run(query, &mut *tx).await?;
        members.push(member);
    }
    let NewJobSet { kind, name, about, body_hash, .. } = new;
    Ok(Submission::New(JobSet { id, kind, name, about, body_hash, created_at, members }))
}

/// Columns of a [`JobSet`].
macro_rules! columns {
    () => {
        "id, kind, name, about, body_hash, created_at"
    };
}

pub(super) async fn of_key(
    connection: &mut SqliteConnection,
    scope: Scope<'_>,
    kind: SetKind,
    key: &str,
) -> Result<Option<JobSet>, StoreError> {
    let query =
        concat!("SELECT ", columns!(), " FROM job_sets WHERE idempotency_key = $1 AND kind = $3 AND ", in_scope!());
    with_members(connection, sqlx::query(query).bind(key).bind(bound(scope)).bind(kind.name())).await
}

pub(super) async fn job_set(
    connection: &mut SqliteConnection,
    scope: Scope<'_>,
    id: Uuid,
) -> Result<Option<JobSet>, StoreError> {
    let query = concat!("SELECT ", columns!(), " FROM job_sets WHERE id = $1 AND ", in_scope!());
    with_members(connection, sqlx::query(query).bind(id.to_string()).bind(bound(scope))).await
}

async fn with_members(connection: &mut SqliteConnection, query: Statement<'_>) -> Result<Option<JobSet>, StoreError> {
    let Some(set) = one(query, &mut *connection, without_members).await? else { return Ok(None) };
    let query = sqlx::query("SELECT job_id, part, found FROM job_set_members WHERE set_id = $1 ORDER BY place");
    let members = all(query.bind(set.id.to_string()), connection, member).await?;
    Ok(Some(JobSet { members, ..set }))
}

fn without_members(row: &SqliteRow) -> Result<JobSet, StoreError> {
    let kind: String = get(row, "kind")?;
    Ok(JobSet {
        id: uuid(row, "id")?,
        kind: SetKind::from_name(&kind).ok_or_else(|| broken("kind", &kind))?,
        name: get(row, "name")?,
        about: get(row, "about")?,
        body_hash: get(row, "body_hash")?,
        created_at: get(row, "created_at")?,
        members: Vec::new(),
    })
}

fn member(row: &SqliteRow) -> Result<SetMember, StoreError> {
    Ok(SetMember { job: uuid(row, "job_id")?, part: json(row, "part")?, found: optional_json(row, "found")? })
}

async fn heads(database: impl SqliteExecutor<'_>, scope: Scope<'_>, id: Uuid) -> Result<Vec<JobHead>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT ",
        head_columns!(),
        " FROM jobs WHERE id IN (SELECT job_id FROM job_set_members WHERE set_id = $1) AND ",
        in_scope!(),
        " ORDER BY id"
    ))
    .bind(id.to_string())
    .bind(bound(scope));
    all(query, database, rows::head).await
}

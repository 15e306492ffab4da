//! Queue of chunks: they are claimed with a lease, kept by heartbeats, and given back.
//!
//! Every statement on a leased chunk names its owner and attempt (`held!`), so that a worker that has lost the lease changes no row.

use std::time::Duration;

use async_trait::async_trait;
use sqlx::{Row, SqliteConnection};
use uuid::Uuid;

use crate::queue::durability::Durability;
use crate::queue::store::*;

use super::change::JobChange;
use super::commit::finish_job;
use super::rows;
use super::sql::{
    Statement, first, held, milliseconds, now_ms, of_lease, one, run, signed, store_error, waits_for_none,
};
use super::store::WRITTEN_NOW;
use super::{SqliteStore, ahead, commit};

/// Lock clause of the claim's inner query: empty for SQLite, `FOR UPDATE OF c SKIP LOCKED` for PostgreSQL.
macro_rules! lock_clause {
    () => {
        ""
    };
}

/// SQL condition for a free chunk: given back, left by an expired lease, or held by this owner itself, who renders one at a time.
/// Chunks on which more than $3 processes have died are not free, nor with $6 those of jobs that have had $7 slices, nor those whose next
/// passes are being computed ahead, unless cancelled.
macro_rules! free {
    () => {
        concat!(
            "c.deaths <= $3 AND (c.state = 'ready' OR c.owner = $1 OR c.lease_until < ",
            now_ms!(),
            ") AND (NOT $6 OR c.line = 0 OR (SELECT slices FROM jobs WHERE jobs.id = c.job_id) < $7) AND (c.line = 0 OR NOT EXISTS \
             (SELECT 1 FROM passes_ahead a WHERE a.job_id = c.job_id AND a.pass_from = c.pass_from AND a.state = 'leased' \
             AND a.lease_until >= ",
            now_ms!(),
            "))"
        )
    };
}

/// SQL query for the waiting chunk that comes next, by $1 (owner), $3 (most deaths), $4 (job to stay with, or null), $5 (later
/// chunks first), $6 (jobs with few slices first) and $7 (most slices). The index `chunks_open` gives the order.
macro_rules! next_chunk {
    ($slices:literal) => {
        concat!(
            "SELECT job_id, idx FROM (\
             SELECT * FROM (SELECT c.job_id, c.idx, 0 AS choice FROM chunks c \
             WHERE c.job_id = $4 AND c.state <> 'done' AND ",
            free!(),
            " LIMIT 1) UNION ALL \
             SELECT * FROM (SELECT c.job_id, c.idx, 1 AS choice FROM chunks c WHERE $5 AND c.line = 2 AND c.state <> 'done' AND ",
            free!(),
            " AND ",
            waits_for_none!(),
            " ORDER BY c.turn, c.rowid LIMIT 1) UNION ALL \
             SELECT * FROM (SELECT c.job_id, c.idx, 2 AS choice FROM chunks c WHERE c.state <> 'done' AND ",
            free!(),
            " AND ",
            waits_for_none!(),
            " ORDER BY ",
            $slices,
            "c.line, c.turn, c.rowid LIMIT 1)) ORDER BY choice LIMIT 1 "
        )
    };
}

/// SQL statement of a claim; `$slices` is put before the other columns by which chunks are ordered.
macro_rules! claim {
    ($slices:literal) => {
        concat!(
            "WITH pick AS (",
            next_chunk!($slices),
            lock_clause!(),
            ") UPDATE chunks SET state = 'leased', attempt = attempt + 1, progressed = 0, owner = $1, lease_until = ",
            now_ms!(),
            " + $2 FROM pick WHERE chunks.job_id = pick.job_id AND chunks.idx = pick.idx \
             RETURNING chunks.job_id, chunks.idx, chunks.attempt, chunks.failures, EXISTS (SELECT 1 FROM chunks o \
             WHERE o.state <> 'done' AND (o.job_id <> chunks.job_id OR o.idx <> chunks.idx)), \
             coalesce((SELECT cancel FROM jobs WHERE jobs.id = chunks.job_id), 0), \
             coalesce((SELECT slices FROM jobs WHERE jobs.id = chunks.job_id), 0)"
        )
    };
}
const CLAIM: &str = claim!("");
const CLAIM_SHORT: &str = claim!("c.line > 0, (SELECT slices FROM jobs WHERE jobs.id = c.job_id), ");

#[async_trait]
impl ChunkStore for SqliteStore {
    async fn claim(&self, owner: &str, lease: Duration, turn: Turn) -> Result<Option<Lease>, StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let claimed = claim(&mut tx, owner, lease, turn).await?;
        tx.commit().await.map_err(store_error)?;
        if let Some(lease) = &claimed {
            self.tell(Change::Job(lease.job));
        }
        Ok(claimed)
    }

    async fn heartbeat(&self, lease: &Lease, extend: Duration) -> Result<Beat, StoreError> {
        let query = concat!(
            "UPDATE chunks SET lease_until = ",
            now_ms!(),
            " + $5 WHERE ",
            held!(),
            " RETURNING coalesce((SELECT cancel FROM jobs WHERE jobs.id = chunks.job_id), 0)"
        );
        let mut tx = self.begin(Durability::Buffered).await?;
        let cancel: Option<i64> = one(of_lease(query, lease).bind(milliseconds(extend)), &mut *tx, first).await?;
        run(sqlx::query(WRITTEN_NOW), &mut *tx).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(match cancel {
            None => Beat::Lost,
            Some(0) => Beat::Keep,
            Some(_) => Beat::Cancel,
        })
    }

    async fn report(&self, lease: &Lease, reports: &[Report]) -> Result<bool, StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let held = commit::report(&mut tx, lease, reports).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Job(lease.job));
        Ok(held)
    }

    async fn complete_and_claim(
        &self,
        lease: &Lease,
        reports: &[Report],
        completion: &Completion,
        next: Option<(Duration, Turn)>,
    ) -> Result<(Committed, Option<Lease>), StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let committed = commit::complete(&mut tx, lease, reports, completion).await?;
        if committed == Committed::LeaseLost {
            tx.rollback().await.map_err(store_error)?;
            return Ok((committed, None));
        }
        let claimed = match next {
            Some((duration, turn)) => claim(&mut tx, &lease.owner, duration, turn).await?,
            None => None,
        };
        self.commit_held(tx, lease.job).await?;
        // listeners that read the job now wait until the commit is durable
        match completion {
            Completion::Finish(_) => self.tell(Change::Ended(lease.job)),
            Completion::Continue { ahead, .. } if !ahead.is_empty() => self.tell(Change::Ahead),
            Completion::Continue { .. } => {}
        }
        self.tell(Change::Job(lease.job));
        if let Some(claimed) = &claimed {
            self.tell(Change::Job(claimed.job));
        }
        Ok((committed, claimed))
    }

    async fn rewind(&self, lease: &Lease, reason: &str) -> Result<Committed, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let committed = commit::rewind(&mut tx, lease, reason).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Job(lease.job));
        self.tell(Change::Queue);
        Ok(committed)
    }

    async fn put_aside(&self, lease: &Lease, slices: u64) -> Result<(), StoreError> {
        let counted = sqlx::query("UPDATE jobs SET slices = slices + $2 WHERE id = $1");
        let mut tx = self.begin(Durability::Buffered).await?;
        run(of_lease(RELEASE, lease), &mut *tx).await?;
        run(counted.bind(lease.job.to_string()).bind(signed(slices)), &mut *tx).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Queue);
        Ok(())
    }

    async fn release(&self, lease: &Lease) -> Result<(), StoreError> {
        self.give_back(of_lease(RELEASE, lease)).await
    }

    async fn fail_attempt(&self, lease: &Lease, error: &str) -> Result<(), StoreError> {
        let query = concat!(
            "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL, failures = failures + 1, error = $5 WHERE ",
            held!()
        );
        self.give_back(of_lease(query, lease).bind(error)).await
    }

    async fn take_back(&self, died: bool) -> Result<TakenBack, StoreError> {
        let query = sqlx::query(
            "UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL, \
             deaths = CASE WHEN $1 = 0 THEN deaths WHEN progressed = 1 THEN 0 ELSE deaths + 1 END, \
             turn = CASE WHEN $1 = 0 OR progressed = 1 THEN turn \
             ELSE (SELECT max(o.turn) + 1 FROM chunks o WHERE o.state <> 'done') END \
             WHERE state = 'leased' AND state <> 'done'",
        );
        let mut tx = self.begin(Durability::Committed).await?;
        let ready = run(query.bind(i64::from(died)), &mut *tx).await?;
        ahead::take_back(&mut tx, died).await?;
        let given_up: Vec<String> = sqlx::query_scalar(
            "UPDATE chunks SET state = 'done' WHERE state <> 'done' AND deaths >= $1 RETURNING job_id",
        )
        .bind(signed(MAX_DEATHS))
        .fetch_all(&mut *tx)
        .await
        .map_err(store_error)?;
        let mut failed = Vec::new();
        for job in given_up {
            let detail = format!("the process died {MAX_DEATHS} times while rendering this job");
            let finish = Finish::failed("The process died", detail);
            finish_job(&mut tx, JobChange::new(&job), &finish).await?;
            failed.extend(Uuid::parse_str(&job));
        }
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Queue);
        Ok(TakenBack { ready: ready - failed.len() as u64, failed })
    }
}

/// Statement that makes a leased chunk ready again.
const RELEASE: &str = concat!("UPDATE chunks SET state = 'ready', owner = NULL, lease_until = NULL WHERE ", held!());

impl SqliteStore {
    /// Runs a statement that gives a chunk back undone.
    async fn give_back(&self, statement: Statement<'_>) -> Result<(), StoreError> {
        self.write(Durability::Buffered, statement).await?;
        self.tell(Change::Queue);
        Ok(())
    }
}

/// Claims the waiting chunk that comes next, and starts its job if it is the first one.
async fn claim(
    tx: &mut SqliteConnection,
    owner: &str,
    lease: Duration,
    turn: Turn,
) -> Result<Option<Lease>, StoreError> {
    let row = sqlx::query(if turn.short { CLAIM_SHORT } else { CLAIM })
        .bind(owner)
        .bind(milliseconds(lease))
        .bind(signed(turn.most_deaths))
        .bind(turn.stay_with.map(|job| job.to_string()))
        .bind(turn.later_first)
        .bind(turn.short)
        .bind(signed(MOST_SLICES))
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
        others_wait: row.try_get::<i64, _>(4).map_err(store_error)? != 0,
        cancel_requested: row.try_get::<i64, _>(5).map_err(store_error)? != 0,
        slices: row.try_get::<i64, _>(6).map_err(store_error)?.unsigned_abs(),
    };
    let job = lease.job.to_string();
    // two statements in one call: the event of a job that is still queued, and its new status
    let query = sqlx::query(concat!(
        "INSERT INTO events (job_id, seq, name, data, at) SELECT id, next_seq, 'started', '{}', ",
        now_ms!(),
        " FROM jobs WHERE id = $1 AND status = 'queued'; UPDATE jobs SET status = 'running', started_at = ",
        now_ms!(),
        ", next_seq = next_seq + 1 WHERE id = $1 AND status = 'queued'"
    ))
    .bind(&job);
    run(query, &mut *tx).await?;
    Ok(Some(lease))
}

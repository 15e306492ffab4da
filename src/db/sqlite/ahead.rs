//! Ranges of passes that are computed ahead of their job's chunk.
//!
//! Every statement on a leased range names its owner, so that a worker that has lost the lease changes no row.

use std::time::Duration;

use async_trait::async_trait;
use sqlx::sqlite::SqliteRow;
use sqlx::{QueryBuilder, Sqlite, SqliteConnection};

use super::SqliteStore;
use super::rows::{self, unsigned};
use super::sql::{Statement, all, first, held, milliseconds, now_ms, of_lease, one, run, signed, store_error};
use crate::engine::ahead::RangeAhead;
use crate::estimate::stopping::Wanted;
use crate::queue::durability::Durability;
use crate::queue::store::*;

/// SQL condition for the range that the owner $3 has claimed of the job $1 from pass $2.
macro_rules! held_ahead {
    () => {
        "job_id = $1 AND pass_from = $2 AND owner = $3 AND state = 'leased'"
    };
}

/// Makes a statement with the condition `held_ahead!`.
fn of_ahead<'q>(sql: &'static str, lease: &'q AheadLease) -> Statement<'q> {
    sqlx::query(sql).bind(lease.job.to_string()).bind(signed(lease.range.passes.start)).bind(&lease.owner)
}

#[async_trait]
impl PassesAhead for SqliteStore {
    async fn claim_ahead(&self, owner: &str, lease: Duration) -> Result<Option<AheadLease>, StoreError> {
        let query = sqlx::query(concat!(
            "WITH pick AS (SELECT a.job_id, a.pass_from FROM passes_ahead a JOIN jobs j ON j.id = a.job_id \
             WHERE a.state = 'ready' AND j.cancel = 0 ORDER BY a.rowid LIMIT 1) \
             UPDATE passes_ahead SET state = 'leased', owner = $1, lease_until = ",
            now_ms!(),
            " + $2 FROM pick WHERE passes_ahead.job_id = pick.job_id AND passes_ahead.pass_from = pick.pass_from \
             RETURNING passes_ahead.job_id, passes_ahead.pass_from, pass_to, grids, views"
        ))
        .bind(owner)
        .bind(milliseconds(lease));
        let claimed = |row: &SqliteRow| {
            let passes = unsigned(rows::get(row, "pass_from")?)..unsigned(rows::get(row, "pass_to")?);
            let [grids, views] = [rows::get::<i64>(row, "grids")? != 0, rows::get::<i64>(row, "views")? != 0];
            let range = RangeAhead { passes, wanted: Wanted { grids, views } };
            Ok(AheadLease { job: rows::uuid(row, "job_id")?, range, owner: owner.to_owned() })
        };
        let mut tx = self.begin(Durability::Buffered).await?;
        let lease = one(query, &mut *tx, claimed).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(lease)
    }

    async fn beat_ahead(&self, lease: &AheadLease, extend: Duration) -> Result<bool, StoreError> {
        let sql = concat!(
            "UPDATE passes_ahead SET lease_until = ",
            now_ms!(),
            " + $4 WHERE ",
            held_ahead!(),
            " AND (SELECT cancel FROM jobs WHERE jobs.id = $1) = 0"
        );
        let query = of_ahead(sql, lease).bind(milliseconds(extend));
        Ok(self.write(Durability::Buffered, query).await? > 0)
    }

    async fn keep_ahead(&self, lease: &AheadLease, end: u64, file: &StateFile) -> Result<bool, StoreError> {
        let rest = concat!(
            "INSERT INTO passes_ahead (job_id, pass_from, pass_to, grids, views, state) \
             SELECT job_id, $4, pass_to, grids, views, 'ready' FROM passes_ahead WHERE pass_to > $4 AND ",
            held_ahead!()
        );
        let kept = concat!(
            "UPDATE passes_ahead SET state = 'done', owner = NULL, lease_until = NULL, pass_to = $4, key = $5, hash = $6 WHERE ",
            held_ahead!()
        );
        let mut tx = self.begin(Durability::Buffered).await?;
        run(of_ahead(rest, lease).bind(signed(end)), &mut *tx).await?;
        let kept = run(of_ahead(kept, lease).bind(signed(end)).bind(&file.key).bind(&file.hash), &mut *tx).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Ahead);
        Ok(kept > 0)
    }

    async fn return_ahead(&self, lease: &AheadLease, to: GivenBack) -> Result<(), StoreError> {
        let sql = concat!("UPDATE passes_ahead SET state = $4, owner = NULL, lease_until = NULL WHERE ", held_ahead!());
        let state = match to {
            GivenBack::ToWorkers => "ready",
            GivenBack::ToChunk => "left",
        };
        self.write(Durability::Buffered, of_ahead(sql, lease).bind(state)).await?;
        self.tell(Change::Ahead);
        Ok(())
    }

    async fn ahead(&self, lease: &Lease, from: u64) -> Result<Ahead, StoreError> {
        let job = lease.job.to_string();
        let taken = concat!(
            "DELETE FROM passes_ahead WHERE job_id = $1 AND pass_from = $5 AND state <> 'done' AND EXISTS \
             (SELECT 1 FROM chunks WHERE ",
            held!(),
            ")"
        );
        let outcomes =
            sqlx::query("SELECT key, hash FROM passes_ahead WHERE job_id = $1 AND pass_from = $2 AND state = 'done'")
                .bind(&job)
                .bind(signed(from));
        let until = sqlx::query("SELECT min(pass_from) FROM passes_ahead WHERE job_id = $1 AND pass_from > $2")
            .bind(&job)
            .bind(signed(from));
        let file = |row: &SqliteRow| Ok(StateFile { key: rows::get(row, "key")?, hash: rows::get(row, "hash")? });
        let mut tx = self.begin(Durability::Buffered).await?;
        run(of_lease(taken, lease).bind(signed(from)), &mut *tx).await?;
        let outcomes = one(outcomes, &mut *tx, file).await?;
        let until: Option<Option<i64>> = one(until, &mut *tx, first).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(Ahead { outcomes, until: until.flatten().map(unsigned) })
    }
}

/// Reads the keys of the outcomes of a job's ranges before a pass.
pub(super) async fn keys_before(tx: &mut SqliteConnection, job: &str, pass: i64) -> Result<Vec<String>, StoreError> {
    let query = sqlx::query("SELECT key FROM passes_ahead WHERE job_id = $1 AND pass_from < $2 AND key IS NOT NULL")
        .bind(job)
        .bind(pass);
    all(query, tx, first).await
}

/// Adds statements that delete the ranges of a job before a pass, and open others that are not there yet.
pub(super) fn push_ahead(sql: &mut QueryBuilder<Sqlite>, job: &str, before: i64, opened: &[RangeAhead]) {
    sql.push("; DELETE FROM passes_ahead WHERE job_id = ").push_bind(job.to_owned());
    sql.push(" AND pass_from < ").push_bind(before);
    if opened.is_empty() {
        return;
    }
    sql.push("; INSERT INTO passes_ahead (job_id, pass_from, pass_to, grids, views, state) ");
    sql.push_values(opened, |mut row, RangeAhead { passes, wanted }| {
        row.push_bind(job.to_owned())
            .push_bind(signed(passes.start))
            .push_bind(signed(passes.end))
            .push_bind(i64::from(wanted.grids))
            .push_bind(i64::from(wanted.views))
            .push("'ready'");
    });
    sql.push(" ON CONFLICT (job_id, pass_from) DO NOTHING");
}

/// Returns all leased ranges at a start, when no other process can have a lease: to the workers, or, where the process before `died` of
/// what may have been one of them, to their chunks.
pub(super) async fn take_back(tx: &mut SqliteConnection, died: bool) -> Result<(), StoreError> {
    let query =
        sqlx::query("UPDATE passes_ahead SET state = $1, owner = NULL, lease_until = NULL WHERE state = 'leased'");
    run(query.bind(if died { "left" } else { "ready" }), tx).await?;
    Ok(())
}

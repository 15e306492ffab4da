//! Jobs of one computation: a job takes the results of an equal one that was computed before.

use sqlx::SqlitePool;
use uuid::Uuid;

use crate::queue::store::StoreError;

use super::rows;
use super::sql::one;

// the newest by its id would be found by reading all jobs that have ended
const ENDED_EQUAL: &str = "SELECT e.id FROM jobs j JOIN jobs e ON e.computation = j.computation AND e.status = 'succeeded' \
     AND e.owner = j.owner WHERE j.id = $1 AND (e.stopped_by <> 'max_seconds' OR e.finished_at >= j.created_at) ORDER BY e.finished_at DESC LIMIT 1";

/// Finds a job of the same owner that has succeeded and whose results are also those of the job `id`. A job that its time limit has ended would have
/// other results at another time: it counts only if it ended after the job `id` was created.
pub(super) async fn ended_equal(pool: &SqlitePool, id: Uuid) -> Result<Option<Uuid>, StoreError> {
    one(sqlx::query(ENDED_EQUAL).bind(id.to_string()), pool, |row| rows::uuid(row, "id")).await
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

//! Events and passes of jobs.

use sqlx::SqlitePool;
use uuid::Uuid;

use crate::engine::progress::PassReport;
use crate::queue::events::{EventData, Planned};
use crate::queue::store::*;

use super::rows::{self, signed};
use super::sql::{Scope, all, bound, of_job_in_scope, one};

pub(super) async fn events(
    pool: &SqlitePool,
    scope: Scope<'_>,
    id: Uuid,
    after: i64,
    limit: u32,
) -> Result<Vec<Event>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT seq, name, data FROM events WHERE ",
        of_job_in_scope!(),
        " AND seq > $3 ORDER BY seq LIMIT $4"
    ))
    .bind(id.to_string())
    .bind(bound(scope))
    .bind(after)
    .bind(i64::from(limit));
    let mut events = all(query, pool, rows::event).await?;
    // the plan is kept once, in the job's row; old events have it
    for event in events.iter_mut().filter(|event| event.name == Planned::NAME && event.data["plan"].is_null()) {
        let query = sqlx::query(
            "SELECT plan, set_id, (SELECT d.plan FROM job_set_documents d WHERE d.set_id = jobs.set_id) AS shared_plan \
             FROM jobs WHERE id = $1",
        );
        let plan = one(query.bind(id.to_string()), pool, |row| rows::whole(row, "plan", "shared_plan")).await?;
        // a job that was deleted meanwhile has no events
        let Some(plan) = plan else { return Ok(Vec::new()) };
        if let Some(data) = event.data.as_object_mut() {
            data.insert("plan".to_owned(), plan);
        }
    }
    Ok(events)
}

/// Columns of a [`PassReport`].
macro_rules! pass_columns {
    () => {
        "pass, seconds, photons, rays, relative_error, view_relative_error, degrees_of_freedom, mean_lux, cpu_seconds"
    };
}

pub(super) async fn convergence(
    pool: &SqlitePool,
    scope: Scope<'_>,
    id: Uuid,
    after: u64,
    limit: u32,
) -> Result<Vec<PassReport>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT ",
        pass_columns!(),
        " FROM passes WHERE ",
        of_job_in_scope!(),
        " AND pass > $3 ORDER BY pass LIMIT $4"
    ))
    .bind(id.to_string())
    .bind(bound(scope))
    .bind(signed(after))
    .bind(i64::from(limit));
    all(query, pool, rows::pass).await
}

/// Reads about `points` rows of the convergence table, evenly spread. Tables from before passes were thinned have a row for each
/// pass.
pub(super) async fn convergence_outline(
    pool: &SqlitePool,
    scope: Scope<'_>,
    id: Uuid,
    points: u32,
) -> Result<Vec<PassReport>, StoreError> {
    let query = sqlx::query(concat!(
        "WITH counted AS (SELECT *, row_number() OVER (ORDER BY pass) AS number, count(*) OVER () AS total FROM passes \
         WHERE ",
        of_job_in_scope!(),
        ") SELECT ",
        pass_columns!(),
        " FROM counted WHERE number % (total / $3 + 1) = 0 OR number = 1 OR number = total ORDER BY pass"
    ))
    .bind(id.to_string())
    .bind(bound(scope))
    .bind(i64::from(points.max(3) - 2));
    all(query, pool, rows::pass).await
}

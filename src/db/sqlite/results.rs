//! Events, passes and files of jobs.

use std::collections::HashSet;

use async_trait::async_trait;
use sqlx::SqliteExecutor;
use uuid::Uuid;

use super::SqliteStore;
use super::rows;
use super::sql::{all, bound, count_of, of_job_in_scope, one, signed, store_error};
use crate::engine::progress::PassReport;
use crate::queue::events::{EventData, Planned};
use crate::queue::store::*;

/// Columns of a [`PassReport`].
macro_rules! pass_columns {
    () => {
        "pass, seconds, photons, rays, relative_error, view_relative_error, degrees_of_freedom, mean_lux, cpu_seconds"
    };
}

/// Beginning of a statement that reads files of a job.
macro_rules! artifacts_of_job {
    () => {
        concat!("SELECT name, key, hash, size, media_type, content FROM artifacts WHERE ", of_job_in_scope!())
    };
}

#[async_trait]
impl ResultStore for SqliteStore {
    async fn events(&self, id: Uuid, after: i64, limit: u32) -> Result<Vec<Event>, StoreError> {
        let query = concat!(
            "SELECT seq, name, data FROM events WHERE ",
            of_job_in_scope!(),
            " AND seq > $3 ORDER BY seq LIMIT $4"
        );
        let query = sqlx::query(query).bind(id.to_string()).bind(bound(self.scope())).bind(after);
        let mut events = all(query.bind(i64::from(limit)), &self.readers, rows::event).await?;
        // the plan is kept once, in the job's row; old events have it
        for event in events.iter_mut().filter(|event| event.name == Planned::NAME && event.data["plan"].is_null()) {
            let query = sqlx::query(
                "SELECT plan, set_id, (SELECT d.plan FROM job_set_documents d WHERE d.set_id = jobs.set_id) AS shared_plan \
                 FROM jobs WHERE id = $1",
            );
            let plan =
                one(query.bind(id.to_string()), &self.readers, |row| rows::whole(row, "plan", "shared_plan")).await?;
            // a job that was deleted meanwhile has no events
            let Some(plan) = plan else {
                events.clear();
                break;
            };
            if let Some(data) = event.data.as_object_mut() {
                data.insert("plan".to_owned(), plan);
            }
        }
        self.log.sync(id).await?;
        Ok(events)
    }

    async fn convergence(&self, id: Uuid, after: u64, limit: u32) -> Result<Vec<PassReport>, StoreError> {
        let query = concat!(
            "SELECT ",
            pass_columns!(),
            " FROM passes WHERE ",
            of_job_in_scope!(),
            " AND pass > $3 ORDER BY pass LIMIT $4"
        );
        let query = sqlx::query(query).bind(id.to_string()).bind(bound(self.scope())).bind(signed(after));
        all(query.bind(i64::from(limit)), &self.readers, rows::pass).await
    }

    /// Tables from before passes were thinned have a row for each pass.
    async fn convergence_outline(&self, id: Uuid, points: u32) -> Result<Vec<PassReport>, StoreError> {
        let query = concat!(
            "WITH counted AS (SELECT *, row_number() OVER (ORDER BY pass) AS number, count(*) OVER () AS total FROM passes \
             WHERE ",
            of_job_in_scope!(),
            ") SELECT ",
            pass_columns!(),
            " FROM counted WHERE number % (total / $3 + 1) = 0 OR number = 1 OR number = total ORDER BY pass"
        );
        let query = sqlx::query(query).bind(id.to_string()).bind(bound(self.scope()));
        all(query.bind(i64::from(points.max(3) - 2)), &self.readers, rows::pass).await
    }

    async fn artifact(&self, id: Uuid, name: &str) -> Result<Option<Artifact>, StoreError> {
        let query = sqlx::query(concat!(artifacts_of_job!(), " AND name = $3"));
        let query = query.bind(id.to_string()).bind(bound(self.scope())).bind(name);
        let artifact = one(query, &self.readers, rows::artifact).await?;
        self.log.sync(id).await?;
        Ok(artifact)
    }

    async fn artifacts(&self, id: Uuid) -> Result<Vec<Artifact>, StoreError> {
        let query = sqlx::query(concat!(artifacts_of_job!(), " ORDER BY name"));
        let query = query.bind(id.to_string()).bind(bound(self.scope()));
        let artifacts = all(query, &self.readers, rows::artifact).await?;
        self.log.sync(id).await?;
        Ok(artifacts)
    }

    async fn stored_bytes(&self) -> Result<u64, StoreError> {
        count_of(sqlx::query("SELECT coalesce(sum(size), 0) FROM artifacts"), &self.readers).await
    }

    async fn referenced_keys(&self) -> Result<HashSet<String>, StoreError> {
        referenced_keys(&self.readers).await
    }
}

/// Reads the keys of the object store that rows of a database point to.
pub(super) async fn referenced_keys(database: impl SqliteExecutor<'_>) -> Result<HashSet<String>, StoreError> {
    let keys: Vec<String> = sqlx::query_scalar(
        "SELECT key FROM artifacts WHERE content IS NULL UNION SELECT key FROM uploads UNION SELECT state_key FROM jobs WHERE state_key IS NOT NULL \
         UNION SELECT previous_state_key FROM jobs WHERE previous_state_key IS NOT NULL \
         UNION SELECT key FROM passes_ahead WHERE key IS NOT NULL",
    )
    .fetch_all(database)
    .await
    .map_err(store_error)?;
    Ok(keys.into_iter().collect())
}

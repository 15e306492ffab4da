//! A change of a job's row together with the events that tell of it.
//!
//! Every statement is a journey to the database's thread and back, which costs more than most statements do: what changes
//! one row is one statement, and events are written together.

use serde_json::Value;
use sqlx::{Encode, QueryBuilder, Sqlite, SqliteConnection, Type};

use crate::job::progress::{PassReport, Progress};
use crate::job::store::*;

use super::rows::{signed, to_json};
use super::sql::{now_ms, store_error};

/// Rows that one statement writes.
pub(super) const ROWS_OF_A_STATEMENT: usize = 500;

/// New values of columns of one job, and its next events in order.
pub(super) struct JobChange<'a> {
    job: &'a str,
    update: QueryBuilder<Sqlite>,
    events: Vec<(&'static str, Value)>,
}

impl<'a> JobChange<'a> {
    pub fn new(job: &'a str) -> Self {
        // begins with an assignment that changes nothing, so that every other one follows a comma
        Self { job, update: QueryBuilder::new("UPDATE jobs SET id = id"), events: Vec::new() }
    }

    pub fn event(&mut self, name: &'static str, data: Value) -> &mut Self {
        self.events.push((name, data));
        self
    }

    pub fn set<'q, T>(&mut self, column: &'static str, value: T) -> &mut Self
    where
        T: Encode<'q, Sqlite> + Type<Sqlite> + 'q,
    {
        self.update.push(", ").push(column).push(" = ").push_bind(value);
        self
    }

    /// Sets columns to SQL expressions; on their right-hand sides stand the values before the change.
    pub fn set_sql(&mut self, assignments: &'static str) -> &mut Self {
        self.update.push(", ").push(assignments);
        self
    }

    /// Everything up to and including this pass.
    pub fn set_pass(&mut self, pass: &PassReport) -> &mut Self {
        self.set("passes", signed(pass.passes))
            .set("photons", signed(pass.photons))
            .set("rays", signed(pass.rays))
            .set("seconds", pass.seconds)
            .set("relative_error", pass.relative_error)
            .set("view_relative_error", pass.view_relative_error)
    }

    pub fn set_progress(&mut self, progress: &Progress) -> &mut Self {
        self.set("passes", signed(progress.passes))
            .set("photons", signed(progress.photons))
            .set("rays", signed(progress.rays))
            .set("seconds", progress.seconds)
            .set("relative_error", progress.relative_error)
            .set("view_relative_error", progress.view_relative_error)
            .set("chunks_done", signed(progress.chunks))
    }

    /// Writes everything; nothing when the job is gone.
    pub async fn write(mut self, tx: &mut SqliteConnection) -> Result<(), StoreError> {
        self.set_sql("next_seq = next_seq + ");
        self.update.push_bind(self.events.len() as i64).push(" WHERE id = ").push_bind(self.job);
        self.update.push(" RETURNING next_seq");
        let next: Option<i64> = self.update.build_query_scalar().fetch_optional(&mut *tx).await.map_err(store_error)?;
        let Some(next) = next else { return Ok(()) };
        insert_events(tx, self.job, next - self.events.len() as i64, &self.events).await
    }
}

/// Writes events whose sequence numbers begin with `first`.
pub(super) async fn insert_events(
    tx: &mut SqliteConnection,
    job: &str,
    first: i64,
    events: &[(&str, Value)],
) -> Result<(), StoreError> {
    let mut rows = Vec::with_capacity(events.len());
    for (seq, (name, data)) in (first..).zip(events) {
        rows.push((seq, *name, to_json(data)?));
    }
    for rows in rows.chunks(ROWS_OF_A_STATEMENT) {
        let mut insert = QueryBuilder::new("INSERT INTO events (job_id, seq, name, data, at) ");
        insert.push_values(rows, |mut row, (seq, name, data)| {
            row.push_bind(job).push_bind(*seq).push_bind(*name).push_bind(data).push(now_ms!());
        });
        insert.build().execute(&mut *tx).await.map_err(store_error)?;
    }
    Ok(())
}

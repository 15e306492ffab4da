//! Change of a job's row together with everything that is written with it: events, passes, files.
//!
//! A call to the database's thread costs more than most statements do, so that a change is sent as one string of statements.

use sqlx::sqlite::SqliteRow;
use sqlx::{Encode, QueryBuilder, Sqlite, SqliteConnection, Type};

use crate::engine::ahead::RangeAhead;
use crate::engine::progress::{PassReport, Progress};
use crate::queue::events::EventData;
use crate::queue::store::*;

use super::ahead::push_ahead;
use super::rows::to_json;
use super::sql::{now_ms, signed, store_error, waits_for_none};

/// Largest number of rows that one statement inserts.
const ROWS_OF_A_STATEMENT: usize = 500;

/// Lines of waiting chunks, in the order in which they are served; chunks of cancelled jobs (line 0) come before both.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Line {
    /// First chunks of jobs that were posted alone.
    First = 1,
    /// Later chunks, and all chunks of the jobs of sets.
    Later = 2,
}

/// New values of columns of one job's row, the job's next events in order, and other rows that belong to it.
pub(super) struct JobChange<'a> {
    job: &'a str,
    update: QueryBuilder<Sqlite>,
    /// Names of events, with their data as JSON text.
    events: Vec<(&'static str, String)>,
    passes: Vec<&'a PassReport>,
    artifacts: Vec<&'a Artifact>,
    /// Number and first pass of the next chunk, with its line.
    next_chunk: Option<([u64; 2], Line)>,
    /// Pass before which ranges ahead are deleted, and those that are opened.
    ahead: Option<(i64, &'a [RangeAhead])>,
    written_now: bool,
}

impl<'a> JobChange<'a> {
    pub fn new(job: &'a str) -> Self {
        Self::after(job, QueryBuilder::new(""))
    }

    /// Begins a change that follows the statements of `update`, with their bound values, in the same call. If they have made no row
    /// of the job, nothing of the change is written.
    pub fn after(job: &'a str, mut update: QueryBuilder<Sqlite>) -> Self {
        // begins with an assignment that changes nothing, so that every other one follows a comma
        update.push("UPDATE jobs SET id = id");
        let (events, passes, artifacts) = (Vec::new(), Vec::new(), Vec::new());
        Self { job, update, events, passes, artifacts, next_chunk: None, ahead: None, written_now: false }
    }

    pub fn event<E: EventData>(&mut self, data: &E) -> Result<&mut Self, StoreError> {
        self.events.push((E::NAME, to_json(data)?));
        Ok(self)
    }

    /// Adds a row of the convergence table; it replaces a row of the same pass.
    pub fn pass(&mut self, pass: &'a PassReport) -> &mut Self {
        self.passes.push(pass);
        self
    }

    /// Adds the row of a file; it replaces a row of the same name.
    pub fn artifact(&mut self, artifact: &'a Artifact) -> &mut Self {
        self.artifacts.push(artifact);
        self
    }

    /// Adds the job's next chunk, with its number and first pass, to a line.
    pub fn chunk(&mut self, next: [u64; 2], line: Line) -> &mut Self {
        self.next_chunk = Some((next, line));
        self
    }

    /// Deletes the ranges ahead before a pass, and opens others.
    pub fn ahead(&mut self, before: i64, opened: &'a [RangeAhead]) -> &mut Self {
        self.ahead = Some((before, opened));
        self
    }

    /// Records the present as the time of the newest write to the database.
    pub fn written_now(&mut self) -> &mut Self {
        self.written_now = true;
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

    /// Sets the job's progress to everything up to and including this pass.
    pub fn set_pass(&mut self, pass: &PassReport) -> &mut Self {
        self.set("passes", signed(pass.passes))
            .set("photons", signed(pass.photons))
            .set("rays", signed(pass.rays))
            .set("seconds", pass.seconds)
            .set("relative_error", pass.relative_error)
            .set("view_relative_error", pass.view_relative_error)
            .set("cpu_seconds", pass.cpu_seconds)
    }

    pub fn set_progress(&mut self, progress: &Progress) -> &mut Self {
        self.set("passes", signed(progress.passes))
            .set("photons", signed(progress.photons))
            .set("rays", signed(progress.rays))
            .set("seconds", progress.seconds)
            .set("relative_error", progress.relative_error)
            .set("view_relative_error", progress.view_relative_error)
            .set("chunks_done", signed(progress.chunks))
            .set("cpu_seconds", progress.cpu_seconds)
    }

    /// Writes the change. When the job is gone, rows of passes and files fail, and everything else changes nothing.
    pub async fn write(self, tx: &mut SqliteConnection) -> Result<(), StoreError> {
        self.statements().build().execute(tx).await.map_err(store_error)?;
        Ok(())
    }

    /// Writes the change as [`Self::write`] does, and returns the rows that the statements before it return.
    pub async fn write_and_fetch(self, tx: &mut SqliteConnection) -> Result<Vec<SqliteRow>, StoreError> {
        self.statements().build().fetch_all(tx).await.map_err(store_error)
    }

    fn statements(mut self) -> QueryBuilder<Sqlite> {
        self.set_sql("next_seq = next_seq + ");
        let mut sql = self.update;
        sql.push_bind(self.events.len() as i64).push(" WHERE id = ").push_bind(self.job);
        push_events(&mut sql, self.job, &self.events);
        push_passes(&mut sql, self.job, &self.passes);
        push_artifacts(&mut sql, self.job, &self.artifacts);
        if let Some((next, line)) = self.next_chunk {
            push_chunk(&mut sql, self.job, next, line);
        }
        if let Some((before, opened)) = self.ahead {
            push_ahead(&mut sql, self.job, before, opened);
        }
        if self.written_now {
            sql.push(concat!("; UPDATE store SET written_at = ", now_ms!()));
        }
        sql
    }
}

/// Adds statements that insert events; these take the numbers before the job's `next_seq`.
fn push_events(sql: &mut QueryBuilder<Sqlite>, job: &str, events: &[(&'static str, String)]) {
    for (part, events_of_part) in events.chunks(ROWS_OF_A_STATEMENT).enumerate() {
        let first = (part * ROWS_OF_A_STATEMENT) as i64 - events.len() as i64;
        sql.push("; WITH told (place, name, data) AS (");
        sql.push_values(events_of_part.iter().enumerate(), |mut row, (index, (name, data))| {
            row.push_bind(first + index as i64).push_bind(*name).push_bind(data.clone());
        });
        sql.push(concat!(
            ") INSERT INTO events (job_id, seq, name, data, at) SELECT jobs.id, jobs.next_seq + told.place, told.name, \
             told.data, ",
            now_ms!(),
            " FROM told, jobs WHERE jobs.id = "
        ));
        sql.push_bind(job.to_owned());
    }
}

fn push_passes(sql: &mut QueryBuilder<Sqlite>, job: &str, passes: &[&PassReport]) {
    for passes in passes.chunks(ROWS_OF_A_STATEMENT) {
        sql.push(
            "; INSERT INTO passes (job_id, pass, seconds, photons, rays, relative_error, view_relative_error, mean_lux, \
             cpu_seconds, degrees_of_freedom) ",
        );
        sql.push_values(passes, |mut row, pass| {
            row.push_bind(job.to_owned())
                .push_bind(signed(pass.passes))
                .push_bind(pass.seconds)
                .push_bind(signed(pass.photons))
                .push_bind(signed(pass.rays))
                .push_bind(pass.relative_error)
                .push_bind(pass.view_relative_error)
                .push_bind(pass.mean_lux)
                .push_bind(pass.cpu_seconds)
                .push_bind(pass.degrees_of_freedom);
        });
        sql.push(
            " ON CONFLICT (job_id, pass) DO UPDATE SET seconds = excluded.seconds, photons = excluded.photons, \
             rays = excluded.rays, relative_error = excluded.relative_error, \
             view_relative_error = excluded.view_relative_error, mean_lux = excluded.mean_lux, \
             cpu_seconds = excluded.cpu_seconds, degrees_of_freedom = excluded.degrees_of_freedom",
        );
    }
}

fn push_artifacts(sql: &mut QueryBuilder<Sqlite>, job: &str, artifacts: &[&Artifact]) {
    for artifacts in artifacts.chunks(ROWS_OF_A_STATEMENT) {
        sql.push("; INSERT INTO artifacts (job_id, name, key, hash, size, media_type, content) ");
        sql.push_values(artifacts, |mut row, artifact| {
            row.push_bind(job.to_owned())
                .push_bind(artifact.name.clone())
                .push_bind(artifact.key.clone())
                .push_bind(artifact.hash.clone())
                .push_bind(signed(artifact.size))
                .push_bind(artifact.media_type.clone())
                .push_bind(artifact.content.as_ref().map(|content| content.to_vec()));
        });
        sql.push(
            " ON CONFLICT (job_id, name) DO UPDATE SET key = excluded.key, hash = excluded.hash, size = excluded.size, \
             media_type = excluded.media_type, content = excluded.content",
        );
    }
}

/// Adds the statement that puts a chunk into a line, where clients take turns. The chunk comes behind the next chunk that is ready
/// (one that is being rendered, or waits for an equal job, does not count: new chunks would overtake those that came before them
/// for as long), and behind the other chunks of its client. Of equal turns, the first to come is served first.
fn push_chunk(sql: &mut QueryBuilder<Sqlite>, job: &str, [number, from]: [u64; 2], line: Line) {
    let line = line as i64;
    sql.push("; INSERT INTO chunks (job_id, idx, pass_from, state, line, turn, client) SELECT id, ");
    sql.push_bind(signed(number)).push(", ").push_bind(signed(from));
    sql.push(", 'ready', ").push_bind(line);
    sql.push(", max(coalesce((SELECT c.turn FROM chunks c WHERE c.state <> 'done' AND c.state = 'ready' AND c.line = ");
    sql.push_bind(line).push(concat!(" AND ", waits_for_none!(), " ORDER BY c.turn LIMIT 1), 0)"));
    sql.push(", coalesce((SELECT turn + 1 FROM chunks WHERE state <> 'done' AND client = jobs.client AND line = ");
    sql.push_bind(line)
        .push(" ORDER BY turn DESC LIMIT 1), 0)), client FROM jobs WHERE id = ")
        .push_bind(job.to_owned());
}

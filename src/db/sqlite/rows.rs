//! Conversion of rows into the types of the room `queue`.

use bytes::Bytes;
use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use sqlx::Row;
use sqlx::sqlite::SqliteRow;
use uuid::Uuid;

use crate::engine::progress::{PassReport, Progress, StoppedBy};
use crate::engine::spent::Spent;
use crate::queue::owner::Owner;
use crate::queue::shared_fields::joined;
use crate::queue::store::*;

use super::sql::store_error;

/// Columns of a [`JobHead`].
macro_rules! head_columns {
    () => {
        "id, name, status, cancel, passes, photons, rays, seconds, relative_error, view_relative_error, \
         chunks_done, cpu_seconds, stopped_by, next_seq, created_at, started_at, finished_at"
    };
}
pub(super) use head_columns;

/// Columns of a [`Job`] beyond its head.
macro_rules! job_columns {
    () => {
        "document, plan, warnings, body_hash, summary, predictions, problem, set_id, \
         (SELECT d.document FROM job_set_documents d WHERE d.set_id = jobs.set_id) AS shared_document, \
         (SELECT d.plan FROM job_set_documents d WHERE d.set_id = jobs.set_id) AS shared_plan"
    };
}
pub(super) use job_columns;

pub(super) fn head(row: &SqliteRow) -> Result<JobHead, StoreError> {
    let status: String = get(row, "status")?;
    Ok(JobHead {
        id: uuid(row, "id")?,
        name: get(row, "name")?,
        status: JobStatus::from_name(&status).ok_or_else(|| broken("status", &status))?,
        cancel_requested: get::<i64>(row, "cancel")? != 0,
        progress: Progress {
            passes: unsigned(get(row, "passes")?),
            photons: unsigned(get(row, "photons")?),
            rays: unsigned(get(row, "rays")?),
            seconds: get(row, "seconds")?,
            relative_error: get(row, "relative_error")?,
            view_relative_error: get(row, "view_relative_error")?,
            chunks: unsigned(get(row, "chunks_done")?),
            cpu_seconds: get(row, "cpu_seconds")?,
        },
        stopped_by: match get::<Option<String>>(row, "stopped_by")? {
            Some(name) => Some(stopped_by(&name)?),
            None => None,
        },
        last_seq: get::<i64>(row, "next_seq")? - 1,
        created_at: get(row, "created_at")?,
        started_at: get(row, "started_at")?,
        finished_at: get(row, "finished_at")?,
    })
}

pub(super) fn job(row: &SqliteRow) -> Result<Job, StoreError> {
    Ok(Job {
        head: head(row)?,
        document: whole(row, "document", "shared_document")?,
        plan: whole(row, "plan", "shared_plan")?,
        warnings: json(row, "warnings")?,
        body_hash: get(row, "body_hash")?,
        summary: optional_json(row, "summary")?,
        predictions: optional_json(row, "predictions")?,
        problem: optional_json(row, "problem")?,
    })
}

pub(super) fn job_source(row: &SqliteRow) -> Result<JobSource, StoreError> {
    let state_key: Option<String> = get(row, "state_key")?;
    let state_hash: Option<String> = get(row, "state_hash")?;
    Ok(JobSource {
        owner: Owner::new(&get::<String>(row, "owner")?),
        submitted: match get::<Option<String>>(row, "set_id")? {
            Some(_) => whole(row, "submitted", "shared_submitted")?.to_string(),
            None => get(row, "submitted")?,
        },
        state: state_key.zip(state_hash).map(|(key, hash)| StateFile { key, hash }),
        merged_spent: Spent { seconds: get(row, "merged_seconds")?, cpu_seconds: get(row, "merged_cpu_seconds")? },
    })
}

/// Reads a JSON column of a job; for a job of a set, adds the fields that the set's jobs share from the column `shared`.
pub(super) fn whole(row: &SqliteRow, column: &str, shared: &str) -> Result<Value, StoreError> {
    if get::<Option<String>>(row, "set_id")?.is_none() {
        return json(row, column);
    }
    let (own, shared): (String, Option<String>) = (get(row, column)?, get(row, shared)?);
    let shared = shared.ok_or_else(|| StoreError::Failed("the set of a job is missing in the database".to_owned()))?;
    joined(&shared, &own).map_err(|_| broken(column, &own))
}

pub(super) fn event(row: &SqliteRow) -> Result<Event, StoreError> {
    Ok(Event { seq: get(row, "seq")?, name: get(row, "name")?, data: json(row, "data")? })
}

pub(super) fn pass(row: &SqliteRow) -> Result<PassReport, StoreError> {
    Ok(PassReport {
        passes: unsigned(get(row, "pass")?),
        seconds: get(row, "seconds")?,
        photons: unsigned(get(row, "photons")?),
        rays: unsigned(get(row, "rays")?),
        relative_error: get(row, "relative_error")?,
        view_relative_error: get(row, "view_relative_error")?,
        degrees_of_freedom: get(row, "degrees_of_freedom")?,
        mean_lux: get(row, "mean_lux")?,
        cpu_seconds: get(row, "cpu_seconds")?,
    })
}

pub(super) fn artifact(row: &SqliteRow) -> Result<Artifact, StoreError> {
    Ok(Artifact {
        name: get(row, "name")?,
        key: get(row, "key")?,
        hash: get(row, "hash")?,
        size: unsigned(get(row, "size")?),
        media_type: get(row, "media_type")?,
        content: get::<Option<Vec<u8>>>(row, "content")?.map(Bytes::from),
    })
}

pub(super) fn upload(row: &SqliteRow, kind: UploadKind) -> Result<UploadedFile, StoreError> {
    Ok(UploadedFile {
        owner: Owner::new(&get::<String>(row, "owner")?),
        id: get(row, "id")?,
        key: get(row, "key")?,
        size: unsigned(get(row, "size")?),
        about: match kind {
            UploadKind::Mesh => About::Mesh(json(row, "about")?),
            UploadKind::Weather => About::Weather(json(row, "about")?),
            UploadKind::Array => About::Array(json(row, "about")?),
            UploadKind::Model => About::Model(json(row, "about")?),
        },
        created_at: get(row, "created_at")?,
    })
}

pub(super) fn get<'r, T>(row: &'r SqliteRow, column: &str) -> Result<T, StoreError>
where
    T: sqlx::Decode<'r, sqlx::Sqlite> + sqlx::Type<sqlx::Sqlite>,
{
    row.try_get(column).map_err(store_error)
}

pub(super) fn uuid(row: &SqliteRow, column: &str) -> Result<Uuid, StoreError> {
    let text: String = get(row, column)?;
    Uuid::parse_str(&text).map_err(|_| broken(column, &text))
}

pub(super) fn json<T: DeserializeOwned>(row: &SqliteRow, column: &str) -> Result<T, StoreError> {
    let text: String = get(row, column)?;
    serde_json::from_str(&text).map_err(|_| broken(column, &text))
}

pub(super) fn optional_json<T: DeserializeOwned>(row: &SqliteRow, column: &str) -> Result<Option<T>, StoreError> {
    match get::<Option<String>>(row, column)? {
        Some(text) => serde_json::from_str(&text).map(Some).map_err(|_| broken(column, &text)),
        None => Ok(None),
    }
}

fn stopped_by(name: &str) -> Result<StoppedBy, StoreError> {
    serde_json::from_value(Value::String(name.into())).map_err(|_| broken("stopped_by", name))
}

pub(super) fn to_json<T: Serialize>(value: &T) -> Result<String, StoreError> {
    serde_json::to_string(value)
        .map_err(|error| StoreError::Failed(format!("a value cannot be written as JSON: {error}")))
}

pub(super) fn to_value<T: Serialize>(value: &T) -> Result<Value, StoreError> {
    serde_json::to_value(value)
        .map_err(|error| StoreError::Failed(format!("a value cannot be written as JSON: {error}")))
}

pub(super) fn unsigned(value: i64) -> u64 {
    u64::try_from(value).unwrap_or(0)
}

pub(super) fn broken(column: &str, text: &str) -> StoreError {
    let start: String = text.chars().take(40).collect();
    StoreError::Failed(format!("the column {column} holds an unexpected value: {start:?}"))
}

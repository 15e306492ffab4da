//! Cancelling and deleting of jobs.

use std::time::{Duration, Instant};

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::resource::JobResource;
use crate::http::App;
use crate::http::problem::{Path, Problem, Query};
use crate::queue::store::*;

/// Stops the job within one pass; results computed so far stay readable.
#[utoipa::path(post, path = "/v1/jobs/{id}/cancel", operation_id = "cancel_job", tag = "jobs", params(("id" = Uuid, Path)),
    responses(
        (status = 202, description = "The job is being cancelled, or was already; the body is the job", body = JobResource),
        (status = 404, description = "No such job"),
        (status = 409, description = "The job has finished")))]
pub async fn cancel(app: App, Path(id): Path<Uuid>) -> Result<Response, Problem> {
    match app.store.cancel(id).await? {
        CancelOutcome::NotFound => Err(Problem::no_such_job()),
        CancelOutcome::Finished(status) => {
            Err(Problem::conflict(format!("the job has ended already ({})", status.name())))
        }
        CancelOutcome::Accepted => {
            tracing::info!(job = %id, "job cancelled");
            app.live.forget(id);
            let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
            Ok((StatusCode::ACCEPTED, Json(JobResource::new(job))).into_response())
        }
    }
}

/// Deletes the job and its artifacts; a running one stops.
#[utoipa::path(delete, path = "/v1/jobs/{id}", operation_id = "delete_job", tag = "jobs", params(("id" = Uuid, Path)),
    responses(
        (status = 204, description = "The job is deleted"),
        (status = 404, description = "No such job")))]
pub async fn delete(app: App, Path(id): Path<Uuid>) -> Result<StatusCode, Problem> {
    if app.deletion().job(id).await? { Ok(StatusCode::NO_CONTENT) } else { Err(Problem::no_such_job()) }
}

/// Most jobs that one request deletes, and time after which it leaves the rest to the next one.
const MOST_DELETED: u32 = 500;
const DELETING: Duration = Duration::from_secs(5);

/// Jobs that are to be deleted.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct DeleteQuery {
    /// Only jobs that ended before this time, RFC 3339.
    #[param(value_type = String, format = DateTime)]
    ended_before: Timestamp,
    /// Only jobs that ended with this status; when absent, all that have ended.
    #[param(inline)]
    status: Option<EndedStatus>,
}

/// Ways in which a job has ended.
#[derive(Clone, Copy, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EndedStatus {
    Succeeded,
    Failed,
    Cancelled,
}

/// Number of jobs that were deleted.
#[derive(Serialize, ToSchema)]
pub struct DeletedJobs {
    /// Jobs that are gone; at most 500 in one request.
    pub deleted: u64,
    /// True if there may be more: ask again.
    pub more: bool,
}

/// Deletes jobs that have ended, with their files, the earliest end first. Jobs of sets and of studies are deleted with these only.
#[utoipa::path(delete, path = "/v1/jobs", operation_id = "delete_jobs", tag = "jobs", params(DeleteQuery),
    responses(
        (status = 200, description = "The jobs are deleted", body = DeletedJobs),
        (status = 422, description = "A parameter is missing or not valid; see `errors`")))]
pub async fn delete_many(app: App, Query(query): Query<DeleteQuery>) -> Result<Json<DeletedJobs>, Problem> {
    let status = query.status.map(|status| match status {
        EndedStatus::Succeeded => JobStatus::Succeeded,
        EndedStatus::Failed => JobStatus::Failed,
        EndedStatus::Cancelled => JobStatus::Cancelled,
    });
    let filter = EndedFilter { status, before: Some(query.ended_before.as_millisecond()), limit: MOST_DELETED };
    let (mut deleted, mut more) = (0, false);
    let found = app.store.ended_jobs(filter).await?;
    let begun = Instant::now();
    for (number, ended) in found.iter().enumerate() {
        // at least one goes with each request
        if number > 0 && begun.elapsed() > DELETING {
            more = true;
            break;
        }
        deleted += u64::from(app.deletion().job(ended.id).await?);
    }
    tracing::info!(deleted, "jobs deleted");
    Ok(Json(DeletedJobs { deleted, more: more || found.len() == MOST_DELETED as usize }))
}

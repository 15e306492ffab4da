//! Jobs are cancelled and deleted.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::resource::JobResource;
use crate::http::problem::{Path, Problem};
use crate::http::{App, Service};
use crate::job::store::*;

/// Stops the job within one pass; what was computed stays readable.
#[utoipa::path(post, path = "/v1/jobs/{id}/cancel", operation_id = "cancel_job", tag = "jobs", params(("id" = Uuid, Path)),
    responses(
        (status = 202, description = "The job stops, or was cancelled before; the body is the job", body = JobResource),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json"),
        (status = 409, description = "The job has finished", body = Problem, content_type = "application/problem+json")))]
pub async fn cancel(app: App, Path(id): Path<Uuid>) -> Result<Response, Problem> {
    match app.store.cancel(id).await? {
        CancelOutcome::NotFound => Err(Problem::no_such_job()),
        CancelOutcome::Finished(status) => Err(Problem::conflict(format!("the job has {}", status.name()))),
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
        (status = 204, description = "It is gone"),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json")))]
pub async fn delete(app: App, Path(id): Path<Uuid>) -> Result<StatusCode, Problem> {
    if delete_with_files(&app, id).await? { Ok(StatusCode::NO_CONTENT) } else { Err(Problem::no_such_job()) }
}

/// Deletes a job with its files; false where there was none.
pub async fn delete_with_files(app: &Service, id: Uuid) -> Result<bool, Problem> {
    if !app.store.delete(id).await? {
        return Ok(false);
    }
    app.live.forget(id);
    if let Err(error) = app.artifacts.delete_job(id).await {
        // nothing points to them any more: the next start sweeps them
        tracing::warn!(%error, job = %id, "deleting files failed");
    }
    Ok(true)
}

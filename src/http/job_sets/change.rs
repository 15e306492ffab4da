//! Cancelling and deleting of sets of jobs.

use axum::Json;
use axum::http::StatusCode;
use uuid::Uuid;

use super::any_kind::{self, heads_of};
use super::resource::JobSetResource;
use crate::http::App;
use crate::http::problem::{Path, Problem};
use crate::queue::store::SetKind;

/// Cancels all jobs of the set that have not ended; results computed so far stay readable.
#[utoipa::path(post, path = "/v1/job_sets/{id}/cancel", operation_id = "cancel_job_set", tag = "job sets", params(("id" = Uuid, Path)),
    responses(
        (status = 202, description = "The jobs of the set are being cancelled; the body is the set", body = JobSetResource),
        (status = 404, description = "No such set of jobs"),
        (status = 409, description = "All of its jobs have ended")))]
pub async fn cancel(app: App, Path(id): Path<Uuid>) -> Result<(StatusCode, Json<JobSetResource>), Problem> {
    let set = any_kind::cancel(&app, SetKind::Jobs, id).await?;
    Ok((StatusCode::ACCEPTED, Json(JobSetResource::new(&set, &heads_of(&app, id).await?))))
}

/// Deletes the set with all of its jobs; running ones stop.
#[utoipa::path(delete, path = "/v1/job_sets/{id}", operation_id = "delete_job_set", tag = "job sets", params(("id" = Uuid, Path)),
    responses(
        (status = 204, description = "The set and its jobs are deleted"),
        (status = 404, description = "No such set of jobs")))]
pub async fn delete(app: App, Path(id): Path<Uuid>) -> Result<StatusCode, Problem> {
    any_kind::delete(&app, SetKind::Jobs, id).await
}

//! Cancelling and deleting of studies.

use axum::Json;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::evaluate::study_resource;
use super::looked::{Looked, no_such_study};
use super::resource::StudyResource;
use crate::http::App;
use crate::http::problem::{Path, Problem};

/// Cancels all jobs of the study that have not ended; results computed so far stay readable.
#[utoipa::path(post, path = "/v1/studies/{id}/cancel", operation_id = "cancel_study", tag = "studies", params(("id" = Uuid, Path)),
    responses(
        (status = 202, description = "The jobs of the study are being cancelled; the body is the study", body = StudyResource),
        (status = 404, description = "No such study"),
        (status = 409, description = "All of its jobs have ended")))]
pub async fn cancel(app: App, Path(id): Path<Uuid>) -> Result<Response, Problem> {
    let study = app.store.study(id).await?.ok_or_else(no_such_study)?;
    if app.store.cancel_study(id).await? == 0 {
        return Err(Problem::conflict("all jobs of the study have ended"));
    }
    tracing::info!(study = %id, "study cancelled");
    Ok((StatusCode::ACCEPTED, Json(study_resource(&app, Looked::new(&app, study).await?).await?)).into_response())
}

/// Deletes the study with all of its jobs; running ones stop.
#[utoipa::path(delete, path = "/v1/studies/{id}", operation_id = "delete_study", tag = "studies", params(("id" = Uuid, Path)),
    responses(
        (status = 204, description = "The study and its jobs are deleted"),
        (status = 404, description = "No such study")))]
pub async fn delete(app: App, Path(id): Path<Uuid>) -> Result<StatusCode, Problem> {
    if app.deletion().study(id).await? { Ok(StatusCode::NO_CONTENT) } else { Err(no_such_study()) }
}

//! Cancelling and deleting of studies.

use axum::Json;
use axum::http::StatusCode;
use uuid::Uuid;

use super::evaluate::study_resource;
use super::looked::Looked;
use super::resource::StudyResource;
use crate::http::App;
use crate::http::job_sets::any_kind;
use crate::http::problem::{Path, Problem};
use crate::queue::store::SetKind;

/// Cancels all jobs of the study that have not ended; results computed so far stay readable.
#[utoipa::path(post, path = "/v1/studies/{id}/cancel", operation_id = "cancel_study", tag = "studies", params(("id" = Uuid, Path)),
    responses(
        (status = 202, description = "The jobs of the study are being cancelled; the body is the study", body = StudyResource),
        (status = 404, description = "No such study"),
        (status = 409, description = "All of its jobs have ended")))]
pub async fn cancel(app: App, Path(id): Path<Uuid>) -> Result<(StatusCode, Json<StudyResource>), Problem> {
    let study = any_kind::cancel(&app, SetKind::Study, id).await?;
    Ok((StatusCode::ACCEPTED, Json(study_resource(&app, Looked::new(&app, study).await?).await?)))
}

/// Deletes the study with all of its jobs; running ones stop.
#[utoipa::path(delete, path = "/v1/studies/{id}", operation_id = "delete_study", tag = "studies", params(("id" = Uuid, Path)),
    responses(
        (status = 204, description = "The study and its jobs are deleted"),
        (status = 404, description = "No such study")))]
pub async fn delete(app: App, Path(id): Path<Uuid>) -> Result<StatusCode, Problem> {
    any_kind::delete(&app, SetKind::Study, id).await
}

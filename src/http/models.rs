//! Uploaded Honeybee models: received, described, deleted.

use axum::Json;
use axum::extract::Request;
use axum::http::StatusCode;
use axum::response::Response;
use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;

use crate::document::hbjson::ModelReport;
use crate::document::limits::MODEL_BYTES;
use crate::http::App;
use crate::http::client::Client;
use crate::http::content::Binary;
use crate::http::problem::{Path, Problem};
use crate::http::uploads::{self, Accepted, UploadResource};
use crate::queue::store::{About, UploadKind, UploadedFile};

/// An uploaded model.
#[derive(Serialize, ToSchema)]
pub struct ModelResource {
    /// Id of the content; the value of `room.hbjson` in a job document.
    pub id: String,
    pub bytes: u64,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    /// Rooms of the model.
    pub report: ModelReport,
}

impl UploadResource for ModelResource {
    const KIND: UploadKind = UploadKind::Model;
    const PATH: &'static str = "/v1/models";
    const ACCEPTED: Accepted = Accepted {
        media_types: &["application/json", "text/plain", "application/octet-stream"],
        refusal: "a model must be HBJSON, sent as application/json, text/plain or application/octet-stream",
        most_bytes: MODEL_BYTES,
    };

    fn of(file: UploadedFile, created_at: Option<Timestamp>) -> Option<Self> {
        let About::Model(report) = file.about else { return None };
        Some(Self { id: file.id, bytes: file.size, created_at, report })
    }
}

/// Uploads a Honeybee model (HBJSON).
///
/// Equal content has the same id, however often it is uploaded. A job document names it in `room.hbjson`, with the `identifier` of a room.
#[utoipa::path(post, path = "/v1/models", operation_id = "create_model", tag = "models",
    request_body(content = inline(Binary), content_type = "application/octet-stream",
        description = "The model; the content types application/json and text/plain are accepted, too"),
    responses(
        (status = 201, description = "The model is stored",
            body = ModelResource, headers(("Location" = String, description = "Path of the model"))),
        (status = 408, description = "The upload was too slow"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not one of models"),
        (status = 422, description = "The model is not valid; the detail names the place"),
        (status = 429, description = "This client has too many uploads in progress"),
        (status = 503, description = "The service is busy reading other files, or its disk is full")))]
pub async fn create(app: App, client: Client, request: Request) -> Result<Response, Problem> {
    uploads::create::<ModelResource>(&app, client, request).await
}

/// Describes an uploaded model.
#[utoipa::path(get, path = "/v1/models/{id}", operation_id = "get_model", tag = "models", params(("id" = String, Path)),
    responses(
        (status = 200, description = "The model", body = ModelResource),
        (status = 404, description = "No such model")))]
pub async fn get(app: App, Path(id): Path<String>) -> Result<Json<ModelResource>, Problem> {
    uploads::get(&app, &id).await
}

/// Deletes a model that no job uses.
#[utoipa::path(delete, path = "/v1/models/{id}", operation_id = "delete_model", tag = "models", params(("id" = String, Path)),
    responses(
        (status = 204, description = "The model is deleted"),
        (status = 404, description = "No such model"),
        (status = 409, description = "A job uses the model")))]
pub async fn delete(app: App, Path(id): Path<String>) -> Result<StatusCode, Problem> {
    uploads::delete(&app, UploadKind::Model, id).await
}

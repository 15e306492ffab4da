//! Uploaded arrays: received, described, deleted.

use axum::Json;
use axum::extract::Request;
use axum::http::StatusCode;
use axum::response::Response;
use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;

use crate::document::limits::ARRAY_BYTES;
use crate::http::App;
use crate::http::client::Client;
use crate::http::content::Binary;
use crate::http::problem::{Path, Problem};
use crate::http::uploads::{self, Accepted, UploadResource};
use crate::queue::store::{About, AboutArray, UploadKind, UploadedFile};

/// An uploaded array.
#[derive(Serialize, ToSchema)]
pub struct ArrayResource {
    /// Id of the content.
    pub id: String,
    pub bytes: u64,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    /// Number of rows: sensors of a grid.
    pub rows: u64,
    /// Number of columns: records of a year.
    pub columns: u64,
}

impl UploadResource for ArrayResource {
    const KIND: UploadKind = UploadKind::Array;
    const PATH: &'static str = "/v1/arrays";
    const ACCEPTED: Accepted = Accepted {
        media_types: &["application/octet-stream"],
        refusal: "an array must be a file of NumPy (.npy), sent as application/octet-stream",
        most_bytes: ARRAY_BYTES,
    };

    fn of(file: UploadedFile, created_at: Option<Timestamp>) -> Option<Self> {
        let About::Array(AboutArray { rows, columns }) = file.about else { return None };
        Some(Self { id: file.id, bytes: file.size, created_at, rows, columns })
    }
}

/// Uploads an array of illuminances.
///
/// Arrays of NumPy are taken whose two dimensions are the sensors of a grid and the records of a year, of float32 or float64 in C order. Equal content
/// has the same id, however often it is uploaded.
#[utoipa::path(post, path = "/v1/arrays", operation_id = "create_array", tag = "arrays",
    request_body(content = inline(Binary), content_type = "application/octet-stream", description = "The array (.npy)"),
    responses(
        (status = 201, description = "The array is stored",
            body = ArrayResource, headers(("Location" = String, description = "Path of the array"))),
        (status = 408, description = "The upload was too slow"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not one of arrays"),
        (status = 422, description = "The array is not valid"),
        (status = 429, description = "This client has too many uploads in progress"),
        (status = 503, description = "The service is busy reading other files, or its disk is full")))]
pub async fn create(app: App, client: Client, request: Request) -> Result<Response, Problem> {
    uploads::create::<ArrayResource>(&app, client, request).await
}

/// Describes an uploaded array.
#[utoipa::path(get, path = "/v1/arrays/{id}", operation_id = "get_array", tag = "arrays", params(("id" = String, Path)),
    responses(
        (status = 200, description = "The array", body = ArrayResource),
        (status = 404, description = "No such array")))]
pub async fn get(app: App, Path(id): Path<String>) -> Result<Json<ArrayResource>, Problem> {
    uploads::get(&app, &id).await
}

/// Deletes an array that no job uses.
#[utoipa::path(delete, path = "/v1/arrays/{id}", operation_id = "delete_array", tag = "arrays", params(("id" = String, Path)),
    responses(
        (status = 204, description = "The array is deleted"),
        (status = 404, description = "No such array"),
        (status = 409, description = "A job uses the array")))]
pub async fn delete(app: App, Path(id): Path<String>) -> Result<StatusCode, Problem> {
    uploads::delete(&app, UploadKind::Array, id).await
}

//! Uploaded meshes: received, described, deleted.

use std::time::Duration;

use axum::Json;
use axum::extract::Request;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::App;
use crate::http::client::Client;
use crate::http::content::{Binary, check_coding};
use crate::http::limits::permit;
use crate::http::problem::{Path, Problem};
use crate::http::problem_kind::ProblemKind;
use crate::http::uploads::Upload;
use crate::queue::meshes::UploadError;
use crate::queue::store::{Mesh, MeshDeletion};

/// Longest time that an upload waits while other meshes are read.
const WAIT_FOR_OTHERS: Duration = Duration::from_secs(10);

/// An uploaded mesh.
#[derive(Serialize, ToSchema)]
pub struct MeshResource {
    /// Id of the content; the value of `mesh` in a job document.
    pub id: String,
    pub bytes: u64,
    pub triangles: u64,
    /// Material names in order of first use; faces without one have the name "".
    pub materials: Vec<String>,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
}

impl From<Mesh> for MeshResource {
    fn from(mesh: Mesh) -> Self {
        Self {
            id: mesh.id,
            bytes: mesh.size,
            triangles: mesh.triangles,
            materials: mesh.materials,
            created_at: Timestamp::from_millisecond(mesh.created_at).ok(),
        }
    }
}

/// Uploads a Wavefront OBJ file.
///
/// Equal content has the same id, however often it is uploaded. Only the names of materials are read (`usemtl`): optics are in
/// the job document, so that no MTL file is needed.
#[utoipa::path(post, path = "/v1/meshes", operation_id = "create_mesh", tag = "meshes",
    request_body(content = inline(Binary), content_type = "application/octet-stream",
        description = "The OBJ file; the content types model/obj and text/plain are accepted, too"),
    responses(
        (status = 201, description = "The mesh is stored",
            body = MeshResource, headers(("Location" = String, description = "Path of the mesh"))),
        (status = 408, description = "The upload was too slow"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not one of OBJ files"),
        (status = 422, description = "The OBJ file is not valid; the detail names the line"),
        (status = 429, description = "This client has too many uploads in progress"),
        (status = 503, description = "The service is busy reading other meshes, or its disk is full")))]
pub async fn create(app: App, client: Client, headers: HeaderMap, request: Request) -> Result<Response, Problem> {
    let content_type = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    let media_type = content_type.split(';').next().unwrap_or("").trim().to_ascii_lowercase();
    if !matches!(media_type.as_str(), "" | "model/obj" | "text/plain" | "application/octet-stream") {
        return Err(Problem::unsupported_media_type(
            "a mesh must be an OBJ file, sent as model/obj, text/plain or application/octet-stream",
        ));
    }
    check_coding(&headers)?;
    let Upload { bytes, places } = Upload::receive(&app, client, request.into_body()).await?;
    let permit = tokio::time::timeout(WAIT_FOR_OTHERS, permit(&app.permits.mesh_readers))
        .await
        .map_err(|_| Problem::unavailable("the service is busy reading other meshes; try again later"))??;
    let mesh = app.meshes.upload(app.owner.clone(), bytes, (permit, places.clone())).await?;
    let location = [(header::LOCATION, format!("/v1/meshes/{}", mesh.id))];
    Ok((StatusCode::CREATED, location, Json(MeshResource::from(mesh))).into_response())
}

impl From<UploadError> for Problem {
    fn from(error: UploadError) -> Self {
        match error {
            UploadError::Obj(error) => Self::new(ProblemKind::InvalidMesh, error.to_string()),
            UploadError::Store(error) => error.into(),
            UploadError::Artifact(error) => error.into(),
            UploadError::Panicked => Self::internal(),
        }
    }
}

/// Describes an uploaded mesh.
#[utoipa::path(get, path = "/v1/meshes/{id}", operation_id = "get_mesh", tag = "meshes", params(("id" = String, Path)),
    responses(
        (status = 200, description = "The mesh", body = MeshResource),
        (status = 404, description = "No such mesh")))]
pub async fn get(app: App, Path(id): Path<String>) -> Result<Json<MeshResource>, Problem> {
    let mesh = app.store.mesh(&id).await?.ok_or_else(no_such_mesh)?;
    Ok(Json(mesh.into()))
}

/// Deletes a mesh that no queued or running job uses.
#[utoipa::path(delete, path = "/v1/meshes/{id}", operation_id = "delete_mesh", tag = "meshes", params(("id" = String, Path)),
    responses(
        (status = 204, description = "The mesh is deleted"),
        (status = 404, description = "No such mesh"),
        (status = 409, description = "A queued or running job uses the mesh")))]
pub async fn delete(app: App, Path(id): Path<String>) -> Result<StatusCode, Problem> {
    match app.deletion().mesh(id).await? {
        MeshDeletion::NotFound => Err(no_such_mesh()),
        MeshDeletion::InUse => Err(Problem::conflict("a queued or running job uses this mesh")),
        MeshDeletion::Deleted(_) => Ok(StatusCode::NO_CONTENT),
    }
}

fn no_such_mesh() -> Problem {
    Problem::not_found("there is no such mesh")
}

//! Uploaded meshes: received, described, deleted.

use axum::Json;
use axum::extract::Request;
use axum::http::StatusCode;
use axum::response::Response;
use jiff::Timestamp;
use serde::Serialize;
use utoipa::ToSchema;

use crate::http::App;
use crate::http::client::Client;
use crate::http::content::Binary;
use crate::http::problem::{Path, Problem};
use crate::http::uploads::{self, Accepted, UploadResource};
use crate::queue::store::{About, AboutMesh, UploadKind, UploadedFile};

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

impl UploadResource for MeshResource {
    const KIND: UploadKind = UploadKind::Mesh;
    const PATH: &'static str = "/v1/meshes";
    const ACCEPTED: Accepted = Accepted {
        media_types: &["model/obj", "text/plain", "application/octet-stream"],
        refusal: "a mesh must be an OBJ file, sent as model/obj, text/plain or application/octet-stream",
        most_bytes: usize::MAX,
    };

    fn of(file: UploadedFile, created_at: Option<Timestamp>) -> Option<Self> {
        let About::Mesh(AboutMesh { triangles, materials }) = file.about else { return None };
        Some(Self { id: file.id, bytes: file.size, triangles, materials, created_at })
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
        (status = 503, description = "The service is busy reading other files, or its disk is full")))]
pub async fn create(app: App, client: Client, request: Request) -> Result<Response, Problem> {
    uploads::create::<MeshResource>(&app, client, request).await
}

/// Describes an uploaded mesh.
#[utoipa::path(get, path = "/v1/meshes/{id}", operation_id = "get_mesh", tag = "meshes", params(("id" = String, Path)),
    responses(
        (status = 200, description = "The mesh", body = MeshResource),
        (status = 404, description = "No such mesh")))]
pub async fn get(app: App, Path(id): Path<String>) -> Result<Json<MeshResource>, Problem> {
    uploads::get(&app, &id).await
}

/// Deletes a mesh that no queued or running job uses.
#[utoipa::path(delete, path = "/v1/meshes/{id}", operation_id = "delete_mesh", tag = "meshes", params(("id" = String, Path)),
    responses(
        (status = 204, description = "The mesh is deleted"),
        (status = 404, description = "No such mesh"),
        (status = 409, description = "A queued or running job uses the mesh")))]
pub async fn delete(app: App, Path(id): Path<String>) -> Result<StatusCode, Problem> {
    uploads::delete(&app, UploadKind::Mesh, id).await
}

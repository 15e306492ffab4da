//! Light on the surfaces of a job's room: as JSON, and as a model of the room; triangles of its meshes.

use axum::http::HeaderMap;
use axum::response::Response;
use uuid::Uuid;

use crate::document::result::{MeshesResult, SurfacesResult};
use crate::http::App;
use crate::http::content::Binary;
use crate::http::formats::{self, Format};
use crate::http::problem::{Path, Problem};
use crate::http::results::result_file;
use crate::present::outputs::Output;

/// Returns the illuminance and the luminance of the patches of each face of the room, with their errors.
#[utoipa::path(get, path = "/v1/jobs/{id}/surfaces.json", operation_id = "get_surfaces", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The light on the faces of the room", body = SurfacesResult, content_type = "application/json"),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 404, description = "No such job, its document does not ask for `surfaces`, or its first pass has not finished yet")))]
pub async fn surfaces(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    result_file(&app, id, &headers, Output::Surfaces(Format::Json)).await
}

/// Returns a model of the room as binary glTF: its faces in the colours of their illuminance, its objects,
/// partitions and tubes.
#[utoipa::path(get, path = "/v1/jobs/{id}/scene.glb", operation_id = "get_scene", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The model", body = inline(Binary), content_type = "model/gltf-binary"),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 404, description = "No such job, its document does not ask for `surfaces`, or its first pass has not finished yet")))]
pub async fn scene(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    let output = Output::Surfaces(Format::Glb);
    let answer = result_file(&app, id, &headers, output.clone()).await?;
    Ok(formats::named(answer, &output.file()))
}

/// Returns the triangles of the meshes of objects and tubes as they stand in the room, at most 30 000 together.
#[utoipa::path(get, path = "/v1/jobs/{id}/meshes.json", operation_id = "get_job_meshes", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The triangles", body = MeshesResult, content_type = "application/json"),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 404, description = "No such job, its document has no mesh, or its first pass has not finished yet")))]
pub async fn meshes(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    result_file(&app, id, &headers, Output::Meshes).await
}

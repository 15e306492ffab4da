//! Uploaded meshes.

use sqlx::SqliteConnection;

use crate::queue::store::*;

use super::rows::{self, signed, to_json};
use super::sql::{now_ms, store_error};

pub(super) async fn add(tx: &mut SqliteConnection, mesh: Mesh) -> Result<Mesh, StoreError> {
    sqlx::query(concat!(
        "INSERT INTO meshes (id, key, size, triangles, materials, created_at) VALUES ($1, $2, $3, $4, $5, ",
        now_ms!(),
        ") ON CONFLICT (id) DO NOTHING"
    ))
    .bind(&mesh.id)
    .bind(&mesh.key)
    .bind(signed(mesh.size))
    .bind(signed(mesh.triangles))
    .bind(to_json(&mesh.materials)?)
    .execute(&mut *tx)
    .await
    .map_err(store_error)?;
    self::mesh(tx, &mesh.id)
        .await?
        .ok_or_else(|| StoreError::Failed("the mesh that was just stored is missing in the database".into()))
}

pub(super) async fn mesh(connection: &mut SqliteConnection, id: &str) -> Result<Option<Mesh>, StoreError> {
    sqlx::query("SELECT id, key, size, triangles, materials, created_at FROM meshes WHERE id = $1")
        .bind(id)
        .fetch_optional(connection)
        .await
        .map_err(store_error)?
        .as_ref()
        .map(rows::mesh)
        .transpose()
}

pub(super) async fn delete(tx: &mut SqliteConnection, id: &str) -> Result<MeshDeletion, StoreError> {
    let user: Option<String> = sqlx::query_scalar(
        "SELECT j.id FROM jobs j JOIN job_meshes m ON m.job_id = j.id \
         WHERE m.mesh_id = $1 AND j.status IN ('queued', 'running') LIMIT 1",
    )
    .bind(id)
    .fetch_optional(&mut *tx)
    .await
    .map_err(store_error)?;
    if user.is_some() {
        return Ok(MeshDeletion::InUse);
    }
    let key: Option<String> = sqlx::query_scalar("DELETE FROM meshes WHERE id = $1 RETURNING key")
        .bind(id)
        .fetch_optional(tx)
        .await
        .map_err(store_error)?;
    Ok(key.map_or(MeshDeletion::NotFound, MeshDeletion::Deleted))
}

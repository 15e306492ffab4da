//! Uploaded meshes.

use sqlx::{SqliteConnection, SqliteExecutor};

use crate::queue::store::*;

use super::rows::{self, signed, to_json};
use super::sql::{Scope, bound, in_scope, now_ms, store_error};

pub(super) async fn add(tx: &mut SqliteConnection, mesh: Mesh) -> Result<Mesh, StoreError> {
    sqlx::query(concat!(
        "INSERT INTO meshes (owner, id, key, size, triangles, materials, created_at) VALUES ($1, $2, $3, $4, $5, $6, ",
        now_ms!(),
        ") ON CONFLICT (id, owner) DO NOTHING"
    ))
    .bind(mesh.owner.name())
    .bind(&mesh.id)
    .bind(&mesh.key)
    .bind(signed(mesh.size))
    .bind(signed(mesh.triangles))
    .bind(to_json(&mesh.materials)?)
    .execute(&mut *tx)
    .await
    .map_err(store_error)?;
    self::mesh(&mut *tx, Some(&mesh.owner), &mesh.id)
        .await?
        .ok_or_else(|| StoreError::Failed("the mesh that was just stored is missing in the database".into()))
}

pub(super) async fn mesh(
    database: impl SqliteExecutor<'_>,
    scope: Scope<'_>,
    id: &str,
) -> Result<Option<Mesh>, StoreError> {
    sqlx::query(concat!(
        "SELECT owner, id, key, size, triangles, materials, created_at FROM meshes WHERE id = $1 AND ",
        in_scope!()
    ))
    .bind(id)
    .bind(bound(scope))
    .fetch_optional(database)
    .await
    .map_err(store_error)?
    .as_ref()
    .map(rows::mesh)
    .transpose()
}

pub(super) async fn delete(tx: &mut SqliteConnection, scope: Scope<'_>, id: &str) -> Result<MeshDeletion, StoreError> {
    let user: Option<String> = sqlx::query_scalar(concat!(
        "SELECT j.id FROM jobs j JOIN job_meshes m ON m.job_id = j.id \
         WHERE m.mesh_id = $1 AND j.status IN ('queued', 'running') AND ",
        in_scope!(),
        " LIMIT 1"
    ))
    .bind(id)
    .bind(bound(scope))
    .fetch_optional(&mut *tx)
    .await
    .map_err(store_error)?;
    if user.is_some() {
        return Ok(MeshDeletion::InUse);
    }
    let key: Option<String> =
        sqlx::query_scalar(concat!("DELETE FROM meshes WHERE id = $1 AND ", in_scope!(), " RETURNING key"))
            .bind(id)
            .bind(bound(scope))
            .fetch_optional(tx)
            .await
            .map_err(store_error)?;
    Ok(key.map_or(MeshDeletion::NotFound, MeshDeletion::Deleted))
}

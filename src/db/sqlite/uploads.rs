//! Uploaded meshes.

use sqlx::{SqliteConnection, SqliteExecutor};

use crate::queue::store::*;

use super::rows::{self, signed, to_json};
use super::sql::{Scope, all, bound, first, in_scope, now_ms, one, run};

pub(super) async fn add(tx: &mut SqliteConnection, mesh: Mesh) -> Result<Mesh, StoreError> {
    let query = sqlx::query(concat!(
        "INSERT INTO meshes (owner, id, key, size, triangles, materials, created_at, uploaded_at) VALUES ($1, $2, $3, $4, $5, $6, ",
        now_ms!(),
        ", ",
        now_ms!(),
        ") ON CONFLICT (id, owner) DO NOTHING"
    ))
    .bind(mesh.owner.name())
    .bind(&mesh.id)
    .bind(&mesh.key)
    .bind(signed(mesh.size))
    .bind(signed(mesh.triangles))
    .bind(to_json(&mesh.materials)?);
    run(query, &mut *tx).await?;
    self::mesh(&mut *tx, Some(&mesh.owner), &mesh.id)
        .await?
        .ok_or_else(|| StoreError::Failed("the mesh that was just stored is missing in the database".into()))
}

pub(super) async fn mesh(
    database: impl SqliteExecutor<'_>,
    scope: Scope<'_>,
    id: &str,
) -> Result<Option<Mesh>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT owner, id, key, size, triangles, materials, created_at FROM meshes WHERE id = $1 AND ",
        in_scope!()
    ))
    .bind(id)
    .bind(bound(scope));
    one(query, database, rows::mesh).await
}

pub(super) async fn uploaded_again(
    tx: &mut SqliteConnection,
    scope: Scope<'_>,
    id: &str,
) -> Result<Option<Mesh>, StoreError> {
    let update = sqlx::query(concat!(
        "UPDATE meshes SET uploaded_at = ",
        now_ms!(),
        " WHERE id = $1 AND ",
        in_scope!(),
        " RETURNING owner, id, key, size, triangles, materials, created_at"
    ));
    one(update.bind(id).bind(bound(scope)), tx, rows::mesh).await
}

/// Deletes meshes that no job uses, and returns the keys of their files.
pub(super) async fn delete_unused(
    tx: &mut SqliteConnection,
    scope: Scope<'_>,
    before: i64,
) -> Result<Vec<String>, StoreError> {
    let delete = sqlx::query(concat!(
        "DELETE FROM meshes WHERE uploaded_at < $1 AND NOT EXISTS (SELECT 1 FROM job_meshes m JOIN jobs j ON j.id = m.job_id \
         WHERE m.mesh_id = meshes.id AND j.owner = meshes.owner) AND ",
        in_scope!(),
        " RETURNING key"
    ));
    all(delete.bind(before).bind(bound(scope)), tx, |row| rows::get(row, "key")).await
}

pub(super) async fn delete(tx: &mut SqliteConnection, scope: Scope<'_>, id: &str) -> Result<MeshDeletion, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT j.id FROM jobs j JOIN job_meshes m ON m.job_id = j.id \
         WHERE m.mesh_id = $1 AND j.status IN ('queued', 'running') AND ",
        in_scope!(),
        " LIMIT 1"
    ))
    .bind(id)
    .bind(bound(scope));
    let user: Option<String> = one(query, &mut *tx, first).await?;
    if user.is_some() {
        return Ok(MeshDeletion::InUse);
    }
    let query = sqlx::query(concat!("DELETE FROM meshes WHERE id = $1 AND ", in_scope!(), " RETURNING key"))
        .bind(id)
        .bind(bound(scope));
    let key: Option<String> = one(query, tx, first).await?;
    Ok(key.map_or(MeshDeletion::NotFound, MeshDeletion::Deleted))
}

//! Uploaded files.

use sqlx::{SqliteConnection, SqliteExecutor};

use crate::queue::store::*;

use super::rows::{self, signed, to_json};
use super::sql::{Scope, all, bound, first, in_scope, now_ms, one, run};

pub(super) async fn add(tx: &mut SqliteConnection, file: UploadedFile) -> Result<UploadedFile, StoreError> {
    let kind = file.about.kind();
    let query = sqlx::query(concat!(
        "INSERT INTO uploads (owner, id, kind, key, size, about, created_at, uploaded_at) VALUES ($1, $2, $3, $4, $5, $6, ",
        now_ms!(),
        ", ",
        now_ms!(),
        ") ON CONFLICT (id, owner) DO NOTHING"
    ))
    .bind(file.owner.name())
    .bind(&file.id)
    .bind(kind.name())
    .bind(&file.key)
    .bind(signed(file.size))
    .bind(to_json(&file.about)?);
    run(query, &mut *tx).await?;
    find(&mut *tx, Some(&file.owner), kind, &file.id)
        .await?
        .ok_or_else(|| StoreError::Failed("the file that was just stored is missing in the database".into()))
}

pub(super) async fn find(
    database: impl SqliteExecutor<'_>,
    scope: Scope<'_>,
    kind: UploadKind,
    id: &str,
) -> Result<Option<UploadedFile>, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT owner, id, key, size, about, created_at FROM uploads WHERE id = $1 AND kind = $3 AND ",
        in_scope!()
    ))
    .bind(id)
    .bind(bound(scope))
    .bind(kind.name());
    one(query, database, |row| rows::upload(row, kind)).await
}

pub(super) async fn uploaded_again(
    tx: &mut SqliteConnection,
    scope: Scope<'_>,
    kind: UploadKind,
    id: &str,
) -> Result<Option<UploadedFile>, StoreError> {
    let update = sqlx::query(concat!(
        "UPDATE uploads SET uploaded_at = ",
        now_ms!(),
        " WHERE id = $1 AND kind = $3 AND ",
        in_scope!(),
        " RETURNING owner, id, key, size, about, created_at"
    ));
    one(update.bind(id).bind(bound(scope)).bind(kind.name()), tx, |row| rows::upload(row, kind)).await
}

/// Deletes files that no job uses, and returns their keys. The sign keeps the query from reading all jobs of an owner.
pub(super) async fn delete_unused(
    tx: &mut SqliteConnection,
    scope: Scope<'_>,
    before: i64,
) -> Result<Vec<String>, StoreError> {
    let delete = sqlx::query(concat!(
        "DELETE FROM uploads WHERE uploaded_at < $1 AND NOT EXISTS (SELECT 1 FROM job_uploads u JOIN jobs j ON j.id = u.job_id \
         WHERE u.upload_id = uploads.id AND +j.owner = uploads.owner) AND ",
        in_scope!(),
        " RETURNING key"
    ));
    all(delete.bind(before).bind(bound(scope)), tx, |row| rows::get(row, "key")).await
}

pub(super) async fn delete(
    tx: &mut SqliteConnection,
    scope: Scope<'_>,
    kind: UploadKind,
    id: &str,
) -> Result<UploadDeletion, StoreError> {
    let query = sqlx::query(concat!(
        "SELECT j.id FROM jobs j JOIN job_uploads u ON u.job_id = j.id \
         WHERE u.upload_id = $1 AND ($3 <> 'mesh' OR j.status IN ('queued', 'running')) AND EXISTS \
         (SELECT 1 FROM uploads f WHERE f.id = u.upload_id AND f.owner = j.owner AND f.kind = $3) AND ",
        in_scope!(),
        " LIMIT 1"
    ))
    .bind(id)
    .bind(bound(scope))
    .bind(kind.name());
    let user: Option<String> = one(query, &mut *tx, first).await?;
    if user.is_some() {
        return Ok(UploadDeletion::InUse);
    }
    let query =
        sqlx::query(concat!("DELETE FROM uploads WHERE id = $1 AND kind = $3 AND ", in_scope!(), " RETURNING key"))
            .bind(id)
            .bind(bound(scope))
            .bind(kind.name());
    let key: Option<String> = one(query, tx, first).await?;
    Ok(key.map_or(UploadDeletion::NotFound, UploadDeletion::Deleted))
}

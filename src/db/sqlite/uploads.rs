//! Uploaded files.

use async_trait::async_trait;
use sqlx::SqliteExecutor;

use super::SqliteStore;
use super::rows::{self, to_json};
use super::sql::{Scope, all, bound, first, in_scope, now_ms, one, run, signed, store_error};
use crate::queue::durability::Durability;
use crate::queue::store::*;

#[async_trait]
impl UploadStore for SqliteStore {
    async fn add_upload(&self, file: UploadedFile) -> Result<UploadedFile, StoreError> {
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
        let mut tx = self.begin(Durability::Committed).await?;
        run(query, &mut *tx).await?;
        let kept = find(&mut *tx, Some(&file.owner), kind, &file.id).await?;
        tx.commit().await.map_err(store_error)?;
        kept.ok_or_else(|| StoreError::Failed("the file that was just stored is missing in the database".into()))
    }

    async fn upload(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError> {
        find(&self.readers, self.scope(), kind, id).await
    }

    async fn uploaded_again(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError> {
        let update = concat!(
            "UPDATE uploads SET uploaded_at = ",
            now_ms!(),
            " WHERE id = $1 AND kind = $3 AND ",
            in_scope!(),
            " RETURNING owner, id, key, size, about, created_at"
        );
        let update = sqlx::query(update).bind(id).bind(bound(self.scope())).bind(kind.name());
        let mut tx = self.begin(Durability::Committed).await?;
        let file = one(update, &mut *tx, |row| rows::upload(row, kind)).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(file)
    }

    /// The sign before `j.owner` keeps the query from reading all jobs of an owner.
    async fn delete_unused_uploads(&self, before: i64) -> Result<Vec<String>, StoreError> {
        let delete = concat!(
            "DELETE FROM uploads WHERE uploaded_at < $1 AND NOT EXISTS (SELECT 1 FROM job_uploads u JOIN jobs j ON j.id = u.job_id \
             WHERE u.upload_id = uploads.id AND +j.owner = uploads.owner) AND ",
            in_scope!(),
            " RETURNING key"
        );
        let delete = sqlx::query(delete).bind(before).bind(bound(self.scope()));
        let mut tx = self.begin_on_full_disk().await?;
        let keys = all(delete, &mut *tx, |row| rows::get(row, "key")).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(keys)
    }

    async fn delete_upload(&self, kind: UploadKind, id: &str) -> Result<UploadDeletion, StoreError> {
        let user = concat!(
            "SELECT j.id FROM jobs j JOIN job_uploads u ON u.job_id = j.id \
             WHERE u.upload_id = $1 AND ($3 <> 'mesh' OR j.status IN ('queued', 'running')) AND EXISTS \
             (SELECT 1 FROM uploads f WHERE f.id = u.upload_id AND f.owner = j.owner AND f.kind = $3) AND ",
            in_scope!(),
            " LIMIT 1"
        );
        let delete = concat!("DELETE FROM uploads WHERE id = $1 AND kind = $3 AND ", in_scope!(), " RETURNING key");
        let [user, delete] =
            [user, delete].map(|query| sqlx::query(query).bind(id).bind(bound(self.scope())).bind(kind.name()));
        let mut tx = self.begin_on_full_disk().await?;
        let deletion = match one(user, &mut *tx, first::<String>).await? {
            Some(_) => UploadDeletion::InUse,
            None => one(delete, &mut *tx, first).await?.map_or(UploadDeletion::NotFound, UploadDeletion::Deleted),
        };
        tx.commit().await.map_err(store_error)?;
        Ok(deletion)
    }
}

/// Reads the record of an uploaded file by its id.
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

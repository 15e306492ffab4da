//! Deletion of jobs, sets of jobs and uploaded files with their files, one or many.

use std::sync::Arc;

use uuid::Uuid;

use super::artifacts::Artifacts;
use super::live::LiveJobs;
use super::store::{Store, StoreError, UploadDeletion, UploadKind};
use super::to_its_end::to_its_end;

/// Places from which a job is deleted.
#[derive(Clone)]
pub struct Deletion {
    /// Rows of jobs, sets and uploaded files.
    pub store: Arc<dyn Store>,
    /// Files of jobs and uploads.
    pub artifacts: Artifacts,
    /// Jobs that are prepared in memory.
    pub live: Arc<LiveJobs>,
}

impl Deletion {
    /// Deletes a job with its files; false if there was none. A running job stops.
    pub async fn job(&self, id: Uuid) -> Result<bool, StoreError> {
        let Self { store, artifacts, live } = self.clone();
        let deletion = async move {
            if !store.delete(id).await? {
                return Ok(false);
            }
            live.forget(id);
            if let Err(error) = artifacts.delete_job(id).await {
                // no row names them any more: the next start sweeps them
                tracing::warn!(%error, job = %id, "deleting files failed");
            }
            Ok(true)
        };
        to_its_end(deletion).await
    }

    /// Deletes an uploaded file with its content, unless a job needs it.
    pub async fn upload(&self, kind: UploadKind, id: String) -> Result<UploadDeletion, StoreError> {
        let from = self.clone();
        let deletion = async move {
            let deletion = from.store.delete_upload(kind, &id).await?;
            if let UploadDeletion::Deleted(key) = &deletion {
                from.uploaded_file(key).await;
            }
            Ok(deletion)
        };
        to_its_end(deletion).await
    }

    /// Deletes uploaded files of all owners that no job uses and that were uploaded before a time in milliseconds since 1970; returns their number.
    pub async fn unused_uploads(&self, before: i64) -> Result<u64, StoreError> {
        let keys = self.store.delete_unused_uploads(before).await?;
        for key in &keys {
            self.uploaded_file(key).await;
        }
        Ok(keys.len() as u64)
    }

    async fn uploaded_file(&self, key: &str) {
        if let Err(error) = self.artifacts.delete(key).await {
            // nothing points to it any more: the next start sweeps it
            tracing::warn!(%error, key, "deleting an uploaded file failed");
        }
    }

    /// Deletes a set with its jobs; false if there was none. Running jobs stop.
    pub async fn set(&self, id: Uuid) -> Result<bool, StoreError> {
        let Some(set) = self.store.job_set(id).await? else { return Ok(false) };
        // no job of it begins meanwhile
        self.store.cancel_set(id).await?;
        for member in set.members {
            self.job(member.job).await?;
        }
        // the last step: after a crash before it the set can be deleted again
        self.store.delete_set(id).await
    }
}

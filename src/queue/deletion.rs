//! Deletion of jobs, studies and meshes with their files, one or many.

use std::sync::Arc;

use uuid::Uuid;

use super::artifacts::Artifacts;
use super::live::LiveJobs;
use super::store::{MeshDeletion, Store, StoreError};
use super::to_its_end::to_its_end;

/// Places from which a job is deleted.
#[derive(Clone)]
pub struct Deletion {
    /// Rows of jobs, studies and meshes.
    pub store: Arc<dyn Store>,
    /// Files of jobs and meshes.
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

    /// Deletes a mesh with its file, unless a job needs it that has not ended.
    pub async fn mesh(&self, id: String) -> Result<MeshDeletion, StoreError> {
        let from = self.clone();
        let deletion = async move {
            let deletion = from.store.delete_mesh(&id).await?;
            if let MeshDeletion::Deleted(key) = &deletion {
                from.mesh_file(key).await;
            }
            Ok(deletion)
        };
        to_its_end(deletion).await
    }

    /// Deletes meshes of all owners that no job uses and that were uploaded before a time in milliseconds since 1970; returns their number.
    pub async fn unused_meshes(&self, before: i64) -> Result<u64, StoreError> {
        let keys = self.store.delete_unused_meshes(before).await?;
        for key in &keys {
            self.mesh_file(key).await;
        }
        Ok(keys.len() as u64)
    }

    async fn mesh_file(&self, key: &str) {
        if let Err(error) = self.artifacts.delete(key).await {
            // nothing points to it any more: the next start sweeps it
            tracing::warn!(%error, key, "deleting a mesh file failed");
        }
    }

    /// Deletes a study with its jobs; false if there was none. Running jobs stop.
    pub async fn study(&self, id: Uuid) -> Result<bool, StoreError> {
        let Some(study) = self.store.study(id).await? else { return Ok(false) };
        // no job of it begins meanwhile
        self.store.cancel_study(id).await?;
        for member in study.jobs {
            self.job(member.job).await?;
        }
        // the last step: after a crash before it the study can be deleted again
        self.store.delete_study(id).await
    }
}

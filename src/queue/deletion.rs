//! Deletion of jobs and studies with their files, one or many.

use uuid::Uuid;

use super::artifacts::Artifacts;
use super::live::LiveJobs;
use super::store::{Store, StoreError};

/// Places from which a job is deleted.
#[derive(Clone, Copy)]
pub struct Deletion<'a> {
    /// Rows of jobs and studies.
    pub store: &'a dyn Store,
    /// Files of jobs.
    pub artifacts: &'a Artifacts,
    /// Jobs that are prepared in memory.
    pub live: &'a LiveJobs,
}

impl Deletion<'_> {
    /// Deletes a job with its files; false if there was none. A running job stops.
    pub async fn job(self, id: Uuid) -> Result<bool, StoreError> {
        if !self.store.delete(id).await? {
            return Ok(false);
        }
        self.live.forget(id);
        if let Err(error) = self.artifacts.delete_job(id).await {
            // no row names them any more: the next start sweeps them
            tracing::warn!(%error, job = %id, "deleting files failed");
        }
        Ok(true)
    }

    /// Deletes a study with its jobs; false if there was none. Running jobs stop.
    pub async fn study(self, id: Uuid) -> Result<bool, StoreError> {
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

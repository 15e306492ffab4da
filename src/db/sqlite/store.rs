//! Implementation of [`Store`]: each method runs its query in the transaction that it needs.

use std::collections::HashSet;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

use async_trait::async_trait;
use serde_json::Value;
use tokio::sync::broadcast;
use uuid::Uuid;

use super::sql::{Scope, store_error};
use super::{SqliteStore, artifacts, commit, equal, history, job_sets, jobs, queue, record, uploads};
use crate::engine::progress::PassReport;
use crate::queue::durability::Durability;
use crate::queue::owner::Owner;
use crate::queue::store::*;

/// Statement by which a deletion gives up to 1024 free pages (4 kB each) back to the disk; later deletions give back the rest.
const PAGES_GIVEN_BACK: &str = "PRAGMA incremental_vacuum(1024)";

impl SqliteStore {
    fn scope(&self) -> Scope<'_> {
        self.owner.as_ref()
    }

    pub(super) fn tell(&self, change: Change) {
        // an error means that nobody listens
        let _ = self.changes.send(change);
    }
}

#[async_trait]
impl Store for SqliteStore {
    fn of(&self, owner: Owner) -> Arc<dyn Store> {
        Arc::new(Self { owner: Some(owner), ..self.clone() })
    }

    async fn close(&self) {
        self.readers.close().await;
        self.writer.close().await;
        self.lock.lock().unwrap_or_else(PoisonError::into_inner).take();
    }

    async fn sync(&self, job: Uuid) -> Result<(), StoreError> {
        self.log.sync(job).await
    }

    fn changes(&self) -> broadcast::Receiver<Change> {
        self.changes.subscribe()
    }

    async fn ready(&self) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        record::written_now(&mut tx).await?;
        tx.commit().await.map_err(store_error)
    }

    async fn record(&self) -> Result<StoreRecord, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        record::record(&mut connection).await
    }

    async fn set_identity(&self, identity: &str) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        record::set_identity(&mut tx, identity).await?;
        tx.commit().await.map_err(store_error)
    }

    async fn set_sweep_from(&self, milliseconds: i64) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        record::set_sweep_from(&mut tx, milliseconds).await?;
        tx.commit().await.map_err(store_error)
    }

    async fn set_serving(&self, serving: bool) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        record::set_serving(&mut tx, serving).await?;
        tx.commit().await.map_err(store_error)
    }

    async fn check(&self) -> Result<(), StoreError> {
        let found: String =
            sqlx::query_scalar("PRAGMA quick_check(1)").fetch_one(&self.readers).await.map_err(store_error)?;
        if found == "ok" { Ok(()) } else { Err(StoreError::Failed(format!("the database is damaged: {found}"))) }
    }

    async fn submit(&self, job: NewJob, most: MostWaiting) -> Result<Submission, StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let submission = jobs::submit(&mut tx, job, most).await?;
        if let Submission::New(job, _) = &submission {
            self.commit_held(tx, job.head.id).await?;
            self.tell(Change::Job(job.head.id));
            self.tell(Change::Queue);
        } else {
            tx.rollback().await.map_err(store_error)?;
        }
        if let Submission::Repeated(job) = &submission {
            self.log.sync(job.head.id).await?;
        }
        Ok(submission)
    }

    async fn job_of_key(&self, idempotency_key: &str) -> Result<Option<Job>, StoreError> {
        let job = jobs::job_of_key(&self.readers, self.scope(), idempotency_key).await?;
        if let Some(job) = &job {
            self.log.sync(job.head.id).await?;
        }
        Ok(job)
    }

    async fn ended_equal(&self, id: Uuid) -> Result<Option<Uuid>, StoreError> {
        equal::ended_equal(&self.readers, id).await
    }

    async fn job(&self, id: Uuid) -> Result<Option<Job>, StoreError> {
        let job = jobs::job(&self.readers, self.scope(), id).await?;
        self.log.sync(id).await?;
        Ok(job)
    }

    async fn job_source(&self, id: Uuid) -> Result<Option<JobSource>, StoreError> {
        jobs::source(&self.readers, self.scope(), id).await
    }

    async fn job_head(&self, id: Uuid) -> Result<Option<JobHead>, StoreError> {
        let head = jobs::head(&self.readers, self.scope(), id).await?;
        self.log.sync(id).await?;
        Ok(head)
    }

    async fn jobs(&self, filter: JobFilter) -> Result<Vec<JobHead>, StoreError> {
        let jobs = jobs::list(&self.readers, self.scope(), filter).await?;
        self.log.sync_all().await?;
        Ok(jobs)
    }

    async fn count(&self, status: JobStatus) -> Result<u64, StoreError> {
        let count = jobs::count(&self.readers, status).await?;
        self.log.sync_all().await?;
        Ok(count)
    }

    async fn unfinished(&self) -> Result<u64, StoreError> {
        jobs::unfinished(&self.readers).await
    }

    async fn unfinished_of(&self, client: &str) -> Result<u64, StoreError> {
        jobs::unfinished_of(&self.readers, client).await
    }

    async fn cancel(&self, id: Uuid) -> Result<CancelOutcome, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let outcome = jobs::cancel(&mut tx, self.scope(), id).await?;
        tx.commit().await.map_err(store_error)?;
        self.log.sync(id).await?;
        if outcome == CancelOutcome::Accepted {
            self.tell(Change::Stop(id));
            self.tell(Change::Ended(id));
            self.tell(Change::Job(id));
        }
        Ok(outcome)
    }

    async fn delete(&self, id: Uuid) -> Result<bool, StoreError> {
        // in pieces, so that others can write in between
        let deleted = loop {
            let mut tx = self.begin(Durability::Committed).await?;
            let deleted = jobs::delete_some(&mut tx, self.scope(), id).await?;
            tx.commit().await.map_err(store_error)?;
            if let Some(deleted) = deleted {
                break deleted;
            }
        };
        if deleted {
            self.tell(Change::Stop(id));
            self.tell(Change::Job(id));
            if let Err(error) = sqlx::query(PAGES_GIVEN_BACK).fetch_all(&self.writer).await {
                tracing::warn!(%error, "giving pages back to the disk failed");
            }
        }
        Ok(deleted)
    }

    async fn events(&self, id: Uuid, after: i64, limit: u32) -> Result<Vec<Event>, StoreError> {
        let events = history::events(&self.readers, self.scope(), id, after, limit).await?;
        self.log.sync(id).await?;
        Ok(events)
    }

    async fn convergence(&self, id: Uuid, after: u64, limit: u32) -> Result<Vec<PassReport>, StoreError> {
        history::convergence(&self.readers, self.scope(), id, after, limit).await
    }

    async fn convergence_outline(&self, id: Uuid, points: u32) -> Result<Vec<PassReport>, StoreError> {
        history::convergence_outline(&self.readers, self.scope(), id, points).await
    }

    async fn artifacts(&self, id: Uuid) -> Result<Vec<Artifact>, StoreError> {
        let artifacts = artifacts::artifacts(&self.readers, self.scope(), id).await?;
        self.log.sync(id).await?;
        Ok(artifacts)
    }

    async fn artifact(&self, id: Uuid, name: &str) -> Result<Option<Artifact>, StoreError> {
        let artifact = artifacts::artifact(&self.readers, self.scope(), id, name).await?;
        self.log.sync(id).await?;
        Ok(artifact)
    }

    async fn submit_set(&self, set: NewJobSet, most: MostWaiting) -> Result<SetSubmission, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let submission = job_sets::submit(&mut tx, set, most).await?;
        if let SetSubmission::New(set) = &submission {
            tx.commit().await.map_err(store_error)?;
            set.members.iter().for_each(|member| self.tell(Change::Job(member.job)));
            self.tell(Change::Queue);
        } else {
            tx.rollback().await.map_err(store_error)?;
        }
        Ok(submission)
    }

    async fn set_of_key(&self, kind: SetKind, idempotency_key: &str) -> Result<Option<JobSet>, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        job_sets::of_key(&mut connection, self.scope(), kind, idempotency_key).await
    }

    async fn job_set(&self, id: Uuid) -> Result<Option<JobSet>, StoreError> {
        let mut connection = self.readers.acquire().await.map_err(store_error)?;
        job_sets::job_set(&mut connection, self.scope(), id).await
    }

    async fn job_sets(&self, kind: SetKind, before: Option<Uuid>, limit: u32) -> Result<Vec<Uuid>, StoreError> {
        job_sets::list(&self.readers, self.scope(), kind, before, limit).await
    }

    async fn jobs_of_set(&self, id: Uuid) -> Result<Vec<JobHead>, StoreError> {
        let heads = job_sets::heads(&self.readers, self.scope(), id).await?;
        self.log.sync_all().await?;
        Ok(heads)
    }

    async fn set_progress(&self, id: Uuid) -> Result<SetProgress, StoreError> {
        let mut tx = self.readers.begin().await.map_err(store_error)?;
        let progress = job_sets::progress(&mut tx, self.scope(), id).await?;
        tx.commit().await.map_err(store_error)?;
        self.log.sync_all().await?;
        Ok(progress)
    }

    async fn cancel_set(&self, id: Uuid) -> Result<Vec<Uuid>, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let cancelled = job_sets::cancel(&mut tx, self.scope(), id).await?;
        tx.commit().await.map_err(store_error)?;
        for job in &cancelled {
            self.tell(Change::Stop(*job));
            self.tell(Change::Ended(*job));
            self.tell(Change::Job(*job));
        }
        Ok(cancelled)
    }

    async fn keep_found(&self, set: Uuid, found: &[(Uuid, Value)]) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        job_sets::keep_found(&mut tx, set, found).await?;
        tx.commit().await.map_err(store_error)
    }

    async fn delete_set(&self, id: Uuid) -> Result<bool, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let deleted = job_sets::delete(&mut tx, self.scope(), id).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(deleted)
    }

    async fn add_upload(&self, file: UploadedFile) -> Result<UploadedFile, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let kept = uploads::add(&mut tx, file).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(kept)
    }

    async fn upload(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError> {
        uploads::find(&self.readers, self.scope(), kind, id).await
    }

    async fn uploaded_again(&self, kind: UploadKind, id: &str) -> Result<Option<UploadedFile>, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let file = uploads::uploaded_again(&mut tx, self.scope(), kind, id).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(file)
    }

    async fn delete_unused_uploads(&self, before: i64) -> Result<Vec<String>, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let keys = uploads::delete_unused(&mut tx, self.scope(), before).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(keys)
    }

    async fn delete_upload(&self, kind: UploadKind, id: &str) -> Result<UploadDeletion, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let deletion = uploads::delete(&mut tx, self.scope(), kind, id).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(deletion)
    }

    async fn claim(&self, owner: &str, lease: Duration, turn: Turn) -> Result<Option<Lease>, StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let claimed = queue::claim(&mut tx, owner, lease, turn).await?;
        tx.commit().await.map_err(store_error)?;
        if let Some(lease) = &claimed {
            self.tell(Change::Job(lease.job));
        }
        Ok(claimed)
    }

    async fn heartbeat(&self, lease: &Lease, extend: Duration) -> Result<Beat, StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let beat = queue::heartbeat(&mut tx, lease, extend).await?;
        record::written_now(&mut tx).await?;
        tx.commit().await.map_err(store_error)?;
        Ok(beat)
    }

    async fn report(&self, lease: &Lease, reports: &[Report]) -> Result<bool, StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        let held = commit::report(&mut tx, lease, reports).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Job(lease.job));
        Ok(held)
    }

    async fn complete(
        &self,
        lease: &Lease,
        reports: &[Report],
        completion: &Completion,
    ) -> Result<Committed, StoreError> {
        Ok(self.end_chunk(lease, reports, completion, None).await?.0)
    }

    async fn complete_and_claim(
        &self,
        lease: &Lease,
        reports: &[Report],
        completion: &Completion,
        next: (Duration, Turn),
    ) -> Result<(Committed, Option<Lease>), StoreError> {
        self.end_chunk(lease, reports, completion, Some(next)).await
    }

    async fn rewind(&self, lease: &Lease, reason: &str) -> Result<Committed, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let committed = commit::rewind(&mut tx, lease, reason).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Job(lease.job));
        self.tell(Change::Queue);
        Ok(committed)
    }

    async fn release(&self, lease: &Lease) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        queue::release(&mut tx, lease).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Queue);
        Ok(())
    }

    async fn put_aside(&self, lease: &Lease, slices: u64) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        queue::put_aside(&mut tx, lease, slices).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Queue);
        Ok(())
    }

    async fn fail_attempt(&self, lease: &Lease, error: &str) -> Result<(), StoreError> {
        let mut tx = self.begin(Durability::Buffered).await?;
        queue::fail_attempt(&mut tx, lease, error).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Queue);
        Ok(())
    }

    async fn take_back(&self, died: bool) -> Result<TakenBack, StoreError> {
        let mut tx = self.begin(Durability::Committed).await?;
        let taken_back = queue::take_back(&mut tx, died).await?;
        tx.commit().await.map_err(store_error)?;
        self.tell(Change::Queue);
        Ok(taken_back)
    }

    async fn ended_jobs(&self, filter: EndedFilter) -> Result<Vec<Ended>, StoreError> {
        jobs::ended(&self.readers, self.scope(), filter).await
    }

    async fn ended_sets(&self, before: Option<i64>, limit: u32) -> Result<Vec<Ended>, StoreError> {
        job_sets::ended(&self.readers, self.scope(), before, limit).await
    }

    async fn stored_bytes(&self) -> Result<u64, StoreError> {
        artifacts::stored_bytes(&self.readers).await
    }

    async fn referenced_keys(&self) -> Result<HashSet<String>, StoreError> {
        artifacts::referenced_keys(&self.readers).await
    }
}

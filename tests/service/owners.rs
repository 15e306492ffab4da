//! Two owners of one store: neither finds, lists, cancels, deletes or collides with what the other has.

use std::sync::Arc;
use std::time::Duration;

use serde_json::{Value, json};
use skyduct::db::SqliteStore;
use skyduct::engine::progress::{PassReport, Progress, StoppedBy};
use skyduct::queue::owner::Owner;
use skyduct::queue::store::*;
use tempfile::TempDir;
use uuid::Uuid;

use crate::common::{most, new_job};

/// Store of everything, and those of two owners.
struct Stores {
    all: SqliteStore,
    owners: [Owner; 2],
    ann: Arc<dyn Store>,
    ben: Arc<dyn Store>,
    _folder: TempDir,
}

impl Stores {
    async fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let all = SqliteStore::open(&folder.path().join("test.db")).await.unwrap();
        let owners = ["ann", "ben"].map(Owner::new);
        let [ann, ben] = owners.clone().map(|owner| all.of(owner));
        Self { all, owners, ann, ben, _folder: folder }
    }

    /// A job of one of the owners, posted with the key that both use.
    fn keyed(&self, owner: usize) -> NewJob {
        let (owner, body_hash) = (self.owners[owner].clone(), format!("hash of {owner}"));
        NewJob { owner, body_hash, idempotency_key: Some("key".into()), ..new_job() }
    }

    /// Queues a job of Ann, and one of Ben with the same key.
    async fn two_jobs(&self) -> [Uuid; 2] {
        let id = |submission: Submission<Job>| match submission {
            Submission::New(job) => job.head.id,
            _ => panic!("not new"),
        };
        let ann = id(self.ann.submit(self.keyed(0), most(10)).await.unwrap());
        assert!(self.ben.job_of_key("key").await.unwrap().is_none());
        [ann, id(self.ben.submit(self.keyed(1), most(10)).await.unwrap())]
    }

    /// Queues a set of one job of Ann, and one of Ben with the same key.
    async fn two_sets(&self) -> [Uuid; 2] {
        let id = |submission: Submission<JobSet>| match submission {
            Submission::New(set) => set.id,
            _ => panic!("not new"),
        };
        let ann = id(self.ann.submit_set(self.set(0), most(10)).await.unwrap());
        assert!(self.ben.set_of_key(SetKind::Jobs, "key").await.unwrap().is_none());
        [ann, id(self.ben.submit_set(self.set(1), most(10)).await.unwrap())]
    }

    fn set(&self, owner: usize) -> NewJobSet {
        let NewJob { known, body_hash, client, .. } = self.keyed(owner);
        let mut jobs = NewMembers::default();
        let fields = json!({ "seed": 1 }).as_object().unwrap().clone();
        let job = NewMember {
            name: None,
            part: Value::Null,
            submitted: jobs.submitted.divide(fields.clone()),
            document: jobs.document.divide(fields.clone()),
            plan: jobs.plan.divide(fields),
            known,
            warnings: Vec::new(),
            computation: None,
        };
        jobs.push(job, "/jobs").unwrap();
        NewJobSet {
            owner: self.owners[owner].clone(),
            kind: SetKind::Jobs,
            name: None,
            about: "{}".into(),
            idempotency_key: Some("key".into()),
            body_hash,
            client,
            uploads: Vec::new(),
            jobs,
        }
    }

    /// Renders the next waiting job to its end, with one pass and one file.
    async fn render(&self) -> Uuid {
        let lease = self.all.claim("worker", Duration::from_secs(60), Turn::default()).await.unwrap().unwrap();
        let pass = PassReport { passes: 1, seconds: 1.0, photons: 1, rays: 1, ..PassReport::default() };
        let finish = Finish {
            end: JobEnd::Succeeded { stopped_by: StoppedBy::MaxPasses, progress: Progress::default() },
            summary: None,
            artifacts: vec![Artifact::in_store("file".into(), "application/json", "{}".into())],
            last_pass: Some(Box::new(pass.into())),
        };
        let completed = self.all.complete(&lease, &[], &Completion::Finish(finish)).await.unwrap();
        assert!(matches!(completed, Committed::Yes { .. }));
        lease.job
    }
}

/// What a store finds of a job, by each of its reads.
async fn reads(store: &dyn Store, job: Uuid) -> [bool; 8] {
    [
        store.job(job).await.unwrap().is_some(),
        store.job_head(job).await.unwrap().is_some(),
        store.job_source(job).await.unwrap().is_some(),
        !store.events(job, 0, 10).await.unwrap().is_empty(),
        !store.convergence(job, 0, 10).await.unwrap().is_empty(),
        !store.convergence_outline(job, 10).await.unwrap().is_empty(),
        !store.artifacts(job).await.unwrap().is_empty(),
        store.artifact(job, "file").await.unwrap().is_some(),
    ]
}

async fn listed(store: &dyn Store, status: Option<JobStatus>) -> Vec<Uuid> {
    let jobs = store.jobs(JobFilter { status, before: None, limit: 10 }).await.unwrap();
    jobs.into_iter().map(|job| job.id).collect()
}

async fn ended(store: &dyn Store) -> Vec<Uuid> {
    let jobs = store.ended_jobs(EndedFilter { status: None, before: None, limit: 10 }).await.unwrap();
    jobs.into_iter().map(|job| job.id).collect()
}

#[tokio::test]
async fn neither_meets_the_jobs_of_the_other() {
    let stores = Stores::new().await;
    let [of_ann, of_ben] = stores.two_jobs().await;
    let (ann, ben) = (stores.ann.as_ref(), stores.ben.as_ref());
    let repeated = ann.submit(stores.keyed(0), most(10)).await.unwrap();
    assert!(matches!(repeated, Submission::Repeated(job) if job.head.id == of_ann));
    let other_body = NewJob { body_hash: "other".into(), ..stores.keyed(1) };
    assert!(matches!(ben.submit(other_body, most(10)).await.unwrap(), Submission::Refused(NotQueued::KeyReused)));
    assert_eq!(ben.job_of_key("key").await.unwrap().unwrap().head.id, of_ben);

    assert_eq!([stores.render().await, stores.render().await], [of_ann, of_ben], "the worker renders the jobs of all");
    for (store, own, other) in [(ann, of_ann, of_ben), (ben, of_ben, of_ann)] {
        assert_eq!(reads(store, own).await, [true; 8]);
        assert_eq!(reads(store, other).await, [false; 8]);
        for status in [None, Some(JobStatus::Succeeded)] {
            assert_eq!(listed(store, status).await, [own]);
        }
        assert_eq!(ended(store).await, [own]);
        assert_eq!(store.cancel(other).await.unwrap(), CancelOutcome::NotFound);
        assert!(!store.delete(other).await.unwrap());
    }
    assert_eq!(ended(&stores.all).await, [of_ann, of_ben]);
    assert_eq!(reads(&stores.all, of_ann).await, [true; 8], "nobody else has deleted a part of it");
    assert!(ann.delete(of_ann).await.unwrap());
    assert_eq!(listed(&stores.all, None).await, [of_ben]);
}

#[tokio::test]
async fn neither_meets_the_sets_of_the_other() {
    let stores = Stores::new().await;
    let [of_ann, of_ben] = stores.two_sets().await;
    for (store, number, own, other) in [(&stores.ann, 0, of_ann, of_ben), (&stores.ben, 1, of_ben, of_ann)] {
        let repeated = store.submit_set(stores.set(number), most(10)).await.unwrap();
        assert!(matches!(repeated, Submission::Repeated(set) if set.id == own));
        assert_eq!(store.set_of_key(SetKind::Jobs, "key").await.unwrap().unwrap().id, own);
        assert!(store.set_of_key(SetKind::Study, "key").await.unwrap().is_none(), "each kind has its own keys");
        assert_eq!(store.job_sets(SetKind::Jobs, None, 10).await.unwrap(), [own]);
        assert!(store.job_sets(SetKind::Study, None, 10).await.unwrap().is_empty());
        for (set, found) in [(own, 1), (other, 0)] {
            assert_eq!(store.job_set(set).await.unwrap().map_or(0, |set| set.members.len()), found);
            assert_eq!(store.jobs_of_set(set).await.unwrap().len(), found);
            assert_eq!(store.set_progress(set).await.unwrap().jobs.len(), found);
        }
        assert!(store.cancel_set(other).await.unwrap().is_empty());
        assert!(!store.delete_set(other).await.unwrap());
    }
    assert_eq!(stores.ann.cancel_set(of_ann).await.unwrap().len(), 1);
    stores.render().await;
    for (store, own) in [(&stores.ann, of_ann), (&stores.ben, of_ben)] {
        let progress = store.set_progress(own).await.unwrap();
        assert!(progress.steps.iter().all(|step| progress.jobs.iter().any(|job| job.id == step.job)));
        let ended = store.ended_sets(None, 10).await.unwrap();
        assert_eq!(ended.into_iter().map(|set| set.id).collect::<Vec<_>>(), [own]);
    }
    assert!(stores.ann.delete_set(of_ann).await.unwrap());
    assert_eq!(stores.all.job_sets(SetKind::Jobs, None, 10).await.unwrap(), [of_ben]);
}

/// Equal meshes of two owners are two files, each of which stays as long as a job of its owner needs it.
#[tokio::test]
async fn neither_meets_the_meshes_of_the_other() {
    let stores = Stores::new().await;
    let [ann, ben] = stores.owners.clone();
    stores.ann.add_upload(mesh(&ann, "of ann")).await.unwrap();
    assert!(stores.ben.upload(UploadKind::Mesh, "m").await.unwrap().is_none());
    let using = NewJob { owner: ben.clone(), uploads: vec!["m".into()], ..new_job() };
    let refused = stores.ben.submit(using.clone(), most(10)).await.unwrap();
    assert!(matches!(refused, Submission::Refused(NotQueued::UploadGone(id)) if id == "m"));
    assert_eq!(stores.ben.add_upload(mesh(&ben, "of ben")).await.unwrap().key, "of ben");
    assert!(matches!(stores.ben.submit(using, most(10)).await.unwrap(), Submission::New(_)));
    assert_eq!(stores.ben.delete_upload(UploadKind::Mesh, "m").await.unwrap(), UploadDeletion::InUse);
    assert_eq!(
        stores.ann.delete_upload(UploadKind::Mesh, "m").await.unwrap(),
        UploadDeletion::Deleted("of ann".into())
    );
    assert_eq!(stores.ann.delete_upload(UploadKind::Mesh, "m").await.unwrap(), UploadDeletion::NotFound);
    assert_eq!(stores.ben.upload(UploadKind::Mesh, "m").await.unwrap().unwrap().key, "of ben");
    assert!(stores.ann.uploaded_again(UploadKind::Mesh, "m").await.unwrap().is_none());
}

/// The retention deletes meshes that no job has the id of, among those whose last upload is long ago.
#[tokio::test]
async fn meshes_go_when_no_job_of_their_owner_is_left() {
    let stores = Stores::new().await;
    let [ann, ben] = stores.owners.clone();
    for owner in [&ann, &ben] {
        stores.all.add_upload(mesh(owner, owner.name())).await.unwrap();
    }
    let using = NewJob { owner: ben.clone(), uploads: vec!["m".into()], ..new_job() };
    let Submission::New(job) = stores.ben.submit(using, most(10)).await.unwrap() else { panic!("not new") };
    stores.render().await;
    let created = stores.ann.upload(UploadKind::Mesh, "m").await.unwrap().unwrap().created_at;
    tokio::time::sleep(Duration::from_millis(5)).await;
    let again = stores.ann.uploaded_again(UploadKind::Mesh, "m").await.unwrap().unwrap();
    assert_eq!(again.created_at, created);
    assert!(stores.all.delete_unused_uploads(created + 1).await.unwrap().is_empty(), "it was uploaded again");
    assert_eq!(stores.all.delete_unused_uploads(i64::MAX).await.unwrap(), ["ann"]);
    assert!(stores.ben.delete(job.head.id).await.unwrap());
    assert_eq!(stores.all.delete_unused_uploads(i64::MAX).await.unwrap(), ["ben"]);
}

fn mesh(owner: &Owner, key: &str) -> UploadedFile {
    UploadedFile {
        owner: owner.clone(),
        id: "m".into(),
        key: key.into(),
        size: 1,
        about: About::Mesh(AboutMesh { triangles: 1, materials: Vec::new() }),
        created_at: 0,
    }
}

/// The worker takes no results of another owner's job, whose id it would tell, and lets nobody wait for it.
#[tokio::test]
async fn neither_takes_the_results_of_the_other() {
    let stores = Stores::new().await;
    let new = |owner: &Owner| NewJob { owner: owner.clone(), computation: Some("equal".into()), ..new_job() };
    let [ann, ben] = stores.owners.clone();
    for owner in [&ann, &ben, &ann] {
        assert!(matches!(stores.all.submit(new(owner), most(10)).await.unwrap(), Submission::New(_)));
    }
    let claim = async || stores.all.claim("worker", Duration::from_secs(60), Turn::default()).await.unwrap();
    let claimed = [
        claim().await.unwrap().job,
        stores.all.claim("other", Duration::from_secs(60), Turn::default()).await.unwrap().unwrap().job,
    ];
    assert!(stores.all.claim("third", Duration::from_secs(60), Turn::default()).await.unwrap().is_none());
    let of = async |job: Uuid| stores.all.job_source(job).await.unwrap().unwrap().owner;
    assert_eq!([of(claimed[0]).await, of(claimed[1]).await], [ann, ben]);
}

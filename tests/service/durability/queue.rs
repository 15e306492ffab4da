//! The queue in the store: leases, fences, completions, whatever order things happen in.

use std::collections::HashMap;
use std::time::Duration;

use proptest::prelude::*;
use serde_json::json;
use skyduct::db::SqliteStore;
use skyduct::engine::progress::{PassReport, Progress, StoppedBy};
use skyduct::queue::owner::Owner;
use skyduct::queue::store::*;
use tempfile::TempDir;
use uuid::Uuid;

use crate::common::{most, new_job};
use skyduct::engine::spent::Spent;

const LEASE: Duration = Duration::from_secs(600);
const ANY: Turn = Turn { stay_with: None, later_first: false, short: false, most_deaths: MAX_DEATHS };

async fn store() -> (SqliteStore, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    (SqliteStore::open(&folder.path().join("test.db")).await.unwrap(), folder)
}

async fn submit(store: &SqliteStore) -> Uuid {
    submit_of(store, "client").await
}

async fn submit_of(store: &SqliteStore, client: &str) -> Uuid {
    match store.submit(NewJob { client: client.into(), ..new_job() }, most(1000)).await.unwrap() {
        Submission::New(job) => job.head.id,
        _ => panic!("not new"),
    }
}

fn pass(passes: u64) -> PassReport {
    PassReport {
        passes,
        seconds: 0.1 * passes as f64,
        photons: 100 * passes,
        rays: 1000 * passes,
        relative_error: (passes > 1).then(|| 1.0 / passes as f64),
        view_relative_error: None,
        degrees_of_freedom: (passes > 1).then_some(3.5 * passes as f64),
        mean_lux: Some(0.1 + 0.2),
        cpu_seconds: Some(0.2 * passes as f64),
    }
}

fn go_on(chunk: u64) -> Completion {
    Completion::Continue {
        state: StateFile { key: format!("state-{chunk}"), hash: format!("hash-{chunk}") },
        progress: Progress {
            passes: 8 * (chunk + 1),
            chunks: chunk + 1,
            seconds: 1.5,
            cpu_seconds: Some(2.5),
            ..Progress::default()
        },
        ahead: Vec::new(),
    }
}

fn end(status: JobStatus) -> Completion {
    let progress = Progress { passes: 16, chunks: 2, ..Progress::default() };
    let stopped_by = StoppedBy::RelativeError;
    let problem = JobProblem { title: "It failed".into(), detail: "for the test".into() };
    Completion::Finish(Finish {
        end: match status {
            JobStatus::Cancelled => JobEnd::Cancelled { progress },
            JobStatus::Failed => JobEnd::Failed { problem, stopped_by: Some(stopped_by), progress: Some(progress) },
            _ => JobEnd::Succeeded { stopped_by, progress },
        },
        summary: Some(json!({ "timing": 1 })),
        artifacts: vec![Artifact {
            name: "grids/a.json".into(),
            key: "key".into(),
            hash: "hash".into(),
            size: 3,
            media_type: "application/json".into(),
            content: None,
        }],
        last_pass: None,
    })
}

async fn event_names(store: &SqliteStore, job: Uuid) -> Vec<String> {
    let events = store.events(job, 0, 10_000).await.unwrap();
    for (index, event) in events.iter().enumerate() {
        assert_eq!(event.seq, index as i64 + 1, "gapless");
    }
    events.into_iter().map(|event| event.name).collect()
}

#[tokio::test]
async fn a_job_through_two_chunks() {
    let (store, _folder) = store().await;
    assert_eq!(store.claim("w", LEASE, ANY).await.unwrap(), None);
    let id = submit(&store).await;
    let lease = store.claim("w", LEASE, ANY).await.unwrap().unwrap();
    assert_eq!((lease.job, lease.chunk, lease.attempt), (id, 0, 1));
    assert_eq!(store.claim("v", LEASE, ANY).await.unwrap(), None, "leased chunks are not claimed");
    assert_eq!(store.heartbeat(&lease, LEASE).await.unwrap(), Beat::Keep);
    assert!(store.report(&lease, &[Report::Pass(pass(1).into()), Report::Pass(pass(2).into())]).await.unwrap());
    let head = store.job_head(id).await.unwrap().unwrap();
    assert_eq!((head.status, head.progress.passes, head.progress.chunks), (JobStatus::Running, 2, 0));
    assert_eq!(store.complete(&lease, &[], &go_on(0)).await.unwrap(), Committed::Yes { obsolete: Vec::new() });
    let source = store.job_source(id).await.unwrap().unwrap();
    assert_eq!(source.state, Some(StateFile { key: "state-0".into(), hash: "hash-0".into() }));
    assert_eq!(source.merged_spent, Spent { seconds: 1.5, cpu_seconds: Some(2.5) });

    let second = store.claim("w", LEASE, ANY).await.unwrap().unwrap();
    assert_eq!((second.chunk, second.attempt), (1, 1));
    let done = store.complete(&second, &[], &end(JobStatus::Succeeded)).await.unwrap();
    assert_eq!(done, Committed::Yes { obsolete: vec!["state-0".into()] });
    assert_eq!(store.claim("w", LEASE, ANY).await.unwrap(), None);
    let job = store.job(id).await.unwrap().unwrap();
    assert_eq!((job.head.status, job.head.stopped_by), (JobStatus::Succeeded, Some(StoppedBy::RelativeError)));
    assert_eq!(job.summary, Some(json!({ "timing": 1 })));
    assert_eq!(store.job_source(id).await.unwrap().unwrap().state, None);
    assert_eq!(store.artifact(id, "grids/a.json").await.unwrap().unwrap().key, "key");
    assert_eq!(event_names(&store, id).await, ["queued", "planned", "started", "pass", "pass", "succeeded"]);
    // doubles survive to the bit
    assert_eq!(store.convergence(id, 0, 1000).await.unwrap(), [pass(1), pass(2)]);
    // final is final
    assert_eq!(store.cancel(id).await.unwrap(), CancelOutcome::Finished(JobStatus::Succeeded));
    assert_eq!(store.complete(&second, &[], &end(JobStatus::Failed)).await.unwrap(), Committed::LeaseLost);
}

#[tokio::test]
async fn who_lost_the_lease_changes_nothing() {
    let (store, _folder) = store().await;
    let id = submit(&store).await;
    let zombie = store.claim("zombie", Duration::ZERO, ANY).await.unwrap().unwrap();
    tokio::time::sleep(Duration::from_millis(5)).await;
    let lease = store.claim("heir", LEASE, ANY).await.unwrap().unwrap();
    assert_eq!(lease.attempt, 2);
    assert_eq!(store.claim("third", LEASE, ANY).await.unwrap(), None, "this lease runs");

    let forged = Lease { owner: "heir".into(), ..zombie.clone() };
    for lost in [&zombie, &forged, &Lease { attempt: 2, ..zombie.clone() }, &Lease { chunk: 1, ..lease.clone() }] {
        assert_eq!(store.heartbeat(lost, LEASE).await.unwrap(), Beat::Lost);
        assert!(!store.report(lost, &[Report::Pass(pass(1).into())]).await.unwrap());
        assert_eq!(store.complete(lost, &[], &go_on(0)).await.unwrap(), Committed::LeaseLost);
        assert_eq!(store.complete(lost, &[], &end(JobStatus::Failed)).await.unwrap(), Committed::LeaseLost);
        store.release(lost).await.unwrap();
        store.fail_attempt(lost, "no").await.unwrap();
    }
    assert_eq!(store.heartbeat(&lease, LEASE).await.unwrap(), Beat::Keep);
    assert!(store.convergence(id, 0, 1000).await.unwrap().is_empty());
    assert_eq!(event_names(&store, id).await, ["queued", "planned", "started"]);
    store.complete(&lease, &[], &go_on(0)).await.unwrap();
    // an answer that was lost on the way: the same completion again is no second one
    assert_eq!(store.complete(&lease, &[], &go_on(0)).await.unwrap(), Committed::LeaseLost);
    assert_eq!(store.job_head(id).await.unwrap().unwrap().progress.chunks, 1);
}

#[tokio::test]
async fn passes_that_are_rendered_again_do_not_double() {
    let (store, folder) = store().await;
    let id = submit(&store).await;
    let first = store.claim("dies", LEASE, ANY).await.unwrap().unwrap();
    store
        .report(&first, &[Report::Pass(pass(1).into()), Report::Pass(pass(2).into()), Report::Pass(pass(3).into())])
        .await
        .unwrap();
    store.close().await;
    // the process is gone; the next one takes over at once, however long the lease
    let store = SqliteStore::open(&folder.path().join("test.db")).await.unwrap();
    assert_eq!(store.take_back(true).await.unwrap(), TakenBack { ready: 1, failed: Vec::new() });
    let second = store.claim("lives", LEASE, ANY).await.unwrap().unwrap();
    assert_eq!((second.chunk, second.attempt, second.failures), (0, 2, 0));
    let slower = PassReport { seconds: 9.0, ..pass(2) };
    let reports: Vec<Report> =
        [pass(1), slower, pass(3), pass(4)].into_iter().map(|pass| Report::Pass(pass.into())).collect();
    store.report(&second, &reports).await.unwrap();
    let table = store.convergence(id, 0, 1000).await.unwrap();
    assert_eq!(table, [pass(1), slower, pass(3), pass(4)]);
    assert_eq!(event_names(&store, id).await, ["queued", "planned", "started", "pass", "pass", "pass", "pass"]);
}

#[tokio::test]
async fn failures_are_counted_and_releases_are_not() {
    let (store, _folder) = store().await;
    submit(&store).await;
    for (round, failures) in [0, 0, 1, 2].into_iter().enumerate() {
        let lease = store.claim("w", LEASE, ANY).await.unwrap().unwrap();
        assert_eq!((lease.attempt, lease.failures), (round as i64 + 1, failures));
        if round == 0 {
            store.release(&lease).await.unwrap();
        } else {
            store.fail_attempt(&lease, "boom").await.unwrap();
        }
    }
}

#[tokio::test]
async fn cancelling_in_every_state() {
    let (store, _folder) = store().await;
    assert_eq!(store.cancel(Uuid::now_v7()).await.unwrap(), CancelOutcome::NotFound);
    let waiting = submit(&store).await;
    assert_eq!(store.cancel(waiting).await.unwrap(), CancelOutcome::Accepted);
    assert_eq!(store.job_head(waiting).await.unwrap().unwrap().status, JobStatus::Cancelled);
    assert_eq!(store.claim("w", LEASE, ANY).await.unwrap(), None);
    assert_eq!(event_names(&store, waiting).await, ["queued", "planned", "cancelled"]);

    let running = submit(&store).await;
    let lease = store.claim("w", LEASE, ANY).await.unwrap().unwrap();
    assert!(!lease.cancel_requested);
    assert_eq!(store.cancel(running).await.unwrap(), CancelOutcome::Accepted);
    assert_eq!(store.heartbeat(&lease, LEASE).await.unwrap(), Beat::Cancel);
    // the worker died: its successor is told
    store.take_back(false).await.unwrap();
    let lease = store.claim("w", LEASE, ANY).await.unwrap().unwrap();
    assert!(lease.cancel_requested && store.job_head(running).await.unwrap().unwrap().cancel_requested);
    store.complete(&lease, &[], &end(JobStatus::Cancelled)).await.unwrap();
    assert_eq!(store.cancel(running).await.unwrap(), CancelOutcome::Accepted, "again is no error");
    assert_eq!(event_names(&store, running).await.iter().filter(|name| *name == "cancelled").count(), 1);
}

#[tokio::test]
async fn a_deleted_job_takes_everything_with_it() {
    let (store, _folder) = store().await;
    let id = submit(&store).await;
    let lease = store.claim("w", LEASE, ANY).await.unwrap().unwrap();
    store.report(&lease, &[Report::Pass(pass(1).into())]).await.unwrap();
    assert!(store.delete(id).await.unwrap());
    assert!(!store.delete(id).await.unwrap());
    assert_eq!(store.heartbeat(&lease, LEASE).await.unwrap(), Beat::Lost);
    assert_eq!(store.complete(&lease, &[], &end(JobStatus::Succeeded)).await.unwrap(), Committed::LeaseLost);
    assert!(store.job(id).await.unwrap().is_none());
    assert!(store.events(id, 0, 10).await.unwrap().is_empty());
    assert!(store.convergence(id, 0, 1000).await.unwrap().is_empty());
    assert!(store.referenced_keys().await.unwrap().is_empty());
}

#[tokio::test]
async fn two_claimers_never_get_the_same_chunk() {
    let (store, _folder) = store().await;
    for _ in 0..20 {
        submit(&store).await;
    }
    let claims = futures::future::join_all((0..40).map(|n| {
        let store = &store;
        async move { store.claim(&format!("w{n}"), LEASE, ANY).await.unwrap() }
    }))
    .await;
    let mut jobs: Vec<Uuid> = claims.into_iter().flatten().map(|lease| lease.job).collect();
    assert_eq!(jobs.len(), 20);
    jobs.sort();
    jobs.dedup();
    assert_eq!(jobs.len(), 20);
}

#[tokio::test]
async fn meshes_of_waiting_jobs_stay() {
    let (store, _folder) = store().await;
    let mesh = |id: &str, key: &str| UploadedFile {
        owner: Owner::default(),
        id: id.into(),
        key: key.into(),
        size: 1,
        about: About::Mesh(AboutMesh { triangles: 1, materials: vec!["pipe".into()] }),
        created_at: 0,
    };
    store.add_upload(mesh("m", "first")).await.unwrap();
    assert_eq!(store.add_upload(mesh("m", "second")).await.unwrap().key, "first");
    let using = |mesh: &str| NewJob { uploads: vec![mesh.into()], ..new_job() };
    let Submission::New(job) = store.submit(using("m"), most(10)).await.unwrap() else { panic!("not new") };
    assert!(
        matches!(store.submit(using("n"), most(10)).await.unwrap(), Submission::Refused(NotQueued::UploadGone(id)) if id == "n")
    );
    assert_eq!(store.jobs(JobFilter { limit: 10, ..JobFilter::default() }).await.unwrap().len(), 1);
    assert_eq!(store.delete_upload(UploadKind::Mesh, "m").await.unwrap(), UploadDeletion::InUse);
    assert_eq!(store.upload(UploadKind::Weather, "m").await.unwrap(), None);
    store.cancel(job.head.id).await.unwrap();
    assert_eq!(store.delete_upload(UploadKind::Weather, "m").await.unwrap(), UploadDeletion::NotFound);
    assert_eq!(store.delete_upload(UploadKind::Mesh, "m").await.unwrap(), UploadDeletion::Deleted("first".into()));
    assert_eq!(store.delete_upload(UploadKind::Mesh, "m").await.unwrap(), UploadDeletion::NotFound);
}

/// Something that a worker, a client or a crash does.
#[derive(Clone, Debug)]
enum Step {
    Submit,
    Claim,
    Report,
    Continue,
    Succeed,
    Release,
    Fail,
    Crash,
    Cancel,
    Delete,
}

fn steps() -> impl Strategy<Value = Vec<(Step, usize)>> {
    let step = prop_oneof![
        2 => Just(Step::Submit),
        6 => Just(Step::Claim),
        4 => Just(Step::Report),
        4 => Just(Step::Continue),
        1 => Just(Step::Succeed),
        1 => Just(Step::Release),
        1 => Just(Step::Fail),
        1 => Just(Step::Crash),
        1 => Just(Step::Cancel),
        1 => Just(Step::Delete),
    ];
    prop::collection::vec((step, 0..100_usize), 1..60)
}

async fn check_invariants(steps: Vec<(Step, usize)>) {
    let (store, _folder) = store().await;
    let mut jobs: Vec<Uuid> = Vec::new();
    // every lease ever handed out, dead ones too
    let mut leases: Vec<Lease> = Vec::new();
    // the chunks that a model says are done, and the newest lease of each job
    let mut done: HashMap<Uuid, u64> = HashMap::new();
    let mut holder: HashMap<Uuid, Lease> = HashMap::new();
    let mut ended: HashMap<Uuid, JobStatus> = HashMap::new();
    for (step, pick) in steps {
        let lease = (!leases.is_empty()).then(|| leases[pick % leases.len()].clone());
        let held = lease.as_ref().is_some_and(|lease| holder.get(&lease.job) == Some(lease));
        match (step, lease) {
            (Step::Submit, _) => jobs.push(submit_of(&store, ["a", "b", "c"][pick % 3]).await),
            (Step::Claim, _) => {
                // a worker that claims again has lost what it had
                let owner = format!("w{}", leases.len());
                if let Some(lease) = store.claim(&owner, LEASE, ANY).await.unwrap() {
                    assert!(!holder.contains_key(&lease.job), "one owner");
                    assert_eq!(lease.chunk, done.get(&lease.job).copied().unwrap_or(0), "in order");
                    holder.insert(lease.job, lease.clone());
                    leases.push(lease);
                }
            }
            (Step::Report, Some(lease)) => {
                let passes = 8 * lease.chunk + pick as u64 % 8 + 1;
                assert_eq!(store.report(&lease, &[Report::Pass(pass(passes).into())]).await.unwrap(), held);
            }
            (Step::Continue, Some(lease)) => {
                let committed = store.complete(&lease, &[], &go_on(lease.chunk)).await.unwrap();
                assert_eq!(committed != Committed::LeaseLost, held);
                if held {
                    holder.remove(&lease.job);
                    *done.entry(lease.job).or_default() += 1;
                }
            }
            (Step::Succeed, Some(lease)) => {
                let committed = store.complete(&lease, &[], &end(JobStatus::Succeeded)).await.unwrap();
                assert_eq!(committed != Committed::LeaseLost, held);
                if held {
                    holder.remove(&lease.job);
                    ended.insert(lease.job, JobStatus::Succeeded);
                }
            }
            (Step::Release, Some(lease)) => {
                store.release(&lease).await.unwrap();
                if held {
                    holder.remove(&lease.job);
                }
            }
            (Step::Fail, Some(lease)) => {
                store.fail_attempt(&lease, "boom").await.unwrap();
                if held {
                    holder.remove(&lease.job);
                }
            }
            (Step::Crash, _) => {
                assert_eq!(store.take_back(false).await.unwrap().ready, holder.len() as u64);
                holder.clear();
            }
            (Step::Cancel, _) if !jobs.is_empty() => {
                let id = jobs[pick % jobs.len()];
                let before = store.job_head(id).await.unwrap().unwrap().status;
                store.cancel(id).await.unwrap();
                if before == JobStatus::Queued {
                    ended.insert(id, JobStatus::Cancelled);
                }
            }
            (Step::Delete, _) if !jobs.is_empty() => {
                let id = jobs.swap_remove(pick % jobs.len());
                assert!(store.delete(id).await.unwrap());
                holder.remove(&id);
                ended.remove(&id);
            }
            _ => {}
        }
    }
    for id in jobs {
        let names = event_names(&store, id).await;
        let head = store.job_head(id).await.unwrap().unwrap();
        let finals: Vec<&String> = names.iter().filter(|name| is_final_event(name)).collect();
        match ended.get(&id) {
            Some(status) => {
                assert_eq!(head.status, *status);
                assert_eq!(finals, [status.name()]);
                assert_eq!(names.last().map(String::as_str), Some(status.name()));
            }
            None => {
                assert!(!head.status.is_final());
                assert!(finals.is_empty());
                assert_eq!(head.progress.chunks, done.get(&id).copied().unwrap_or(0));
            }
        }
        let passes: Vec<u64> = store.convergence(id, 0, 1000).await.unwrap().iter().map(|row| row.passes).collect();
        assert!(passes.is_sorted_by(|a, b| a < b));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn whatever_happens_the_queue_agrees_with_a_model(steps in steps()) {
        tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap().block_on(check_invariants(steps));
    }
}

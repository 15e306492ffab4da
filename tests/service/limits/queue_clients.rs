//! Clients that share the queue: whoever posts much makes nobody else wait for it.

use std::time::Duration;

use reqwest::Method;
use skyduct::db::SqliteStore;
use skyduct::engine::progress::{Progress, StoppedBy};
use skyduct::queue::store::*;
use tempfile::TempDir;
use uuid::Uuid;

use crate::common::{TestService, endless_job, most, new_job, problem, small_job};

const LEASE: Duration = Duration::from_secs(600);

async fn store() -> (SqliteStore, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    (SqliteStore::open(&folder.path().join("test.db")).await.unwrap(), folder)
}

fn go_on(chunk: u64) -> Completion {
    let after = chunk + 1;
    Completion::Continue {
        state: StateFile { key: format!("state-{chunk}"), hash: "hash".into() },
        progress: Progress { passes: 8 * after, chunks: after, ..Progress::default() },
        ahead: Vec::new(),
    }
}

fn end() -> Completion {
    let end = JobEnd::Succeeded { stopped_by: StoppedBy::MaxPasses, progress: Progress::default() };
    Completion::Finish(Finish { end, summary: None, artifacts: Vec::new(), last_pass: None })
}

async fn submit_of(store: &SqliteStore, client: &str, most: MostWaiting) -> Submission<Job> {
    store.submit(NewJob { client: client.into(), ..new_job() }, most).await.unwrap()
}

async fn queued_of(store: &SqliteStore, client: &str) -> Uuid {
    match submit_of(store, client, most(1000)).await {
        Submission::New(job) => job.head.id,
        _ => panic!("not new"),
    }
}

/// Takes the next chunk, lets it end or go on, and tells whose job it was.
async fn one_chunk(store: &SqliteStore, turn: Turn, goes_on: impl Fn(Uuid) -> bool) -> Uuid {
    let lease = store.claim("w", LEASE, turn).await.unwrap().unwrap();
    let completion = if goes_on(lease.job) { go_on(lease.chunk) } else { end() };
    assert!(matches!(store.complete(&lease, &[], &completion).await.unwrap(), Committed::Yes { .. }));
    lease.job
}

#[tokio::test]
async fn three_hundred_jobs_of_one_client_delay_one_of_another_by_one_turn() {
    let (store, _folder) = store().await;
    let mut flood = Vec::new();
    for _ in 0..300 {
        flood.push(queued_of(&store, "many").await);
    }
    // before any has begun, while one is rendered, and when half of them have ended
    for begun in [0, 1, 150] {
        for job in &flood[..begun] {
            assert_eq!(
                one_chunk(&store, Turn::default(), |_| false).await,
                *job,
                "a client's own jobs keep their order"
            );
        }
        flood.drain(..begun);
        let running = store.claim("w", LEASE, Turn::default()).await.unwrap().unwrap();
        let alone = queued_of(&store, "one").await;
        store.complete(&running, &[], &end()).await.unwrap();
        assert_eq!(running.job, flood.remove(0));
        // the many have the turn that was next when it came, and not one more
        let next = [(); 2].map(|()| one_chunk(&store, Turn::default(), |_| false));
        let [of_many, after] = next;
        assert_eq!((of_many.await, after.await), (flood.remove(0), alone));
    }
    // two that come alone do not make each other wait for the many
    let (second, third) = (queued_of(&store, "two").await, queued_of(&store, "three").await);
    let mut began = Vec::new();
    for _ in 0..3 {
        began.push(one_chunk(&store, Turn::default(), |_| false).await);
    }
    assert!(began.contains(&second) && began.contains(&third), "{began:?}");
}

#[tokio::test]
async fn two_clients_share_the_worker() {
    let (store, _folder) = store().await;
    let mut many = Vec::new();
    for _ in 0..9 {
        many.push(queued_of(&store, "many").await);
    }
    let one = queued_of(&store, "one").await;
    for _ in 0..10 {
        one_chunk(&store, Turn::default(), |_| true).await;
    }
    // all are in the line of later chunks; the one's turn has five chunks, those of the others have one
    let mut turns = Vec::new();
    for _ in 0..20 {
        let job = one_chunk(&store, Turn::default(), |_| true).await;
        if job == one {
            for _ in 0..4 {
                let stay = Turn { stay_with: Some(one), ..Turn::default() };
                assert_eq!(one_chunk(&store, stay, |_| true).await, one);
            }
        }
        turns.push(job);
    }
    let of_one: Vec<usize> = (0..20).filter(|turn| turns[*turn] == one).collect();
    assert!((9..=11).contains(&of_one.len()), "{of_one:?}");
    assert!(of_one.windows(2).all(|two| two[1] - two[0] <= 3), "{of_one:?}");
    // the other's own jobs take turns, too
    let of_many: Vec<Uuid> = turns.into_iter().filter(|job| *job != one).take(9).collect();
    assert!(many.iter().all(|job| of_many.contains(job)), "{of_many:?}");
}

#[tokio::test]
async fn a_client_with_a_full_quota_waits_and_others_do_not() {
    let (store, _folder) = store().await;
    let quota = MostWaiting { jobs: 5, of_client: 2 };
    let mut jobs = Vec::new();
    for _ in 0..3 {
        let Submission::New(job) = submit_of(&store, "many", quota).await else { panic!("not new") };
        jobs.push(job.head.id);
    }
    assert!(matches!(submit_of(&store, "many", quota).await, Submission::Refused(NotQueued::ClientFull)));
    assert_eq!(store.unfinished_of("many").await.unwrap(), 3);
    for _ in 0..3 {
        assert!(matches!(submit_of(&store, "one", quota).await, Submission::New(_)));
    }
    assert!(matches!(submit_of(&store, "two", quota).await, Submission::Refused(NotQueued::QueueFull)));
    store.cancel(jobs[0]).await.unwrap();
    assert!(matches!(submit_of(&store, "many", quota).await, Submission::New(_)));
}

/// A turn that is offered to later chunks first is theirs, and no other one, whoever posts job after job.
#[tokio::test]
async fn a_flood_of_first_chunks_stops_neither_other_clients_nor_its_own() {
    let (store, _folder) = store().await;
    let (of_other, of_flood) = (queued_of(&store, "one").await, queued_of(&store, "many").await);
    for _ in 0..2 {
        one_chunk(&store, Turn::default(), |_| true).await;
    }
    let later_first = Turn { later_first: true, ..Turn::default() };
    let mut later = Vec::new();
    for offered in 0..6 {
        for _ in 0..5 {
            queued_of(&store, "many").await;
        }
        for _ in 0..4 {
            let first = one_chunk(&store, Turn::default(), |_| false).await;
            assert!(![of_other, of_flood].contains(&first), "first chunks go first");
        }
        let job = one_chunk(&store, later_first, |job| [of_other, of_flood].contains(&job)).await;
        assert!([of_other, of_flood].contains(&job), "turn {offered}");
        later.push(job);
    }
    assert_eq!(later.iter().filter(|job| **job == of_other).count(), 3, "{later:?}");
    // where no later chunk waits, such a turn is anybody's
    for job in [of_other, of_flood] {
        assert!(store.delete(job).await.unwrap());
    }
    one_chunk(&store, later_first, |_| false).await;
}

/// A pass of hours keeps its place in the line, behind which nobody comes who posted later than others.
#[tokio::test]
async fn a_chunk_that_is_rendered_for_hours_lets_nobody_overtake() {
    let (store, _folder) = store().await;
    queued_of(&store, "hours").await;
    let hours = store.claim("hours", LEASE, Turn::default()).await.unwrap().unwrap();
    let mut of_many = Vec::new();
    for _ in 0..3 {
        of_many.push(queued_of(&store, "many").await);
    }
    // the one posts its next job when its last one has ended
    let mut began = Vec::new();
    for _ in 0..3 {
        queued_of(&store, "one").await;
        for _ in 0..2 {
            began.push(one_chunk(&store, Turn::default(), |_| false).await);
        }
    }
    assert!(of_many.iter().all(|job| began.contains(job)), "{began:?}");
    assert!(matches!(store.complete(&hours, &[], &end()).await.unwrap(), Committed::Yes { .. }));
}

#[tokio::test]
async fn a_client_whose_quota_is_full_is_told_when_to_come_back() {
    let service = TestService::start_with(|config| config.limits.queued_jobs_per_client = 2).await;
    // one is rendered, two wait
    let mut jobs = Vec::new();
    for _ in 0..3 {
        jobs.push(service.submit(&endless_job()).await);
    }
    // the second is refused before it is prepared
    for _ in 0..2 {
        let full = service.post_job(&small_job()).send().await.unwrap();
        assert_eq!(full.headers()["retry-after"], "30");
        let full = problem(full, 429).await;
        assert_eq!(full["type"], "/problems/too-many");
        let detail = full["detail"].as_str().unwrap();
        assert!(
            detail.starts_with("this client has reached its limit of 2 waiting jobs (queued_jobs_per_client)"),
            "{detail}"
        );
    }
    for job in jobs {
        service.request(Method::DELETE, &job).send().await.unwrap();
    }
    service.submit(&small_job()).await;
}

//! Passes of hours: others go on meanwhile, and what is put aside is rendered again.

use reqwest::Method;
use serde_json::{Value, json};
use skyduct::db::SqliteStore;
use skyduct::queue::store::*;
use sqlx::{ConnectOptions, Connection, sqlite::SqliteConnectOptions};
use std::time::Duration;

use crate::common::{PATIENCE, TestService, client, events_until, most, new_job, small_job};
use crate::process::Server;

const LEASE: Duration = Duration::from_secs(600);

/// A view whose pass takes an hour or so.
fn hours() -> Value {
    let mut job = small_job();
    job["grids"] = json!([]);
    job["views"][0]["size_px"] = json!([1024, 1024]);
    job["method"] = json!({ "kind": "bidirectional_path_tracing", "samples_per_pixel": 4096 });
    job
}

/// The reader of a job's events needs no change of the job to see that nobody listens any more.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_reader_of_events_ends_with_its_last_stream() {
    // metrics are those of a process
    let data = tempfile::tempdir().unwrap();
    let service = Server::start(data.path(), &[]);
    let job = service.submit(&hours()).await;
    let stream = client().get(format!("{}{job}/events", service.url));
    events_until(stream, 0, |event| event.name == "started").await;
    let ended = async {
        while !String::from_utf8(service.get("/metrics").await).unwrap().contains("skyduct_watched_jobs 0") {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(PATIENCE, ended).await.expect("the reader ends");
}

/// Nobody counts seconds: the pass of hours is in its first pass still when the others have ended.
#[tokio::test]
async fn a_pass_of_hours_lets_a_short_job_through() {
    let calm = TestService::start().await;
    let job = calm.submit(&small_job()).await;
    assert_eq!(calm.finished(&job).await["status"], "succeeded");
    let expected = calm.json(&format!("{job}/grids/workplane")).await;

    let service = TestService::start().await;
    let long = service.submit(&hours()).await;
    service.events_until(&long, 0, |event| event.name == "started").await;
    // as many as there are: whoever comes second does not wait for the pass either
    let mut last = String::new();
    for seed in [1, 2, 7] {
        let mut job = small_job();
        job["seed"] = seed.into();
        last = service.submit(&job).await;
        assert_eq!(service.finished(&last).await["status"], "succeeded");
    }
    assert_eq!(service.json(&format!("{last}/grids/workplane")).await["illuminance_lux"], expected["illuminance_lux"]);
    let head = service.json(&long).await;
    assert_eq!((&head["status"], &head["progress"]["passes"]), (&json!("running"), &json!(0)), "{head}");
    // a second one is put aside in the short lane; a stop gives both chunks back
    let mut second = hours();
    second["seed"] = 8.into();
    let second = service.submit(&second).await;
    service.events_until(&second, 0, |event| event.name == "started").await;
    let TestService { running, data, .. } = service;
    running.stop().await;
    let file = data.path().join("skyduct.db");
    let mut database = SqliteConnectOptions::new().filename(file).connect().await.unwrap();
    let leased = "SELECT count(*) FROM chunks WHERE state = 'leased' OR owner IS NOT NULL";
    assert_eq!(sqlx::query_scalar::<_, i64>(leased).fetch_one(&mut database).await.unwrap(), 0);
    let open = "SELECT count(*) FROM chunks WHERE state = 'ready'";
    assert_eq!(sqlx::query_scalar::<_, i64>(open).fetch_one(&mut database).await.unwrap(), 2);
    database.close().await.unwrap();
}

/// A job put aside in mid-pass, and one rendered beside another, has the bits of a job that was alone.
#[tokio::test]
async fn a_pass_that_is_put_aside_and_rendered_again_has_the_same_bits() {
    // of some seconds: longer than a slice on most machines
    let mut job = hours();
    job["views"][0]["size_px"] = json!([256, 256]);
    job["method"]["samples_per_pixel"] = 16.into();
    job["stop"]["max_passes"] = 1.into();
    let picture = async |service: &TestService, path: &str| {
        let response = service.get(&format!("{path}/views/room.exr")).send().await.unwrap();
        assert_eq!(response.status(), 200);
        response.bytes().await.unwrap()
    };
    let calm = TestService::start().await;
    let alone = calm.submit(&job).await;
    assert_eq!(calm.finished(&alone).await["status"], "succeeded");
    let expected = picture(&calm, &alone).await;
    drop(calm);

    let service = TestService::start().await;
    let long = service.submit(&hours()).await;
    service.events_until(&long, 0, |event| event.name == "started").await;
    let disturbed = service.submit(&job).await;
    let file = service.data.path().join("skyduct.db");
    let mut database = SqliteConnectOptions::new().filename(file).read_only(true).connect().await.unwrap();
    loop {
        let slices =
            sqlx::query_scalar::<_, i64>("SELECT max(slices) FROM jobs").fetch_one(&mut database).await.unwrap();
        if slices > 0 || service.json(&disturbed).await["status"] == "succeeded" {
            break;
        }
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
    database.close().await.unwrap();
    assert_eq!(service.json(&long).await["status"], "running");
    service.request(Method::DELETE, &long).send().await.unwrap();
    assert_eq!(service.finished(&disturbed).await["status"], "succeeded");
    assert_eq!(picture(&service, &disturbed).await, expected);
}

/// Whoever waits behind a pass of hours in both lanes is cancelled all the same.
#[tokio::test]
async fn a_job_that_was_put_aside_is_cancelled_at_once() {
    let service = TestService::start().await;
    let long = service.submit(&hours()).await;
    service.events_until(&long, 0, |event| event.name == "started").await;
    let mut second = hours();
    second["seed"] = 8.into();
    let second = service.submit(&second).await;
    service.events_until(&second, 0, |event| event.name == "started").await;
    service.request(Method::POST, &format!("{second}/cancel")).send().await.unwrap();
    assert_eq!(service.finished(&second).await["status"], "cancelled");
    assert_eq!(service.json(&long).await["status"], "running");
}

/// In the short lane those with fewer slices go first, and after the last slice a job is the main lane's alone.
#[tokio::test]
async fn a_job_that_is_put_aside_comes_back_and_is_the_main_lanes_in_the_end() {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("test.db")).await.unwrap();
    let mut jobs = Vec::new();
    for _ in 0..2 {
        let Submission::New(job) = store.submit(new_job(), most(10)).await.unwrap() else { panic!("not new") };
        jobs.push(job.head.id);
    }
    let short = Turn { short: true, ..Turn::default() };
    let mut taken = Vec::new();
    while let Some(lease) = store.claim("short", LEASE, short).await.unwrap() {
        taken.push((lease.job, lease.slices));
        // one that is interrupted has the same slice again
        store.put_aside(&lease, 0).await.unwrap();
        let again = store.claim("short", LEASE, short).await.unwrap().unwrap();
        assert_eq!((again.job, again.slices), (lease.job, lease.slices));
        store.put_aside(&again, 1).await.unwrap();
    }
    let expected: Vec<_> = (0..MOST_SLICES).flat_map(|slices| jobs.iter().map(move |job| (*job, slices))).collect();
    assert_eq!(taken, expected);
    // all of the cancelled is that it says so
    store.cancel(jobs[1]).await.unwrap();
    let cancelled = store.claim("short", LEASE, short).await.unwrap().unwrap();
    assert!(cancelled.job == jobs[1] && cancelled.cancel_requested);
    assert!(store.claim("other", LEASE, short).await.unwrap().is_none());
    assert_eq!(store.claim("main", LEASE, Turn::default()).await.unwrap().unwrap().job, jobs[0]);
}

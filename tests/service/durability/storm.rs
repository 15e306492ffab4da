//! Long trials of the built program, run by `tests/run --long`: a storm of kills, and ten thousand jobs.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::common::small_job;
use crate::process::Server;
use eventsource_stream::Eventsource;
use futures::{StreamExt, stream};
use serde_json::{Value, json};

/// Killed when dropped, so that a failed test leaves nothing behind.
const ENVIRONMENT: [(&str, &str); 3] = [
    ("RUST_LOG", "error"),
    ("SKYDUCT_LIMITS__QUEUED_JOBS", "20000"),
    ("SKYDUCT_LIMITS__QUEUED_JOBS_PER_CLIENT", "20000"),
];

/// Follows a job to its end; answers ids and names of all its events.
async fn events(server: &Server, job: &str) -> Vec<(i64, String)> {
    let response = server.http.get(format!("{}{job}/events", server.url)).send().await.unwrap();
    let events = response.bytes_stream().eventsource();
    events.map(|event| event.unwrap()).map(|event| (event.id.parse().unwrap(), event.event)).collect().await
}

/// Seven kinds of work: sums over photons, statistics of schedules and of points, light paths, a large view, a solver.
fn kinds() -> Vec<Value> {
    let job = |name: &str, method: Value, passes: u64| {
        let mut job = small_job();
        job["name"] = json!(name);
        job["method"] = method;
        job["stop"]["max_passes"] = json!(passes);
        job
    };
    let without_views = |mut job: Value| {
        job["views"] = json!([]);
        job
    };
    let mut view = job("view", json!({ "kind": "path_tracing", "samples_per_pixel": 1 }), 60);
    view["views"][0]["size_px"] = json!([128, 96]);
    vec![
        without_views(job("photons", json!({ "kind": "light_tracing", "photons_per_pass": 40_000 }), 60)),
        job("schedule", json!({ "kind": "sppm", "photons_per_pass": 20_000 }), 90),
        job("points", json!({ "kind": "ppm", "photons_per_pass": 20_000, "radius": "per_point" }), 90),
        job("light paths", json!({ "kind": "bidirectional_path_tracing", "photons_per_pass": 10_000 }), 60),
        view,
        without_views(job("solver", json!("holigilm"), 1)),
        job("two stages", json!({ "kind": "two_stage", "photons_per_pass": 20_000 }), 60),
    ]
}

/// Every file of a finished job by its path below the job's, and its passes without their times.
async fn results(server: &Server, job: &str) -> BTreeMap<String, Vec<u8>> {
    let resource = server.json(job).await;
    assert_eq!(resource["status"], "succeeded", "{}: {}", resource["document"]["name"], resource["problem"]);
    let mut files = BTreeMap::new();
    let mut names = vec!["grids/workplane?format=json", "grids/workplane?format=csv", "tubes/0.json"];
    if !resource["document"]["views"].as_array().unwrap().is_empty() {
        names.extend(["views/room.exr", "views/room.png", "views/room.png?style=false_colour"]);
    }
    for name in names {
        files.insert(name.to_owned(), server.get(&format!("{job}/{name}")).await);
    }
    let mut table = server.json(&format!("{job}/convergence")).await;
    for row in table["passes"].as_array_mut().unwrap() {
        row.as_object_mut().unwrap().retain(|name, _| !name.contains("seconds"));
    }
    files.insert("convergence".into(), table["passes"].to_string().into_bytes());
    files
}

async fn submit_all(server: &Server) -> Vec<String> {
    let mut paths = Vec::new();
    for job in kinds() {
        paths.push(server.submit(&job).await);
    }
    paths
}

#[tokio::test]
#[ignore = "two minutes: tests/run --long"]
async fn sixty_kills_change_no_bit_and_lose_no_event() {
    let calm_data = tempfile::tempdir().unwrap();
    let calm = Server::start(calm_data.path(), &ENVIRONMENT);
    let mut expected = Vec::new();
    for path in submit_all(&calm).await {
        events(&calm, &path).await;
        expected.push(results(&calm, &path).await);
    }
    drop(calm);

    let data = tempfile::tempdir().unwrap();
    let mut server = Server::start(data.path(), &ENVIRONMENT);
    let paths = submit_all(&server).await;
    // kills between 50 and 900 ms apart, the same on every run
    let mut random = 1u64;
    for _ in 0..60 {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        tokio::time::sleep(Duration::from_millis(50 + (random >> 33) % 850)).await;
        drop(server);
        server = Server::start(data.path(), &ENVIRONMENT);
    }
    for (path, expected) in paths.iter().zip(&expected) {
        let events = events(&server, path).await;
        let ids: Vec<i64> = events.iter().map(|(id, _)| *id).collect();
        assert_eq!(ids, (1..=ids.len() as i64).collect::<Vec<_>>(), "events without gaps");
        let ends = events.iter().filter(|(_, name)| ["succeeded", "failed", "cancelled"].contains(&name.as_str()));
        assert_eq!(ends.count(), 1, "one final event");
        let found = results(&server, path).await;
        for (name, bytes) in expected {
            assert!(found[name] == *bytes, "{path}: {name} differs");
        }
    }
}

#[tokio::test]
#[ignore = "minutes: tests/run --long"]
async fn ten_thousand_small_jobs_leave_memory_flat() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &ENVIRONMENT);
    let mut job = small_job();
    job["views"] = json!([]);
    job["method"] = json!({ "kind": "light_tracing", "photons_per_pass": 64 });
    job["stop"]["max_passes"] = json!(8);
    let mut resident = Vec::new();
    for round in 0..10u64 {
        let jobs = (0..1000u64).map(|number| {
            let mut job = job.clone();
            job["seed"] = json!(1000 * round + number);
            let server = &server;
            async move { server.submit(&job).await }
        });
        let paths: Vec<String> = stream::iter(jobs).buffer_unordered(16).collect().await;
        for path in paths {
            let end = events(&server, &path).await.pop().map(|(_, name)| name);
            assert_eq!(end.as_deref(), Some("succeeded"));
        }
        resident.push(server.resident());
    }
    // caches fill in the first rounds; after that nothing may grow with the number of jobs: 2 kB a job would be seen
    let growth = resident[9] as f64 - resident[2] as f64;
    assert!(growth < 7000.0 * 2048.0, "resident bytes after each thousand jobs: {resident:?}");
}

//! Long trials of the built program, run by `tests/run --long`: a storm of kills, and ten thousand jobs.

mod common;

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

use common::{client, small_job};
use eventsource_stream::Eventsource;
use futures::{StreamExt, stream};
use reqwest::StatusCode;
use serde_json::{Value, json};

/// Killed when dropped, so that a failed test leaves nothing behind.
struct Server {
    child: Child,
    url: String,
}

impl Server {
    fn start(data: &Path) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_skyduct"))
            .args(["serve", "--listen", "127.0.0.1:0", "--data"])
            .arg(data)
            .env("RUST_LOG", "error")
            .env("SKYDUCT_LIMITS__QUEUED_JOBS", "20000")
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut line).unwrap();
        let url = line.trim().strip_prefix("listening on ").expect("the address").to_owned();
        Self { child, url }
    }

    async fn get(&self, path: &str) -> Vec<u8> {
        let response = client().get(format!("{}{path}", self.url)).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::OK, "{path}");
        response.bytes().await.unwrap().into()
    }

    async fn json(&self, path: &str) -> Value {
        serde_json::from_slice(&self.get(path).await).unwrap()
    }

    async fn submit(&self, job: &Value) -> String {
        let response = client().post(format!("{}/v1/jobs", self.url)).json(job).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::ACCEPTED);
        response.headers()["location"].to_str().unwrap().to_owned()
    }

    /// Follows a job to its end; answers ids and names of all its events.
    async fn events(&self, job: &str) -> Vec<(i64, String)> {
        let response = client().get(format!("{}{job}/events", self.url)).send().await.unwrap();
        let events = response.bytes_stream().eventsource();
        events.map(|event| event.unwrap()).map(|event| (event.id.parse().unwrap(), event.event)).collect().await
    }

    /// Resident memory of the process in bytes.
    fn resident(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap();
        let line = status.lines().find(|line| line.starts_with("VmRSS:")).unwrap();
        1024 * line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap()
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // SIGKILL
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
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
    let calm = Server::start(calm_data.path());
    let mut expected = Vec::new();
    for path in submit_all(&calm).await {
        calm.events(&path).await;
        expected.push(results(&calm, &path).await);
    }
    drop(calm);

    let data = tempfile::tempdir().unwrap();
    let mut server = Server::start(data.path());
    let paths = submit_all(&server).await;
    // kills between 50 and 900 ms apart, the same on every run
    let mut random = 1u64;
    for _ in 0..60 {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        tokio::time::sleep(Duration::from_millis(50 + (random >> 33) % 850)).await;
        drop(server);
        server = Server::start(data.path());
    }
    for (path, expected) in paths.iter().zip(&expected) {
        let events = server.events(path).await;
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
    let server = Server::start(data.path());
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
            let end = server.events(&path).await.pop().map(|(_, name)| name);
            assert_eq!(end.as_deref(), Some("succeeded"));
        }
        resident.push(server.resident());
    }
    // caches fill in the first rounds; after that nothing may grow with the number of jobs: 2 kB a job would be seen
    let growth = resident[9] as f64 - resident[2] as f64;
    assert!(growth < 7000.0 * 2048.0, "resident bytes after each thousand jobs: {resident:?}");
}

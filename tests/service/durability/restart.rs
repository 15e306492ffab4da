//! The built program killed in mid-job: the next start finishes the job with the same bits.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant, SystemTime};

use crate::common::{PATIENCE, client, small_job};
use crate::process::Server;
use eventsource_stream::Eventsource;
use futures::StreamExt;
use reqwest::StatusCode;
use serde_json::{Value, json};
use skyduct::engine::convergence::is_kept;

/// Starts the service with this number of render threads.
fn start(data: &Path, threads: &str) -> Server {
    Server::start(data, &[("RAYON_NUM_THREADS", threads)])
}

/// Passes enough for some chunks, each long enough to be killed in.
fn job() -> Value {
    let mut job = small_job();
    job["grids"][0]["cells"] = json!([6, 6]);
    job["method"] = json!({ "kind": "sppm", "photons_per_pass": 20_000 });
    job["stop"]["max_passes"] = json!(120);
    job
}

/// A job whose passes depend on those before.
fn job_with_statistics() -> Value {
    let mut job = job();
    job["method"] = json!({ "kind": "ppm", "photons_per_pass": 20_000, "radius": "per_point" });
    job
}

/// Follows the events until pass `passes`, or to the end; answers their ids.
async fn follow(server: &Server, job: &str, passes: u64) -> Vec<i64> {
    let response = client().get(format!("{}{job}/events", server.url)).send().await.unwrap();
    let mut events = response.bytes_stream().eventsource();
    let mut ids = Vec::new();
    while let Some(Ok(event)) = events.next().await {
        ids.push(event.id.parse().unwrap());
        let data: Value = serde_json::from_str(&event.data).unwrap();
        if event.event == "pass" && data["passes"].as_u64().unwrap() >= passes {
            break;
        }
    }
    ids
}

async fn result_files(server: &Server, job: &str) -> BTreeMap<&'static str, Vec<u8>> {
    let mut files = BTreeMap::new();
    for file in [
        "grids/workplane?format=json",
        "grids/workplane?format=csv",
        "views/room.exr",
        "views/room.png",
        "views/room.png?style=false_colour",
        "views/room.png?pass=64",
    ] {
        let response = client().get(format!("{}{job}/{file}", server.url)).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::OK, "{file}");
        files.insert(file, response.bytes().await.unwrap().into());
    }
    files
}

async fn status(server: &Server, job: &str) -> Value {
    client().get(format!("{}{job}", server.url)).send().await.unwrap().json().await.unwrap()
}

async fn undisturbed(job: &Value, threads: &str) -> BTreeMap<&'static str, Vec<u8>> {
    let data = tempfile::tempdir().unwrap();
    let server = start(data.path(), threads);
    let path = server.submit(job).await;
    follow(&server, &path, u64::MAX).await;
    assert_eq!(status(&server, &path).await["status"], "succeeded");
    let files = result_files(&server, &path).await;
    assert!(server.terminate(), "SIGTERM is a clean end");
    files
}

#[tokio::test]
async fn killed_in_mid_job_the_result_is_the_same_to_the_bit() {
    killed_in_mid_job(&job()).await;
}

#[tokio::test]
async fn statistics_of_points_survive_a_kill() {
    killed_in_mid_job(&job_with_statistics()).await;
}

async fn killed_in_mid_job(submitted: &Value) {
    let expected = undisturbed(submitted, "2").await;
    let data = tempfile::tempdir().unwrap();
    let mut server = start(data.path(), "2");
    let path = server.submit(submitted).await;
    for passes in [3, 13, 40, 41] {
        follow(&server, &path, passes).await;
        server.kill();
        server = start(data.path(), "1");
    }
    // a polite stop in mid-job, too
    follow(&server, &path, 60).await;
    assert!(server.terminate());
    let last_start = SystemTime::now();
    server = start(data.path(), "2");
    let ids = follow(&server, &path, u64::MAX).await;
    assert_eq!(ids, (1..=ids.len() as i64).collect::<Vec<_>>(), "events without gaps");

    let job = status(&server, &path).await;
    assert_eq!(job["status"], "succeeded");
    assert_eq!(job["progress"]["passes"], 120);
    let table: Value =
        client().get(format!("{}{path}/convergence", server.url)).send().await.unwrap().json().await.unwrap();
    let passes: Vec<u64> =
        table["passes"].as_array().unwrap().iter().map(|row| row["passes"].as_u64().unwrap()).collect();
    assert_eq!(passes, (1..=120).filter(|pass| *pass == 120 || is_kept(*pass)).collect::<Vec<_>>());
    let files = result_files(&server, &path).await;
    for (name, bytes) in &expected {
        assert!(files[name] == *bytes, "{name} differs");
    }
    // States of chunks are deleted after the job has ended. A kill between a state and its commit may leave one behind, which
    // a start sweeps when it is a day old; what the last process wrote is gone.
    let id = path.rsplit('/').next().unwrap();
    let folder = data.path().join("artifacts/jobs").join(id);
    let written_since = |entry: &std::fs::DirEntry| {
        let written = entry.metadata().and_then(|meta| meta.modified());
        // one that is gone by now is no state
        written.is_ok_and(|written| written >= last_start)
    };
    let states = || {
        let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap());
        let states = files.filter(|file| file.file_name().to_string_lossy().ends_with("-state"));
        states.filter(written_since).count()
    };
    let begin = Instant::now();
    while states() > 0 {
        assert!(begin.elapsed() < PATIENCE, "{} states are left", states());
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

#[tokio::test]
async fn one_and_two_threads_give_the_same_bits() {
    for job in [job(), job_with_statistics()] {
        let (one, two) = (undisturbed(&job, "1").await, undisturbed(&job, "2").await);
        for (name, bytes) in &one {
            assert!(two[name] == *bytes, "{name} differs");
        }
    }
}

#[tokio::test]
async fn submit_downloads_and_its_exit_status_says_whose_fault_it_is() {
    let data = tempfile::tempdir().unwrap();
    let out = tempfile::tempdir().unwrap();
    let server = start(data.path(), "2");
    let submit = |document: &Value, url: &str| {
        let file = out.path().join("job.json");
        std::fs::write(&file, document.to_string()).unwrap();
        let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
        command.arg("submit").arg(&file).args(["--server", url, "--out"]).arg(out.path().join("results"));
        command.output().unwrap()
    };
    let done = submit(&small_job(), &server.url);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    for file in [
        "result.json",
        "grids/workplane.json",
        "grids/workplane.csv",
        "views/room.exr",
        "views/room.png",
        "false_colours/room.svg",
    ] {
        assert!(out.path().join("results").join(file).metadata().unwrap().len() > 0, "{file}");
    }
    let mut bad = small_job();
    bad["room"]["size_m"][0] = json!(-1);
    let refused = submit(&bad, &server.url);
    assert_eq!(refused.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&refused.stderr).contains("/room/size_m/0"));
    let url = server.url.clone();
    server.kill();
    assert_eq!(submit(&small_job(), &url).status.code(), Some(1));
}

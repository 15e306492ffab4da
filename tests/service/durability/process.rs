//! Processes that die of a job, that are killed all the time, and whose disk is full.

use std::process::Command;
use std::time::{Duration, Instant};

use crate::common::{PATIENCE, client, problem, small_job};
use crate::process::Server;
use reqwest::StatusCode;
use serde_json::json;

/// Killed when dropped, so that a failed test leaves nothing behind.
const TWO_THREADS: [(&str, &str); 1] = [("RAYON_NUM_THREADS", "2")];

/// Views whose estimate does not fit into the memory that the process may take: it aborts. Every start takes it up again.
#[tokio::test]
async fn a_job_that_kills_its_process_fails_after_three_deaths_and_the_next_one_is_done() {
    let data = tempfile::tempdir().unwrap();
    // One arena: threads then take little of the address space. The service is told that it has more than enough.
    let little_memory = "export MALLOC_ARENA_MAX=1 SKYDUCT_LIMITS__MEMORY_BYTES=100000000000; ulimit -v 900000";
    let mut poison = small_job();
    poison["method"] = json!("path_tracing");
    poison["views"] = (0..16)
        .map(|number| {
            let mut view = small_job()["views"][0].clone();
            view["name"] = json!(format!("v{number}"));
            view["size_px"] = json!([4096, 4096]);
            view
        })
        .collect();
    let mut server = Server::start_after(little_memory, data.path(), &TWO_THREADS);
    let path = server.submit(&poison).await;
    let mut next = None;
    let mut deaths = 0;
    let begin = Instant::now();
    let job = loop {
        assert!(begin.elapsed() < PATIENCE, "{deaths} deaths");
        if server.is_gone() {
            deaths += 1;
            server = Server::start_after(little_memory, data.path(), &TWO_THREADS);
        }
        if next.is_none() && deaths > 0 {
            let posted = client().post(format!("{}/v1/jobs", server.url)).json(&small_job()).send().await;
            next = posted.ok().map(|answer| answer.headers()["location"].to_str().unwrap().to_owned());
        }
        if let Ok(job) = server.job(&path).await
            && job["status"] == "failed"
        {
            break job;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    };
    assert_eq!(deaths, 3);
    assert_eq!(job["problem"]["detail"], "the process died 3 times while rendering this job");
    let next = next.unwrap();
    loop {
        assert!(begin.elapsed() < PATIENCE);
        if server.job(&next).await.unwrap()["status"] == "succeeded" {
            break;
        }
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    assert!(!server.is_gone());
}

/// Kills far faster than a chunk takes, most of them before a pass is done, with one and more open chunks.
#[tokio::test]
async fn a_sound_job_survives_a_storm_of_kills_with_the_same_bits() {
    let mut document = small_job();
    document["method"]["photons_per_pass"] = 20_000.into();
    document["stop"]["max_passes"] = 40.into();
    let result = async |server: &Server, path: &str| {
        let begin = Instant::now();
        loop {
            assert!(begin.elapsed() < PATIENCE);
            let job = server.job(path).await.unwrap();
            assert_ne!(job["status"], "failed", "{job}");
            if job["status"] == "succeeded" {
                break;
            }
            tokio::time::sleep(Duration::from_millis(50)).await;
        }
        let answer = client().get(format!("{}{path}/grids/workplane", server.url)).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK);
        answer.bytes().await.unwrap()
    };
    let calm = tempfile::tempdir().unwrap();
    let server = Server::start(calm.path(), &TWO_THREADS);
    let path = server.submit(&document).await;
    let expected = result(&server, &path).await;
    drop(server);

    for open in ["1", "2", "4"] {
        let environment = [TWO_THREADS[0], ("SKYDUCT_LIMITS__OPEN_CHUNKS_PER_JOB", open)];
        let data = tempfile::tempdir().unwrap();
        let mut server = Server::start(data.path(), &environment);
        let path = server.submit(&document).await;
        for kill in 0..25_u64 {
            tokio::time::sleep(Duration::from_millis(10 + 37 * kill % 200)).await;
            drop(server);
            server = Server::start(data.path(), &environment);
        }
        assert_eq!(result(&server, &path).await, expected, "{open} open chunks");
        let table = server.job(&format!("{path}/convergence")).await.unwrap();
        let passes: Vec<u64> =
            table["passes"].as_array().unwrap().iter().map(|row| row["passes"].as_u64().unwrap()).collect();
        assert_eq!(passes, (1..=40).collect::<Vec<_>>(), "{open} open chunks");
    }
}

/// A soft limit on the size of files in blocks of 512 bytes, which can be taken away again: a new database fits, with all of its steps, and
/// little more. The signal would end the process.
const FULL_DISK: &str = "trap '' XFSZ; ulimit -S -f 1800";

/// The limit on the size of files stands for a full disk: writes fail, and later they do not.
#[tokio::test]
async fn a_service_whose_disk_was_full_goes_on_by_itself() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start_after(FULL_DISK, data.path(), &TWO_THREADS);
    let mut document = small_job();
    document["stop"]["max_passes"] = 2.into();
    let begin = Instant::now();
    let url = format!("{}/v1/jobs", server.url);
    let mut accepted = Vec::new();
    loop {
        assert!(begin.elapsed() < PATIENCE, "the limit has no effect");
        let answer = client().post(&url).json(&document).send().await.unwrap();
        match answer.status() {
            StatusCode::ACCEPTED => accepted.push(answer.headers()["location"].to_str().unwrap().to_owned()),
            StatusCode::SERVICE_UNAVAILABLE => break,
            status => panic!("{status} {}", answer.text().await.unwrap()),
        }
    }
    for _ in 0..3 {
        let answer = client().post(&url).json(&document).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::SERVICE_UNAVAILABLE);
        assert_eq!(answer.headers()["content-type"], "application/problem+json");
    }
    let ready = || async { client().get(format!("{}/readyz", server.url)).send().await.unwrap().status() };
    while ready().await != StatusCode::SERVICE_UNAVAILABLE {
        assert!(begin.elapsed() < PATIENCE, "it says that it is ready");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
    let freed = Command::new("prlimit").args(["--fsize=unlimited:", "--pid", &server.child.id().to_string()]).status();
    assert!(freed.expect("prlimit of util-linux").success());
    let answer = client().post(&url).json(&document).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    accepted.push(answer.headers()["location"].to_str().unwrap().to_owned());
    for path in &accepted {
        while server.job(path).await.unwrap()["status"] != "succeeded" {
            assert!(begin.elapsed() < PATIENCE, "a job does not go on");
            tokio::time::sleep(Duration::from_millis(100)).await;
        }
    }
    while ready().await != StatusCode::OK {
        assert!(begin.elapsed() < PATIENCE, "it never gets ready again");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

/// An upload that finds no room is refused for now, and taken when there is some.
#[tokio::test]
async fn an_upload_on_a_full_disk_is_unavailable() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start_after(FULL_DISK, data.path(), &TWO_THREADS);
    let mesh = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n{}", "# a line\n".repeat(250_000));
    let upload =
        || client().post(format!("{}/v1/meshes", server.url)).header("content-type", "model/obj").body(mesh.clone());
    let refused = upload().send().await.unwrap();
    assert!(refused.headers().contains_key("retry-after"));
    let refused = problem(refused, 503).await;
    assert_eq!(refused["type"], "/problems/unavailable", "{refused}");
    let freed = Command::new("prlimit").args(["--fsize=unlimited:", "--pid", &server.child.id().to_string()]).status();
    assert!(freed.expect("prlimit of util-linux").success());
    assert_eq!(upload().send().await.unwrap().status(), StatusCode::CREATED);
}

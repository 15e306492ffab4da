//! Limits to what one client has: connections, streams, waits, uploads.

use std::time::Duration;

use reqwest::{Method, StatusCode};
use serde_json::Value;
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::common::{PATIENCE, TestService, client, endless_job, problem, raw, small_job};
use crate::process::Server;

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A problem document of a client that has too much, its header and its words.
async fn too_many(response: reqwest::Response, most: &str) {
    assert_eq!(response.headers()["retry-after"], "5");
    let problem = problem(response, 429).await;
    assert_eq!(problem["type"], "/problems/too-many");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains(&format!("this client has reached its limit of {most}")), "{detail}");
}

/// Repeats a request until it is answered so.
async fn until(status: StatusCode, mut answer: impl AsyncFnMut() -> StatusCode) {
    let answered = async {
        while answer().await != status {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(PATIENCE, answered).await.unwrap_or_else(|_| panic!("it is never {status}"));
}

#[tokio::test]
async fn one_client_has_so_many_streams() {
    let service = TestService::start_with(|config| config.limits.streams_per_client = 2).await;
    let job = service.submit(&endless_job()).await;
    let study = serde_json::json!({ "job": small_job(), "methods": ["sppm"], "relative_errors": [0.5], "seeds": 1 });
    let study: Value = service.post("/v1/studies", &study).send().await.unwrap().json().await.unwrap();
    let [of_job, of_study] = [format!("{job}/events"), format!("/v1/studies/{}/events", study["id"].as_str().unwrap())];
    let open = [service.get(&of_job).send().await.unwrap(), service.get(&of_study).send().await.unwrap()];
    assert!(open.iter().all(|stream| stream.status() == StatusCode::OK));
    for path in [&of_job, &of_study] {
        too_many(service.get(path).send().await.unwrap(), "2 event streams").await;
    }
    drop(open);
    until(StatusCode::OK, async || service.get(&of_job).send().await.unwrap().status()).await;
}

#[tokio::test]
async fn one_client_has_so_many_connections() {
    let service = TestService::start_with(|config| config.limits.connections_per_client = 3).await;
    let host = service.running.address;
    let open = async || {
        let mut connection = TcpStream::connect(host).await.unwrap();
        // an answer shows that it was accepted; it stays open
        connection.write_all(format!("GET /livez HTTP/1.1\r\nhost: {host}\r\n\r\n").as_bytes()).await.unwrap();
        connection.read_exact(&mut [0; 15]).await.unwrap();
        connection
    };
    let idle = [open().await, open().await, open().await];
    for path in ["/livez", "/readyz", "/metrics"] {
        assert_eq!(service.get(path).send().await.unwrap().status(), StatusCode::OK, "{path}");
    }
    too_many(service.get("/v1/skies").send().await.unwrap(), "3 connections").await;
    // so many are told; the others are closed
    let mut beyond = Vec::new();
    for _ in 0..17 {
        beyond.push(TcpStream::connect(host).await.unwrap());
    }
    let mut last = beyond.pop().unwrap();
    let end = tokio::time::timeout(PATIENCE, last.read(&mut [0; 1])).await.expect("it is closed");
    assert!(matches!(end, Ok(0) | Err(_)), "{end:?}");
    drop((idle, beyond));
    until(StatusCode::OK, async || client().get(format!("http://{host}/v1/skies")).send().await.unwrap().status())
        .await;
}

/// Waits take nothing from event streams, and end with their clients: the next one waits.
#[tokio::test]
async fn waits_end_with_their_clients_and_leave_streams_alone() {
    let service = TestService::start_with(|config| {
        config.limits.waits_per_client = 1;
        config.limits.streams = 1;
        config.limits.request_seconds = 10_000;
    })
    .await;
    let host = service.running.address;
    let endless = service.submit(&endless_job()).await;
    let finished_or_queued = async || {
        let post = service.post_job(&small_job()).header("prefer", "wait=60");
        post.send().await.unwrap().status()
    };
    for _ in 0..3 {
        let mut waits = TcpStream::connect(host).await.unwrap();
        // an equal one would wait for the first
        let mut other = endless_job();
        other["seed"] = 8.into();
        let body = other.to_string();
        let head = format!(
            "POST /v1/jobs HTTP/1.1\r\nhost: {host}\r\ncontent-type: application/json\r\nprefer: wait=60\r\ncontent-length: {}\r\n\r\n{body}",
            body.len()
        );
        waits.write_all(head.as_bytes()).await.unwrap();
        until(StatusCode::ACCEPTED, &finished_or_queued).await;
        let events = service.get(&format!("{endless}/events")).send().await.unwrap();
        assert_eq!(events.status(), StatusCode::OK);
        drop((events, waits));
        until(StatusCode::OK, &finished_or_queued).await;
        // the client that hung up does not cancel what it has posted, but we do
        for job in service.json("/v1/jobs?status=running").await["jobs"].as_array().unwrap() {
            let path = format!("/v1/jobs/{}", job["id"].as_str().unwrap());
            if path != endless && job["name"] == "endless" {
                service.request(Method::POST, &format!("{path}/cancel")).send().await.unwrap();
            }
        }
    }
}

/// Uploads that drip neither keep others from theirs nor stay.
#[tokio::test]
async fn uploads_that_drip_end_and_stop_nobody() {
    let service = TestService::start_with(|config| {
        config.limits.uploads_per_client = 5;
        config.limits.mesh_readers = 1;
        config.limits.upload_grace_seconds = 1;
    })
    .await;
    let host = service.running.address;
    let mut slow = Vec::new();
    for _ in 0..4 {
        let mut upload = TcpStream::connect(host).await.unwrap();
        let head = format!(
            "POST /v1/meshes HTTP/1.1\r\nhost: {host}\r\ncontent-type: model/obj\r\ncontent-length: 1000\r\nexpect: 100-continue\r\n\r\n"
        );
        upload.write_all(head.as_bytes()).await.unwrap();
        // `100 Continue` comes when the service reads the body
        let mut answer = [0; 25];
        upload.read_exact(&mut answer).await.unwrap();
        assert!(answer.starts_with(b"HTTP/1.1 100"));
        upload.write_all(b"v").await.unwrap();
        slow.push(upload);
    }
    let upload = || service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(TRIANGLE);
    assert_eq!(upload().send().await.unwrap().status(), StatusCode::CREATED);
    for mut upload in slow {
        let mut answer = Vec::new();
        let _ = tokio::time::timeout(PATIENCE, upload.read_to_end(&mut answer)).await.expect("it ends");
        let answer = String::from_utf8_lossy(&answer);
        assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("/problems/timeout"), "{answer}");
    }
    assert_eq!(upload().send().await.unwrap().status(), StatusCode::CREATED);
}

#[tokio::test]
async fn one_client_has_so_many_uploads_and_bytes_of_them() {
    let service = TestService::start_with(|config| {
        config.limits.uploads_per_client = 1;
        config.limits.upload_bytes_per_client = 100_000;
    })
    .await;
    let host = service.running.address;
    let head = format!("POST /v1/meshes HTTP/1.1\r\nhost: {host}\r\ncontent-type: model/obj\r\n");
    let mut first = TcpStream::connect(host).await.unwrap();
    first.write_all(format!("{head}content-length: 1000\r\nexpect: 100-continue\r\n\r\n").as_bytes()).await.unwrap();
    first.read_exact(&mut [0; 12]).await.unwrap();
    let second = raw(host, &format!("{head}content-length: 1000\r\nconnection: close\r\n\r\n")).await;
    assert!(second.starts_with("HTTP/1.1 429") && second.contains("/problems/too-many"), "{second}");
    drop(first);
    let upload =
        |text: String| service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(text);
    until(StatusCode::CREATED, async || upload(TRIANGLE.to_owned()).send().await.unwrap().status()).await;
    let long = format!("{TRIANGLE}#{}\n", "x".repeat(100_000));
    too_many(upload(long).send().await.unwrap(), "100000 bytes of uploads").await;
    assert_eq!(upload(TRIANGLE.to_owned()).send().await.unwrap().status(), StatusCode::CREATED);
}

/// Requests that are refused for now are counted; they write no lines into the log, whatever their number.
#[tokio::test]
async fn refused_requests_leave_the_log_quiet() {
    let data = tempfile::tempdir().unwrap();
    let log = tempfile::NamedTempFile::new().unwrap();
    let limits = [
        ("SKYDUCT_LIMITS__QUEUED_JOBS", "1"),
        ("SKYDUCT_LIMITS__STREAMS", "1"),
        ("SKYDUCT_LIMITS__STREAMS_PER_CLIENT", "2"),
    ];
    let service =
        Server::start_after(&format!("unset RUST_LOG; exec 2>'{}'", log.path().display()), data.path(), &limits);
    let http = client();
    let path = service.submit(&endless_job()).await;
    let post =
        async || http.post(format!("{}/v1/jobs", service.url)).json(&endless_job()).send().await.unwrap().status();
    until(StatusCode::SERVICE_UNAVAILABLE, &post).await;
    let open = http.get(format!("{}{path}/events", service.url)).send().await.unwrap();
    assert_eq!(open.status(), StatusCode::OK);
    for _ in 0..20 {
        assert_eq!(post().await, StatusCode::SERVICE_UNAVAILABLE);
        let stream = http.get(format!("{}{path}/events", service.url)).send().await.unwrap();
        assert_eq!(stream.status(), StatusCode::SERVICE_UNAVAILABLE);
    }
    let metrics = String::from_utf8(service.get("/metrics").await).unwrap();
    assert!(metrics.contains("skyduct_refused_total{limit=\"streams\",of=\"service\"} 20"), "{metrics}");
    drop(open);
    service.kill();
    let log = std::fs::read_to_string(log.path()).unwrap();
    assert!(log.contains("listening"), "{log}");
    assert!(!log.contains("ERROR") && !log.contains("WARN") && log.lines().count() < 12, "{log}");
}

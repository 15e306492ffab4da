//! What one client can burn: connections, streams, uploads, seconds.

mod clients;
mod long_passes;
mod queue_clients;
mod turns;

use crate::common;
use std::time::Duration;

use crate::common::{PATIENCE, TestService, client, endless_job, events_until, problem, raw, small_job};
use crate::process::Server;
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::{TcpSocket, TcpStream};

const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

#[tokio::test]
async fn more_seconds_than_the_service_gives_are_refused() {
    let service = TestService::start_with(|config| config.limits.max_seconds = 100.0).await;
    let mut job = small_job();
    job["stop"]["max_seconds"] = json!(100.5);
    for path in ["/v1/jobs", "/v1/plan"] {
        let refused = problem(service.request(Method::POST, path).json(&job).send().await.unwrap(), 422).await;
        let error = &refused["errors"][0];
        assert_eq!(
            (&error["pointer"], &error["code"]),
            (&json!("/stop/max_seconds"), &json!("out_of_range")),
            "{refused}"
        );
    }
    job["stop"]["max_seconds"] = json!(100);
    service.submit(&job).await;
}

/// A pass of hours, and a solver that takes long: both end within a second or two of their limit, with nothing to show.
#[tokio::test]
async fn a_job_without_one_pass_in_its_time_fails_and_says_so() {
    let service = TestService::start().await;
    let mut passes = small_job();
    passes["views"][0]["size_px"] = json!([512, 512]);
    passes["method"] = json!({ "kind": "path_tracing", "samples_per_pixel": 4096 });
    let mut solver = small_job();
    solver["room"]["size_m"] = json!([1000.0, 2.0, 2.0]);
    solver["method"] = json!("holigilm");
    solver["views"] = json!([]);
    for mut job in [passes, solver] {
        job["stop"] = json!({ "max_seconds": 1 });
        let path = service.submit(&job).await;
        let job = tokio::time::timeout(PATIENCE, service.finished(&path)).await.expect("it ends");
        assert_eq!((&job["status"], &job["stopped_by"]), (&json!("failed"), &json!("max_seconds")), "{job}");
        assert_eq!(job["progress"]["passes"], 0);
        assert!(job["problem"]["detail"].as_str().unwrap().contains("/stop/max_seconds"), "{job}");
        problem(service.get(&format!("{path}/grids/workplane")).send().await.unwrap(), 404).await;
    }
}

/// The pass at the limit is dropped; those before it are what a job of just as many passes gives.
#[tokio::test]
async fn a_job_at_its_limit_keeps_its_whole_passes() {
    let service = TestService::start().await;
    let mut job = small_job();
    job["method"] = json!({ "kind": "sppm", "photons_per_pass": 40_000 });
    job["stop"] =
        json!({ "relative_error": 1e-9, "view_relative_error": 1e-9, "max_passes": 1_000_000, "max_seconds": 2 });
    let limited = service.submit(&job).await;
    let ended = service.finished(&limited).await;
    assert_eq!((&ended["status"], &ended["stopped_by"]), (&json!("succeeded"), &json!("max_seconds")), "{ended}");
    let passes = ended["progress"]["passes"].as_u64().unwrap();
    assert!(passes > 0);
    job["stop"] = json!({ "relative_error": 1e-9, "view_relative_error": 1e-9, "max_passes": passes });
    let counted = service.submit(&job).await;
    service.finished(&counted).await;
    let grid = async |job: &str| service.json(&format!("{job}/grids/workplane")).await;
    assert_eq!(grid(&limited).await, grid(&counted).await);
}

#[tokio::test]
async fn streams_have_a_limit_of_their_own() {
    let service = TestService::start_with(|config| config.limits.streams = 1).await;
    let events = format!("{}/events", service.submit(&endless_job()).await);
    let first = service.get(&events).send().await.unwrap();
    assert_eq!(first.status(), StatusCode::OK);
    let second = service.get(&events).send().await.unwrap();
    assert!(second.headers().contains_key("retry-after"));
    problem(second, 503).await;
    drop(first);
    let again = async {
        while service.get(&events).send().await.unwrap().status() != StatusCode::OK {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(PATIENCE, again).await.expect("the place is free again");
}

#[tokio::test]
async fn health_is_reached_when_all_connections_are_taken() {
    let service = TestService::start_with(|config| config.limits.connections = 3).await;
    let mut idle = Vec::new();
    for _ in 0..3 {
        let mut connection = TcpStream::connect(service.running.address).await.unwrap();
        // an answer shows that it was accepted; it stays open
        let host = service.running.address;
        connection.write_all(format!("GET /livez HTTP/1.1\r\nhost: {host}\r\n\r\n").as_bytes()).await.unwrap();
        connection.read_exact(&mut [0; 15]).await.unwrap();
        idle.push(connection);
    }
    for path in ["/livez", "/readyz", "/metrics"] {
        assert_eq!(service.get(path).send().await.unwrap().status(), StatusCode::OK, "{path}");
    }
    let busy = service.get("/v1/skies").send().await.unwrap();
    assert!(busy.headers().contains_key("retry-after"));
    problem(busy, 503).await;
    drop(idle);
    let again = async {
        while service.get("/v1/skies").send().await.unwrap().status() != StatusCode::OK {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(PATIENCE, again).await.expect("the places are free again");
}

/// Answers of 20 MB in all are waiting for a client that takes none of them.
#[tokio::test]
async fn a_client_that_never_reads_is_closed() {
    let service = TestService::start_with(|config| config.limits.write_seconds = 1).await;
    let whole = service.get("/docs/swagger-ui-bundle.js").send().await.unwrap().bytes().await.unwrap().len();
    const REQUESTS: usize = 16;
    let socket = TcpSocket::new_v4().unwrap();
    socket.set_recv_buffer_size(8192).unwrap();
    let mut connection = socket.connect(service.running.address).await.unwrap();
    let host = service.running.address;
    let request = format!("GET /docs/swagger-ui-bundle.js HTTP/1.1\r\nhost: {host}\r\n\r\n");
    connection.write_all(request.repeat(REQUESTS).as_bytes()).await.unwrap();
    tokio::time::sleep(Duration::from_secs(4)).await;
    let mut taken = Vec::new();
    // the end may be a reset
    let _ = tokio::time::timeout(PATIENCE, connection.read_to_end(&mut taken)).await.expect("it was closed");
    assert!(taken.len() < REQUESTS * whole, "{} of {}", taken.len(), REQUESTS * whole);
    // and who reads slowly, but reads, is served
    let mut connection = TcpStream::connect(host).await.unwrap();
    connection.write_all(request.replace("\r\n\r\n", "\r\nconnection: close\r\n\r\n").as_bytes()).await.unwrap();
    let mut taken = 0;
    let mut piece = vec![0; whole / 8];
    loop {
        match connection.read(&mut piece).await.unwrap() {
            0 => break,
            length => taken += length,
        }
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    assert!(taken > whole);
}

#[tokio::test]
async fn a_body_that_says_it_is_too_long_is_refused_before_it_comes() {
    let service = TestService::start().await;
    let host = service.running.address;
    for (path, kind) in
        [("/v1/jobs", "application/json"), ("/v1/plan", "application/json"), ("/v1/meshes", "model/obj")]
    {
        // no byte of the body is sent
        let head = format!(
            "POST {path} HTTP/1.1\r\nhost: {host}\r\ncontent-type: {kind}\r\ncontent-length: 100000000\r\n\r\n"
        );
        let answer = raw(host, &head).await;
        assert!(answer.starts_with("HTTP/1.1 413") && answer.contains("/problems/too-large"), "{path}: {answer}");
    }
}

#[tokio::test]
async fn a_head_that_is_too_long_is_refused() {
    let service = TestService::start().await;
    let host = service.running.address;
    let headers: String = (0..110).map(|number| format!("x-{number}: a\r\n")).collect();
    let answer = raw(host, &format!("GET /livez HTTP/1.1\r\nhost: {host}\r\n{headers}\r\n")).await;
    assert!(answer.starts_with("HTTP/1.1 431"), "{answer}");
}

/// Hundreds of streams of one job end with the service, and one reader feeds them.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hundreds_of_streams_have_one_reader_and_end_with_the_service() {
    const STREAMS: usize = 500;
    // metrics are those of a process
    let data = tempfile::tempdir().unwrap();
    let most = STREAMS.to_string();
    let limits =
        ["STREAMS", "STREAMS_PER_CLIENT", "CONNECTIONS_PER_CLIENT"].map(|name| format!("SKYDUCT_LIMITS__{name}"));
    let more = (2 * STREAMS).to_string();
    let environment =
        [(limits[0].as_str(), most.as_str()), (limits[1].as_str(), most.as_str()), (limits[2].as_str(), more.as_str())];
    let service = Server::start(data.path(), &environment);
    let path = service.submit(&endless_job()).await;
    let (http, mut streams) = (client(), Vec::new());
    for _ in 0..STREAMS {
        streams.push(http.get(format!("{}{path}/events", service.url)).send().await.unwrap());
    }
    let metrics = String::from_utf8(service.get("/metrics").await).unwrap();
    for line in [format!("skyduct_event_streams {STREAMS}"), "skyduct_watched_jobs 1".to_owned()] {
        assert!(metrics.contains(&line), "{line} in {metrics}");
    }
    let bodies = futures::future::join_all(streams.into_iter().map(|stream| stream.bytes()));
    let ended = async { tokio::join!(tokio::task::spawn_blocking(|| assert!(service.terminate())), bodies).1 };
    for body in tokio::time::timeout(PATIENCE, ended).await.expect("all end") {
        assert!(!body.unwrap().is_empty());
    }
}

/// Streams that keep up do not read the store: the job's reader does, whatever their number.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn streams_that_keep_up_cost_no_reads() {
    const STREAMS: usize = 40;
    // metrics are those of a process
    let data = tempfile::tempdir().unwrap();
    let service = Server::start(data.path(), &[]);
    let path = service.submit(&endless_job()).await;
    let reads = async |by: &str| -> u64 {
        let metrics = String::from_utf8(service.get("/metrics").await).unwrap();
        let name = format!("skyduct_event_reads_total{{by=\"{by}\"}} ");
        metrics.lines().find_map(|line| line.strip_prefix(&name)).map_or(0, |number| number.parse().unwrap())
    };
    let before = reads("stream").await;
    let (http, address) = (client(), format!("{}{path}/events", service.url));
    let follow = |_| async { events_until(http.get(&address), 0, |event| event.id >= 100).await };
    let all = futures::future::join_all((0..STREAMS).map(follow)).await;
    for events in &all {
        let ids: Vec<i64> = events.iter().map(|event| event.id).collect();
        assert_eq!(ids, (1..=100).collect::<Vec<_>>());
        assert!(events.iter().zip(&all[0]).all(|(event, first)| event.data == first.data));
    }
    // each begins with what was there before, in two or three reads
    let of_streams = reads("stream").await - before;
    assert!(of_streams <= 10 * STREAMS as u64, "{of_streams} reads");
}

/// The memory that the process has had at most, MB.
#[cfg(target_os = "linux")]
fn peak_memory_mb(process: u32) -> f64 {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    line.trim().trim_end_matches("kB").trim().parse::<f64>().unwrap() / 1024.0
}

/// Files that are made to be costly: all are judged, in little memory, and what is refused has its line.
#[cfg(target_os = "linux")]
#[tokio::test]
async fn meshes_made_to_be_costly_cost_little() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};

    struct Server(std::process::Child);
    impl Drop for Server {
        fn drop(&mut self) {
            let _ = self.0.kill();
            let _ = self.0.wait();
        }
    }
    let data = tempfile::tempdir().unwrap();
    let mut server = Command::new(env!("CARGO_BIN_EXE_skyduct"));
    server.args(["serve", "--listen", "127.0.0.1:0", "--data"]).arg(data.path()).env("MALLOC_ARENA_MAX", "2");
    let mut server = Server(server.stdout(Stdio::piped()).spawn().unwrap());
    let mut line = String::new();
    BufReader::new(server.0.stdout.take().unwrap()).read_line(&mut line).unwrap();
    let url = format!("{}/v1/meshes", line.trim().strip_prefix("listening on ").unwrap());

    let zigzag = |corners: usize, faces: usize| {
        let line: Vec<_> = (0..corners / 2).map(|k| (k as f64 * 0.01, (k % 2) as f64)).collect();
        let back = line.iter().rev().map(|(x, y)| (*x, y - 0.02));
        let mut text: String = line.iter().copied().chain(back).map(|(x, y)| format!("v {x:.6} {y:.6} 0\n")).collect();
        let face: String = (1..=corners).map(|corner| format!(" {corner}")).collect();
        text += &format!("f{face}\n").repeat(faces);
        text
    };
    let names: String = (0..9999).map(|k| format!("usemtl {k}{}\n", "x".repeat(3000))).collect();
    let many_names: String = (0..9999).map(|k| format!("usemtl {k}\n")).collect();
    let files: [(&str, String, Option<usize>); 14] = [
        ("repeated faces", format!("{TRIANGLE}{}", "f 1 2 3\n".repeat(1_999_000)), None),
        ("vertices", "v 0 0 0\n".repeat(4_000_000), Some(2_000_001)),
        ("faces", format!("{TRIANGLE}{}", "f 1 2 3\n".repeat(2_000_000)), Some(2_000_004)),
        ("objects", format!("{TRIANGLE}{}", "o a\n".repeat(1_000_000)), None),
        ("long names", format!("{TRIANGLE}{names}"), Some(5)),
        ("many names", format!("{TRIANGLE}{many_names}"), Some(1004)),
        ("a long face", format!("{TRIANGLE}f{}\n", " 1 2 3 4".repeat(500_000)), Some(5)),
        ("a long line", format!("#{}\n{TRIANGLE}", "x".repeat(31_000_000)), Some(1)),
        ("not a number", format!("v 0 0 nan\n{TRIANGLE}"), Some(1)),
        ("index 0", format!("{TRIANGLE}f 0 1 2\n"), Some(5)),
        ("index of 2^63", format!("{TRIANGLE}f 9223372036854775808 1 2\n"), Some(5)),
        ("out of range", format!("{TRIANGLE}f 1 2 4\n"), Some(5)),
        ("a ribbon", zigzag(500, 2), None),
        // some of them: all together cost too much
        ("ribbons", zigzag(1000, 2000), Some(0)),
    ];
    let client = common::client();
    for (name, text, line) in files {
        let response = client.post(&url).header("content-type", "model/obj").body(text).send().await.unwrap();
        match line {
            None => assert_eq!(response.status(), StatusCode::CREATED, "{name}"),
            Some(line) => {
                let refused = problem(response, 422).await;
                let detail = refused["detail"].as_str().unwrap();
                let named: usize =
                    detail.split(['l', 'i', 'n', 'e', ' ', ':']).find_map(|word| word.parse().ok()).unwrap();
                assert!(line == 0 || named == line, "{name}: {detail}");
                assert!(detail.len() < 300, "{name}: {detail}");
            }
        }
        let peak = peak_memory_mb(server.0.id());
        println!("{name}: peak {peak:.0} MB");
        assert!(peak < 200.0, "{name}: {peak} MB");
    }
    let ready: Value = json!(client.get(url.replace("/v1/meshes", "/readyz")).send().await.unwrap().status().as_u16());
    assert_eq!(ready, 200);
}

//! Work for requests: bounded before it is read, in turns, and over when its client has gone.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use tokio::io::{AsyncReadExt, AsyncWriteExt};
use tokio::net::TcpStream;

use crate::common::{PATIENCE, TestService, client, problem, raw, small_job};
use crate::process::Server;

/// Bytes that a post counts beside its document.
const BYTES_OF_POST: usize = 8 << 10;

/// A thousand times of a bent tube to a thousandth: more than a minute of work.
fn long_flux() -> Value {
    let times: Vec<String> = (0..1000)
        .map(|k| format!("2026-06-{:02}T{:02}:{:02}:00+02:00", 1 + k % 30, 8 + k / 30 % 10, k / 300))
        .collect();
    json!({
        "tube": { "diameter_m": 0.35, "reflectance": 0.98,
                  "segments": [{ "length_m": 1.2 }, { "length_m": 2, "tilt_deg": 40, "azimuth_deg": 90 }],
                  "collector": { "kind": "dome", "transmittance": 0.92 },
                  "diffuser": { "kind": "lambertian", "transmittance": 0.7, "reflectance": 0.1 } },
        "location": { "latitude_deg": 55.77, "longitude_deg": 12.5 },
        "skies": [{ "cie_type": 12 }], "times": times, "relative_error": 0.001
    })
}

/// A wavy sheet of 2 n^2 triangles.
fn sheet(n: usize) -> String {
    let mut text = String::new();
    for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
        let [x, y] = [i, j].map(|k| 0.2 + 1.6 * k as f64 / n as f64);
        writeln!(text, "v {x} {y} {}", 0.3 + 0.1 * (i as f64 * 0.37).sin() * (j as f64 * 0.29).cos()).unwrap();
    }
    let at = |i: usize, j: usize| i * (n + 1) + j + 1;
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        writeln!(text, "f {} {} {}", at(i, j), at(i + 1, j), at(i + 1, j + 1)).unwrap();
        writeln!(text, "f {} {} {}", at(i, j), at(i + 1, j + 1), at(i, j + 1)).unwrap();
    }
    text
}

/// A small job with text that is a large value.
fn with_arrays(count: usize) -> String {
    let job = small_job().to_string();
    format!("{}, \"x\": [{}]}}", &job[..job.len() - 1], vec!["[]"; count].join(","))
}

/// Fluxes take the only turn of their kind for minutes: everything of another kind is answered meanwhile.
#[tokio::test]
async fn a_post_waits_for_no_other_kind() {
    let service = TestService::start_with(|config| {
        config.limits.preparing = 1;
        config.limits.flux_seconds = 10_000;
    })
    .await;
    let flux = service.post("/v1/tubes/flux", &long_flux()).timeout(10 * PATIENCE).send();
    let flux = tokio::spawn(flux);
    let second = tokio::spawn(service.post("/v1/tubes/flux", &long_flux()).timeout(10 * PATIENCE).send());
    tokio::time::sleep(Duration::from_millis(300)).await;
    let path = service.submit(&small_job()).await;
    assert_eq!(service.post("/v1/plan", &small_job()).send().await.unwrap().status(), StatusCode::OK);
    let predicted = service.request(Method::POST, "/v1/plan?predict=true").json(&small_job()).send().await.unwrap();
    assert_eq!(predicted.status(), StatusCode::OK);
    let study = json!({ "job": small_job(), "methods": ["light_tracing"], "relative_errors": [0.5], "seeds": 1 });
    assert_eq!(service.post("/v1/studies", &study).send().await.unwrap().status(), StatusCode::ACCEPTED);
    service.json("/v1/tubes/transmission?reflectance=0.98&aspect_ratio=4&altitude_deg=30").await;
    service.finished(&path).await;
    service.json(&format!("{path}/grids/workplane")).await;
    assert!(!flux.is_finished() && !second.is_finished());
    flux.abort();
    second.abort();
}

/// Fluxes that do not fit into their time are refused early, with how long they would take and how many fit.
#[tokio::test]
async fn fluxes_that_do_not_fit_into_their_time_are_refused_with_what_fits() {
    let service = TestService::start_with(|config| config.limits.flux_seconds = 30).await;
    let answer = service.post("/v1/tubes/flux", &long_flux()).send().await.unwrap();
    let refused = problem(answer, 422).await;
    let error = &refused["errors"][0];
    assert_eq!((&error["pointer"], &error["code"]), (&json!("/times"), &json!("too_many")), "{refused}");
    let detail = error["detail"].as_str().unwrap();
    // as many as it says
    let fitting = detail.split(": request ").nth(1).and_then(|rest| rest.split(' ').next()).unwrap();
    let fitting: usize = fitting.parse().unwrap();
    assert!((1..1000).contains(&fitting), "{detail}");
}

/// Bytes that somebody else sends slowly, or has yet to send, are taken: no more come in, and everything without a body goes on.
#[tokio::test]
async fn bytes_of_bodies_are_bounded_before_they_are_read() {
    let small = small_job().to_string().len() + BYTES_OF_POST;
    for (of_all, of_client, status) in [(2 * small, usize::MAX, 503), (usize::MAX / 16, 2 * small, 429)] {
        let service = TestService::start_with(|config| {
            config.limits.body_bytes = of_all;
            config.limits.body_bytes_per_client = of_client;
        })
        .await;
        let host = service.running.address;
        let mut slow = TcpStream::connect(host).await.unwrap();
        let head = format!(
            "POST /v1/plan HTTP/1.1\r\nhost: {host}\r\ncontent-type: application/json\r\ncontent-length: {}\r\n",
            small_job().to_string().len() + 1
        );
        // `100 Continue` comes when the service reads the body
        slow.write_all(format!("{head}expect: 100-continue\r\n\r\n").as_bytes()).await.unwrap();
        slow.read_exact(&mut [0; 12]).await.unwrap();
        for path in ["/v1/jobs", "/v1/plan", "/v1/studies", "/v1/tubes/flux"] {
            let refused = service.post(path, &small_job()).send().await.unwrap();
            assert!(refused.headers().contains_key("retry-after"), "{path}");
            problem(refused, status).await;
            // nothing of it is read
            let head = format!("{}connection: close\r\n\r\n", head.replace("/v1/plan", path));
            let answer = raw(host, &head).await;
            assert!(answer.starts_with(&format!("HTTP/1.1 {status}")), "{answer}");
        }
        service.json("/v1/jobs").await;
        drop(slow);
        let again = async {
            while service.post("/v1/plan", &small_job()).send().await.unwrap().status() != StatusCode::OK {
                tokio::time::sleep(Duration::from_millis(20)).await;
            }
        };
        tokio::time::timeout(PATIENCE, again).await.expect("the bytes are free again");
    }
}

#[tokio::test]
async fn more_values_than_a_document_has_are_refused() {
    let service = TestService::start().await;
    let most = (1 << 20) / 5;
    let post = async |path: &str, body: String| {
        service.request(Method::POST, path).header("content-type", "application/json").body(body).send().await.unwrap()
    };
    for path in ["/v1/jobs", "/v1/plan", "/v1/studies", "/v1/tubes/flux"] {
        let refused = problem(post(path, with_arrays(most)).await, 422).await;
        let error = &refused["errors"][0];
        assert_eq!(error["code"], "too_many", "{refused}");
        assert!(error["pointer"].as_str().unwrap().starts_with("/x/"), "{refused}");
        assert!(error["detail"].as_str().unwrap().contains(&format!("at most {most} values")), "{refused}");
        // objects take more memory than other values
        let refused = problem(post(path, with_arrays(most / 8).replace("[]", "{}")).await, 422).await;
        assert_eq!(refused["errors"][0]["code"], "too_many", "{refused}");
        assert_eq!(post(path, format!("{}1", "[".repeat(100_000))).await.status(), StatusCode::BAD_REQUEST);
    }
}

/// A post that waits for its turn outlives its client, and its bytes count as long: more than are allowed are refused.
#[tokio::test]
async fn posts_that_outlive_their_clients_count() {
    let small = small_job().to_string().len() + BYTES_OF_POST;
    let service = TestService::start_with(|config| {
        config.limits.preparing = 1;
        // the slow one, which is a little longer, and two
        config.limits.body_bytes_per_client = 3 * small + 1000;
    })
    .await;
    let upload = service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(sheet(250));
    let mesh: Value = upload.send().await.unwrap().json().await.unwrap();
    let mut slow = small_job();
    slow["name"] = json!("slow");
    slow["grids"] = json!([]);
    slow["room"]["objects"] = json!([{ "kind": "mesh", "mesh": mesh["id"], "unit": "m", "position_m": [0, 0, 0],
                                       "surfaces": { "": { "reflectance": 0.5 } } }]);
    let posted = tokio::spawn(service.post_job(&slow).send());
    let host = service.running.address;
    // the first has its turn
    tokio::time::sleep(Duration::from_millis(100)).await;
    for _ in 0..2 {
        let mut hangs_up = TcpStream::connect(host).await.unwrap();
        let body = small_job().to_string();
        let head = format!(
            "POST /v1/jobs HTTP/1.1\r\nhost: {host}\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
            body.len()
        );
        hangs_up.write_all(head.as_bytes()).await.unwrap();
    }
    // they are read
    tokio::time::sleep(Duration::from_millis(100)).await;
    for _ in 0..5 {
        problem(service.post_job(&small_job()).send().await.unwrap(), 429).await;
    }
    assert!(!posted.is_finished(), "the mesh is too small: others have had a turn");
    assert_eq!(posted.await.unwrap().unwrap().status(), StatusCode::ACCEPTED);
    let all_are_there = async {
        while service.json("/v1/jobs").await["jobs"].as_array().unwrap().len() < 3 {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(PATIENCE, all_are_there).await.expect("a posted job is lost");
    service.submit(&small_job()).await;
    let jobs = service.json("/v1/jobs").await;
    let mut names: Vec<&str> =
        jobs["jobs"].as_array().unwrap().iter().map(|job| job["name"].as_str().unwrap()).collect();
    names.sort_unstable();
    assert_eq!(names, ["slow", "small", "small", "small"]);
}

/// Posts of a megabyte that is a large value, hundreds at once, in little memory: each is answered, and the service goes on.
#[cfg(target_os = "linux")]
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn hundreds_of_large_posts_fit_into_little_memory() {
    const POSTS: usize = 400;
    let data = tempfile::tempdir().unwrap();
    let mut service = Server::start_after("ulimit -d 400000", data.path(), &[]);
    let (http, url) = (client(), format!("{}/v1/jobs", service.url));
    let body = bytes::Bytes::from(with_arrays(((1 << 20) - 2000) / 3));
    let post = |_| {
        let post = http.post(&url).header("content-type", "application/json").body(body.clone()).send();
        async { post.await.map(|answer| answer.status().as_u16()).ok() }
    };
    let answers = futures::future::join_all((0..POSTS).map(post)).await;
    let mut counts = BTreeMap::new();
    answers.into_iter().for_each(|status| *counts.entry(status).or_insert(0) += 1);
    println!("{counts:?}, {} MB", service.resident() >> 20);
    assert!(!service.is_gone(), "{counts:?}");
    // one that is refused while it sends may not read why
    assert!(counts.keys().all(|status| matches!(status, None | Some(422 | 429 | 503))), "{counts:?}");
    assert!(counts[&Some(422)] > 0, "{counts:?}");
    service.submit(&small_job()).await;
}

//! A service on a free port with a data folder of its own, and a client.

use std::time::Duration;

use eventsource_stream::Eventsource;
use futures::StreamExt;
use reqwest::{Method, RequestBuilder, Response, StatusCode};
use serde_json::{Value, json};
use skyduct::cli::config::{Config, Flags};
use skyduct::cli::serve::RunningService;
use skyduct::document::NoFiles;
use skyduct::document::result::PlanResult;
use skyduct::present::prepared::prepare;
use skyduct::queue::owner::Owner;
use skyduct::queue::store::{MostWaiting, NewJob};
use tempfile::TempDir;
use uuid::Uuid;

/// Far longer than anything here takes: a test that waits for it has failed.
pub const PATIENCE: Duration = Duration::from_secs(120);

pub struct TestService {
    pub running: RunningService,
    pub http: reqwest::Client,
    pub data: TempDir,
}

pub struct TestEvent {
    pub id: i64,
    pub name: String,
    pub data: Value,
}

pub fn client() -> reqwest::Client {
    let _ = rustls::crypto::ring::default_provider().install_default();
    reqwest::Client::builder().timeout(PATIENCE).build().unwrap()
}

pub fn config(data: &std::path::Path) -> Config {
    let flags = Flags { listen: Some(([127, 0, 0, 1], 0).into()), data: Some(data.to_owned()), ..Flags::default() };
    Config::load(None, &flags).unwrap()
}

impl TestService {
    pub async fn start() -> Self {
        Self::start_with(|_| {}).await
    }

    pub async fn start_with(change: impl FnOnce(&mut Config)) -> Self {
        let data = tempfile::tempdir().unwrap();
        let mut config = config(data.path());
        change(&mut config);
        let running = RunningService::start(config).await.unwrap();
        Self { running, http: client(), data }
    }

    pub fn request(&self, method: Method, path: &str) -> RequestBuilder {
        self.http.request(method, format!("{}{path}", self.running.url()))
    }

    pub fn get(&self, path: &str) -> RequestBuilder {
        self.request(Method::GET, path)
    }

    pub fn post(&self, path: &str, body: &Value) -> RequestBuilder {
        self.request(Method::POST, path).json(body)
    }

    pub fn post_job(&self, document: &Value) -> RequestBuilder {
        self.post("/v1/jobs", document)
    }

    pub async fn json(&self, path: &str) -> Value {
        let response = self.get(path).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::OK, "{path}");
        response.json().await.unwrap()
    }

    /// Queues a job; answers its path.
    pub async fn submit(&self, document: &Value) -> String {
        let response = self.post_job(document).send().await.unwrap();
        let status = response.status();
        let location = response.headers().get("location").map(|value| value.to_str().unwrap().to_owned());
        assert_eq!(status, StatusCode::ACCEPTED, "{}", response.text().await.unwrap());
        location.unwrap()
    }

    /// Events from `after` on, until the stream ends.
    pub async fn events_after(&self, job: &str, after: i64) -> Vec<TestEvent> {
        self.events_until(job, after, |_| false).await
    }

    /// Events from `after` on, until `enough`, or the stream ends.
    pub async fn events_until(&self, job: &str, after: i64, enough: impl Fn(&TestEvent) -> bool) -> Vec<TestEvent> {
        events_until(self.get(&format!("{job}/events")), after, enough).await
    }

    /// Waits for the job's end; answers the job.
    pub async fn finished(&self, job: &str) -> Value {
        let response = self.get(&format!("{job}/events")).send().await.unwrap();
        // the stream ends with the job
        response.bytes().await.unwrap();
        self.json(job).await
    }
}

/// Events of a stream from `after` on, until `enough`, or its end.
pub async fn events_until(request: RequestBuilder, after: i64, enough: impl Fn(&TestEvent) -> bool) -> Vec<TestEvent> {
    let response = request.header("last-event-id", after).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::OK);
    assert_eq!(response.headers()["content-type"], "text/event-stream");
    let mut stream = response.bytes_stream().eventsource();
    let mut events = Vec::new();
    while let Some(event) = stream.next().await {
        let event = event.unwrap();
        let id = event.id.parse().unwrap();
        let data = serde_json::from_str(&event.data).unwrap();
        let event = TestEvent { id, name: event.event, data };
        let last = enough(&event);
        events.push(event);
        if last {
            break;
        }
    }
    events
}

/// Sends `text` as it is and reads the answer to its end, or as far as it comes.
pub async fn raw(address: std::net::SocketAddr, text: &str) -> String {
    use tokio::io::{AsyncReadExt, AsyncWriteExt};
    let mut stream = tokio::net::TcpStream::connect(address).await.unwrap();
    stream.write_all(text.as_bytes()).await.unwrap();
    let mut answer = Vec::new();
    // a service that closes early resets the connection
    let _ = tokio::time::timeout(PATIENCE, stream.read_to_end(&mut answer)).await.expect("the answer ends");
    String::from_utf8_lossy(&answer).into_owned()
}

/// The problem document of a failed answer, after a look at what all have.
pub async fn problem(response: Response, status: u16) -> Value {
    let path = response.url().path().to_owned();
    assert_eq!(response.status().as_u16(), status, "{path}");
    assert_eq!(response.headers()["content-type"], "application/problem+json", "{path}");
    let problem: Value = response.json().await.unwrap();
    assert_eq!(problem["status"], status);
    assert_eq!(problem["instance"], path);
    for field in ["type", "title", "detail"] {
        assert!(problem[field].as_str().is_some_and(|text| !text.is_empty()), "{field} in {problem}");
    }
    problem
}

/// A job of 20 passes, well under a second: a grid and a small view.
pub fn small_job() -> Value {
    json!({
        "name": "small",
        "sky": {
            "cie_type": 12,
            "sun_position": { "altitude_deg": 35, "azimuth_deg": 225 },
            "zenith_luminance_cd_m2": 5000,
            "direct_normal_illuminance_lux": 0
        },
        "room": { "size_m": [2.0, 2.0, 2.0] },
        "tubes": [{
            "centre_m": [1.0, 1.0], "diameter_m": 0.254, "reflectance": 0.98, "segments": [{ "length_m": 1.0 }],
            "collector": { "kind": "open" },
            "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.0 }
        }],
        "grids": [{ "name": "workplane", "height_m": 0.85, "cells": [3, 2] }],
        "views": [{ "name": "room", "eye_m": [1.9, 0.1, 1.6], "look_at_m": [1.0, 1.2, 0.8], "up": [0, 0, 1],
                    "vertical_fov_deg": 60, "size_px": [16, 8] }],
        "method": { "kind": "sppm", "photons_per_pass": 2000 },
        "stop": { "relative_error": 1e-9, "view_relative_error": 1e-9, "max_passes": 20 },
        "seed": 7
    })
}

/// A job that goes on until it is stopped.
pub fn endless_job() -> Value {
    let mut job = small_job();
    job["name"] = json!("endless");
    job["stop"] =
        json!({ "relative_error": 1e-9, "view_relative_error": 1e-9, "max_passes": 100_000_000, "max_seconds": 3600 });
    job
}

/// Jobs that a test lets wait, of all clients and of each.
pub fn most(jobs: u64) -> MostWaiting {
    MostWaiting { jobs, of_client: jobs }
}

/// A small job as a store takes it.
pub fn new_job() -> NewJob {
    let prepared = prepare(small_job().to_string().as_bytes(), &NoFiles).unwrap();
    NewJob {
        id: Uuid::now_v7(),
        owner: Owner::default(),
        client: "client".into(),
        name: Some("test".into()),
        submitted: "{}".into(),
        document: prepared.document.clone(),
        plan: PlanResult::from(&prepared.plan),
        known: prepared.known(),
        predictions: None,
        warnings: Vec::new(),
        idempotency_key: None,
        body_hash: "hash".into(),
        computation: None,
        uploads: Vec::new(),
    }
}

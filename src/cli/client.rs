//! HTTP client of the service, for `submit` and `demo`.

use std::time::Duration;

use anyhow::{Context, bail};
use eventsource_stream::Eventsource;
use futures::StreamExt;
use reqwest::{RequestBuilder, Response, StatusCode};
use serde::Deserialize;
use serde_json::Value;

use crate::document::{DocumentErrors, FieldError};

/// Longest silence of a live connection: heartbeats come every 15 s.
const SILENCE: Duration = Duration::from_secs(45);
const RECONNECT_PAUSE: Duration = Duration::from_secs(1);
/// Number of successive attempts without an answer after which the service is given up.
const MAX_ATTEMPTS: u32 = 30;

/// Kind of an uploaded file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Uploaded {
    /// Mesh.
    Mesh,
    /// Weather of a year.
    Weather,
    /// Daylight of other openings over a year.
    Array,
    /// Honeybee model.
    Model,
}

/// Connection to a service.
pub struct Client {
    http: reqwest::Client,
    server: String,
    /// Name of the server in messages: its address without user name and password.
    name: String,
}

/// Event of a job.
pub struct JobEvent {
    /// Name of the kind of event, as in the event stream.
    pub name: String,
    /// Content of the event.
    pub data: Value,
}

/// News of a job that is followed: its events, and the state of the connection.
pub enum News<'a> {
    /// The next event.
    Event(&'a JobEvent),
    /// Loss of the connection, or none from the start; the client keeps trying to connect.
    Lost,
    /// First event after the connection was restored.
    Back(&'a JobEvent),
}

impl JobEvent {
    /// True if the job ends with this event.
    pub fn is_final(&self) -> bool {
        crate::queue::store::is_final_event(&self.name)
    }
}

impl Client {
    /// Creates a client of `server`, e.g. `http://127.0.0.1:8080`.
    pub fn new(server: &str) -> anyhow::Result<Self> {
        // an error means that there is a provider already
        let _ = rustls::crypto::ring::default_provider().install_default();
        let http = reqwest::Client::builder()
            .connect_timeout(Duration::from_secs(10))
            .read_timeout(SILENCE)
            .build()
            .context("the HTTP client cannot start")?;
        let server = server.trim_end_matches('/').to_owned();
        Ok(Self { http, name: without_password(&server), server })
    }

    fn url(&self, path: &str) -> String {
        format!("{}{path}", self.server)
    }

    /// Uploads a file and returns its id. `pointer` is the field of the document that errors refer to.
    pub async fn upload(&self, kind: Uploaded, bytes: Vec<u8>, pointer: &str) -> anyhow::Result<String> {
        let (path, content_type) = match kind {
            Uploaded::Mesh => ("/v1/meshes", "model/obj"),
            Uploaded::Weather => ("/v1/weather", "text/plain"),
            Uploaded::Array => ("/v1/arrays", "application/octet-stream"),
            Uploaded::Model => ("/v1/models", "application/json"),
        };
        let request = self.http.post(self.url(path)).header("content-type", content_type).body(bytes);
        let response = self.send(request).await?;
        if response.status() == StatusCode::UNPROCESSABLE_ENTITY {
            let detail = problem_detail(response).await;
            return Err(DocumentErrors::from(FieldError::new(pointer, detail)).into());
        }
        let file: Value = success(response).await?.json().await?;
        Ok(file["id"].as_str().context("the service's answer has no id of the file")?.to_owned())
    }

    /// Posts a JSON document to the path of a collection, such as that of jobs, and returns what it made there. `key` makes the request
    /// idempotent.
    pub async fn submit(&self, path: &str, document: Vec<u8>, key: &str) -> anyhow::Result<Value> {
        let request = self
            .http
            .post(self.url(path))
            .header("content-type", "application/json")
            .header("idempotency-key", key)
            .body(document);
        let response = self.send(request).await?;
        match response.status() {
            StatusCode::UNPROCESSABLE_ENTITY | StatusCode::BAD_REQUEST => Err(document_errors(response).await.into()),
            _ => Ok(success(response).await?.json().await?),
        }
    }

    /// Posts a job document, waits up to `seconds` for its grids, and returns the job, with `grid_results` when it is done.
    pub async fn submit_and_wait(&self, document: Vec<u8>, seconds: u32) -> anyhow::Result<Value> {
        let request = self
            .http
            .post(self.url("/v1/jobs"))
            .header("content-type", "application/json")
            .header("prefer", format!("wait={seconds}"))
            .body(document);
        Ok(success(self.send(request).await?).await?.json().await?)
    }

    /// Follows a job to its final event, which is returned. Calls `hear` for every event in order and when the connection is
    /// lost or restored, and reconnects as often as needed; an error if the service stops answering.
    pub async fn follow(&self, events_path: &str, mut hear: impl FnMut(News)) -> anyhow::Result<JobEvent> {
        let mut last_id = "0".to_owned();
        let mut silent_attempts = 0;
        let mut lost = false;
        loop {
            let request = self
                .http
                .get(self.url(events_path))
                .header("accept", "text/event-stream")
                .header("last-event-id", &last_id);
            let response = match request.send().await {
                Ok(response) if is_busy(response.status()) => None,
                Ok(response) => Some(success(response).await?),
                Err(error) => {
                    tracing::debug!(%error, "connecting to the event stream failed");
                    None
                }
            };
            if let Some(response) = response {
                let mut events = response.bytes_stream().eventsource();
                while let Some(Ok(event)) = events.next().await {
                    silent_attempts = 0;
                    last_id.clone_from(&event.id);
                    let data = serde_json::from_str(&event.data).context("an event is not JSON")?;
                    let event = JobEvent { name: event.event, data };
                    if std::mem::take(&mut lost) {
                        hear(News::Back(&event));
                    }
                    hear(News::Event(&event));
                    if event.is_final() {
                        return Ok(event);
                    }
                }
            }
            if !std::mem::replace(&mut lost, true) {
                hear(News::Lost);
            }
            silent_attempts += 1;
            if silent_attempts > MAX_ATTEMPTS {
                bail!("{} no longer answers; the job continues there", self.name);
            }
            tokio::time::sleep(RECONNECT_PAUSE).await;
        }
    }

    /// Fetches a JSON document.
    pub async fn json(&self, path: &str) -> anyhow::Result<Value> {
        Ok(success(self.send(self.http.get(self.url(path))).await?).await?.json().await?)
    }

    /// Fetches a file.
    pub async fn bytes(&self, path: &str) -> anyhow::Result<Vec<u8>> {
        Ok(success(self.send(self.http.get(self.url(path))).await?).await?.bytes().await?.into())
    }

    async fn send(&self, request: RequestBuilder) -> anyhow::Result<Response> {
        request.send().await.with_context(|| format!("{} does not answer", self.name))
    }
}

/// True if the status is temporary, so that a later attempt may succeed.
fn is_busy(status: StatusCode) -> bool {
    status.is_server_error() || status == StatusCode::TOO_MANY_REQUESTS
}

async fn success(response: Response) -> anyhow::Result<Response> {
    if response.status().is_success() {
        return Ok(response);
    }
    let (status, url) = (response.status(), response.url().clone());
    bail!("{url}: {status}: {}", problem_detail(response).await)
}

/// Returns an address without user name and password.
fn without_password(address: &str) -> String {
    match address.rsplit_once('@') {
        Some((before, host)) => {
            let scheme = before.split_once("://").map_or(String::new(), |(scheme, _)| format!("{scheme}://"));
            format!("{scheme}{host}")
        }
        None => address.to_owned(),
    }
}

async fn problem(response: Response) -> Value {
    response.json().await.unwrap_or(Value::Null)
}

async fn problem_detail(response: Response) -> String {
    let problem = problem(response).await;
    problem["detail"].as_str().unwrap_or("the service gave no reason").to_owned()
}

async fn document_errors(response: Response) -> DocumentErrors {
    let problem = problem(response).await;
    match Vec::<FieldError>::deserialize(&problem["errors"]) {
        Ok(listed) if !listed.is_empty() => DocumentErrors(listed),
        _ => FieldError::new("", problem["detail"].as_str().unwrap_or_default()).into(),
    }
}

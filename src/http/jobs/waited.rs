//! Wait for the end of a posted job, which is answered with its grids if it ends in time.

use std::collections::BTreeMap;
use std::time::Duration;

use axum::Json;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use serde_json::Value;
use tokio::sync::broadcast;
use utoipa::ToSchema;
use uuid::Uuid;

use super::resource::{JobResource, names};
use crate::document::result::GridResult;
use crate::http::client::Client;
use crate::http::outlive::HungUp;
use crate::http::places::Place;
use crate::http::prefer::PREFERENCE_APPLIED;
use crate::http::problem::Problem;
use crate::http::{App, Service};
use crate::queue::store::*;

/// Longest wait, also if the client prefers a longer one; shorter if the time limit of requests is.
const LONGEST: Duration = Duration::from_secs(60);

/// Time reserved for the answer itself, within the time limit of a request.
const FOR_THE_ANSWER: Duration = Duration::from_secs(2);

/// Largest number of bytes of all grid files together that are sent with the job.
const MOST_GRID_BYTES: u64 = 4 << 20;

/// Job that has ended, with its grids.
#[derive(Serialize, ToSchema)]
pub struct FinishedJob {
    #[serde(flatten)]
    pub job: JobResource,
    /// Grids by name, as in their files; absent if no pass was done, or if they take more than 4 MiB.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<BTreeMap<String, GridResult>>)]
    pub grid_results: Option<BTreeMap<String, Value>>,
}

/// Wait for the end of a job. It begins before the job is queued, so that no change is missed in between.
pub struct Waiting<'a> {
    app: &'a App,
    longest: Duration,
    changes: broadcast::Receiver<Change>,
    hung_up: HungUp,
    _place: Place,
}

impl<'a> Waiting<'a> {
    /// Begins a wait; `None` if the client prefers none, or if as many wait as the service allows, in all or for this client.
    pub fn new(app: &'a App, client: Client, hung_up: HungUp, preferred: Option<Duration>) -> Option<Self> {
        let request = Duration::from_secs(app.limits.request_seconds).saturating_sub(FOR_THE_ANSWER);
        let longest = preferred?.min(LONGEST).min(request);
        let place = app.permits.waits.take(client).ok()?;
        Some(Self { app, longest, changes: app.store.changes(), hung_up, _place: place })
    }

    /// Answers with the job and its grids if it ends in time; returns `None` if not. The job must be read after the wait has begun.
    pub async fn answer(mut self, job: &JobHead) -> Result<Option<Response>, Problem> {
        let id = job.id;
        let Ok(ended) = tokio::time::timeout(self.longest, self.ended(job)).await else { return Ok(None) };
        let Some(job) = ended? else { return Ok(None) };
        let grid_results = grids(self.app, id, &job).await?;
        let headers = [
            (header::LOCATION.as_str(), format!("/v1/jobs/{id}")),
            (PREFERENCE_APPLIED, format!("wait={}", self.longest.as_secs())),
        ];
        let body = FinishedJob { job: JobResource::new(job), grid_results };
        Ok(Some((StatusCode::OK, headers, Json(body)).into_response()))
    }

    /// Returns the job once it has ended; `None` if the job is deleted, the client disconnects, or the service ends.
    async fn ended(&mut self, job: &JobHead) -> Result<Option<Job>, Problem> {
        if job.status.is_final() {
            return Ok(self.app.store.job(job.id).await?);
        }
        loop {
            let change = tokio::select! {
                () = self.app.shutdown.cancelled() => return Ok(None),
                () = self.hung_up.wait() => return Ok(None),
                change = self.changes.recv() => change,
            };
            match change {
                Ok(Change::Ended(of) | Change::Stop(of)) if of == job.id => {}
                Err(broadcast::error::RecvError::Lagged(_)) => {}
                Err(broadcast::error::RecvError::Closed) => return Ok(None),
                Ok(_) => continue,
            }
            match self.app.store.job(job.id).await? {
                None => return Ok(None),
                Some(job) if job.head.status.is_final() => return Ok(Some(job)),
                Some(_) => {}
            }
        }
    }
}

/// Reads the grids of a job that has ended from its files; `None` if one is missing, or if they take more than [`MOST_GRID_BYTES`].
async fn grids(app: &Service, id: Uuid, job: &Job) -> Result<Option<BTreeMap<String, Value>>, Problem> {
    let mut grids = BTreeMap::new();
    let mut bytes = 0;
    for name in names(&job.document, "grids") {
        let Some(file) = app.store.artifact(id, &format!("grids/{name}.json")).await? else { return Ok(None) };
        bytes += file.size;
        if bytes > MOST_GRID_BYTES {
            return Ok(None);
        }
        let json = app.artifacts.read_artifact(&file).await?;
        let grid = serde_json::from_slice(&json).map_err(|error| Problem::failed("reading a grid failed", &error))?;
        grids.insert(name.to_owned(), grid);
    }
    Ok(Some(grids))
}

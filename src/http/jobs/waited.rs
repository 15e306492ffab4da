//! A posted job that is waited for: answered with its grids when it ends in time.

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

use super::resource::JobResource;
use crate::document::result::GridResult;
use crate::http::client::Client;
use crate::http::outlive::HungUp;
use crate::http::places::Place;
use crate::http::prefer::PREFERENCE_APPLIED;
use crate::http::problem::Problem;
use crate::http::{App, Service};
use crate::job::store::*;

/// Longest wait, whatever the client prefers; shorter where the service lets no request take as long.
const LONGEST: Duration = Duration::from_secs(60);

/// Time for the answer itself, within the time that a request may take.
const FOR_THE_ANSWER: Duration = Duration::from_secs(2);

/// Grids whose files take more bytes in all are not sent with the job.
const MOST_GRID_BYTES: u64 = 4 << 20;

/// A job that has ended, with its grids.
#[derive(Serialize, ToSchema)]
pub struct FinishedJob {
    #[serde(flatten)]
    pub job: JobResource,
    /// The grids by name, as their links have them; absent where no pass was done, or where they take more than 4 MiB.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<BTreeMap<String, GridResult>>)]
    pub grid_results: Option<BTreeMap<String, Value>>,
}

/// A wait that a client prefers, and that begins before its job is queued, so that nothing falls between.
pub struct Waiting<'a> {
    app: &'a App,
    longest: Duration,
    changes: broadcast::Receiver<Change>,
    hung_up: HungUp,
    _place: Place,
}

impl<'a> Waiting<'a> {
    /// `None` where nothing can be waited for: nobody asks for it, or as many wait as the service allows, in all or of this client.
    pub fn new(app: &'a App, client: Client, hung_up: HungUp, preferred: Option<Duration>) -> Option<Self> {
        let request = Duration::from_secs(app.limits.request_seconds).saturating_sub(FOR_THE_ANSWER);
        let longest = preferred?.min(LONGEST).min(request);
        let place = app.permits.waits.take(client).ok()?;
        Some(Self { app, longest, changes: app.store.changes(), hung_up, _place: place })
    }

    /// The job, which was read after the wait began, with its grids when it ends in time, else `None`.
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

    /// The job once it has ended; `None` if it is gone, the client is, or the service ends.
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

/// The grids of a job that has ended, as its files have them.
async fn grids(app: &Service, id: Uuid, job: &Job) -> Result<Option<BTreeMap<String, Value>>, Problem> {
    let mut grids = BTreeMap::new();
    let mut bytes = 0;
    for name in job.document["grids"].as_array().into_iter().flatten().filter_map(|grid| grid["name"].as_str()) {
        let Some(file) = app.store.artifact(id, &format!("grids/{name}.json")).await? else { return Ok(None) };
        bytes += file.size;
        if bytes > MOST_GRID_BYTES {
            return Ok(None);
        }
        let json = app.artifacts.read_artifact(&file).await?;
        let grid = serde_json::from_slice(&json).map_err(|error| {
            tracing::error!(%error, job = %id, "reading a grid failed");
            Problem::internal()
        })?;
        grids.insert(name.to_owned(), grid);
    }
    Ok(Some(grids))
}

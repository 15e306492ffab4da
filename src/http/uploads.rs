//! Uploads: bodies are received as fast as they come, but no slower than a least rate; stored files are described and deleted.

use std::sync::Arc;
use std::time::Duration;

use axum::Json;
use axum::body::HttpBody;
use axum::extract::Request;
use axum::http::{StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use futures::StreamExt;
use jiff::Timestamp;
use serde::Serialize;
use tokio::time::{Instant, timeout_at};

use crate::http::Service;
use crate::http::client::Client;
use crate::http::content::check_coding;
use crate::http::limits::permit;
use crate::http::places::Place;
use crate::http::problem::{Problem, incomplete_body, too_long};
use crate::http::problem_kind::ProblemKind;
use crate::http::turns::Turn;
use crate::queue::store::{UploadDeletion, UploadKind, UploadedFile};
use crate::queue::uploads::UploadError;

/// Longest time that an upload waits while other files are read.
const WAIT_FOR_OTHERS: Duration = Duration::from_secs(10);

/// Bodies that a path takes.
pub struct Accepted {
    /// Media types; a body without one is taken, too.
    pub media_types: &'static [&'static str],
    /// Sentence for others.
    pub refusal: &'static str,
    /// Largest length in bytes, if it is less than that of meshes.
    pub most_bytes: usize,
}

/// Uploaded file in memory, with the places that it takes.
struct Upload {
    bytes: Bytes,
    /// Places of the upload and its bytes, held until the last copy of this is dropped.
    places: Arc<[Place; 2]>,
    /// Permit to read the file.
    turn: Turn,
}

impl Upload {
    /// Receives a body of at most `mesh_bytes`, within the client's places for uploads and their bytes, and no slower than
    /// `upload_bytes_per_second`, and waits for a turn to read it. Places for bytes are taken as bytes arrive, so that an announced length
    /// takes none.
    async fn receive(service: &Service, client: Client, request: Request, accepted: Accepted) -> Result<Self, Problem> {
        check_type(&request, &accepted)?;
        check_coding(request.headers())?;
        let (limits, body) = (&service.limits, request.into_body());
        let most_bytes = limits.mesh_bytes.min(accepted.most_bytes);
        // before anything of it comes
        if body.size_hint().lower() > most_bytes as u64 {
            return Err(too_long(most_bytes));
        }
        let place = service.permits.uploads.take(client)?;
        let mut places_of_bytes = service.permits.upload_bytes.none(client);
        let in_time = Pace::new(limits.upload_grace_seconds, limits.upload_bytes_per_second);
        let mut pieces = body.into_data_stream();
        let mut bytes = Vec::new();
        while let Some(piece) =
            timeout_at(in_time.deadline_after(bytes.len()), pieces.next()).await.map_err(|_| too_slow(bytes.len()))?
        {
            let piece = piece.map_err(|error| incomplete_body(&error))?;
            if bytes.len() + piece.len() > most_bytes {
                return Err(too_long(most_bytes));
            }
            places_of_bytes.take(piece.len())?;
            bytes.extend_from_slice(&piece);
        }
        let turn = tokio::time::timeout(WAIT_FOR_OTHERS, permit(&service.permits.mesh_readers))
            .await
            .map_err(|_| Problem::unavailable("the service is busy reading other files; try again later"))??;
        Ok(Self { bytes: bytes.into(), places: Arc::new([place, places_of_bytes]), turn })
    }
}

fn check_type(request: &Request, accepted: &Accepted) -> Result<(), Problem> {
    let content_type = request.headers().get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
    let media_type = content_type.split(';').next().unwrap_or("").trim().to_ascii_lowercase();
    let taken = media_type.is_empty() || accepted.media_types.contains(&media_type.as_str());
    taken.then_some(()).ok_or_else(|| Problem::unsupported_media_type(accepted.refusal))
}

/// Uploaded file of one kind in the form of JSON answers.
pub trait UploadResource: Serialize + Sized {
    /// Kind of the file.
    const KIND: UploadKind;
    /// Path of the files of this kind.
    const PATH: &'static str;
    /// Bodies that are such files.
    const ACCEPTED: Accepted;

    /// Describes a file that was created at a time; `None` if it is of another kind.
    fn of(file: UploadedFile, created_at: Option<Timestamp>) -> Option<Self>;
}

/// Receives, checks and stores a file of a kind, and answers with its description.
pub async fn create<R: UploadResource>(app: &Service, client: Client, request: Request) -> Result<Response, Problem> {
    let Upload { bytes, places, turn } = Upload::receive(app, client, request, R::ACCEPTED).await?;
    let file = app.uploads.add(app.owner.clone(), R::KIND, bytes, (turn, places.clone())).await?;
    let location = [(header::LOCATION, format!("{}/{}", R::PATH, file.id))];
    Ok((StatusCode::CREATED, location, Json(described::<R>(Some(file))?)).into_response())
}

/// Describes a file of a kind by its id.
pub async fn get<R: UploadResource>(app: &Service, id: &str) -> Result<Json<R>, Problem> {
    Ok(Json(described(app.store.upload(R::KIND, id).await?)?))
}

fn described<R: UploadResource>(file: Option<UploadedFile>) -> Result<R, Problem> {
    let of = |file: UploadedFile| {
        let created_at = Timestamp::from_millisecond(file.created_at).ok();
        R::of(file, created_at)
    };
    file.and_then(of).ok_or_else(|| no_such(R::KIND))
}

/// Deletes an uploaded file of a kind.
pub async fn delete(service: &Service, kind: UploadKind, id: String) -> Result<StatusCode, Problem> {
    match service.deletion().upload(kind, id).await? {
        UploadDeletion::NotFound => Err(no_such(kind)),
        UploadDeletion::InUse => {
            let users = match kind {
                UploadKind::Mesh => "a queued or running job",
                // results of jobs that have ended are made of it
                UploadKind::Weather | UploadKind::Array | UploadKind::Model => "a job",
            };
            Err(Problem::conflict(format!("{users} uses this {}", kind.noun())))
        }
        UploadDeletion::Deleted(_) => Ok(StatusCode::NO_CONTENT),
    }
}

/// Returns the problem that there is no file of a kind with the id of a path.
fn no_such(kind: UploadKind) -> Problem {
    Problem::not_found(format!("there is no such {}", kind.noun()))
}

impl From<UploadError> for Problem {
    fn from(error: UploadError) -> Self {
        match error {
            UploadError::Obj(error) => Self::new(ProblemKind::InvalidMesh, error.to_string()),
            UploadError::Model(error) => Self::new(ProblemKind::InvalidModel, error.to_string()),
            UploadError::Weather(error) => Self::new(ProblemKind::InvalidWeather, error.to_string()),
            UploadError::Array(error) => Self::new(ProblemKind::InvalidArray, error.to_string()),
            UploadError::Store(error) => error.into(),
            UploadError::Artifact(error) => error.into(),
            UploadError::Panicked => Self::internal(),
        }
    }
}

/// Least rate of a body, counted from the creation of this value.
struct Pace {
    begun: Instant,
    grace: Duration,
    bytes_per_second: u64,
}

impl Pace {
    fn new(grace_seconds: u64, bytes_per_second: u64) -> Self {
        Self { begun: Instant::now(), grace: Duration::from_secs(grace_seconds), bytes_per_second }
    }

    /// Returns the time by which more must arrive after the first `bytes`.
    fn deadline_after(&self, bytes: usize) -> Instant {
        let paid = Duration::from_secs_f64(bytes as f64 / self.bytes_per_second.max(1) as f64);
        self.begun + self.grace + paid
    }
}

fn too_slow(bytes: usize) -> Problem {
    Problem::new(
        ProblemKind::Timeout,
        format!(
            "the upload is too slow: only {bytes} bytes arrived so far, fewer than upload_bytes_per_second of the \
             configuration requires"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_come_buys_time() {
        let pace = Pace::new(5, 1000);
        let seconds = |bytes| (pace.deadline_after(bytes) - pace.begun).as_secs_f64();
        assert_eq!([seconds(0), seconds(500), seconds(10_000)], [5.0, 5.5, 15.0]);
    }
}

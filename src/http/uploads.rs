//! Uploads: bodies are received as fast as they come, but no slower than a least rate.

use std::sync::Arc;
use std::time::Duration;

use axum::body::{Body, HttpBody};
use bytes::Bytes;
use futures::StreamExt;
use tokio::time::{Instant, timeout_at};

use crate::http::Service;
use crate::http::client::Client;
use crate::http::places::Place;
use crate::http::problem::{Problem, too_large};
use crate::http::problem_kind::ProblemKind;

/// Uploaded file in memory, with the places that it takes.
pub struct Upload {
    pub bytes: Bytes,
    /// Places of the upload and its bytes, held until the last copy of this is dropped.
    pub places: Arc<[Place; 2]>,
}

impl Upload {
    /// Receives a body of at most `mesh_bytes`, within the client's places for uploads and their bytes, and no slower than
    /// `upload_bytes_per_second`. Places for bytes are taken as bytes arrive, so that an announced length takes none.
    pub async fn receive(service: &Service, client: Client, body: Body) -> Result<Self, Problem> {
        let limits = &service.limits;
        let longer = || too_large("the body is longer than this path allows");
        // before anything of it comes
        if body.size_hint().lower() > limits.mesh_bytes as u64 {
            return Err(longer());
        }
        let place = service.permits.uploads.take(client)?;
        let mut places_of_bytes = service.permits.upload_bytes.none(client);
        let in_time = Pace::new(limits.upload_grace_seconds, limits.upload_bytes_per_second);
        let mut pieces = body.into_data_stream();
        let mut bytes = Vec::new();
        while let Some(piece) =
            timeout_at(in_time.deadline_after(bytes.len()), pieces.next()).await.map_err(|_| too_slow(bytes.len()))?
        {
            let piece = piece
                .map_err(|error| Problem::bad_request(format!("the body ended before it was complete: {error}")))?;
            if bytes.len() + piece.len() > limits.mesh_bytes {
                return Err(longer());
            }
            places_of_bytes.take(piece.len())?;
            bytes.extend_from_slice(&piece);
        }
        Ok(Self { bytes: bytes.into(), places: Arc::new([place, places_of_bytes]) })
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

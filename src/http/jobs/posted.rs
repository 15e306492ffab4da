//! Posted documents: read, hashed, prepared.

use std::sync::Arc;

use axum::body::HttpBody;
use axum::extract::{FromRequest, FromRequestParts, Request};
use axum::http::header;
use bytes::Bytes;
use futures::StreamExt as _;
use serde_json::Value;

use crate::document::canonical::canonical_hash;
use crate::document::{DocumentErrors, JobDocument, read};
use crate::http::client::Client;
use crate::http::content::check_coding;
use crate::http::limits::off_thread;
use crate::http::places::Place;
use crate::http::problem::{Problem, incomplete_body, too_long};
use crate::http::problem_kind::ProblemKind;
use crate::http::turns::Turn;
use crate::http::{Service, Shared};
use crate::present::prepared::{Prepared, prepare_document};
use crate::queue::computation::computation;

/// Least number of bytes of a document for each value in it: a table of short numbers has a value for every five bytes, and no
/// document has more.
const BYTES_PER_VALUE: usize = 5;

/// Bytes counted for a post besides those of its document: posts outlive their clients, and the number of short ones must be
/// limited, too.
const BYTES_OF_POST: usize = 8 << 10;

/// Body that came as JSON and is not parsed yet. Its bytes count for its client as long as it, or the document read from it, lives.
pub struct Body {
    text: Bytes,
    /// Largest number of JSON values that it may have.
    most_values: usize,
    held: Place,
}

impl FromRequest<Arc<Shared>> for Body {
    type Rejection = Problem;

    async fn from_request(request: Request, app: &Arc<Shared>) -> Result<Self, Problem> {
        Self::within(request, app, app.limits.document_bytes).await
    }
}

/// Posted document: its text, which is JSON, its value, and the hash of its canonical form.
pub struct Posted {
    pub text: String,
    pub value: Value,
    pub hash: String,
    /// Bytes of the document, which count for the client until this is dropped.
    pub held: Place,
}

impl Body {
    /// Receives a body of at most `most` bytes.
    pub async fn within(request: Request, app: &Arc<Shared>, most: usize) -> Result<Self, Problem> {
        let content_type = request.headers().get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok());
        let media_type = content_type.unwrap_or("").split(';').next().unwrap_or("").trim().to_ascii_lowercase();
        if media_type != "application/json" {
            return Err(Problem::unsupported_media_type("a document must be sent as application/json"));
        }
        check_coding(request.headers())?;
        let (mut parts, body) = request.into_parts();
        let Ok(client) = Client::from_request_parts(&mut parts, app).await;
        // before anything of it comes
        if body.size_hint().lower() > most as u64 {
            return Err(too_long(most));
        }
        // one that does not say how long it is may be as long as it can
        let bytes = body.size_hint().upper().map_or(most, |bytes| usize::try_from(bytes).unwrap_or(most).min(most));
        let mut held = app.permits.bodies.none(client);
        held.take(bytes.saturating_add(BYTES_OF_POST))?;
        let (mut pieces, mut text) = (body.into_data_stream(), Vec::new());
        while let Some(piece) = pieces.next().await {
            let piece = piece.map_err(|error| incomplete_body(&error))?;
            if text.len() + piece.len() > most {
                return Err(too_long(most));
            }
            text.extend_from_slice(&piece);
        }
        Ok(Self { text: text.into(), most_values: most / BYTES_PER_VALUE, held })
    }

    /// Parses the document off the async threads.
    pub async fn read(self, turn: &Turn) -> Result<Posted, Problem> {
        off_thread(turn.clone(), move |_| self.parse()).await?
    }

    fn parse(self) -> Result<Posted, Problem> {
        let Self { text, most_values, held } = self;
        let text = read::json::text(&text).map_err(|error| not_json(error.detail))?.into_owned();
        // a field that is given twice is refused before a key can compare its last value
        let value =
            read::json::value_within(text.as_bytes(), most_values).map_err(|error| match error.pointer.as_str() {
                "" => not_json(error.detail),
                _ => DocumentErrors(vec![error]).into(),
            })?;
        let hash = canonical_hash(&value).map_err(|error| Problem::failed("hashing a document failed", &error))?;
        Ok(Posted { text, value, hash, held })
    }
}

fn not_json(detail: String) -> Problem {
    Problem::new(ProblemKind::NotJson, detail)
}

/// Job that can be queued, or planned.
pub struct PreparedPost {
    pub prepared: Arc<Prepared>,
    /// Ids of the uploaded files that the job uses.
    pub meshes: Vec<String>,
    /// Name of the computation that the job needs; see [`computation`].
    pub computation: Option<String>,
}

/// Prepares a job off the async threads, because meshes can be large.
pub async fn prepare(app: &Service, turn: &Turn, document: Value) -> Result<PreparedPost, Problem> {
    let (uploads, runtime) = (app.uploads.clone(), tokio::runtime::Handle::current());
    let (memory_limit, most_seconds) = (app.limits.memory_limit_bytes(), app.limits.max_seconds);
    let prepared = off_thread(turn.clone(), move |cancel| {
        let meshes = uploads.for_document(runtime, cancel);
        let prepared = prepare_document(&JobDocument::from_files(document, &meshes)?, &meshes)?;
        prepared.check_memory(memory_limit)?;
        prepared.check_seconds(most_seconds)?;
        let computation = computation(&prepared.document);
        Ok::<_, DocumentErrors>(PreparedPost { prepared: Arc::new(prepared), meshes: meshes.loaded(), computation })
    });
    Ok(prepared.await??)
}

//! Errors as `application/problem+json` (RFC 9457).

use std::fmt::Display;

use axum::body::Body;
use axum::extract::rejection::{PathRejection, QueryRejection};
use axum::extract::{FromRequestParts, Request};
use axum::http::{HeaderValue, StatusCode, header};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;

use crate::document::{DocumentErrors, FieldError};
use crate::http::problem_kind::ProblemKind;
use crate::queue::files::FileError;
use crate::queue::store::StoreError;

/// Reason why a request was refused or failed (RFC 9457).
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct Problem {
    /// Kind of the problem: the path of a page that explains it.
    #[serde(rename = "type")]
    #[schema(format = "uri-reference", example = "/problems/invalid-document")]
    pub kind: &'static str,
    #[schema(example = "The document is not valid")]
    pub title: &'static str,
    #[schema(example = 422)]
    pub status: u16,
    pub detail: String,
    /// Path of the request.
    #[schema(format = "uri-reference", example = "/v1/jobs")]
    pub instance: String,
    /// Faults of an invalid document or query, one for each field; for a query, `parameter` is the parameter's name.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub errors: Vec<FieldError>,
    #[serde(skip)]
    retry_after_seconds: Option<u32>,
}

impl Problem {
    pub fn new(kind: ProblemKind, detail: impl Into<String>) -> Self {
        Self {
            kind: kind.code(),
            title: kind.title(),
            status: kind.status().as_u16(),
            detail: detail.into(),
            instance: String::new(),
            errors: Vec::new(),
            retry_after_seconds: None,
        }
    }

    pub fn retry_after(mut self, seconds: u32) -> Self {
        self.retry_after_seconds = Some(seconds);
        self
    }

    pub fn bad_request(detail: impl Into<String>) -> Self {
        Self::new(ProblemKind::BadRequest, detail)
    }

    pub fn no_such_job() -> Self {
        Self::not_found("there is no such job")
    }

    pub fn not_found(detail: impl Into<String>) -> Self {
        Self::new(ProblemKind::NotFound, detail)
    }

    /// True if there is nothing at the path of the request.
    pub fn is_not_found(&self) -> bool {
        self.status == StatusCode::NOT_FOUND.as_u16()
    }

    pub fn conflict(detail: impl Into<String>) -> Self {
        Self::new(ProblemKind::Conflict, detail)
    }

    pub fn unsupported_media_type(detail: impl Into<String>) -> Self {
        Self::new(ProblemKind::UnsupportedMediaType, detail)
    }

    /// Creates the problem of query parameters with bad values.
    pub fn invalid_parameters(errors: Vec<FieldError>) -> Self {
        let first = errors.first().map_or(String::new(), |error| error.to_string());
        Self { errors, ..Self::new(ProblemKind::InvalidParameters, first) }
    }

    /// Creates the problem of one query parameter with a bad value.
    pub fn invalid_parameter(name: &str, detail: impl Into<String>) -> Self {
        Self::invalid_parameters(vec![FieldError::of_parameter(name, detail)])
    }

    pub fn unavailable(detail: impl Into<String>) -> Self {
        Self::new(ProblemKind::Unavailable, detail).retry_after(5)
    }

    /// Creates the problem of a fault of the service; the log has its reason, under the answer's `x-request-id`.
    pub fn internal() -> Self {
        Self::new(
            ProblemKind::Internal,
            "internal error: the log of the service has the reason, under the x-request-id of this answer",
        )
    }

    /// Creates the problem of a fault of the service, and logs its reason.
    pub fn failed(what: &str, error: &dyn Display) -> Self {
        tracing::error!(%error, what);
        Self::internal()
    }

    /// Creates the problem of a stored file that is missing or damaged, for which repeating the request does not help.
    pub fn damaged_artifact(what: &str) -> Self {
        Self::new(
            ProblemKind::DamagedArtifact,
            format!("{what}; post the same document again to compute the file anew"),
        )
    }

    /// Creates the problem of a failed answer that came without one.
    fn of_status(status: StatusCode, allow: Option<&HeaderValue>) -> Self {
        match status {
            StatusCode::NOT_FOUND => Self::not_found("there is nothing at this path"),
            StatusCode::METHOD_NOT_ALLOWED => {
                let allowed = allow.and_then(|value| value.to_str().ok()).unwrap_or("other methods");
                Self::new(ProblemKind::MethodNotAllowed, format!("this path allows {allowed}"))
            }
            StatusCode::REQUEST_TIMEOUT => {
                Self::new(ProblemKind::Timeout, "the request did not arrive completely in time")
            }
            StatusCode::INTERNAL_SERVER_ERROR => Self::internal(),
            status => {
                let reason = status.canonical_reason().unwrap_or("The request failed");
                Self { status: status.as_u16(), title: reason, ..Self::new(ProblemKind::Http, reason) }
            }
        }
    }
}

/// Creates the problem of a body that is longer than the number of bytes that its path allows.
pub fn too_long(most_bytes: usize) -> Problem {
    Problem::new(
        ProblemKind::TooLarge,
        format!("the body may have at most {most_bytes} bytes on this path, but is longer"),
    )
}

/// Creates the problem of a body that cannot be received.
pub fn incomplete_body(error: &dyn Display) -> Problem {
    Problem::bad_request(format!("the body ended before it was complete: {error}"))
}

/// Attaches the problem to the response as an extension; [`as_problem_documents`] writes it out.
impl IntoResponse for Problem {
    fn into_response(self) -> Response {
        let status = StatusCode::from_u16(self.status).unwrap_or(StatusCode::INTERNAL_SERVER_ERROR);
        let mut response = status.into_response();
        if let Some(seconds) = self.retry_after_seconds {
            response.headers_mut().insert(header::RETRY_AFTER, HeaderValue::from(seconds));
        }
        response.extensions_mut().insert(self);
        response
    }
}

/// Gives every failed answer a problem document, also answers of outer layers.
pub async fn as_problem_documents(request: Request, next: Next) -> Response {
    let instance = request.uri().path().to_owned();
    let mut response = next.run(request).await;
    let status = response.status();
    if !status.is_client_error() && !status.is_server_error() {
        return response;
    }
    let mut problem = response
        .extensions_mut()
        .remove::<Problem>()
        .unwrap_or_else(|| Problem::of_status(status, response.headers().get(header::ALLOW)));
    problem.instance = instance;
    let body = serde_json::to_vec(&problem).unwrap_or_default();
    let headers = response.headers_mut();
    headers.remove(header::CONTENT_LENGTH);
    headers.remove(header::CONTENT_ENCODING);
    headers.insert(header::CONTENT_TYPE, HeaderValue::from_static("application/problem+json"));
    headers.insert(header::CACHE_CONTROL, HeaderValue::from_static("no-store"));
    let (parts, _) = response.into_parts();
    Response::from_parts(parts, Body::from(body))
}

impl From<StoreError> for Problem {
    fn from(error: StoreError) -> Self {
        tracing::error!(%error, "the store failed");
        match error {
            StoreError::Unavailable(_) => Self::unavailable("the database does not answer; try again later"),
            StoreError::Failed(_) => Self::internal(),
        }
    }
}

impl From<FileError> for Problem {
    fn from(error: FileError) -> Self {
        tracing::error!(%error, "the artifact store failed");
        match error {
            FileError::NotFound(_) => Self::damaged_artifact("the stored file is missing"),
            FileError::Damaged { .. } => Self::damaged_artifact("the stored file is damaged"),
            FileError::Full(_) => Self::unavailable("the disk of the service is full"),
            FileError::Failed(_) => Self::internal(),
        }
    }
}

impl From<DocumentErrors> for Problem {
    fn from(DocumentErrors(errors): DocumentErrors) -> Self {
        let detail = match errors.as_slice() {
            [only] => only.to_string(),
            [first, rest @ ..] => format!("{first} (and {} more)", rest.len()),
            [] => String::new(),
        };
        Self { errors, ..Self::new(ProblemKind::InvalidDocument, detail) }
    }
}

impl From<QueryRejection> for Problem {
    fn from(rejection: QueryRejection) -> Self {
        let text = rejection.body_text();
        let text = text.trim_start_matches("Failed to deserialize query string: ");
        // the parameter's name, and what is wrong with it; without one, it is named in the text
        let named = || text.split_once('`').and_then(|(_, rest)| rest.split_once('`')).map(|(name, _)| (name, text));
        let (name, detail) = text.split_once(": ").or_else(named).unwrap_or(("", text));
        Self::invalid_parameter(name, detail)
    }
}

impl From<PathRejection> for Problem {
    fn from(_: PathRejection) -> Self {
        Self::not_found("there is nothing at this path")
    }
}

/// Extractor of query parameters; a bad one is answered with a problem document.
#[derive(FromRequestParts)]
#[from_request(via(axum::extract::Query), rejection(Problem))]
pub struct Query<T>(pub T);

/// Extractor of parts of the path; a bad one is answered with a problem document.
#[derive(FromRequestParts)]
#[from_request(via(axum::extract::Path), rejection(Problem))]
pub struct Path<T>(pub T);

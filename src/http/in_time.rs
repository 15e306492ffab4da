//! Time within which requests must be answered.

use std::time::Duration;

use axum::extract::{Request, State};
use axum::middleware::Next;
use axum::response::{IntoResponse, Response};
use tokio::time::Instant;

use crate::http::Limits;
use crate::http::problem::Problem;
use crate::http::problem_kind::ProblemKind;

/// Path of the fluxes of a tube, which have a time limit of their own.
const FLUX: &str = "/v1/tubes/flux";

/// Time by which a request must be answered.
#[derive(Clone, Copy)]
pub struct Deadline {
    pub at: Instant,
    /// Time from the arrival of the request to `at`.
    pub all: Duration,
}

/// Ends requests that are not answered within their time limit; event streams must have begun within it.
pub async fn answer_in_time(State(limits): State<Limits>, mut request: Request, next: Next) -> Response {
    let (seconds, setting, advice) = match request.uri().path() {
        FLUX => (limits.flux_seconds, "flux_seconds", "request fewer times at once, or a larger relative_error"),
        _ => (limits.request_seconds, "request_seconds", "try again later"),
    };
    let all = Duration::from_secs(seconds);
    let deadline = Deadline { at: Instant::now() + all, all };
    request.extensions_mut().insert(deadline);
    tokio::time::timeout_at(deadline.at, next.run(request)).await.unwrap_or_else(|_| {
        let detail = format!(
            "the request did not arrive completely or could not be answered within {seconds} s ({setting} of the \
             configuration); {advice}"
        );
        Problem::new(ProblemKind::Timeout, detail).into_response()
    })
}

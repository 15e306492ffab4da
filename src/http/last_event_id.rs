//! Header `Last-Event-ID`, which says after which event a stream continues.

use axum::http::HeaderMap;

/// Error for a header that is not the number of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("Last-Event-ID must be the id of an event")]
pub struct NoEventId;

/// Reads the id in the header `Last-Event-ID`, which a client sends that comes back, at least 0; `None` without the header.
///
/// It does not check that the job has such an event.
pub fn last_event_id(headers: &HeaderMap) -> Result<Option<i64>, NoEventId> {
    let Some(value) = headers.get("last-event-id") else { return Ok(None) };
    let text = value.to_str().map_err(|_| NoEventId)?;
    match text.parse() {
        Ok(id @ 0..) => Ok(Some(id)),
        _ => Err(NoEventId),
    }
}

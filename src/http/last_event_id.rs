//! Where a stream of events goes on.

use axum::http::HeaderMap;

/// A header that is no number of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("Last-Event-ID must be the id of an event")]
pub struct NoEventId;

/// Id in the header `Last-Event-ID`, which a client sends that comes back, at least 0; `None` without the header.
///
/// Whether the job has such an event is not judged here.
pub fn last_event_id(headers: &HeaderMap) -> Result<Option<i64>, NoEventId> {
    let Some(value) = headers.get("last-event-id") else { return Ok(None) };
    let text = value.to_str().map_err(|_| NoEventId)?;
    match text.parse() {
        Ok(id @ 0..) => Ok(Some(id)),
        _ => Err(NoEventId),
    }
}

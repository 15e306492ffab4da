//! A job's events as a stream (server-sent events), replayed from the store and followed live.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderMap, StatusCode};
use axum::response::sse::{Event as SseEvent, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures::stream::{self, Stream};
use serde::Deserialize;
use tokio::sync::broadcast;
use utoipa::IntoParams;
use uuid::Uuid;

use crate::http::event_schemas::{JobEvent, events as events_of_a_job};
use crate::http::problem::{Path, Problem, Query};
use crate::http::{App, Service};
use crate::job::store::{Change, Event, StoreError, is_final_event};

/// Events read at once; a slow reader costs no more memory than these.
const EVENTS_AT_ONCE: u32 = 256;
const HEARTBEAT: Duration = Duration::from_secs(15);
/// A client that lost the connection waits so long before it comes back.
const RETRY: Duration = Duration::from_secs(3);

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct EventsQuery {
    /// Only events after this id; the header `Last-Event-ID` comes first.
    #[param(minimum = 0)]
    after: Option<i64>,
}

/// The job's events.
///
/// Named `queued`, `planned`, `started`, `pass`, `image`, `succeeded`, `failed` and `cancelled`; their ids count 1, 2, 3 ...
/// without gaps. Those after `Last-Event-ID` that were missed come from the store. A comment is sent every 15 s. The stream
/// ends after a final event; who asks for events after that one is answered 204. `x-events` has the component of each event's
/// data. An `EventSource` hears named events by a listener of each name only, not by `onmessage`.
#[utoipa::path(get, path = "/v1/jobs/{id}/events", operation_id = "get_job_events", tag = "jobs",
    extensions(("x-events" = json!(events_of_a_job()))),
    params(("id" = Uuid, Path), EventsQuery, ("Last-Event-ID" = Option<i64>, Header, description = "The last event that was received")),
    responses(
        (status = 200, description = "The stream", body = JobEvent, content_type = "text/event-stream"),
        (status = 204, description = "All events were received before"),
        (status = 400, description = "Last-Event-ID is not an event id", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json")))]
pub async fn events(
    app: App,
    Path(id): Path<Uuid>,
    Query(query): Query<EventsQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let last = match headers.get("last-event-id") {
        Some(value) => Some(
            value
                .to_str()
                .ok()
                .and_then(|text| text.parse().ok())
                .ok_or_else(|| Problem::bad_request("Last-Event-ID must be the id of an event"))?,
        ),
        None => query.after,
    };
    let last = last.unwrap_or(0);
    // subscribed before the first look, so that nothing falls between
    let changes = app.store.changes();
    let head = app.store.job_head(id).await?.ok_or_else(|| Problem::not_found("there is no such job"))?;
    if !(0..=head.last_seq).contains(&last) {
        return Err(Problem::bad_request(format!("the job's event ids are 1 to {}", head.last_seq)));
    }
    if head.status.is_final() && last == head.last_seq {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    let feed = Feed { app: app.0, id, last, changes, read: VecDeque::new(), ended: false };
    Ok(Sse::new(feed.into_stream()).keep_alive(KeepAlive::new().interval(HEARTBEAT)).into_response())
}

struct Feed {
    app: Arc<Service>,
    id: Uuid,
    last: i64,
    changes: broadcast::Receiver<Change>,
    read: VecDeque<Event>,
    ended: bool,
}

impl Feed {
    fn into_stream(self) -> impl Stream<Item = Result<SseEvent, Infallible>> {
        let first = stream::iter([Ok(SseEvent::default().retry(RETRY))]);
        let events = stream::unfold(self, |mut feed| async {
            let event = match feed.next().await {
                Ok(event) => event?,
                Err(error) => {
                    // the client comes back with the id of the last event
                    tracing::warn!(%error, "an event stream broke off");
                    return None;
                }
            };
            Some((Ok(feed.to_sse(&event)), feed))
        });
        stream::StreamExt::chain(first, events)
    }

    async fn next(&mut self) -> Result<Option<Event>, StoreError> {
        loop {
            if let Some(event) = self.read.pop_front() {
                self.last = event.seq;
                self.ended = is_final_event(&event.name);
                return Ok(Some(event));
            }
            if self.ended || self.app.shutdown.is_cancelled() {
                return Ok(None);
            }
            self.read = self.app.store.events(self.id, self.last, EVENTS_AT_ONCE).await?.into();
            if !self.read.is_empty() {
                continue;
            }
            if self.app.store.job_head(self.id).await?.is_none() {
                return Ok(None);
            }
            if !self.changed().await {
                return Ok(None);
            }
        }
    }

    /// Waits until the job may have new events; `false` when the service ends.
    async fn changed(&mut self) -> bool {
        loop {
            tokio::select! {
                () = self.app.shutdown.cancelled() => return false,
                change = self.changes.recv() => match change {
                    Ok(Change::Job(id)) if id == self.id => return true,
                    Ok(_) => {}
                    Err(broadcast::error::RecvError::Lagged(_)) => return true,
                    Err(broadcast::error::RecvError::Closed) => return false,
                },
            }
        }
    }

    fn to_sse(&self, event: &Event) -> SseEvent {
        let mut data = event.data.clone();
        if event.name == "image"
            && let (Some(view), Some(passes)) = (data["view"].as_str(), data["passes"].as_u64())
        {
            data["url"] = format!("/v1/jobs/{}/views/{view}.png?pass={passes}", self.id).into();
        }
        SseEvent::default().id(event.seq.to_string()).event(&event.name).data(data.to_string())
    }
}

//! Stream of a job's events (server-sent events), replayed from the store and followed live.

use std::collections::VecDeque;
use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use axum::http::{HeaderMap, StatusCode};
use axum::response::sse::{Event as SseEvent, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures::stream::{self, Stream};
use metrics::counter;
use serde::Deserialize;
use tokio::sync::broadcast;
use utoipa::IntoParams;
use uuid::Uuid;

use crate::http::client::Client;
use crate::http::event_schemas::{JobEvent, events as events_of_a_job};
use crate::http::last_event_id::last_event_id;
use crate::http::places::Place;
use crate::http::problem::{Path, Problem, Query};
use crate::http::watched::{EVENTS_AT_ONCE, News, SentEvent, WatchedJobs};
use crate::http::{App, Service};
use crate::queue::events::{EventData, Restarted};
use crate::queue::store::{Event, JobHead, StoreError};

pub(super) const HEARTBEAT: Duration = Duration::from_secs(15);
/// Time that a client waits after a lost connection before it comes back.
pub(super) const RETRY: Duration = Duration::from_secs(3);

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct EventsQuery {
    /// Id of the event after which the stream begins; the header `Last-Event-ID` takes precedence.
    #[param(minimum = 0)]
    pub(super) after: Option<i64>,
}

/// Streams the job's events.
///
/// They are named `queued`, `planned`, `started`, `pass`, `image`, `restarted`, `succeeded`, `failed` and `cancelled`; their ids
/// count 1, 2, 3 ... without gaps. `pass` is sent for passes 1 to 64, then for those nearest to powers of 2^(1/8), and for the last
/// one; its `passes` is the number of passes done. `restarted` means that passes are rendered again because their stored state is
/// damaged; events of these passes are not sent twice. After a power failure, the newest events may be lost although they were
/// sent: a client that comes back with the id of a lost event receives `restarted` first, with the id before the last event that
/// there is, and then that event again. Events after `Last-Event-ID` that were missed come from the store. A comment is sent every
/// 15 s. The stream ends after a final event; a request for events after that one is answered 204. `x-events` has the component of
/// each event's data. An `EventSource` receives named events by a listener of each name only, not by `onmessage`.
#[utoipa::path(get, path = "/v1/jobs/{id}/events", operation_id = "get_job_events", tag = "jobs",
    extensions(("x-events" = json!(events_of_a_job()))),
    params(("id" = Uuid, Path),
        EventsQuery, ("Last-Event-ID" = Option<i64>, Header, description = "Id of the last event that was received")),
    responses(
        (status = 200, description = "The stream of events", body = JobEvent, content_type = "text/event-stream"),
        (status = 204, description = "The client has received all events already, and no more will come"),
        (status = 400, description = "The header Last-Event-ID is not a number", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "`after` is not a number, or is negative", body = Problem, content_type = "application/problem+json"),
        (status = 429, description = "This client has too many event streams open",
            body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The service has too many event streams open",
            body = Problem, content_type = "application/problem+json")))]
pub async fn events(
    app: App,
    client: Client,
    Path(id): Path<Uuid>,
    Query(query): Query<EventsQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let by_header = last_event_id(&headers).map_err(|error| Problem::bad_request(error.to_string()))?;
    let place = app.permits.streams.take(client)?;
    // subscribed before the job is read, so that no event is missed in between
    let changes = app.store.changes();
    let head = app.store.job_head(id).await?.ok_or_else(Problem::no_such_job)?;
    let last = last_heard(by_header, query.after)?;
    if head.status.is_final() && last == head.last_seq {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    // the client has an event that a power failure has lost
    let restart = (last > head.last_seq).then(|| SentEvent::new(id, &restarted(&head)));
    let last = restart.as_ref().map_or(last, |event| event.seq);
    let news = (!head.status.is_final()).then(|| WatchedJobs::watch(&app, &head, changes));
    let feed = Feed {
        app: app.0,
        id,
        last,
        news,
        read: restart.into_iter().collect(),
        missed: true,
        ended: false,
        _place: place,
    };
    Ok(Sse::new(feed.into_stream()).keep_alive(KeepAlive::new().interval(HEARTBEAT)).into_response())
}

/// Returns the id of the last event that a client has received. An invalid parameter is an error even if the header takes
/// precedence.
pub(super) fn last_heard(by_header: Option<i64>, after: Option<i64>) -> Result<i64, Problem> {
    match after {
        Some(after @ ..0) => {
            Err(Problem::invalid_parameter("after", format!("must be the id of an event, or 0, but is {after}")))
        }
        after => Ok(by_header.or(after).unwrap_or(0)),
    }
}

/// Creates the event for a client that has received more events than there are: the stream continues with the last event, sent
/// again.
fn restarted(head: &JobHead) -> Event {
    let data = Restarted {
        from_pass: head.progress.passes + 1,
        reason: format!("the service lost the events after {}, although they had been sent", head.last_seq),
    };
    // our own types always serialise
    let data = serde_json::to_value(data).unwrap_or_default();
    Event { seq: (head.last_seq - 1).max(0), name: Restarted::NAME.to_owned(), data }
}

/// Stream of a job's events: first those that were missed, from the store, then those that the job's reader sends.
struct Feed {
    app: Arc<Service>,
    id: Uuid,
    /// Id of the last event that was sent.
    last: i64,
    /// Channel of new events; `None` once all that is left is in the store.
    news: Option<broadcast::Receiver<Arc<News>>>,
    read: VecDeque<SentEvent>,
    /// True if the store may have events after `last` that the reader will not send.
    missed: bool,
    ended: bool,
    /// Place of this stream among those that may be open.
    _place: Place,
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
            Some((Ok(event.text), feed))
        });
        stream::StreamExt::chain(first, events)
    }

    async fn next(&mut self) -> Result<Option<SentEvent>, StoreError> {
        loop {
            if let Some(event) = self.read.pop_front() {
                self.last = event.seq;
                self.ended = event.is_final;
                return Ok(Some(event));
            }
            if self.ended || self.app.shutdown.is_cancelled() {
                return Ok(None);
            }
            if self.missed {
                let events = self.app.store.events(self.id, self.last, EVENTS_AT_ONCE).await?;
                counter!("skyduct_event_reads_total", "by" => "stream").increment(1);
                self.missed = events.len() >= EVENTS_AT_ONCE as usize;
                self.read = events.iter().map(|event| SentEvent::new(self.id, event)).collect();
                continue;
            }
            let Some(news) = &mut self.news else { return Ok(None) };
            let told = tokio::select! {
                () = self.app.shutdown.cancelled() => return Ok(None),
                told = news.recv() => told,
            };
            match told {
                Ok(news) if news.previous > self.last => self.missed = true,
                Ok(news) => self.read.extend(news.event.iter().filter(|event| event.seq > self.last).cloned()),
                Err(broadcast::error::RecvError::Lagged(_)) => self.missed = true,
                Err(broadcast::error::RecvError::Closed) => {
                    // its last words may have been missed
                    self.news = None;
                    self.missed = true;
                }
            }
        }
    }
}

//! Stream of a study's events (server-sent events): starts, passes and ends of its jobs.

use std::convert::Infallible;
use std::sync::Arc;

use axum::http::{HeaderMap, StatusCode};
use axum::response::sse::{Event as SseEvent, KeepAlive, Sse};
use axum::response::{IntoResponse, Response};
use futures::stream::{self, Stream};
use serde_json::{Value, json};
use tokio::sync::watch;
use tokio_util::sync::CancellationToken;
use utoipa::ToSchema;
use uuid::Uuid;

use super::looked::parts;
use super::resource::StudyStatus;
use super::show::no_such_study;
use super::watched::{ENDED, PASS, RESTARTED, STARTED, StudyEvent, StudyJobs, StudyNow, WatchedStudies};
use crate::http::App;
use crate::http::client::Client;
use crate::http::events::{EventsQuery, HEARTBEAT, RETRY, last_heard};
use crate::http::last_event_id::last_event_id;
use crate::http::places::Place;
use crate::http::problem::{Path, Problem, Query};

/// An event of a study's stream.
#[derive(ToSchema)]
#[expect(dead_code, reason = "only its schema is used: the library for server-sent events writes them")]
pub struct StudyStreamEvent {
    /// Number of the event: 1, 2, 3 ... without gaps. Sent back as `Last-Event-ID`, it makes the stream continue after it.
    /// `restarted` has the id after which the stream continues, which may be 0. Absent for `pass`.
    #[schema(pattern = "^(0|[1-9][0-9]*)$")]
    pub id: Option<String>,
    /// Name of the event.
    pub event: StudyEventName,
    /// Data of the event: JSON of a `StudyEvent`.
    pub data: String,
}

#[derive(serde::Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[expect(dead_code, reason = "only its schema is used: each kind of event has its own name")]
pub enum StudyEventName {
    Started,
    Pass,
    Ended,
    Restarted,
    Finished,
    Failed,
    Cancelled,
}

/// Lists the name of each event and the component of its data, for `x-events` of the operation.
fn names() -> Value {
    let last = [StudyStatus::Finished, StudyStatus::Failed, StudyStatus::Cancelled].map(StudyStatus::name);
    let data = json!({ "$ref": "#/components/schemas/StudyEvent" });
    [STARTED, PASS, ENDED, RESTARTED].iter().chain(&last).map(|name| json!({ "name": name, "data": data })).collect()
}

/// Streams the study's events.
///
/// `started` and `ended` report each of its jobs, `pass` the job that is at work, about once a second at most, and `finished`,
/// `failed` or `cancelled` the study: this event ends the stream. Ids count 1, 2, 3 ... without gaps; a `pass` has none, since it
/// is sent live only. Events after `Last-Event-ID` that were missed are sent first; a job that was deleted alone takes its events
/// with it. A client that comes back with the id of an event that no longer exists (after a power failure, or because a job was
/// deleted) receives `restarted` first, with the id before the last event that there is, and then that event again. A comment is
/// sent every 15 s. A request for events after the last one is answered 204. `x-events` has the component of each event's data; the
/// study itself has the same data at any time.
#[utoipa::path(get, path = "/v1/studies/{id}/events", operation_id = "get_study_events", tag = "studies",
    extensions(("x-events" = json!(names()))),
    params(("id" = Uuid, Path),
        EventsQuery, ("Last-Event-ID" = Option<i64>, Header, description = "Id of the last event that was received")),
    responses(
        (status = 200, description = "The stream of events", body = StudyStreamEvent, content_type = "text/event-stream"),
        (status = 204, description = "The client has received all events already, and no more will come"),
        (status = 400, description = "The header Last-Event-ID is not a number", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such study", body = Problem, content_type = "application/problem+json"),
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
    // subscribed before the study is read, so that no event is missed in between
    let changes = app.store.changes();
    let study = app.store.study(id).await?.ok_or_else(no_such_study)?;
    let jobs = StudyJobs { study: id, parts: parts(&study)? };
    let now = StudyNow::new(&jobs, &app.store.study_progress(id).await?);
    let newest = now.told.len() as i64;
    let last = last_heard(by_header, query.after)?;
    if now.status.is_final() && last == newest {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    // the client has an event that a power failure has lost: continue from the last event that there is, which is sent again
    let restarted = (last > newest).then(|| now.as_event(&jobs));
    let last = if restarted.is_some() { (newest - 1).max(0) } else { last };
    let news = match now.status.is_final() {
        // the stream sends the events that there are, and ends
        true => watch::channel(Arc::new(now)).1,
        false => WatchedStudies::watch(&app, jobs, now, changes),
    };
    // passes that were sent to other streams before are old
    let passes = news.borrow().pass.as_ref().map_or(0, |(number, _)| number + 1);
    let last = last.unsigned_abs() as usize;
    let feed = Feed { last, restarted, passes, news, shutdown: app.shutdown.clone(), _place: place };
    Ok(Sse::new(feed.into_stream()).keep_alive(KeepAlive::new().interval(HEARTBEAT)).into_response())
}

/// Stream of the events of a study.
struct Feed {
    /// Id of the last event that was sent.
    last: usize,
    /// Event `restarted`, sent first if events that were sent before are lost.
    restarted: Option<StudyEvent>,
    /// Number of the next pass to be sent.
    passes: u64,
    news: watch::Receiver<Arc<StudyNow>>,
    shutdown: CancellationToken,
    /// Place of this stream among those that may be open.
    _place: Place,
}

impl Feed {
    fn into_stream(self) -> impl Stream<Item = Result<SseEvent, Infallible>> {
        let first = stream::iter([Ok(SseEvent::default().retry(RETRY))]);
        let events = stream::unfold(self, |mut feed| async { Some((Ok(feed.next().await?), feed)) });
        stream::StreamExt::chain(first, events)
    }

    /// Returns the next event; `None` at the end of the stream.
    async fn next(&mut self) -> Option<SseEvent> {
        loop {
            if self.shutdown.is_cancelled() {
                return None;
            }
            if let Some(event) = self.untold() {
                return Some(event);
            }
            if self.news.borrow().status.is_final() {
                return None;
            }
            tokio::select! {
                () = self.shutdown.cancelled() => return None,
                changed = self.news.changed() => changed.ok()?,
            }
        }
    }

    fn untold(&mut self) -> Option<SseEvent> {
        if let Some(event) = self.restarted.take() {
            return Some(text(RESTARTED, &event).id(self.last.to_string()));
        }
        let now = self.news.borrow_and_update().clone();
        if let Some((name, event)) = now.told.get(self.last) {
            self.last += 1;
            return Some(text(name, event).id(self.last.to_string()));
        }
        let (number, event) = now.pass.as_ref().filter(|(number, _)| *number >= self.passes)?;
        self.passes = number + 1;
        Some(text(PASS, event))
    }
}

fn text(name: &str, event: &StudyEvent) -> SseEvent {
    // our own types always serialise
    let data = serde_json::to_string(event).unwrap_or_default();
    SseEvent::default().event(name).data(data)
}

//! Streams of events (server-sent events) of jobs and sets of jobs: missed ones are sent first, then new ones live. One reader sends the
//! new events of a job or set to all of its streams.

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

use crate::http::client::Client;
use crate::http::last_event_id::last_event_id;
use crate::http::places::Place;
use crate::http::problem::Problem;
use crate::http::watched::{News, SentEvent, Streams, Watched};
use crate::http::{App, Service};
use crate::queue::store::{Change, StoreError};

/// Number of events read at once, which bounds the memory of a stream that catches up.
pub const EVENTS_AT_ONCE: u32 = 64;

const HEARTBEAT: Duration = Duration::from_secs(15);
/// Time that a client waits after a lost connection before it comes back.
const RETRY: Duration = Duration::from_secs(3);

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct EventsQuery {
    /// Id of the event after which the stream begins; the header `Last-Event-ID` takes precedence.
    #[param(minimum = 0)]
    after: Option<i64>,
}

/// Job or set whose events are streamed.
pub trait EventSource: Sized + Send + Sync + 'static {
    /// Reads the job or set of an id as it is now.
    fn open(service: &Service, id: Uuid) -> impl Future<Output = Result<Self, Problem>> + Send;

    /// Returns the sources of this kind that have open streams.
    fn watched(service: &Service) -> &Watched<Self>;

    /// Returns the id of the newest event, and true if no event can come after it.
    fn newest(&self) -> (i64, bool);

    /// Creates the event for a client that has received more events than there are, which a power failure may have lost: the stream
    /// continues after the event `id`.
    fn restarted(&self, id: i64) -> SentEvent;

    /// Returns at most [`EVENTS_AT_ONCE`] events after an id, for a stream that has missed them.
    fn missed(&self, service: &Service, after: i64) -> impl Future<Output = Result<Vec<SentEvent>, StoreError>> + Send;

    /// Sends all events since it was opened to the streams, until no stream is open or no more events can come. `changes` began before
    /// that, so that nothing is missed in between.
    fn follow(
        &self,
        service: &Service,
        changes: broadcast::Receiver<Change>,
        streams: &Streams<'_, Self>,
    ) -> impl Future<Output = Result<(), StoreError>> + Send;
}

/// Answers a request for the events of the job or set of an id.
pub async fn answer<S: EventSource>(
    app: App,
    client: Client,
    id: Uuid,
    query: EventsQuery,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let by_header = last_event_id(headers).map_err(|error| Problem::bad_request(error.to_string()))?;
    let place = app.permits.streams.take(client)?;
    // subscribed before the source is read, so that no event is missed in between
    let changes = app.store.changes();
    let source = S::open(&app, id).await?;
    // an invalid parameter is an error even if the header takes precedence
    if let Some(after @ ..0) = query.after {
        let detail = format!("must be the id of an event, or 0, but is {after}");
        return Err(Problem::invalid_parameter("after", detail));
    }
    let last = by_header.or(query.after).unwrap_or(0);
    let (newest, is_final) = source.newest();
    if is_final && last == newest {
        return Ok(StatusCode::NO_CONTENT.into_response());
    }
    // a client may have an event that a power failure has lost: it continues with the last event that there is, which is sent again
    let before_newest = (newest - 1).max(0);
    let restarted = (last > newest).then(|| source.restarted(before_newest));
    let last = if restarted.is_some() { before_newest } else { last };
    let (source, news) = match is_final {
        true => (Arc::new(source), None),
        false => {
            let begin = |source, sender| drop(tokio::spawn(read(app.0.clone(), id, source, changes, sender)));
            let (source, news) = S::watched(&app).subscribe(id, source, begin);
            (source, Some(news))
        }
    };
    let read = restarted.into_iter().collect();
    let feed = Feed { app: app.0, source, last, news, read, missed: true, ended: false, _place: place };
    Ok(Sse::new(feed.into_stream()).keep_alive(KeepAlive::new().interval(HEARTBEAT)).into_response())
}

/// Sends all new events of a source to its streams, until no more can come or the service ends. The channel closes then, and after a panic.
async fn read<S: EventSource>(
    service: Arc<Service>,
    id: Uuid,
    source: Arc<S>,
    changes: broadcast::Receiver<Change>,
    sender: broadcast::Sender<Arc<News>>,
) {
    let streams = Streams { watched: S::watched(&service), id, sender };
    let ended = tokio::select! {
        () = service.shutdown.cancelled() => Ok(()),
        ended = source.follow(&service, changes, &streams) => ended,
    };
    if let Err(error) = ended {
        tracing::warn!(%error, %id, "reading events for streams failed");
    }
}

/// Stream of events: first those that were missed, then those that the reader sends.
struct Feed<S> {
    app: Arc<Service>,
    source: Arc<S>,
    /// Id of the last event that was sent.
    last: i64,
    /// Channel of new events; `None` once all that is left can be read.
    news: Option<broadcast::Receiver<Arc<News>>>,
    read: VecDeque<SentEvent>,
    /// True if there may be events after `last` that the reader will not send.
    missed: bool,
    ended: bool,
    /// Place of this stream among those that may be open.
    _place: Place,
}

impl<S: EventSource> Feed<S> {
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

    /// Returns the next event; `None` at the end of the stream.
    async fn next(&mut self) -> Result<Option<SentEvent>, StoreError> {
        loop {
            if let Some(event) = self.read.pop_front() {
                self.last = event.id.unwrap_or(self.last);
                self.ended = event.is_final;
                return Ok(Some(event));
            }
            if self.ended || self.app.shutdown.is_cancelled() {
                return Ok(None);
            }
            if self.missed {
                let events = self.source.missed(&self.app, self.last).await?;
                self.missed = events.len() >= EVENTS_AT_ONCE as usize;
                self.read = events.into();
                continue;
            }
            let Some(news) = &mut self.news else { return Ok(None) };
            let told = tokio::select! {
                () = self.app.shutdown.cancelled() => return Ok(None),
                told = news.recv() => told,
            };
            match told {
                Ok(news) if news.previous > self.last => self.missed = true,
                Ok(news) if news.event.id.is_none_or(|id| id > self.last) => self.read.push_back(news.event.clone()),
                Ok(_) => {}
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

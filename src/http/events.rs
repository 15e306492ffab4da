//! Stream of a job's events (server-sent events), replayed from the store and followed live.

use axum::http::HeaderMap;
use axum::response::Response;
use metrics::counter;
use tokio::sync::broadcast;
use uuid::Uuid;

use crate::http::client::Client;
use crate::http::event_schemas::{JobEvent, JobEvents, events as events_of_a_job, sent};
use crate::http::event_stream::{self, EVENTS_AT_ONCE, EventSource, EventsQuery};
use crate::http::problem::{Path, Problem, Query};
use crate::http::watched::{SentEvent, Streams, Watched};
use crate::http::{App, Service};
use crate::queue::events::{EventData, Restarted};
use crate::queue::store::{Change, StoreError};

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
        (status = 400, description = "The header Last-Event-ID is not a number"),
        (status = 404, description = "No such job"),
        (status = 422, description = "`after` is not a number, or is negative"),
        (status = 429, description = "This client has too many event streams open"),
        (status = 503, description = "The service has too many event streams open")))]
pub async fn events(
    app: App,
    client: Client,
    Path(id): Path<Uuid>,
    Query(query): Query<EventsQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    event_stream::answer::<JobEvents>(app, client, id, query, &headers).await
}

impl EventSource for JobEvents {
    async fn open(service: &Service, id: Uuid) -> Result<Self, Problem> {
        Ok(Self { head: service.store.job_head(id).await?.ok_or_else(Problem::no_such_job)? })
    }

    fn watched(service: &Service) -> &Watched<Self> {
        &service.watched
    }

    fn newest(&self) -> (i64, bool) {
        (self.head.last_seq, self.head.status.is_final())
    }

    fn restarted(&self, id: i64) -> SentEvent {
        let data = Restarted {
            from_pass: self.head.progress.passes + 1,
            reason: format!("the service lost the events after {}, although they had been sent", self.head.last_seq),
        };
        SentEvent::new(Some(id), Restarted::NAME, &data)
    }

    async fn missed(&self, service: &Service, after: i64) -> Result<Vec<SentEvent>, StoreError> {
        self.read(service, after, "stream").await
    }

    async fn follow(
        &self,
        service: &Service,
        mut changes: broadcast::Receiver<Change>,
        streams: &Streams<'_, Self>,
    ) -> Result<(), StoreError> {
        let (job, mut last) = (self.head.id, self.head.last_seq);
        loop {
            let is_gone = tokio::select! {
                change = changes.recv() => match change {
                    Ok(Change::Job(id)) if id == job => false,
                    Ok(Change::Stop(id)) if id == job => true,
                    Err(broadcast::error::RecvError::Lagged(_)) => true,
                    Err(broadcast::error::RecvError::Closed) => return Ok(()),
                    Ok(_) => continue,
                },
                () = streams.sender.closed() => false,
            };
            if !streams.is_watched() || self.pass_on(service, &mut last, streams).await? {
                return Ok(());
            }
            if is_gone && service.store.job_head(job).await?.is_none() {
                return Ok(());
            }
        }
    }
}

impl JobEvents {
    /// Sends all events after `last`; returns true after a final one.
    async fn pass_on(
        &self,
        service: &Service,
        last: &mut i64,
        streams: &Streams<'_, Self>,
    ) -> Result<bool, StoreError> {
        loop {
            let events = self.read(service, *last, "reader").await?;
            let may_be_more = events.len() >= EVENTS_AT_ONCE as usize;
            for event in events {
                let (previous, is_final) = (*last, event.is_final);
                *last = event.id.unwrap_or(previous);
                streams.tell(previous, event);
                if is_final {
                    return Ok(true);
                }
            }
            if !may_be_more {
                return Ok(false);
            }
        }
    }

    async fn read(&self, service: &Service, after: i64, by: &'static str) -> Result<Vec<SentEvent>, StoreError> {
        let events = service.store.events(self.head.id, after, EVENTS_AT_ONCE).await?;
        counter!("skyduct_event_reads_total", "by" => by).increment(1);
        Ok(events.iter().map(|event| sent(self.head.id, event)).collect())
    }
}

//! Stream of a study's events (server-sent events): starts, passes and ends of its jobs.

use std::collections::HashMap;
use std::time::Duration;

use axum::http::HeaderMap;
use axum::response::Response;
use serde_json::{Value, json};
use tokio::sync::broadcast;
use tokio::time::{Instant, sleep, sleep_until};
use utoipa::ToSchema;
use uuid::Uuid;

use super::looked::{no_such_study, parts};
use super::resource::StudyStatus;
use super::watched::{ENDED, PASS, RESTARTED, STARTED, StudyEvents};
use crate::http::client::Client;
use crate::http::event_stream::{self, EventSource, EventsQuery};
use crate::http::problem::{Path, Problem, Query};
use crate::http::watched::{SentEvent, Streams, Watched};
use crate::http::{App, Service};
use crate::queue::store::{Change, JobStatus, StoreError, StudyProgress};

/// Shortest time between two reads of a study.
const LOOK_PAUSE: Duration = Duration::from_millis(100);
/// Shortest time between two passes that are reported of a study.
const PASS_PAUSE: Duration = Duration::from_secs(1);

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
        (status = 400, description = "The header Last-Event-ID is not a number"),
        (status = 404, description = "No such study"),
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
    event_stream::answer::<StudyEvents>(app, client, id, query, &headers).await
}

impl EventSource for StudyEvents {
    async fn open(service: &Service, id: Uuid) -> Result<Self, Problem> {
        let study = service.store.study(id).await?.ok_or_else(no_such_study)?;
        let events = Self::new(id, parts(&study)?);
        events.take(&service.store.study_progress(id).await?);
        Ok(events)
    }

    fn watched(service: &Service) -> &Watched<Self> {
        &service.watched_studies
    }

    fn newest(&self) -> (i64, bool) {
        let (newest, status) = self.newest_with_status();
        (newest, status.is_final())
    }

    fn restarted(&self, id: i64) -> SentEvent {
        SentEvent::new(Some(id), RESTARTED, &self.as_event())
    }

    async fn missed(&self, _: &Service, after: i64) -> Result<Vec<SentEvent>, StoreError> {
        Ok(self.told_after(after, event_stream::EVENTS_AT_ONCE as usize))
    }

    async fn follow(
        &self,
        service: &Service,
        changes: broadcast::Receiver<Change>,
        streams: &Streams<'_, Self>,
    ) -> Result<(), StoreError> {
        let (passes, next_pass) = (HashMap::new(), Instant::now());
        Reader { service, events: self, streams, changes, passes, next_pass }.run().await
    }
}

/// Reader of a watched study: it reads the study's jobs when they change, and sends the news to all streams.
struct Reader<'a> {
    service: &'a Service,
    events: &'a StudyEvents,
    streams: &'a Streams<'a, StudyEvents>,
    changes: broadcast::Receiver<Change>,
    /// Numbers of passes of the jobs when a pass was reported last.
    passes: HashMap<Uuid, u64>,
    /// Time from which the next pass may be reported.
    next_pass: Instant,
}

impl Reader<'_> {
    async fn run(&mut self) -> Result<(), StoreError> {
        // jobs may have changed since the first stream read them
        let mut is_waiting = self.look(None).await?;
        while !self.events.newest().1 {
            let (next_pass, streams) = (self.next_pass, self.streams);
            let heard = tokio::select! {
                change = self.changes.recv() => match change {
                    Ok(Change::Job(id) | Change::Stop(id)) if self.events.part(id).is_some() => Some(id),
                    Err(broadcast::error::RecvError::Lagged(_)) => None,
                    Err(broadcast::error::RecvError::Closed) => return Ok(()),
                    Ok(_) => continue,
                },
                () = sleep_until(next_pass), if is_waiting => None,
                () = streams.sender.closed() => None,
            };
            if !streams.is_watched() || self.service.store.study(self.events.study).await?.is_none() {
                return Ok(());
            }
            is_waiting = self.look(heard).await?;
            sleep(LOOK_PAUSE).await;
        }
        Ok(())
    }

    /// Sends all news, with a pass if its time has come; true if a pass waits for that. `heard` is the job that has changed.
    async fn look(&mut self, heard: Option<Uuid>) -> Result<bool, StoreError> {
        let progress = self.service.store.study_progress(self.events.study).await?;
        let (before, _) = self.events.newest();
        for (previous, event) in (before..).zip(self.events.take(&progress)) {
            self.streams.tell(previous, event);
        }
        let moved = self.moved(&progress, heard);
        let may_tell = Instant::now() >= self.next_pass;
        if let Some(job) = moved.filter(|_| may_tell) {
            if let Some(pass) = self.events.pass(&progress, job) {
                self.streams.tell(self.events.newest().0, pass);
            }
            self.passes = progress.jobs.iter().map(|head| (head.id, head.progress.passes)).collect();
            self.next_pass = Instant::now() + PASS_PAUSE;
        }
        Ok(moved.is_some() && !may_tell)
    }

    /// Finds a running job with a pass that was not reported: the job `heard` if it has one, else the first one.
    fn moved(&self, progress: &StudyProgress, heard: Option<Uuid>) -> Option<Uuid> {
        let before = |id: &Uuid| self.passes.get(id).copied().unwrap_or(0);
        let mut moved = progress
            .jobs
            .iter()
            .filter(|head| head.status == JobStatus::Running && head.progress.passes > before(&head.id))
            .map(|head| head.id);
        let first = moved.clone().next();
        moved.find(|id| Some(*id) == heard).or(first)
    }
}

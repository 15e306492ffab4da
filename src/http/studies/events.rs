//! Stream of a study's events (server-sent events): starts, passes and ends of its jobs.

use axum::http::HeaderMap;
use axum::response::Response;
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::looked::parts;
use super::resource::StudyStatus;
use super::view::StudyView;
use crate::http::client::Client;
use crate::http::event_stream::{self, EventsQuery};
use crate::http::job_sets::followed::{FollowedView, names};
use crate::http::job_sets::set_events::SetEvents;
use crate::http::problem::{Path, Problem, Query};
use crate::http::watched::Watched;
use crate::http::{App, Service};
use crate::queue::store::{JobSet, SetKind};

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

#[derive(Serialize, ToSchema)]
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
    extensions(("x-events" = json!(names("StudyEvent", &[StudyStatus::Finished, StudyStatus::Failed, StudyStatus::Cancelled])))),
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
    event_stream::answer::<SetEvents<StudyView>>(app, client, id, query, &headers).await
}

impl FollowedView for StudyView {
    const KIND: SetKind = SetKind::Study;

    fn of(set: &JobSet) -> Result<Self, Problem> {
        Ok(Self::new(parts(set)?))
    }

    fn watched(service: &Service) -> &Watched<SetEvents<Self>> {
        &service.watched_studies
    }
}

//! Stream of the events of a set of jobs (server-sent events).

use axum::http::HeaderMap;
use axum::response::Response;
use utoipa::ToSchema;
use uuid::Uuid;

use super::followed::{FollowedView, names};
use super::resource::{JobSetStatus, JobsView};
use super::set_events::SetEvents;
use crate::http::client::Client;
use crate::http::event_stream::{self, EventsQuery};
use crate::http::problem::{Path, Problem, Query};
use crate::http::watched::Watched;
use crate::http::{App, Service};
use crate::queue::store::{JobSet, SetKind};

/// An event of the stream of a set of jobs.
#[derive(ToSchema)]
#[expect(dead_code, reason = "only its schema is used: the library for server-sent events writes them")]
pub struct JobSetStreamEvent {
    /// Number of the event: 1, 2, 3 ... without gaps. Sent back as `Last-Event-ID`, it makes the stream continue after it.
    /// `restarted` has the id after which the stream continues, which may be 0. Absent for `pass`.
    #[schema(pattern = "^(0|[1-9][0-9]*)$")]
    pub id: Option<String>,
    /// Name of the event.
    pub event: JobSetEventName,
    /// Data of the event: JSON of a `JobSetEvent`.
    pub data: String,
}

#[derive(serde::Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
#[expect(dead_code, reason = "only its schema is used: each kind of event has its own name")]
pub enum JobSetEventName {
    Started,
    Pass,
    Ended,
    Restarted,
    Finished,
}

/// Streams the events of the set.
///
/// `started` and `ended` report each of its jobs, `pass` the job that is at work, about once a second at most, and `finished` the
/// set: this event ends the stream. Ids, `Last-Event-ID`, `restarted` and the comments are those of the events of a study.
#[utoipa::path(get, path = "/v1/job_sets/{id}/events", operation_id = "get_job_set_events", tag = "job sets",
    extensions(("x-events" = json!(names("JobSetEvent", &[JobSetStatus::Finished])))),
    params(("id" = Uuid, Path),
        EventsQuery, ("Last-Event-ID" = Option<i64>, Header, description = "Id of the last event that was received")),
    responses(
        (status = 200, description = "The stream of events", body = JobSetStreamEvent, content_type = "text/event-stream"),
        (status = 204, description = "The client has received all events already, and no more will come"),
        (status = 400, description = "The header Last-Event-ID is not a number"),
        (status = 404, description = "No such set of jobs"),
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
    event_stream::answer::<SetEvents<JobsView>>(app, client, id, query, &headers).await
}

impl FollowedView for JobsView {
    const KIND: SetKind = SetKind::Jobs;

    fn of(_: &JobSet) -> Result<Self, Problem> {
        Ok(Self)
    }

    fn watched(service: &Service) -> &Watched<SetEvents<Self>> {
        &service.watched_sets
    }
}

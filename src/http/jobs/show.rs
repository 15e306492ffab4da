//! Reading of jobs, one or many.

use axum::Json;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use super::resource::{JobResource, JobSummary};
use crate::http::problem::{Path, Problem, Query};
use crate::http::query_faults::up_to;
use crate::http::{App, content};
use crate::queue::store::*;

const DEFAULT_PAGE: u32 = 50;
const MAX_PAGE: u32 = 500;

/// A page of jobs, newest first.
#[derive(Serialize, ToSchema)]
pub struct JobPage {
    pub jobs: Vec<JobSummary>,
    /// Value of `cursor` for the next page; null on the last one.
    pub next_cursor: Option<Uuid>,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct ListQuery {
    /// Status of the jobs to list; all when absent.
    #[param(inline)]
    status: Option<JobStatus>,
    /// Largest number of jobs on a page; 50 when absent.
    #[param(minimum = 1, maximum = 500)]
    #[serde(default, deserialize_with = "up_to::<_, MAX_PAGE>")]
    limit: Option<u32>,
    /// Value of `next_cursor` of the page before.
    cursor: Option<Uuid>,
}

/// Lists jobs, newest first.
#[utoipa::path(get, path = "/v1/jobs", operation_id = "list_jobs", tag = "jobs", params(ListQuery),
    responses(
        (status = 200, description = "A page of jobs", body = JobPage),
        (status = 422, description = "A parameter is not valid; see `errors`")))]
pub async fn list(app: App, Query(query): Query<ListQuery>) -> Result<Json<JobPage>, Problem> {
    let limit = query.limit.unwrap_or(DEFAULT_PAGE);
    // one more tells whether there is a next page
    let filter = JobFilter { status: query.status, before: query.cursor, limit: limit + 1 };
    let mut heads = app.store.jobs(filter).await?;
    let more = heads.len() > limit as usize;
    heads.truncate(limit as usize);
    let next_cursor = heads.last().filter(|_| more).map(|head| head.id);
    Ok(Json(JobPage { jobs: heads.iter().map(JobSummary::new).collect(), next_cursor }))
}

/// Returns the job.
#[utoipa::path(get, path = "/v1/jobs/{id}", operation_id = "get_job", tag = "jobs", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The job", body = JobResource),
        (status = 304, description = "Not modified: nothing has changed since the ETag in If-None-Match"),
        (status = 404, description = "No such job")))]
pub async fn get(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    let tag =
        format!("W/\"{}-{}-{}\"", job.head.last_seq, job.head.progress.passes, u8::from(job.head.cancel_requested));
    let fresh = content::none_match(&headers, &tag);
    let tag = HeaderValue::try_from(tag).map_err(|_| Problem::internal())?;
    let headers = [(header::ETAG, tag), (header::CACHE_CONTROL, HeaderValue::from_static("no-cache"))];
    Ok(if fresh {
        (StatusCode::NOT_MODIFIED, headers).into_response()
    } else {
        (headers, Json(JobResource::new(job))).into_response()
    })
}

//! Reading of sets of jobs, one or many.

use axum::Json;
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::any_kind::{PageQuery, heads_of, page, set_of};
use super::resource::{JobSetResource, JobSetSummary};
use crate::http::App;
use crate::http::problem::{Path, Problem, Query};
use crate::queue::store::SetKind;

/// A page of sets of jobs, newest first.
#[derive(Serialize, ToSchema)]
pub struct JobSetPage {
    pub job_sets: Vec<JobSetSummary>,
    /// Value of `cursor` for the next page; null on the last one.
    pub next_cursor: Option<Uuid>,
}

/// Lists sets of jobs, newest first; those of studies are listed as studies.
#[utoipa::path(get, path = "/v1/job_sets", operation_id = "list_job_sets", tag = "job sets", params(PageQuery),
    responses(
        (status = 200, description = "A page of sets of jobs", body = JobSetPage),
        (status = 422, description = "A parameter is not valid; see `errors`")))]
pub async fn list(app: App, Query(query): Query<PageQuery>) -> Result<Json<JobSetPage>, Problem> {
    let (sets, next_cursor) = page(&app, SetKind::Jobs, query).await?;
    let mut job_sets = Vec::with_capacity(sets.len());
    for set in sets {
        job_sets.push(JobSetSummary::new(&set, &heads_of(&app, set.id).await?));
    }
    Ok(Json(JobSetPage { job_sets, next_cursor }))
}

/// Returns the set with the state of each of its jobs.
#[utoipa::path(get, path = "/v1/job_sets/{id}", operation_id = "get_job_set", tag = "job sets", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The set of jobs", body = JobSetResource),
        (status = 404, description = "No such set of jobs")))]
pub async fn get(app: App, Path(id): Path<Uuid>) -> Result<Json<JobSetResource>, Problem> {
    let set = set_of(&app, SetKind::Jobs, id).await?;
    Ok(Json(JobSetResource::new(&set, &heads_of(&app, id).await?)))
}

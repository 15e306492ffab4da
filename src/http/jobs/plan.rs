//! What a document would do, without a job.

use axum::Json;
use axum::extract::rejection::BytesRejection;
use axum::http::HeaderMap;
use bytes::Bytes;
use serde::Serialize;
use serde_json::Value;
use utoipa::ToSchema;

use super::posted::{Posted, prepare};
use crate::document::result::{Known, PlanResult};
use crate::document::{JobDocument, Warning};
use crate::http::App;
use crate::http::problem::Problem;

/// What a document would do.
#[derive(Serialize, ToSchema)]
pub struct PlanResource {
    /// The document as understood, all defaults filled in.
    #[schema(value_type = JobDocument)]
    pub document: Value,
    /// What would be simulated and what would not, and why.
    pub plan: PlanResult,
    pub warnings: Vec<Warning>,
    #[serde(flatten)]
    pub known: Known,
}

/// What a document would simulate and what not, and why; queues nothing.
#[utoipa::path(post, path = "/v1/plan", operation_id = "plan_job", tag = "jobs",
    request_body(content = JobDocument, description = "The job document", content_type = "application/json"),
    responses(
        (status = 200, description = "The plan", body = PlanResource),
        (status = 400, description = "Not JSON", body = Problem, content_type = "application/problem+json"),
        (status = 413, description = "Too long", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "Not application/json", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "Not a valid document", body = Problem, content_type = "application/problem+json")))]
pub async fn plan(
    app: App,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
) -> Result<Json<PlanResource>, Problem> {
    let posted = Posted::read(&headers, body)?;
    let (prepared, _) = prepare(&app, posted.value).await?;
    let (plan, known) = (PlanResult::from(&prepared.plan), prepared.known());
    Ok(Json(PlanResource { document: prepared.document, plan, warnings: prepared.warnings, known }))
}

//! Plan of a document, and predictions of the time that each method would take, without a job.

use std::sync::Arc;

use axum::Json;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::{IntoParams, ToSchema};

use super::posted::{Body, prepare};
use crate::document::result::{Known, PlanResult};
use crate::document::{JobDocument, Warning};
use crate::http::App;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Problem, Query};
use crate::http::turns::Line;
use crate::predict::pilot;
use crate::predict::predictions::Predictions;
use crate::present::prepared::Prepared;

/// Plan of a document.
#[derive(Serialize, ToSchema)]
pub struct PlanResource {
    /// The document as understood, all defaults filled in.
    #[schema(value_type = JobDocument)]
    pub document: Value,
    /// Plan: what would be simulated and what would not, with reasons.
    pub plan: PlanResult,
    pub warnings: Vec<Warning>,
    #[serde(flatten)]
    pub known: Known,
    /// Predictions of the time that each method would take; with `predict` only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub predictions: Option<Predictions>,
}

/// Option to predict by a pilot the time that a job would take.
#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct PredictQuery {
    /// True to try every method for a moment, less than 0.2 s of each processor beside the set-up of the planned one, and to predict its
    /// time to relative errors of 10, 5, 2, 1, 0.5 and 0.1 percent; false when absent.
    #[serde(default)]
    #[param(inline)]
    predict: bool,
}

impl PredictQuery {
    /// Predicts the time that each method would take, if the query requests it; `pilots` is the line of pilots.
    pub async fn predictions(
        &self,
        pilots: &Arc<Line>,
        prepared: &Arc<Prepared>,
    ) -> Result<Option<Predictions>, Problem> {
        if !self.predict {
            return Ok(None);
        }
        // one at a time: each takes all threads
        let (turn, prepared) = (permit(pilots).await?, prepared.clone());
        Ok(Some(off_thread(turn, move |cancel| pilot::predict(&prepared, &cancel)).await?))
    }
}

/// Plans a document: what would be simulated, what not, and why, and with `predict` the time that it would take; queues nothing.
#[utoipa::path(post, path = "/v1/plan", operation_id = "plan_job", tag = "jobs", params(PredictQuery),
    request_body(content = JobDocument, description = "The job document", content_type = "application/json"),
    responses(
        (status = 200, description = "The plan", body = PlanResource),
        (status = 400, description = "The body is not JSON"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not application/json"),
        (status = 422, description = "The document or a parameter is not valid; see `errors`")))]
pub async fn plan(app: App, Query(query): Query<PredictQuery>, body: Body) -> Result<Json<PlanResource>, Problem> {
    // kept to the end: a plan that waits for its pilot takes as much memory as one that is being prepared
    let turn = permit(&app.permits.plans).await?;
    let posted = body.read(&turn).await?;
    let prepared = prepare(&app, &turn, posted.value).await?.prepared;
    let (plan, known) = (PlanResult::from(&prepared.plan), prepared.known());
    let (document, warnings) = (prepared.document.clone(), prepared.warnings.clone());
    let predictions = query.predictions(&app.permits.pilots_of_plans, &prepared).await?;
    Ok(Json(PlanResource { document, plan, warnings, known, predictions }))
}

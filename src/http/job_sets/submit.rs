//! Queueing of a set of jobs.

use axum::http::HeaderMap;
use axum::response::Response;
use serde_json::Value;

use super::any_kind::{self, accepted, heads_of};
use super::request::JobSetRequest;
use super::resource::JobSetResource;
use crate::http::App;
use crate::http::client::Client;
use crate::http::jobs::posted::Body;
use crate::http::problem::Problem;
use crate::queue::store::{SetBounds, SetKind};

/// Queues a set of jobs, all of them or none.
///
/// They are jobs like all others, and take turns with the jobs that have begun, so that a job that is posted alone need not wait for
/// a set. Fields that the documents have in common are stored once. The body has the same limit of bytes as that of a job.
/// `Idempotency-Key` makes a repeated post answer with the first set; a job or a study may have the same key.
#[utoipa::path(post, path = "/v1/job_sets", operation_id = "create_job_set", tag = "job sets",
    params(("Idempotency-Key" = Option<String>, Header, description = "Unique to this set: 1 to 255 printable ASCII characters",
        min_length = 1, max_length = 255, pattern = "^[ -~]+$")),
    request_body(content = JobSetRequest, description = "The documents of the jobs", content_type = "application/json",
        example = json!({
            "name": "a desk in spring and in summer",
            "jobs": [example("2025-03-21T12:00:00+01:00"), example("2025-06-21T12:00:00+02:00")]
        })),
    responses(
        (status = 202, description = "Queued; the body is the set", body = JobSetResource,
            headers(("Location" = String, description = "Path of the set"),
                ("Retry-After" = u32, description = "Seconds to wait before asking for it"),
                ("Idempotency-Replayed" = bool, description = "`true` if the set is that of an earlier post with \
                                                               this key; otherwise absent"))),
        (status = 400, description = "The body is not JSON"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not application/json"),
        (status = 422, description = "The request or one of its documents is not valid, or the key was used with another one"),
        (status = 429, description = "The jobs of the set would exceed the client's limit of waiting jobs"),
        (status = 503, description = "The queue has no room for all jobs of the set")))]
pub async fn create(app: App, client: Client, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let new = |request, files: &_, bounds: &SetBounds| {
        JobSetRequest::from_value(request, bounds.most)?.prepared(files, bounds)
    };
    let (set, is_replayed) = any_kind::post(&app, SetKind::Jobs, (client, &headers, body), new).await?;
    let heads = heads_of(&app, set.id).await?;
    Ok(accepted(format!("/v1/job_sets/{}", set.id), is_replayed, &JobSetResource::new(&set, &heads)))
}

/// Returns the document of a small job at a time, for the description.
fn example(time: &str) -> Value {
    serde_json::json!({
        "location": { "latitude_deg": 52.5, "longitude_deg": 13.4 },
        "time": time,
        "room": { "size_m": [4, 3, 2.5] },
        "tubes": [{ "centre_m": [2, 1.5], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
                    "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.7 } }],
        "sky": { "cie_type": 1 },
        "grids": [{ "name": "desk", "height_m": 0.75, "cells": [8, 6] }]
    })
}

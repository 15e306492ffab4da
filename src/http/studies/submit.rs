//! Queueing of a study: a job for its reference, and one for each method, error and seed.

use axum::http::HeaderMap;
use axum::response::Response;

use super::evaluate::study_resource;
use super::looked::Looked;
use super::resource::StudyResource;
use crate::http::App;
use crate::http::client::Client;
use crate::http::job_sets::any_kind::{self, accepted};
use crate::http::jobs::posted::Body;
use crate::http::problem::Problem;
use crate::queue::store::{SetBounds, SetKind};
use crate::queue::uploaded_files::UploadedFiles;
use crate::study::StudyRequest;
use crate::study::queued::new_study;

/// Queues a study: the cost of accuracy by several methods on one job.
///
/// Its jobs are jobs like all others: a reference, and one for each method, relative error and seed; with `pictures` another
/// reference, and one for each method and time and for each accuracy; at most 200 in all, and not more than a client may have waiting
/// here. They take turns with the jobs that have
/// begun, so that new jobs need not wait for a study. `Idempotency-Key` makes a repeated post answer with the first study; a job
/// may have the same key.
#[utoipa::path(post, path = "/v1/studies", operation_id = "create_study", tag = "studies",
    params(("Idempotency-Key" = Option<String>, Header, description = "Unique to this study: 1 to 255 printable ASCII characters",
        min_length = 1, max_length = 255, pattern = "^[ -~]+$")),
    request_body(content = StudyRequest, description = "The job, and the methods, errors and seeds with which to \
                                                        compute it", content_type = "application/json",
        example = json!({
            "job": {
                "room": { "size_m": [4, 3, 2.5] },
                "tubes": [{ "centre_m": [2, 1.5], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
                            "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.7 } }],
                "sky": { "cie_type": 1, "sun_position": { "altitude_deg": 40, "azimuth_deg": 180 } },
                "grids": [{ "name": "desk", "height_m": 0.75, "cells": [8, 6] }]
            },
            "methods": ["auto", "path_tracing"], "relative_errors": [0.05, 0.02], "seeds": 3
        })),
    responses(
        (status = 202, description = "Queued; the body is the study", body = StudyResource,
            headers(("Location" = String, description = "Path of the study"),
                ("Retry-After" = u32, description = "Seconds to wait before asking for it"),
                ("Idempotency-Replayed" = bool, description = "`true` if the study is that of an earlier post with \
                                                               this key; otherwise absent"))),
        (status = 400, description = "The body is not JSON"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not application/json"),
        (status = 422, description = "The request is not valid, or the key was used with another one"),
        (status = 429, description = "The jobs of the study would exceed the client's limit of waiting jobs"),
        (status = 503, description = "The queue has no room for all jobs of the study")))]
pub async fn create(app: App, client: Client, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let new = |request, files: &UploadedFiles, bounds: &SetBounds| {
        let request = StudyRequest::from_value(request, files)?.within(bounds.most_seconds)?;
        new_study(request, files, bounds)
    };
    let (study, is_replayed) = any_kind::post(&app, SetKind::Study, (client, &headers, body), new).await?;
    let path = format!("/v1/studies/{}", study.id);
    Ok(accepted(path, is_replayed, &study_resource(&app, Looked::new(&app, study).await?).await?))
}

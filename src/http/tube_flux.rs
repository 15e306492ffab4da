//! Luminous flux that a tube sends into a room under many skies, computed within one request and without a job.

use std::time::Instant;

use axum::{Extension, Json};

use crate::document::result::TubeFluxResult;
use crate::document::tube_flux::TubeFluxDocument;
use crate::http::App;
use crate::http::in_time::Deadline;
use crate::http::jobs::posted::Body;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::present::tube_flux::{TimeThereIs, TubeFluxError, tube_flux};

/// Fraction of its time limit that a request waits for a turn at the most, and fraction that the computation may take.
const WAITING: f64 = 0.5;
const COMPUTING: f64 = 0.95;

/// Computes the luminous flux of a tube into a room by patches of its opening, of sky and sun apart, for every sky and time.
#[utoipa::path(post, path = "/v1/tubes/flux", operation_id = "get_tube_flux", tag = "tubes",
    request_body(content = TubeFluxDocument, description = "The tube, the skies and the times",
        content_type = "application/json", example = json!({
            "tube": {
                "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
                "collector": { "kind": "dome", "transmittance": 0.92 },
                "diffuser": { "kind": "lambertian", "transmittance": 0.7, "reflectance": 0.1 }
            },
            "location": { "latitude_deg": 55.77, "longitude_deg": 12.5 },
            "skies": [{ "cie_type": 1 }, { "cie_type": 12 }],
            "times": ["2026-06-21T09:00:00+02:00", "2026-06-21T13:00:00+02:00"]
        })),
    responses(
        (status = 200, description = "The fluxes", body = TubeFluxResult),
        (status = 400, description = "The body is not JSON"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not application/json"),
        (status = 422, description = "The request is not valid, or would take longer than allowed; see `errors`")))]
pub async fn flux(
    app: App,
    Extension(deadline): Extension<Deadline>,
    body: Body,
) -> Result<Json<TubeFluxResult>, Problem> {
    let busy = || Problem::unavailable("the service is busy computing other fluxes; try again later");
    let turn = tokio::time::timeout(deadline.all.mul_f64(WAITING), permit(&app.permits.fluxes));
    let turn = turn.await.map_err(|_| busy())??;
    let posted = body.read(&turn).await?;
    let (uploads, runtime) = (app.uploads.clone(), tokio::runtime::Handle::current());
    let left = deadline.at.saturating_duration_since(tokio::time::Instant::now());
    let time =
        TimeThereIs { until: Instant::now() + left.mul_f64(COMPUTING), at_best: deadline.all.mul_f64(COMPUTING) };
    let found = off_thread(turn, move |cancel| {
        let meshes = uploads.for_document(runtime, cancel.clone());
        tube_flux(&TubeFluxDocument::from_value(posted.value)?, &meshes, Some(time), &cancel)
    });
    found.await?.map(Json).map_err(|error| match error {
        TubeFluxError::Request(errors) => errors.into(),
        TubeFluxError::NoTimeNow => busy(),
        TubeFluxError::NotFinite { .. } => Problem::failed("computing the fluxes of a tube failed", &error),
    })
}

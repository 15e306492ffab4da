//! Health of the service: whether it lives, whether it is ready, and its metrics.

use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use metrics::gauge;
use metrics_process::Collector;

use crate::http::App;
use crate::http::problem::Problem;
use crate::queue::store::JobStatus;

/// Answers as long as the process lives; checks nothing else.
#[utoipa::path(get, path = "/livez", operation_id = "livez", tag = "operation",
    responses((status = 200, description = "The process is running", body = String, content_type = "text/plain")))]
pub async fn livez() -> &'static str {
    "ok\n"
}

/// Checks that the service can take jobs: it can write to its stores, there is space on the disk, and it is not shutting down.
///
/// The results of the checks of stores and disk are valid for up to 5 seconds.
#[utoipa::path(get, path = "/readyz", operation_id = "readyz", tag = "operation",
    responses(
        (status = 200, description = "The service is ready", body = String, content_type = "text/plain"),
        (status = 503, description = "The service is not ready; the detail says why")))]
pub async fn readyz(app: App) -> Result<&'static str, Problem> {
    if app.shutdown.is_cancelled() {
        return Err(Problem::unavailable("the service is shutting down"));
    }
    let looked = app.readiness.look(app.store.as_ref(), &app.artifacts, app.limits.free_bytes);
    looked.await.map_err(Problem::unavailable)?;
    Ok("ready\n")
}

/// Returns metrics for Prometheus.
#[utoipa::path(get, path = "/metrics", operation_id = "metrics", tag = "operation",
    responses((status = 200, description = "Metrics in the text format of Prometheus", body = String, content_type = "text/plain")))]
pub async fn metrics(app: App) -> Result<impl IntoResponse, Problem> {
    for status in [JobStatus::Queued, JobStatus::Running] {
        gauge!("skyduct_jobs", "status" => status.name()).set(app.store.count(status).await? as f64);
    }
    gauge!("skyduct_event_streams").set(app.permits.streams.taken() as f64);
    gauge!("skyduct_waits").set(app.permits.waits.taken() as f64);
    gauge!("skyduct_uploads").set(app.permits.uploads.taken() as f64);
    gauge!("skyduct_body_bytes").set(app.permits.bodies.taken() as f64);
    gauge!("skyduct_watched_jobs").set(app.watched.count() as f64);
    gauge!("skyduct_watched_job_sets").set(app.watched_sets.count() as f64);
    gauge!("skyduct_watched_studies").set(app.watched_studies.count() as f64);
    gauge!("skyduct_stored_bytes").set(app.store.stored_bytes().await? as f64);
    if let Ok(free) = app.artifacts.free_bytes() {
        gauge!("skyduct_disk_free_bytes").set(free as f64);
    }
    Collector::default().collect();
    app.metrics.run_upkeep();
    Ok((StatusCode::OK, [(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], app.metrics.render()))
}

//! Whether the service lives, whether it is ready, and its numbers.

use std::time::{Duration, Instant};

use axum::http::{StatusCode, header};
use axum::response::IntoResponse;
use metrics::gauge;
use tokio::sync::Mutex;

use crate::http::problem::Problem;
use crate::http::{App, Service};
use crate::job::store::JobStatus;

/// The process lives; asks nothing else.
#[utoipa::path(get, path = "/livez", operation_id = "livez", tag = "operation",
    responses((status = 200, description = "It lives", body = String, content_type = "text/plain")))]
pub async fn livez() -> &'static str {
    "ok\n"
}

/// Time for which a look at whether the service can write is good.
const LOOK_AGAIN: Duration = Duration::from_secs(5);
/// Time for which a look is good that found that the service cannot write.
const LOOK_AGAIN_AFTER_TROUBLE: Duration = Duration::from_secs(1);

/// The last look at whether the service can write; whoever asks at the same time shares it.
#[derive(Default)]
pub struct Readiness {
    last: Mutex<Option<(Instant, Result<(), String>)>>,
}

impl Readiness {
    async fn look(&self, app: &Service) -> Result<(), String> {
        let mut last = self.last.lock().await;
        if let Some((when, found)) = last.as_ref() {
            let good_for = if found.is_ok() { LOOK_AGAIN } else { LOOK_AGAIN_AFTER_TROUBLE };
            if when.elapsed() < good_for {
                return found.clone();
            }
        }
        let found = try_to_write(app).await;
        *last = Some((Instant::now(), found.clone()));
        found
    }
}

/// Writes to both stores; the reason why that does not work, without the machine's paths.
async fn try_to_write(app: &Service) -> Result<(), String> {
    let (free, least) = (app.artifacts.free_bytes(), app.limits.free_bytes);
    match free {
        Ok(free) if free < least => {
            tracing::error!(free, least, "not ready: the disk is nearly full");
            return Err(format!("the disk is nearly full: {} MB are free, {} MB are needed", free >> 20, least >> 20));
        }
        Ok(_) => {}
        Err(error) => tracing::warn!(%error, "the free space of the disk is not known"),
    }
    app.store.ready().await.map_err(|error| {
        tracing::error!(%error, "not ready");
        "the database cannot be written to".to_owned()
    })?;
    app.artifacts.ready().await.map_err(|error| {
        tracing::error!(%error, "not ready");
        "artifacts cannot be written".to_owned()
    })
}

/// The service can take jobs: it can write to its stores, there is space on the disk, and it is not shutting down.
///
/// What is written is looked at anew every 5 seconds at most.
#[utoipa::path(get, path = "/readyz", operation_id = "readyz", tag = "operation",
    responses(
        (status = 200, description = "It is ready", body = String, content_type = "text/plain"),
        (status = 503, description = "It is not, and why", body = Problem, content_type = "application/problem+json")))]
pub async fn readyz(app: App) -> Result<&'static str, Problem> {
    if app.shutdown.is_cancelled() {
        return Err(Problem::unavailable("the service is shutting down"));
    }
    app.readiness.look(&app).await.map_err(Problem::unavailable)?;
    Ok("ready\n")
}

/// Numbers for Prometheus.
#[utoipa::path(get, path = "/metrics", operation_id = "metrics", tag = "operation",
    responses((status = 200, description = "In the text format of Prometheus", body = String, content_type = "text/plain")))]
pub async fn metrics(app: App) -> Result<impl IntoResponse, Problem> {
    for status in [JobStatus::Queued, JobStatus::Running] {
        gauge!("skyduct_jobs", "status" => status.name()).set(app.store.count(status).await? as f64);
    }
    gauge!("skyduct_event_streams")
        .set(app.limits.streams.saturating_sub(app.permits.streams.available_permits()) as f64);
    gauge!("skyduct_watched_jobs").set(app.watched.count() as f64);
    app.metrics.run_upkeep();
    Ok((StatusCode::OK, [(header::CONTENT_TYPE, "text/plain; version=0.0.4; charset=utf-8")], app.metrics.render()))
}

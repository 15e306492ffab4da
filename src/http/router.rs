//! Paths, and the layers around all of them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::Router;
use axum::extract::{DefaultBodyLimit, MatchedPath, Request};
use axum::http::{HeaderName, HeaderValue, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::Response;
use axum::routing::get;
use metrics::{counter, histogram};
use tower::ServiceBuilder;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::compression::CompressionLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::timeout::TimeoutLayer;
use tower_http::trace::TraceLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::problem::as_problem_documents;
use crate::http::{Limits, Service, events, health, jobs, meshes, openapi, results, skies, tubes};

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// The described paths, with defaults for limits: what `openapi.yaml` is made of.
pub fn api() -> OpenApiRouter<Arc<Service>> {
    api_with_mesh_limit(0)
}

fn api_with_mesh_limit(mesh_bytes: usize) -> OpenApiRouter<Arc<Service>> {
    // made anew for each request and worth compressing; results and event streams are not
    let texts = OpenApiRouter::new()
        .routes(routes!(jobs::list, jobs::create))
        .routes(routes!(jobs::plan))
        .routes(routes!(jobs::get, jobs::delete))
        .routes(routes!(jobs::cancel))
        .routes(routes!(meshes::get, meshes::delete))
        .routes(routes!(skies::skies))
        .routes(routes!(tubes::transmission))
        .routes(routes!(openapi::openapi_yaml))
        .layer(CompressionLayer::new());
    let uploads = OpenApiRouter::new().routes(routes!(meshes::create)).layer(DefaultBodyLimit::max(mesh_bytes));
    OpenApiRouter::with_openapi(openapi::Description::openapi())
        .merge(texts)
        .merge(uploads)
        .routes(routes!(events::events))
        .routes(routes!(results::grid))
        .routes(routes!(results::view))
        .routes(routes!(results::tube))
        .routes(routes!(results::convergence))
        .routes(routes!(results::convergence_svg))
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(health::metrics))
}

/// The whole service.
pub fn router(service: Arc<Service>) -> Router {
    let Limits { document_bytes, mesh_bytes, request_seconds, .. } = service.limits;
    let (api, _) = api_with_mesh_limit(mesh_bytes).split_for_parts();
    let around_all = ServiceBuilder::new()
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
        .layer(TraceLayer::new_for_http().make_span_with(span))
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(SetResponseHeaderLayer::overriding(header::X_CONTENT_TYPE_OPTIONS, HeaderValue::from_static("nosniff")))
        .layer(middleware::from_fn(as_problem_documents))
        .layer(CatchPanicLayer::new())
        // of event streams this is the time until they begin
        .layer(TimeoutLayer::with_status_code(StatusCode::REQUEST_TIMEOUT, Duration::from_secs(request_seconds)));
    api.route("/docs", get(openapi::docs))
        .route("/docs/", get(openapi::docs_index))
        .route("/docs/{*file}", get(openapi::docs_file))
        .layer(DefaultBodyLimit::max(document_bytes))
        .layer(middleware::from_fn(measure))
        .layer(around_all)
        .with_state(service)
}

fn span(request: &Request) -> tracing::Span {
    let id = request.headers().get(REQUEST_ID).and_then(|id| id.to_str().ok()).unwrap_or("");
    tracing::info_span!("request", method = %request.method(), path = request.uri().path(), id)
}

async fn measure(request: Request, next: Next) -> Response {
    let start = Instant::now();
    let method = request.method().as_str().to_owned();
    // the pattern, not the path: ids would make a series each
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let response = next.run(request).await;
    let status = response.status().as_u16().to_string();
    counter!("skyduct_http_requests_total", "method" => method, "route" => route.clone(), "status" => status)
        .increment(1);
    histogram!("skyduct_http_request_seconds", "route" => route).record(start.elapsed().as_secs_f64());
    response
}

//! Routes of the service, and the layers around all of them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::{DefaultBodyLimit, MatchedPath, Request};
use axum::http::{HeaderName, HeaderValue, Method, StatusCode, header};
use axum::middleware::{self, Next};
use axum::response::Response;
use axum::routing::get;
use axum::{Extension, Router};
use metrics::{counter, histogram};
use tower::ServiceBuilder;
use tower_http::catch_panic::CatchPanicLayer;
use tower_http::classify::ServerErrorsFailureClass;
use tower_http::compression::CompressionLayer;
use tower_http::request_id::{MakeRequestUuid, PropagateRequestIdLayer, SetRequestIdLayer};
use tower_http::set_header::SetResponseHeaderLayer;
use tower_http::trace::TraceLayer;
use utoipa::OpenApi;
use utoipa_axum::router::OpenApiRouter;
use utoipa_axum::routes;

use crate::http::access::check_access;
use crate::http::description::{Description, completed};
use crate::http::in_time::answer_in_time;
use crate::http::parameters::{QueryParameters, refuse_unknown};
use crate::http::problem::as_problem_documents;
use crate::http::server::answer_health_only_beyond;
use crate::http::turns::answer_for;
use crate::http::{
    Shared, annual, arrays, convergence, docs, events, figures, grids, health, job_sets, jobs, meshes, models, page,
    problem_page, report, results, skies, studies, surfaces, time_zone, tube_flux, tubes, views, weather,
};

const REQUEST_ID: HeaderName = HeaderName::from_static("x-request-id");

/// Returns the described routes without real limits, from which `openapi.yaml` is made.
pub fn api() -> OpenApiRouter<Arc<Shared>> {
    // made anew for each request and worth compressing; results and event streams are not
    let texts = OpenApiRouter::new()
        .routes(routes!(jobs::show::list, jobs::submit::create, jobs::change::delete_many))
        .routes(routes!(jobs::plan::plan))
        .routes(routes!(jobs::show::get, jobs::change::delete))
        .routes(routes!(jobs::change::cancel))
        .routes(routes!(job_sets::show::list, job_sets::submit::create))
        .routes(routes!(job_sets::show::get, job_sets::change::delete))
        .routes(routes!(job_sets::change::cancel))
        .routes(routes!(studies::show::list, studies::submit::create))
        .routes(routes!(studies::show::get, studies::change::delete))
        .routes(routes!(studies::change::cancel))
        .routes(routes!(meshes::get, meshes::delete))
        .routes(routes!(weather::get, weather::delete))
        .routes(routes!(arrays::get, arrays::delete))
        .routes(routes!(models::get, models::delete))
        .routes(routes!(skies::skies))
        .routes(routes!(time_zone::time_zone))
        .routes(routes!(tubes::transmission))
        .routes(routes!(tube_flux::flux))
        .routes(routes!(docs::openapi_yaml))
        .layer(CompressionLayer::new());
    let uploads = OpenApiRouter::new()
        .routes(routes!(meshes::create))
        .routes(routes!(weather::create))
        .routes(routes!(models::create))
        .routes(routes!(arrays::create));
    let others = OpenApiRouter::new()
        .merge(texts)
        .routes(routes!(events::events))
        .routes(routes!(grids::grid))
        .routes(routes!(figures::figure))
        .routes(routes!(job_sets::events::events))
        .routes(routes!(studies::events::events))
        .routes(routes!(studies::show::file))
        .routes(routes!(views::view))
        .routes(routes!(results::tube))
        .routes(routes!(annual::annual))
        .routes(routes!(annual::file))
        .routes(routes!(annual::hours))
        .routes(routes!(annual::honeybee))
        .routes(routes!(annual::honeybee_grid))
        .routes(routes!(convergence::convergence))
        .routes(routes!(convergence::convergence_json))
        .routes(routes!(convergence::convergence_csv))
        .routes(routes!(convergence::convergence_svg))
        .routes(routes!(convergence::convergence_png))
        .routes(routes!(convergence::convergence_pdf))
        .routes(routes!(report::pdf))
        .routes(routes!(surfaces::surfaces))
        .routes(routes!(surfaces::scene))
        .routes(routes!(surfaces::meshes))
        .routes(routes!(problem_page::problem_page))
        .routes(routes!(health::livez))
        .routes(routes!(health::readyz))
        .routes(routes!(health::metrics));
    OpenApiRouter::with_openapi(Description::openapi()).merge(others).merge(uploads)
}

/// Builds the router of the whole service.
pub fn router(shared: Arc<Shared>) -> Router {
    let limits = shared.limits.clone();
    let (api, description) = api().split_for_parts();
    let parameters = Arc::new(QueryParameters::of(&description));
    let access = Arc::new(shared.access.clone());
    let always = |name: HeaderName, value: &'static str| {
        SetResponseHeaderLayer::if_not_present(name, HeaderValue::from_static(value))
    };
    let around_all = ServiceBuilder::new()
        .layer(middleware::from_fn(without_long_request_id))
        .layer(SetRequestIdLayer::new(REQUEST_ID, MakeRequestUuid))
        .layer(TraceLayer::new_for_http().make_span_with(span).on_failure(log_failure))
        .layer(PropagateRequestIdLayer::new(REQUEST_ID))
        .layer(always(header::X_CONTENT_TYPE_OPTIONS, "nosniff"))
        .layer(always(header::X_FRAME_OPTIONS, "DENY"))
        .layer(always(header::REFERRER_POLICY, "no-referrer"))
        .layer(always(header::CONTENT_SECURITY_POLICY, CONTENT_SECURITY_POLICY))
        .layer(always(header::CACHE_CONTROL, "no-cache"))
        .layer(middleware::from_fn(as_problem_documents))
        .layer(CatchPanicLayer::new())
        .layer(middleware::from_fn_with_state(access, check_access))
        .layer(middleware::from_fn(answer_health_only_beyond))
        .layer(middleware::from_fn_with_state(limits, answer_in_time))
        .layer(middleware::from_fn(answer_for));
    let routes = api
        .route("/", get(page::index))
        .route("/jobs/{id}", get(page::index))
        .route("/jobs/{id}/report", get(report::page))
        .route("/web/{*file}", get(page::file))
        .route("/docs", get(docs::docs))
        .route("/docs/", get(docs::docs_index))
        .route("/docs/{*file}", get(docs::docs_file))
        // for the handler of the description, which cannot ask the router that it is a part of
        .layer(Extension(Arc::new(completed(description))))
        .layer(middleware::from_fn_with_state(parameters, refuse_unknown))
        // who reads a body limits it
        .layer(DefaultBodyLimit::disable())
        .layer(middleware::from_fn(measure))
        .with_state(shared);
    // a router around it: only outside of all routes does an answer that refuses a method name those that are allowed
    Router::new().fallback_service(routes).layer(around_all)
}

/// Content security policy of answers that a browser shows as a page: it may draw them, and nothing else (figures have styles, and
/// pictures within them).
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; frame-ancestors 'none'; base-uri 'none'; \
                                       form-action 'none'";

/// Largest number of bytes of a client's `X-Request-Id` that is accepted.
const REQUEST_ID_BYTES: usize = 128;

/// Removes a long `X-Request-Id`, so that it is neither logged nor sent back; the request gets a new one.
async fn without_long_request_id(mut request: Request, next: Next) -> Response {
    if request.headers().get(REQUEST_ID).is_some_and(|id| id.len() > REQUEST_ID_BYTES) {
        request.headers_mut().remove(REQUEST_ID);
    }
    next.run(request).await
}

fn span(request: &Request) -> tracing::Span {
    let id = request.headers().get(REQUEST_ID).and_then(|id| id.to_str().ok()).unwrap_or("");
    tracing::info_span!("request", method = %request.method(), path = request.uri().path(), id)
}

/// Logs a failed request. A temporary refusal (503) is no fault and no error in the log: it is counted, its causes have log lines
/// of their own, and clients could otherwise fill the log.
fn log_failure(failure: ServerErrorsFailureClass, latency: Duration, _: &tracing::Span) {
    match failure {
        ServerErrorsFailureClass::StatusCode(StatusCode::SERVICE_UNAVAILABLE) => {
            tracing::debug!(?latency, "a request was refused temporarily")
        }
        failure => tracing::error!(%failure, ?latency, "a request failed"),
    }
}

/// Returns the label of a method in metrics. A client may invent methods; the number of time series must not grow with them.
fn method_label(method: &Method) -> &'static str {
    const KNOWN: [&str; 7] = ["GET", "HEAD", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"];
    KNOWN.into_iter().find(|known| *known == method.as_str()).unwrap_or("other")
}

async fn measure(request: Request, next: Next) -> Response {
    let start = Instant::now();
    let method = method_label(request.method());
    // the pattern, not the path: ids would make a series each
    let route = request.extensions().get::<MatchedPath>().map_or("none", MatchedPath::as_str).to_owned();
    let response = next.run(request).await;
    let status = response.status().as_u16().to_string();
    counter!("skyduct_http_requests_total", "method" => method, "route" => route.clone(), "status" => status)
        .increment(1);
    histogram!("skyduct_http_request_seconds", "route" => route).record(start.elapsed().as_secs_f64());
    response
}

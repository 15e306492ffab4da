//! Description of the interface as a file, and a page to read it and to try it.

use std::sync::{Arc, OnceLock};

use axum::Extension;
use axum::extract::Path;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use utoipa::openapi::OpenApi;
use utoipa_swagger_ui::Config;

use crate::http::description::to_yaml;
use crate::http::problem::Problem;

/// Returns this description.
#[utoipa::path(get, path = "/openapi.yaml", operation_id = "get_openapi_yaml", tag = "operation",
    responses((status = 200, description = "OpenAPI 3.1", body = Object, content_type = "application/yaml")))]
pub async fn openapi_yaml(Extension(description): Extension<Arc<OpenApi>>) -> Result<Response, Problem> {
    Ok(([(header::CONTENT_TYPE, "application/yaml")], to_yaml(&description)?).into_response())
}

/// Redirects `/docs` to `/docs/`: relative links need the slash.
pub async fn docs() -> Redirect {
    Redirect::permanent("/docs/")
}

pub async fn docs_index() -> Result<Response, Problem> {
    docs_file(Path(String::new())).await
}

/// Content security policy of the page: it may run its own scripts, draw, and call this service.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
    img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Returns a file of the page.
pub async fn docs_file(Path(file): Path<String>) -> Result<Response, Problem> {
    static CONFIG: OnceLock<Arc<Config>> = OnceLock::new();
    let config = CONFIG.get_or_init(|| Arc::new(Config::from("/openapi.yaml"))).clone();
    match utoipa_swagger_ui::serve(&file, config) {
        Ok(Some(file)) => {
            let policy = HeaderValue::from_static(CONTENT_SECURITY_POLICY);
            let content_type = HeaderValue::try_from(file.content_type).map_err(|_| Problem::internal())?;
            let headers = [(header::CONTENT_TYPE, content_type), (header::CONTENT_SECURITY_POLICY, policy)];
            Ok((StatusCode::OK, headers, file.bytes.into_owned()).into_response())
        }
        Ok(None) => Err(Problem::not_found("there is nothing at this path")),
        Err(error) => {
            tracing::error!(%error, file, "the page cannot be written");
            Err(Problem::internal())
        }
    }
}

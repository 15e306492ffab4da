//! The interface's description, made from the handlers, and a page to read it and try it.

use std::sync::{Arc, OnceLock};

use axum::extract::Path;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use utoipa::OpenApi;
use utoipa_swagger_ui::Config;

use crate::document::{EffectSwitch, MethodKind, RadiusKind, schema};
use crate::http::event_schemas::{
    CancelledEvent, FailedEvent, ImageEvent, PassEvent, PlannedEvent, QueuedEvent, StartedEvent, SucceededEvent,
};
use crate::http::problem::Problem;
use crate::http::router::api;

#[derive(OpenApi)]
#[openapi(
    info(
        title = "skyduct",
        description = "Daylight through tubular daylight devices: job documents go in, illuminance grids with standard errors \
                       and luminance pictures come out.",
        license(name = "MIT OR Apache-2.0", identifier = "MIT OR Apache-2.0")
    ),
    servers((url = "/", description = "This service")),
    // named by hand-written schemas only, where the derived ones do not see them
    components(schemas(
        MethodKind, RadiusKind, EffectSwitch, QueuedEvent, PlannedEvent, StartedEvent, PassEvent, ImageEvent, SucceededEvent,
        FailedEvent, CancelledEvent
    )),
    tags(
        (name = "jobs", description = "Job documents and what becomes of them"),
        (name = "results", description = "Grids, pictures and convergence; of a running job, what there is so far"),
        (name = "meshes", description = "Uploaded OBJ files"),
        (name = "skies", description = "The sky types of CIE S 011"),
        (name = "tubes", description = "Closed forms of straight tubes"),
        (name = "operation", description = "Health, numbers, this description"),
    )
)]
pub struct Description;

/// The description as YAML.
pub fn yaml() -> Result<String, Problem> {
    let yaml = description().to_yaml().map_err(|error| {
        tracing::error!(%error, "the description cannot be written");
        Problem::internal()
    })?;
    Ok(yaml.lines().map(|line| quoted(line) + "\n").collect())
}

pub fn description() -> utoipa::openapi::OpenApi {
    let mut description = api().into_openapi();
    schema::complete(&mut description.components.get_or_insert_default().schemas);
    description
}

/// A line of YAML with the names quoted that are truth values to readers of YAML 1.1, as many still are.
fn quoted(line: &str) -> String {
    let text = line.trim_start();
    let indent = &line[..line.len() - text.len()];
    match text.strip_prefix("- ").map_or(("", text), |item| ("- ", item)) {
        (dash, word @ ("on" | "off" | "yes" | "no" | "y" | "n")) => format!("{indent}{dash}'{word}'"),
        (dash, word @ ("on:" | "off:" | "yes:" | "no:" | "y:" | "n:")) => {
            format!("{indent}{dash}'{}':", word.trim_end_matches(':'))
        }
        _ => line.to_owned(),
    }
}

/// This description.
#[utoipa::path(get, path = "/openapi.yaml", operation_id = "get_openapi_yaml", tag = "operation",
    responses((status = 200, description = "OpenAPI 3.1", body = Object, content_type = "application/yaml")))]
pub async fn openapi_yaml() -> Result<Response, Problem> {
    Ok(([(header::CONTENT_TYPE, "application/yaml")], yaml()?).into_response())
}

/// `/docs`: relative links need the slash.
pub async fn docs() -> Redirect {
    Redirect::permanent("/docs/")
}

pub async fn docs_index() -> Result<Response, Problem> {
    docs_file(Path(String::new())).await
}

/// What the page may do: run its own scripts, draw, and call this service.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; \
    img-src 'self' data: blob:; font-src 'self' data:; connect-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// A file of the page.
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

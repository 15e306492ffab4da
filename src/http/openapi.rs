//! The interface's description, made from the handlers, and a page to read it and try it.

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use axum::extract::Path;
use axum::http::{HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Redirect, Response};
use serde_json::Value;
use utoipa::openapi::example::{Example, ExampleBuilder};
use utoipa::openapi::header::{Header, HeaderBuilder};
use utoipa::openapi::link::LinkBuilder;
use utoipa::openapi::path::{Operation, Parameter};
use utoipa::openapi::response::{Response as OpenApiResponse, ResponseBuilder};
use utoipa::openapi::schema::{Schema, SchemaType, Type};
use utoipa::openapi::{Content, ObjectBuilder, Ref, RefOr};
use utoipa::{IntoResponses, OpenApi};
use utoipa_swagger_ui::Config;

use crate::document::{EffectSwitch, MethodKind, RadiusKind, schema};
use crate::http::event_schemas::{
    CancelledEvent, FailedEvent, ImageEvent, PassEvent, PlannedEvent, QueuedEvent, RestartedEvent, StartedEvent,
    SucceededEvent,
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
        MethodKind, RadiusKind, EffectSwitch, QueuedEvent, PlannedEvent, StartedEvent, PassEvent, ImageEvent, RestartedEvent, SucceededEvent,
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
    for path in description.paths.paths.values_mut() {
        [&mut path.get, &mut path.post, &mut path.delete].into_iter().flatten().for_each(complete);
    }
    description
}

/// Adds what all operations have alike.
fn complete(operation: &mut Operation) {
    let responses = &mut operation.responses.responses;
    for (status, response) in CommonProblems::responses() {
        responses.entry(status).or_insert(response);
    }
    if let Some(RefOr::T(unavailable)) = responses.get_mut("503") {
        unavailable.headers.entry("Retry-After".to_owned()).or_insert_with(retry_after);
    }
    let id_of = operation.operation_id.as_deref().and_then(|id| LINKS.iter().find(|(from, ..)| *from == id));
    if let Some((_, status, linked)) = id_of
        && let Some(RefOr::T(made)) = responses.get_mut(*status)
    {
        let link = |to: &&str| {
            let link = LinkBuilder::new().operation_id(*to).parameter("id", "$response.body#/id").build();
            ((*to).to_owned(), link.into())
        };
        made.links = linked.iter().map(link).collect();
    }
    for parameter in operation.parameters.iter_mut().flatten() {
        // a parameter is there or not: none is null
        if let RefOr::T(Parameter { schema: Some(RefOr::T(Schema::Object(schema))), .. }) = parameter
            && let SchemaType::Array(types) = &schema.schema_type
            && let Some(only) = types.iter().find(|kind| **kind != Type::Null)
        {
            schema.schema_type = only.clone().into();
        }
    }
    if let Some(RefOr::T(body)) = &mut operation.request_body
        && let Some(RefOr::T(document)) = body.content.get_mut("application/json")
    {
        let examples = EXAMPLES.iter().filter_map(|(name, text)| Some(((*name).to_owned(), example(text)?)));
        document.examples = examples.collect();
    }
}

/// Operations whose answer has an id: the operation, the status of the answer, and where the id leads.
const LINKS: [(&str, &str, &[&str]); 2] = [
    ("create_job", "202", &["get_job", "cancel_job", "delete_job", "get_convergence", "get_convergence_csv"]),
    ("create_mesh", "201", &["get_mesh", "delete_mesh"]),
];

/// Problems that any request may be answered with.
struct CommonProblems;

impl IntoResponses for CommonProblems {
    fn responses() -> BTreeMap<String, RefOr<OpenApiResponse>> {
        let problem = |description: &str| {
            let body = Content::new(Some(Ref::from_schema_name("Problem")));
            ResponseBuilder::new().description(description).content("application/problem+json", body)
        };
        BTreeMap::from([
            ("408".to_owned(), problem("The request did not arrive, or was not answered, in time").into()),
            ("500".to_owned(), problem("A fault of the service").into()),
            ("503".to_owned(), problem("The service is shutting down, busy, or cannot reach its stores").into()),
        ])
    }
}

fn retry_after() -> RefOr<Header> {
    let seconds = ObjectBuilder::new().schema_type(Type::Integer).minimum(Some(0));
    HeaderBuilder::new().schema(Some(seconds)).description(Some("Seconds to wait before the next try")).build().into()
}

/// Documents that run as they are: those of `examples` without meshes.
const EXAMPLES: [(&str, &str); 8] = [
    ("bent_tube", include_str!("../../examples/bent_tube.json")),
    ("cornell_box", include_str!("../../examples/cornell_box.json")),
    ("dome_tube", include_str!("../../examples/dome_tube.json")),
    ("glossy_room", include_str!("../../examples/glossy_room.json")),
    ("holigilm_thesis", include_str!("../../examples/holigilm_thesis.json")),
    ("jenkins", include_str!("../../examples/jenkins.json")),
    ("thesis_room", include_str!("../../examples/thesis_room.json")),
    ("two_tubes", include_str!("../../examples/two_tubes.json")),
];

fn example(text: &str) -> Option<RefOr<Example>> {
    let document: Value = serde_json::from_str(text).ok()?;
    let name = document["name"].as_str().unwrap_or_default().to_owned();
    Some(ExampleBuilder::new().summary(name).value(Some(document)).build().into())
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

/// Content security policy of the page: it may run its own scripts, draw, and call this service.
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

//! Description of the interface (OpenAPI): the parts that handlers do not state, and its YAML.

use serde_json::Value;
use utoipa::OpenApi;
use utoipa::openapi::example::{Example, ExampleBuilder};
use utoipa::openapi::header::{Header, HeaderBuilder};
use utoipa::openapi::link::LinkBuilder;
use utoipa::openapi::path::{Operation, Parameter};
use utoipa::openapi::response::{Response as OpenApiResponse, ResponseBuilder};
use utoipa::openapi::schema::{Schema, SchemaType, Type};
use utoipa::openapi::{Content, ObjectBuilder, Ref, RefOr};

use crate::document::{EffectSwitch, MethodKind, RadiusKind, schema};
use crate::http::event_schemas::ImageEvent;
use crate::http::file_operations;
use crate::http::job_sets::resource::JobSetEvent;
use crate::http::parameters::CHECKED;
use crate::http::problem::Problem;
use crate::http::studies::view::StudyEvent;
use crate::http::yaml;
use crate::queue::events::{Cancelled, Failed, Pass, Phase, Planned, Queued, Restarted, Started, Succeeded};

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
        Problem, MethodKind, RadiusKind, EffectSwitch, Queued, Planned, Started, Pass, ImageEvent, Phase, Restarted, Succeeded, Failed, Cancelled,
        StudyEvent, JobSetEvent
    )),
    tags(
        (name = "jobs", description = "Submit, plan, follow, list, cancel and delete jobs"),
        (name = "results", description = "Grids, pictures, figures and convergence of a job; while it runs, the \
                                          results so far"),
        (name = "job sets", description = "Jobs that are submitted, followed, cancelled and deleted together"),
        (name = "studies", description = "Compare methods on one job: the time that each takes to each accuracy, \
                                          against a reference"),
        (name = "meshes", description = "Uploaded OBJ files"),
        (name = "models", description = "Uploaded Honeybee models: rooms by their faces"),
        (name = "weather", description = "Uploaded weather files: years of EnergyPlus and of Radiance"),
        (name = "arrays", description = "Uploaded arrays of NumPy: daylight of a year that another program has computed"),
        (name = "skies", description = "Sky types of CIE S 011, and time zones of places"),
        (name = "tubes", description = "Closed forms of straight tubes"),
        (name = "operation", description = "Health checks, metrics, and this description of the interface"),
    )
)]
pub struct Description;

/// Completes a description made from the handlers with the parts that they do not state.
pub fn completed(mut description: utoipa::openapi::OpenApi) -> utoipa::openapi::OpenApi {
    schema::complete(&mut description.components.get_or_insert_default().schemas);
    file_operations::add(&mut description.paths);
    for (name, path) in &mut description.paths.paths {
        for operation in [&mut path.get, &mut path.post, &mut path.delete].into_iter().flatten() {
            if name.starts_with(CHECKED) {
                let invalid = || described("A parameter is not valid; see `errors`");
                operation.responses.responses.entry("422".to_owned()).or_insert_with(invalid);
            }
            complete(operation);
        }
    }
    description
}

/// Writes a description as YAML.
pub fn to_yaml(description: &utoipa::openapi::OpenApi) -> Result<String, Problem> {
    let yaml = description.to_yaml().map_err(|error| Problem::failed("the description cannot be written", &error))?;
    Ok(yaml::for_all_versions(&yaml))
}

/// Adds the parts that all operations have in common.
fn complete(operation: &mut Operation) {
    let responses = &mut operation.responses.responses;
    for (status, description) in COMMON_PROBLEMS {
        responses.entry(status.to_owned()).or_insert_with(|| described(description));
    }
    for (_, response) in responses.iter_mut().filter(|(status, _)| status.starts_with(['4', '5'])) {
        if let RefOr::T(failed) = response {
            let problem = Content::new(Some(Ref::from_schema_name("Problem")));
            failed.content.insert("application/problem+json".to_owned(), problem.into());
        }
    }
    for status in ["429", "503"] {
        if let Some(RefOr::T(later)) = responses.get_mut(status) {
            later.headers.entry("Retry-After".to_owned()).or_insert_with(retry_after);
        }
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
        && let Some(RefOr::Ref(schema)) = &document.schema
        && schema.ref_location.ends_with("/JobDocument")
    {
        let examples = EXAMPLES.iter().filter_map(|(name, text)| Some(((*name).to_owned(), example(text)?)));
        document.examples = examples.collect();
    }
}

/// Operations whose answer has an id: the operation, the status of the answer, and the operations that take the id.
const LINKS: [(&str, &str, &[&str]); 6] = [
    ("create_job", "202", &["get_job", "cancel_job", "delete_job", "get_convergence", "get_convergence_csv"]),
    ("create_job_set", "202", &["get_job_set", "cancel_job_set", "delete_job_set"]),
    ("create_study", "202", &["get_study", "cancel_study", "delete_study"]),
    ("create_mesh", "201", &["get_mesh", "delete_mesh"]),
    ("create_model", "201", &["get_model", "delete_model"]),
    ("create_weather", "201", &["get_weather", "delete_weather"]),
];

/// Problems that any request may be answered with.
const COMMON_PROBLEMS: [(&str, &str); 4] = [
    ("408", "The request did not arrive completely, or could not be answered, in time"),
    ("429", "The client has reached one of its limits, such as that of open connections"),
    ("500", "Internal error of the service"),
    ("503", "The service is shutting down, busy, or cannot reach its database or disk"),
];

fn described(description: &str) -> RefOr<OpenApiResponse> {
    ResponseBuilder::new().description(description).build().into()
}

fn retry_after() -> RefOr<Header> {
    let seconds = ObjectBuilder::new().schema_type(Type::Integer).minimum(Some(0));
    HeaderBuilder::new().schema(Some(seconds)).description(Some("Seconds to wait before trying again")).build().into()
}

/// Documents that run as they are: the files of `examples` that need no meshes.
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

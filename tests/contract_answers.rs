//! Real answers against the description: each is valid, and has no field that the description does not name.

mod common;
mod schema;

use common::{TestService, endless_job, small_job};
use reqwest::{Method, StatusCode};
use schema::{DESCRIPTION, assert_valid};
use serde_json::{Value, json};

/// `answer` is a `component`, and every field of it is described.
#[track_caller]
fn is_a(component: &str, answer: &Value) {
    assert_valid(&schema::component(component), answer, component);
    let mut found = Vec::new();
    undescribed(&json!({ "$ref": format!("#/components/schemas/{component}") }), answer, component, &mut found);
    assert_eq!(found, [""; 0], "not described");
}

/// Paths of the fields of `value` that `schema` does not name.
fn undescribed(schema: &Value, value: &Value, path: &str, found: &mut Vec<String>) {
    let mut objects = Vec::new();
    alternatives(schema, &mut objects);
    match value {
        Value::Object(fields) => {
            for (name, value) in fields {
                let path = format!("{path}/{name}");
                let of_maps = objects.iter().map(|object| &object["additionalProperties"]);
                let named = objects.iter().map(|object| &object["properties"][name]);
                let schemas: Vec<_> = named.chain(of_maps.filter(|any| any.is_object())).collect();
                let schemas: Vec<_> = schemas.into_iter().filter(|schema| !schema.is_null()).collect();
                // an object without properties may hold anything
                let free =
                    objects.iter().any(|object| object["type"] == "object" && object.get("properties").is_none());
                match schemas.as_slice() {
                    [] if free => {}
                    [] => found.push(path),
                    schemas => undescribed(&json!({ "anyOf": schemas }), value, &path, found),
                }
            }
        }
        Value::Array(values) => {
            let items: Vec<_> = objects.iter().map(|array| &array["items"]).filter(|items| !items.is_null()).collect();
            for (index, value) in values.iter().enumerate() {
                undescribed(&json!({ "anyOf": items }), value, &format!("{path}/{index}"), found);
            }
        }
        _ => {}
    }
}

/// The schemas that `schema` is made of, references followed.
fn alternatives(schema: &Value, found: &mut Vec<Value>) {
    if let Some(reference) = schema["$ref"].as_str() {
        alternatives(DESCRIPTION.pointer(reference.trim_start_matches('#')).unwrap(), found);
    }
    for key in ["allOf", "oneOf", "anyOf"] {
        schema[key].as_array().into_iter().flatten().for_each(|part| alternatives(part, found));
    }
    found.push(schema.clone());
}

fn component_of_event(name: &str) -> &'static str {
    let events = &DESCRIPTION["paths"]["/v1/jobs/{id}/events"]["get"]["x-events"];
    let event = events.as_array().unwrap().iter().find(|event| event["name"] == name);
    let event = event.unwrap_or_else(|| panic!("no event {name}"));
    event["data"]["$ref"].as_str().unwrap().rsplit('/').next().unwrap()
}

#[tokio::test]
async fn answers_about_a_job_are_as_described() {
    let service = TestService::start().await;
    let planned: Value =
        service.request(Method::POST, "/v1/plan").json(&small_job()).send().await.unwrap().json().await.unwrap();
    is_a("PlanResource", &planned);
    let response = service.post_job(&small_job()).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::ACCEPTED);
    let posted: Value = response.json().await.unwrap();
    is_a("JobResource", &posted);
    let path = posted["links"]["self"].as_str().unwrap();

    let mut names = Vec::new();
    for event in service.events_after(path, 0).await {
        is_a(component_of_event(&event.name), &event.data);
        if event.name == "planned" {
            for field in ["switches", "external_horizontal_illuminance_lux"] {
                assert_eq!(event.data[field], posted[field], "{field}");
            }
        }
        names.push(event.name);
    }
    for name in ["queued", "planned", "started", "pass", "image", "succeeded"] {
        assert!(names.iter().any(|event| event == name), "{name}");
    }

    let job = service.json(path).await;
    is_a("JobResource", &job);
    // what is known when a job is planned is what the results say
    for field in ["switches", "external_horizontal_illuminance_lux"] {
        assert!(!posted[field].is_null() && posted[field] == job[field] && planned[field] == job[field], "{field}");
    }
    assert!(posted["switches"]["sun"]["altitude_deg"].as_f64().is_some());
    assert_eq!(job["views"], json!([{ "name": "room", "size_px": [16, 8] }]));

    is_a("JobPage", &service.json("/v1/jobs").await);
    is_a("GridResult", &service.json(&format!("{path}/grids/workplane")).await);
    is_a("TubeReport", &service.json(&format!("{path}/tubes/0.json")).await);
    is_a("Convergence", &service.json(&format!("{path}/convergence")).await);
}

#[tokio::test]
async fn other_answers_are_as_described() {
    let service = TestService::start().await;
    is_a("Skies", &service.json("/v1/skies").await);
    let tube = "/v1/tubes/transmission?reflectance=0.98&aspect_ratio=4&altitude_deg=30&cie_type=12&sun_altitude_deg=35";
    is_a("TubeTransmission", &service.json(tube).await);
    let obj = "o pipe\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let upload = service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(obj);
    let mesh: Value = upload.send().await.unwrap().json().await.unwrap();
    is_a("MeshResource", &mesh);
    is_a("MeshResource", &service.json(&format!("/v1/meshes/{}", mesh["id"].as_str().unwrap())).await);

    let mut bad = small_job();
    bad["stop"]["confidence"] = json!(2);
    for request in [service.post_job(&bad), service.get("/v1/jobs/none"), service.get("/v1/jobs?limit=0")] {
        let answer = request.send().await.unwrap();
        assert!(answer.status().is_client_error());
        is_a("Problem", &answer.json().await.unwrap());
    }
    let path = service.submit(&endless_job()).await;
    let cancelled = service.request(Method::POST, &format!("{path}/cancel")).send().await.unwrap();
    is_a("JobResource", &cancelled.json().await.unwrap());
    for event in service.events_after(&path, 0).await {
        is_a(component_of_event(&event.name), &event.data);
    }
}

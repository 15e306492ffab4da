//! Real answers against the description: each is valid, and has no field that the description does not name.

use crate::common;
use crate::common::{TestService, endless_job, small_job};
use crate::schema;
use crate::schema::{DESCRIPTION, assert_valid};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use skyduct::http::problem_kind::ProblemKind;

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
    // with everything that can be asked for
    let mut asked = small_job();
    (asked["cross_check"], asked["grids"][0]["components"]) = (json!(true), json!(true));
    asked["method"] = json!({ "kind": "path_tracing", "samples_per_sensor": 4, "samples_per_pixel": 1 });
    let planned: Value =
        service.request(Method::POST, "/v1/plan").json(&asked).send().await.unwrap().json().await.unwrap();
    is_a("PlanResource", &planned);
    let request = service.request(Method::POST, "/v1/plan?predict=true").json(&asked);
    is_a("PlanResource", &request.send().await.unwrap().json().await.unwrap());
    let response = service.post("/v1/jobs?predict=true", &asked).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::ACCEPTED);
    let posted: Value = response.json().await.unwrap();
    is_a("JobResource", &posted);
    let path = posted["links"]["self"].as_str().unwrap();

    let mut names = Vec::new();
    for event in service.events_after(path, 0).await {
        is_a(component_of_event(&event.name), &event.data);
        if event.name == "planned" {
            for field in ["provenance", "switches", "external_horizontal_illuminance_lux"] {
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
    for field in ["provenance", "switches", "external_horizontal_illuminance_lux"] {
        assert!(!posted[field].is_null() && posted[field] == job[field] && planned[field] == job[field], "{field}");
    }
    assert!(posted["provenance"]["sun"]["altitude_deg"].as_f64().is_some());
    // under its name of before, too
    assert_eq!(posted["switches"], posted["provenance"]);
    assert_eq!(job["views"], json!([{ "name": "room", "size_px": [16, 8] }]));

    is_a("JobPage", &service.json("/v1/jobs").await);
    let grid = service.json(&format!("{path}/grids/workplane")).await;
    is_a("GridResult", &grid);
    assert!(grid["components"].is_object() && grid["by_tube"].is_array() && job["cross_check"]["agrees"].is_boolean());
    is_a("TubeReport", &service.json(&format!("{path}/tubes/0.json")).await);
    is_a("Convergence", &service.json(&format!("{path}/convergence")).await);
}

#[tokio::test]
async fn other_answers_are_as_described() {
    let service = TestService::start().await;
    is_a("Skies", &service.json("/v1/skies").await);
    let tube = "/v1/tubes/transmission?reflectance=0.98&aspect_ratio=4&altitude_deg=30&cie_type=12&sun_altitude_deg=35";
    is_a("TubeTransmission", &service.json(tube).await);
    let [once, twice] = ["2026-06-21T12:00", "2026-10-25T02:30"]
        .map(|time| format!("/v1/time_zone?latitude_deg=55.69&longitude_deg=12.9&local_time={time}"));
    is_a("TimeZoneResource", &service.json(&once).await);
    is_a("TimeZoneResource", &service.json(&twice).await);
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

/// Each kind of problem has a page, in words for people and as JSON.
#[tokio::test]
async fn every_kind_of_problem_is_explained() {
    let service = TestService::start().await;
    for kind in ProblemKind::ALL {
        let code = kind.code();
        let page =
            service.get(code).header("accept", "text/html,application/xhtml+xml,*/*;q=0.8").send().await.unwrap();
        assert_eq!(page.status(), StatusCode::OK, "{code}");
        assert!(page.headers()["content-type"].to_str().unwrap().starts_with("text/html"), "{code}");
        let page = page.text().await.unwrap();
        assert!(page.contains(kind.title()) && page.contains(code), "{page}");
        let json = service.get(code).header("accept", "application/json").send().await.unwrap().json().await.unwrap();
        is_a("ProblemPage", &json);
        assert_eq!(json["type"], code);
    }
    common::problem(service.get("/problems/none").send().await.unwrap(), 404).await;
}

/// Representations by suffix, by `?format=` and by `Accept` with its weights are the same files, with names to save them by.
#[tokio::test]
async fn a_suffix_is_another_way_to_ask_for_a_format() {
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    let job = service.finished(&path).await;
    let get = async |path: &str, accept: &str| {
        let answer = service.get(path).header("accept", accept).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{path} {accept}");
        let header = |name: &str| {
            let value = answer.headers().get(name).map(|value| value.to_str().unwrap().to_owned());
            value.unwrap_or_default()
        };
        let (media_type, file) = (header("content-type"), header("content-disposition"));
        (media_type, file, answer.bytes().await.unwrap())
    };
    for (resource, name, media_types) in [
        ("grids/workplane", "workplane", &["application/json", "text/csv", "image/png", "image/svg+xml"][..]),
        ("tubes/0", "tube-0", &["application/json", "image/svg+xml", "image/png"]),
        ("views/room", "room", &["image/png", "image/x-exr"]),
        ("convergence", "convergence", &["application/json", "text/csv", "image/svg+xml", "image/png"]),
    ] {
        for media_type in media_types {
            let suffix = media_type.split(['/', '+']).nth(1).unwrap().trim_start_matches("x-");
            let by_suffix = get(&format!("{path}/{resource}.{suffix}"), "*/*").await;
            assert!(by_suffix.0.starts_with(media_type), "{resource}.{suffix}: {}", by_suffix.0);
            assert_eq!(by_suffix.1, format!("inline; filename=\"{name}.{suffix}\""));
            let accept = format!("text/html, {media_type};q=0.9, */*;q=0.1");
            let by_accept = get(&format!("{path}/{resource}"), &accept).await;
            assert_eq!(by_accept, by_suffix, "{resource} {accept}");
        }
        let (first, ..) = get(&format!("{path}/{resource}"), "text/html,*/*;q=0.8").await;
        assert!(first.starts_with(media_types[0]), "{resource}: {first}");
    }
    let csv = get(&format!("{path}/grids/workplane?format=csv"), "application/json").await;
    assert_eq!(csv, get(job["links"]["grid_files"]["workplane"]["csv"].as_str().unwrap(), "*/*").await);
    get(job["links"]["grid_files"]["workplane"]["png"].as_str().unwrap(), "*/*").await;
    get(job["links"]["convergence_csv"].as_str().unwrap(), "*/*").await;
    common::problem(service.get(&format!("{path}/grids/other.csv")).send().await.unwrap(), 404).await;
}

/// Typed clients read one type: JSON that is one of several representations has an operation of its own.
#[tokio::test]
async fn json_has_operations_of_its_own() {
    let paths = DESCRIPTION["paths"].as_object().unwrap();
    let content =
        |path: &str| paths[path]["get"]["responses"]["200"]["content"].as_object().cloned().unwrap_or_default();
    let mut with_json: Vec<String> = Vec::new();
    for path in paths.keys() {
        let all = content(path);
        let Some(json) = all.get("application/json").filter(|_| all.len() > 1 && !all.contains_key("text/html")) else {
            continue;
        };
        let (resource, last) = path.rsplit_once('/').unwrap();
        let is_alone = |other: &&String| {
            let file = other.strip_prefix(resource).and_then(|file| file.strip_prefix('/'));
            let name = if last.starts_with('{') { "" } else { last };
            file.is_some_and(|file| !file.contains('/') && file.starts_with(name) && file.ends_with(".json"))
        };
        let alone = paths.keys().find(is_alone).unwrap_or_else(|| panic!("no file with the JSON of {path}"));
        let of_file = content(alone);
        assert_eq!((of_file.len(), &of_file["application/json"]["schema"]), (1, &json["schema"]), "{alone}");
        with_json.push(alone.clone());
    }
    assert!(with_json.len() >= 4, "{with_json:?}");

    // they are there, and are what is described
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    service.finished(&path).await;
    for (described, file, component) in [
        ("/v1/jobs/{id}/grids/{name}.json", "grids/workplane.json", Some("GridResult")),
        ("/v1/jobs/{id}/grids/{name}.csv", "grids/workplane.csv", None),
        ("/v1/jobs/{id}/tubes/{tube}.json", "tubes/0.json", Some("TubeReport")),
    ] {
        let media_types: Vec<String> = content(described).keys().cloned().collect();
        // whatever else is accepted
        let answer = service.get(&format!("{path}/{file}")).header("accept", "image/png").send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{file}");
        let media_type = answer.headers()["content-type"].to_str().unwrap().to_owned();
        assert_eq!(media_types, [media_type.split(';').next().unwrap()], "{file}");
        if let Some(component) = component {
            let reference = format!("#/components/schemas/{component}");
            assert_eq!(content(described)["application/json"]["schema"]["$ref"], reference);
            is_a(component, &answer.json().await.unwrap());
        }
    }
}

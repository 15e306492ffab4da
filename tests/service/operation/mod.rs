//! Health, numbers, the description, connections.

mod commands;
mod contract_answers;
mod log;
mod page;
mod security;

use crate::common;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use crate::common::{PATIENCE, TestService, config, small_job};
use reqwest::{Method, StatusCode};
use serde_json::json;
use skyduct::cli::serve::RunningService;
use tokio::io::{AsyncReadExt, AsyncWriteExt};

#[test]
fn openapi_file_is_current() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("openapi.yaml");
    let Ok(generated) = skyduct::http::openapi::yaml() else { panic!("the description cannot be written") };
    if std::env::var_os("UPDATE_OPENAPI").is_some() {
        std::fs::write(&file, &generated).unwrap();
    }
    let committed = std::fs::read_to_string(&file).unwrap_or_default();
    assert!(
        committed == generated,
        "openapi.yaml is not what the code says: UPDATE_OPENAPI=1 cargo test --test service openapi_file"
    );
}

/// Readers of YAML 1.1 take plain words such as `off`, 12:00 and 2011-09-15 for truth values, numbers and times.
#[test]
fn every_version_of_yaml_reads_the_same_description() {
    fn texts<'a>(value: &'a serde_json::Value, found: &mut BTreeSet<&'a str>) {
        match value {
            serde_json::Value::String(text) => drop(found.insert(text)),
            serde_json::Value::Array(items) => items.iter().for_each(|item| texts(item, found)),
            serde_json::Value::Object(fields) => {
                found.extend(fields.keys().map(String::as_str));
                fields.values().for_each(|field| texts(field, found));
            }
            _ => {}
        }
    }
    let description = serde_json::to_value(skyduct::http::openapi::description()).unwrap();
    let mut found = BTreeSet::new();
    texts(&description, &mut found);
    let is_time = |text: &&str| {
        text.starts_with(|first: char| first.is_ascii_digit())
            && text.contains([':', '-', '_'])
            && !text.contains(|letter: char| letter.is_alphabetic() && !"TtZzeE".contains(letter))
    };
    let is_truth = |text: &&str| ["y", "n", "yes", "no", "on", "off"].contains(&text.to_lowercase().as_str());
    let misread: Vec<&str> = found.into_iter().filter(|text| is_time(text) || is_truth(text)).collect();
    assert!(misread.contains(&"off") && misread.contains(&"2011-09-15T15:00:00+02:00"), "{misread:?}");
    let yaml = skyduct::http::openapi::yaml().unwrap_or_else(|_| panic!("the description cannot be written"));
    for text in misread {
        let is_plain = |line: &&str| {
            let word = line.trim_start().trim_start_matches("- ");
            let of_name = word == format!("{text}:") || word.starts_with(&format!("{text}: "));
            word == text || of_name || word.ends_with(&format!(": {text}"))
        };
        let line = yaml.lines().find(is_plain);
        assert_eq!(line, None, "{text} is not quoted");
    }
}

#[test]
fn the_description_refers_to_what_is_there() {
    let description = serde_json::to_value(skyduct::http::openapi::description()).unwrap();
    let schemas = description["components"]["schemas"].as_object().unwrap();
    let text = description.to_string();
    let references: Vec<&str> =
        text.split("\"#/components/schemas/").skip(1).map(|rest| rest.split('"').next().unwrap()).collect();
    assert!(references.len() > 50);
    for name in references {
        assert!(schemas.contains_key(name), "{name}");
    }
    let operations = description["paths"].as_object().unwrap().values();
    let mut ids: Vec<&str> = operations
        .flat_map(|path| path.as_object().unwrap().values())
        .map(|operation| operation["operationId"].as_str().unwrap())
        .collect();
    let count = ids.len();
    ids.sort();
    ids.dedup();
    assert_eq!(ids.len(), count);
}

#[tokio::test]
async fn the_service_tells_how_it_is() {
    let service = TestService::start().await;
    for path in ["/livez", "/readyz"] {
        assert_eq!(service.get(path).send().await.unwrap().status(), StatusCode::OK);
    }
    let skies = service.json("/v1/skies").await;
    let skies = skies["skies"].as_array().unwrap();
    assert_eq!(skies.len(), 16);
    assert_eq!(skies[11]["cie_type"], 12);
    assert_eq!(skies[11]["parameters"], json!({ "a": -1.0, "b": -0.32, "c": 10.0, "d": -3.0, "e": 0.45 }));
    assert!(skies[15]["parameters"].is_null());

    let path = service.submit(&small_job()).await;
    service.finished(&path).await;
    let metrics = service.get("/metrics").send().await.unwrap().text().await.unwrap();
    for name in [
        "skyduct_jobs{status=\"queued\"} 0",
        "skyduct_passes_total",
        "skyduct_http_requests_total{method=\"POST\",route=\"/v1/jobs\",status=\"202\"}",
        "skyduct_http_request_seconds_bucket",
    ] {
        assert!(metrics.contains(name), "{name} in {metrics}");
    }
    // every one says what it is
    for line in metrics.lines().filter(|line| !line.is_empty() && !line.starts_with('#')) {
        let name = line.split(['{', ' ']).next().unwrap();
        let whole = ["_bucket", "_sum", "_count"].iter().find_map(|part| name.strip_suffix(part)).unwrap_or(name);
        assert!(metrics.contains(&format!("# HELP {whole} ")), "{name} in {metrics}");
    }

    let yaml = service.get("/openapi.yaml").send().await.unwrap();
    assert_eq!(yaml.headers()["content-type"], "application/yaml");
    assert!(yaml.text().await.unwrap().contains("/v1/jobs/{id}/events"));
    // follows the redirect to /docs/
    let docs = service.get("/docs").send().await.unwrap();
    assert_eq!(docs.status(), StatusCode::OK);
    assert!(docs.text().await.unwrap().contains("swagger-ui"));
    let script = service.get("/docs/swagger-initializer.js").send().await.unwrap().text().await.unwrap();
    assert!(script.contains("/openapi.yaml"), "{script}");
    for text in ["/v1/skies", "/openapi.yaml"] {
        let zipped = service.get(text).header("accept-encoding", "gzip").send().await.unwrap();
        assert_eq!(zipped.headers()["content-encoding"], "gzip", "{text}");
    }
}

/// A tube of 4 diameters and R = 0.98: the reference tables' values at 30 degrees and under skies; bad values by name.
#[tokio::test]
async fn the_transmission_of_a_tube() {
    let service = TestService::start().await;
    let near = |value: &serde_json::Value, truth: f64, tolerance: f64| {
        assert!((value.as_f64().unwrap() - truth).abs() <= tolerance, "{value} {truth}");
    };
    let path = "/v1/tubes/transmission?reflectance=0.98";
    let tube =
        service.json(&format!("{path}&aspect_ratio=4&altitude_deg=30,90,0&cie_type=1&sun_altitude_deg=20")).await;
    near(&tube["uniform_sky_transmission"], 0.869927, 5e-7);
    near(&tube["beams"][0]["transmission"], 0.83912, 5e-6);
    let mean = 4.0 / std::f64::consts::FRAC_PI_4 * 3f64.sqrt();
    near(&tube["beams"][0]["mean_reflections"], mean, 1e-12);
    near(&tube["beams"][0]["zastrow_wittwer_transmission"], 0.98f64.powf(mean), 1e-12);
    near(&tube["beams"][1]["transmission"], 1.0, 0.0);
    near(&tube["beams"][2]["transmission"], 0.0, 0.0);
    assert!(tube["beams"][2]["mean_reflections"].is_null());
    near(&tube["sky"]["transmission"], 0.895085, 1.5e-6);
    let measured = service.json(&format!("{path}&length_m=1.2&diameter_m=0.3")).await;
    near(&measured["aspect_ratio"], 4.0, 1e-12);
    assert!(measured["sky"].is_null() && measured["beams"].as_array().unwrap().is_empty());
    for (query, parameter) in [
        ("reflectance=1.1&aspect_ratio=4", "reflectance"),
        ("aspect_ratio=4", "reflectance"),
        ("reflectance=0.98&aspect_ratio=-1", "aspect_ratio"),
        ("reflectance=0.98&aspect_ratio=NaN", "aspect_ratio"),
        ("reflectance=0.98", "aspect_ratio"),
        ("reflectance=0.98&length_m=1&diameter_m=0", "diameter_m"),
        ("reflectance=0.98&length_m=1000&diameter_m=0.1", "length_m"),
        ("reflectance=0.98&aspect_ratio=4&altitude_deg=30,91", "altitude_deg"),
        ("reflectance=0.98&aspect_ratio=4&altitude_deg=high", "altitude_deg"),
        ("reflectance=0.98&aspect_ratio=4&cie_type=17&sun_altitude_deg=20", "cie_type"),
        ("reflectance=0.98&aspect_ratio=4&cie_type=1", "sun_altitude_deg"),
        ("reflectance=0.98&aspect_ratio=4&cie_type=1&sun_altitude_deg=0", "sun_altitude_deg"),
    ] {
        let answer = service.get(&format!("/v1/tubes/transmission?{query}")).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY, "{query}");
        assert_eq!(answer.headers()["content-type"], "application/problem+json");
        let problem: serde_json::Value = answer.json().await.unwrap();
        assert_eq!(problem["errors"][0]["parameter"], parameter, "{query}: {problem}");
    }
    let unknown = service.get(&format!("{path}&aspect_ratio=4&length=2")).send().await.unwrap();
    assert_eq!(common::problem(unknown, 422).await["errors"][0]["parameter"], "length");
}

/// The zone of a place or of a name; times that clocks show once, twice and never; bad values by name.
#[tokio::test]
async fn the_time_zone_of_a_place() {
    let service = TestService::start().await;
    let told = async |query: &str| service.json(&format!("/v1/time_zone?{query}")).await;
    let place = "latitude_deg=55.69&longitude_deg=12.55";
    let summer = json!({ "time_zone": "Europe/Copenhagen", "shown": "once", "time": "2026-06-21T12:00:00+02:00",
                         "second_time": null, "utc_offset": "+02:00" });
    assert_eq!(told(&format!("{place}&local_time=2026-06-21T12:00")).await, summer);
    assert_eq!(told("time_zone=europe/copenhagen&local_time=2026-06-21T12:00:00").await, summer);
    let chosen = told(&format!("{place}&time_zone=America/St_Johns&local_time=2026-06-21T12:00")).await;
    assert_eq!(chosen["time"], "2026-06-21T12:00:00-02:30");
    let never = told(&format!("{place}&local_time=2026-03-29T02:30")).await;
    assert_eq!((&never["shown"], &never["time"]), (&json!("never"), &json!("2026-03-29T03:30:00+02:00")));
    let twice = told(&format!("{place}&local_time=2026-10-25T02:30")).await;
    assert_eq!((&twice["shown"], &twice["utc_offset"]), (&json!("twice"), &json!("+02:00")));
    assert_eq!(twice["second_time"], "2026-10-25T02:30:00+01:00");
    for (query, parameters) in [
        ("local_time=2026-06-21T12:00", &["latitude_deg", "longitude_deg"][..]),
        ("latitude_deg=91&longitude_deg=181&local_time=noon", &["latitude_deg", "longitude_deg", "local_time"]),
        ("latitude_deg=0&longitude_deg=NaN&local_time=2026-06-21T12:00Z", &["longitude_deg", "local_time"]),
        ("latitude_deg=0&longitude_deg=0&local_time=2026-02-30T12:00", &["local_time"]),
        ("latitude_deg=0&longitude_deg=0", &["local_time"]),
        ("time_zone=Europe/Aarhus&local_time=2026-06-21T12:00", &["time_zone"]),
        ("time_zone=&local_time=2026-06-21T12:00", &["time_zone"]),
        ("time_zone=Asia/Tokyo&local_time=-009999-01-01T00:00", &["local_time"]),
    ] {
        let answer = service.get(&format!("/v1/time_zone?{query}")).send().await.unwrap();
        let problem = common::problem(answer, 422).await;
        let named: Vec<&str> =
            problem["errors"].as_array().unwrap().iter().filter_map(|error| error["parameter"].as_str()).collect();
        assert_eq!(named, parameters, "{query}: {problem}");
    }
}

/// Every operation refuses a parameter that it does not have, also one that has none.
#[tokio::test]
async fn unknown_parameters_are_refused_by_name() {
    let service = TestService::start().await;
    let description = serde_json::to_value(skyduct::http::openapi::description()).unwrap();
    let mut operations = 0;
    for (path, item) in description["paths"].as_object().unwrap() {
        for method in item.as_object().unwrap().keys().filter(|_| path.starts_with("/v1/")) {
            let path = path.replace("{id}", "00000000-0000-0000-0000-000000000000").replace(['{', '}'], "");
            let method = Method::from_bytes(method.to_uppercase().as_bytes()).unwrap();
            let request = service.request(method, &format!("{path}?labels=a%20b&tags=c")).json(&json!({}));
            let problem = common::problem(request.send().await.unwrap(), 422).await;
            assert_eq!(problem["type"], "/problems/invalid-parameters");
            let named: Vec<_> = problem["errors"].as_array().unwrap().iter().map(|error| &error["parameter"]).collect();
            assert_eq!(named, ["labels", "tags"], "{problem}");
            assert_eq!(problem["errors"][0]["code"], "unknown_field", "{problem}");
            operations += 1;
        }
    }
    assert!(operations > 30, "{operations}");
    // what is no part of the interface may have any
    for path in ["/livez?at=1", "/?at=1", "/docs/?at=1"] {
        assert_eq!(service.get(path).send().await.unwrap().status(), StatusCode::OK, "{path}");
    }
}

#[tokio::test]
async fn a_request_that_never_ends_is_ended() {
    let service = TestService::start_with(|config| {
        config.limits.header_seconds = 1;
        config.limits.request_seconds = 1;
    })
    .await;
    let mut half_head = tokio::net::TcpStream::connect(service.running.address).await.unwrap();
    half_head.write_all(b"GET /livez HTTP/1.1\r\nhost: x\r\n").await.unwrap();
    let mut answer = Vec::new();
    tokio::time::timeout(PATIENCE, half_head.read_to_end(&mut answer)).await.unwrap().unwrap();

    let mut half_body = tokio::net::TcpStream::connect(service.running.address).await.unwrap();
    let address = service.running.address;
    let head = format!(
        "POST /v1/jobs HTTP/1.1\r\nhost: {address}\r\ncontent-type: application/json\r\ncontent-length: 100\r\n\r\n{{"
    );
    half_body.write_all(head.as_bytes()).await.unwrap();
    let mut answer = vec![0; 4096];
    let length = tokio::time::timeout(PATIENCE, half_body.read(&mut answer)).await.unwrap().unwrap();
    let answer = String::from_utf8_lossy(&answer[..length]).into_owned();
    assert!(answer.starts_with("HTTP/1.1 408") && answer.contains("/problems/timeout"), "{answer}");
}

/// `skyduct healthcheck` is what a container's health check runs.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn the_health_check_tells_a_ready_service_from_none() {
    let service = TestService::start().await;
    let check = |address: String| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_skyduct"));
        command.args(["healthcheck", "--server", &format!("http://{address}")]);
        command.stderr(std::process::Stdio::null()).status().unwrap().code()
    };
    assert_eq!(check(service.running.address.to_string()), Some(0));
    // a port that was free a moment ago
    let free = tokio::net::TcpListener::bind("127.0.0.1:0").await.unwrap().local_addr().unwrap();
    assert_eq!(check(free.to_string()), Some(1));
}

#[tokio::test]
async fn a_data_folder_has_one_service() {
    let service = TestService::start().await;
    let second = RunningService::start(config(service.data.path())).await;
    assert!(second.err().expect("the folder is taken").to_string().contains("another process"));
    let TestService { running, data, http } = service;
    running.stop().await;
    // connections may linger, the lock must not
    let third = RunningService::start(config(data.path())).await.unwrap();
    let live = http.request(Method::GET, format!("{}/livez", third.url())).timeout(Duration::from_secs(10));
    assert_eq!(live.send().await.unwrap().status(), StatusCode::OK);
}

/// Pages of listed origins are told that they may call and what they may read; others are told nothing.
#[tokio::test]
async fn only_listed_origins_may_call_from_a_page() {
    let listed = "https://design.example";
    let preflight = |service: &TestService, origin: &str| {
        let request = service.request(Method::OPTIONS, "/v1/jobs").header("origin", origin);
        let asked = "content-type,idempotency-key,last-event-id";
        request.header("access-control-request-method", "POST").header("access-control-request-headers", asked).send()
    };
    let service = TestService::start_with(|config| config.cors_origins = vec![listed.to_owned()]).await;
    let answer = preflight(&service, listed).await.unwrap();
    let header = |name: &str| answer.headers().get(name).map_or("", |value| value.to_str().unwrap()).to_owned();
    assert_eq!(header("access-control-allow-origin"), listed);
    assert!(header("access-control-allow-methods").contains("POST"));
    for name in ["content-type", "idempotency-key", "last-event-id"] {
        assert!(header("access-control-allow-headers").contains(name), "{name}");
    }
    let other = preflight(&service, "https://other.example").await.unwrap();
    assert!(other.headers().get("access-control-allow-origin").is_none());

    // an answer that refuses can be read, too
    let bad = service.post_job(&json!({})).header("origin", listed).send().await.unwrap();
    assert_eq!(bad.status(), StatusCode::UNPROCESSABLE_ENTITY);
    assert_eq!(bad.headers()["access-control-allow-origin"], listed);
    let exposed = bad.headers()["access-control-expose-headers"].to_str().unwrap().to_owned();
    for name in ["location", "retry-after", "etag", "preference-applied", "idempotency-replayed", "x-request-id"] {
        assert!(exposed.contains(name), "{name} in {exposed}");
    }

    let closed = TestService::start().await;
    let refused = preflight(&closed, listed).await.unwrap();
    assert_eq!(refused.status(), StatusCode::METHOD_NOT_ALLOWED);
    assert!(refused.headers().get("access-control-allow-origin").is_none());
}

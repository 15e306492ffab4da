//! Uploaded meshes.

use crate::common::{TestService, endless_job, problem};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

/// A square tube of 0.2 m, 1 m long, with a collector on top and a diffuser below.
fn square_tube() -> String {
    let mut text = String::new();
    for z in [0.0, 1.0] {
        for (x, y) in [(-0.08, -0.08), (0.08, -0.08), (0.08, 0.08), (-0.08, 0.08)] {
            text += &format!("v {x} {y} {z}\n");
        }
    }
    text += "usemtl diffuser\nf 1 2 3 4\nusemtl pipe\n";
    text += "f 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    text += "usemtl top\nf 5 6 7 8\n";
    text
}

fn with_mesh(mut job: Value, mesh: &str) -> Value {
    job["tubes"] = json!([{
        "mesh": mesh, "unit": "m", "centre_m": [1.0, 1.0], "opening_diameter_m": 0.254, "rotation_deg": 0,
        "parts": {
            "top": { "role": "collector", "transmittance": 0.92, "reflectance": 0.05 },
            "pipe": { "role": "pipe", "reflectance": 0.98 },
            "diffuser": { "role": "diffuser", "kind": "lambertian", "transmittance": 0.6 }
        }
    }]);
    job
}

#[tokio::test]
async fn a_mesh_from_upload_to_delete() {
    let service = TestService::start().await;
    let upload = |text: String| {
        service.request(Method::POST, "/v1/meshes").header("content-type", "model/obj").body(text).send()
    };
    let response = upload(square_tube()).await.unwrap();
    assert_eq!(response.status(), StatusCode::CREATED);
    let path = response.headers()["location"].to_str().unwrap().to_owned();
    let mesh: Value = response.json().await.unwrap();
    let id = mesh["id"].as_str().unwrap();
    assert_eq!(id, &blake3::hash(square_tube().as_bytes()).to_hex()[..32]);
    assert_eq!(mesh["triangles"], 12);
    assert_eq!(mesh["materials"], json!(["diffuser", "pipe", "top"]));
    assert_eq!(service.json(&path).await, mesh);
    let again: Value = upload(square_tube()).await.unwrap().json().await.unwrap();
    assert_eq!(again, mesh);

    let job = service.submit(&with_mesh(endless_job(), id)).await;
    service.events_until(&job, 0, |event| event.name == "pass").await;
    problem(service.request(Method::DELETE, &path).send().await.unwrap(), 409).await;
    service.request(Method::POST, &format!("{job}/cancel")).send().await.unwrap();
    assert_eq!(service.finished(&job).await["status"], "cancelled");
    let deleted = service.request(Method::DELETE, &path).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    problem(service.get(&path).send().await.unwrap(), 404).await;
    problem(service.request(Method::DELETE, &path).send().await.unwrap(), 404).await;
    assert_eq!(std::fs::read_dir(service.data.path().join("artifacts/meshes")).map_or(0, Iterator::count), 0);

    let gone = problem(service.post_job(&with_mesh(endless_job(), id)).send().await.unwrap(), 422).await;
    assert_eq!(gone["errors"][0]["pointer"], "/tubes/0/mesh");
}

#[tokio::test]
async fn a_broken_mesh_is_refused_with_its_line() {
    let service = TestService::start_with(|config| config.limits.mesh_bytes = 10_000).await;
    let upload = async |text: &str, content_type: &str| {
        let request = service.request(Method::POST, "/v1/meshes").header("content-type", content_type);
        request.body(text.to_owned()).send().await.unwrap()
    };
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (text, line) in [
        (format!("{corners}f 1 2 9\n"), 4),
        (format!("{corners}f 1 2 0\n"), 4),
        ("v 0 0 nan\n".to_owned(), 1),
        (format!("{corners}v 1 2\nf 1 2 3\n"), 4),
    ] {
        let broken = problem(upload(&text, "model/obj").await, 422).await;
        assert!(broken["detail"].as_str().unwrap().contains(&format!("line {line}")), "{broken}");
    }
    problem(upload("", "model/obj").await, 422).await;
    problem(upload(&" ".repeat(10_001), "model/obj").await, 413).await;
    problem(upload("{}", "application/json").await, 415).await;
    problem(upload("x", "multipart/form-data; boundary=x").await, 415).await;
}

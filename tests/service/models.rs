//! Uploaded Honeybee models, and jobs whose room is one of them.

use crate::common::{TestService, problem, small_job};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

/// A box of 2 m in millimetres, with a window.
fn model() -> Value {
    let corner = |k: usize| [2000 * (k & 1), 2000 * (k >> 1 & 1), 2000 * (k >> 2)];
    let face = |name: &str, face_type: &str, corners: [usize; 4]| {
        json!({ "type": "Face", "identifier": name, "face_type": face_type,
                "geometry": { "type": "Face3D", "boundary": corners.map(corner) } })
    };
    let mut south = face("south", "Wall", [0, 1, 5, 4]);
    south["apertures"] = json!([{ "type": "Aperture" }]);
    let faces = json!([
        face("floor", "Floor", [2, 3, 1, 0]),
        south,
        face("north", "Wall", [3, 2, 6, 7]),
        face("east", "Wall", [1, 3, 7, 5]),
        face("west", "Wall", [2, 0, 4, 6]),
        face("roof", "RoofCeiling", [4, 5, 7, 6])
    ]);
    json!({ "type": "Model", "units": "Millimeters", "tolerance": 0.01,
            "rooms": [{ "type": "Room", "identifier": "Shop_1", "display_name": "Shop", "faces": faces }] })
}

fn job(hbjson: Value) -> Value {
    let mut job = small_job();
    job["room"] = json!({ "hbjson": hbjson, "identifier": "Shop" });
    job["tubes"][0]["centre_m"] = json!([1, 1]);
    job
}

/// A job takes a model by its id or as an object, has its faces, and tells what is left out.
#[tokio::test]
async fn a_model_from_upload_to_result() {
    let service = TestService::start().await;
    let upload = |body: String, content_type: &str| {
        service.request(Method::POST, "/v1/models").header("content-type", content_type).body(body).send()
    };
    let response = upload(model().to_string(), "application/json").await.unwrap();
    assert_eq!(response.status(), StatusCode::CREATED);
    let path = response.headers()["location"].to_str().unwrap().to_owned();
    let uploaded: Value = response.json().await.unwrap();
    let rooms = json!([{ "identifier": "Shop_1", "display_name": "Shop", "faces": 6 }]);
    assert_eq!(uploaded["report"], json!({ "room_count": 1, "rooms": rooms }));
    assert_eq!(service.json(&path).await, uploaded);
    let by_id = service.submit(&job(uploaded["id"].clone())).await;
    let whole = service.submit(&job(model())).await;
    let jobs = [by_id, whole];
    for job in &jobs {
        let ended = service.finished(job).await;
        assert_eq!(ended["status"], "succeeded", "{ended}");
        assert_eq!(ended["document"]["room"]["faces"][5]["name"], "roof");
        let told = ended["warnings"].as_array().unwrap().iter().filter(|warning| warning["code"] == "model_changed");
        let told: Vec<&str> = told.map(|warning| warning["detail"].as_str().unwrap()).collect();
        assert!(told.iter().any(|detail| detail.contains("1 apertures")), "{told:?}");
        let figures = ended["links"]["figures"].as_object().unwrap();
        assert!(!figures.is_empty());
        for figure in figures.values() {
            let path = figure["svg"].as_str().unwrap();
            assert_eq!(service.get(path).send().await.unwrap().status(), StatusCode::OK, "{path}");
        }
    }
    problem(service.request(Method::DELETE, &path).send().await.unwrap(), 409).await;
    for job in &jobs {
        let deleted = service.request(Method::DELETE, job).send().await.unwrap();
        assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    }
    assert_eq!(service.request(Method::DELETE, &path).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    problem(service.get(&path).send().await.unwrap(), 404).await;
    let gone = problem(service.post_job(&job(uploaded["id"].clone())).send().await.unwrap(), 422).await;
    assert_eq!(gone["errors"][0]["pointer"], "/room/hbjson");
    let mut open = model();
    open["rooms"][0]["faces"].as_array_mut().unwrap().pop();
    let open = problem(service.post_job(&job(open)).send().await.unwrap(), 422).await;
    assert_eq!(open["errors"][0]["pointer"], "/room/hbjson/rooms/0/faces");
    for (body, words) in [
        ("{", "EOF"),
        ("{\"rooms\": 3}", "/rooms"),
        ("{}", "at least one room"),
        ("[]", "at least one room"),
        ("{\"units\": \"Miles\"}", "/units"),
        (&format!("{{\"units\": \"{}\"}}", "M".repeat(5000)), "/units"),
    ] {
        let broken = problem(upload(body.to_owned(), "text/plain").await.unwrap(), 422).await;
        assert_eq!(broken["type"], "/problems/invalid-model");
        let detail = broken["detail"].as_str().unwrap();
        assert!(detail.contains(words) && detail.len() < 400, "{broken}");
    }
    problem(upload(String::new(), "model/obj").await.unwrap(), 415).await;
}

#[tokio::test]
async fn a_study_takes_a_model_by_its_id() {
    let service = TestService::start().await;
    let upload = service.request(Method::POST, "/v1/models").header("content-type", "application/json");
    let uploaded: Value = upload.body(model().to_string()).send().await.unwrap().json().await.unwrap();
    let asked = json!({ "job": job(uploaded["id"].clone()), "methods": ["light_tracing"], "relative_errors": [0.5], "seconds": 1 });
    let post = service.request(Method::POST, "/v1/studies").header("content-type", "application/json");
    let answer = post.body(asked.to_string()).send().await.unwrap();
    let status = answer.status();
    assert_eq!(status, StatusCode::ACCEPTED, "{}", answer.text().await.unwrap());
}

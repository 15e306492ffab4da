//! Years of daylight over HTTP: weather, job, results and files.

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use crate::common::{TestService, problem, small_job};

const SYNTHETIC: &str = include_str!("../../../examples/synthetic.epw");

/// A small room with a year of the given weather.
fn year(weather: &str) -> Value {
    let mut job = small_job();
    let fields = job.as_object_mut().unwrap();
    ["sky", "time", "location", "views", "method"].iter().for_each(|field| drop(fields.remove(*field)));
    job["annual"] = json!({ "weather": weather });
    job["stop"] = json!({ "relative_error": 0.05 });
    job
}

#[tokio::test]
async fn a_year_from_weather_to_files() {
    let service = TestService::start().await;
    let upload = service.request(Method::POST, "/v1/weather").header("content-type", "text/plain").body(SYNTHETIC);
    let weather: Value = upload.send().await.unwrap().json().await.unwrap();
    let id = weather["id"].as_str().unwrap();
    let path = service.submit(&year(id)).await;
    let job = service.finished(&path).await;
    assert_eq!(job["status"], "succeeded", "{job}");

    let links: Vec<&str> =
        job["links"]["annual"].as_array().unwrap().iter().map(|link| link.as_str().unwrap()).collect();
    assert_eq!(links[0], format!("{path}/annual"));
    let summary = service.json(links[0]).await;
    assert_eq!(summary["site"]["name"], "Synthetic");
    assert_eq!(summary["conventions"]["occupied_hours"], 3650.0);
    assert!(summary["tubes"][0]["klm_h"]["value"].as_f64().unwrap() > 0.0);
    let verdicts = summary["grids"][0]["verdicts"].as_array().unwrap();
    assert!(verdicts.len() > 10 && verdicts.iter().all(|verdict| verdict["basis"].is_string()));
    for link in &links[1..] {
        let answer = service.get(link).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{link}");
        assert!(!answer.bytes().await.unwrap().is_empty(), "{link}");
    }
    problem(service.get(&format!("{path}/annual/points.none.csv")).send().await.unwrap(), 404).await;

    // files are made of the weather as long as the job is there
    let weather = format!("/v1/weather/{id}");
    problem(service.request(Method::DELETE, &weather).send().await.unwrap(), 409).await;
    assert_eq!(service.request(Method::DELETE, &path).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    assert_eq!(service.request(Method::DELETE, &weather).send().await.unwrap().status(), StatusCode::NO_CONTENT);
}

#[tokio::test]
async fn years_without_weather_and_jobs_without_years() {
    let service = TestService::start().await;
    let refused = service.request(Method::POST, "/v1/jobs").json(&year("none")).send().await.unwrap();
    let refused = problem(refused, 422).await;
    assert_eq!(refused["errors"][0]["pointer"], "/annual/weather", "{refused}");
    let path = service.submit(&small_job()).await;
    let job = service.finished(&path).await;
    assert!(job["links"]["annual"].is_null());
    problem(service.get(&format!("{path}/annual")).send().await.unwrap(), 404).await;
    problem(service.get(&format!("{path}/annual/hours.csv")).send().await.unwrap(), 404).await;
}

#[tokio::test]
async fn other_daylight_from_upload_to_deletion() {
    let service = TestService::start().await;
    let upload = service.request(Method::POST, "/v1/weather").header("content-type", "text/plain").body(SYNTHETIC);
    let weather: Value = upload.send().await.unwrap().json().await.unwrap();
    let mut job = year(weather["id"].as_str().unwrap());
    let grid = &job["grids"][0];
    let cells = grid["cells"].as_array().unwrap().iter().map(|cells| cells.as_u64().unwrap() as usize).product();
    let post = |body: Vec<u8>| service.request(Method::POST, "/v1/arrays").body(body).send();
    problem(post(b"x".to_vec()).await.unwrap(), 422).await;
    let array = skyduct::output::npy::encode([cells, 8760], std::iter::repeat_n(400.0, cells * 8760));
    let posted = post(array).await.unwrap();
    assert_eq!(posted.status(), StatusCode::CREATED);
    let path = posted.headers()["location"].to_str().unwrap().to_owned();
    let array: Value = posted.json().await.unwrap();
    assert_eq!((&array["rows"], &array["columns"]), (&json!(cells), &json!(8760)));
    assert_eq!(service.json(&path).await, array);
    job["annual"]["other_daylight"] = json!([{ "grid": grid["name"], "file": array["id"] }]);
    let of_job = service.submit(&job).await;
    assert_eq!(service.finished(&of_job).await["status"], "succeeded");
    let summary = service.json(&format!("{of_job}/annual")).await;
    assert!(summary["grids"][0]["mean_lux"]["value"].as_f64().unwrap() > 300.0);
    problem(service.request(Method::DELETE, &path).send().await.unwrap(), 409).await;
    service.request(Method::DELETE, &of_job).send().await.unwrap();
    assert_eq!(service.request(Method::DELETE, &path).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    problem(service.get(&path).send().await.unwrap(), 404).await;
}

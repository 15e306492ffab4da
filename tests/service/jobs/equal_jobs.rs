//! Jobs with equal documents are one computation, and lives of their own.

use std::time::Duration;

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use crate::common::{PATIENCE, TestService, endless_job, small_job};

/// Files of a job, those that are kept and those that are made again.
async fn files(service: &TestService, path: &str) -> Vec<(&'static str, Vec<u8>)> {
    let mut files = Vec::new();
    for name in [
        "grids/workplane.json",
        "grids/workplane.csv",
        "grids/workplane.svg",
        "views/room.png",
        "views/room.exr",
        "views/room.png?pass=4",
        "tubes/0.json",
        "convergence.csv",
    ] {
        let answer = service.get(&format!("{path}/{name}")).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{path}/{name}");
        files.push((name, answer.bytes().await.unwrap().into()));
    }
    files
}

/// Names and data of a job's events.
async fn events(service: &TestService, path: &str) -> Vec<(String, Value)> {
    let events = service.events_after(path, 0).await;
    assert!(events.iter().zip(1..).all(|(event, id)| event.id == id), "gapless");
    // the first one has the job's id, and images have its path
    let data = |mut data: Value| {
        data["url"].take();
        data
    };
    events.into_iter().skip(1).map(|event| (event.name, data(event.data))).collect()
}

async fn until(service: &TestService, path: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let found = async {
        loop {
            let job = service.json(path).await;
            if is_so(&job) {
                return job;
            }
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    tokio::time::timeout(PATIENCE, found).await.expect("it comes to that")
}

fn is_running(job: &Value) -> bool {
    job["status"] == "running" && job["progress"]["passes"].as_u64().unwrap() > 0
}

async fn delete(service: &TestService, path: &str) {
    let deleted = service.request(Method::DELETE, path).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
}

/// The second job has another id and the results of the first, to the bit and with its times: it was not rendered. What becomes of the
/// first is nothing to it.
#[tokio::test]
async fn an_equal_job_takes_the_results_of_the_one_before() {
    let service = TestService::start().await;
    let first = service.submit(&small_job()).await;
    let rendered = service.finished(&first).await;
    assert!(rendered.get("computed_by").is_none());
    let (expected, told) = (files(&service, &first).await, events(&service, &first).await);

    // with a default that is written, and without a key
    let mut equal = small_job();
    equal["stop"]["confidence"] = json!(0.95);
    let second = service.submit(&equal).await;
    assert_ne!(second, first);
    let taken = service.finished(&second).await;
    assert_eq!(taken["computed_by"], rendered["id"]);
    for field in ["status", "stopped_by", "progress", "timing", "accuracy", "grids", "tubes", "document", "plan"] {
        assert_eq!(taken[field], rendered[field], "{field}");
    }
    assert_eq!(events(&service, &second).await, told);
    assert_eq!(files(&service, &second).await, expected);

    delete(&service, &first).await;
    assert_eq!(files(&service, &second).await, expected);
    let third = service.submit(&small_job()).await;
    assert_eq!(service.finished(&third).await["computed_by"], rendered["id"], "the one that was rendered");
    delete(&service, &second).await;
    assert_eq!(files(&service, &third).await, expected);

    // another seed is another computation
    let mut other = small_job();
    other["seed"] = json!(8);
    let other = service.submit(&other).await;
    let other = service.finished(&other).await;
    assert!(other.get("computed_by").is_none());
    assert_ne!(other["grids"], rendered["grids"]);
}

/// One that is equal to a running job is not rendered beside it, nor does it end with it; others go on.
#[tokio::test]
async fn an_equal_job_waits_for_the_one_that_runs() {
    let service = TestService::start().await;
    let first = service.submit(&endless_job()).await;
    until(&service, &first, is_running).await;
    let [second, third] = [service.submit(&endless_job()).await, service.submit(&endless_job()).await];
    // one that comes after them is rendered before
    let other = service.submit(&small_job()).await;
    assert_eq!(service.finished(&other).await["status"], "succeeded");
    assert!(is_running(&service.json(&first).await));
    for path in [&second, &third] {
        assert_eq!(service.json(path).await["status"], "queued");
    }
    let cancel = |path: String| service.request(Method::POST, &format!("{path}/cancel")).send();
    assert_eq!(cancel(first.clone()).await.unwrap().status(), StatusCode::ACCEPTED);
    assert_eq!(service.finished(&first).await["status"], "cancelled");
    // a part of what was asked for is nobody else's result
    until(&service, &second, is_running).await;
    assert_eq!(service.json(&third).await["status"], "queued");
    delete(&service, &second).await;
    until(&service, &third, is_running).await;
    assert_eq!(cancel(third.clone()).await.unwrap().status(), StatusCode::ACCEPTED);
    assert_eq!(service.finished(&third).await["status"], "cancelled");
    assert_eq!(service.json(&first).await["status"], "cancelled");
}

/// A result that a limit of seconds has cut short goes to the jobs that waited for it, but to none that is posted later.
#[tokio::test]
async fn seconds_make_a_result_of_their_time() {
    let service = TestService::start().await;
    let mut job = endless_job();
    job["stop"]["max_seconds"] = json!(0.5);
    let first = service.submit(&job).await;
    let second = service.submit(&job).await;
    let [first, second] = [service.finished(&first).await, service.finished(&second).await];
    assert_eq!((&first["status"], &first["stopped_by"]), (&json!("succeeded"), &json!("max_seconds")));
    assert_eq!((&second["computed_by"], &second["progress"]), (&first["id"], &first["progress"]));
    let later = service.submit(&job).await;
    assert!(service.finished(&later).await.get("computed_by").is_none());
}

/// A study compares times: each of its jobs is rendered, whatever was rendered before.
#[tokio::test]
async fn jobs_of_studies_are_rendered() {
    let service = TestService::start().await;
    let mut job = small_job();
    job["views"] = json!([]);
    let study = json!({ "job": job, "methods": ["light_tracing"], "relative_errors": [0.5], "seeds": 1 });
    for _ in 0..2 {
        let answer = service.post("/v1/studies", &study).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::ACCEPTED);
        let path = answer.headers()["location"].to_str().unwrap().to_owned();
        until(&service, &path, |study| study["status"] == "finished").await;
    }
    for job in service.json("/v1/jobs").await["jobs"].as_array().unwrap() {
        let job = service.json(job["links"]["self"].as_str().unwrap()).await;
        assert_eq!((&job["status"], job.get("computed_by")), (&json!("succeeded"), None));
    }
}

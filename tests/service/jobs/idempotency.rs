//! Posts of jobs with an `Idempotency-Key`: repeated ones find the job of the first.

use crate::common::{TestService, problem, small_job};
use reqwest::{Method, Response};
use serde_json::{Value, json};

/// Posts a body with a key.
async fn post(service: &TestService, key: &str, body: String) -> Response {
    let request = service.request(Method::POST, "/v1/jobs").header("content-type", "application/json");
    request.header("idempotency-key", key.as_bytes()).body(body).send().await.unwrap()
}

/// Path of the job, and whether the answer says that it is an earlier post's.
fn job(answer: &Response) -> (String, bool) {
    assert_eq!(answer.status(), 202);
    let replayed = answer.headers().get("idempotency-replayed");
    assert!(replayed.is_none_or(|value| value == "true"), "{replayed:?}");
    (answer.headers()["location"].to_str().unwrap().to_owned(), replayed.is_some())
}

/// The small job with another seed.
fn other_job() -> Value {
    let mut other = small_job();
    other["seed"] = json!(8);
    other
}

#[tokio::test]
async fn an_idempotency_key_makes_one_job() {
    let service = TestService::start().await;
    let posts = (0..20).map(|_| post(&service, "key 1", small_job().to_string()));
    let answers = futures::future::join_all(posts).await.iter().map(job).collect::<Vec<_>>();
    assert_eq!(answers.iter().filter(|(_, replayed)| *replayed).count(), 19);
    assert!(answers.iter().all(|(path, _)| *path == answers[0].0), "{answers:?}");
    assert_eq!(service.json("/v1/jobs").await["jobs"].as_array().unwrap().len(), 1);
}

/// White space, the order of fields and the way to write a number make no other document.
#[tokio::test]
async fn a_key_knows_its_document_however_it_is_written() {
    let service = TestService::start().await;
    let (first, _) = job(&post(&service, "key", small_job().to_string()).await);
    let mut rewritten = small_job();
    rewritten["method"]["photons_per_pass"] = json!(2000);
    rewritten["sky"]["zenith_luminance_cd_m2"] = json!(5000.0);
    for body in [serde_json::to_string_pretty(&small_job()).unwrap(), rewritten.to_string()] {
        assert_eq!(job(&post(&service, "key", body).await), (first.clone(), true));
    }
}

#[tokio::test]
async fn a_key_of_another_document_is_refused() {
    let service = TestService::start().await;
    job(&post(&service, "key", small_job().to_string()).await);
    let reused = problem(post(&service, "key", other_job().to_string()).await, 422).await;
    assert_eq!(reused["type"], "/problems/key-reused");
    // a field that is given twice is refused, whatever its last value
    let twice = small_job().to_string().replacen('{', "{\"seed\": 8, ", 1);
    let twice = problem(post(&service, "key", twice).await, 422).await;
    assert_eq!(twice["type"], "/problems/invalid-document");
}

#[tokio::test]
async fn other_keys_and_no_key_make_other_jobs() {
    let service = TestService::start().await;
    let mut jobs = vec![job(&post(&service, "key 1", other_job().to_string()).await)];
    jobs.push(job(&post(&service, "key 2", other_job().to_string()).await));
    jobs.push(job(&service.post_job(&other_job()).send().await.unwrap()));
    assert!(jobs.iter().all(|(_, replayed)| !replayed), "{jobs:?}");
    assert!(jobs[0].0 != jobs[1].0 && jobs[1].0 != jobs[2].0 && jobs[2].0 != jobs[0].0, "{jobs:?}");
}

#[tokio::test]
async fn keys_that_are_none_are_refused() {
    let service = TestService::start().await;
    for key in ["", &"x".repeat(256), "\u{e9}"] {
        problem(post(&service, key, small_job().to_string()).await, 400).await;
    }
}

//! Ended jobs are deleted: many by one request, and by the retention.

use std::time::Instant;

use crate::common::{PATIENCE, TestService, client, config, small_job};
use crate::studies::{request, wait_for};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use skyduct::cli::serve::RunningService;
use skyduct::queue::retention::Retention;

async fn delete(service: &TestService, query: &str) -> Value {
    let answer = service.request(Method::DELETE, &format!("/v1/jobs?{query}")).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::OK);
    answer.json().await.unwrap()
}

async fn is_there(service: &TestService, path: &str) -> bool {
    service.get(path).send().await.unwrap().status() == StatusCode::OK
}

/// Only ended jobs go, those of a status if it is named, and none of a study.
#[tokio::test]
async fn ended_jobs_are_deleted_by_one_request() {
    let service = TestService::start().await;
    let study = service.post("/v1/studies", &request()).send().await.unwrap().json::<Value>().await.unwrap();
    let study = format!("/v1/studies/{}", study["id"].as_str().unwrap());
    let mut jobs = Vec::new();
    for seed in 0..3 {
        let mut document = small_job();
        document["seed"] = seed.into();
        let job = service.submit(&document).await;
        assert_eq!(service.finished(&job).await["status"], "succeeded");
        jobs.push(job);
    }
    wait_for(&service.running.url(), &study, &["finished"]).await;
    let none = json!({ "deleted": 0, "more": false });
    assert_eq!(delete(&service, "ended_before=2020-01-01T00:00:00Z").await, none);
    assert_eq!(delete(&service, "ended_before=2100-01-01T00:00:00Z&status=cancelled").await, none);
    assert!(is_there(&service, &jobs[0]).await);
    let deleted = delete(&service, "ended_before=2100-01-01T00:00:00Z&status=succeeded").await;
    assert_eq!(deleted, json!({ "deleted": 3, "more": false }));
    for job in &jobs {
        assert!(!is_there(&service, job).await);
    }
    assert!(is_there(&service, &study).await);
    for query in
        ["", "?status=succeeded", "?ended_before=yesterday", "?ended_before=2020-01-01T00:00:00Z&status=running"]
    {
        let answer = service.request(Method::DELETE, &format!("/v1/jobs{query}")).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::UNPROCESSABLE_ENTITY, "{query}");
    }
}

/// After a start with a retention what is too old goes, a study with all of its jobs; with bounds that hold nothing goes.
#[tokio::test]
async fn the_retention_deletes_what_is_too_old_or_too_much() {
    let keeps_all = Retention { days: Some(1.0), bytes: Some(1 << 40) };
    for (retention, goes) in [
        (keeps_all, false),
        (Retention { days: Some(1e-9), bytes: None }, true),
        (Retention { days: None, bytes: Some(0) }, true),
    ] {
        let service = TestService::start().await;
        let job = service.submit(&small_job()).await;
        service.finished(&job).await;
        let study = service.post("/v1/studies", &request()).send().await.unwrap().json::<Value>().await.unwrap();
        let study = format!("/v1/studies/{}", study["id"].as_str().unwrap());
        wait_for(&service.running.url(), &study, &["finished"]).await;
        let TestService { running, data, .. } = service;
        running.stop().await;
        let mut with_retention = config(data.path());
        with_retention.retention = retention;
        let running = RunningService::start(with_retention).await.unwrap();
        let service = TestService { running, http: client(), data };
        let begun = Instant::now();
        while goes && (is_there(&service, &job).await || is_there(&service, &study).await) {
            assert!(begun.elapsed() < PATIENCE, "{retention:?}");
            tokio::time::sleep(std::time::Duration::from_millis(20)).await;
        }
        if !goes {
            tokio::time::sleep(std::time::Duration::from_millis(300)).await;
            assert!(is_there(&service, &job).await && is_there(&service, &study).await);
        }
        let left = service.json("/v1/jobs").await["jobs"].as_array().unwrap().len();
        assert_eq!(left == 0, goes, "{left}");
    }
}

//! Jobs that arrive beside others, or from clients that go away.

use std::time::{Duration, SystemTime};

use reqwest::Method;

use crate::common;
use crate::common::{TestService, endless_job, small_job};

#[tokio::test]
async fn a_short_job_need_not_wait_for_long_ones() {
    let service = TestService::start().await;
    let mut other = endless_job();
    other["seed"] = 8.into();
    let long = [service.submit(&endless_job()).await, service.submit(&other).await];
    for job in &long {
        service.events_until(job, 0, |event| event.name == "pass").await;
    }
    let short = service.submit(&small_job()).await;
    assert_eq!(service.finished(&short).await["status"], "succeeded");
    for job in &long {
        assert_eq!(service.json(job).await["status"], "running");
        service.request(Method::DELETE, job).send().await.unwrap();
    }
}

/// Each connection is closed as soon as its request is written.
#[tokio::test]
async fn a_job_exists_though_its_client_went_away() {
    use tokio::io::AsyncWriteExt;
    const POSTS: usize = 20;
    let service = TestService::start().await;
    let mut document = small_job();
    document["stop"]["max_passes"] = 1.into();
    let body = document.to_string();
    for _ in 0..POSTS {
        let mut connection = tokio::net::TcpStream::connect(service.running.address).await.unwrap();
        let host = service.running.address;
        let head = format!(
            "POST /v1/jobs HTTP/1.1\r\nhost: {host}\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n",
            body.len()
        );
        connection.write_all((head + &body).as_bytes()).await.unwrap();
    }
    let deadline = SystemTime::now() + common::PATIENCE;
    loop {
        let jobs = service.json("/v1/jobs").await["jobs"].as_array().unwrap().len();
        if jobs == POSTS {
            break;
        }
        assert!(SystemTime::now() < deadline, "{jobs} of {POSTS} jobs");
        tokio::time::sleep(Duration::from_millis(100)).await;
    }
}

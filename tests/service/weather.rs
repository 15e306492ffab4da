//! Uploaded weather files, and the command that reads one.

use std::process::Command;

use crate::common::{TestService, problem};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

const SYNTHETIC: &str = include_str!("../../examples/synthetic.epw");

/// The first two days of the year as a file of its own, with a line of the header and a text in it replaced.
fn two_days(line: usize, from: &str, to: &str) -> String {
    let lines = SYNTHETIC.lines().take(8 + 48).enumerate().map(|(k, text)| match k + 1 {
        8 => "DATA PERIODS,1,1,Data,Sunday, 1/ 1, 1/ 2\n".to_owned(),
        number if number == line => text.replacen(from, to, 1) + "\n",
        _ => text.to_owned() + "\n",
    });
    lines.collect()
}

#[tokio::test]
async fn a_weather_file_from_upload_to_delete() {
    let service = TestService::start().await;
    let upload =
        || service.request(Method::POST, "/v1/weather").header("content-type", "text/plain").body(SYNTHETIC).send();
    let response = upload().await.unwrap();
    assert_eq!(response.status(), StatusCode::CREATED);
    let path = response.headers()["location"].to_str().unwrap().to_owned();
    let weather: Value = response.json().await.unwrap();
    assert_eq!(weather["id"], blake3::hash(SYNTHETIC.as_bytes()).to_hex()[..32]);
    let report = &weather["report"];
    assert_eq!(
        (&report["name"], &report["format"], &report["utc_offset_hours"]),
        (&json!("Synthetic"), &json!("epw"), &json!(1.0))
    );
    assert_eq!((&report["records"], &report["records_with_light"]), (&json!(8760), &json!(4396)));
    assert_eq!((&report["closure"]["best_offset_minutes"], &report["warnings"]), (&json!(-30.0), &json!([])));
    assert_eq!(service.json(&path).await, weather);
    let again: Value = upload().await.unwrap().json().await.unwrap();
    assert_eq!(again, weather);

    // it is no mesh
    let as_mesh = path.replace("weather", "meshes");
    problem(service.get(&as_mesh).send().await.unwrap(), 404).await;
    problem(service.request(Method::DELETE, &as_mesh).send().await.unwrap(), 404).await;
    let deleted = service.request(Method::DELETE, &path).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    problem(service.get(&path).send().await.unwrap(), 404).await;
    problem(service.request(Method::DELETE, &path).send().await.unwrap(), 404).await;
    assert_eq!(std::fs::read_dir(service.data.path().join("artifacts/weather")).map_or(0, Iterator::count), 0);
}

#[tokio::test]
async fn a_broken_weather_file_is_refused_with_its_line_and_field() {
    let service = TestService::start().await;
    let upload = async |text: String, content_type: &str| {
        service
            .request(Method::POST, "/v1/weather")
            .header("content-type", content_type)
            .body(text)
            .send()
            .await
            .unwrap()
    };
    assert_eq!(upload(two_days(0, "", ""), "").await.status(), StatusCode::CREATED);
    for (line, from, to, fault) in [
        (1, "55.77", "155.77", "line 1, field 7 (latitude)"),
        (20, ",1,12,", ",1,25,", "line 20, field 4 (hour)"),
        (20, ",1,12,", ",1,13,", "line 20: "),
    ] {
        let broken = problem(upload(two_days(line, from, to), "text/plain").await, 422).await;
        assert_eq!(broken["type"], "/problems/invalid-weather");
        assert!(broken["detail"].as_str().unwrap().starts_with(fault), "{broken}");
    }
    problem(upload(String::new(), "text/plain").await, 422).await;
    problem(upload(" ".repeat((16 << 20) + 1), "text/plain").await, 413).await;
    problem(upload("{}".into(), "application/json").await, 415).await;
    problem(upload("x".into(), "model/obj").await, 415).await;
}

#[test]
fn the_command_prints_the_report_or_the_fault() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("two_days.epw");
    let run = |text: String| {
        std::fs::write(&file, text).unwrap();
        Command::new(env!("CARGO_BIN_EXE_skyduct")).arg("weather").arg(&file).output().unwrap()
    };
    let good = run(two_days(0, "", ""));
    assert!(good.status.success());
    let report: Value = serde_json::from_slice(&good.stdout).unwrap();
    assert_eq!((&report["from"], &report["to"], &report["closure"]), (&json!("01-01"), &json!("01-02"), &Value::Null));
    let bad = run(two_days(20, ",1,12,", ",1,25,"));
    assert_eq!(bad.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&bad.stderr).contains("line 20, field 4 (hour)"));
}

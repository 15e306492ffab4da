//! What the built service tells an operator: lines at its start, and its log.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};

use crate::common::{client, small_job};
use reqwest::StatusCode;
use serde_json::Value;

/// Serves until a job has finished and a document was refused; answers standard output and standard error.
async fn serve(data: &std::path::Path, environment: &[(&str, &str)]) -> (String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
    command.args(["serve", "--listen", "127.0.0.1:0", "--data"]).arg(data);
    command.env_remove("RUST_LOG").envs(environment.iter().copied());
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stdout = BufReader::new(child.stdout.take().unwrap());
    let mut told = String::new();
    stdout.read_line(&mut told).unwrap();
    let url = told.trim().strip_prefix("listening on ").expect("the address").to_owned();
    let mut job = small_job();
    job["name"] = "a bathroom".into();
    let accepted = client().post(format!("{url}/v1/jobs")).json(&job).send().await.unwrap();
    assert_eq!(accepted.status(), StatusCode::ACCEPTED);
    let path = accepted.headers()["location"].to_str().unwrap().to_owned();
    client().get(format!("{url}{path}/events")).send().await.unwrap().bytes().await.unwrap();
    let refused = client().post(format!("{url}/v1/jobs")).json(&Value::Null).send().await.unwrap();
    assert_eq!(refused.status(), StatusCode::UNPROCESSABLE_ENTITY);
    assert!(Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap().success());
    stdout.read_to_string(&mut told).unwrap();
    let mut log = String::new();
    child.stderr.take().unwrap().read_to_string(&mut log).unwrap();
    assert!(child.wait().unwrap().success(), "{log}");
    (told.replace(&url, "URL"), log)
}

#[tokio::test]
async fn the_log_has_one_line_when_a_job_starts_and_one_when_it_ends() {
    let data = tempfile::tempdir().unwrap();
    let (told, log) = serve(data.path(), &[("SKYDUCT_LOG__FORMAT", "json")]).await;
    assert_eq!(told, format!("listening on URL\ndata in {}\npage at URL/\n", data.path().display()));
    let lines: Vec<Value> =
        log.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error}: {line}"))).collect();
    let of = |message: &str| lines.iter().filter(|line| line["message"] == message).cloned().collect::<Vec<_>>();
    let (started, finished) = (of("job started"), of("job finished"));
    assert_eq!((started.len(), finished.len()), (1, 1), "{log}");
    for line in [&started[0], &finished[0]] {
        assert_eq!((&line["level"], &line["name"]), (&"INFO".into(), &"a bathroom".into()));
        assert_eq!(line["method"], "sppm");
        assert!(line["span"]["job"].as_str().is_some_and(|id| id.len() == 36), "{line}");
    }
    assert_eq!((&finished[0]["status"], &finished[0]["stopped_by"]), (&"succeeded".into(), &"max_passes".into()));
    assert_eq!(finished[0]["passes"], 20);
    assert!(finished[0]["seconds"].as_f64().unwrap() > 0.0);
    assert!(lines.iter().all(|line| line["target"].as_str().unwrap().starts_with("skyduct")), "no request: {log}");
    assert!(lines.len() < 12, "{log}");
}

/// Into a pipe there are no colours.
#[tokio::test]
async fn requests_are_logged_at_debug_and_rust_log_wins() {
    let data = tempfile::tempdir().unwrap();
    let (_, log) = serve(data.path(), &[("SKYDUCT_LOG__LEVEL", "debug")]).await;
    assert!(log.lines().filter(|line| line.contains("path=\"/v1/jobs\"")).count() >= 2, "{log}");
    assert!(!log.contains('\x1b'), "{log}");
    let data = tempfile::tempdir().unwrap();
    let (_, log) = serve(data.path(), &[("SKYDUCT_LOG__LEVEL", "debug"), ("RUST_LOG", "error")]).await;
    assert_eq!(log, "");
}

//! Backups that are made while the service works, and services that start on them.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::common::{TestService, client, config, small_job};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};
use skyduct::cli::serve::RunningService;

fn backup(data: &Path, to: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_skyduct"));
    command.arg("backup").arg(to).arg("--data").arg(data).output().unwrap()
}

fn refusal(data: &Path, to: &Path) -> String {
    let output = backup(data, to);
    assert!(!output.status.success());
    String::from_utf8(output.stderr).unwrap()
}

/// A job with files, or one whose results are rows.
fn job(number: u64) -> Value {
    let mut job = small_job();
    job["seed"] = json!(number);
    job["stop"]["max_passes"] = json!(4);
    if number.is_multiple_of(2) {
        job["views"] = json!([]);
        job["method"] = json!({ "kind": "light_tracing", "photons_per_pass": 64 });
    }
    job
}

/// A job's results, each with its bytes; no answer is a failure of the service.
async fn results(service: &TestService, path: &str) -> Vec<(StatusCode, Vec<u8>)> {
    let mut results = Vec::new();
    for name in ["grids/workplane", "views/room.png", "views/room.exr", "convergence", "grids/workplane?format=csv"] {
        let answer = service.get(&format!("{path}/{name}")).send().await.unwrap();
        let status = answer.status();
        assert!(!status.is_server_error(), "{path}/{name}: {status}");
        results.push((status, answer.bytes().await.unwrap().into()));
    }
    results
}

/// Clients post, and delete every fifth job, while backups are made: each starts, has every job that had ended before, to the bit, and
/// goes on with those that had not.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_backup_under_load_has_every_result_and_goes_on() {
    let service = TestService::start().await;
    let (ended, enough) = (Mutex::new(Vec::new()), AtomicBool::new(false));
    let folder = tempfile::tempdir().unwrap();
    let clients = futures::future::join_all((0..3).map(|client| {
        let (service, ended, enough) = (&service, &ended, &enough);
        async move {
            for number in (0..).take_while(|_| !enough.load(Ordering::Relaxed)) {
                let path = service.submit(&job(1000 * client + number)).await;
                // some are left waiting
                if number % 3 > 0 {
                    assert_eq!(service.finished(&path).await["status"], "succeeded");
                    match number % 5 {
                        0 => drop(service.request(Method::DELETE, &path).send().await.unwrap()),
                        _ => ended.lock().unwrap().push(path),
                    }
                }
            }
        }
    }));
    let backups = async {
        let mut backups = Vec::new();
        for number in 0..3 {
            while ended.lock().unwrap().len() < 8 * (number + 1) {
                tokio::time::sleep(std::time::Duration::from_millis(20)).await;
            }
            let known = ended.lock().unwrap().clone();
            let to = folder.path().join(number.to_string());
            let (data, made) = (service.data.path().to_owned(), to.clone());
            let output = tokio::task::spawn_blocking(move || backup(&data, &made)).await.unwrap();
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
            backups.push((to, known));
        }
        enough.store(true, Ordering::Relaxed);
        backups
    };
    let (_, backups) = tokio::join!(clients, backups);
    for (folder, known) in &backups {
        let running = RunningService::start(config(folder)).await.unwrap();
        let restored = TestService { running, http: client(), data: tempfile::tempdir().unwrap() };
        for path in known {
            assert_eq!(restored.json(path).await["status"], "succeeded", "{path}");
            assert_eq!(results(&restored, path).await, results(&service, path).await, "{path}");
        }
        let jobs = restored.json("/v1/jobs?limit=500").await;
        for job in jobs["jobs"].as_array().unwrap() {
            let path = format!("/v1/jobs/{}", job["id"].as_str().unwrap());
            assert_eq!(restored.finished(&path).await["status"], "succeeded");
            results(&restored, &path).await;
        }
        // what is deleted in one is there in the other
        let deleted = known.last().unwrap();
        let before = results(&service, deleted).await;
        restored.request(Method::DELETE, deleted).send().await.unwrap();
        assert_eq!(results(&service, deleted).await, before);
        restored.running.stop().await;
    }
    // neither takes the other's files for its own
    let TestService { running, data, .. } = service;
    running.stop().await;
    let mut crossed = config(data.path());
    crossed.database = Some(format!("sqlite:{}", backups[0].0.join("skyduct.db").display()));
    let refusal = format!("{:#}", RunningService::start(crossed).await.err().unwrap());
    assert!(refusal.contains("belong to another database"), "{refusal}");
    // of a service that has stopped, too
    let to = folder.path().join("stopped");
    assert!(backup(data.path(), &to).status.success());
    RunningService::start(config(&to)).await.unwrap().stop().await;
}

#[tokio::test]
async fn a_backup_that_cannot_be_is_refused_and_says_why() {
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("backup");
    let none = refusal(&folder.path().join("none"), &to);
    assert!(none.contains("there is no database") && none.contains("--data"), "{none}");
    assert!(!to.exists());
    let service = TestService::start().await;
    std::fs::create_dir(&to).unwrap();
    std::fs::write(to.join("x"), b"").unwrap();
    let full = refusal(service.data.path(), &to);
    assert!(full.contains("is not empty"), "{full}");
    assert_eq!(std::fs::read_dir(&to).unwrap().count(), 1, "nothing was written");
    // a result that is gone is told, and all else is there
    let path = service.submit(&job(1)).await;
    service.finished(&path).await;
    let files = service.data.path().join("artifacts/jobs").join(path.rsplit('/').next().unwrap());
    let picture = std::fs::read_dir(files).unwrap().map(|file| file.unwrap().path());
    let picture = picture.into_iter().find(|file| file.to_string_lossy().ends_with("views_room.png")).unwrap();
    std::fs::remove_file(picture).unwrap();
    let to = folder.path().join("damaged");
    let damaged = refusal(service.data.path(), &to);
    assert!(damaged.contains("1 result files are missing"), "{damaged}");
    let running = RunningService::start(config(&to)).await.unwrap();
    let restored = TestService { running, http: client(), data: tempfile::tempdir().unwrap() };
    let grid = restored.get(&format!("{path}/grids/workplane")).send().await.unwrap();
    assert_eq!(grid.status(), StatusCode::OK);
    restored.running.stop().await;
}

/// Of a backup that did not get to its end nothing is taken for a whole one.
#[tokio::test]
async fn no_service_starts_on_half_a_backup() {
    let service = TestService::start().await;
    let folder = tempfile::tempdir().unwrap();
    let to = folder.path().join("backup");
    assert!(backup(service.data.path(), &to).status.success());
    std::fs::rename(to.join("skyduct.db"), to.join("skyduct.db.part")).unwrap();
    let refusal = format!("{:#}", RunningService::start(config(&to)).await.err().unwrap());
    assert!(refusal.contains("this database has no identity"), "{refusal}");
}

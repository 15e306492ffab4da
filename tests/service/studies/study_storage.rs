//! Studies on the disk: what a crash leaves, what is stored once, and what is computed once.

use std::path::Path;
use std::time::Instant;

use reqwest::StatusCode;
use serde_json::{Value, json};
use skyduct::cli::mesh_files::MeshFiles;
use skyduct::db::SqliteStore;
use skyduct::queue::store::{SetStore, Store};
use skyduct::study::StudyRequest;
use skyduct::study::request::RunKey;

use crate::common::{self, PATIENCE, client};
use crate::process::Server;
use crate::schema;
use crate::studies::{path, request, wait_for};

/// A service that is killed in the middle of a study finishes it after a start: no run is lost, and none is made twice.
#[tokio::test]
async fn a_crash_loses_nothing_of_a_study() {
    let data = tempfile::tempdir().unwrap();
    let mut asked = request();
    // some seconds in all
    asked["methods"] = json!(["light_tracing", "path_tracing"]);
    asked["relative_errors"] = json!([0.02, 0.005]);
    let server = Server::start(data.path(), &[]);
    let answer = client().post(format!("{}/v1/studies", server.url)).json(&asked).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    let posted: Value = answer.json().await.unwrap();
    let begin = Instant::now();
    let before = loop {
        let study = wait_for(&server.url, &path(&posted), &["queued", "running", "finished"]).await;
        if study["runs_done"].as_u64().unwrap() >= 3 {
            break study;
        }
        assert!(begin.elapsed() < PATIENCE);
    };
    drop(server);
    let server = Server::start(data.path(), &[]);
    let study = wait_for(&server.url, &path(&posted), &["finished"]).await;
    assert_eq!(study["runs_done"], 9);
    let runs = |study: &Value| study["results"]["runs"].as_array().unwrap().clone();
    // what was done before is as it was
    let (now, then) = (runs(&study), runs(&before));
    assert!(now.len() == 8 && then.iter().all(|run| now.contains(run)), "{then:?} {now:?}");
}

/// Bytes of all files of a folder.
fn bytes_in(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.map(|path| if path.is_dir() { bytes_in(&path) } else { path.metadata().unwrap().len() }).sum()
}

/// A study of 192 jobs of 600 kB each stores what they have in common once; each of them still has its whole document and plan.
#[tokio::test]
async fn a_long_document_is_stored_once() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let mut asked = request();
    let points = 1000;
    let mirror = json!({
        "incidence_deg": (0..points).map(|i| 90.0 * f64::from(i) / f64::from(points - 1)).collect::<Vec<_>>(),
        "reflectance": vec![0.9; points as usize],
    });
    let place = |number: u32| json!([0.6 + 1.2 * f64::from(number % 8), 0.6 + 1.2 * f64::from(number / 8)]);
    asked["job"]["room"]["size_m"] = json!([10, 5, 3]);
    let tube = asked["job"]["tubes"][0].clone();
    asked["job"]["tubes"] = (0..24)
        .map(|number| {
            let mut tube = tube.clone();
            (tube["centre_m"], tube["reflectance"]) = (place(number), mirror.clone());
            tube
        })
        .collect();
    (asked["relative_errors"], asked["seeds"]) = (json!([0.5, 0.4]), json!(48));
    asked["reference"] = json!({ "grids": [{ "illuminance_lux": [[1, 1], [1, 1]] }] });
    let text = asked.to_string();
    assert!(text.len() > 500_000, "{}", text.len());
    let (before, resident) = (bytes_in(data.path()), server.resident());
    let post =
        client().post(format!("{}/v1/studies", server.url)).header("content-type", "application/json").body(text);
    let answer = post.send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    let study: Value = answer.json().await.unwrap();
    let (grown, held) = (bytes_in(data.path()) - before, server.resident().saturating_sub(resident));
    println!("{} bytes on the disk, {} in memory", grown, held);
    assert!(grown < 20_000_000 && held < 200_000_000, "{grown} {held}");
    let jobs = study["jobs"].as_array().unwrap();
    assert_eq!(jobs.len(), 192);
    let request = StudyRequest::from_value(asked, &MeshFiles::below(data.path())).unwrap();
    for job in [&jobs[0], &jobs[3], &jobs[191]] {
        let key = RunKey {
            method: job["method"].as_str().unwrap().to_owned(),
            relative_error: job["asked_relative_error"].as_f64().unwrap(),
            seed: job["seed"].as_u64().unwrap(),
        };
        let found = server.json(job["link"].as_str().unwrap()).await;
        let plan = client().post(format!("{}/v1/plan", server.url)).json(&request.run(&key)).send().await.unwrap();
        let plan: Value = plan.json().await.unwrap();
        assert!(found["document"] == plan["document"] && found["document"]["tubes"].as_array().unwrap().len() == 24);
        for field in ["effects", "guides", "methods"] {
            assert_eq!(found["plan"][field], plan["plan"][field], "{field}");
        }
        let events = format!("{}{}/events", server.url, job["link"].as_str().unwrap());
        let events = common::events_until(client().get(events), 0, |event| event.name == "planned").await;
        assert_eq!((events[1].name.as_str(), &events[1].data["plan"]), ("planned", &found["plan"]));
        schema::assert_valid(&schema::component("PlannedEvent"), &events[1].data, "PlannedEvent");
    }
}

/// A study that is finished is compared with its reference once, whatever is asked for and however often, also by other processes; a
/// client that has the newest answer is told so.
#[tokio::test]
async fn a_finished_study_is_evaluated_once() {
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let answer = client().post(format!("{}/v1/studies", server.url)).json(&request()).send().await.unwrap();
    let posted: Value = answer.json().await.unwrap();
    let study = wait_for(&server.url, &path(&posted), &["finished"]).await;
    let csv = study["links"]["csv"].as_str().unwrap();
    for file in [&path(&posted), csv] {
        let url = format!("{}{file}", server.url);
        let answer = client().get(&url).send().await.unwrap();
        let again = client().get(&url).header("if-none-match", &answer.headers()["etag"]).send().await.unwrap();
        assert_eq!(
            (again.status(), again.headers()["etag"].clone()),
            (StatusCode::NOT_MODIFIED, answer.headers()["etag"].clone())
        );
    }
    assert!(server.terminate());
    let store = SqliteStore::open(&data.path().join("skyduct.db")).await.unwrap();
    let id = posted["id"].as_str().unwrap().parse().unwrap();
    let stored = store.job_set(id).await.unwrap().unwrap();
    assert!(stored.members.iter().all(|member| member.found.is_some()));
    // were anything found anew, this would not be told
    let other = json!({ "run": { "squared_error": 0.25, "covered": 0.5 } });
    store.keep_found(id, &[(stored.members[1].job, other)]).await.unwrap();
    store.close().await;
    let server = Server::start(data.path(), &[]);
    let now = server.json(&path(&posted)).await;
    let runs = |study: &Value| study["results"]["runs"].as_array().unwrap().clone();
    assert_eq!((&runs(&now)[0]["squared_error"], &runs(&now)[0]["covered"]), (&json!(0.25), &json!(0.5)));
    assert_eq!(runs(&now)[1..], runs(&study)[1..]);
    assert_eq!(now["results"]["reference"], study["results"]["reference"]);
}

//! Studies: several methods on one job, queued, compared and taken away again.

mod study_storage;

use std::time::{Duration, Instant};

use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

use crate::common::{self, PATIENCE, TestEvent, TestService, client, endless_job, small_job};
use crate::schema;

/// A room whose four sensors are known to some percent in milliseconds.
pub fn request() -> Value {
    let mut job = small_job();
    job["grids"] = json!([{ "name": "floor", "height_m": 0.8, "cells": [2, 2] }]);
    job["method"] = json!("auto");
    json!({ "job": job, "methods": ["auto", "light_tracing"], "relative_errors": [0.1, 0.05], "seeds": 2 })
}

async fn post(service: &TestService, request: &Value) -> Value {
    let answer = service.post("/v1/studies", request).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED, "{}", answer.text().await.unwrap());
    let study: Value = answer.json().await.unwrap();
    schema::assert_valid(&schema::component("StudyResource"), &study, "StudyResource");
    study
}

/// Asks for a study until its status is one of these.
pub async fn wait_for(url: &str, path: &str, statuses: &[&str]) -> Value {
    let begin = Instant::now();
    loop {
        let answer = client().get(format!("{url}{path}")).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK);
        let study: Value = answer.json().await.unwrap();
        if statuses.contains(&study["status"].as_str().unwrap()) {
            return study;
        }
        assert!(begin.elapsed() < PATIENCE, "{study}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

pub fn path(study: &Value) -> String {
    study["links"]["self"].as_str().unwrap().to_owned()
}

/// All cells, a table and a figure; what a method refuses is told, and the numbers are those of the jobs.
#[tokio::test]
async fn a_study_says_what_accuracy_costs() {
    let service = TestService::start().await;
    let mut asked = request();
    asked["methods"] = json!(["auto", "jenkins", "light_tracing"]);
    // which the formula knows nothing of
    asked["job"]["room"]["objects"] = json!([{ "kind": "box", "size_m": [0.2, 0.2, 0.2], "position_m": [1.7, 1.7, 0],
                                               "surface": { "reflectance": 0.3 } }]);
    let posted = post(&service, &asked).await;
    assert_eq!((&posted["runs"], &posted["name"]), (&json!(9), &json!("small")));
    assert_eq!((&posted["refused"][0]["method"], posted["refused"].as_array().unwrap().len()), (&json!("jenkins"), 1));
    assert_eq!(posted["request"]["seconds"], 60.0);
    let study = wait_for(&service.running.url(), &path(&posted), &["finished"]).await;
    schema::assert_valid(&schema::component("StudyResource"), &study, "StudyResource");
    assert_eq!(study["runs_done"], 9);
    let results = &study["results"];
    assert_eq!((results["cells"].as_array().unwrap().len(), results["runs"].as_array().unwrap().len()), (4, 8));
    for cell in results["cells"].as_array().unwrap() {
        assert!(
            cell["met"] == true && cell["reported_relative_error"].as_f64() <= cell["asked_relative_error"].as_f64(),
            "{cell}"
        );
        // four sensors that fail together, and three sigma
        assert!(
            cell["actual_relative_error"].as_f64().unwrap() < 1.5 * cell["asked_relative_error"].as_f64().unwrap(),
            "{cell}"
        );
    }
    assert!(results["verdict"].as_str().unwrap().contains("jenkins"), "{results}");
    // a run is its job
    let first = study["jobs"].as_array().unwrap().iter().find(|job| job["part"] == "run").unwrap();
    let job = service.json(first["link"].as_str().unwrap()).await;
    let run = &results["runs"][0];
    assert_eq!((&run["cpu_seconds"], &run["passes"]), (&job["progress"]["cpu_seconds"], &job["progress"]["passes"]));
    assert_eq!(
        (&run["reported_relative_error"], &run["method"]),
        (&job["progress"]["relative_error"], &first["method"])
    );
    let file = async |link: &str| {
        let answer = service.get(study["links"][link].as_str().unwrap()).send().await.unwrap();
        assert_eq!(answer.status(), StatusCode::OK, "{link}");
        (answer.headers()["content-type"].to_str().unwrap().to_owned(), answer.bytes().await.unwrap())
    };
    let (media_type, csv) = file("csv").await;
    let csv = String::from_utf8(csv.to_vec()).unwrap();
    assert!(
        media_type.starts_with("text/csv") && csv.lines().count() == 5 && csv.contains("light_tracing,0.05,"),
        "{csv}"
    );
    let (media_type, svg) = file("svg").await;
    assert!(media_type == "image/svg+xml" && String::from_utf8_lossy(&svg).contains("Error against time: small"));
    assert!(file("png").await.1.starts_with(b"\x89PNG") && file("pdf").await.1.starts_with(b"%PDF"));
    let page = service.json("/v1/studies").await;
    assert_eq!((&page["studies"][0]["id"], &page["studies"][0]["status"]), (&study["id"], &json!("finished")));
    schema::assert_valid(&schema::component("StudyPage"), &page, "StudyPage");
}

/// Pictures of views by each method after the same time and at an accuracy, each a job; a method that shows no views is told.
#[tokio::test]
async fn a_study_makes_pictures_of_views() {
    let service = TestService::start().await;
    let mut asked = request();
    asked["job"]["method"] = json!({ "kind": "path_tracing", "samples_per_pixel": 1 });
    (asked["relative_errors"], asked["seeds"]) = (json!([0.1]), json!(1));
    // nothing ends within a microsecond
    asked["pictures"] = json!({ "seconds": [0.5, 1e-6], "relative_errors": [0.5] });
    // ten times that for the reference
    asked["seconds"] = json!(0.5);
    asked["reference"] = json!({ "method": "path_tracing" });
    let posted = post(&service, &asked).await;
    let view = asked["job"]["views"][0]["name"].as_str().unwrap();
    let refused = posted["refused"].as_array().unwrap();
    assert_eq!((refused.len(), &refused[0]["method"]), (1, &json!("light_tracing")));
    assert!(refused[0]["reason"].as_str().unwrap().starts_with("for the views: "), "{refused:?}");
    // a reference and two runs, and a reference, two of equal time and one accuracy
    assert_eq!(posted["runs"], 7);
    let study = wait_for(&service.running.url(), &path(&posted), &["finished"]).await;
    schema::assert_valid(&schema::component("StudyResource"), &study, "StudyResource");
    assert_eq!(study["results"]["runs"].as_array().unwrap().len(), 2);
    let of_part = |part: &str| study["jobs"].as_array().unwrap().iter().filter(|job| job["part"] == part).count();
    assert_eq!((of_part("picture_reference"), of_part("picture")), (1, 3));
    let links = &study["links"]["pictures"];
    let numbers = service.json(links["json"].as_str().unwrap()).await;
    let pictures = numbers["pictures"].as_array().unwrap();
    assert_eq!(pictures.len(), 3);
    // on a busy machine the clock may end a job only after its first pass
    let late = pictures[0]["passes"].as_u64() > Some(0);
    assert_eq!((&pictures[0]["asked_seconds"], pictures[0]["actual_relative_error"].is_null()), (&json!(1e-6), !late));
    assert_eq!((&pictures[1]["method"], &pictures[1]["asked_seconds"]), (&json!("auto"), &json!(0.5)));
    assert_eq!((&pictures[2]["method"], &pictures[2]["asked_relative_error"]), (&json!("path_tracing"), &json!(0.5)));
    for picture in &pictures[1..] {
        assert!(picture["passes"].as_u64().unwrap() > 0 && picture["view"] == view, "{picture}");
        let [told, actual] =
            ["reported_relative_error", "actual_relative_error"].map(|error| picture[error].as_f64().unwrap());
        // told at 95 %: two standard errors
        assert!(actual > 0.0 && actual < 1.5 * told, "{picture}");
    }
    for kind in ["equal_time_png", "accuracies_png"] {
        let link = links["views"][view][kind].as_str().unwrap();
        let answer = service.get(link).send().await.unwrap();
        assert_eq!(
            (answer.status(), &answer.headers()["content-type"]),
            (StatusCode::OK, &"image/png".parse().unwrap())
        );
        assert!(answer.bytes().await.unwrap().starts_with(b"\x89PNG"));
    }
    // readers at the same time are given one and the same file, and who has it is told so
    let link = links["views"][view]["equal_time_png"].as_str().unwrap();
    let all = futures::future::join_all((0..24).map(|_| service.get(link).send())).await;
    let tags: Vec<_> = all.into_iter().map(|answer| answer.unwrap().headers()["etag"].clone()).collect();
    assert!(tags.iter().all(|tag| *tag == tags[0]), "{tags:?}");
    let again = service.get(link).header("if-none-match", &tags[0]).send().await.unwrap();
    assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
    // what was found of the pictures is kept, and says the same
    assert_eq!(service.json(links["json"].as_str().unwrap()).await, numbers);
    let missing = format!("{}/files/other.accuracies.png", path(&study));
    assert_eq!(service.get(&missing).send().await.unwrap().status(), StatusCode::NOT_FOUND);
}

/// Values that are given take the place of the reference, and one that is wrong is seen in every run.
#[tokio::test]
async fn a_reference_may_be_given() {
    let service = TestService::start().await;
    let mut asked = request();
    asked["reference"] = json!({ "grids": [{ "illuminance_lux": [[1, 1], [1, 1]] }] });
    let posted = post(&service, &asked).await;
    assert_eq!(posted["runs"], 8);
    let study = wait_for(&service.running.url(), &path(&posted), &["finished"]).await;
    let results = &study["results"];
    assert_eq!(
        (&results["reference"]["method"], &results["reference"]["relative_standard_error"]),
        (&Value::Null, &json!(0.0))
    );
    for cell in results["cells"].as_array().unwrap() {
        assert!(cell["actual_relative_error"].as_f64().unwrap() > 1.0 && cell["covered"] == 0.0, "{cell}");
    }
    asked["reference"]["grids"][0]["illuminance_lux"] = json!([[1, 1]]);
    let answer = service.post("/v1/studies", &asked).send().await.unwrap();
    let problem = common::problem(answer, 422).await;
    assert_eq!(problem["errors"][0]["pointer"], "/reference/grids/0/illuminance_lux");
}

/// A study of more jobs than may ever wait is refused for good, as a set of jobs is, and one that fits is queued.
#[tokio::test]
async fn a_study_larger_than_the_queue_is_refused_with_the_bound() {
    for (queued_jobs, of_client) in [(4, 1000), (1000, 4)] {
        let service = TestService::start_with(|config| {
            (config.limits.queued_jobs, config.limits.queued_jobs_per_client) = (queued_jobs, of_client);
        })
        .await;
        // a reference, and two methods at two errors; four wait when one of five is rendered
        let mut request = request();
        request["seeds"] = json!(1);
        post(&service, &request).await;
        request["seeds"] = json!(2);
        let problem = common::problem(service.post("/v1/studies", &request).send().await.unwrap(), 422).await;
        let error = &problem["errors"][0];
        assert_eq!((&error["pointer"], &error["code"]), (&json!("/seeds"), &json!("too_many")), "{problem}");
        assert!(error["detail"].as_str().unwrap().contains("at most 5 jobs on this service"), "{problem}");
    }
}

/// Everything that is wrong is named by its place in the request, and nothing is queued.
#[tokio::test]
async fn what_is_wrong_is_named() {
    let service = TestService::start_with(|config| {
        config.limits.max_seconds = 100.0;
        config.limits.memory_bytes = Some(2_000_000_000);
    })
    .await;
    let cases = [
        ("/methods", json!([]), "/methods"),
        ("/methods/0", json!("nobody"), "/methods/0"),
        ("/methods/1", json!("auto"), "/methods/1"),
        ("/relative_errors/1", json!(1.5), "/relative_errors/1"),
        ("/relative_errors", json!("small"), "/relative_errors"),
        ("/seeds", json!(0), "/seeds"),
        // 400 jobs
        ("/seeds", json!(100), "/seeds"),
        ("/seconds", json!(101), "/seconds"),
        ("/reference", json!({ "seconds": 101 }), "/reference/seconds"),
        ("/reference", json!({ "method": "nobody" }), "/reference/method"),
        ("/sensors", json!(1), "/sensors"),
        ("/pictures", json!({ "seconds": [0] }), "/pictures/seconds/0"),
        ("/pictures", json!({ "seconds": [101] }), "/pictures/seconds/0"),
        ("/pictures", json!({ "relative_errors": [0.1, 0.1] }), "/pictures/relative_errors/1"),
        ("/pictures", json!({ "times": [1] }), "/pictures/times"),
        ("/job/room/size_m/0", json!(-1), "/job/room/size_m/0"),
        ("/job/grids", json!([]), "/job/grids"),
        ("/job/tubes/0/mesh", json!("gone"), "/job/tubes/0"),
    ];
    for (place, value, pointer) in cases {
        let mut request = request();
        let (parent, field) = place.rsplit_once('/').unwrap();
        match request.pointer_mut(parent).unwrap() {
            Value::Array(list) => list[field.parse::<usize>().unwrap()] = value,
            object => object[field] = value,
        }
        let problem = common::problem(service.post("/v1/studies", &request).send().await.unwrap(), 422).await;
        let found = problem["errors"][0]["pointer"].as_str().unwrap();
        assert!(found == pointer || (place.ends_with("mesh") && found.starts_with(pointer)), "{place}: {problem}");
    }
    // pictures that would take more to put together than there is for them
    let mut large = request();
    large["job"]["views"][0]["size_px"] = json!([2048, 2048]);
    large["job"]["method"] = json!("path_tracing");
    (large["methods"], large["pictures"]) = (json!(["path_tracing"]), json!({ "seconds": [1, 2, 3] }));
    let problem = common::problem(service.post("/v1/studies", &large).send().await.unwrap(), 422).await;
    let error = &problem["errors"][0];
    assert_eq!((&error["pointer"], &error["code"]), (&json!("/pictures/seconds"), &json!("too_many")), "{problem}");
    // a room with a box is beyond the formula
    let mut request = request();
    request["job"]["room"]["objects"] = json!([{ "kind": "box", "size_m": [0.2, 0.2, 0.2], "position_m": [1.7, 1.7, 0], "surface": { "reflectance": 0.3 } }]);
    request["methods"] = json!(["jenkins"]);
    let problem = common::problem(service.post("/v1/studies", &request).send().await.unwrap(), 422).await;
    assert_eq!(
        (&problem["errors"][0]["pointer"], &problem["errors"][0]["code"]),
        (&json!("/methods/0"), &json!("method_refuses"))
    );
    assert_eq!(service.json("/v1/jobs").await["jobs"], json!([]));
    assert_eq!(service.json("/v1/studies").await["studies"], json!([]));
}

/// A key names one study. A queue without room for all jobs takes none of them. What is deleted takes its jobs with it.
#[tokio::test]
async fn studies_are_queued_once_and_whole() {
    let service = TestService::start_with(|config| config.limits.queued_jobs = 9).await;
    let post = async |request: &Value| {
        service.post("/v1/studies", request).header("idempotency-key", "k").send().await.unwrap()
    };
    let first = post(&request()).await;
    assert!(!first.headers().contains_key("idempotency-replayed"));
    let first: Value = first.json().await.unwrap();
    let again = post(&request()).await;
    assert_eq!(again.headers()["idempotency-replayed"], "true");
    let again: Value = again.json().await.unwrap();
    assert_eq!(first["id"], again["id"]);
    let mut other = request();
    other["seeds"] = json!(1);
    assert_eq!(common::problem(post(&other).await, 422).await["type"], "/problems/key-reused");
    wait_for(&service.running.url(), &path(&first), &["finished"]).await;
    let long = self::post(&service, &endless_request()).await;
    let answer = service.post("/v1/studies", &request()).send().await.unwrap();
    assert_eq!(common::problem(answer, 503).await["type"], "/problems/queue-full");
    assert_eq!(service.json("/v1/jobs").await["jobs"].as_array().unwrap().len(), 18);
    assert_eq!(service.request(Method::DELETE, &path(&long)).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    let delete = async || service.request(Method::DELETE, &path(&first)).send().await.unwrap();
    assert_eq!(delete().await.status(), StatusCode::NO_CONTENT);
    assert_eq!(service.json("/v1/jobs").await["jobs"], json!([]));
    common::problem(service.get(&path(&first)).send().await.unwrap(), 404).await;
    common::problem(delete().await, 404).await;
}

/// A study that would take long: its reference is never good enough.
fn endless_request() -> Value {
    let mut request = request();
    request["job"]["method"] = endless_job()["method"].clone();
    request["reference"] = json!({ "method": "sppm", "relative_error": 1e-9, "seconds": 1000 });
    request
}

/// A job that is posted later goes before the jobs of a study; a cancelled study ends, and can be cancelled once.
#[tokio::test]
async fn a_study_is_cancelled_with_its_jobs() {
    let service = TestService::start().await;
    let study = post(&service, &endless_request()).await;
    let answer = service.get(study["links"]["csv"].as_str().unwrap()).send().await.unwrap();
    common::problem(answer, 404).await;
    wait_for(&service.running.url(), &path(&study), &["running"]).await;
    let job = service.submit(&small_job()).await;
    assert_eq!(service.finished(&job).await["status"], "succeeded");
    let cancel = format!("{}/cancel", path(&study));
    let answer = service.request(Method::POST, &cancel).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    let study = wait_for(&service.running.url(), &path(&study), &["cancelled"]).await;
    assert_eq!((&study["runs_done"], &study["results"]), (&study["runs"], &Value::Null));
    common::problem(service.request(Method::POST, &cancel).send().await.unwrap(), 409).await;
    common::problem(service.request(Method::POST, "/v1/studies/none/cancel").send().await.unwrap(), 404).await;
}

/// Starts and ends of a study's events, without its passes.
fn steps(events: &[TestEvent]) -> Vec<(i64, &str, &Value)> {
    let steps = events.iter().filter(|event| event.name != "pass");
    steps.map(|event| (event.id, event.name.as_str(), &event.data)).collect()
}

/// A study is followed to its end: each start and end once and in order, as the study itself says, and missed ones again.
#[tokio::test]
async fn events_of_a_study_tell_each_start_and_end_once() {
    let service = TestService::start().await;
    let posted = post(&service, &request()).await;
    let events = posted["links"]["events"].as_str().unwrap();
    assert_eq!(events, format!("{}/events", path(&posted)));
    let all = common::events_until(service.get(events), 0, |_| false).await;
    for event in &all {
        schema::assert_valid(&schema::component("StudyEvent"), &event.data, &event.name);
        assert_eq!((&event.data["runs"], &event.data["table"]), (&json!(9), &posted["links"]["csv"]));
    }
    let steps_of_all = steps(&all);
    let ids: Vec<i64> = steps_of_all.iter().map(|(id, ..)| *id).collect();
    assert_eq!(ids, (1..=19).collect::<Vec<_>>());
    let (_, last_name, last) = steps_of_all[18];
    assert_eq!((last_name, &last["status"], &last["runs_done"]), ("finished", &json!("finished"), &json!(9)));
    // the table is there by then
    assert_eq!(service.get(last["table"].as_str().unwrap()).send().await.unwrap().status(), StatusCode::OK);
    let study = service.json(&path(&posted)).await;
    let mut done = 0;
    for (_, name, data) in &steps_of_all[..18] {
        done += u64::from(*name == "ended");
        assert_eq!((&data["runs_done"], &data["status"]), (&json!(done), &json!("running")), "{data}");
        let job = study["jobs"].as_array().unwrap().iter().find(|job| job["id"] == data["job"]["id"]).unwrap();
        match *name {
            "ended" => assert_eq!((&data["job"], data["progress"]["passes"].is_u64()), (job, true)),
            name => assert_eq!((name, &data["job"]["status"]), ("started", &json!("running"))),
        }
        assert_eq!(
            (&data["job"]["method"], &data["job"]["asked_relative_error"]),
            (&job["method"], &job["asked_relative_error"])
        );
    }
    // each of the nine starts before it ends
    for job in study["jobs"].as_array().unwrap() {
        let of_job = steps_of_all.iter().filter(|(.., data)| data["job"]["id"] == job["id"]);
        assert_eq!(of_job.map(|(_, name, _)| *name).collect::<Vec<_>>(), ["started", "ended"]);
    }
    for after in [1, 7, 18] {
        let rest = common::events_until(service.get(events), after, |_| false).await;
        assert_eq!(steps(&rest), steps_of_all[after as usize..]);
    }
    let received = service.get(events).header("last-event-id", 19).send().await.unwrap();
    assert_eq!(received.status(), StatusCode::NO_CONTENT);
    // told before the power failed, and lost with it
    for lost in [20, 1000] {
        let rest = common::events_until(service.get(events), lost, |_| false).await;
        assert_eq!((rest[0].id, rest[0].name.as_str()), (18, "restarted"));
        assert_eq!(steps(&rest[1..]), steps_of_all[18..]);
    }
    common::problem(service.get(&format!("{events}?after=-1")).send().await.unwrap(), 422).await;
    common::problem(service.get("/v1/studies/00000000-0000-0000-0000-000000000000/events").send().await.unwrap(), 404)
        .await;
}

/// Passes of the jobs at work are told, about once a second, and a study that is cancelled says so and ends its streams.
#[tokio::test]
async fn events_of_a_study_tell_passes_and_its_cancellation() {
    let service = TestService::start().await;
    let posted = post(&service, &endless_request()).await;
    let events = format!("{}/events", path(&posted));
    let begin = Instant::now();
    let mut told = common::events_until(service.get(&events), 0, |event| {
        event.name == "pass"
            && event.data["job"]["part"] == "reference"
            && event.data["progress"]["passes"].as_u64() > Some(50)
    })
    .await;
    let passes: Vec<Value> = told.extract_if(.., |event| event.name == "pass").map(|event| event.data).collect();
    assert!(passes.len() as u64 <= 1 + begin.elapsed().as_secs() + 1, "{}", passes.len());
    let of_reference = passes.iter().filter(|pass| pass["job"]["part"] == "reference");
    let numbers: Vec<u64> = of_reference.map(|pass| pass["progress"]["passes"].as_u64().unwrap()).collect();
    assert!(numbers.last() > Some(&50) && numbers.windows(2).all(|pair| pair[0] < pair[1]), "{numbers:?}");
    assert_eq!((told[0].id, told[0].name.as_str()), (1, "started"));
    assert_eq!(told[0].data["job"]["part"], "reference");
    // told before the power failed, and lost with it
    let lost = common::events_until(service.get(&events), 1000, |_| true).await;
    assert_eq!(lost[0].name, "restarted");
    let sent = json!({ "id": lost[0].id.to_string(), "event": "restarted", "data": lost[0].data.to_string() });
    schema::assert_valid(&schema::component("StudyStreamEvent"), &sent, "StudyStreamEvent");
    // another stream goes on after what that one had
    let rest = tokio::spawn(common::events_until(service.get(&events), 1, |_| false));
    let cancel = format!("{}/cancel", path(&posted));
    assert_eq!(service.request(Method::POST, &cancel).send().await.unwrap().status(), StatusCode::ACCEPTED);
    let rest = tokio::time::timeout(PATIENCE, rest).await.unwrap().unwrap();
    let rest = steps(&rest);
    // some of the eight others never began, and the reference ends within a pass
    assert_eq!(rest.iter().map(|(id, ..)| *id).collect::<Vec<_>>(), (2..).take(rest.len()).collect::<Vec<_>>());
    let ((_, last, end), before) = rest.split_last().unwrap();
    assert_eq!((*last, &end["runs_done"]), ("cancelled", &json!(9)));
    assert_eq!(before.iter().filter(|(_, name, _)| *name == "ended").count(), 9);
    assert!(before.iter().all(|(_, name, _)| ["started", "ended"].contains(name)));
}

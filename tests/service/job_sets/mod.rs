//! Sets of jobs: queued together or not at all, followed, cancelled and deleted together.

use std::time::{Duration, Instant};

use reqwest::{Method, Response, StatusCode};
use serde_json::{Value, json};

use crate::common::{self, PATIENCE, TestEvent, TestService, client, endless_job, small_job};
use crate::process::Server;
use crate::schema;

/// Two equal jobs, and one with another seed and a name of its own.
fn request() -> Value {
    let mut other = small_job();
    (other["name"], other["seed"]) = (json!("other"), json!(8));
    json!({ "name": "three jobs", "jobs": [small_job(), other, small_job()] })
}

/// Some jobs that go on until they are stopped.
fn endless() -> Value {
    let with_seed = |seed: u64| {
        let mut job = endless_job();
        job["seed"] = json!(seed);
        job
    };
    json!({ "jobs": (0..3).map(with_seed).collect::<Vec<_>>() })
}

async fn post_with_key(service: &TestService, request: &Value, key: &str) -> Response {
    service.post("/v1/job_sets", request).header("idempotency-key", key).send().await.unwrap()
}

async fn post(service: &TestService, request: &Value) -> (String, Value) {
    let answer = service.post("/v1/job_sets", request).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED, "{}", answer.text().await.unwrap());
    let path = answer.headers()["location"].to_str().unwrap().to_owned();
    let set: Value = answer.json().await.unwrap();
    schema::assert_valid(&schema::component("JobSetResource"), &set, "JobSetResource");
    assert_eq!(set["links"]["self"], path.as_str());
    (path, set)
}

/// Asks for a set until it is so.
async fn until(url: &str, path: &str, is_so: impl Fn(&Value) -> bool) -> Value {
    let begin = Instant::now();
    loop {
        let set: Value = client().get(format!("{url}{path}")).send().await.unwrap().json().await.unwrap();
        if is_so(&set) {
            return set;
        }
        assert!(begin.elapsed() < PATIENCE, "{set}");
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
}

fn is_finished(set: &Value) -> bool {
    set["status"] == "finished"
}

fn jobs(set: &Value) -> &Vec<Value> {
    set["jobs"].as_array().unwrap()
}

fn steps(events: &[TestEvent]) -> Vec<(i64, &str, &Value)> {
    let steps = events.iter().filter(|event| event.name != "pass");
    steps.map(|event| (event.id, event.name.as_str(), &event.data)).collect()
}

/// A set is its jobs in their order, each with its whole document; equal ones are computed once. It is told to its end, and goes with
/// its jobs, which no other deletion takes.
#[tokio::test]
async fn a_set_lives_from_its_post_to_its_deletion() {
    let service = TestService::start().await;
    let (path, posted) = post(&service, &request()).await;
    assert_eq!((&posted["name"], &posted["total"]), (&json!("three jobs"), &json!(3)));
    let events = common::events_until(service.get(posted["links"]["events"].as_str().unwrap()), 0, |_| false).await;
    for event in &events {
        schema::assert_valid(&schema::component("JobSetEvent"), &event.data, &event.name);
    }
    let told = steps(&events);
    assert_eq!(told.iter().map(|(id, ..)| *id).collect::<Vec<_>>(), [1, 2, 3, 4, 5, 6, 7]);
    let ((_, last, end), of_jobs) = told.split_last().unwrap();
    assert_eq!(
        (*last, &end["status"], &end["ended"], &end["job"]),
        ("finished", &json!("finished"), &json!(3), &Value::Null)
    );
    for index in 0..3 {
        let of_job = of_jobs.iter().filter(|(.., data)| data["job"]["index"] == index);
        let names = of_job.map(|(_, name, data)| (*name, data["job"]["status"].as_str().unwrap())).collect::<Vec<_>>();
        assert_eq!(names, [("started", "running"), ("ended", "succeeded")]);
    }
    for after in [1, 6] {
        let rest = common::events_until(service.get(&format!("{path}/events")), after, |_| false).await;
        assert_eq!(steps(&rest), told[after as usize..]);
    }
    let all = service.get(&format!("{path}/events")).header("last-event-id", 7).send().await.unwrap();
    assert_eq!(all.status(), StatusCode::NO_CONTENT);

    let set = service.json(&path).await;
    schema::assert_valid(&schema::component("JobSetResource"), &set, "JobSetResource");
    let counts = json!({ "queued": 0, "running": 0, "succeeded": 3, "failed": 0, "cancelled": 0, "deleted": 0 });
    assert_eq!((&set["status"], &set["ended"], &set["counts"]), (&json!("finished"), &json!(3), &counts));
    let mut found = Vec::new();
    for (place, job) in jobs(&set).iter().enumerate() {
        assert_eq!((&job["index"], &job["name"]), (&json!(place), &request()["jobs"][place]["name"]));
        found.push(service.json(job["link"].as_str().unwrap()).await);
    }
    let planned = service.post("/v1/plan", &request()["jobs"][1]).send().await.unwrap().json::<Value>().await.unwrap();
    assert_eq!(found[1]["document"], planned["document"], "what is kept once is there for each");
    assert_eq!((&found[2]["computed_by"], found[1].get("computed_by")), (&found[0]["id"], None));
    assert_eq!(found[2]["grids"], found[0]["grids"]);
    assert_ne!(found[1]["grids"], found[0]["grids"]);

    let page = service.json("/v1/job_sets").await;
    schema::assert_valid(&schema::component("JobSetPage"), &page, "JobSetPage");
    assert_eq!((&page["job_sets"][0]["id"], &page["next_cursor"]), (&set["id"], &Value::Null));
    // a set is no study, and its jobs are not deleted with those that were posted alone
    assert_eq!(service.json("/v1/studies").await["studies"], json!([]));
    let id = set["id"].as_str().unwrap();
    common::problem(service.get(&format!("/v1/studies/{id}")).send().await.unwrap(), 404).await;
    let ended = service.request(Method::DELETE, "/v1/jobs?ended_before=2100-01-01T00:00:00Z").send().await.unwrap();
    assert_eq!(ended.json::<Value>().await.unwrap()["deleted"], 0);

    let first = jobs(&set)[0]["link"].as_str().unwrap();
    assert_eq!(service.request(Method::DELETE, first).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    let set = service.json(&path).await;
    assert_eq!((&set["status"], &set["counts"]["deleted"]), (&json!("finished"), &json!(1)));
    assert_eq!((&jobs(&set)[0]["status"], &jobs(&set)[1]["status"]), (&Value::Null, &json!("succeeded")));
    assert_eq!(service.request(Method::DELETE, &path).send().await.unwrap().status(), StatusCode::NO_CONTENT);
    assert_eq!(service.json("/v1/jobs").await["jobs"], json!([]));
    for method in [Method::GET, Method::DELETE] {
        common::problem(service.request(method, &path).send().await.unwrap(), 404).await;
    }
}

/// Posts with a key make one set, however many come at once; jobs and studies have keys of their own.
#[tokio::test]
async fn a_key_makes_one_set() {
    let service = TestService::start().await;
    let asked = request();
    let answers = futures::future::join_all((0..8).map(|_| post_with_key(&service, &asked, "k"))).await;
    let replayed = answers.iter().filter(|answer| answer.headers().contains_key("idempotency-replayed")).count();
    assert_eq!(replayed, 7);
    let places: Vec<_> = answers.iter().map(|answer| answer.headers()["location"].clone()).collect();
    assert!(places.iter().all(|place| *place == places[0]));
    assert_eq!(service.json("/v1/jobs").await["jobs"].as_array().unwrap().len(), 3);
    let mut other = request();
    other["name"] = json!("other");
    let reused = common::problem(post_with_key(&service, &other, "k").await, 422).await;
    assert_eq!(reused["type"], "/problems/key-reused");
    let job = service.post_job(&small_job()).header("idempotency-key", "k").send().await.unwrap();
    assert_eq!(job.status(), StatusCode::ACCEPTED);
}

/// Every fault is named by its place in the request, those of all documents at once, and nothing is queued.
#[tokio::test]
async fn what_is_wrong_is_named() {
    let service = TestService::start_with(|config| {
        config.limits.max_seconds = 1000.0;
        config.limits.queued_jobs_per_client = 4;
    })
    .await;
    let mut two_faults = request();
    (two_faults["jobs"][0]["room"]["size_m"][0], two_faults["jobs"][2]["stop"]["max_passes"]) = (json!(-1), json!(0));
    let mut too_long = request();
    too_long["jobs"][1]["stop"]["max_seconds"] = json!(1001);
    let mut gone = request();
    gone["jobs"][1]["tubes"][0] =
        json!({ "mesh": "none", "unit": "m", "centre_m": [1, 1], "opening_diameter_m": 0.2, "parts": {} });
    for (request, pointers) in [
        (json!({ "jobs": [] }), vec!["/jobs"]),
        (json!({}), vec!["/jobs"]),
        (json!({ "jobs": small_job() }), vec!["/jobs"]),
        (json!({ "jobs": [1], "sets": 2 }), vec!["/sets"]),
        (json!({ "jobs": [[]] }), vec!["/jobs/0"]),
        (json!({ "jobs": [small_job()], "name": "x".repeat(1001) }), vec!["/name"]),
        // five wait when one of six is rendered
        (json!({ "jobs": vec![small_job(); 6] }), vec!["/jobs"]),
        (two_faults, vec!["/jobs/0/room/size_m/0", "/jobs/2/stop/max_passes"]),
        (too_long, vec!["/jobs/1/stop/max_seconds"]),
        (gone, vec!["/jobs/1/tubes/0"]),
    ] {
        let problem = common::problem(service.post("/v1/job_sets", &request).send().await.unwrap(), 422).await;
        let found: Vec<&str> =
            problem["errors"].as_array().unwrap().iter().map(|error| error["pointer"].as_str().unwrap()).collect();
        for pointer in pointers {
            assert!(found.iter().any(|found| found.starts_with(pointer)), "{pointer}: {problem}");
        }
    }
    let many = service.post("/v1/job_sets", &json!({ "jobs": vec![small_job(); 6] })).send().await.unwrap();
    let many = common::problem(many, 422).await;
    assert_eq!(many["errors"][0]["code"], "too_many");
    assert!(many["errors"][0]["detail"].as_str().unwrap().contains("1 to 5 jobs"), "{many}");
    for path in ["/v1/job_sets?limit=0", "/v1/job_sets?limit=101", "/v1/job_sets?cursor=x"] {
        common::problem(service.get(path).send().await.unwrap(), 422).await;
    }
    assert_eq!(service.json("/v1/jobs").await["jobs"], json!([]));
    assert_eq!(service.json("/v1/job_sets").await["job_sets"], json!([]));
}

/// A set that does not fit beside what waits is refused whole, by the client's limit and by that of the service.
#[tokio::test]
async fn a_set_without_room_is_refused_whole() {
    for (of_client, status, kind) in [(3, 429, "/problems/too-many"), (1000, 503, "/problems/queue-full")] {
        let service = TestService::start_with(|config| {
            config.limits.queued_jobs = 3;
            config.limits.queued_jobs_per_client = of_client;
        })
        .await;
        let (path, _) = post(&service, &endless()).await;
        let refused = service.post("/v1/job_sets", &request()).send().await.unwrap();
        assert!(refused.headers().contains_key("retry-after"));
        assert_eq!(common::problem(refused, status).await["type"], kind);
        assert_eq!(service.json("/v1/jobs").await["jobs"].as_array().unwrap().len(), 3);
        assert_eq!(service.request(Method::DELETE, &path).send().await.unwrap().status(), StatusCode::NO_CONTENT);
        post(&service, &request()).await;
    }
}

/// A job that is posted later goes before those of a set; a cancelled set ends with all of its jobs, and can be cancelled once.
#[tokio::test]
async fn a_set_is_cancelled_with_its_jobs() {
    let service = TestService::start().await;
    let url = service.running.url();
    let (path, posted) = post(&service, &endless()).await;
    let set = until(&url, &path, |set| set["status"] == "running").await;
    assert_eq!((&set["ended"], &set["total"]), (&json!(0), &json!(3)));
    let job = service.submit(&small_job()).await;
    assert_eq!(service.finished(&job).await["status"], "succeeded");
    let events = common::events_until(service.get(&format!("{path}/events")), 0, |event| event.name == "pass").await;
    schema::assert_valid(&schema::component("JobSetEvent"), &events.last().unwrap().data, "pass");
    let cancel = posted["links"]["cancel"].as_str().unwrap();
    let answer = service.request(Method::POST, cancel).send().await.unwrap();
    assert_eq!(answer.status(), StatusCode::ACCEPTED);
    let set = until(&url, &path, is_finished).await;
    assert_eq!((&set["counts"]["cancelled"], &set["ended"]), (&json!(3), &json!(3)));
    common::problem(service.request(Method::POST, cancel).send().await.unwrap(), 409).await;
    common::problem(service.request(Method::POST, "/v1/job_sets/none/cancel").send().await.unwrap(), 404).await;
}

/// A service that is killed in the middle of a set finishes it after a start, with the bits of jobs that nothing disturbed.
#[tokio::test]
async fn a_crash_loses_nothing_of_a_set() {
    let with_seed = |seed: u64| {
        let mut job = small_job();
        job["method"] = json!({ "kind": "sppm", "photons_per_pass": 10_000 });
        (job["seed"], job["stop"]["max_passes"]) = (json!(seed), json!(40));
        job
    };
    let documents: Vec<Value> = (1..=3).map(with_seed).collect();
    let data = tempfile::tempdir().unwrap();
    let server = Server::start(data.path(), &[]);
    let posted = client().post(format!("{}/v1/job_sets", server.url)).json(&json!({ "jobs": documents }));
    let posted = posted.send().await.unwrap();
    assert_eq!(posted.status(), StatusCode::ACCEPTED);
    let path = posted.headers()["location"].to_str().unwrap().to_owned();
    let passes = |set: &Value| jobs(set).iter().filter_map(|job| job["progress"]["passes"].as_u64()).sum::<u64>();
    let before = until(&server.url, &path, |set| passes(set) >= 10 || is_finished(set)).await;
    server.kill();
    assert!(!is_finished(&before), "killed in the middle: {before}");
    let server = Server::start(data.path(), &[]);
    let set = until(&server.url, &path, is_finished).await;
    assert_eq!(set["counts"]["succeeded"], 3);
    let undisturbed = TestService::start().await;
    for (job, document) in jobs(&set).iter().zip(&documents) {
        let grid = server.get(&format!("{}/grids/workplane?format=json", job["link"].as_str().unwrap())).await;
        let alone = undisturbed.submit(document).await;
        undisturbed.finished(&alone).await;
        let expected = undisturbed.get(&format!("{alone}/grids/workplane?format=json")).send().await.unwrap();
        assert!(grid == expected.bytes().await.unwrap().to_vec(), "{}", job["index"]);
    }
}

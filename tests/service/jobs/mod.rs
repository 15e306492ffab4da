//! Jobs over HTTP, against a service that is bound to a port.

mod annual;
mod equal_jobs;
mod events;
mod idempotency;
mod memory;
mod predictions;
mod result_files;
mod retention;
mod surfaces;

use crate::common::{PATIENCE, TestService, endless_job, problem, small_job};
use reqwest::{Method, StatusCode};
use serde_json::{Value, json};

/// `Prefer: wait` answers with the finished job and its grids, as their links have them; a repeated post, too. What takes longer, or
/// is not to be waited for, is answered at once.
#[tokio::test]
async fn a_job_that_is_waited_for() {
    let service = TestService::start().await;
    let post = |job: &Value, prefer: &'static str| {
        service.post_job(job).header("prefer", prefer).header("idempotency-key", prefer).send()
    };
    let response = post(&small_job(), "respond-async, wait=25").await.unwrap();
    assert_eq!(response.status(), StatusCode::OK);
    assert_eq!(response.headers()["preference-applied"], "wait=25");
    let path = response.headers()["location"].to_str().unwrap().to_owned();
    let job: Value = response.json().await.unwrap();
    assert_eq!((&job["status"], &job["links"]["self"]), (&json!("succeeded"), &json!(path)));
    let mut grids = job.clone();
    let grids = grids["grid_results"].take();
    assert_eq!(grids.as_object().unwrap().len(), 1);
    assert_eq!(grids["workplane"], service.json(&format!("{path}/grids/workplane")).await);
    let mut without = job.clone();
    without.as_object_mut().unwrap().remove("grid_results");
    assert_eq!(without, service.json(&path).await);

    let again = post(&small_job(), "respond-async, wait=25").await.unwrap();
    assert_eq!((again.status(), &again.headers()["idempotency-replayed"]), (StatusCode::OK, &"true".parse().unwrap()));
    assert_eq!(again.json::<Value>().await.unwrap(), job);
    for (job, prefer) in [(endless_job(), "wait=1"), (small_job(), "wait=0"), (small_job(), "wait=soon")] {
        let response = post(&job, prefer).await.unwrap();
        assert_eq!(response.status(), StatusCode::ACCEPTED, "{prefer}");
        assert!(!response.headers().contains_key("preference-applied"));
        let path = response.headers()["location"].to_str().unwrap().to_owned();
        service.request(Method::DELETE, &path).send().await.unwrap();
    }
}

/// A wait that ends before its job tells how far the job is by then, not how it was when it was posted.
#[tokio::test]
async fn a_wait_that_is_too_short_tells_how_far_the_job_is() {
    let service = TestService::start().await;
    let mut answers = Vec::new();
    // a machine with other work may need longer to the first pass
    for wait in ["wait=1", "wait=4", "wait=16"] {
        let response = service.post_job(&endless_job()).header("prefer", wait).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::ACCEPTED);
        let path = response.headers()["location"].to_str().unwrap().to_owned();
        let job: Value = response.json().await.unwrap();
        service.request(Method::DELETE, &path).send().await.unwrap();
        let is_seen = job["status"] == "running" && job["progress"]["passes"].as_u64().unwrap() > 0;
        if is_seen && !job["started_at"].is_null() {
            return;
        }
        answers.push(job);
    }
    panic!("none of the waits saw its job run: {answers:?}");
}

#[tokio::test]
async fn a_job_from_post_to_delete() {
    let service = TestService::start().await;
    let response = service.post_job(&small_job()).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::ACCEPTED);
    assert_eq!(response.headers()["retry-after"], "1");
    assert_eq!(response.headers()["x-content-type-options"], "nosniff");
    assert!(response.headers().contains_key("x-request-id"));
    let path = response.headers()["location"].to_str().unwrap().to_owned();
    let job: Value = response.json().await.unwrap();
    assert_eq!(path, format!("/v1/jobs/{}", job["id"].as_str().unwrap()));
    assert_eq!(job["links"]["self"], path);
    // defaults are filled in
    assert_eq!(job["document"]["stop"]["confidence"], 0.95);

    let events = service.events_after(&path, 0).await;
    let ids: Vec<i64> = events.iter().map(|event| event.id).collect();
    assert_eq!(ids, (1..=events.len() as i64).collect::<Vec<_>>());
    let names: Vec<&str> = events.iter().map(|event| event.name.as_str()).collect();
    assert_eq!(names[..3], ["queued", "planned", "started"]);
    assert_eq!(names.last(), Some(&"succeeded"));
    let passes: Vec<u64> = events
        .iter()
        .filter(|event| event.name == "pass")
        .map(|event| event.data["passes"].as_u64().unwrap())
        .collect();
    assert_eq!(passes, (1..=20).collect::<Vec<_>>());
    let images: Vec<(&str, u64)> = events
        .iter()
        .filter(|event| event.name == "image")
        .map(|event| (event.data["view"].as_str().unwrap(), event.data["passes"].as_u64().unwrap()))
        .collect();
    assert_eq!(images, [("room", 1), ("room", 4), ("room", 16)]);

    let job = service.json(&path).await;
    assert_eq!(job["status"], "succeeded");
    assert_eq!(job["engine"], format!("skyduct {}", skyduct::VERSION));
    assert_eq!(job["stopped_by"], "max_passes");
    assert_eq!(job["progress"]["passes"], 20);
    assert_eq!(job["progress"]["photons"], 40_000);
    for field in ["plan", "warnings", "timing", "accuracy", "created_at", "started_at", "finished_at"] {
        assert!(!job[field].is_null(), "{field}");
    }

    problem(service.request(Method::POST, &format!("{path}/cancel")).send().await.unwrap(), 409).await;
    let deleted = service.request(Method::DELETE, &path).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    for gone in ["", "/events", "/convergence", "/grids/workplane", "/views/room.png"] {
        problem(service.get(&format!("{path}{gone}")).send().await.unwrap(), 404).await;
    }
    problem(service.request(Method::DELETE, &path).send().await.unwrap(), 404).await;
    let id = path.rsplit('/').next().unwrap();
    let files = service.data.path().join("artifacts/jobs").join(id);
    assert!(!files.exists(), "{} is still there", files.display());
}

/// The files of a job that has ended, in every representation, and those that it does not have.
#[tokio::test]
async fn the_files_of_a_job() {
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    let job = service.finished(&path).await;
    let grid = service.json(job["links"]["grids"]["workplane"].as_str().unwrap()).await;
    assert_eq!(grid["cells"], json!([3, 2]));
    assert_eq!(grid["illuminance_lux"].as_array().unwrap().len(), 2);
    assert!(grid["statistics"]["mean_lux"].as_f64().unwrap() > 0.0);
    let csv = service.get(&format!("{path}/grids/workplane")).header("accept", "text/csv").send().await.unwrap();
    assert!(csv.headers()["content-type"].to_str().unwrap().starts_with("text/csv"));
    assert_eq!(csv.headers()["vary"], "accept");
    let csv = csv.text().await.unwrap();
    assert_eq!(
        csv,
        service.get(&format!("{path}/grids/workplane?format=csv")).send().await.unwrap().text().await.unwrap()
    );

    // the report on the tube: its traced transmission and the job's fluxes tell of the same tube
    let report = service.json(&format!("{path}/tubes/0.json")).await;
    let flux = |end: &str| report["flux"][end]["flux_lm"].as_f64().unwrap();
    let of_job = flux("at_diffuser") / flux("at_collector");
    let traced = &report["sky"]["direct"];
    let [transmission, error] = ["transmission", "standard_error"].map(|field| traced[field].as_f64().unwrap());
    let job_error = report["flux"]["at_diffuser"]["standard_error_lm"].as_f64().unwrap() / flux("at_collector");
    assert!((of_job - transmission).abs() < 4.0 * error.hypot(job_error), "{of_job} {transmission}");
    let plot = service.get(&format!("{path}/tubes/0.svg")).send().await.unwrap();
    assert_eq!(plot.headers()["content-type"], "image/svg+xml");
    problem(service.get(&format!("{path}/tubes/1.json")).send().await.unwrap(), 404).await;
    problem(service.get(&format!("{path}/tubes/0.txt")).send().await.unwrap(), 404).await;

    let map = service.get(&format!("{path}/grids/workplane?format=png")).send().await.unwrap();
    assert_eq!(map.headers()["content-type"], "image/png");

    let exr = service.get(&format!("{path}/views/room.exr")).send().await.unwrap();
    assert_eq!(exr.status(), StatusCode::OK);
    for query in ["", "?style=tone", "?style=false_colour", "?pass=1", "?pass=4", "?pass=16", "?style=tone&pass=16"] {
        let image = service.get(&format!("{path}/views/room.png{query}")).send().await.unwrap();
        assert_eq!(image.status(), StatusCode::OK, "{query}");
        assert_eq!(image.headers()["content-type"], "image/png");
    }
    for (file, status) in [
        ("room.png?pass=2", 422),
        ("room.png?pass=64", 404),
        ("room.png?style=x", 422),
        ("room.png?pass=1&style=false_colour", 422),
        ("room.exr?style=tone", 422),
        ("room.jpg", 404),
        ("other.png", 404),
        ("..%2fgrids%2fworkplane.json", 404),
        ("%2e%2e.png", 404),
    ] {
        problem(service.get(&format!("{path}/views/{file}")).send().await.unwrap(), status).await;
    }
    problem(service.get(&format!("{path}/grids/other")).send().await.unwrap(), 404).await;

    let table = service.json(&format!("{path}/convergence")).await;
    assert_eq!(table["passes"].as_array().unwrap().len(), 20);
    let csv = service.get(&format!("{path}/convergence?format=csv")).send().await.unwrap().text().await.unwrap();
    assert_eq!(csv.lines().count(), 21);
    let svg = service.get(&format!("{path}/convergence.svg")).send().await.unwrap();
    assert_eq!(svg.headers()["content-type"], "image/svg+xml");
    assert!(svg.text().await.unwrap().contains("<svg"));
}

#[tokio::test]
async fn artifacts_are_tagged_and_read_in_ranges() {
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    service.finished(&path).await;
    let url = format!("{path}/views/room.exr");
    let whole = service.get(&url).header("accept-encoding", "gzip").send().await.unwrap();
    assert!(!whole.headers().contains_key("content-encoding"));
    let tag = whole.headers()["etag"].to_str().unwrap().to_owned();
    let bytes = whole.bytes().await.unwrap();
    assert_eq!(tag, format!("\"{}\"", blake3::hash(&bytes).to_hex()));

    let again = service.get(&url).header("if-none-match", &tag).send().await.unwrap();
    assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
    assert_eq!(again.headers()["etag"], tag.as_str());
    assert!(again.bytes().await.unwrap().is_empty());

    let head = service.request(Method::HEAD, &url).send().await.unwrap();
    assert_eq!(head.headers()["content-length"], bytes.len().to_string().as_str());
    assert_eq!(head.headers()["etag"], tag.as_str());

    let part = service.get(&url).header("range", "bytes=3-9").send().await.unwrap();
    assert_eq!(part.status(), StatusCode::PARTIAL_CONTENT);
    assert_eq!(part.headers()["content-range"], format!("bytes 3-9/{}", bytes.len()).as_str());
    assert_eq!(part.bytes().await.unwrap(), bytes.slice(3..10));
    let stale = service.get(&url).header("range", "bytes=3-9").header("if-range", "\"old\"").send().await.unwrap();
    assert_eq!(stale.status(), StatusCode::OK);
    assert_eq!(stale.bytes().await.unwrap(), bytes);
    problem(service.get(&url).header("range", format!("bytes={}-", bytes.len())).send().await.unwrap(), 416).await;

    let job = service.get(&path).send().await.unwrap();
    let tag = job.headers()["etag"].clone();
    let again = service.get(&path).header("if-none-match", tag).send().await.unwrap();
    assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
}

#[tokio::test]
async fn bad_requests_are_problem_documents() {
    let service = TestService::start_with(|config| config.limits.document_bytes = 100_000).await;
    let post = |path: &str, content_type: &str, body: Vec<u8>| {
        let request = service.request(Method::POST, path).header("content-type", content_type).body(body);
        async { request.send().await.unwrap() }
    };
    for path in ["/v1/jobs", "/v1/plan"] {
        for (content_type, body, status) in [
            ("application/json", b"{".to_vec(), 400),
            ("application/json", b"".to_vec(), 400),
            ("application/json", b"{\"seed\": 1e999}".to_vec(), 422),
            ("application/json", b"{\"seed\": NaN}".to_vec(), 400),
            ("application/json", b"{\"name\": \"\xff\"}".to_vec(), 400),
            ("application/json", "[".repeat(50_000).into_bytes(), 400),
            ("application/json", vec![b' '; 100_001], 413),
            ("text/plain", b"{}".to_vec(), 415),
            ("application/x-www-form-urlencoded", b"{}".to_vec(), 415),
            ("application/json", b"{}".to_vec(), 422),
            ("application/json", b"[]".to_vec(), 422),
            ("application/json", b"null".to_vec(), 422),
            ("application/json", b"{\"seed\": 1, \"seed\": 2}".to_vec(), 422),
            ("application/json; charset=utf-8", b"{}".to_vec(), 422),
        ] {
            let refused = problem(post(path, content_type, body).await, status).await;
            let names_bound = || refused["detail"].as_str().unwrap().contains("at most 100000 bytes");
            assert!(status != 413 || names_bound(), "{refused}");
        }
        let mut document = small_job();
        document["room"]["size_m"][0] = json!(-1);
        document["tubes"][0]["diamter_m"] = json!(0.3);
        let problem = problem(post(path, "application/json", document.to_string().into_bytes()).await, 422).await;
        let pointers: Vec<&str> =
            problem["errors"].as_array().unwrap().iter().map(|error| error["pointer"].as_str().unwrap()).collect();
        assert!(pointers.contains(&"/tubes/0/diamter_m") || pointers.contains(&"/room/size_m/0"), "{problem}");
    }
    let missing = uuid::Uuid::now_v7();
    for path in [
        "/web/none.js".to_owned(),
        "/v1".to_owned(),
        "/v1/job".to_owned(),
        "/v1/jobs/".to_owned(),
        "/v1/jobs/x".to_owned(),
        format!("/v1/jobs/{missing}"),
        format!("/v1/jobs/{missing}/events"),
        format!("/v1/jobs/{missing}/convergence"),
        format!("/v1/jobs/{missing}/convergence.svg"),
        format!("/v1/jobs/{missing}/grids/a"),
        format!("/v1/jobs/{missing}/views/a.png"),
        "/v1/meshes/x".to_owned(),
        "/v1/weather/x".to_owned(),
        "/docs/none".to_owned(),
    ] {
        problem(service.get(&path).send().await.unwrap(), 404).await;
    }
    for path in [
        "/v1/jobs?limit=0",
        "/v1/jobs?limit=501",
        "/v1/jobs?limit=x",
        "/v1/jobs?limit=-1",
        "/v1/jobs?limit=1e3",
        "/v1/jobs?status=done",
        "/v1/jobs?cursor=x",
        "/v1/jobs?page=2",
    ] {
        let problem = problem(service.get(path).send().await.unwrap(), 422).await;
        let name = path.split(['?', '=']).nth(1).unwrap();
        let error = &problem["errors"][0];
        assert_eq!((&error["parameter"], &error["pointer"]), (&json!(name), &json!("")), "{problem}");
        // its name and its text stand once
        let detail = error["detail"].as_str().unwrap();
        assert_eq!(problem["detail"], format!("{name}: {detail}"));
        assert!(!detail.starts_with(name), "{problem}");
        assert!(name != "limit" || detail.starts_with("must be 1 to 500, but is "), "{problem}");
    }
    let response = service.request(Method::PUT, "/v1/jobs").send().await.unwrap();
    assert_eq!(response.headers()["allow"], "GET,HEAD,POST,DELETE");
    assert_eq!(problem(response, 405).await["detail"], "this path allows GET,HEAD,POST,DELETE");
    problem(service.request(Method::DELETE, "/v1/skies").send().await.unwrap(), 405).await;
    assert_eq!(service.json("/v1/jobs").await["jobs"], json!([]));
}

#[tokio::test]
async fn a_plan_queues_nothing() {
    let service = TestService::start().await;
    let response = service.request(Method::POST, "/v1/plan").json(&small_job()).send().await.unwrap();
    assert_eq!(response.status(), StatusCode::OK);
    let plan: Value = response.json().await.unwrap();
    assert!(plan["plan"]["effects"].is_array());
    assert_eq!(plan["document"]["seed"], 7);
    assert_eq!(service.json("/v1/jobs").await["jobs"], json!([]));
}

#[tokio::test]
async fn jobs_are_listed_newest_first_in_pages() {
    let service = TestService::start().await;
    let mut submitted = Vec::new();
    for _ in 0..5 {
        submitted.push(service.submit(&small_job()).await);
    }
    submitted.reverse();
    let mut listed = Vec::new();
    let mut query = "?limit=2".to_owned();
    let mut pages = 0;
    loop {
        let page = service.json(&format!("/v1/jobs{query}")).await;
        pages += 1;
        listed.extend(
            page["jobs"].as_array().unwrap().iter().map(|job| job["links"]["self"].as_str().unwrap().to_owned()),
        );
        match page["next_cursor"].as_str() {
            Some(cursor) => query = format!("?limit=2&cursor={cursor}"),
            None => break,
        }
    }
    assert_eq!(listed, submitted);
    assert_eq!(pages, 3);
    for job in &submitted {
        service.finished(job).await;
    }
    let count =
        async |status: &str| service.json(&format!("/v1/jobs?status={status}")).await["jobs"].as_array().unwrap().len();
    assert_eq!(count("succeeded").await, 5);
    assert_eq!(count("queued").await, 0);
}

#[tokio::test]
async fn a_running_job_is_readable_and_cancelled_within_a_pass() {
    let service = TestService::start().await;
    let path = service.submit(&endless_job()).await;
    service.events_until(&path, 0, |event| event.name == "pass").await;
    let grid = service.json(&format!("{path}/grids/workplane")).await;
    assert!(grid["statistics"]["mean_lux"].as_f64().unwrap() > 0.0);
    let image = service.get(&format!("{path}/views/room.png")).send().await.unwrap();
    assert_eq!(image.status(), StatusCode::OK);
    assert_eq!(service.json(&path).await["status"], "running");

    // one that waits is cancelled at once
    let waiting = service.submit(&small_job()).await;
    let cancelled: Value =
        service.request(Method::POST, &format!("{waiting}/cancel")).send().await.unwrap().json().await.unwrap();
    assert_eq!(cancelled["status"], "cancelled");
    problem(service.get(&format!("{waiting}/grids/workplane")).send().await.unwrap(), 404).await;

    let cancel = service.request(Method::POST, &format!("{path}/cancel")).send().await.unwrap();
    assert_eq!(cancel.status(), StatusCode::ACCEPTED);
    let job = tokio::time::timeout(PATIENCE, service.finished(&path)).await.unwrap();
    assert_eq!(job["status"], "cancelled");
    assert_eq!(job["stopped_by"], "cancelled");
    assert!(job["progress"]["passes"].as_u64().unwrap() > 0);
    let grid = service.json(&format!("{path}/grids/workplane")).await;
    assert!(grid["statistics"]["mean_lux"].as_f64().unwrap() > 0.0);
    let again = service.request(Method::POST, &format!("{path}/cancel")).send().await.unwrap();
    assert_eq!(again.status(), StatusCode::ACCEPTED);
    let events = service.events_after(&path, 0).await;
    assert_eq!(events.iter().filter(|event| event.name == "cancelled").count(), 1);
}

#[tokio::test]
async fn a_running_job_is_deleted_and_the_next_one_starts() {
    let service = TestService::start().await;
    let path = service.submit(&endless_job()).await;
    service.events_until(&path, 0, |event| event.name == "pass").await;
    let next = service.submit(&small_job()).await;
    let watching = service.get(&format!("{path}/events")).send().await.unwrap();
    let deleted = service.request(Method::DELETE, &path).send().await.unwrap();
    assert_eq!(deleted.status(), StatusCode::NO_CONTENT);
    // its stream ends
    tokio::time::timeout(PATIENCE, watching.bytes()).await.unwrap().unwrap();
    assert_eq!(service.finished(&next).await["status"], "succeeded");
    let files = service.data.path().join("artifacts/jobs").join(path.rsplit('/').next().unwrap());
    assert!(!files.exists(), "{} is still there", files.display());
}

#[tokio::test]
async fn a_full_queue_says_when_to_come_back() {
    let service = TestService::start_with(|config| config.limits.queued_jobs = 2).await;
    // one is rendered, two wait: they take turns
    let mut jobs = Vec::new();
    for _ in 0..3 {
        jobs.push(service.submit(&endless_job()).await);
    }
    let full = service.post_job(&small_job()).send().await.unwrap();
    assert!(full.headers().contains_key("retry-after"));
    let full = problem(full, 503).await;
    assert_eq!(full["type"], "/problems/queue-full");
    for job in jobs {
        service.request(Method::DELETE, &job).send().await.unwrap();
    }
    service.submit(&small_job()).await;
}

//! Event streams: replay, live events, their end.

use std::time::Instant;

use crate::common::{PATIENCE, TestService, endless_job, problem, small_job};
use reqwest::StatusCode;
use serde_json::{Value, json};

#[tokio::test]
async fn missed_events_are_replayed_exactly_once() {
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    let all = service.events_after(&path, 0).await;
    let last = all.last().unwrap().id;
    for after in [0, 1, 5, last - 1] {
        let rest = service.events_after(&path, after).await;
        let ids: Vec<i64> = rest.iter().map(|event| event.id).collect();
        assert_eq!(ids, (after + 1..=last).collect::<Vec<_>>());
        for (event, first_time) in rest.iter().zip(&all[after as usize..]) {
            assert_eq!((&event.name, &event.data), (&first_time.name, &first_time.data));
        }
    }
    let response = service.get(&format!("{path}/events?after={}", last - 1)).send().await.unwrap();
    let text = response.text().await.unwrap();
    assert!(text.contains("retry: 3000\n"), "{text}");
    assert!(text.contains(&format!("id: {last}\n")) && text.contains("event: succeeded\n"), "{text}");
    // nothing more will come: a client that reconnects by itself is told to stop
    let done = service.get(&format!("{path}/events")).header("last-event-id", last).send().await.unwrap();
    assert_eq!(done.status(), StatusCode::NO_CONTENT);
    for id in ["x", "-1", "1.5", "", "99999999999999999999"] {
        problem(service.get(&format!("{path}/events")).header("last-event-id", id).send().await.unwrap(), 400).await;
    }
    problem(service.get(&format!("{path}/events?after=-1")).send().await.unwrap(), 422).await;
    let both = service.get(&format!("{path}/events?after=-1")).header("Last-Event-ID", "1");
    problem(both.send().await.unwrap(), 422).await;
}

/// After a power failure there are fewer events than were told: who heard of more goes on from the last one that there is.
#[tokio::test]
async fn an_id_of_the_future_goes_on_from_the_last_event() {
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    let all = service.events_after(&path, 0).await;
    let last = all.last().unwrap().id;
    for lost in [1, 7, 1_000_000_000_000] {
        let told = service.events_after(&path, last + lost).await;
        let names: Vec<(i64, &str)> = told.iter().map(|event| (event.id, event.name.as_str())).collect();
        assert_eq!(names, [(last - 1, "restarted"), (last, "succeeded")]);
        assert_eq!(told[0].data["from_pass"], 21);
        assert!(told[0].data["reason"].as_str().unwrap().contains(&last.to_string()), "{}", told[0].data);
        // the address of an `EventSource` says where it began, however often it comes back
        let both = service.get(&format!("{path}/events?after={}", last + lost)).header("last-event-id", last);
        assert_eq!(both.send().await.unwrap().status(), StatusCode::NO_CONTENT);
    }
    let running = service.submit(&endless_job()).await;
    let told = service.events_until(&running, 1_000_000, |event| event.name == "pass").await;
    assert_eq!(told[0].name, "restarted");
    assert!(told.windows(2).all(|pair| pair[1].id == pair[0].id + 1));
}

#[tokio::test]
async fn a_broken_stream_goes_on_where_it_was() {
    let service = TestService::start().await;
    let path = service.submit(&endless_job()).await;
    let mut ids = Vec::new();
    for _ in 0..5 {
        let after = ids.last().copied().unwrap_or(0);
        // the connection is dropped after the tenth event
        let events = service.events_until(&path, after, |event| event.id == after + 10).await;
        ids.extend(events.iter().map(|event| event.id));
    }
    assert_eq!(ids, (1..=50).collect::<Vec<_>>());
}

#[tokio::test]
async fn stopping_ends_streams_and_gives_the_chunk_back() {
    let service = TestService::start().await;
    let path = service.submit(&endless_job()).await;
    service.events_until(&path, 0, |event| event.name == "pass").await;
    let stream = service.get(&format!("{path}/events")).send().await.unwrap();
    let TestService { running, data, .. } = service;
    let start = Instant::now();
    let (stopped, body) =
        tokio::join!(tokio::time::timeout(PATIENCE, running.stop()), tokio::time::timeout(PATIENCE, stream.bytes()));
    stopped.unwrap();
    body.unwrap().unwrap();
    assert!(start.elapsed().as_secs() < 10);

    let store = skyduct::db::SqliteStore::open(&data.path().join("skyduct.db")).await.unwrap();
    use skyduct::queue::store::{ChunkStore, Turn};
    let lease = store.claim("test", PATIENCE, Turn::default()).await.unwrap().expect("the chunk is ready again");
    assert!(path.ends_with(&lease.job.to_string()));
    assert_eq!(lease.failures, 0);
}

/// Every pass tells what is left to it, and the last one that nothing is; a job whose limit holds from the second pass on waits for
/// passes that tell its error.
#[tokio::test]
async fn passes_foretell_the_end_of_their_job() {
    let service = TestService::start().await;
    let mut job = small_job();
    job["stop"] = json!({ "relative_error": 0.9, "view_relative_error": 0.9, "max_passes": 64 });
    let path = service.submit(&job).await;
    let events = service.events_after(&path, 0).await;
    let passes: Vec<&Value> = events.iter().filter(|event| event.name == "pass").map(|event| &event.data).collect();
    let [first, .., last] = passes[..] else { panic!("{passes:?}") };
    assert!(first["seconds_left"].is_null() && first["grids"]["seconds_left"].is_null(), "{first}");
    assert_eq!((&first["waiting_for"], &last["waiting_for"]), (&json!("least_passes"), &Value::Null));
    assert_eq!((&last["seconds_left"], &last["grids"]["seconds_left"]), (&json!(0.0), &json!(0.0)));
    let accuracies = [0.05, 0.02, 0.01, 0.005, 0.001];
    for pass in &passes[1..] {
        let (seconds, left) = (pass["seconds"].as_f64().unwrap(), pass["seconds_left"].as_f64().unwrap());
        assert!(seconds > 0.0 && left >= 0.0, "{pass}");
        for outputs in ["grids", "views"] {
            let times = pass[outputs]["seconds_to"].as_array().unwrap();
            let told: Vec<f64> = times.iter().map(|time| time["relative_error"].as_f64().unwrap()).collect();
            assert_eq!(told, accuracies);
            let later: Vec<f64> = times.iter().filter_map(|time| time["seconds"].as_f64()).collect();
            assert!(later.is_sorted() && later.iter().all(|time| *time >= seconds), "{pass}");
        }
        let fits = pass["passes"].as_u64().unwrap() >= 5;
        assert_eq!(pass["grids"]["exponent"].is_number(), fits, "{pass}");
    }
    #[cfg(target_os = "linux")]
    {
        let cpu = |value: &Value| value["cpu_seconds"].as_f64().unwrap_or_else(|| panic!("{value}"));
        let times: Vec<f64> = passes.iter().map(|pass| cpu(pass)).collect();
        assert!(times[0] > 0.0 && times.is_sorted(), "{times:?}");
        let job = service.json(&path).await;
        let table = service.json(&format!("{path}/convergence")).await;
        assert_eq!(cpu(table["passes"].as_array().unwrap().last().unwrap()), times[times.len() - 1]);
        assert!(cpu(&job["progress"]) >= times[times.len() - 1] && cpu(&job["timing"]) == cpu(&job["progress"]));
    }
}

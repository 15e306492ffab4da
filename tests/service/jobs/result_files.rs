//! What is kept of a finished job, and what is made again when it is asked for.

use std::path::Path;

use crate::common::{TestService, client, config, problem, small_job};
use reqwest::StatusCode;
use skyduct::cli::serve::RunningService;

/// Names of all files below `folder`.
fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.flat_map(|path| if path.is_dir() { files(&path) } else { vec![path.display().to_string()] }).collect()
}

/// Files that are made when they are asked for.
const FILES: [&str; 15] = [
    "tubes/0.json",
    "tubes/0.svg",
    "grids/workplane?format=csv",
    "grids/workplane?format=png",
    "tubes/0.png",
    "grids/workplane.svg?quantity=ratio&max=5&numbers=true",
    "views/room.png?style=false_colour",
    "views/room.png?style=false_colour&max=50&scale=log&palette=viridis&density=2",
    "views/room.png?exposure=20",
    "views/room.svg?style=false_colour",
    "views/room.pdf?style=captioned&exposure=20",
    "grids/workplane.pdf",
    "tubes/0.pdf",
    "figures/section_x.pdf",
    "report.pdf",
];

#[tokio::test]
async fn what_is_not_kept_is_made_when_asked_for_and_the_same_after_a_restart() {
    let TestService { running, http, data } = TestService::start().await;
    let service = TestService { running, http, data };
    let job = service.submit(&small_job()).await;
    assert_eq!(service.finished(&job).await["status"], "succeeded");
    let kept = files(&service.data.path().join("artifacts"));
    assert!(kept.iter().any(|name| name.contains("grids_workplane.json")), "{kept:?}");
    for made_again in ["tubes_", ".csv", "workplane.png", "false_colour"] {
        assert!(!kept.iter().any(|name| name.contains(made_again)), "{made_again}: {kept:?}");
    }

    let read = async |http: &reqwest::Client, url: String| {
        let response = http.get(url).send().await.unwrap();
        assert_eq!(response.status(), StatusCode::OK);
        (response.headers()["etag"].to_str().unwrap().to_owned(), response.bytes().await.unwrap())
    };
    let mut before = Vec::new();
    for file in FILES {
        let url = format!("{}{job}/{file}", service.running.url());
        let (tag, bytes) = read(&service.http, url.clone()).await;
        let again = service.http.get(url).header("if-none-match", &tag).send().await.unwrap();
        assert_eq!(again.status(), StatusCode::NOT_MODIFIED);
        before.push((tag, bytes));
    }
    assert!(before[2].1.starts_with(b"x_m,y_m,z_m,") && before[3].1.starts_with(b"\x89PNG"));
    for (file, (_, bytes)) in FILES.iter().zip(&before).filter(|(file, _)| file.contains(".pdf")) {
        assert!(bytes.starts_with(b"%PDF-") && bytes.ends_with(b"%%EOF"), "{file}");
    }
    let report: serde_json::Value = serde_json::from_slice(&before[0].1).unwrap();
    assert!(report["flux"]["into_room"]["flux_lm"].as_f64().unwrap() > 0.0);
    for name in ["tubes/1.json", "tubes/room.json", "tubes/0.exr", "grids/none?format=csv", "grids/none.svg"] {
        problem(service.get(&format!("{job}/{name}")).send().await.unwrap(), 404).await;
    }
    // a figure less itself; and what does not go together
    let id = job.rsplit('/').next().unwrap();
    let (_, map) = read(&service.http, format!("{}{job}/grids/workplane.svg?minus={id}", service.running.url())).await;
    assert!(String::from_utf8(map.to_vec()).unwrap().contains(" minus "));
    for name in [
        "grids/workplane.csv?max=5",
        "grids/workplane.png?max=0",
        "grids/workplane.png?max=inf",
        "views/room.png?exposure=1e309",
        "grids/workplane.svg?minus=01a204ed-307c-73db-9d17-956a594aff06",
        "views/room.png?max=5",
        "views/room.png?style=false_colour&exposure=5",
        "views/room.exr?exposure=5",
        "views/room.svg",
        "views/room.pdf?style=tone",
    ] {
        let refused = problem(service.get(&format!("{job}/{name}")).send().await.unwrap(), 422).await;
        let says_finite = || refused["detail"].as_str().unwrap().ends_with("must be above 0 and finite, but is inf");
        assert!(!name.ends_with("inf") && !name.ends_with("1e309") || says_finite(), "{refused}");
    }

    let TestService { running, data, .. } = service;
    running.stop().await;
    let running = RunningService::start(config(data.path())).await.unwrap();
    for (file, before) in FILES.into_iter().zip(before) {
        assert_eq!(read(&client(), format!("{}{job}/{file}", running.url())).await, before);
    }
    running.stop().await;
}

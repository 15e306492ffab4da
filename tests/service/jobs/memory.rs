//! What is let in fits into memory, and what would not is refused before.

use std::path::Path;
use std::process::{Command, Output};

use crate::common::{TestService, problem, small_job};
use serde_json::{Value, json};
use skyduct::cli::mesh_files::MeshFiles;
use skyduct::present::prepared::prepare;

/// Views of a million pixels in all, photons that a pass keeps, vertices of light paths, fixed points with statistics, and
/// factors between patches: what memory goes to.
fn large_jobs() -> Vec<(&'static str, Value)> {
    let job = |name, size_px: [u32; 2], cells: [u32; 2], method: Value| {
        let mut job = small_job();
        job["views"][0]["size_px"] = json!(size_px);
        job["grids"][0]["cells"] = json!(cells);
        job["method"] = method;
        job["stop"]["max_passes"] = json!(2);
        (name, job)
    };
    let mut path_tracing =
        job("views", [1280, 1024], [1, 1], json!({ "kind": "path_tracing", "samples_per_pixel": 1 }));
    path_tracing.1["grids"] = json!([]);
    let mut solver = job("factors", [8, 8], [2, 2], json!("holigilm"));
    solver.1["views"] = json!([]);
    solver.1["room"]["size_m"] = json!([400.0, 2.1, 2.1]);
    vec![
        path_tracing,
        job("photons", [64, 64], [9, 9], json!({ "kind": "sppm", "photons_per_pass": 700_000 })),
        job(
            "vertices",
            [8, 8],
            [1, 1],
            json!({ "kind": "bidirectional_path_tracing", "photons_per_pass": 300_000, "samples_per_sensor": 1 }),
        ),
        job(
            "points",
            [256, 256],
            [1, 1],
            json!({ "kind": "ppm", "photons_per_pass": 1000, "samples_per_pixel": 16, "radius": "per_point" }),
        ),
        solver,
    ]
}

fn write(folder: &Path, job: &Value) -> std::path::PathBuf {
    let file = folder.join("job.json");
    std::fs::write(&file, job.to_string()).unwrap();
    file
}

/// Runs `skyduct render` with a limit of `bytes` to the memory that it can get.
fn render_within(bytes: f64, folder: &Path) -> Output {
    let script = format!("ulimit -d {} && exec \"$@\"", (bytes / 1024.0).ceil());
    Command::new("sh")
        .args(["-c", &script, "sh", env!("CARGO_BIN_EXE_skyduct"), "render", "job.json", "--out", "out"])
        .current_dir(folder)
        .output()
        .unwrap()
}

#[test]
fn what_is_let_in_fits_and_what_is_not_is_refused_with_its_estimate() {
    for (name, job) in large_jobs() {
        let folder = tempfile::tempdir().unwrap();
        let file = write(folder.path(), &job);
        let prepared = prepare(&std::fs::read(&file).unwrap(), &MeshFiles::beside(&file)).unwrap();
        let needs = prepared.memory().total();
        // the program itself must find room in the quarter that jobs are not given
        assert!(needs > 150e6, "{name}: {:?}", prepared.memory());
        let output = render_within(1.001 * needs / 0.75, folder.path());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{name}, {:?}: {said}", prepared.memory());
        let output = render_within(0.99 * needs / 0.75, folder.path());
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{name}: {said}");
        assert!(said.contains("GB of memory"), "{name}: {said}");
    }
}

#[tokio::test]
async fn the_sum_of_all_views_counts() {
    let service = TestService::start_with(|config| config.limits.memory_bytes = Some(1_000_000_000)).await;
    let mut job = small_job();
    let view = |number: usize| {
        let mut view = small_job()["views"][0].clone();
        view["name"] = json!(format!("view-{number}"));
        view["size_px"] = json!([4096, 4096]);
        view
    };
    job["views"] = (0..64).map(view).collect();
    job["method"] = json!("path_tracing");
    for path in ["/v1/jobs", "/v1/plan"] {
        let response = service.request(reqwest::Method::POST, path).json(&job).send().await.unwrap();
        let problem = problem(response, 422).await;
        assert_eq!(problem["errors"][0]["pointer"], "/views", "{problem}");
    }
    assert_eq!(service.post_job(&small_job()).send().await.unwrap().status(), 202);
    service.running.stop().await;
}

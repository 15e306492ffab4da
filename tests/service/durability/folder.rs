//! The data folder: whose artifacts are in it, what is swept, what is served of damaged files, whether it can be written to.

use crate::common;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use crate::common::{TestService, client, config, problem, small_job};
use crate::process::Server;
use reqwest::StatusCode;
use skyduct::cli::serve::RunningService;
use tempfile::TempDir;

const DAY: Duration = Duration::from_secs(24 * 3600);

/// All files below a folder, in order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn make_older(file: &Path, by: Duration) {
    let file = std::fs::File::options().write(true).open(file).unwrap();
    file.set_modified(SystemTime::now() - by).unwrap();
}

/// A data folder with the results of two jobs, and a copy of its database from between them.
async fn folder_with_results() -> (TempDir, PathBuf) {
    let service = TestService::start().await;
    let first = service.submit(&small_job()).await;
    service.finished(&first).await;
    let TestService { running, data, .. } = service;
    running.stop().await;
    let backup = data.path().join("backup.db");
    std::fs::copy(data.path().join("skyduct.db"), &backup).unwrap();
    let running = RunningService::start(config(data.path())).await.unwrap();
    let service = TestService { running, http: client(), data };
    let second = service.submit(&small_job()).await;
    service.finished(&second).await;
    let TestService { running, data, .. } = service;
    running.stop().await;
    (data, backup)
}

async fn refused(data: &Path, database: Option<&Path>) -> String {
    let mut config = config(data);
    config.database = database.map(|file| format!("sqlite:{}", file.display()));
    format!("{:#}", RunningService::start(config).await.err().expect("it starts"))
}

/// Starts and stops, with time for the sweep.
async fn start_and_stop(data: &Path) {
    let running = RunningService::start(config(data)).await.unwrap();
    tokio::time::sleep(Duration::from_millis(300)).await;
    running.stop().await;
}

#[tokio::test]
async fn no_other_database_deletes_an_artifact() {
    let (data, backup) = folder_with_results().await;
    let artifacts = data.path().join("artifacts");
    let before = files(&artifacts);
    assert!(before.len() > 10);
    for file in &before {
        make_older(file, 3 * DAY);
    }
    // another one, and an empty one
    let other = tempfile::tempdir().unwrap();
    let refusal = refused(data.path(), Some(&other.path().join("new.db"))).await;
    assert!(refusal.contains("this database has no identity"), "{refusal}");
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    service.finished(&path).await;
    let TestService { running, data: third, .. } = service;
    running.stop().await;
    let refusal = refused(data.path(), Some(&third.path().join("skyduct.db"))).await;
    assert!(refusal.contains("belong to another database"), "{refusal}");
    assert_eq!(files(&artifacts), before);

    let database = data.path().join("skyduct.db");
    let newest = data.path().join("newest.db");
    std::fs::rename(&database, &newest).unwrap();
    std::fs::write(&database, b"").unwrap();
    refused(data.path(), None).await;
    assert_eq!(files(&artifacts), before);

    // a backup of the right one: it starts, and keeps what it does not know, this time and later
    std::fs::copy(&backup, &database).unwrap();
    // made five days ago, before the second job's files
    set_written_at(&database, SystemTime::now() - 5 * DAY).await;
    for file in &before {
        make_older(file, 2 * DAY);
    }
    for _ in 0..3 {
        start_and_stop(data.path()).await;
        assert_eq!(files(&artifacts), before);
    }
}

/// A job whose results the database keeps in its rows alone.
fn job_of_rows(seed: u64) -> serde_json::Value {
    let mut job = small_job();
    job["views"] = serde_json::json!([]);
    job["method"] = serde_json::json!({ "kind": "light_tracing", "photons_per_pass": 64 });
    job["stop"]["max_passes"] = 4.into();
    job["seed"] = seed.into();
    job
}

/// A folder without a file is not free for another database: its own would later sweep what the other one has stored.
#[tokio::test]
async fn no_other_database_adopts_a_folder_of_jobs_that_are_rows() {
    let service = TestService::start().await;
    let path = service.submit(&job_of_rows(1)).await;
    assert_eq!(service.finished(&path).await["status"], "succeeded");
    let TestService { running, data, .. } = service;
    running.stop().await;
    let artifacts = data.path().join("artifacts");
    assert_eq!(files(&artifacts), [artifacts.join("identity")], "its results are rows");
    // another one in the same folder, twice: the refusal leaves nothing that lets it in
    let other = data.path().join("other.db");
    for _ in 0..2 {
        let refusal = refused(data.path(), Some(&other)).await;
        assert!(refusal.contains("this database has no identity"), "{refusal}");
    }
    // one that was emptied in its place
    let database = data.path().join("skyduct.db");
    let kept = data.path().join("kept.db");
    std::fs::rename(&database, &kept).unwrap();
    refused(data.path(), None).await;
    std::fs::rename(&kept, &database).unwrap();
    // who agrees to another one by deleting the note has shut out the first
    std::fs::remove_file(artifacts.join("identity")).unwrap();
    let mut agreed = config(data.path());
    agreed.database = Some(format!("sqlite:{}", other.display()));
    RunningService::start(agreed).await.unwrap().stop().await;
    let refusal = refused(data.path(), None).await;
    assert!(refusal.contains("belong to another database"), "{refusal}");
}

/// Makes the database look as if nothing had been written to it since then.
async fn set_written_at(database: &Path, time: SystemTime) {
    use sqlx::{ConnectOptions, Connection};
    let options = sqlx::sqlite::SqliteConnectOptions::new().filename(database);
    let mut connection = options.connect().await.unwrap();
    let milliseconds = time.duration_since(SystemTime::UNIX_EPOCH).unwrap().as_millis() as i64;
    for statement in
        ["UPDATE store SET written_at = $1", "UPDATE jobs SET created_at = $1, started_at = $1, finished_at = $1"]
    {
        sqlx::query(statement).bind(milliseconds).execute(&mut connection).await.unwrap();
    }
    connection.close().await.unwrap();
}

#[tokio::test]
async fn files_that_nothing_points_to_are_swept_after_a_day() {
    let (data, _) = folder_with_results().await;
    let artifacts = data.path().join("artifacts");
    let before = files(&artifacts);
    let job = before.iter().find(|file| file.to_string_lossy().contains("/jobs/")).unwrap().parent().unwrap();
    let [old, young] = ["old-state", "young-state"].map(|name| job.join(name));
    for file in [&old, &young] {
        std::fs::write(file, b"x").unwrap();
    }
    make_older(&old, 2 * DAY);
    for file in &before {
        make_older(file, 2 * DAY);
    }
    start_and_stop(data.path()).await;
    assert!(!old.exists() && young.exists());
    let mut after = files(&artifacts);
    after.retain(|file| *file != young);
    assert_eq!(after, before);
}

/// What a service from before there were identities left behind.
#[tokio::test]
async fn an_older_data_folder_opens_and_gets_an_identity() {
    let (data, _) = folder_with_results().await;
    let note = data.path().join("artifacts/identity");
    let identity = std::fs::read_to_string(&note).unwrap();
    std::fs::remove_file(&note).unwrap();
    forget_identity(&data.path().join("skyduct.db")).await;
    let before = files(&data.path().join("artifacts"));
    start_and_stop(data.path()).await;
    let new = std::fs::read_to_string(&note).unwrap();
    assert!(!new.trim().is_empty() && new != identity);
    std::fs::remove_file(&note).unwrap();
    assert_eq!(files(&data.path().join("artifacts")), before);
    // the note alone is lost: it is written anew
    start_and_stop(data.path()).await;
    assert_eq!(std::fs::read_to_string(&note).unwrap(), new);
    // the artifacts are lost: nobody takes an empty folder for theirs
    let moved = data.path().join("moved");
    std::fs::rename(data.path().join("artifacts"), &moved).unwrap();
    let refusal = refused(data.path(), None).await;
    assert!(refusal.contains("none of them exists") && refusal.contains(new.trim()), "{refusal}");
    std::fs::write(&note, &new).unwrap();
    start_and_stop(data.path()).await;
}

async fn forget_identity(database: &Path) {
    use sqlx::{ConnectOptions, Connection};
    let mut connection = sqlx::sqlite::SqliteConnectOptions::new().filename(database).connect().await.unwrap();
    sqlx::query("DELETE FROM store").execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
}

#[tokio::test]
async fn two_services_on_one_database_are_refused() {
    let service = TestService::start().await;
    let other = tempfile::tempdir().unwrap();
    let refusal = refused(other.path(), Some(&service.data.path().join("skyduct.db"))).await;
    assert!(refusal.contains("another process serves the database"), "{refusal}");
    let link = other.path().join("link.db");
    std::os::unix::fs::symlink(service.data.path().join("skyduct.db"), &link).unwrap();
    let refusal = refused(other.path(), Some(&link)).await;
    assert!(refusal.contains("another process serves the database"), "{refusal}");
    let link = other.path().join("hard.db");
    std::fs::hard_link(service.data.path().join("skyduct.db"), &link).unwrap();
    let refusal = refused(other.path(), Some(&link)).await;
    assert!(refusal.contains("hard.db: the file has 2 names (hard links)"), "{refusal}");
}

#[tokio::test]
async fn the_data_folder_is_its_owners_alone() {
    let parent = tempfile::tempdir().unwrap();
    let data = parent.path().join("a").join("data");
    let running = RunningService::start(config(&data)).await.unwrap();
    let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
    assert_eq!(mode(&data), 0o700);
    assert_eq!(mode(&data.join("artifacts")), 0o700);
    for file in ["skyduct.db", "skyduct.db-wal", "lock"] {
        assert_eq!(mode(&data.join(file)), 0o600, "{file}");
    }
    running.stop().await;
}

#[tokio::test]
async fn damaged_and_missing_results_are_told_and_never_served() {
    let service = TestService::start().await;
    let path = service.submit(&small_job()).await;
    service.finished(&path).await;
    let stored = |name: &str| {
        let found: Vec<PathBuf> = files(&service.data.path().join("artifacts"))
            .into_iter()
            .filter(|file| file.to_string_lossy().ends_with(name))
            .collect();
        assert_eq!(found.len(), 1, "{name}");
        found[0].clone()
    };
    let grid = stored("grids_workplane.json");
    let mut bytes = std::fs::read(&grid).unwrap();
    let at = bytes.iter().position(|byte| *byte == b'1').unwrap();
    bytes[at] = b'2';
    std::fs::write(&grid, &bytes).unwrap();
    let exr = stored("views_room.exr");
    let short = std::fs::read(&exr).unwrap();
    std::fs::write(&exr, &short[..short.len() / 2]).unwrap();
    std::fs::remove_file(stored("views_room.png")).unwrap();
    for (url, what) in [
        ("grids/workplane", "the stored file is damaged"),
        ("views/room.exr", "the stored file is damaged"),
        ("views/room.png", "missing"),
    ] {
        for range in [None, Some("bytes=0-3")] {
            let mut request = service.get(&format!("{path}/{url}"));
            if let Some(range) = range {
                request = request.header("range", range);
            }
            let problem = problem(request.send().await.unwrap(), 500).await;
            assert_eq!(problem["type"], "/problems/damaged-artifact", "{url}");
            let text = problem.to_string();
            assert!(text.contains(what), "{text}");
            assert!(!text.contains(&*service.data.path().to_string_lossy()), "{text}");
        }
    }
    // what is made from a damaged file is damaged, too
    let table = problem(service.get(&format!("{path}/grids/workplane?format=csv")).send().await.unwrap(), 500).await;
    assert_eq!(table["type"], "/problems/damaged-artifact");
    let sound = service.get(&format!("{path}/views/room.png?pass=16")).send().await.unwrap();
    assert_eq!(sound.status(), StatusCode::OK);
}

/// The same bits as without the damage, and each pass told once.
#[tokio::test]
async fn a_job_whose_state_is_damaged_or_missing_is_rendered_again() {
    let mut document = small_job();
    // it takes longer than two chunks
    document["method"]["photons_per_pass"] = 300_000.into();
    document["stop"]["max_passes"] = 40.into();
    let undisturbed = {
        let service = TestService::start().await;
        let path = service.submit(&document).await;
        service.finished(&path).await;
        service.get(&format!("{path}/grids/workplane")).send().await.unwrap().bytes().await.unwrap()
    };
    type Harm = fn(&Path);
    let flip: Harm = |file| {
        let mut bytes = std::fs::read(file).unwrap();
        let at = bytes.len() / 2;
        bytes[at] ^= 4;
        std::fs::write(file, bytes).unwrap();
    };
    let remove: Harm = |file| std::fs::remove_file(file).unwrap();
    // the newest state, and all of them
    for (harm, all) in [(flip, false), (remove, true)] {
        let service = TestService::start().await;
        let path = service.submit(&document).await;
        let artifacts = service.data.path().join("artifacts");
        let states = || {
            let mut states: Vec<PathBuf> = files(&artifacts);
            states.retain(|file| file.to_string_lossy().ends_with("-state"));
            states
        };
        let is_enough = |passes: Option<u64>| passes >= Some(20) && states().len() >= 2;
        service.events_until(&path, 0, |event| is_enough(event.data["passes"].as_u64())).await;
        let TestService { running, data, .. } = service;
        running.stop().await;
        let mut states = states();
        assert_eq!(states.len(), 2, "the newest and the one before");
        let newest = |file: &PathBuf| std::fs::metadata(file).unwrap().modified().unwrap();
        states.sort_by_key(newest);
        for state in &states[usize::from(!all)..] {
            harm(state);
        }
        let running = RunningService::start(config(data.path())).await.unwrap();
        let service = TestService { running, http: client(), data };
        let events = service.events_after(&path, 0).await;
        let ids: Vec<i64> = events.iter().map(|event| event.id).collect();
        assert_eq!(ids, (1..=events.len() as i64).collect::<Vec<_>>());
        assert_eq!(events.last().unwrap().name, "succeeded");
        let passes: Vec<u64> = events
            .iter()
            .filter(|event| event.name == "pass")
            .map(|event| event.data["passes"].as_u64().unwrap())
            .collect();
        assert_eq!(passes, (1..=40).collect::<Vec<_>>());
        let restarts: Vec<_> = events.iter().filter(|event| event.name == "restarted").collect();
        assert_eq!(restarts.len(), if all { 2 } else { 1 });
        let from_pass = restarts.last().unwrap().data["from_pass"].as_u64().unwrap();
        assert!(if all { from_pass == 1 } else { (2..40).contains(&from_pass) }, "{from_pass}");
        let table = service.json(&format!("{path}/convergence")).await;
        assert_eq!(table["passes"].as_array().unwrap().len(), 40);
        let grid = service.get(&format!("{path}/grids/workplane")).send().await.unwrap().bytes().await.unwrap();
        assert_eq!(grid, undisturbed);
    }
}

#[tokio::test]
async fn a_service_without_space_is_not_ready_and_says_why() {
    let service = TestService::start_with(|config| config.limits.free_bytes = u64::MAX).await;
    let answer = service.get("/readyz").send().await.unwrap();
    assert!(answer.headers().contains_key("retry-after"));
    let problem = problem(answer, 503).await;
    assert!(problem["detail"].as_str().unwrap().contains("nearly full"), "{problem}");
    assert!(!problem.to_string().contains(&*service.data.path().to_string_lossy()));
    assert_eq!(service.get("/livez").send().await.unwrap().status(), StatusCode::OK);
}

#[tokio::test]
async fn a_service_that_cannot_write_artifacts_is_not_ready() {
    let service = TestService::start().await;
    assert_eq!(service.get("/readyz").send().await.unwrap().status(), StatusCode::OK);
    let artifacts = service.data.path().join("artifacts");
    let moved = service.data.path().join("moved");
    std::fs::rename(&artifacts, &moved).unwrap();
    // a file where the folder was, so that nobody can make it anew
    std::fs::write(&artifacts, b"").unwrap();
    let deadline = SystemTime::now() + common::PATIENCE;
    let not_ready = loop {
        let answer = service.get("/readyz").send().await.unwrap();
        if answer.status() != StatusCode::OK {
            break answer;
        }
        assert!(SystemTime::now() < deadline, "it still says that it is ready");
        tokio::time::sleep(Duration::from_millis(200)).await;
    };
    let problem = problem(not_ready, 503).await;
    assert_eq!(problem["detail"], "result files cannot be written to the disk");
    std::fs::remove_file(&artifacts).unwrap();
    std::fs::rename(&moved, &artifacts).unwrap();
    while service.get("/readyz").send().await.unwrap().status() != StatusCode::OK {
        assert!(SystemTime::now() < deadline, "it never gets ready again");
        tokio::time::sleep(Duration::from_millis(200)).await;
    }
}

/// Nobody else on the machine reads jobs and their results: not in the data folder, and not in a backup of it.
#[tokio::test]
async fn files_are_for_the_user_of_the_service_alone() {
    fn public(folder: &Path) -> Vec<(PathBuf, u32)> {
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode() & 0o777;
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        let within =
            entries.flat_map(|path| if path.is_dir() { public(&path) } else { vec![(path.clone(), mode(&path))] });
        within.chain([(folder.to_owned(), mode(folder))]).filter(|(_, mode)| mode & 0o077 != 0).collect()
    }
    let folder = tempfile::tempdir().unwrap();
    let [data, backup] = ["data", "backup"].map(|name| folder.path().join(name));
    // as most users have it
    let server = Server::start_after("umask 022", &data, &[]);
    let path = server.submit(&small_job()).await;
    let posted = client().post(format!("{}/v1/meshes", server.url)).header("content-type", "model/obj");
    let mesh = posted.body("o pipe\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").send().await.unwrap();
    assert_eq!(mesh.status(), StatusCode::CREATED);
    while server.json(&path).await["status"] != "succeeded" {
        tokio::time::sleep(Duration::from_millis(20)).await;
    }
    let mut command = std::process::Command::new("sh");
    let command = command.arg("-c").arg("umask 022; exec \"$0\" backup \"$1\" --data \"$2\"");
    let made = command.arg(env!("CARGO_BIN_EXE_skyduct")).arg(&backup).arg(&data).output().unwrap();
    assert!(made.status.success(), "{made:?}");
    for folder in [&data, &backup] {
        assert!(files(&folder.join("artifacts")).len() > 3 && folder.join("skyduct.db").is_file());
        assert_eq!(public(folder), [], "{}", folder.display());
    }
}

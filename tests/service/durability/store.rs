//! What the store does when the disk is full, when processes die, when states are damaged, and how jobs take turns.

use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::time::Duration;

use skyduct::db::SqliteStore;
use skyduct::engine::progress::{PassReport, Progress, StoppedBy};
use skyduct::queue::store::*;
use sqlx::{ConnectOptions, Connection, Row, sqlite::SqliteConnectOptions};
use tempfile::TempDir;
use uuid::Uuid;

use crate::common::{most, new_job};

const LEASE: Duration = Duration::from_secs(600);

async fn store() -> (SqliteStore, TempDir) {
    let folder = tempfile::tempdir().unwrap();
    (SqliteStore::open(&folder.path().join("test.db")).await.unwrap(), folder)
}

async fn submit(store: &SqliteStore) -> Uuid {
    match store.submit(new_job(), most(100_000)).await.unwrap() {
        Submission::New(job) => job.head.id,
        _ => panic!("not new"),
    }
}

async fn claim(store: &SqliteStore, owner: &str) -> Option<Lease> {
    store.claim(owner, LEASE, Turn::default()).await.unwrap()
}

/// What a large transaction made of the log is given back to the disk when the log begins anew.
#[tokio::test]
async fn a_large_transaction_leaves_no_large_log() {
    let (store, folder) = store().await;
    let log = || folder.path().join("test.db-wal").metadata().unwrap().len();
    let large = NewJob { submitted: "x".repeat(40_000_000), ..new_job() };
    assert!(matches!(store.submit(large, most(100_000)).await.unwrap(), Submission::New(_)));
    assert!(log() > 40_000_000);
    for _ in 0..3 {
        submit(&store).await;
    }
    assert!(log() <= 17_000_000, "{}", log());
}

fn pass(passes: u64) -> PassReport {
    PassReport {
        passes,
        seconds: 0.1 * passes as f64,
        photons: 100 * passes,
        rays: 1000 * passes,
        relative_error: (passes > 1).then(|| 1.0 / passes as f64),
        mean_lux: Some(0.1),
        ..PassReport::default()
    }
}

fn state(chunk: u64) -> StateFile {
    StateFile { key: format!("state-{chunk}"), hash: format!("hash-{chunk}") }
}

/// The completion of `chunk` of a job whose chunks have 8 passes.
fn go_on(chunk: u64) -> Completion {
    Completion::Continue {
        state: state(chunk),
        progress: Progress {
            passes: 8 * (chunk + 1),
            chunks: chunk + 1,
            seconds: 1.5 * (chunk + 1) as f64,
            ..Progress::default()
        },
        ahead: Vec::new(),
    }
}

fn end(last: u64) -> Completion {
    Completion::Finish(Finish {
        end: JobEnd::Succeeded {
            stopped_by: StoppedBy::MaxPasses,
            progress: Progress { passes: last, ..Progress::default() },
        },
        summary: None,
        artifacts: Vec::new(),
        last_pass: Some(Box::new(pass(last).into())),
    })
}

async fn events(store: &SqliteStore, job: Uuid) -> Vec<Event> {
    let events = store.events(job, 0, 100_000).await.unwrap();
    for (index, event) in events.iter().enumerate() {
        assert_eq!(event.seq, index as i64 + 1, "gapless");
    }
    events
}

async fn names(store: &SqliteStore, job: Uuid) -> Vec<String> {
    events(store, job).await.into_iter().map(|event| event.name).collect()
}

#[tokio::test]
async fn a_disk_that_was_full_heals() {
    let (store, _folder) = store().await;
    let running = submit(&store).await;
    let lease = claim(&store, "w").await.unwrap();
    let before = store.unfinished().await.unwrap();
    store.limit_pages(1);
    let mut accepted = 0;
    let refused = loop {
        match store.submit(new_job(), most(100_000)).await {
            Ok(_) => accepted += 1,
            Err(error) => break error,
        }
        assert!(accepted < 10_000, "the limit has no effect");
    };
    assert!(matches!(refused, StoreError::Unavailable(_)), "{refused}");
    // as long as it is full, the answer stays the same, and reading goes on
    for _ in 0..3 {
        let error = store.submit(new_job(), most(100_000)).await.err().expect("still full");
        assert!(matches!(error, StoreError::Unavailable(_)), "{error}");
        assert!(store.job(running).await.unwrap().is_some());
    }
    store.limit_pages(0);
    let healed = submit(&store).await;
    assert_eq!(names(&store, healed).await, ["queued", "planned"]);
    assert_eq!(store.unfinished().await.unwrap(), before + accepted + 1, "no half job");
    // the job that ran goes on
    assert_eq!(store.heartbeat(&lease, LEASE).await.unwrap(), Beat::Keep);
    assert!(matches!(store.complete(&lease, &[], &go_on(0)).await.unwrap(), Committed::Yes { .. }));
    store.ready().await.unwrap();
    store.check().await.unwrap();
}

#[tokio::test]
async fn a_lease_that_is_over_and_the_owners_own_are_taken_at_the_next_claim() {
    let (store, _folder) = store().await;
    let job = submit(&store).await;
    let other = submit(&store).await;
    let first = store.claim("zombie", Duration::ZERO, Turn::default()).await.unwrap().unwrap();
    tokio::time::sleep(Duration::from_millis(5)).await;
    let second = claim(&store, "w").await.unwrap();
    assert_eq!((first.job, second.job, second.attempt), (job, job, 2));
    assert_eq!(store.heartbeat(&first, LEASE).await.unwrap(), Beat::Lost);
    // giving it back failed, say: who claims again has lost it
    let third = claim(&store, "w").await.unwrap();
    assert_eq!((third.job, third.attempt), (job, 3));
    assert_eq!(claim(&store, "v").await.unwrap().job, other);
    assert_eq!(claim(&store, "u").await, None);
}

#[tokio::test]
async fn a_claim_finds_its_chunk_by_the_index() {
    let (store, folder) = store().await;
    for _ in 0..3 {
        submit(&store).await;
    }
    store.close().await;
    let file = folder.path().join("test.db");
    let mut connection = SqliteConnectOptions::new().filename(&file).connect().await.unwrap();
    let plan = sqlx::query(
        "EXPLAIN QUERY PLAN SELECT c.job_id, c.idx FROM chunks c WHERE c.state <> 'done' AND c.deaths <= 3 \
         AND (c.state = 'ready' OR c.owner = 'me' OR c.lease_until < 5) ORDER BY c.line, c.turn, c.rowid LIMIT 1",
    )
    .fetch_all(&mut connection)
    .await
    .unwrap();
    let plan: Vec<String> = plan.iter().map(|row| row.get("detail")).collect();
    let plan = plan.join("; ");
    assert!(plan.contains("USING INDEX chunks_open") && !plan.contains("TEMP B-TREE"), "{plan}");
    connection.close().await.unwrap();
}

#[tokio::test]
async fn jobs_take_turns_and_first_chunks_come_first() {
    let (store, _folder) = store().await;
    let [a, b] = [submit(&store).await, submit(&store).await];
    let mut chunks = std::collections::HashMap::from([(a, 0), (b, 0)]);
    let mut order = Vec::new();
    for _ in 0..6 {
        let lease = claim(&store, "w").await.unwrap();
        assert_eq!(lease.chunk, chunks[&lease.job]);
        store.complete(&lease, &[], &go_on(lease.chunk)).await.unwrap();
        *chunks.get_mut(&lease.job).unwrap() += 1;
        order.push(lease.job);
    }
    assert_eq!(order, [a, b, a, b, a, b]);
    // a new job need not wait for long ones
    let new = submit(&store).await;
    let lease = claim(&store, "w").await.unwrap();
    assert_eq!(lease.job, new);
    store.complete(&lease, &[], &go_on(0)).await.unwrap();
    // a turn is more than one chunk
    let stay = |job| Turn { stay_with: Some(job), ..Turn::default() };
    for chunk in 1..4 {
        let lease = store.claim("w", LEASE, stay(new)).await.unwrap().unwrap();
        assert_eq!((lease.job, lease.chunk), (new, chunk));
        store.complete(&lease, &[], &go_on(chunk)).await.unwrap();
    }
    // who is cancelled comes at once
    store.cancel(b).await.unwrap();
    assert_eq!(claim(&store, "w").await.unwrap().job, b);
    // a job to stay with that has nothing to do holds nobody up
    assert_eq!(store.claim("v", LEASE, stay(Uuid::now_v7())).await.unwrap().unwrap().job, a);
}

#[tokio::test]
async fn a_job_over_which_three_processes_died_fails_and_the_others_do_not() {
    let (store, _folder) = store().await;
    let (poison, healthy) = (submit(&store).await, submit(&store).await);
    for death in 0..MAX_DEATHS {
        // a process that is not steady leaves it alone
        let steady = Turn { most_deaths: death, ..Turn::default() };
        if death > 0 {
            let unsteady = Turn { most_deaths: death - 1, ..Turn::default() };
            let lease = store.claim("w", LEASE, unsteady).await.unwrap().unwrap();
            assert_eq!(lease.job, healthy, "others go on meanwhile");
            store.release(&lease).await.unwrap();
        }
        let lease = store.claim("w", LEASE, Turn { stay_with: Some(poison), ..steady }).await.unwrap().unwrap();
        assert_eq!(lease.job, poison);
        let found = store.take_back(true).await.unwrap();
        let last = death + 1 == MAX_DEATHS;
        let expected = TakenBack { ready: u64::from(!last), failed: if last { vec![poison] } else { Vec::new() } };
        assert_eq!(found, expected);
    }
    let job = store.job(poison).await.unwrap().unwrap();
    assert_eq!(job.head.status, JobStatus::Failed);
    assert_eq!(job.problem.unwrap().detail, "the process died 3 times while rendering this job");
    assert_eq!(names(&store, poison).await, ["queued", "planned", "started", "failed"]);
    let lease = claim(&store, "w").await.unwrap();
    assert_eq!((lease.job, lease.failures), (healthy, 0));
    assert_eq!(claim(&store, "v").await, None);
}

#[tokio::test]
async fn deaths_of_a_job_that_gets_further_do_not_count() {
    let (store, _folder) = store().await;
    let job = submit(&store).await;
    for attempt in 0..8 {
        let lease = claim(&store, "w").await.unwrap();
        // the first attempts get one pass further each, and then two die before they get there
        if attempt % 3 == 0 {
            store.report(&lease, &[Report::Pass(pass(attempt / 3 + 1).into())]).await.unwrap();
        } else {
            store.report(&lease, &[Report::Pass(pass(1).into())]).await.unwrap();
        }
        assert_eq!(store.take_back(true).await.unwrap(), TakenBack { ready: 1, failed: Vec::new() }, "{attempt}");
    }
    // ends that are no deaths change nothing
    for _ in 0..5 {
        claim(&store, "w").await.unwrap();
        assert_eq!(store.take_back(false).await.unwrap(), TakenBack { ready: 1, failed: Vec::new() });
    }
    // the chunk is done: the next one starts from nothing
    let lease = claim(&store, "w").await.unwrap();
    store.complete(&lease, &[], &go_on(0)).await.unwrap();
    for _ in 0..2 {
        claim(&store, "w").await.unwrap();
        assert!(store.take_back(true).await.unwrap().failed.is_empty());
    }
    claim(&store, "w").await.unwrap();
    assert_eq!(store.take_back(true).await.unwrap().failed, [job]);
}

#[tokio::test]
async fn a_damaged_state_is_rendered_again_from_the_one_before() {
    let (store, _folder) = store().await;
    let job = submit(&store).await;
    for chunk in 0..3 {
        let lease = claim(&store, "w").await.unwrap();
        let passes: Vec<Report> =
            (8 * chunk + 1..=8 * chunk + 8).map(|number| Report::Pass(pass(number).into())).collect();
        let committed = store.complete(&lease, &passes, &go_on(chunk)).await.unwrap();
        // the state before is kept
        let obsolete = if chunk == 2 { vec!["state-0".to_owned()] } else { Vec::new() };
        assert_eq!(committed, Committed::Yes { obsolete });
    }
    let kept = store.referenced_keys().await.unwrap();
    assert_eq!(kept, ["state-1".to_owned(), "state-2".to_owned()].into());
    let lease = claim(&store, "w").await.unwrap();
    assert_eq!(lease.chunk, 3);
    let forged = Lease { attempt: 7, ..lease.clone() };
    assert_eq!(store.rewind(&forged, "x").await.unwrap(), Committed::LeaseLost);
    let back = store.rewind(&lease, "the state is damaged").await.unwrap();
    assert_eq!(back, Committed::Yes { obsolete: vec!["state-2".into()] });
    let found = store.job(job).await.unwrap().unwrap();
    let source = store.job_source(job).await.unwrap().unwrap();
    assert_eq!((source.state, source.merged_spent.seconds), (Some(state(1)), 3.0));
    assert_eq!((found.head.progress.passes, found.head.progress.chunks), (16, 2));
    assert_eq!(store.heartbeat(&lease, LEASE).await.unwrap(), Beat::Lost);

    // the one before is damaged, too: from the start
    let lease = claim(&store, "w").await.unwrap();
    assert_eq!((lease.chunk, lease.attempt), (2, 2));
    store.rewind(&lease, "the state is damaged").await.unwrap();
    assert_eq!(store.job_source(job).await.unwrap().unwrap().state, None);
    for chunk in 0..3 {
        let lease = claim(&store, "w").await.unwrap();
        assert_eq!(lease.chunk, chunk);
        let passes: Vec<Report> =
            (8 * chunk + 1..=8 * chunk + 8).map(|number| Report::Pass(pass(number).into())).collect();
        let completion = if chunk < 2 { go_on(chunk) } else { end(24) };
        assert!(matches!(store.complete(&lease, &passes, &completion).await.unwrap(), Committed::Yes { .. }));
    }
    let names = names(&store, job).await;
    assert_eq!(names.iter().filter(|name| *name == "pass").count(), 24, "none twice, none missing");
    assert_eq!(names.last().map(String::as_str), Some("succeeded"));
    let restarts: Vec<Event> =
        events(&store, job).await.into_iter().filter(|event| event.name == "restarted").collect();
    let from: Vec<u64> = restarts.iter().map(|event| event.data["from_pass"].as_u64().unwrap()).collect();
    assert_eq!(from, [17, 1]);
    assert_eq!(restarts[0].data["reason"], "the state is damaged");
    let table: Vec<u64> = store.convergence(job, 0, 1000).await.unwrap().iter().map(|row| row.passes).collect();
    assert_eq!(table, (1..=24).collect::<Vec<_>>());
}

#[tokio::test]
async fn a_long_job_has_few_rows_and_the_last_one() {
    let (store, _folder) = store().await;
    let job = submit(&store).await;
    let lease = claim(&store, "w").await.unwrap();
    for start in (0..200_000).step_by(1000) {
        let reports: Vec<Report> = (start + 1..=start + 1000).map(|number| Report::Pass(pass(number).into())).collect();
        assert!(store.report(&lease, &reports).await.unwrap());
        assert_eq!(store.job_head(job).await.unwrap().unwrap().progress.passes, start + 1000, "progress is exact");
    }
    store.complete(&lease, &[], &end(200_000)).await.unwrap();
    let rows = store.convergence(job, 0, 1000).await.unwrap();
    assert!(rows.len() < 200, "{}", rows.len());
    let passes: Vec<u64> = rows.iter().map(|row| row.passes).collect();
    assert_eq!(passes[..64], (1..=64).collect::<Vec<_>>());
    assert_eq!(passes.last(), Some(&200_000));
    let told: Vec<u64> = events(&store, job)
        .await
        .iter()
        .filter(|event| event.name == "pass")
        .map(|event| event.data["passes"].as_u64().unwrap())
        .collect();
    assert_eq!(told, passes);
    // in pages
    let mut paged = Vec::new();
    loop {
        let page = store.convergence(job, paged.last().copied().unwrap_or(0), 50).await.unwrap();
        if page.is_empty() {
            break;
        }
        paged.extend(page.iter().map(|row| row.passes));
    }
    assert_eq!(paged, passes);
}

/// Before passes were thinned, each had a row and an event.
#[tokio::test]
async fn a_big_job_of_an_old_database_is_drawn_with_few_points_and_deleted_in_pieces() {
    let (store, folder) = store().await;
    let job = submit(&store).await;
    store.close().await;
    let file = folder.path().join("test.db");
    let mut connection = SqliteConnectOptions::new().filename(&file).connect().await.unwrap();
    for statement in [
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 25000) \
         INSERT INTO passes (job_id, pass, seconds, photons, rays) SELECT $1, i, i, i, i FROM n",
        "WITH RECURSIVE n(i) AS (SELECT 10 UNION ALL SELECT i + 1 FROM n WHERE i < 25000) \
         INSERT INTO events (job_id, seq, name, data, at) SELECT $1, i, 'pass', '{}', 0 FROM n",
    ] {
        sqlx::query(statement).bind(job.to_string()).execute(&mut connection).await.unwrap();
    }
    connection.close().await.unwrap();
    let store = SqliteStore::open(&file).await.unwrap();
    let outline = store.convergence_outline(job, 2000).await.unwrap();
    assert!((1000..=2000).contains(&outline.len()), "{}", outline.len());
    assert_eq!((outline[0].passes, outline.last().unwrap().passes), (1, 25_000));
    let size = std::fs::metadata(&file).unwrap().len();
    assert!(store.delete(job).await.unwrap());
    assert!(store.job(job).await.unwrap().is_none());
    assert!(store.events(job, 0, 10).await.unwrap().is_empty());
    assert!(store.convergence(job, 0, 10).await.unwrap().is_empty());
    assert!(!store.delete(job).await.unwrap());
    store.close().await;
    let left = std::fs::metadata(&file).unwrap().len();
    assert!(left < size, "{left} of {size} bytes: the file shrinks");
}

#[tokio::test]
async fn a_database_has_one_service_by_whatever_path() {
    let (store, folder) = store().await;
    let file = folder.path().join("test.db");
    let link = folder.path().join("link.db");
    std::os::unix::fs::symlink(&file, &link).unwrap();
    let linked_folder = folder.path().join("folder");
    std::os::unix::fs::symlink(folder.path(), &linked_folder).unwrap();
    let around = folder.path().join("folder").join("..").join(folder.path().file_name().unwrap()).join("test.db");
    for path in [&file, &link, &linked_folder.join("test.db"), &around] {
        let refused = SqliteStore::open(path).await.err().expect("taken").to_string();
        assert!(refused.contains("another process serves"), "{refused}");
    }
    store.close().await;
    SqliteStore::open(&link).await.unwrap();
}

#[tokio::test]
async fn the_database_is_its_owners_alone() {
    let (store, folder) = store().await;
    submit(&store).await;
    for name in ["test.db", "test.db-wal", "test.db-shm", "test.db.lock"] {
        assert_eq!(mode(&folder.path().join(name)), 0o600, "{name}");
    }
}

fn mode(path: &Path) -> u32 {
    std::fs::metadata(path).unwrap().permissions().mode() & 0o777
}

#[tokio::test]
async fn a_lock_of_another_process_is_waited_for_and_then_told() {
    let (store, folder) = store().await;
    let options = SqliteConnectOptions::new().filename(folder.path().join("test.db"));
    let mut other = options.connect().await.unwrap();
    sqlx::query("BEGIN EXCLUSIVE").execute(&mut other).await.unwrap();
    // within the five seconds for which a writer waits
    let waiting = async {
        tokio::time::sleep(Duration::from_secs(1)).await;
        sqlx::query("ROLLBACK").execute(&mut other).await.unwrap();
    };
    let (submitted, ()) = tokio::join!(store.submit(new_job(), most(100)), waiting);
    assert!(matches!(submitted, Ok(Submission::New(_))));
    // and beyond them
    sqlx::query("BEGIN EXCLUSIVE").execute(&mut other).await.unwrap();
    assert!(matches!(store.submit(new_job(), most(100)).await, Err(StoreError::Unavailable(_))));
    assert_eq!(store.count(JobStatus::Queued).await.unwrap(), 1, "readers go on");
    sqlx::query("ROLLBACK").execute(&mut other).await.unwrap();
    assert!(matches!(store.submit(new_job(), most(100)).await, Ok(Submission::New(_))));
}

#[tokio::test]
async fn a_database_of_a_newer_version_is_refused() {
    let (store, folder) = store().await;
    store.close().await;
    let file = folder.path().join("test.db");
    let mut connection = SqliteConnectOptions::new().filename(&file).connect().await.unwrap();
    let newer = "INSERT INTO _sqlx_migrations (version, description, success, checksum, execution_time) \
                 VALUES (9999, 'of tomorrow', TRUE, x'00', 0)";
    sqlx::query(newer).execute(&mut connection).await.unwrap();
    connection.close().await.unwrap();
    let Err(StoreError::Failed(reason)) = SqliteStore::open(&file).await else { panic!("it opened") };
    assert!(reason.contains("9999"), "{reason}");
}

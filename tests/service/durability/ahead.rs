//! Passes that are computed ahead of their job's chunk: in whatever order workers compute them and die, the job has the same bits.

use std::collections::HashMap;
use std::time::Duration;

use bytes::Bytes;
use serde_json::{Value, json};
use skyduct::db::SqliteStore;
use skyduct::document::NoFiles;
use skyduct::engine::ahead::{RangeAhead, stored_outcomes};
use skyduct::engine::cancel::Stop;
use skyduct::engine::checkpoint::{decode, encode};
use skyduct::engine::progress::{Progress, StoppedBy};
use skyduct::engine::spent::Spent;
use skyduct::estimate::Estimate;
use skyduct::estimate::stopping::Wanted;
use skyduct::present::prepared::{Prepared, prepare};
use skyduct::queue::store::*;
use tempfile::TempDir;
use uuid::Uuid;

use crate::common::{most, new_job, small_job};

const LEASE: Duration = Duration::from_secs(600);
const ALWAYS: Duration = Duration::from_secs(3600);

async fn running() -> (SqliteStore, TempDir, Uuid) {
    let folder = tempfile::tempdir().unwrap();
    let store = SqliteStore::open(&folder.path().join("test.db")).await.unwrap();
    let Submission::New(job) = store.submit(new_job(), most(10)).await.unwrap() else { panic!("not new") };
    (store, folder, job.head.id)
}

fn go_on(chunk: u64, passes: u64, ahead: Vec<RangeAhead>) -> Completion {
    Completion::Continue {
        state: StateFile { key: format!("state-{chunk}"), hash: "hash".into() },
        progress: Progress { passes, chunks: chunk + 1, ..Progress::default() },
        ahead,
    }
}

fn end() -> Completion {
    let end = JobEnd::Succeeded { stopped_by: StoppedBy::RelativeError, progress: Progress::default() };
    Completion::Finish(Finish { end, summary: None, artifacts: Vec::new(), last_pass: None })
}

/// Random numbers that are the same on every run.
struct Random(u64);

impl Random {
    fn below(&mut self, count: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % count
    }
}

/// Adds a pass with its outcome, or computes it.
fn add_pass(
    prepared: &Prepared,
    merged: &mut Estimate,
    outcome: Option<skyduct::engine::ahead::Outcome>,
) -> Option<StoppedBy> {
    prepared.add_pass((merged, &mut Spent::NOTHING.clone()), outcome, &Stop::default(), &mut |_, _| {}).unwrap()
}

/// A job with `open` chunks whose workers take turns and die at random: the bits of its result, and the number of passes of it that
/// were computed ahead.
async fn render(prepared: &Prepared, open: usize, seed: u64) -> (Vec<u8>, u64) {
    let (store, _folder, id) = running().await;
    let (mut random, mut files, mut leases) = (Random(seed), HashMap::<String, Bytes>::new(), Vec::new());
    let (mut names, mut taken) = (0, 0);
    for _ in 0..10_000 {
        names += 1;
        let owner = format!("w{names}");
        match random.below(8) {
            // a chunk: the outcomes that there are, or up to three passes
            0..=2 => {
                let Some(lease) = store.claim(&owner, LEASE, Turn::default()).await.unwrap() else { continue };
                let state = store.job_source(id).await.unwrap().unwrap().state;
                let mut merged = match state {
                    Some(state) => decode(prepared.empty_estimate(), &files[&state.key]).unwrap(),
                    None => prepared.empty_estimate(),
                };
                let ahead = store.ahead(&lease, merged.passes).await.unwrap();
                let outcomes = ahead.outcomes.map(|file| files[&file.key].clone());
                let mut outcomes = outcomes.into_iter().flat_map(stored_outcomes).peekable();
                let was_ahead = outcomes.peek().is_some();
                let (from, most) = (merged.passes, 1 + random.below(3));
                let ended = loop {
                    if let Some(ended) = add_pass(prepared, &mut merged, outcomes.next()) {
                        break Some(ended);
                    }
                    let is_over = outcomes.peek().is_none() && (was_ahead || merged.passes - from >= most);
                    if is_over || ahead.until == Some(merged.passes) {
                        break None;
                    }
                };
                if random.below(3) == 0 {
                    // it dies before its commit
                    store.take_back(false).await.unwrap();
                    leases.clear();
                    continue;
                }
                taken += if was_ahead { merged.passes - from } else { 0 };
                let bits = encode(&merged);
                if ended.is_some() {
                    let Committed::Yes { obsolete } = store.complete(&lease, &[], &end()).await.unwrap() else {
                        panic!()
                    };
                    obsolete.iter().for_each(|key| drop(files.remove(key)));
                    assert_eq!(store.referenced_keys().await.unwrap().len(), 0);
                    assert_eq!(
                        store.claim_ahead(&owner, LEASE).await.unwrap(),
                        None,
                        "nothing is left of a job that ended"
                    );
                    return (bits, taken);
                }
                let opened = prepared.ranges_ahead(&merged, bits.len() as u64, open - 1);
                assert!(opened.len() < open);
                files.insert(format!("state-{}", lease.chunk), bits.into());
                let completion = go_on(lease.chunk, merged.passes, opened);
                let Committed::Yes { obsolete } = store.complete(&lease, &[], &completion).await.unwrap() else {
                    panic!()
                };
                obsolete.iter().for_each(|key| drop(files.remove(key)));
                let named = store.referenced_keys().await.unwrap();
                assert!(named.iter().all(|key| files.contains_key(key)), "files are deleted after their rows");
            }
            3..=4 => leases.extend(store.claim_ahead(&owner, LEASE).await.unwrap()),
            // one of those that compute ahead ends its range, or keeps its first pass; it may have lost the lease
            5..=6 if !leases.is_empty() => {
                let lease: AheadLease = leases.swap_remove(random.below(leases.len() as u64) as usize);
                let most = if random.below(2) == 0 { Duration::ZERO } else { ALWAYS };
                let outcomes = prepared.compute_ahead(&lease.range, &Stop::default(), most).unwrap();
                let file = StateFile { key: lease.owner.clone(), hash: String::new() };
                files.insert(lease.owner.clone(), outcomes.bytes);
                if !store.keep_ahead(&lease, outcomes.passes.end, &file).await.unwrap() {
                    files.remove(&lease.owner);
                }
            }
            5..=6 => {}
            // all die; what they had may have been the reason
            _ => drop(store.take_back(random.below(2) == 0).await.unwrap()),
        }
    }
    panic!("the job does not end");
}

/// A job that stops by its accuracy, with a grid that is accurate before the view, or the other way round.
fn document(method: Value, [grid, view]: [f64; 2]) -> Value {
    let mut job = small_job();
    job["method"] = method;
    job["stop"] = json!({ "relative_error": grid, "view_relative_error": view, "max_passes": 40 });
    job
}

#[tokio::test]
async fn bits_do_not_depend_on_open_chunks_or_on_who_dies() {
    let methods = [
        (json!({ "kind": "sppm", "photons_per_pass": 500 }), [0.2, 0.2]),
        (json!("auto"), [0.2, 1e-9]),
        (json!({ "kind": "path_tracing", "samples_per_sensor": 2 }), [0.01, 0.6]),
    ];
    for (method, errors) in methods {
        let document = document(method, errors);
        let prepared = prepare(document.to_string().as_bytes(), &NoFiles).unwrap();
        assert!(prepared.passes_are_independent());
        let mut calm = prepared.empty_estimate();
        while add_pass(&prepared, &mut calm, None).is_none() {}
        println!("{} passes of grids, {} of views", calm.passes_of_grids(), calm.passes_of_views());
        for open in [1, 2, 4] {
            let mut all_taken = 0;
            for seed in 0..4 {
                let (bits, taken) = render(&prepared, open, seed).await;
                assert!(bits == encode(&calm), "{}, {open} open chunks, seed {seed}", document["method"]);
                all_taken += taken;
            }
            assert_eq!(all_taken > 0, open > 1, "{}: {all_taken} passes ahead", document["method"]);
        }
    }
}

#[test]
fn passes_that_depend_on_each_other_are_not_computed_ahead() {
    for method in [json!({ "kind": "ppm", "photons_per_pass": 500, "radius": "per_point" }), json!("holigilm")] {
        let mut document = small_job();
        (document["views"], document["method"]) = (json!([]), method);
        let prepared = prepare(document.to_string().as_bytes(), &NoFiles).unwrap();
        assert!(!prepared.passes_are_independent());
        assert_eq!(prepared.ranges_ahead(&prepared.empty_estimate(), 1, 3), []);
    }
}

/// Ranges end at judgements and at the last pass, and before where their passes are large.
#[test]
fn ranges_are_bounded() {
    let mut document = small_job();
    document["stop"]["max_passes"] = json!(11);
    let prepared = prepare(document.to_string().as_bytes(), &NoFiles).unwrap();
    let mut merged = prepared.empty_estimate();
    let ranges = |merged: &Estimate, bytes| {
        let ahead = prepared.ranges_ahead(merged, bytes, 3);
        ahead.into_iter().map(|range| (range.passes.start, range.passes.end)).collect::<Vec<_>>()
    };
    assert_eq!(ranges(&merged, 1 << 10), [(5, 6), (6, 7), (7, 8)]);
    assert_eq!(ranges(&merged, 16 << 20), [(1, 5), (5, 6), (6, 7)]);
    assert_eq!(ranges(&merged, 1 << 40), [(1, 2), (2, 3), (3, 4)]);
    merged.passes = 9;
    assert_eq!(ranges(&merged, 1 << 10), [(10, 11)]);
}

/// A range is computed by one worker, or by its chunk, which waits for the worker as long as it has a lease.
#[tokio::test]
async fn who_lost_a_range_changes_nothing() {
    let (store, _folder, id) = running().await;
    let range = |from| RangeAhead { passes: from..from + 2, wanted: Wanted { grids: true, views: false } };
    let file = |key: &str| StateFile { key: key.into(), hash: "hash".into() };
    let chunk = store.claim("c", LEASE, Turn::default()).await.unwrap().unwrap();
    store.complete(&chunk, &[], &go_on(0, 8, vec![range(8), range(10), range(12)])).await.unwrap();
    let first = store.claim_ahead("a", LEASE).await.unwrap().unwrap();
    assert_eq!((first.job, &first.range), (id, &range(8)));
    assert_eq!(store.claim("c", LEASE, Turn::default()).await.unwrap(), None, "the chunk waits for its first range");
    let second = store.claim_ahead("b", Duration::ZERO).await.unwrap().unwrap();
    assert_eq!(second.range, range(10));

    // a part is kept, and the rest waits again
    assert!(store.keep_ahead(&first, 9, &file("first")).await.unwrap());
    assert!(!store.keep_ahead(&first, 9, &file("first")).await.unwrap(), "it is kept once");
    let third = store.claim_ahead("a", LEASE).await.unwrap().unwrap();
    assert_eq!(third.range, range(12));
    store.return_ahead(&third, GivenBack::ToChunk).await.unwrap();
    let rest = store.claim_ahead("a", LEASE).await.unwrap().unwrap();
    assert_eq!(rest.range, RangeAhead { passes: 9..10, ..range(9) });
    assert_eq!(
        store.claim_ahead("d", LEASE).await.unwrap(),
        None,
        "nobody takes what is left to the chunk, or was lost"
    );
    store.return_ahead(&rest, GivenBack::ToWorkers).await.unwrap();

    let chunk = store.claim("c", LEASE, Turn::default()).await.unwrap().unwrap();
    assert_eq!(store.ahead(&chunk, 8).await.unwrap(), Ahead { outcomes: Some(file("first")), until: Some(9) });
    let done = store.complete(&chunk, &[], &go_on(1, 9, Vec::new())).await.unwrap();
    assert_eq!(done, Committed::Yes { obsolete: vec!["first".into()] });
    // the chunk takes what is ready, and what somebody has lost
    for (index, from, until) in [(2, 9, 10), (3, 10, 12)] {
        let chunk = store.claim("c", LEASE, Turn::default()).await.unwrap().unwrap();
        let forged = Lease { attempt: 9, ..chunk.clone() };
        assert_eq!(store.ahead(&forged, from).await.unwrap().until, Some(until));
        assert_eq!(store.ahead(&chunk, from).await.unwrap(), Ahead { outcomes: None, until: Some(until) });
        store.complete(&chunk, &[], &go_on(index, until, Vec::new())).await.unwrap();
    }
    assert!(!store.beat_ahead(&second, LEASE).await.unwrap());
    assert!(!store.keep_ahead(&second, 12, &file("second")).await.unwrap());
    let chunk = store.claim("c", LEASE, Turn::default()).await.unwrap().unwrap();
    assert_eq!(store.ahead(&chunk, 12).await.unwrap(), Ahead::default());

    // a cancelled job does not wait for a range, and drops all at its end
    store.complete(&chunk, &[], &go_on(4, 14, vec![range(14), range(16)])).await.unwrap();
    let [first, second] = ["a", "b"].map(|owner| store.claim_ahead(owner, LEASE));
    let (first, second) = (first.await.unwrap().unwrap(), second.await.unwrap().unwrap());
    assert!(store.keep_ahead(&second, 18, &file("late")).await.unwrap());
    assert!(store.beat_ahead(&first, LEASE).await.unwrap());
    store.cancel(id).await.unwrap();
    assert!(!store.beat_ahead(&first, LEASE).await.unwrap());
    let chunk = store.claim("c", LEASE, Turn::default()).await.unwrap().unwrap();
    let Committed::Yes { obsolete } = store.complete(&chunk, &[], &end()).await.unwrap() else { panic!("not ended") };
    assert!(obsolete.contains(&"late".to_owned()), "{obsolete:?}");
    assert!(!store.keep_ahead(&first, 16, &file("later")).await.unwrap());
    assert_eq!(store.referenced_keys().await.unwrap().len(), 0);
}

//! The seeds of fuzzing (`fuzz/corpus`) through the functions that fuzzing runs.

use std::fs;
use std::path::Path;

use crate::fuzzed;

/// Runs every seed of a target; what it panics at is named by its file.
fn run(target: &str, judge: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let seeds: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(seeds.len() > 10, "{target} has {} seeds", seeds.len());
    let fails = |path: &&std::path::PathBuf| {
        let bytes = fs::read(path).unwrap();
        std::panic::catch_unwind(|| judge(&bytes)).is_err()
    };
    let failed: Vec<_> = seeds.iter().filter(fails).collect();
    assert!(failed.is_empty(), "{failed:?}");
}

#[test]
fn documents_are_judged() {
    run("document", fuzzed::document);
}

#[test]
fn obj_files_are_read() {
    run("obj", fuzzed::obj);
}

#[test]
fn weather_files_are_read() {
    run("weather", fuzzed::weather);
}

#[test]
fn ids_of_events_are_read() {
    run("last_event_id", fuzzed::last_event_id);
}

#[test]
fn tables_are_judged() {
    run("tables", fuzzed::tables);
}

//! Studies: runs are compared with a reference that shares nothing with them, and their errors are what jobs tell.

use serde_json::{Value, json};
use skyduct::engine::cancel::{Stop, StopReason};
use skyduct::study::StudyRequest;
use skyduct::study::picture_request::{PictureRequest, PicturesWanted};
use skyduct::study::run::{StudyError, run, run_pictures};

use crate::documents::Folder;

/// A room whose floor has four sensors, under a sky with some structure.
fn job() -> Value {
    json!({
        "name": "four sensors",
        "sky": { "cie_type": 12, "sun_position": { "altitude_deg": 35, "azimuth_deg": 225 }, "zenith_luminance_cd_m2": 5000,
                 "direct_normal_illuminance_lux": 0 },
        "room": { "size_m": [2, 2, 2] },
        "tubes": [{ "centre_m": [0.8, 1.1], "diameter_m": 0.25, "reflectance": 0.97, "segments": [{ "length_m": 1 }],
                    "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }],
        "grids": [{ "name": "floor", "height_m": 0.8, "cells": [2, 2] }],
        "views": [{ "name": "v", "eye_m": [0.2, 0.2, 1], "look_at_m": [1, 1, 1], "size_px": [8, 8] }]
    })
}

fn request(methods: &[&str]) -> StudyRequest {
    let methods = methods.iter().map(|method| (*method).to_owned()).collect();
    StudyRequest { seeds: 4, ..StudyRequest::new(job(), methods).to(vec![0.05, 0.02]) }
}

/// Every cell is there, and met; a smaller error takes more passes; what a method refuses is told. Intervals of 95 % hold the
/// reference: sensors of one run may all fail together, so that the runs alone count as independent.
#[test]
fn errors_of_runs_are_what_they_tell() {
    let methods = ["auto", "light_tracing", "path_tracing", "photon_mapping", "jenkins", "holigilm"];
    let mut request = request(&methods);
    // which the solvers know nothing of
    request.job["room"]["objects"] = json!([{ "kind": "box", "size_m": [0.2, 0.2, 0.2], "position_m": [1.7, 1.7, 0], "surface": { "reflectance": 0.3 } }]);
    let mut steps = Vec::new();
    let study = run(&request, &Folder, &Stop::default(), &mut |step| steps.push(step.done)).unwrap();
    println!("{}\n{}", study.table(), study.verdict());
    assert_eq!(
        study.refused.iter().map(|refused| refused.method.as_str()).collect::<Vec<_>>(),
        ["jenkins", "holigilm"]
    );
    let cells = study.cells();
    assert_eq!((cells.len(), study.runs.len()), (4 * 2, 4 * 2 * 4));
    assert!(cells.iter().all(|cell| cell.met), "{cells:#?}");
    assert_eq!(cells.iter().filter(|cell| cell.cheapest).count(), 2);
    assert_eq!((steps.len(), *steps.last().unwrap()), (study.runs.len() + 2, study.runs.len() + 1));
    assert_eq!(study.runs[0].computed_by, "two_stage");
    let passes = |method: &str, asked: f64| -> u64 {
        let runs = study.runs.iter().filter(|run| run.method == method && run.asked == asked);
        runs.map(|run| run.passes).sum()
    };
    assert!(passes("path_tracing", 0.02) > passes("path_tracing", 0.05));
    let held: Vec<f64> = study.runs.iter().filter_map(|run| run.covered).collect();
    let (held, runs) = (held.iter().sum::<f64>() / held.len() as f64, held.len() as f64);
    assert!(held > 0.95 - 4.0 * (0.95_f64 * 0.05 / runs).sqrt(), "{held} of the intervals of {runs} runs");
    for run in &study.runs {
        assert!(run.reported.unwrap() <= run.asked, "{run:?}");
    }
}

/// A reference that is wrong is seen in every run: the light of another sky.
#[test]
fn another_reference_is_another_error() {
    let mut request = request(&["auto"]);
    request.seeds = 1;
    let right = run(&request, &Folder, &Stop::default(), &mut |_| {}).unwrap().cells();
    // the formula has no interreflection of its own kind: some percent off
    request.reference.method = Some("jenkins".to_owned());
    let wrong = run(&request, &Folder, &Stop::default(), &mut |_| {}).unwrap().cells();
    assert!(right[1].actual < 0.02 && wrong[1].actual > 0.05, "{} {}", right[1].actual, wrong[1].actual);
}

#[test]
fn a_study_that_cannot_be_done_says_why() {
    let refusal = |request: &StudyRequest| match run(request, &Folder, &Stop::default(), &mut |_| {}) {
        Err(StudyError::Document(errors)) => errors.0[0].pointer.clone(),
        other => panic!("{other:?}"),
    };
    let mut bad = request(&["auto"]);
    bad.job["room"]["size_m"] = json!([2, 2]);
    assert!(refusal(&bad).starts_with("/room/size_m"));
    assert_eq!(refusal(&StudyRequest { seeds: 0, ..request(&["auto"]) }), "/seeds");
    let mut bad = request(&["auto"]);
    bad.reference.method = Some("nobody".to_owned());
    assert_eq!(refusal(&bad), "/reference/method");
    let stop = Stop::default();
    stop.raise(StopReason::Cancelled);
    let cancelled = run(&request(&["auto"]), &Folder, &stop, &mut |_| {});
    assert!(matches!(cancelled, Err(StudyError::Cancelled { done: 0, of: 9 })), "{cancelled:?}");
}

/// Seconds end a run, and the study goes on without what was not met.
#[test]
fn a_run_that_takes_too_long_ends_alone() {
    let mut request = StudyRequest { seeds: 3, seconds: 0.1, ..request(&["path_tracing"]) };
    request.reference.method = Some("jenkins".to_owned());
    let study = run(&request.to(vec![1e-5]), &Folder, &Stop::default(), &mut |_| {}).unwrap();
    assert!(study.cells().iter().all(|cell| !cell.met && !cell.cheapest));
    assert!(study.verdict().starts_with("No method met"), "{}", study.verdict());
}

/// Jobs that end when they are good enough are as good as they say: their intervals hold as often, their root mean square error is
/// what was asked for or less, and few are far off. The sensors of a run may fail together, so that runs alone count: 4 sigma.
#[test]
fn jobs_that_end_early_are_honest() {
    const SEEDS: u64 = 50;
    // errors that the first passes do not have
    let asked = [("two_stage", 0.005), ("path_tracing", 0.04)];
    let studies = asked.map(|(method, error)| {
        let request = StudyRequest { seeds: SEEDS, ..request(&[method]) };
        run(&request.to(vec![error]), &Folder, &Stop::default(), &mut |_| {}).unwrap()
    });
    for (study, cell) in studies.iter().flat_map(|study| study.cells().into_iter().map(move |cell| (study, cell))) {
        let runs = &study.runs;
        assert!(runs.len() as u64 == SEEDS && cell.met);
        let held: Vec<f64> = runs.iter().filter_map(|run| run.covered).collect();
        let mean = held.iter().sum::<f64>() / SEEDS as f64;
        let spread = held.iter().map(|held| (held - mean).powi(2)).sum::<f64>() / (SEEDS - 1) as f64;
        let far = runs.iter().filter(|run| 1.96 * run.squared_error.sqrt() > 1.5 * cell.asked).count() as f64;
        let actual = 1.96 * cell.actual / cell.asked;
        println!("{} to {}: {mean} hold, {actual} of what was asked, {far} far off", cell.method, cell.asked);
        assert!((mean - 0.95).abs() < 0.02 + 4.0 * (spread / SEEDS as f64).sqrt(), "{cell:?}: {mean}");
        // as if the sensors of a run all had one error
        assert!(actual < 1.0 + 4.0 / (2.0 * SEEDS as f64).sqrt(), "{cell:?}: {actual}");
        assert!(far < 0.05 * SEEDS as f64 + 4.0 * (0.05 * 0.95 * SEEDS as f64).sqrt(), "{cell:?}: {far}");
    }
}

/// Pictures by each method after the same time, better ones after more, and at an accuracy; files that can be looked at.
#[test]
fn pictures_show_what_time_buys() {
    let mut job = job();
    job["views"][0]["size_px"] = json!([16, 16]);
    job["method"] = json!("path_tracing");
    let methods = ["path_tracing", "jenkins", "bidirectional_path_tracing"].map(str::to_owned).to_vec();
    let wanted = PicturesWanted { seconds: vec![0.2, 0.05], relative_errors: vec![0.4] };
    let request = PictureRequest::new(job, methods, wanted, 60.0, Some("bidirectional_path_tracing"));
    let pictures = run_pictures(&request, &Folder, &Stop::default(), &mut |_| {}).unwrap();
    let entries = pictures.outcomes.pictures(&request);
    assert_eq!((entries.len(), pictures.outcomes.refused[0].method.as_str()), (5, "jenkins"));
    assert_eq!(entries[0].asked_seconds, Some(0.05));
    let last = &entries[4];
    assert!(last.asked_relative_error == Some(0.4) && last.actual_relative_error.unwrap() < 0.4, "{last:?}");
    let files = pictures.files(&request).unwrap();
    let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["v.equal_time.png", "v.accuracies.png", "pictures.json"]);
    assert!(files[..2].iter().all(|(_, bytes)| bytes.starts_with(b"\x89PNG")));
    let told: Value = serde_json::from_slice(&files[2].1).unwrap();
    assert_eq!((told["pictures"].as_array().unwrap().len(), &told["refused"][0]["method"]), (5, &json!("jenkins")));
    let bad = PicturesWanted { seconds: vec![0.0], relative_errors: Vec::new() };
    let nothing = PictureRequest { job: json!({ "grids": [] }), wanted: bad, ..request };
    match run_pictures(&nothing, &Folder, &Stop::default(), &mut |_| {}) {
        Err(StudyError::Document(errors)) => {
            let pointers: Vec<&str> = errors.0.iter().map(|error| error.pointer.as_str()).collect();
            assert_eq!(pointers, ["", "/seconds/0"]);
        }
        other => panic!("{other:?}"),
    }
}

//! The files of a job: each by its name, reports on tubes by their content.

use crate::documents::{first_passes, prepare};
use crate::schema::DESCRIPTION;
use serde_json::{Value, json};
use skyduct::document::errors::WarningCode;
use skyduct::engine::cancel::Stop;
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::present::outputs::{Format, Output};
use skyduct::present::prepared::Prepared;
use skyduct::present::reader::ResultReader as _;
use skyduct::statistics::Moments;

/// Two equal tubes, a longer one, a grid and a small view.
fn three_tubes() -> Prepared {
    prepare("S1", |document| {
        let tube = |x: f64, length_m: f64| {
            let mut tube = document["tubes"][0].clone();
            tube["centre_m"][0] = json!(x);
            tube["segments"][0]["length_m"] = json!(length_m);
            tube
        };
        document["tubes"] = json!([tube(0.4, 1.0), tube(1.0, 1.0), tube(1.6, 2.0)]);
        document["views"] = json!([{ "name": "room", "eye_m": [1.9, 0.1, 0.3], "look_at_m": [0.9, 1.2, 1.3],
                                     "up": [0, 0, 1], "vertical_fov_deg": 90, "size_px": [16, 8] }]);
        document["method"] = json!({ "kind": "sppm", "photons_per_pass": 2000 });
    })
}

/// Nothing is zero because nobody has counted it.
#[test]
fn results_have_what_their_method_says_that_it_knows() {
    for name in DESCRIPTION["components"]["schemas"]["MethodKind"]["enum"].as_array().unwrap() {
        let prepared = prepare("S1", |document| {
            document["method"] = name.clone();
            document["grids"] = json!([{ "name": "floor", "height_m": 0, "cells": [2, 2] }]);
            document["stop"] = json!({ "max_passes": 2 });
        });
        let outputs = prepared.plan.methods.grids.as_ref().unwrap().method.described().outputs();
        let results = prepared.summary_json(&first_passes(&prepared, 8), Spent::NOTHING, StoppedBy::MaxPasses);
        let emitted = results["energy"]["emitted_lm"].as_f64();
        assert_eq!(emitted.is_some_and(|flux| flux > 0.0), outputs.energy, "{name}: {results}");
        assert_eq!(results["tubes"][0]["into_room"].is_object(), outputs.tube_fluxes, "{name}: {results}");
    }
}

/// Efficiencies of tubes differ from seed to seed as their standard errors say. Both variances are estimates: of the values of 200 seeds, and
/// of the errors of these, each by eight passes.
#[test]
fn efficiencies_of_tubes_differ_as_their_errors_say() {
    const SEEDS: u64 = 200;
    let of_seed = |seed: u64| {
        let prepared = prepare("S1", |document| {
            document["tubes"][0]["reflectance"] = json!(0.9);
            document["grids"] = json!([{ "name": "floor", "height_m": 0, "cells": [1, 1] }]);
            document["method"] = json!({ "kind": "light_tracing", "photons_per_pass": 64 });
            document["stop"] = json!({ "max_passes": 8 });
            document["seed"] = json!(seed);
        });
        prepared.summary_json(&first_passes(&prepared, 8), Spent::NOTHING, StoppedBy::MaxPasses)["tubes"][0].take()
    };
    let tubes: Vec<Value> = (0..SEEDS).map(of_seed).collect();
    for name in ["transmission_efficiency", "level_aperture_efficiency"] {
        let [mut values, mut variances] = [Moments::default(); 2];
        for tube in &tubes {
            values.push(tube[name].as_f64().unwrap());
            variances.push(tube[format!("{name}_standard_error")].as_f64().unwrap().powi(2));
        }
        let ratio = values.m2 / (values.count - 1.0) / variances.mean;
        let deviation = (2.0 / values.count * (1.0 + 1.0 / 7.0)).sqrt();
        assert!((ratio - 1.0).abs() < 4.0 * deviation, "{name}: {ratio} +- {deviation}");
    }
}

/// Jobs that the default number of passes ends far from the accuracy that was requested say so; one whose document sets this number does
/// not, and nor does one that is as accurate.
#[test]
fn jobs_that_end_before_their_accuracy_say_so() {
    let warns = |stop: Value| {
        let prepared = prepare("S1", |document| {
            document["method"] = json!({ "kind": "light_tracing", "photons_per_pass": 100 });
            document["stop"] = stop.clone();
        });
        let estimate = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap().estimate;
        let warnings = prepared.render_warnings(&estimate);
        warnings.into_iter().find(|warning| warning.code == WarningCode::AccuracyNotReached)
    };
    let detail = warns(json!({ "relative_error": 0.001 })).unwrap().detail;
    assert!(detail.contains("4096 passes") && detail.contains("0.1 %"), "{detail}");
    assert!(warns(json!({ "relative_error": 0.001, "max_passes": 64 })).is_none());
    assert!(warns(json!({ "relative_error": 0.5 })).is_none());
}

#[test]
fn a_file_that_is_asked_for_alone_is_the_one_among_all() {
    let prepared = three_tubes();
    let merged = first_passes(&prepared, 8);
    let results = prepared.results(&merged);
    let (outputs, all) = (prepared.outputs(), results.files(|_| true).unwrap());
    // of the grid JSON, CSV and a figure in three formats; of the view EXR, PNG and a figure; of each tube JSON and a figure
    assert_eq!((outputs.len(), all.len()), (5 + 5 + 3 * 4, outputs.len()), "{outputs:?}");
    for (output, file) in outputs.iter().zip(&all) {
        let alone = results.file(output).unwrap().unwrap();
        assert!(!alone.bytes.is_empty() && alone.bytes == file.bytes, "{}", file.name);
        assert_eq!((alone.name, alone.media_type), (output.file(), file.media_type));
    }
    let [none, room] = ["none", "room"].map(str::to_owned);
    for output in [
        Output::Grid(none.clone(), Format::Json),
        Output::Grid("floor".to_owned(), Format::Exr),
        Output::View(none, Format::Png),
        Output::View(room.clone(), Format::Svg),
        Output::FalseColours(room, Format::Csv),
        Output::Tube(3, Format::Json),
        Output::Tube(0, Format::Csv),
    ] {
        assert!(results.file(&output).unwrap().is_none(), "{output:?}");
    }
}

/// But for its number and the fluxes, which are the job's.
#[test]
fn equal_tubes_have_equal_reports_and_others_do_not() {
    let prepared = three_tubes();
    let merged = first_passes(&prepared, 8);
    let reports = [0, 1, 2].map(|tube| {
        let mut report = json!(prepared.results(&merged).tube(tube).unwrap().unwrap());
        assert_eq!(report["tube"], tube);
        report["tube"] = Value::Null;
        assert!(report["flux"].take()["into_room"]["flux_lm"].as_f64().unwrap() > 0.0);
        report
    });
    assert_eq!(reports[0], reports[1]);
    for part in ["beam", "uniform_sky", "sky"] {
        assert_ne!(reports[0][part], reports[2][part], "{part}");
    }
    let other_sky = prepare("S1", |document| document["sky"]["cie_type"] = json!(5));
    let report = json!(other_sky.results(&first_passes(&other_sky, 8)).tube(0).unwrap().unwrap());
    assert_ne!(report["sky"], reports[0]["sky"]);
}

/// Cells under a sunlit clear closure by fixed points: the error of the grid's mean in a job's summary is that of its statistics,
/// which holds the choice of points. Three seeds are within 4 of these errors of light tracing's mean; the spread of the passes
/// alone is less.
#[test]
fn the_summary_of_fixed_points_has_their_error_in_the_mean() {
    let job = |method: serde_json::Value, passes: u64, seed: u64| {
        let prepared = prepare("S1", |document| {
            document["method"] = method.clone();
            document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.9 });
            document["sky"]["direct_normal_illuminance_lux"] = json!(60_000);
            document["grids"][0] =
                json!({ "name": "cells", "height_m": 0, "cells": [5, 5], "estimate": "cell_average" });
            document["stop"] = json!({ "relative_error": 1e-4, "max_passes": passes, "max_seconds": 300 });
            document["seed"] = json!(seed);
        });
        let estimate = prepared.render_all_passes(&mut |_, _| {}).unwrap();
        let spread = estimate.grids[0].mean.standard_error();
        let grid = prepared.summary(&estimate, Spent::NOTHING, StoppedBy::MaxPasses).grids.unwrap().remove(0);
        assert_eq!(grid.mean_standard_error_lux, grid.statistics.mean_lux_standard_error);
        (grid.statistics.mean_lux, grid.mean_standard_error_lux.unwrap(), spread)
    };
    let (truth, truth_error, _) = job(json!("light_tracing"), 64, 9);
    for seed in 1..=3 {
        let method = json!({ "kind": "ppm", "photons_per_pass": 16_384, "samples_per_sensor": 4 });
        let (mean, error, spread) = job(method, 24, seed);
        println!("seed {seed}: {mean} +- {error} (spread {spread}), {truth} +- {truth_error}");
        assert!((mean - truth).abs() < 4.0 * error.hypot(truth_error), "{seed}: {mean} +- {error}, {truth}");
        assert!(error > spread, "{error} {spread}");
    }
}

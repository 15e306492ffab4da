//! What a pilot foretells of errors, against the errors of jobs: by passes, not by seconds.

use crate::documents::prepare;
use serde_json::{Value, json};
use skyduct::engine::cancel::Stop;
use skyduct::estimate::error_law::Judged;
use skyduct::predict::pilot;
use skyduct::present::prepared::Prepared;
use skyduct::statistics::interval::two_sided_student_quantile;

const PASSES: u64 = 32;

/// The relative standard error that a job of 32 passes tells must lie in what the law of its pilot says with its uncertain parts 4 of
/// their standard deviations larger and smaller; the job's own is known within 4 of 1 / sqrt(2 * 31 * 4), of four values at least
/// that are independent. What is said is certain enough to be of use: unbiased methods within a factor of 2.5 at one deviation.
fn check(prepared: &Prepared, method: &str, views: bool) {
    let laws = pilot::laws(prepared, method, 8).unwrap_or_else(|| panic!("no law of {method}"));
    let predicted = |deviations: f64| {
        let errors = laws.iter().map(|law| law.shifted(deviations).standard_error(PASSES as f64));
        errors.fold(0.0, f64::max)
    };
    let estimate = prepared.render_all_passes(&mut |_, _| {}).unwrap();
    assert_eq!(estimate.passes, PASSES);
    let accuracy = prepared.accuracy(&estimate);
    let told = if views { accuracy.views } else { accuracy.grids }.unwrap();
    let degrees = accuracy.degrees_of_grids.filter(|_| !views).unwrap_or(PASSES as f64 - 1.0);
    let told = told / two_sided_student_quantile(0.95, degrees);
    let own = (4.0 / (2.0 * 31.0 * 4.0f64).sqrt()).exp();
    let [least, expected, most] = [-4.0, 0.0, 4.0].map(predicted);
    println!("{method}: {told:.3e} predicted {expected:.3e} ({least:.3e}..{most:.3e}) {:.2}", told / expected);
    assert!(told > least / own && told < most * own, "{method}: {told} is not in {least}..{most}");
    let unbiased = laws.iter().all(|law| law.bias_noise == 0.0);
    assert!(!unbiased || predicted(1.0) < 2.5 * expected, "{method}: {laws:?}");
}

fn passes(document: &mut Value) {
    document["stop"] = json!({ "relative_error": 0.01, "view_relative_error": 0.01, "max_passes": PASSES });
}

#[test]
fn a_pilot_foretells_the_errors_of_grids() {
    let methods = [
        json!({ "kind": "path_tracing" }),
        json!({ "kind": "bidirectional_path_tracing", "photons_per_pass": 4096, "samples_per_sensor": 32 }),
        json!({ "kind": "light_tracing" }),
        json!({ "kind": "two_stage", "samples_per_sensor": 64 }),
        json!({ "kind": "two_stage" }),
        json!({ "kind": "photon_mapping", "photons_per_pass": 16384, "gather_rays": 64 }),
        json!({ "kind": "sppm", "photons_per_pass": 16384 }),
        json!({ "kind": "ppm", "photons_per_pass": 16384 }),
    ];
    for method in methods {
        // cells are told from points by whether light is connected to them, gathered there, or followed from them
        let is_cells = ["light_tracing", "two_stage", "sppm"].contains(&method["kind"].as_str().unwrap());
        for estimate in if is_cells { &["point", "cell_average"][..] } else { &["point"] } {
            let prepared = prepare("S1", |document| {
                passes(document);
                document["grids"][0]["estimate"] = json!(estimate);
                document["method"] = method.clone();
            });
            check(&prepared, method["kind"].as_str().unwrap(), false);
        }
    }
}

/// Sensors that share a residual have a fraction of its noise: what is predicted is what a job tells, within 40 %; the noise of each sensor by
/// itself would be 1.76 times as much.
#[test]
fn a_pilot_foretells_what_sensors_share() {
    let prepared = prepare("S1", |document| {
        passes(document);
        document["grids"][0]["cells"] = json!([9, 9]);
        document["method"] = json!("two_stage");
    });
    let law = pilot::laws(&prepared, "two_stage", 8).unwrap()[0];
    let estimate = prepared.render_all_passes(&mut |_, _| {}).unwrap();
    let accuracy = prepared.accuracy(&estimate);
    let told = accuracy.grids.unwrap() / two_sided_student_quantile(0.95, accuracy.degrees_of_grids.unwrap());
    let ratio = law.standard_error(PASSES as f64) / told;
    println!("{ratio}");
    assert!((0.6..1.4).contains(&ratio), "{ratio}");
}

/// A job ends after the passes that are predicted, within a factor of 1.4, of 12 jobs after as many in all within 15 %: one that shares
/// residuals ends sooner than the passes' own degrees of freedom tell, and its passes have the sizes of all its sensors.
#[test]
fn a_pilot_foretells_the_passes_of_jobs() {
    let (mut predicted_in_all, mut taken_in_all) = (0, 0);
    for (seed, accuracy) in
        [0.05, 0.0196, 0.01].into_iter().flat_map(|accuracy| [0, 1, 2, 3].map(|seed| (seed, accuracy)))
    {
        let prepared = prepare("S1", |document| {
            document["stop"] = json!({ "relative_error": accuracy, "max_passes": 100 });
            document["method"] = json!("two_stage");
            document["seed"] = json!(seed);
        });
        let judged = Judged { confidence: 0.95, least_passes: 8 };
        let law = pilot::laws(&prepared, "two_stage", 8).unwrap()[0];
        let predicted = law.passes_to(accuracy, judged).unwrap();
        let taken = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap().estimate.passes;
        println!("{accuracy} {seed}: predicted {predicted}, taken {taken}");
        let ratio = predicted as f64 / taken as f64;
        assert!((1.0 / 1.4..1.4).contains(&ratio), "{accuracy} {seed}: predicted {predicted}, taken {taken}");
        (predicted_in_all, taken_in_all) = (predicted_in_all + predicted, taken_in_all + taken);
    }
    let ratio = predicted_in_all as f64 / taken_in_all as f64;
    assert!((0.85..1.15).contains(&ratio), "{predicted_in_all} {taken_in_all}");
}

/// Through a clear closure rays seldom meet the bright patches, through bends and meshes photons differ, so that more of them help
/// most: what a pass of fewer photons tells depends on whose noise it is.
#[test]
fn a_pilot_tells_noise_of_photons_from_that_of_paths_and_rays() {
    for (scene, method) in [("S2", "photon_mapping"), ("S3", "photon_mapping"), ("S3_mesh", "two_stage")] {
        let prepared = prepare(scene, |document| {
            passes(document);
            document["method"] = json!(method);
        });
        check(&prepared, method, false);
    }
}

#[test]
fn a_pilot_foretells_the_errors_of_views() {
    let methods = [
        json!({ "kind": "path_tracing" }),
        json!({ "kind": "bidirectional_path_tracing", "photons_per_pass": 4096 }),
        json!({ "kind": "two_stage", "samples_per_pixel": 2 }),
        json!({ "kind": "photon_mapping", "photons_per_pass": 16384, "gather_rays": 4 }),
        json!({ "kind": "sppm", "photons_per_pass": 16384 }),
        json!({ "kind": "ppm", "photons_per_pass": 16384 }),
    ];
    for method in methods {
        let prepared = prepare("S1", |document| {
            passes(document);
            document.as_object_mut().unwrap().remove("grids");
            document["views"] = json!([{ "name": "room", "eye_m": [1.9, 0.1, 0.3], "look_at_m": [0.9, 1.2, 1.0],
                                         "up": [0, 0, 1], "vertical_fov_deg": 80, "size_px": [64, 48] }]);
            document["method"] = method.clone();
        });
        check(&prepared, method["kind"].as_str().unwrap(), true);
    }
}

/// What is told of a method that the plan takes is told of the settings that the plan gives it: one path to a pixel, not the eight of a
/// job that names the method.
#[test]
fn a_pilot_tries_the_plans_own_settings() {
    let prepared = |method: Value| {
        prepare("S1", |document| {
            passes(document);
            document.as_object_mut().unwrap().remove("grids");
            document["views"] = json!([{ "name": "room", "eye_m": [1.9, 0.1, 0.3], "look_at_m": [0.9, 1.2, 1.0],
                                         "up": [0, 0, 1], "vertical_fov_deg": 80, "size_px": [64, 48] }]);
            document["method"] = method;
        })
    };
    let laws = |method: Value| pilot::laws(&prepared(method), "two_stage", 4).unwrap();
    assert_eq!(laws(json!("auto")), laws(json!({ "kind": "two_stage", "samples_per_pixel": 1 })));
    assert_ne!(laws(json!("auto")), laws(json!("two_stage")));
}

/// The keys of a pilot are not those of the job, and its laws have the same bits each time.
#[test]
fn a_pilot_is_made_of_other_samples_and_repeats() {
    let prepared = |seed: u64| {
        prepare("S1", |document| {
            document["method"] = json!("light_tracing");
            document["seed"] = json!(seed);
        })
    };
    let law = |seed: u64| pilot::laws(&prepared(seed), "light_tracing", 4).unwrap();
    assert_eq!(law(3), law(3));
    assert_ne!(law(3), law(4));
    assert_eq!(pilot::laws(&prepared(3), "holigilm", 4), None, "it has no passes");
    assert_eq!(pilot::laws(&prepared(3), "light_tracing", 2), None, "two passes tell no uncertainty");
}

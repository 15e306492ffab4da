//! Views of glossy surfaces in the sun: direct, and by way of mirrors.
//!
//! Comparisons of one test share a false-alarm rate of 1e-3 (Sidak), by Student's t over runs with seeds of their own: a view's
//! blocks share photons, and what a run finds rarely shows in the spread of runs.

use serde_json::{Value, json};
use skyduct::document::{JobDocument, to_scene};
use skyduct::integrator::Integrator;
use skyduct::integrator::method::{Computation, Described, Task};
use skyduct::integrator::{photon_mapping, ppm, sppm};
use statrs::distribution::{ContinuousCDF, StudentsT};

use crate::documents::Folder;
use crate::reference;
use crate::scenes::{run, traceable};

const FALSE_ALARMS: f64 = 1e-3;
const RUNS: usize = 6;

/// Means of the blocks of a job's only view by runs of `passes`, with the standard error of each mean and its bias.
fn blocks(document: &Value, method: &str, first_seed: u64, passes: u64) -> Vec<[f64; 2]> {
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    let (scene, ..) = to_scene(&document, &Folder).unwrap();
    let runs: Vec<_> = (0..RUNS as u64)
        .map(|number| {
            let traceable = traceable(&scene);
            run(&scene, by(method, &Task::whole(&scene, &traceable), first_seed + number).as_ref(), passes)
        })
        .collect();
    (0..runs[0].views[0].blocks.len())
        .map(|block| {
            let values: Vec<f64> = runs.iter().map(|run| run.views[0].blocks[block].mean).collect();
            let mean = values.iter().sum::<f64>() / RUNS as f64;
            let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (RUNS - 1) as f64;
            let bias = runs.iter().map(|run| run.views[0].block_bias[block].mean).sum::<f64>() / RUNS as f64;
            [mean, (variance / RUNS as f64).sqrt().hypot(bias)]
        })
        .collect()
}

fn by(method: &str, task: &Task, seed: u64) -> Box<dyn Integrator> {
    let settings: Box<dyn Described> = match method {
        "sppm" => Box::new(sppm::Settings::default()),
        "ppm" => Box::new(ppm::Settings::default()),
        _ => Box::new(photon_mapping::Settings::default()),
    };
    match settings.build(task, seed, 0.01) {
        Computation::Passes(integrator) => integrator,
        Computation::Solution(_) => panic!("{method} has no passes"),
    }
}

fn assert_blocks(found: &[[f64; 2]], truth: &[[f64; 2]], comparisons: usize, what: &str) {
    let rate = 1.0 - (1.0 - FALSE_ALARMS).powf(1.0 / comparisons as f64);
    let limit = StudentsT::new(0.0, 1.0, (RUNS - 1) as f64).unwrap().inverse_cdf(1.0 - 0.5 * rate);
    for (block, ([value, error], [truth, truth_error])) in found.iter().zip(truth).enumerate() {
        let error = error.hypot(*truth_error);
        assert!(
            (value - truth).abs() <= limit * error + 1e-9,
            "{what}, block {block}: {value} +- {error}, not {truth}"
        );
    }
}

#[test]
fn a_sunbeam_on_a_glossy_floor_is_seen() {
    is_seen_on_a_glossy_floor(&["sppm", "photon_mapping"]);
}

#[test]
#[ignore = "half a minute: gathers as `sppm` does"]
fn a_sunbeam_on_a_glossy_floor_is_seen_by_ppm() {
    is_seen_on_a_glossy_floor(&["ppm"]);
}

/// The direct beam on a lobe narrow enough that a ray in one of its directions meets the sun in one of some hundred cases.
fn is_seen_on_a_glossy_floor(methods: &[&str]) {
    let truth = reference::json("view_sun_on_gloss.json");
    let numbers = |key: &str| -> Vec<f64> {
        let rows = truth[key].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
        rows.map(|value| value.as_f64().unwrap()).collect()
    };
    let (values, errors) = (numbers("luminance_cd_m2"), numbers("standard_error_cd_m2"));
    let truth_blocks: Vec<[f64; 2]> = values.iter().zip(&errors).map(|(value, error)| [*value, *error]).collect();
    for method in methods {
        let found = blocks(&truth["job"], method, 100, 1);
        assert_blocks(&found, &truth_blocks, methods.len() * truth_blocks.len(), method);
        // what is seen is known well enough to mean something
        for ([_, error], truth) in found.iter().zip(&values).filter(|(_, truth)| **truth > 1e4) {
            assert!(error / truth < 0.1, "{method}: {error} of {truth}");
        }
    }
}

/// A beam that falls on a mirror wall before it reaches the floor, and the same without the mirror, from behind it: the room
/// twice as deep, tube and sun on the other side.
fn by_mirror(roughness: f64) -> [Value; 2] {
    let room = |depth: f64, tube_y: f64, azimuth: f64, eye_y: f64, mirror: f64| {
        let black = json!({ "reflectance": 0 });
        json!({
            "sky": { "cie_type": 12, "zenith_luminance_cd_m2": 0, "direct_normal_illuminance_lux": 60000,
                     "sun_position": { "altitude_deg": 60, "azimuth_deg": azimuth } },
            "room": { "size_m": [3, depth, 2.5], "surfaces": {
                "floor": { "reflectance": 0.1, "specular": 0.5, "roughness": roughness },
                "walls": black.clone(), "ceiling": black.clone(),
                "wall_south": if mirror > 0.0 { json!({ "reflectance": 0, "specular": mirror, "roughness": 0 }) } else { black } } },
            "tubes": [{ "centre_m": [1.5, tube_y], "diameter_m": 0.5, "reflectance": 0,
                        "segments": [{ "length_m": 0.05 }], "collector": { "kind": "open" },
                        "diffuser": { "kind": "clear", "transmittance": 0.9 } }],
            "views": [{ "name": "patch", "eye_m": [1.6, eye_y + 1.85, 1.2], "look_at_m": [1.5, eye_y + 1.14, 0],
                        "vertical_fov_deg": 50, "size_px": [32, 32] }],
            "method": "auto", "stop": { "max_passes": 1 }, "seed": 1
        })
    };
    [room(3.0, 0.3, 0.0, 0.0, 0.9), room(6.0, 2.7, 180.0, 3.0, 0.0)]
}

#[test]
fn a_sunbeam_by_way_of_a_mirror_is_seen_on_gloss() {
    let roughnesses = [0.05, 0.3];
    for roughness in roughnesses {
        let [mirrored, straight] = by_mirror(roughness);
        let truth: Vec<[f64; 2]> =
            blocks(&straight, "sppm", 300, 1).iter().map(|[value, error]| [0.9 * value, 0.9 * error]).collect();
        let lit = truth.iter().filter(|[value, error]| *value > 1e3 && *error < 0.25 * value).count();
        assert!(lit >= 1, "no block is lit and known: {truth:?}");
        for method in ["sppm", "photon_mapping"] {
            let found = blocks(&mirrored, method, 500, 1);
            let comparisons = 2 * roughnesses.len() * truth.len();
            assert_blocks(&found, &truth, comparisons, &format!("{method}, roughness {roughness}"));
        }
    }
}

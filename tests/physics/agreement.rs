//! Every method on one scene after another: two of them may differ by what their standard errors allow, and no more.
//!
//! A sensor's two values are compared by Student's t with the passes' degrees of freedom; over all sensors and pairs of
//! methods of a scene the false-alarm rate is held at 0.1 % by Sidak's correction. The standard errors of photon mapping hold
//! its bias, whose square is not normally distributed: such pairs have to cover the difference with the same quantile.

use crate::reference;
use std::collections::BTreeMap;

use crate::documents::{Folder, refusal, render_chunk};
use serde_json::{Value, json};
use skyduct::document::{JobDocument, WarningCode};
use skyduct::estimate::Estimate;
use skyduct::integrator::method::RefusalCode;
use skyduct::job::prepare::prepare_document;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// False alarms of one scene.
const FALSE_ALARM: f64 = 1e-3;

/// Passes of every method: the standard error's own error is 13 %, which Student's t takes into account.
const PASSES: u64 = 32;

/// The methods, each at a cost of about a tenth of a second per pass; those that follow paths from sensors alone with
/// `eye_paths` times as many.
fn methods(eye_paths: u32) -> Vec<Value> {
    vec![
        json!({ "kind": "light_tracing", "photons_per_pass": 8192 }),
        json!({ "kind": "path_tracing", "samples_per_sensor": 64 * eye_paths }),
        json!({ "kind": "bidirectional_path_tracing", "photons_per_pass": 2048, "samples_per_sensor": 32 }),
        json!({ "kind": "two_stage", "photons_per_pass": 4096, "samples_per_sensor": 32 * eye_paths }),
        json!({ "kind": "photon_mapping", "photons_per_pass": 8192, "gather_rays": 32 }),
        json!({ "kind": "ppm", "photons_per_pass": 16384, "samples_per_sensor": 64 }),
        json!({ "kind": "sppm", "photons_per_pass": 16384 }),
        json!({ "kind": "ppm", "photons_per_pass": 16384, "samples_per_sensor": 64, "radius": "per_point" }),
        json!({ "kind": "sppm", "photons_per_pass": 16384, "radius": "per_point" }),
    ]
}

/// One method's name, and the values and standard errors of its sensors.
type Found = (String, Vec<(f64, f64)>);

/// Compares all methods on a scene; `refused` are those that must say no, with the code of the reason.
#[track_caller]
fn agree(what: &str, document: &Value, refused: &[(&str, RefusalCode)]) {
    agree_with(1, what, document, refused);
}

#[track_caller]
fn agree_with(eye_paths: u32, what: &str, document: &Value, refused: &[(&str, RefusalCode)]) {
    let mut found: Vec<Found> = Vec::new();
    let mut refusals = BTreeMap::new();
    for (number, method) in methods(eye_paths).into_iter().enumerate() {
        let kind = method["kind"].as_str().unwrap().to_owned();
        let name = method.get("radius").map_or(kind.clone(), |_| format!("{kind} per point"));
        let mut document = document.clone();
        document["method"] = method;
        document["seed"] = json!(number);
        document["stop"] = json!({ "relative_error": 1e-6, "view_relative_error": 1e-6, "max_passes": PASSES });
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        match refusal(&document) {
            None => {
                let prepared = prepare_document(&document, &Folder).unwrap();
                let mut merged = prepared.empty_estimate();
                for index in 0.. {
                    let chunk = render_chunk(&prepared, index, &merged);
                    merged.merge(&chunk.estimate);
                    if prepared.stop_after(index, &merged).is_some() {
                        break;
                    }
                }
                found.push((name, sensors(&merged)));
            }
            Some(refusal) => drop(refusals.insert(kind, refusal.code)),
        }
    }
    let refused = refused.iter().map(|(kind, code)| ((*kind).to_owned(), *code)).collect();
    assert_eq!(refusals, refused, "{what}");
    let pairs = || (0..found.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
    let comparisons = pairs().count() * found[0].1.len();
    // 1 - (1 - p)^n = false alarm (Sidak 1967)
    let each = 1.0 - (1.0 - FALSE_ALARM).powf(1.0 / comparisons as f64);
    let limit = StudentsT::new(0.0, 1.0, (PASSES - 1) as f64).unwrap().inverse_cdf(1.0 - 0.5 * each);
    let mut failures = Vec::new();
    for (a, b) in pairs() {
        let ((a_name, a), (b_name, b)) = (&found[a], &found[b]);
        let z = |((a, a_error), (b, b_error)): (&(f64, f64), &(f64, f64))| {
            if a == b { 0.0 } else { (a - b) / a_error.hypot(*b_error) }
        };
        let worst = a.iter().zip(b).map(z).fold(0.0, |worst: f64, z| if z.abs() > worst.abs() { z } else { worst });
        println!("{what}: {a_name}, {b_name}: worst {worst:.2} of {limit:.2}");
        if worst.abs() > limit {
            failures
                .push(format!("{a_name} and {b_name} differ by {worst:.2} standard errors, {limit:.2} are allowed"));
        }
    }
    for (name, values) in &found {
        let mean = |f: fn(&(f64, f64)) -> f64| values.iter().map(f).sum::<f64>() / values.len() as f64;
        println!("{what}: {name}: mean {:.3} lx, standard error {:.3} lx", mean(|v| v.0), mean(|v| v.1));
        // a comparison with an unbounded error would say nothing
        assert!(mean(|v| v.1) < 0.1 * mean(|v| v.0), "{what}: {name}");
    }
    assert!(failures.is_empty(), "{what}: {failures:#?}");
}

fn sensors(estimate: &Estimate) -> Vec<(f64, f64)> {
    let grid = &estimate.grids[0];
    (0..grid.sensors.len()).map(|sensor| (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor))).collect()
}

fn scene(name: &str) -> Value {
    let mut document = reference::json(&format!("scenes/{name}.json"));
    let height = document["grids"][0]["height_m"].clone();
    document["grids"] = json!([{ "name": "grid", "height_m": height, "cells": [4, 4], "estimate": "point" }]);
    document
}

fn cells(mut document: Value) -> Value {
    document["grids"][0]["estimate"] = "cell_average".into();
    document
}

#[test]
fn straight_tube() {
    agree("S1", &scene("S1"), &[]);
    agree("S1, cells", &cells(scene("S1")), &[]);
}

/// The sun through a clear closure: path tracing says that it cannot.
#[test]
fn sun_through_a_clear_closure() {
    let refused = [("path_tracing", RefusalCode::SunThroughClearClosures), ("two_stage", RefusalCode::ClearClosures)];
    agree("S2", &scene("S2"), &refused);
    agree("S2, cells", &cells(scene("S2")), &refused);
}

#[test]
fn bent_tube() {
    agree("S3", &scene("S3"), &[]);
}

#[test]
fn mesh_tube() {
    agree("S3_mesh", &scene("S3_mesh"), &[]);
}

/// A room of 3 x 2.5 x 2.4 m under a clear sky, with a tube and a sun of 40 klx.
fn room() -> Value {
    json!({
        "sky": {
            "cie_type": 12, "sun_position": { "altitude_deg": 50, "azimuth_deg": 200 },
            "zenith_luminance_cd_m2": 4000, "direct_normal_illuminance_lux": 40000
        },
        "room": { "size_m": [3.0, 2.5, 2.4], "surfaces": {
            "floor": { "reflectance": 0.3 }, "walls": { "reflectance": 0.5 }, "ceiling": { "reflectance": 0.7 }
        } },
        "tubes": [{
            "centre_m": [1.2, 1.3], "diameter_m": 0.3, "reflectance": 0.97, "segments": [{ "length_m": 0.8 }],
            "collector": { "kind": "dome", "transmittance": 0.9 },
            "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.3 }
        }],
        "grids": [{ "name": "grid", "height_m": 0.8, "cells": [4, 4], "margin_m": 0.05, "estimate": "point" }]
    })
}

#[test]
fn glossy_walls() {
    let mut document = room();
    document["room"]["surfaces"]["walls"] = json!({ "reflectance": 0.2, "specular": 0.5, "roughness": 0.3 });
    agree("glossy walls", &document, &[]);
}

/// A mirror: points cannot be connected to it, cells see what crosses them; the sun in it is found by photons alone. What it
/// shows of the diffuser paths from the sensors find by chance, and say so: the error tells the truth when there are many.
#[test]
fn mirror_object() {
    let mut document = cells(room());
    document["room"]["objects"] = json!([{
        "kind": "box", "size_m": [0.8, 0.1, 1.6], "position_m": [1.5, 2.2, 0], "rotation_deg": 15,
        "surface": { "reflectance": 0.05, "specular": 0.85 }
    }]);
    let refused = [("path_tracing", RefusalCode::SunByMirrors), ("two_stage", RefusalCode::SunByMirrors)];
    agree("mirror in the sun", &document, &refused);
    document["sky"]["direct_normal_illuminance_lux"] = json!(0);
    agree_with(32, "mirror", &document, &[]);
    document["method"] = "path_tracing".into();
    let parsed = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    assert!(
        prepare_document(&parsed, &Folder)
            .unwrap()
            .warnings
            .iter()
            .any(|warning| warning.code == WarningCode::MirrorsByChance)
    );
}

#[test]
fn furniture() {
    let mut document = room();
    document["room"]["objects"] = json!([
        { "kind": "box", "size_m": [1.2, 0.7, 0.75], "position_m": [0.9, 0.8, 0], "rotation_deg": 20,
          "surface": { "reflectance": 0.6 } },
        { "kind": "box", "size_m": [0.5, 0.4, 1.9], "position_m": [2.5, 2.1, 0], "rotation_deg": 0,
          "surface": { "reflectance": 0.4 } },
        { "kind": "mesh", "mesh": "block.obj", "unit": "cm", "position_m": [2.2, 0.6, 0], "rotation_deg": 30,
          "surfaces": { "side": { "reflectance": 0.5 }, "top": { "reflectance": 0.3 } } }
    ]);
    agree("furniture", &cells(document), &[]);
}

#[test]
fn two_tubes() {
    let mut document = room();
    let mut second = document["tubes"][0].clone();
    second["centre_m"] = json!([2.3, 0.8]);
    second["segments"] = json!([{ "length_m": 0.4 }, { "length_m": 0.5, "tilt_deg": 40, "azimuth_deg": 120 }]);
    document["tubes"].as_array_mut().unwrap().push(second);
    agree("two tubes", &document, &[]);
}

#[test]
fn measured_diffuser() {
    let mut document = room();
    document["tubes"][0]["diffuser"] = json!({
        "kind": "measured", "incidence_deg": [0, 30, 60, 90], "exit_deg": [0, 30, 60, 90],
        "btdf_per_sr": [[0.6, 0.2, 0.05, 0.0], [0.4, 0.25, 0.05, 0.0], [0.15, 0.15, 0.1, 0.05], [0.03, 0.03, 0.03, 0.03]]
    });
    agree("measured diffuser", &document, &[("two_stage", RefusalCode::MeasuredDiffusers)]);
}

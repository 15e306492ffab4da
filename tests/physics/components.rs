//! The light of a grid in parts: each is the light of a job that has this part alone, and they add up to the whole.
//!
//! And the second opinion of another method.

use serde_json::{Value, json};
use skyduct::document::JobDocument;
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::estimate::Estimate;
use skyduct::estimate::residual::Residuals;
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::present::reader::ResultReader as _;

use crate::documents::Folder;
use crate::judge::{Measured, compare, each};

/// False alarms of a test with all its comparisons.
const FALSE_ALARM: f64 = 1e-3;

const PASSES: u64 = 8;

/// Two tubes unlike each other, sun, sky and a panel; `method` is asked for.
fn document(method: &Value) -> Value {
    json!({
        "sky": { "cie_type": 12, "direct_normal_illuminance_lux": 60000, "zenith_luminance_cd_m2": 6000,
                 "sun_position": { "altitude_deg": 50, "azimuth_deg": 160 } },
        "room": { "size_m": [3, 2.4, 2.5],
                  "surfaces": { "floor": { "reflectance": 0.3 }, "walls": { "reflectance": 0.6 }, "ceiling": { "reflectance": 0.7 } },
                  "luminaires": [{ "kind": "rectangle", "corner_m": [1.2, 2, 2.5], "edge_u_m": [0, 0.3, 0], "edge_v_m": [0.6, 0, 0],
                                   "luminance_cd_m2": 800 }] },
        "tubes": [
            { "centre_m": [0.7, 0.7], "diameter_m": 0.3, "reflectance": 0.97, "segments": [{ "length_m": 0.8 }],
              "collector": { "kind": "flat", "transmittance": 0.9 },
              "diffuser": { "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.2 } },
            { "centre_m": [2.2, 1.4], "diameter_m": 0.4, "reflectance": 0.95,
              "segments": [{ "length_m": 0.5 }, { "length_m": 0.6, "tilt_deg": 25, "azimuth_deg": 40 }],
              "collector": { "kind": "flat", "transmittance": 0.85 },
              "diffuser": { "kind": "lambertian", "transmittance": 0.5 } }
        ],
        "grids": [{ "name": "g", "height_m": 0.75, "cells": [3, 2], "margin_m": 0.3 }],
        "method": method,
        "stop": { "relative_error": 1e-6, "max_passes": PASSES },
        "seed": 3
    })
}

fn prepared(document: &Value) -> Prepared {
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    prepare_document(&document, &Folder).unwrap()
}

fn grid(prepared: &Prepared, estimate: &Estimate) -> Value {
    json!(prepared.results(estimate).grid("g").unwrap().unwrap())
}

fn rendered(document: &Value) -> Value {
    let prepared = prepared(document);
    grid(&prepared, &prepared.render_all_passes(&mut |_, _| {}).unwrap())
}

fn numbers(rows: &Value) -> Vec<f64> {
    let rows = rows.as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
    rows.map(|number| number.as_f64().unwrap()).collect()
}

fn measured(part: &Value) -> Vec<Measured> {
    let (values, errors) = (numbers(&part["illuminance_lux"]), numbers(&part["standard_error_lux"]));
    let measured = |(value, error)| Measured { value, error, degrees: (PASSES - 1) as f64 };
    values.into_iter().zip(errors).map(measured).collect()
}

/// What is left of measurements without others that are independent.
fn without(all: &[Measured], part: &[Measured]) -> Vec<Measured> {
    let less = |(all, part): (&Measured, &Measured)| Measured {
        value: all.value - part.value,
        error: all.error.hypot(part.error),
        ..*all
    };
    all.iter().zip(part).map(less).collect()
}

/// Each part as light tracing finds it in a job of its own, where all other light is switched off.
fn truth() -> Vec<(String, Vec<Measured>)> {
    let job = |off: &[&str], dark_tube: Option<usize>| {
        let mut document = document(&json!({ "kind": "light_tracing", "photons_per_pass": 4096 }));
        document["effects"] = off.iter().map(|name| ((*name).to_owned(), json!("off"))).collect();
        if let Some(tube) = dark_tube {
            document["tubes"][tube]["collector"]["transmittance"] = json!(0);
        }
        measured(&rendered(&document))
    };
    let others = [("sky", ["sun", "luminaires"]), ("sun", ["sky", "luminaires"]), ("luminaires", ["sky", "sun"])];
    let mut parts = Vec::new();
    for (source, [one, other]) in others {
        let (all, direct) = (job(&[one, other], None), job(&[one, other, "interreflection"], None));
        parts.push((format!("{source}_interreflected"), without(&all, &direct)));
        parts.push((format!("{source}_direct"), direct));
    }
    for (tube, dark) in [(0, 1), (1, 0)] {
        parts.push((format!("tube {tube}"), job(&["luminaires"], Some(dark))));
    }
    parts
}

/// All methods with independent passes: sums to 1e-12, and each part against a job of its own.
#[test]
fn parts_are_the_light_of_jobs_that_have_them_alone() {
    let truth = truth();
    let methods = [
        json!({ "kind": "two_stage" }),
        json!({ "kind": "light_tracing", "photons_per_pass": 4096 }),
        json!({ "kind": "path_tracing", "samples_per_sensor": 64 }),
        json!({ "kind": "bidirectional_path_tracing", "photons_per_pass": 2048, "samples_per_sensor": 32 }),
        json!({ "kind": "photon_mapping", "photons_per_pass": 4096, "gather_rays": 64 }),
    ];
    let sensors = truth[0].1.len();
    let least = each(FALSE_ALARM, methods.len() * truth.len() * sensors);
    for method in &methods {
        let mut document = document(method);
        document["grids"][0]["components"] = json!(true);
        let grid = rendered(&document);
        let components = grid["components"].as_object().unwrap();
        let by_tube = grid["by_tube"].as_array().unwrap();
        assert_eq!((components.len(), by_tube.len()), (6, 2), "{method}");
        let whole = numbers(&grid["illuminance_lux"]);
        let value = |part: &Value, sensor: usize| numbers(&part["illuminance_lux"])[sensor];
        for (sensor, whole) in whole.iter().enumerate() {
            let by_source: f64 = components.values().map(|part| value(part, sensor)).sum();
            let electric =
                ["luminaires_direct", "luminaires_interreflected"].map(|name| value(&components[name], sensor));
            let by_tubes = by_tube.iter().map(|part| value(part, sensor)).sum::<f64>() + electric.iter().sum::<f64>();
            for sum in [by_source, by_tubes] {
                assert!((sum - whole).abs() < 1e-12 * whole, "{method}, {sensor}: {sum}, not {whole}");
            }
        }
        for (name, truth) in &truth {
            let part = match name.strip_prefix("tube ") {
                Some(number) => &by_tube[number.parse::<usize>().unwrap()],
                None => &components[name],
            };
            for (sensor, (found, truth)) in measured(part).into_iter().zip(truth).enumerate() {
                let verdict = compare(found, *truth, 0.0);
                assert!(verdict.probability > least, "{method}, {name}, {sensor}: {found:?}, not {truth:?}");
            }
        }
    }
}

/// Without reflection all light is direct; where nothing gives light all parts are 0; of absent sources there are none.
#[test]
fn parts_of_simple_light() {
    let mut document = document(&json!("auto"));
    document["grids"][0]["components"] = json!(true);
    document["effects"] = json!({ "interreflection": "off", "sun": "off" });
    let grid = rendered(&document);
    let components = grid["components"].as_object().unwrap();
    let names: Vec<&str> = components.keys().map(String::as_str).collect();
    assert_eq!(names, ["luminaires_direct", "luminaires_interreflected", "sky_direct", "sky_interreflected"]);
    assert!(numbers(&components["sky_interreflected"]["illuminance_lux"]).iter().all(|lux| *lux == 0.0));
    assert!(components["sky_direct"]["mean_lux"].as_f64().unwrap() > 1.0);
    document["effects"] = json!({ "sky": "off", "sun": "off", "luminaires": "off" });
    let dark = rendered(&document);
    assert_eq!(dark["components"], json!({}));
    let parts = dark["by_tube"].as_array().unwrap();
    assert!(
        parts.len() == 2 && parts.iter().all(|part| part["mean_lux"] == 0.0 && part["mean_lux_standard_error"] == 0.0)
    );
}

/// Views and grids of one method are computed apart, and the views keep their bits.
#[test]
fn views_know_nothing_of_parts() {
    let job = |components: bool| {
        let mut document =
            document(&json!({ "kind": "path_tracing", "samples_per_sensor": 4, "samples_per_pixel": 1 }));
        document["grids"][0]["components"] = json!(components);
        document["views"] =
            json!([{ "name": "v", "eye_m": [0.2, 0.2, 1.2], "look_at_m": [2, 2, 0.5], "size_px": [8, 8] }]);
        document["stop"] = json!({ "max_passes": 4, "relative_error": 1e-6, "view_relative_error": 1e-6 });
        let estimate = prepared(&document).render_all_passes(&mut |_, _| {}).unwrap();
        estimate.views[0].mean.iter().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(job(true), job(false));
}

/// What cannot be told in parts, or be checked, is refused at the field that asks for it.
#[test]
fn dependent_passes_have_no_parts() {
    let refusal = |method: &str, edit: &dyn Fn(&mut Value)| {
        let mut document = document(&json!(method));
        document["room"]["luminaires"] = json!([]);
        edit(&mut document);
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        let error = prepare_document(&document, &Folder).err().unwrap().0.remove(0);
        (error.pointer, error.refusal.unwrap().0.code())
    };
    let components = |document: &mut Value| document["grids"][0]["components"] = json!(true);
    let check = |document: &mut Value| document["cross_check"] = json!(true);
    for method in ["ppm", "sppm", "holigilm"] {
        let expected = ("/grids/0/components".to_owned(), "dependent_passes");
        assert_eq!(refusal(method, &components), expected, "{method}");
    }
    assert_eq!(refusal("holigilm", &check), ("/cross_check".to_owned(), "dependent_passes"));
    let no_grid = |document: &mut Value| {
        document["views"] =
            json!([{ "name": "v", "eye_m": [0.2, 0.2, 1.2], "look_at_m": [2, 2, 0.5], "size_px": [8, 8] }]);
        document["grids"] = json!([]);
        check(document);
    };
    assert_eq!(refusal("auto", &no_grid), ("/cross_check".to_owned(), "no_second_method"));
}

/// Two methods that are right agree; the values of the first keep their bits, with parts and without.
#[test]
fn a_second_method_finds_the_same() {
    let mut document = document(&json!("auto"));
    let alone = rendered(&document);
    document["cross_check"] = json!(true);
    let prepared = prepared(&document);
    let plan = prepared.plan_json();
    let [first, second] = ["grids", "cross_check"].map(|key| plan["methods"][key]["name"].as_str().unwrap().to_owned());
    assert_eq!((first.as_str(), second.as_str()), ("two_stage", "light_tracing"));
    let estimate = prepared.render_all_passes(&mut |_, _| {}).unwrap();
    assert_eq!(grid(&prepared, &estimate)["illuminance_lux"], alone["illuminance_lux"]);
    let summary = prepared.summary_json(&estimate, Spent::NOTHING, StoppedBy::MaxPasses);
    let check = &summary["cross_check"];
    println!("{check:#}");
    assert!(check["agrees"] == true && check["method"] == "light_tracing" && check["sensors"] == 6);
    assert!(check["worst_sigma"].as_f64().unwrap() < 5.0 && check["relative_error"].as_f64().unwrap() < 0.1);
    assert_eq!(summary["render_warnings"], json!([]));
    // a value that is wrong is told
    let mut wrong = estimate;
    wrong.grids[0].residuals = Residuals::default();
    wrong.grids[0].sensors[2].mean *= 1.5;
    let warnings = prepared.render_warnings(&wrong);
    assert_eq!(warnings.iter().map(|warning| warning.code.to_string()).collect::<Vec<_>>(), ["methods_disagree"]);
}

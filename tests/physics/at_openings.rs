//! Sensors within millimetres below an opening: they see next to nothing else, and get what leaves it.

use std::f64::consts::PI;

use serde_json::{Value, json};
use skyduct::document::JobDocument;
use skyduct::engine::cancel::Stop;
use skyduct::integrator::method::RefusalCode;
use skyduct::present::prepared::{Prepared, prepare_document};

use crate::documents::{Folder, prepare, render};

/// Radius of the opening in m, and what leaves it in lm/m2: a uniform sky through a lossless tube and a sheet.
const RADIUS: f64 = 0.25;
const EXITANCE: f64 = PI * 5000.0 * 0.6;

/// The number of the one sensor of 5 x 3 that is below the opening, on its axis.
const BELOW: usize = 6;

fn lambertian() -> Value {
    json!({ "kind": "lambertian", "transmittance": 0.6 })
}

fn clear() -> Value {
    json!({ "kind": "clear", "transmittance": 0.6 })
}

fn mixed() -> Value {
    json!({
        "kind": "mixed", "inner": "lambertian", "lambertian_radius_m": 0.15, "lambertian_transmittance": 0.6,
        "lambertian_reflectance": 0.0, "clear_transmittance": 0.6
    })
}

/// A room with a tube under a uniform sky, points this far below its ceiling.
fn document(document: &mut Value, below_m: f64, diffuser: &Value, reflectance: f64) {
    let of = json!({ "reflectance": reflectance });
    document["sky"]["cie_type"] = json!(5);
    document["room"] =
        json!({ "size_m": [4.0, 3.0, 2.7], "surfaces": { "floor": of, "walls": of.clone(), "ceiling": of.clone() } });
    let tube = &mut document["tubes"][0];
    tube["centre_m"] = json!([1.2, 1.5]);
    tube["diameter_m"] = json!(2.0 * RADIUS);
    tube["reflectance"] = json!(1.0);
    tube["diffuser"] = diffuser.clone();
    document["grids"] = json!([{ "name": "below", "height_m": 2.7 - below_m, "cells": [5, 3], "estimate": "point" }]);
    document["stop"] = json!({ "relative_error": 0.05, "max_seconds": 300 });
}

/// By Lambert's closed form.
fn on_axis(below_m: f64) -> f64 {
    EXITANCE * RADIUS * RADIUS / (RADIUS * RADIUS + below_m * below_m)
}

/// The illuminance below the opening and its error after some passes; what surfaces reflect there is less than `reflected` lx.
#[track_caller]
fn assert_below(prepared: &Prepared, below_m: f64, reflected: f64, what: &str) {
    let estimate = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap().estimate;
    let (lux, error) = (estimate.grids[0].illuminance_lux(BELOW), estimate.grids[0].standard_error_lux(BELOW));
    println!("{what}, {below_m} m below: {lux} +- {error} lx after {} passes", estimate.passes);
    let excess = lux - on_axis(below_m);
    assert!(error > 0.0 && error < 0.05 * lux, "{what}, {below_m} m below: {lux} +- {error}");
    let beyond = if excess > 0.0 { (excess - reflected).max(0.0) } else { -excess };
    assert!(beyond <= 4.5 * error, "{what}, {below_m} m below: {lux} +- {error} is not {}", on_axis(below_m));
}

/// The method that the program takes is right at every distance, through every closure, in a black room.
#[test]
fn points_below_an_opening_are_right_by_default() {
    for diffuser in [lambertian(), clear(), mixed()] {
        for below_m in [0.026, 1e-3, 1e-4, 1e-9] {
            // the error of the whole grid, of which this is one sensor
            let prepared = prepare("S1", |job| {
                document(job, below_m, &diffuser, 0.0);
                job["stop"]["relative_error"] = json!(if diffuser == lambertian() { 0.02 } else { 0.05 });
            });
            let estimate = render(&prepared);
            let grid = &estimate.grids[0];
            let (lux, error) = (grid.illuminance_lux(BELOW), grid.standard_error_lux(BELOW));
            println!("{} {below_m}: {lux} +- {error}, {} passes", diffuser["kind"], estimate.passes);
            let difference = (lux - on_axis(below_m)).abs();
            // a tenth of a percent for the sheet's own rounding of the closed form
            assert!(difference <= 4.5 * error + 1e-3 * lux, "{diffuser} {below_m}: {lux} +- {error}");
            assert!(error < 0.1 * lux, "{diffuser} {below_m}: {lux} +- {error}");
        }
    }
}

/// What finds light by photons at the diffuser finds it there too, and so does what the program takes beside a mirror.
#[test]
fn photons_find_what_leaves_an_opening_very_near() {
    for (below_m, cases) in
        [(1e-4, vec![("cell_average", lambertian())]), (1e-9, vec![("point", lambertian()), ("point", mixed())])]
    {
        for method in ["photon_mapping", "sppm", "ppm"] {
            for (estimate, diffuser) in cases.clone() {
                let prepared = prepare("S1", |job| {
                    document(job, below_m, &diffuser, 0.5);
                    // cells within the opening
                    job["grids"][0]["estimate"] = json!(estimate);
                    if estimate == "cell_average" {
                        job["grids"][0]["cells"] = json!([25, 15]);
                    }
                    job["method"] = json!({ "kind": method, "photons_per_pass": 16384 });
                    job["stop"]["max_passes"] = json!(12);
                });
                if estimate == "point" {
                    assert_below(&prepared, below_m, 60.0, &format!("{method} {}", diffuser["kind"]));
                    continue;
                }
                let found = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap().estimate;
                // column 7, row 7 is the cell about the axis
                let (lux, error) =
                    (found.grids[0].illuminance_lux(7 * 25 + 7), found.grids[0].standard_error_lux(7 * 25 + 7));
                println!("{method} cells {below_m}: {lux} +- {error}");
                assert!(error < 0.06 * lux && (lux - EXITANCE).abs() <= 4.5 * error + 60.0, "{lux} +- {error}");
            }
        }
    }
    let mirror = prepare("S1", |job| {
        document(job, 1e-4, &lambertian(), 0.5);
        job["room"]["surfaces"]["wall_west"] = json!({ "reflectance": 0.05, "specular": 0.85, "roughness": 0 });
        job["stop"]["max_passes"] = json!(64);
    });
    assert_below(&mirror, 1e-4, 90.0, "auto beside a mirror");
}

/// A method that connects points refuses, naming the sensor and the distance it needs.
#[test]
fn light_tracing_names_the_sensor_that_is_too_near() {
    let mut job = crate::reference::json("scenes/S1.json");
    document(&mut job, 1e-4, &lambertian(), 0.0);
    job["method"] = json!("light_tracing");
    let job = JobDocument::parse(job.to_string().as_bytes()).unwrap();
    let error = prepare_document(&job, &Folder).err().unwrap().0.remove(0);
    let refusal = error.refusal.as_ref().map(|refusal| refusal.0);
    assert_eq!((error.pointer.as_str(), refusal), ("/method", Some(RefusalCode::PointsNearSurfaces)));
    for part in ["row 1, column 1", "\"below\"", "2.700e-2 m"] {
        assert!(error.detail.contains(part), "{part}: {error}");
    }
}

//! Means over cells of which walls cut a part off: they are means over the part in the room, by every method.

use serde_json::{Value, json};
use skyduct::document::{JobDocument, leave_out, to_scene};
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::scene::Grid;

use crate::documents::{Folder, render};

/// Cells of 0.5 m in a room of 4.3 m x 3.3 m, the last column and row of which are cut, and cells of 0.1 m in the same places.
fn prepared(room: &Value, method: &str, relative_error: f64) -> (Prepared, Vec<Grid>) {
    let document = json!({
        "sky": { "cie_type": 5, "sun_position": { "altitude_deg": 45, "azimuth_deg": 180 },
                 "diffuse_horizontal_illuminance_lux": 10000 },
        "room": room,
        "tubes": [{ "centre_m": [3.9, 1.3], "diameter_m": 0.5, "reflectance": 0.98, "segments": [{ "length_m": 1.0 }],
                    "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.7 } }],
        "grids": [{ "name": "cut", "height_m": 0.8, "spacing_m": 0.5, "estimate": "cell_average" },
                  { "name": "fine", "height_m": 0.8, "cells": [43, 33], "estimate": "cell_average" }],
        "method": method,
        "stop": { "relative_error": relative_error, "max_seconds": 300 }
    });
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    let (mut scene, ..) = to_scene(&document, &Folder).unwrap();
    leave_out(&document, &mut scene, true).unwrap();
    (prepare_document(&document, &Folder).unwrap(), scene.grids)
}

/// The value of each cut cell is the mean of the fine cells in it: within 4 standard errors of both. Fine cells of path tracing have paths of
/// their own; those of other methods share their photons, so that the error of their mean is at most the mean of their errors.
fn agrees(room: &Value, method: &str, relative_error: f64) {
    let (prepared, grids) = prepared(room, method, relative_error);
    let estimate = render(&prepared);
    let ([cut, fine], [coarse_grid, fine_grid]) =
        ([0, 1].map(|grid| &estimate.grids[grid]), [0, 1].map(|grid| &grids[grid]));
    let mut compared = 0;
    for sensor in (0..coarse_grid.len()).filter(|sensor| coarse_grid.is_cut(*sensor)) {
        let centre = coarse_grid.centre(sensor);
        let within = (0..fine_grid.len()).filter(|other| {
            let apart = (fine_grid.centre(*other) - centre).abs();
            apart.x < 0.25 && apart.y < 0.25
        });
        let within: Vec<usize> = within.collect();
        let count = within.len() as f64;
        let area = coarse_grid.area.as_ref().unwrap()[sensor] * 0.25;
        assert!((area - 0.01 * count).abs() < 1e-9, "{sensor}: {area} m2 and {count} fine cells");
        let mean = within.iter().map(|other| fine.illuminance_lux(*other)).sum::<f64>() / count;
        let errors: Vec<f64> = within.iter().map(|other| fine.standard_error_lux(*other)).collect();
        let of_mean = match method {
            "path_tracing" => errors.iter().map(|error| error * error).sum::<f64>().sqrt() / count,
            _ => errors.iter().sum::<f64>() / count,
        };
        let error = of_mean.hypot(cut.standard_error_lux(sensor));
        let value = cut.illuminance_lux(sensor);
        assert!((value - mean).abs() < 4.0 * error, "{method}, {sensor}: {value} is not {mean} +- {error}");
        compared += 1;
    }
    assert_eq!(compared, 15);
}

fn cuboid() -> Value {
    json!({ "size_m": [4.3, 3.3, 2.7] })
}

fn plan() -> Value {
    json!({ "plan": { "outline_m": [[0, 0], [4.3, 0], [4.3, 3.3], [0, 3.3]] },
            "ceiling": { "kind": "flat", "height_m": 2.7 },
            "luminaires": [{ "kind": "rectangle", "corner_m": [4.0, 2.6, 2.7], "edge_u_m": [0, 0.4, 0], "edge_v_m": [0.2, 0, 0],
                             "luminance_cd_m2": 3000 }] })
}

#[test]
fn two_stage() {
    agrees(&plan(), "two_stage", 0.04);
}

#[test]
fn light_tracing() {
    [cuboid(), plan()].iter().for_each(|room| agrees(room, "light_tracing", 0.04));
}

#[test]
fn path_tracing() {
    [cuboid(), plan()].iter().for_each(|room| agrees(room, "path_tracing", 0.16));
}

#[test]
fn bidirectional_path_tracing() {
    [cuboid(), plan()].iter().for_each(|room| agrees(room, "bidirectional_path_tracing", 0.04));
}

//! Rooms that are no boxes: against an independent path tracer over triangles (`reference/rooms`), and one with tilted openings against
//! stored renders.

use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{JobDocument, to_scene};
use skyduct::scene::{EstimateKind, Grid, Scene, Sensor};

use super::super::row::{Row, Values};
use crate::documents::Folder;
use crate::judge::{Measured, Whole};
use crate::reference::{self, number};

/// Degrees of freedom of errors of 400 000 paths.
const MANY: f64 = 1e5;

/// An oracle's sensor and its illuminance.
struct Lit {
    sensor: Sensor,
    lux: f64,
    error: f64,
}

fn lit(room: &str) -> Vec<Lit> {
    let of_row = |row: &Vec<String>| {
        let of: Vec<f64> = row.iter().map(|cell| number(cell)).collect();
        let sensor = Sensor { position: DVec3::new(of[0], of[1], of[2]), normal: DVec3::new(of[3], of[4], of[5]) };
        Lit { sensor, lux: of[6], error: of[7] }
    };
    reference::rows(&format!("rooms/{room}.csv")).iter().map(of_row).collect()
}

/// A row with level grids of points that the oracle has, or with all of its sensors, which are those of the document.
fn row(name: &str, level: Vec<Grid>) -> Row {
    let (lit, mut scene) = (lit(name), scene(name));
    if !level.is_empty() {
        scene.grids = level;
    }
    let of_sensor = |sensor: Sensor| {
        let same =
            |lit: &&Lit| (lit.sensor.position - sensor.position).length() < 1e-9 && lit.sensor.normal == sensor.normal;
        let Lit { lux, error, .. } = lit.iter().find(same).unwrap_or_else(|| panic!("{name}: {sensor:?}"));
        Measured { value: *lux, error: *error, degrees: MANY }
    };
    let output = |grid: &Grid| {
        let sensors: Vec<Measured> = (0..grid.len()).map(|index| of_sensor(grid.sensor(index))).collect();
        let n = sensors.len() as f64;
        let value = sensors.iter().map(|lit| lit.value).sum::<f64>() / n;
        let noise = sensors.iter().map(|lit| lit.error * lit.error).sum::<f64>().sqrt() / n;
        (sensors, Whole { value, noise, bias: 0.0, degrees: MANY })
    };
    let values = Values { outputs: scene.grids.iter().map(output).collect(), tubes: Vec::new() };
    Row::new(scene).given(values, 0.0)
}

/// The scene of a room's document: pipes that lose nothing under a uniform sky of 10 000 lx, so that each closure is a disc or square of even exitance.
fn scene(room: &str) -> Scene {
    let document = reference::json(&format!("rooms/{room}.json"));
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    to_scene(&document, &Folder).unwrap().0
}

pub fn l_hall_points() -> Row {
    let north = Grid::new("north".into(), 0.85, [4, 3], 0.0, [4.0, 3.0], EstimateKind::Point);
    let south = Grid::new("south".into(), 0.85, [8, 3], 0.0, [8.0, 3.0], EstimateKind::Point);
    row("L_hall", vec![south, Grid { y_m: vec![3.5, 4.5, 5.5], ..north }])
}

pub fn attic_points() -> Row {
    row("attic", vec![Grid::new("desk".into(), 0.85, [5, 4], 0.0, [5.0, 4.0], EstimateKind::Point)])
}

pub fn gable_points() -> Row {
    row("gable", vec![Grid::new("desk".into(), 0.85, [10, 6], 0.0, [10.0, 6.0], EstimateKind::Point)])
}

/// South of the core on both sides of the partition, between core and eastern wall, and north of it.
pub fn skew_points() -> Row {
    let grid = |name: &str, x_m: &[f64], y_m: &[f64]| {
        let cells = [x_m.len(), y_m.len()];
        let whole = Grid::new(name.into(), 0.75, cells, 0.0, [6.0, 5.0], EstimateKind::Point);
        Grid { x_m: x_m.to_vec(), y_m: y_m.to_vec(), ..whole }
    };
    row(
        "skew",
        vec![
            grid("south", &[1.2, 2.0, 2.8, 3.6, 4.4, 5.2], &[0.4, 1.2]),
            grid("east", &[3.6, 4.4, 5.2], &[2.0]),
            grid("north", &[1.2, 2.0, 2.8, 3.6, 4.4], &[2.8, 3.6]),
        ],
    )
}

pub fn l_hall_sensors() -> Row {
    row("L_hall", Vec::new())
}

pub fn attic_sensors() -> Row {
    row("attic", Vec::new())
}

pub fn skew_sensors() -> Row {
    row("skew", Vec::new())
}

/// An attic with an opening in its slope, below a pipe along the normal of the roof, and one in its east wall, below a pipe that turns up.
/// Both leaning pipes see the ground, which `beam_lux` of the sun lights, too.
fn tilted_openings(closure: &Value, beam_lux: f64, estimate: &str) -> Row {
    let document = json!({
        "sky": { "cie_type": 12, "diffuse_horizontal_illuminance_lux": 12_000, "direct_normal_illuminance_lux": beam_lux,
                 "sun_position": { "altitude_deg": 50, "azimuth_deg": 160 } },
        "surroundings": { "ground_reflectance": 0.2 },
        "room": {
            "plan": { "outline_m": [[0, 0], [2.4, 0], [2.4, 2], [0, 2]] },
            "ceiling": { "kind": "sloped", "point_m": [0, 0, 1.6], "rise_toward_deg": 0, "pitch_deg": 35 },
            "surfaces": { "floor": { "reflectance": 0.3 }, "walls": { "reflectance": 0.5 }, "ceiling": { "reflectance": 0.7 } }
        },
        "tubes": [
            { "centre_m": [0.8, 0.9], "normal": "face", "diameter_m": 0.3, "reflectance": 0.95, "segments": [{ "length_m": 0.6 }],
              "collector": { "kind": "flat", "transmittance": 0.9 }, "diffuser": closure },
            { "centre_m": [2.4, 1.1, 1.3], "normal": "face", "diameter_m": 0.25, "reflectance": 0.95,
              "segments": [{ "length_m": 0.3 }, { "length_m": 0.5 }], "collector": { "kind": "dome", "transmittance": 0.9 },
              "diffuser": closure }
        ],
        "grids": [{ "name": "desk", "height_m": 0.6, "cells": [4, 3], "margin_m": 0.2, "estimate": estimate }]
    });
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    Row::new(to_scene(&document, &Folder).unwrap().0)
}

pub fn tilted_openings_points() -> Row {
    let closure = json!({ "kind": "lambertian", "transmittance": 0.6, "reflectance": 0.2 });
    tilted_openings(&closure, 20_000.0, "point")
}

pub fn tilted_clear_openings_cells() -> Row {
    tilted_openings(&json!({ "kind": "clear", "transmittance": 0.9 }), 0.0, "cell_average")
}

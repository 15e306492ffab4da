//! Rooms that are no boxes, against an independent path tracer over triangles (`reference/rooms`).

use glam::DVec3;
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

pub fn l_hall_sensors() -> Row {
    row("L_hall", Vec::new())
}

pub fn attic_sensors() -> Row {
    row("attic", Vec::new())
}

pub fn skew_sensors() -> Row {
    row("skew", Vec::new())
}

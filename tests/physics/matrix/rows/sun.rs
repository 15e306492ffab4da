//! Patterns in which the light of the sun leaves a diffuser.

use glam::DVec2;
use skyduct::scene::EstimateKind::{self, CellAverage, Point};
use skyduct::scene::{Grid, Tube};

use super::super::row::Row;
use crate::scenes::{RADIUS, SIDE, cube, daylight, lambertian, straight, with_sun};

/// A metre below the tube patterns matter, and are not lost.
fn patterns(altitude_deg: f64, estimate: EstimateKind) -> Row {
    let tubes = vec![straight(0.4, 0.95, lambertian(0.6, 0.2))];
    let mut scene = cube(0.2, 0.5, 0.7, tubes, daylight(12, 100.0, altitude_deg, 120.0), estimate);
    with_sun(&mut scene, 60_000.0, altitude_deg);
    scene.grids = vec![Grid::new("grid".into(), SIDE - 1.0, [5, 5], 0.0, [SIDE, SIDE], estimate)];
    Row::new(scene)
}

pub fn patterns_of_a_low_sun_points() -> Row {
    patterns(30.0, Point)
}

pub fn patterns_of_the_sun_cells() -> Row {
    patterns(45.0, CellAverage)
}

pub fn patterns_of_a_high_sun_points() -> Row {
    patterns(60.0, Point)
}

/// Interreflected light alone: the sensors look past the tube.
pub fn interreflection_of_the_sun_points() -> Row {
    let tube = Tube { centre: DVec2::new(RADIUS, 0.5 * SIDE), ..straight(0.3, 0.95, lambertian(0.6, 0.2)) };
    let mut scene = cube(0.5, 0.8, 0.8, vec![tube], daylight(12, 100.0, 40.0, 120.0), Point);
    with_sun(&mut scene, 60_000.0, 40.0);
    scene.grids = vec![Grid::new("grid".into(), SIDE - 0.01, [4, 4], 0.3, [SIDE, SIDE], Point)];
    Row::new(scene).stored(&["path_tracing", "bidirectional_path_tracing"])
}

/// Tubes that touch walls and each other, and a plane 5 cm below them.
fn beside_walls(estimate: EstimateKind) -> Row {
    let tube = |y: f64| Tube { centre: DVec2::new(RADIUS, y), ..straight(0.5, 0.95, lambertian(0.6, 0.2)) };
    let tubes = vec![tube(RADIUS), tube(3.0 * RADIUS)];
    let mut scene = cube(0.3, 0.8, 0.7, tubes, daylight(12, 5000.0, 50.0, 120.0), estimate);
    with_sun(&mut scene, 20_000.0, 50.0);
    scene.grids = vec![Grid::new("grid".into(), SIDE - 0.05, [6, 6], 0.0, [SIDE, SIDE], estimate)];
    Row::new(scene)
}

pub fn beside_walls_points() -> Row {
    beside_walls(Point)
}

pub fn beside_walls_cells() -> Row {
    beside_walls(CellAverage)
}

//! Rooms without objects, which the deterministic solver computes, too.

use glam::DVec2;
use skyduct::optics::{Diffuser, DiffuserZone};
use skyduct::scene::EstimateKind::{self, CellAverage, Point};
use skyduct::scene::{Grid, Scene, Segment, Tube, TubeShape};
use skyduct::sky::Sun;

use super::super::row::{Mirrors, Row};
use crate::scenes::{SIDE, cube, daylight, disc_room, lambertian, specular, straight};

/// Light tracing judges the others, and the deterministic solver judges it.
const SOLVED: &[&str] = &["light_tracing", "holigilm"];

fn mixed(inner: DiffuserZone) -> Diffuser {
    Diffuser::Mixed {
        lambertian_radius_m: 0.07,
        inner,
        lambertian_transmittance: [0.6; 3],
        lambertian_reflectance: [0.2; 3],
        clear_transmittance: [0.9; 3],
    }
}

fn room(tubes: Vec<Tube>, sun_lux: f64, estimate: EstimateKind) -> Row {
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(12, 4000.0, 50.0, 200.0), estimate);
    scene.grids = vec![Grid::new("plane".into(), 0.8, [4, 3], 0.1, [SIDE, SIDE], estimate)];
    if sun_lux > 0.0 {
        let daylight = scene.daylight.as_mut().unwrap();
        let direction = daylight.sky.as_ref().unwrap().distribution.sun();
        daylight.sun = Some(Sun { direction, normal_illuminance_lux: sun_lux });
    }
    Row::new(scene).stored(SOLVED)
}

fn two_mixed() -> Vec<Tube> {
    let second = Tube { centre: DVec2::new(0.4, 1.4), ..straight(0.4, 0.95, mixed(DiffuserZone::Clear)) };
    vec![straight(0.8, 0.97, mixed(DiffuserZone::Lambertian)), second]
}

fn bend() -> Tube {
    let mut tube = straight(0.6, 0.98, lambertian(0.6, 0.3));
    if let TubeShape::Cylinders(cylinders) = &mut tube.shape {
        cylinders.segments.push(Segment { length_m: 0.5, tilt: 0.8, azimuth: 1.0 });
    }
    tube
}

pub fn two_mixed_dim_sun_points() -> Row {
    room(two_mixed(), 5_000.0, Point).work(2.0)
}

pub fn two_mixed_dim_sun_cells() -> Row {
    room(two_mixed(), 5_000.0, CellAverage)
}

pub fn below_a_bend_points() -> Row {
    room(vec![bend()], 0.0, Point)
}

pub fn below_a_bend_sun_cells() -> Row {
    room(vec![bend()], 40_000.0, CellAverage)
}

pub fn short_tube_bright_sun_points() -> Row {
    room(vec![straight(0.3, 0.98, lambertian(0.6, 0.3))], 80_000.0, Point)
}

/// The disc room with one glossy wall or mirror.
fn wall(diffuse: f64, reflectance: f64, roughness: f64, estimate: EstimateKind) -> Scene {
    let mut scene = disc_room(0.3, 0.4, 0.6, 0.3, estimate);
    scene.room.enclosure.paint(skyduct::scene::Face::East as usize, Some(specular(diffuse, reflectance, roughness)));
    scene.grids = vec![Grid::new("grid".into(), 0.4, [4, 4], 0.2, [SIDE, SIDE], estimate)];
    scene
}

pub fn glossy_wall_cells() -> Row {
    Row::new(wall(0.2, 0.6, 0.5, CellAverage))
}

pub fn glossy_wall_points() -> Row {
    Row::new(wall(0.0, 0.8, 0.8, Point))
}

pub fn mirror_wall_cells() -> Row {
    Row::new(wall(0.1, 0.8, 0.0, CellAverage)).mirrors(Mirrors::LeftOut)
}

/// More sensors than a vertex of a path is connected to.
pub fn large_grid_points() -> Row {
    let mut scene = disc_room(0.2, 0.5, 0.7, 0.7, Point);
    scene.grids = vec![Grid::new("grid".into(), 0.5, [36, 30], 0.0, [SIDE, SIDE], Point)];
    Row::new(scene).stored(SOLVED)
}

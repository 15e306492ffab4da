//! Rooms that are no boxes, against an independent path tracer over triangles (`reference/rooms`).

use glam::{DVec2, DVec3};
use skyduct::geometry::TriangleMesh;
use skyduct::optics::Surface;
use skyduct::scene::prism::{CeilingPlane, KindSurfaces};
use skyduct::scene::{Enclosure, EstimateKind, Grid, Luminaire, MeshObject, Scene, Sensor, Tube};

use super::super::row::{Row, Values};
use crate::judge::{Measured, Whole};
use crate::reference::{self, number};
use crate::scenes::{cube, daylight, lambertian, straight};

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

/// A row with level grids of points that the oracle has, or with all of its sensors.
fn row(name: &str, mut scene: Scene, level: Vec<Grid>) -> Row {
    let lit = lit(name);
    scene.grids = match level.is_empty() {
        true => vec![Grid::points("sensors".into(), lit.iter().map(|lit| lit.sensor).collect())],
        false => level,
    };
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

/// A pipe that loses nothing under a uniform sky of 10 000 lx: its closure is a disc of even exitance.
fn tube(centre: DVec2, diameter_m: f64, transmittance: f64, enclosure: &Enclosure, drop_m: f64) -> Tube {
    let face = enclosure.ceiling_above(centre).unwrap();
    Tube {
        face,
        drop_m,
        centre,
        opening_radius: 0.5 * diameter_m,
        ..straight(1.0, 1.0, lambertian(transmittance, 0.0))
    }
}

fn surfaces(floor: f64, walls: f64, ceiling: f64) -> KindSurfaces {
    let [floor, walls, ceiling] = [floor, walls, ceiling].map(|reflectance| Some(Surface::diffuse([reflectance; 3])));
    KindSurfaces { floor, walls, ceiling }
}

fn scene(enclosure: Enclosure, tubes: Vec<Tube>) -> Scene {
    let sky = daylight(5, 10_000.0 / std::f64::consts::PI, 45.0, 180.0);
    let mut scene = cube(0.0, 0.0, 0.0, tubes, sky, EstimateKind::Point);
    scene.room.enclosure = enclosure;
    scene
}

fn corners<const N: usize>(corners: [[f64; 2]; N]) -> Vec<DVec2> {
    corners.map(DVec2::from).into()
}

/// An L-shaped hall: neither tube lights all of it straight.
fn l_hall() -> Scene {
    let outline = corners([[0.0, 0.0], [8.0, 0.0], [8.0, 3.0], [4.0, 3.0], [4.0, 6.0], [0.0, 6.0]]);
    let enclosure = Enclosure::prism(&[outline], 1e-9, &[CeilingPlane::flat(2.7)], surfaces(0.2, 0.5, 0.7)).unwrap();
    let at = |x, y| tube(DVec2::new(x, y), 0.35, 0.6, &enclosure, 0.0);
    let tubes = vec![at(2.0, 4.5), at(6.0, 1.5)];
    scene(enclosure, tubes)
}

/// An attic: a ceiling sloped by 35 degrees, an opening that hangs, a luminaire in the slope.
fn attic() -> Scene {
    let slope = 35f64.to_radians().tan();
    let ceiling = CeilingPlane { height_m: 2.2, rise: DVec2::new(0.0, slope) };
    let outline = corners([[0.0, 0.0], [5.0, 0.0], [5.0, 4.0], [0.0, 4.0]]);
    let enclosure = Enclosure::prism(&[outline], 1e-9, &[ceiling], surfaces(0.3, 0.6, 0.8)).unwrap();
    let tubes = vec![tube(DVec2::new(2.5, 2.0), 0.35, 0.7, &enclosure, 0.700_415_076)];
    let mut scene = scene(enclosure, tubes);
    let along = 0.327_660_817_715_596_74;
    scene.room.luminaires.push(Luminaire {
        corner: DVec3::new(2.3, 3.0, 2.2 + 3.0 * slope),
        edge_u: DVec3::new(0.0, along, along * slope),
        edge_v: DVec3::new(0.4, 0.0, 0.0),
        luminance: [2_984.155_182_973_038; 3],
    });
    scene
}

/// A skew room with a core from floor to ceiling, a partition and one dark wall.
fn skew() -> Scene {
    let outline = corners([[0.0, 0.0], [6.0, 0.0], [5.2, 4.0], [0.8, 5.0]]);
    let core = corners([[2.5, 1.5], [3.1, 1.5], [3.1, 2.1], [2.5, 2.1]]);
    let ceiling = [CeilingPlane::flat(3.0)];
    let mut enclosure = Enclosure::prism(&[outline, core], 1e-9, &ceiling, surfaces(0.25, 0.55, 0.75)).unwrap();
    let wall = enclosure.faces().iter().position(|face| face.name == "wall_2").unwrap();
    enclosure.paint(wall, Some(Surface::diffuse([0.1; 3])));
    let tubes = vec![tube(DVec2::new(4.2, 2.8), 0.53, 0.6, &enclosure, 0.0)];
    let mut scene = scene(enclosure, tubes);
    let partition = [[1.5, 0.5, 0.0], [1.5, 2.5, 0.0], [1.5, 2.5, 1.8], [1.5, 0.5, 1.8]];
    let mesh = TriangleMesh {
        positions: partition.map(DVec3::from).into(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0; 2],
        materials: vec![String::new()],
        ..TriangleMesh::default()
    };
    scene.room.meshes.push(MeshObject { mesh, surfaces: vec![Surface::diffuse([0.4; 3])] });
    scene
}

pub fn l_hall_points() -> Row {
    let north = Grid::new("north".into(), 0.85, [4, 3], 0.0, [4.0, 3.0], EstimateKind::Point);
    let south = Grid::new("south".into(), 0.85, [8, 3], 0.0, [8.0, 3.0], EstimateKind::Point);
    row("L_hall", l_hall(), vec![south, Grid { y_m: vec![3.5, 4.5, 5.5], ..north }])
}

pub fn attic_points() -> Row {
    row("attic", attic(), vec![Grid::new("desk".into(), 0.85, [5, 4], 0.0, [5.0, 4.0], EstimateKind::Point)])
}

pub fn l_hall_sensors() -> Row {
    row("L_hall", l_hall(), Vec::new())
}

pub fn attic_sensors() -> Row {
    row("attic", attic(), Vec::new())
}

pub fn skew_sensors() -> Row {
    row("skew", skew(), Vec::new())
}

//! Point sensors too near to a surface or an opening for connections.

use glam::DVec3;

use crate::integrator::method::{Refusal, RefusalCode};
use crate::scene::{EstimateKind, Grid};
use crate::traceable::{TraceableScene, TraceableTube};

/// Share of the room's shortest edge within which a surface or an opening is too near to a point sensor.
const NEAR_SURFACE: f64 = 0.01;

/// Share of an opening's radius within which it is too near to connect its points: of each connection the variance is 33 times the
/// square of the mean there, and rises as one over the squared distance.
const NEAR_OPENING: f64 = 0.1;

/// Reason why the standard error of point sensors would not tell the truth, if so: near a surface that rises above them, and near an
/// opening, connections are rare and bright, the square of the distance over the area per photon being small. The reason names the
/// nearest of these sensors.
pub fn dishonest_points(scene: &TraceableScene, grids: &[Grid]) -> Option<Refusal> {
    refusal_of_nearest(close_points(scene, grids), grids)
}

/// The point sensors too near to a surface or an opening: number of the grid, and of the sensor in it.
pub fn close_sensors<'a>(scene: &'a TraceableScene, grids: &'a [Grid]) -> impl Iterator<Item = (usize, usize)> + 'a {
    close_points(scene, grids).map(|ClosePoint { place, .. }| (place.grid, place.sensor))
}

fn refusal_of_nearest(close: impl Iterator<Item = ClosePoint>, grids: &[Grid]) -> Option<Refusal> {
    let ClosePoint { distance, near, surface, place } = close.min_by(|a, b| a.distance.total_cmp(&b.distance))?;
    let grid = &grids[place.grid];
    let (row, column) = (place.sensor / grid.cells[0], place.sensor % grid.cells[0]);
    let (than, or) = match surface {
        OPENING => (OPENING, " or a tenth of its radius"),
        _ => ("a surface", ""),
    };
    let detail = format!(
        "connections to point sensors nearer to {than} than 1 % of the room's shortest edge{or} ({near:.3e} m) are rare and \
         bright, and the sensor in row {row}, column {column} (from 0, south-west) of the grid {:?} is {distance:.3e} m \
         from {surface}",
        grid.name
    );
    Some(Refusal::new(RefusalCode::PointsNearSurfaces, detail))
}

/// Sine of the slope below which a face is a wall.
const LEVEL: f64 = 0.1;

const OPENING: &str = "an opening";

/// A point sensor too near to something.
struct ClosePoint {
    /// In m.
    distance: f64,
    /// Distance in m from which on it would be far enough.
    near: f64,
    /// Name of the surface that it is near to.
    surface: &'static str,
    place: SensorPlace,
}

/// A sensor of a grid: number of the grid, and of the sensor in it.
#[derive(Clone, Copy, Debug)]
struct SensorPlace {
    grid: usize,
    sensor: usize,
}

/// The point sensors that lie in no solid.
fn points(grids: &[Grid]) -> impl Iterator<Item = (SensorPlace, DVec3)> {
    let of_points = grids.iter().enumerate().filter(|(_, grid)| grid.estimate == EstimateKind::Point);
    of_points.flat_map(|(number, grid)| {
        let free = (0..grid.len()).filter(|sensor| !grid.is_inside(*sensor));
        free.map(move |sensor| (SensorPlace { grid: number, sensor }, grid.centre(sensor)))
    })
}

/// True if a point sensor is nearer than `near` m to a surface that rises above it.
pub fn points_nearer_than(scene: &TraceableScene, grids: &[Grid], near: f64) -> bool {
    points(grids).any(|(_, point)| distance_to_surface(scene, point, near).is_some())
}

/// Point sensors too near to a surface or an opening.
fn close_points<'a>(scene: &'a TraceableScene, grids: &'a [Grid]) -> impl Iterator<Item = ClosePoint> + 'a {
    let near = NEAR_SURFACE * scene.enclosure.shortest_edge_m();
    points(grids).filter_map(move |(place, point)| {
        let to_surface = distance_to_surface(scene, point, near);
        let to_surface = to_surface.map(|(distance, surface)| ClosePoint { distance, near, surface, place });
        to_surface.or_else(|| close_to_opening(scene, place, point))
    })
}

/// The opening that a point is too near to, if it is to one.
fn close_to_opening(scene: &TraceableScene, place: SensorPlace, point: DVec3) -> Option<ClosePoint> {
    let close = scene.tubes.iter().filter(|tube| is_near_opening(scene, tube, point)).map(|tube| {
        let (distance, near) = (tube.distance_to_opening(point), opening_reach(scene, tube));
        ClosePoint { distance, near, surface: OPENING, place }
    });
    close.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// True if a point is so near to an opening that its light must be found by directions, not by points of it.
#[inline]
pub fn is_near_opening(scene: &TraceableScene, tube: &TraceableTube, point: DVec3) -> bool {
    tube.distance_to_opening(point) < opening_reach(scene, tube)
}

fn opening_reach(scene: &TraceableScene, tube: &TraceableTube) -> f64 {
    f64::max(NEAR_SURFACE * scene.enclosure.shortest_edge_m(), NEAR_OPENING * tube.opening_radius)
}

/// Distance in metres of a point to the nearest surface that rises above it and that photons may be connected from, and what
/// it is; `None` where that is farther than `near`.
pub fn distance_to_surface(scene: &TraceableScene, point: DVec3, near: f64) -> Option<(f64, &'static str)> {
    let mut found = Vec::new();
    if scene.interreflection {
        let rising = scene.enclosure.polygons.iter().filter(|face| face.bounds()[1].z > point.z);
        found.extend(rising.map(|face| {
            let is_wall = face.normal().z.abs() < LEVEL;
            (face.distance(point), if is_wall { "a wall" } else { "the ceiling" })
        }));
        let outside = scene.boxes.iter().filter(|object| !object.contains(point));
        found.extend(outside.map(|object| (object.distance_beside(point), "a box")));
        // a grid may lie on a mesh
        let level = scene.coinciding();
        let meshes = scene.meshes.as_ref().and_then(|meshes| meshes.distance_beside(point, level, near));
        found.extend(meshes.map(|distance| (distance, "a mesh")));
    }
    // without anything in between their light has a closed form
    if scene.luminaires_obstructed {
        let luminaires = scene.luminaires.iter().filter(|luminaire| luminaire.emits());
        found.extend(luminaires.map(|luminaire| (luminaire.distance_beside(point), "a luminaire")));
    }
    found.into_iter().filter(|(distance, _)| *distance < near).min_by(|a, b| a.0.total_cmp(&b.0))
}

//! Point sensors that are too near to a surface or an opening to be estimated by connections.

use glam::DVec3;

use crate::integrator::method::{Refusal, RefusalCode};
use crate::scene::{EstimateKind, Grid};
use crate::traceable::{TraceableScene, TraceableTube};

/// Distance to a surface or an opening, as a fraction of the room's shortest edge, below which a point sensor is too near to it.
const NEAR_SURFACE: f64 = 0.01;

/// Distance to an opening, as a fraction of its radius, below which connections to its points are too noisy: at this distance the variance
/// of each connection is 33 times the square of the mean, and it rises as one over the squared distance.
const NEAR_OPENING: f64 = 0.1;

/// Returns the reason why point sensors would get a misleading standard error, or `None`. Near a surface that rises above them, and near an
/// opening, connections are rare and bright, because the squared distance is small against the area per photon. The reason names the sensor
/// that is nearest to a surface or opening.
pub fn dishonest_points(scene: &TraceableScene, grids: &[Grid]) -> Option<Refusal> {
    refusal_of_nearest(close_points(scene, grids), grids)
}

/// Returns the point sensors that are too near to a surface or an opening: the number of the grid, and of the sensor in it.
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
        "connections to point sensors nearer to {than} than 1 % of the room's shortest edge{or} ({near:.3e} m) are \
         rare and very bright, so that the standard error is too small, and the sensor in row {row}, column {column} \
         (from 0, south-west) of the grid {:?} is {distance:.3e} m from {surface}",
        grid.name
    );
    Some(Refusal::new(RefusalCode::PointsNearSurfaces, detail))
}

/// Largest |z| of a face's unit normal at which the face is called a wall, not the ceiling.
const LEVEL: f64 = 0.1;

const OPENING: &str = "an opening";

/// Point sensor that is too near to a surface or an opening.
struct ClosePoint {
    /// Distance to the surface or opening in m.
    distance: f64,
    /// Distance in m from which on a sensor is far enough.
    near: f64,
    /// Name of the surface or opening, for the message.
    surface: &'static str,
    place: SensorPlace,
}

/// Sensor of a grid: number of the grid, and of the sensor in it.
#[derive(Clone, Copy, Debug)]
struct SensorPlace {
    grid: usize,
    sensor: usize,
}

/// Returns the point sensors that lie in no solid, with their positions in m.
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

/// Returns the point sensors that are too near to a surface or an opening, with their distances.
fn close_points<'a>(scene: &'a TraceableScene, grids: &'a [Grid]) -> impl Iterator<Item = ClosePoint> + 'a {
    let near = NEAR_SURFACE * scene.enclosure.shortest_edge_m();
    points(grids).filter_map(move |(place, point)| {
        let to_surface = distance_to_surface(scene, point, near);
        let to_surface = to_surface.map(|(distance, surface)| ClosePoint { distance, near, surface, place });
        to_surface.or_else(|| close_to_opening(scene, place, point))
    })
}

/// Returns the nearest opening that a point is too near to, if there is one.
fn close_to_opening(scene: &TraceableScene, place: SensorPlace, point: DVec3) -> Option<ClosePoint> {
    let close = scene.tubes.iter().filter(|tube| is_near_opening(scene, tube, point)).map(|tube| {
        let (distance, near) = (tube.distance_to_opening(point), opening_reach(scene, tube));
        ClosePoint { distance, near, surface: OPENING, place }
    });
    close.min_by(|a, b| a.distance.total_cmp(&b.distance))
}

/// True if a point is so near to an opening that its light must be estimated by sampled directions, not by connections to points of the
/// opening.
#[inline]
pub fn is_near_opening(scene: &TraceableScene, tube: &TraceableTube, point: DVec3) -> bool {
    tube.distance_to_opening(point) < opening_reach(scene, tube)
}

fn opening_reach(scene: &TraceableScene, tube: &TraceableTube) -> f64 {
    f64::max(NEAR_SURFACE * scene.enclosure.shortest_edge_m(), NEAR_OPENING * tube.opening.outer_radius())
}

/// Returns the distance in metres from a point to the nearest surface that rises above it and from which photons may be connected, and the
/// name of the surface; `None` if that distance is `near` or more.
pub fn distance_to_surface(scene: &TraceableScene, point: DVec3, near: f64) -> Option<(f64, &'static str)> {
    let mut found = Vec::new();
    if scene.interreflection {
        let rising = scene.enclosure.polygons.iter().filter(|face| face.bounds()[1].z > point.z);
        found.extend(rising.map(|face| {
            let is_wall = face.normal().z.abs() < LEVEL;
            (face.distance(point), if is_wall { "a wall" } else { "the ceiling" })
        }));
        let outside = scene.boxes.iter().filter(|object| !object.contains(point));
        found.extend(outside.map(|object| (object.horizontal_distance(point), "a box")));
        // a grid may lie on a mesh
        let level = scene.coinciding();
        let meshes = scene.meshes.as_ref().and_then(|meshes| meshes.horizontal_distance(point, level, near));
        found.extend(meshes.map(|distance| (distance, "a mesh")));
    }
    // without anything in between their light has a closed form
    if scene.luminaires_obstructed {
        let luminaires = scene.luminaires.iter().filter(|luminaire| luminaire.emits());
        found.extend(luminaires.map(|luminaire| (luminaire.horizontal_distance(point), "a luminaire")));
    }
    found.into_iter().filter(|(distance, _)| *distance < near).min_by(|a, b| a.0.total_cmp(&b.0))
}

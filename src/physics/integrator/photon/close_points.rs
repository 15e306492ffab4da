//! Point sensors that are too near to a surface or an opening to be estimated by connections.

use glam::DVec3;

use super::nearness::{distance_to_surface, is_near_opening, opening_reach, surface_reach};
use crate::integrator::method::{Refusal, RefusalCode};
use crate::scene::{EstimateKind, Grid};
use crate::traceable::TraceableScene;

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
    let near = surface_reach(scene);
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

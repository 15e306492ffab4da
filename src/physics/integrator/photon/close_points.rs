//! Point sensors too near to a surface for connections.

use glam::DVec3;

use crate::integrator::method::{Refusal, RefusalCode};
use crate::integrator::some_sensors::SensorPlace;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::TraceableScene;

/// Share of the room's shortest edge within which a surface is too near to a point sensor.
const NEAR_SURFACE: f64 = 0.01;

/// Reason why the standard error of point sensors would not tell the truth, if so: near a surface that rises above them
/// connections are rare and bright, the square of the distance over the area per photon being small. The reason names the
/// nearest of these sensors.
pub fn dishonest_points(scene: &TraceableScene, grids: &[Grid]) -> Option<Refusal> {
    let near = NEAR_SURFACE * scene.size.min_element();
    let (distance, surface, place) = close_points(scene, grids).min_by(|a, b| a.0.total_cmp(&b.0))?;
    let SensorPlace { grid, sensor } = place;
    let grid = &grids[grid];
    let (row, column) = (sensor / grid.cells[0], sensor % grid.cells[0]);
    let detail = format!(
        "connections to point sensors nearer to a surface than 1 % of the room's shortest edge ({near:.3e} m) are rare and \
         bright, and the sensor in row {row}, column {column} (from 0, south-west) of the grid {:?} is {distance:.3e} m \
         from {surface}",
        grid.name
    );
    Some(Refusal::new(RefusalCode::PointsNearSurfaces, detail))
}

/// The point sensors for which [`dishonest_points`] gives a reason.
pub fn near_surfaces(scene: &TraceableScene, grids: &[Grid]) -> Vec<SensorPlace> {
    close_points(scene, grids).map(|(.., place)| place).collect()
}

/// Point sensors too near to a surface: the distance in metres, what it is near to, and the sensor.
fn close_points<'a>(
    scene: &'a TraceableScene,
    grids: &'a [Grid],
) -> impl Iterator<Item = (f64, &'static str, SensorPlace)> + 'a {
    let near = NEAR_SURFACE * scene.size.min_element();
    let points = grids.iter().enumerate().filter(|(_, grid)| grid.estimate == EstimateKind::Point);
    points.flat_map(move |(number, grid)| {
        (0..grid.len()).filter(|sensor| !grid.is_inside(*sensor)).filter_map(move |sensor| {
            let (distance, surface) = distance_to_surface(scene, grid.centre(sensor), near)?;
            Some((distance, surface, SensorPlace { grid: number, sensor }))
        })
    })
}

/// Distance in metres of a point to the nearest surface that rises above it and that photons may be connected from, and what
/// it is; `None` where that is farther than `near`.
pub fn distance_to_surface(scene: &TraceableScene, point: DVec3, near: f64) -> Option<(f64, &'static str)> {
    let mut found = Vec::new();
    if scene.interreflection {
        found.push((point.truncate().min(scene.size.truncate() - point.truncate()).min_element(), "a wall"));
        found.push((scene.size.z - point.z, "the ceiling"));
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

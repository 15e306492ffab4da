//! Distances of points to surfaces and openings below which connections to photons are too noisy.

use glam::DVec3;

use crate::traceable::{TraceableScene, TraceableTube};

/// Distance to a surface or an opening, as a fraction of the room's shortest edge, below which a point sensor is too near to it.
const NEAR_SURFACE: f64 = 0.01;

/// Distance to an opening, as a fraction of its radius, below which connections to its points are too noisy: at this distance the variance
/// of each connection is 33 times the square of the mean, and it rises as one over the squared distance.
const NEAR_OPENING: f64 = 0.1;

/// Largest |z| of a face's unit normal at which the face is called a wall, not the ceiling.
const LEVEL: f64 = 0.1;

/// Returns the distance in m to a surface below which a point is too near to it.
pub fn surface_reach(scene: &TraceableScene) -> f64 {
    NEAR_SURFACE * scene.enclosure.shortest_edge_m()
}

/// True if a point is so near to an opening that its light must be estimated by sampled directions, not by connections to points of the
/// opening.
#[inline]
pub fn is_near_opening(scene: &TraceableScene, tube: &TraceableTube, point: DVec3) -> bool {
    tube.distance_to_opening(point) < opening_reach(scene, tube)
}

/// Returns the distance in m to an opening below which a point is too near to it.
pub fn opening_reach(scene: &TraceableScene, tube: &TraceableTube) -> f64 {
    f64::max(surface_reach(scene), NEAR_OPENING * tube.opening.outer_radius())
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

//! What light tracing cannot compute, or other methods compute better.

use glam::DVec3;

use crate::guide::Guide;
use crate::integrator::method::{Refusal, RefusalCode};
use crate::optics::SurfaceOptics;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::TraceableScene;

/// Share of the room's shortest edge within which a surface is too near to a point sensor.
const NEAR_SURFACE: f64 = 0.01;

/// Reason why another method serves point sensors of a scene better, if one does.
pub fn noisy_points(scene: &TraceableScene) -> Option<&'static str> {
    let narrow = scene.interreflection && scene.specular_surfaces().any(SurfaceOptics::is_narrow);
    narrow.then_some("connections of point sensors to glossy surfaces of roughness below 0.2 are rare and bright")
}

/// Reason why the standard error of point sensors would not tell the truth, if so: near a reflecting surface
/// connections are rare and bright, the square of the distance over the area per photon being small. Meshes are not
/// looked at.
pub fn dishonest_points(scene: &TraceableScene, grids: &[Grid]) -> Option<Refusal> {
    let near = NEAR_SURFACE * scene.size.min_element();
    let close = |point: DVec3| {
        let to_walls = point.truncate().min(scene.size.truncate() - point.truncate()).min_element();
        let outside = || scene.boxes.iter().filter(|object| !object.contains(point));
        to_walls.min(scene.size.z - point.z) < near || outside().any(|object| object.distance_beside(point) < near)
    };
    let points = grids
        .iter()
        .filter(|grid| grid.estimate == EstimateKind::Point)
        .flat_map(|grid| (0..grid.len()).map(|sensor| grid.centre(sensor)));
    let found = scene.interreflection && points.into_iter().any(close);
    let detail = "connections to point sensors nearer to a wall, the ceiling or a box than 1 % of the room's shortest edge \
                  are rare and bright";
    found.then(|| Refusal::new(RefusalCode::PointsNearSurfaces, detail))
}

/// Reason why this method cannot compute point sensors of a scene, if it cannot: no vertex of a mirror can be
/// connected; in a tube that is not straight or has a dielectric dome, light that passes the closure unscattered is
/// followed backward into the sky only.
pub fn refuses_points(scene: &TraceableScene) -> Option<Refusal> {
    let bent_and_clear = scene.tubes.iter().any(|tube| {
        !matches!(tube.guide, Guide::Straight(_)) && tube.diffuser.specular_zone(tube.opening_radius).is_some()
    });
    let (code, detail) = if scene.interreflection && scene.specular_surfaces().any(SurfaceOptics::is_mirror) {
        (RefusalCode::MirrorsAtPoints, "point sensors cannot find light that a mirror reflects")
    } else if bent_and_clear && scene.sun.is_some() {
        let detail = "point sensors cannot find the sun's beam through a clear closure of a bent, domed or meshed tube";
        (RefusalCode::ClearClosuresOfBentTubes, detail)
    } else if bent_and_clear && scene.guide_return {
        let detail = "point sensors cannot find light that a bent, domed or meshed tube with a clear closure sends back into the room";
        (RefusalCode::ClearClosuresOfBentTubes, detail)
    } else {
        return None;
    };
    Some(Refusal::new(code, detail))
}

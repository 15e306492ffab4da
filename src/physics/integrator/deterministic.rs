//! Inputs of the solvers in `analytic`, made from compiled scenes, and the refusals that all these solvers share.

use super::method::{Refusal, RefusalCode, Task};
use crate::analytic::{Installation, Tube};
use crate::optics::mirror::Mirror;
use crate::optics::{Collector, Diffuser};
use crate::scene::{Channels, Face, Grid, StraightOrBent, TubeShape};
use crate::traceable::{SurfaceId, TraceableScene, TraceableTube};

/// Extracts the room and tubes of a compiled scene, in one photopic channel.
pub fn installation(traceable: &TraceableScene, grids: &[Grid]) -> Installation {
    let tube = |tube: &TraceableTube| Tube {
        origin: tube.frame.origin,
        radius: tube.pipe_radius,
        guide: tube.guide.clone(),
        diffuser: tube.diffuser.clone(),
    };
    Installation {
        // without a horizon, all tubes that are lit have the same
        sky: traceable.tubes.iter().find_map(|tube| tube.sky.clone()),
        sun: traceable.tubes.iter().find_map(|tube| tube.sun),
        size: traceable.enclosure.extent(),
        reflectance: Face::ALL
            .map(|face| traceable.optics(SurfaceId::of_face(face)).map(|surface| surface.reflectance[0])),
        tubes: traceable.tubes.iter().map(tube).collect(),
        grids: grids.to_vec(),
        interreflection: traceable.interreflection,
        guide_return: traceable.guide_return,
    }
}

/// Returns the reason why no solver in `analytic` can compute a task, if there is one.
pub(super) fn refuses(task: &Task) -> Option<Refusal> {
    let Task { scene, traceable, .. } = task;
    let shapes = || scene.tubes.iter().filter_map(|tube| cylinders(&tube.shape));
    let by_angle = |tube: &StraightOrBent| matches!(tube.reflectance, Mirror::ByAngle(_));
    let thin =
        |collector: &Collector| matches!(collector, Collector::Open | Collector::Flat { .. } | Collector::Dome { .. });
    let (code, what) = if traceable.enclosure.as_box().is_none() {
        (RefusalCode::RoomShape, "rooms that are not boxes")
    } else if traceable.tubes.iter().any(|tube| tube.hangs) {
        (RefusalCode::RoomShape, "openings that hang below the ceiling")
    } else if traceable.tubes.iter().any(|tube| !tube.frame.is_level()) {
        (RefusalCode::RoomShape, "openings that are not level")
    } else if scene.grids.iter().any(|grid| (0..grid.len()).any(|sensor| grid.is_cut(sensor))) {
        (RefusalCode::RoomShape, "means over cells that walls cut")
    } else if traceable.tubes.iter().any(|tube| tube.opening.disc().is_none()) {
        (RefusalCode::SquareClosures, "square closures")
    } else if scene.channels != Channels::Photopic {
        (RefusalCode::Colours, "coefficients given as red, green, blue")
    } else if scene.tubes.iter().any(|tube| cylinders(&tube.shape).is_none()) {
        // meshes recognised as cylinders too: the formulae take their lengths from the document
        (RefusalCode::MeshTubes, "tubes given as meshes")
    } else if !traceable.boxes.is_empty() || traceable.meshes.is_some() {
        (RefusalCode::Objects, "objects in the room")
    } else if !traceable.luminaires.is_empty() {
        (RefusalCode::Luminaires, "luminaires")
    } else if traceable.specular_surfaces().next().is_some() {
        (RefusalCode::SpecularSurfaces, "glossy and mirror surfaces")
    } else if scene.tubes.iter().any(|tube| matches!(tube.diffuser, Diffuser::Measured(_))) {
        (RefusalCode::MeasuredDiffusers, "measured diffusers")
    } else if shapes().any(by_angle) {
        (RefusalCode::MirrorsByAngle, "mirrors whose reflectance depends on the angle")
    } else if shapes().any(|tube| !thin(&tube.collector)) {
        (RefusalCode::RefractingCollectors, "collectors that bend light")
    } else if traceable.tubes.iter().any(|tube| tube.sky.as_ref().is_some_and(|sky| sky.horizon().is_some())) {
        (RefusalCode::Horizon, "a horizon above 0 degrees")
    } else {
        return None;
    };
    Some(Refusal::new(code, format!("its formulas do not cover {what}")))
}

/// Returns the cylinders of a tube; `None` if it is given as a mesh.
pub(super) fn cylinders(shape: &TubeShape) -> Option<&StraightOrBent> {
    match shape {
        TubeShape::Cylinders(cylinders) => Some(cylinders),
        TubeShape::Mesh(_) => None,
    }
}

//! Scenes for the solvers of `analytic`, and what these cannot do.

use super::Method;
use crate::analytic::holigilm::Holigilm;
use crate::analytic::jenkins::{Jenkins, Pipe};
use crate::analytic::{Installation, Solver, Tube};
use crate::guide::Guide;
use crate::optics::mirror::Mirror;
use crate::optics::{Collector, Diffuser};
use crate::scene::{Channels, EstimateKind, Face, Grid, Scene, StraightOrBent, TubeShape};
use crate::traceable::{SurfaceId, TraceableScene, TraceableTube};

/// The solver of a deterministic method; `None` for the others, and for tubes given as meshes.
///
/// `target`: relative standard error asked for.
pub fn solver(
    method: &Method,
    traceable: &TraceableScene,
    scene: &Scene,
    target: f64,
    seed: u64,
) -> Option<Box<dyn Solver>> {
    let room = installation(traceable, &scene.grids);
    match method {
        Method::Holigilm => Some(Box::new(Holigilm::new(room, target, seed))),
        Method::Jenkins(settings) => {
            let pipes: Option<Vec<Pipe>> =
                scene.tubes.iter().map(|tube| Some(pipe(cylinders(&tube.shape)?, tube.opening_radius))).collect();
            Some(Box::new(Jenkins::new(room, pipes?, settings.clone())))
        }
        _ => None,
    }
}

/// The room and tubes of a compiled scene, in one photopic channel.
pub fn installation(traceable: &TraceableScene, grids: &[Grid]) -> Installation {
    let tube = |tube: &TraceableTube| Tube {
        origin: tube.origin,
        radius: tube.opening_radius,
        guide: tube.guide.clone(),
        diffuser: tube.diffuser.clone(),
    };
    Installation {
        sky: traceable.sky.clone(),
        sun: traceable.sun,
        size: traceable.size,
        reflectance: Face::ALL
            .map(|face| traceable.optics(SurfaceId::of_face(face)).map(|surface| surface.reflectance[0])),
        tubes: traceable.tubes.iter().map(tube).collect(),
        grids: grids.to_vec(),
        interreflection: traceable.interreflection,
        guide_return: traceable.guide_return,
    }
}

/// Reason why a deterministic method cannot compute a scene, if it cannot.
pub fn refuses(method: &Method, scene: &Scene, traceable: &TraceableScene) -> Option<String> {
    let name = method.name();
    if !scene.views.is_empty() {
        return Some(format!("{name} computes grids only: use auto or sppm for views"));
    }
    let unable = |what: &str| Some(format!("not supported yet: {name} computes no {what}; use auto"));
    if scene.channels != Channels::Photopic {
        return unable("colours");
    }
    // also those that were recognised as cylinders: the formulae take their lengths from the document
    if scene.tubes.iter().any(|tube| cylinders(&tube.shape).is_none()) {
        return unable("tubes given as meshes");
    }
    if !traceable.boxes.is_empty() || traceable.meshes.is_some() {
        return unable("objects in the room");
    }
    if !traceable.luminaires.is_empty() {
        return unable("luminaires");
    }
    if traceable.specular().next().is_some() {
        return unable("glossy and mirror surfaces");
    }
    if scene.tubes.iter().any(|tube| matches!(tube.diffuser, Diffuser::Measured(_))) {
        return unable("measured diffusers");
    }
    let by_angle = |tube: &StraightOrBent| matches!(tube.reflectance, Mirror::ByAngle(_));
    if scene.tubes.iter().filter_map(|tube| cylinders(&tube.shape)).any(by_angle) {
        return unable("mirrors whose reflectance depends on the angle");
    }
    let thin =
        |collector: &Collector| matches!(collector, Collector::Open | Collector::Flat { .. } | Collector::Dome { .. });
    if scene.tubes.iter().filter_map(|tube| cylinders(&tube.shape)).any(|tube| !thin(&tube.collector)) {
        return unable("collectors that bend light");
    }
    match method {
        Method::Holigilm => refuses_holigilm(scene, traceable),
        Method::Jenkins(settings) => {
            let bends = scene.tubes.iter().filter_map(|tube| cylinders(&tube.shape)).any(|tube| bends(tube) > 0);
            if bends && settings.bend_factor.is_none() {
                Some("jenkins needs `bend_factor` for a tube with bends: no published value holds for all".into())
            } else if !traceable.interreflection && reflects(scene) {
                Some("the coefficient of jenkins holds the reflections of a room: they cannot be switched off".into())
            } else {
                None
            }
        }
        _ => None,
    }
}

fn refuses_holigilm(scene: &Scene, traceable: &TraceableScene) -> Option<String> {
    let bent_and_clear = traceable.tubes.iter().any(|tube| {
        !matches!(tube.guide, Guide::Straight(_)) && tube.diffuser.specular_zone(tube.opening_radius).is_some()
    });
    let points = scene.grids.iter().any(|grid| grid.estimate == EstimateKind::Point);
    let lossless = scene.room.surfaces.iter().all(|face| face.is_some_and(|face| face.reflectance[0] >= 1.0));
    if bent_and_clear && points && traceable.sun.is_some() {
        Some(
            "not supported yet: holigilm finds no sunlight at points through a clear closure of a bent tube; use the \
             estimate cell_average, or auto"
                .into(),
        )
    } else if bent_and_clear && traceable.guide_return && traceable.interreflection {
        Some(
            "not supported yet: holigilm does not follow light from the room that a bent tube with a clear closure \
             sends back; switch the effect guide_return off, or use auto"
                .into(),
        )
    } else if traceable.interreflection && lossless {
        Some("a room whose surfaces absorb nothing has no limit of its interreflection".into())
    } else {
        None
    }
}

fn reflects(scene: &Scene) -> bool {
    scene.room.surfaces.iter().flatten().any(|face| face.reflectance[0] > 0.0)
}

fn cylinders(shape: &TubeShape) -> Option<&StraightOrBent> {
    match shape {
        TubeShape::Cylinders(cylinders) => Some(cylinders),
        TubeShape::Mesh(_) => None,
    }
}

/// Elbows of a tube: where the axis changes its direction.
fn bends(tube: &StraightOrBent) -> u32 {
    let turned = tube
        .segments
        .windows(2)
        .filter(|pair| pair[0].tilt != pair[1].tilt || (pair[0].tilt != 0.0 && pair[0].azimuth != pair[1].azimuth));
    turned.count() as u32
}

fn pipe(tube: &StraightOrBent, radius: f64) -> Pipe {
    Pipe {
        aspect: tube.segments.iter().map(|segment| segment.length_m).sum::<f64>() / (2.0 * radius),
        bends: bends(tube),
        reflectance: tube.reflectance.reflectance(|| 1.0)[0],
        collector_transmittance: tube.collector.transmittance()[0],
    }
}

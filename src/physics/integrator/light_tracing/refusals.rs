//! Reasons why light tracing cannot compute a task, or why another method does so better.

use crate::guide::Guide;
use crate::integrator::method::{Refusal, RefusalCode};
use crate::optics::SurfaceOptics;
use crate::traceable::TraceableScene;

/// Returns the reason why another method computes point sensors of a scene better, if one does.
pub fn noisy_points(scene: &TraceableScene) -> Option<&'static str> {
    let narrow = scene.interreflection && scene.specular_surfaces().any(SurfaceOptics::is_narrow);
    narrow.then_some(
        "light tracing connects point sensors to glossy surfaces of roughness below 0.2 by rare, very bright paths",
    )
}

/// Returns the reason why this method cannot compute point sensors of a scene, if it cannot: no vertex of a mirror can be connected; in a
/// tube that is not straight and upright or has a dielectric dome, light that passes the closure unscattered is followed backward into the sky only.
pub fn refuses_points(scene: &TraceableScene) -> Option<Refusal> {
    let bent_and_clear =
        scene.tubes.iter().any(|tube| !matches!(tube.guide, Guide::Straight(_)) && tube.specular_zone().is_some());
    let (code, detail) = if scene.interreflection && scene.specular_surfaces().any(SurfaceOptics::is_mirror) {
        (RefusalCode::MirrorsAtPoints, "light tracing cannot compute light that a mirror reflects to a point sensor")
    } else if bent_and_clear && scene.has_sun() {
        let detail = "light tracing cannot compute the sun's beam that reaches a point sensor through a clear closure \
                      of a bent, leaning, domed or meshed tube";
        (RefusalCode::ClearClosuresOfBentTubes, detail)
    } else if bent_and_clear && scene.guide_return {
        let detail = "light tracing cannot compute light that a bent, leaning, domed or meshed tube with a clear closure sends \
                      back to a point sensor";
        (RefusalCode::ClearClosuresOfBentTubes, detail)
    } else {
        return None;
    };
    Some(Refusal::new(code, detail))
}

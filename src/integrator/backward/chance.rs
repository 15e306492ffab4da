//! Light that paths from sensors and eyes find by chance only: its part of the error stays unseen.

use crate::integrator::method::{Caveat, CaveatCode, Refusal, RefusalCode};
use crate::optics::SurfaceOptics;
use crate::traceable::{TraceableScene, TraceableTube};

/// Reason why paths that are followed backward cannot compute a scene, if they cannot: the sun's disc would be found by
/// chance only.
pub fn sun(scene: &TraceableScene) -> Option<Refusal> {
    scene.sun?;
    let clear = |tube: &TraceableTube| tube.diffuser.specular_zone(tube.opening_radius).is_some();
    if scene.tubes.iter().any(clear) {
        let detail = "the sun's beam through a clear closure is found by chance only";
        Some(Refusal::new(RefusalCode::SunThroughClearClosures, detail))
    } else if scene.specular_surfaces().any(SurfaceOptics::is_narrow) {
        let detail =
            "the sun's beam by way of a mirror or of a glossy surface of roughness below 0.2 is found by chance only";
        Some(Refusal::new(RefusalCode::SunByMirrors, detail))
    } else {
        None
    }
}

/// What a reader must know of the results of `method` where the room has mirrors.
pub fn mirrors(method: &str, scene: &TraceableScene) -> Option<Caveat> {
    let mirrors = scene.interreflection && scene.specular_surfaces().any(SurfaceOptics::is_mirror);
    mirrors.then(|| Caveat {
        code: CaveatCode::MirrorsByChance,
        detail: format!(
            "{method} finds a diffuser or luminaire that a mirror shows to a sensor by chance: as long as few paths have, the \
             standard error is too small; cell averages by light_tracing or bidirectional_path_tracing do not have \
             this fault"
        ),
    })
}

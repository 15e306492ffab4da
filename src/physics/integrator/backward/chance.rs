//! Light that paths from sensors and eyes find only by chance: the standard error does not include its part.

use crate::integrator::method::{Caveat, CaveatCode, Refusal, RefusalCode, Task};
use crate::optics::SurfaceOptics;
use crate::traceable::{TraceableScene, TraceableTube};

/// Returns the reason why backward paths cannot compute a scene, if they cannot: the sun's disc would be found by chance only.
pub fn sun(scene: &TraceableScene) -> Option<Refusal> {
    if !scene.has_sun() {
        return None;
    }
    let clear = |tube: &TraceableTube| tube.specular_zone().is_some();
    if scene.tubes.iter().any(clear) {
        let detail = "its paths meet the sun's beam through a clear closure only by chance";
        Some(Refusal::new(RefusalCode::SunThroughClearClosures, detail))
    } else {
        sun_by_mirrors(scene)
    }
}

/// Returns the reason why backward paths cannot compute a scene if another estimator follows the sun's beam through clear closures: mirrors
/// or narrow lobes reflect the sun.
pub fn sun_by_mirrors(scene: &TraceableScene) -> Option<Refusal> {
    if !scene.has_sun() {
        return None;
    }
    let detail = "its paths meet the sun's beam by way of a mirror, or of a glossy surface of roughness below 0.2, \
                  only by chance";
    let narrow = scene.specular_surfaces().any(SurfaceOptics::is_narrow);
    narrow.then(|| Refusal::new(RefusalCode::SunByMirrors, detail))
}

/// Returns the reason why backward paths cannot compute a scene if they end at Lambertian closures and are connected to these by plane
/// mirrors: surfaces with narrow lobes, or mirrors outside these connections, reflect the sun.
pub fn sun_by_other_mirrors(scene: &TraceableScene) -> Option<Refusal> {
    let lobes = scene.specular_surfaces().any(SurfaceOptics::has_narrow_lobe);
    if lobes || scene.mirrors.shows_more() { sun_by_mirrors(scene) } else { None }
}

/// Returns the caveat about the results of `method`, whose paths are connected to openings and luminaires by plane mirrors, if the scene
/// has mirrors for which no connection exists.
pub fn other_mirrors(method: &str, scene: &TraceableScene) -> Option<Caveat> {
    if scene.mirrors.leaves_out() { mirrors(method, scene) } else { None }
}

/// Returns the caveat about the results of `method` if the room has mirrors.
pub fn mirrors(method: &str, scene: &TraceableScene) -> Option<Caveat> {
    has_mirrors(scene).then(|| Caveat {
        code: CaveatCode::MirrorsByChance,
        detail: format!(
            "{method} finds a diffuser or luminaire that a sensor sees in a mirror only by chance: while few paths \
             have found it, the standard error is too small; light_tracing with `estimate` cell_average avoids this"
        ),
    })
}

/// Returns the caveat about cell averages by `method`, which is bidirectional, if the room has mirrors: no strategy is good for some pairs
/// of mirrors. Among three mirrors and a glossy wall 72 % of the intervals of 95 % held the truth.
pub fn mirrors_at_cells(method: &str, scene: &TraceableScene) -> Option<Caveat> {
    has_mirrors(scene).then(|| Caveat {
        code: CaveatCode::MirrorsRarely,
        detail: format!(
            "{method} finds some of the light that mirrors send to cells by rare, very bright paths: the standard \
             errors of cells between mirrors, or between a mirror and a glossy surface, are too small; light_tracing \
             avoids this"
        ),
    })
}

/// Returns the caveat about views by `method`, which is bidirectional, if the room has mirrors. In a room with a mirror box, a mirror pyramid
/// and a glossy slab one block of twenty was 6 standard errors off.
pub fn mirrors_in_views(method: &str, scene: &TraceableScene) -> Option<Caveat> {
    has_mirrors(scene).then(|| Caveat {
        code: CaveatCode::MirrorsRarely,
        detail: format!(
            "{method} finds light that mirrors cast on a surface which the eye sees in a mirror by rare, very bright paths: the \
             standard errors of these pixels are too small"
        ),
    })
}

/// Returns the caveat about views by `method`, which connects lobes of glossy surfaces to lights, but not by way of mirrors. In three rooms
/// of mirrors, glossy walls and lamps 92 to 95 % of the intervals of 95 % held the truth, and in single parts of a picture a third.
pub fn mirrors_in_gloss(method: &str, task: &Task) -> Option<Caveat> {
    let shows = |surface: &SurfaceOptics| surface.lobe().is_some();
    let is_by_chance =
        !task.views.is_empty() && has_mirrors(task.traceable) && task.traceable.specular_surfaces().any(shows);
    is_by_chance.then(|| Caveat {
        code: CaveatCode::MirrorsRarely,
        detail: format!(
            "{method} finds light that goes from a mirror by a glossy surface to the eye by rare, very bright paths: \
             the standard errors of these pixels are too small"
        ),
    })
}

fn has_mirrors(scene: &TraceableScene) -> bool {
    scene.interreflection && scene.specular_surfaces().any(SurfaceOptics::is_mirror)
}

//! Reasons why bidirectional path tracing cannot compute a task.

use crate::guide::Guide;
use crate::integrator::method::{Refusal, RefusalCode, Task};
use crate::optics::SurfaceOptics;

/// Returns the reason why the method cannot compute a task, if it cannot: the sun's disc is found by photons alone, and these end where
/// only one direction continues to the sensor or the eye.
pub fn refuses(task: &Task) -> Option<Refusal> {
    let scene = task.traceable;
    let clear_and_not_straight = || {
        let mut tubes = scene.tubes.iter();
        tubes.any(|tube| !matches!(tube.guide, Guide::Straight(_)) && tube.specular_zone().is_some())
    };
    let points = task.has_points();
    if scene.has_sun() {
        // cells see what crosses them
        let seen = |surface: &SurfaceOptics| surface.is_mirror() && task.views.is_empty() && !points;
        if scene.specular_surfaces().any(|surface| surface.is_narrow() && !seen(surface)) {
            let detail =
                "it finds the sun's light in a mirror, or in a glossy surface of roughness below 0.2, only by chance";
            return Some(Refusal::new(RefusalCode::SunByMirrors, detail));
        }
        if clear_and_not_straight() && (scene.guide_return || points) {
            let detail = "it finds the sun's light through a clear closure of a tube that is not straight and upright only by chance";
            return Some(Refusal::new(RefusalCode::SunThroughClearClosures, detail));
        }
    }
    let reflects = scene.all_optics().any(|surface| surface.gathers() || surface.is_specular());
    if !task.views.is_empty() && !scene.interreflection && reflects {
        let detail = "with interreflection off, its photons end at the first surface, before they can be connected to \
                      the eye";
        return Some(Refusal::new(RefusalCode::InterreflectionOff, detail));
    }
    None
}

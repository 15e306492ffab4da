//! How many photons of a pass go down the tubes.

use crate::guide::Guide;
use crate::integrator::pass_size::PassSize;
use crate::traceable::TraceableTube;

/// Photons for each tube of a pass: a ray through a straight guide is worth many through bends and facets, some of which turn back.
/// Errors of the flux are errors of all sensors at once: jobs that saved here would miss by much too often. Rays through domes and
/// meshes cost several times as much.
const STRAIGHT: PassSize = PassSize { for_one_percent: 64.0, growth: 1.5, fewest: 0.0, most: f64::INFINITY };
/// Even points gain little through bends: four times the photons have a third of the variance. Passes for fine answers that grew as
/// straight ones do would be too many, and each look at an error is another chance to end by one that is small by luck: jobs to 0.5 %
/// were off by more than they should in 7 %, and are in 4 %. Passes for rough answers keep what makes them few.
const BENT: PassSize = PassSize { for_one_percent: 512.0, growth: 1.85, ..STRAIGHT };
const BENT_AND_ROUGH: PassSize = PassSize { growth: STRAIGHT.growth, ..BENT };
const OF_OTHER_GUIDES: PassSize = PassSize { for_one_percent: 256.0, ..STRAIGHT };

/// True if the flux of all tubes is known well after few photons.
pub fn are_straight(tubes: &[TraceableTube]) -> bool {
    tubes.iter().all(|tube| matches!(tube.guide, Guide::Straight(_)))
}

/// Photons of a pass by which some to a dozen passes find the flux of tubes to a relative standard error `target`.
pub fn photons_for(tubes: &[TraceableTube], target: f64) -> f64 {
    let of_tube = |tube: &TraceableTube| match tube.guide {
        Guide::Straight(_) => STRAIGHT.of(target, 1.0),
        Guide::Bent(_) => BENT.of(target, 1.0).max(BENT_AND_ROUGH.of(target, 1.0)),
        Guide::Domed(_) | Guide::Mesh(_) => OF_OTHER_GUIDES.of(target, 1.0),
    };
    tubes.iter().map(of_tube).sum()
}

//! How many photons of a pass go down the tubes.

use crate::guide::Guide;
use crate::traceable::TraceableTube;

/// Photons for each tube of a pass of a job that asks for a relative standard error of 1 %: a ray through a straight guide is worth
/// many through bends and facets, some of which turn back. Errors of the flux are errors of all sensors at once: jobs that saved here
/// would miss by much too often. Rays through domes and meshes cost several times as much.
const FOR_ONE_PERCENT: f64 = 64.0;
const THROUGH_BENDS: f64 = 512.0;
const OF_OTHER_GUIDES: f64 = 256.0;

/// Power of the standard error by which they grow.
const GROWTH: f64 = 1.5;

/// True if the flux of all tubes is known well after few photons.
pub fn are_straight(tubes: &[TraceableTube]) -> bool {
    tubes.iter().all(|tube| matches!(tube.guide, Guide::Straight(_)))
}

/// Photons of a pass by which some to a dozen passes find the flux of tubes to a relative standard error `target`.
pub fn photons_for(tubes: &[TraceableTube], target: f64) -> f64 {
    let of_tube = |tube: &TraceableTube| match tube.guide {
        Guide::Straight(_) => FOR_ONE_PERCENT,
        Guide::Bent(_) => THROUGH_BENDS,
        Guide::Domed(_) | Guide::Mesh(_) => OF_OTHER_GUIDES,
    };
    tubes.iter().map(of_tube).sum::<f64>() * libm::pow(0.01 / target, GROWTH)
}

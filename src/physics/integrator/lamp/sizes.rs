//! How many photons of a pass go down the tubes.

use crate::guide::Guide;
use crate::traceable::TraceableTube;

/// Photons for each tube of a pass of a job that asks for a relative standard error of 1 %; a ray through a straight guide is worth
/// several through bends and facets.
const FOR_ONE_PERCENT: f64 = 64.0;
const OF_OTHER_GUIDES: f64 = 256.0;

/// Power of the standard error by which they grow.
const GROWTH: f64 = 1.5;

/// Photons of a pass by which some to a dozen passes find the flux of tubes to a relative standard error `target`.
pub fn photons_for(tubes: &[TraceableTube], target: f64) -> f64 {
    let of_tube = |tube: &TraceableTube| match tube.guide {
        Guide::Straight(_) => FOR_ONE_PERCENT,
        _ => OF_OTHER_GUIDES,
    };
    tubes.iter().map(of_tube).sum::<f64>() * libm::pow(0.01 / target, GROWTH)
}

//! Number of photons of a pass that go down the tubes.

use crate::guide::Guide;
use crate::integrator::pass_size::PassSize;
use crate::traceable::TraceableTube;

/// Numbers of photons for each tube of a pass: a ray through a straight guide is worth many through bends and facets, some of which turn
/// back. Errors of the flux are errors of all sensors at once: with fewer photons, jobs would miss the requested error much too often. Rays
/// through domes and meshes cost several times as much.
const STRAIGHT: PassSize = PassSize { for_one_percent: 128.0, growth: 1.5, fewest: 0.0, most: f64::INFINITY };
const BENT: PassSize = PassSize { for_one_percent: 512.0, ..STRAIGHT };
const OF_OTHER_GUIDES: PassSize = PassSize { for_one_percent: 256.0, ..STRAIGHT };

/// Returns the number of photons of a pass such that a few to a dozen passes find the light of sensors to a relative standard error
/// `target`. A sensor gets light from several tubes, whose errors are independent: each may exceed the target by the root of their number.
pub fn photons_for(tubes: &[TraceableTube], target: f64) -> f64 {
    let of_tube = |tube: &TraceableTube| match tube.guide {
        Guide::Straight(_) => STRAIGHT.of(target, 1.0),
        Guide::Bent(_) => BENT.of(target, 1.0),
        Guide::Domed(_) | Guide::Mesh(_) => OF_OTHER_GUIDES.of(target, 1.0),
    };
    tubes.iter().map(of_tube).sum::<f64>() / (tubes.len().max(1) as f64).sqrt()
}

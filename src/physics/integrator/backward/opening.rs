//! Path of a ray that meets an opening from below: up the guide into the sky, or back down.

use glam::DVec3;

use super::up_guide::upward;
use crate::guide::{End, RayCount, Transit};
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Closure, Scatter, SheetSide, Spectrum};
use crate::sampling::PathSamples;
use crate::traceable::{TraceableScene, TraceableTube};

/// Weights (MIS) of the daylight found by a ray that meets an opening.
#[derive(Clone, Copy, Debug)]
pub struct DaylightWeights {
    /// Weight of the sky that the ray finds without a return to the opening.
    pub sky: f64,
    /// Weight of the sky that the ray finds after it came back down the guide.
    pub sky_later: f64,
    /// Weight of the sun's disc.
    pub sun: f64,
}

impl DaylightWeights {
    /// Weights where other estimators count all daylight.
    pub const NONE: Self = Self { sky: 0.0, sky_later: 0.0, sun: 0.0 };

    fn is_none(self) -> bool {
        self.sky == 0.0 && self.sky_later == 0.0 && self.sun == 0.0
    }
}

/// Ray at an opening.
#[derive(Clone, Copy, Debug)]
pub struct Arriving<const C: usize> {
    pub position: DVec3,
    /// Unit vector of the path's direction, against the light.
    pub direction: DVec3,
    pub weight: Spectrum<C>,
}

/// Continuation of a path after an opening.
#[derive(Clone, Copy, Debug)]
pub enum Onward<'a, const C: usize> {
    Ends,
    /// Path straight down through a clear closure.
    Passes(Arriving<C>),
    /// Path that ends in light which the lower side of the closure scatters.
    Scatters(Arriving<C>, Closure<'a>),
}

/// Follows a ray through an opening, and returns the daylight that it finds beyond, in cd/m2 times its weight, and how the path continues;
/// `rays` counts the rays traced.
pub fn enter_tube<'a, const C: usize>(
    scene: &TraceableScene,
    tube: &'a TraceableTube,
    mut arriving: Arriving<C>,
    weights: DaylightWeights,
    samples: &mut PathSamples,
    rays: &mut RayCount,
) -> (Spectrum<C>, Onward<'a, C>) {
    let mut found = Spectrum::ZERO;
    let weights = if tube.is_daylit() { weights } else { DaylightWeights::NONE };
    let mut sky_weight = weights.sky;
    let climbs = !weights.is_none() || (scene.guide_return && tube.guide.returns_light());
    for _ in 0..MAX_EVENTS {
        let Arriving { position, direction, weight } = arriving;
        let closure = tube.closure_at(position);
        let from_below = closure.up(direction) > 0.0;
        // what goes on down into the room, and what goes up
        let (down, up, upward) = if let Some(transmittance) = closure.unscattered() {
            let weight = weight * transmittance;
            if !from_below {
                return (found, Onward::Passes(Arriving { weight, ..arriving }));
            }
            (Spectrum::ZERO, weight, direction)
        } else {
            let (above, below) =
                if from_below { (SheetSide::Other, SheetSide::Same) } else { (SheetSide::Same, SheetSide::Other) };
            let down = weight * closure.likely_albedo(-direction, below);
            match upward::<C>(tube, &closure, -direction, above, samples) {
                Some((toward, fraction)) => (down, weight * fraction, toward),
                None => (down, Spectrum::ZERO, direction),
            }
        };
        let (mut returning, mut place) = (Spectrum::ZERO, (position, direction));
        if climbs && up.max() > 0.0 {
            let transit: Transit<C> = tube.up(position, upward, &mut samples.random);
            *rays += transit.ray_count();
            let out = up * transit.weight();
            if transit.end == End::Top {
                let toward = transit.direction;
                let sky = tube.sky.as_ref().map_or(0.0, |sky| sky_weight * sky.luminance(toward));
                let sun = tube.sun.filter(|sun| weights.sun > 0.0 && toward.z > 0.0 && sun.covers(toward));
                found += out * (sky + sun.map_or(0.0, |sun| weights.sun * sun.luminance_cd_m2()));
            } else if transit.end == End::Opening && scene.guide_return {
                returning = out;
                place = (tube.frame.onto(tube.frame.origin + transit.position), transit.direction);
            }
        }
        // one of the two goes on, by roulette
        let both = returning.max() + down.max();
        let survival = (both / weight.max()).min(1.0);
        if both <= 0.0 || samples.random.uniform() >= survival {
            return (found, Onward::Ends);
        }
        let returns = returning.max() / both;
        if samples.random.uniform() >= returns {
            let weight = weight * (1.0 / (survival * (1.0 - returns)));
            return (found, Onward::Scatters(Arriving { weight, ..arriving }, closure));
        }
        let weight = returning * (1.0 / (survival * returns));
        arriving = Arriving { position: place.0, direction: place.1, weight };
        sky_weight = weights.sky_later;
    }
    (found, Onward::Ends)
}

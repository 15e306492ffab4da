//! How many photons and paths a pass has: so many that about eight passes reach the accuracy asked for, by what a small trial tells of
//! the room.

use crate::integrator::lamp::beside::photons_beside;
use crate::integrator::lamp::sizes::photons_for;
use crate::integrator::pass_size::PassSize;
use crate::sampling::power_of_two;
use crate::statistics::Moments;
use crate::traceable::TraceableTube;

/// Fewest and most photons of a pass unless the document says how many; with views the most.
const FEWEST_PHOTONS: f64 = 64.0;
const MOST_PHOTONS: f64 = 8192.0;

/// Fewest and most paths from a sensor in a pass, unless the document says how many.
const FEWEST_PATHS: f64 = 4.0;
const MOST_PATHS: f64 = 1024.0;

/// Paths from a sensor in a room of no special kind, for what is told of jobs before their rooms are tried.
pub const PATHS: PassSize = PassSize { for_one_percent: 16.0, growth: 2.0, fewest: FEWEST_PATHS, most: MOST_PATHS };

/// Paths from a sensor of which one goes on beyond the first surface, where the document says how many there are.
const PATHS_OF_ONE_BEYOND: u32 = 4;

/// Connections of a sensor to an opening that something may hide.
const PER_OPENING: PassSize = PassSize { for_one_percent: 8.0, growth: 2.0, fewest: 4.0, most: 64.0 };

/// Passes by which the accuracy is to be reached, and the share of the squared error that paths may have: Student's quantile for so few
/// passes, and errors that differ by chance, take the rest.
pub const PASSES: f64 = 8.0;
const SHARE_OF_PATHS: f64 = 0.6;

/// Power of the number of random directions from a sensor by which as good even ones grow.
const GAIN_OF_EVEN: f64 = 0.94;

/// Share of the variance of what is beyond that sensors have of their own even where they are many: patches are not equally good everywhere.
const DIFFERENT: f64 = 0.04;

/// Time that a path takes beyond its first surface, in that of its first ray.
const TIME_BEYOND: f64 = 3.0;

/// Numbers of a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sizes {
    /// Photons down the tubes.
    pub photons: u64,
    /// Paths from each sensor.
    pub per_sensor: u32,
    /// Number of these that go on beyond the first surface of which the radiosity is known.
    pub beyond: u32,
    /// Photons of an opening that something may hide to which a sensor is connected.
    pub per_opening: u32,
    /// Paths from each pixel.
    pub per_pixel: u32,
}

impl Sizes {
    /// Photons of a pass for a relative standard error `target`, or with views.
    pub fn photons(target: f64, tubes: &[TraceableTube], views: bool) -> u64 {
        let wanted = photons_for(tubes, target).max(photons_beside(tubes, target));
        power_of_two(if views { MOST_PHOTONS } else { wanted.clamp(FEWEST_PHOTONS, MOST_PHOTONS) })
    }

    /// Photons of a pass at the most, where the document does not say how many.
    pub const fn most_photons() -> f64 {
        MOST_PHOTONS
    }

    /// Connections to an opening that something may hide.
    pub fn per_opening(target: f64) -> u32 {
        PER_OPENING.of(target, 1.0).round() as u32
    }

    /// So many paths from each sensor, as a document says.
    pub fn with_paths(self, per_sensor: u32) -> Self {
        Self { per_sensor, beyond: per_sensor.div_ceil(PATHS_OF_ONE_BEYOND), ..self }
    }

    /// Sizes with as many paths as some sensors of `all` that were tried ask for.
    pub fn tried(self, target: f64, spread: Spread, all: usize) -> Self {
        // what is beyond has its part in a sensor's error as far as sensors do not measure it together
        let beyond = spread.beyond * (DIFFERENT + 1.0 / (all.max(1) as f64).sqrt()).min(1.0);
        let [known, beyond] = [spread.known, beyond].map(f64::sqrt);
        let per_error = (known + beyond * TIME_BEYOND.sqrt()) / (PASSES * SHARE_OF_PATHS * target * target);
        // even directions gain more than as many random ones
        let per_sensor = FEWEST_PATHS * libm::pow((known * per_error / FEWEST_PATHS).max(1.0), GAIN_OF_EVEN);
        let per_sensor = per_sensor.min(MOST_PATHS).round() as u32;
        let beyond = (beyond / TIME_BEYOND.sqrt() * per_error).round().clamp(1.0, f64::from(per_sensor)) as u32;
        Self { per_sensor, beyond, ..self }
    }
}

/// Variances by one path, relative to the squared illuminance of a sensor: means over some sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Variance of the part that a coarse solution tells.
    pub known: f64,
    /// Variance of the part beyond it.
    pub beyond: f64,
}

impl Spread {
    /// Computes the spread of sensors whose values in some passes of `paths` each are known; `None` if none of them is lit.
    pub fn of(sensors: impl Iterator<Item = [Moments; 2]>, paths: f64) -> Option<Self> {
        let (mut known, mut beyond) = (Moments::default(), Moments::default());
        for [of_known, of_beyond] in sensors {
            let lux = of_known.mean + of_beyond.mean;
            if lux > 0.0 {
                let relative = |moments: Moments| moments.m2 / (moments.count - 1.0) * paths / (lux * lux);
                known.push(relative(of_known));
                beyond.push(relative(of_beyond));
            }
        }
        (known.count > 0.0).then_some(Self { known: known.mean, beyond: beyond.mean })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Sizes = Sizes { photons: 64, per_sensor: 1, beyond: 1, per_opening: 4, per_pixel: 1 };

    /// By hand: 64 random directions, and four times as many for half the error, of which even ones need 4 (16)^0.94 and 4 (64)^0.94; what
    /// many sensors measure together takes fewer paths of each; bounds hold.
    #[test]
    fn paths_follow_from_what_is_tried() {
        let spread = Spread { known: 0.0064 * 4.8, beyond: 0.0 };
        let tried = |target: f64, spread: Spread, all: usize| NONE.tried(target, spread, all);
        assert_eq!([0.01, 0.005].map(|target| tried(target, spread, 81).per_sensor), [54, 199]);
        assert_eq!(tried(0.1, spread, 81), Sizes { per_sensor: 4, beyond: 1, ..NONE });
        let noisy = Spread { beyond: 0.1, ..spread };
        let [one, many] = [1, 10_000].map(|all| tried(0.02, noisy, all));
        assert!(one.beyond > 3 * many.beyond && one.per_sensor > many.per_sensor, "{one:?} {many:?}");
        assert_eq!(tried(1e-6, noisy, 1), Sizes { per_sensor: 1024, beyond: 1024, ..NONE });
    }

    /// Two passes of 8 paths at 1 and 3 lx: a variance of 2 lx2, of a path 16, over the square of 2 lx.
    #[test]
    fn spreads_are_relative_to_the_light() {
        let of = |values: [f64; 2]| {
            let mut moments = Moments::default();
            values.into_iter().for_each(|value| moments.push(value));
            moments
        };
        let lit = [of([1.0, 3.0]), of([0.0, 0.0])];
        let spread = Spread::of([lit, [Moments::default(); 2]].into_iter(), 8.0).unwrap();
        assert_eq!(spread, Spread { known: 4.0, beyond: 0.0 });
        assert_eq!(Spread::of(std::iter::once([Moments::default(); 2]), 8.0), None);
    }
}

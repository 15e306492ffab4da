//! How many photons and paths a pass has: so many that about eight passes reach the accuracy asked for, by what a small trial tells of
//! the room.

use crate::integrator::GridPass;
use crate::integrator::lamp::beside::photons_beside;
use crate::integrator::lamp::sizes::photons_for;
use crate::integrator::pass_size::PassSize;
use crate::sampling::power_of_two;
use crate::statistics::Moments;
use crate::traceable::TraceableTube;

/// Fewest and most photons of a pass unless the document says how many; with views the most.
const FEWEST_PHOTONS: f64 = 64.0;
const MOST_PHOTONS: f64 = 8192.0;
/// Most where photons bring light into the room beside the lamps, too.
const MOST_BESIDE: f64 = 65_536.0;

/// Fewest and most paths from a sensor in a pass, unless the document says how many.
const FEWEST_PATHS: f64 = 4.0;
const MOST_PATHS: f64 = 1024.0;

/// Paths from a sensor in a room of no special kind, for what is told of jobs before their rooms are tried.
pub const PATHS: PassSize = PassSize { for_one_percent: 16.0, growth: 2.0, fewest: FEWEST_PATHS, most: MOST_PATHS };

/// Paths from a sensor of which one goes on beyond the first surface, where the document says how many there are.
const PATHS_OF_ONE_BEYOND: u32 = 4;

/// Fewest and most connections of a sensor to an opening that something may hide.
const PER_OPENING: PassSize = PassSize { for_one_percent: 8.0, growth: 2.0, fewest: 4.0, most: 64.0 };
const MOST_PER_OPENING: f64 = 1024.0;

/// Passes by which the accuracy is to be reached, and the share of the squared error that paths may have: Student's quantile for so few
/// passes, and errors that differ by chance, take the rest.
pub const PASSES: f64 = 8.0;
const SHARE_OF_PATHS: f64 = 0.6;

/// Power of the number of a sensor's even directions by which the variance of what they gather falls.
const GAIN_OF_EVEN: f64 = 1.4;

/// Power of the number of even connections by which the variance of what is hidden in part falls.
const GAIN_OF_CONNECTIONS: f64 = 1.5;

/// Time of a connection, in that of a ray that ends at the first surface.
const TIME_OF_CONNECTION: f64 = 0.5;

/// Share of the variance of what is beyond that sensors have of their own even where they are many: patches are not equally good everywhere.
const DIFFERENT: f64 = 0.04;

/// Time that a path takes beyond its first surface, in that of a ray that ends there.
const TIME_BEYOND: f64 = 10.0;

/// Rays of a coarse solution in those of all passes, and how much finer than at first it gets at the most.
const SHARE_OF_PATCHES: f64 = 0.25;
const FINEST: f64 = 0.15;

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
        let of_lamps = photons_for(tubes, target).clamp(FEWEST_PHOTONS, MOST_PHOTONS);
        let beside = photons_beside(tubes, target).min(MOST_BESIDE);
        power_of_two(if views { MOST_PHOTONS } else { of_lamps.max(beside) })
    }

    /// Photons of a pass at the most, where the document does not say how many.
    pub const fn most_photons() -> f64 {
        MOST_BESIDE
    }

    /// Connections to an opening that something may hide.
    pub fn per_opening(target: f64) -> u32 {
        PER_OPENING.of(target, 1.0).round() as u32
    }

    /// So many paths from each sensor, as a document says.
    pub fn with_paths(self, per_sensor: u32) -> Self {
        Self { per_sensor, beyond: per_sensor.div_ceil(PATHS_OF_ONE_BEYOND), ..self }
    }

    /// Sizes of a small trial of how much sensors differ from pass to pass.
    pub const TRIED: Self = Self { photons: 0, per_sensor: 16, beyond: 4, per_opening: 4, per_pixel: 0 };

    /// Factor by which edges of patches are to be shorter, at most 1, so that the coarse solution, which took so many `rays`, has its share of
    /// a job of so many sensors and pixels.
    pub fn finer(self, rays: f64, (sensors, pixels): (usize, usize)) -> f64 {
        let of_sensor = f64::from(self.per_sensor) + TIME_BEYOND * f64::from(self.beyond);
        let of_pixel = f64::from(self.per_pixel) * TIME_BEYOND;
        let passes = PASSES * (of_sensor * sensors as f64 + of_pixel * pixels as f64);
        (rays / (SHARE_OF_PATCHES * passes)).sqrt().clamp(FINEST, 1.0)
    }

    /// Sizes with as many paths, connections and photons as some sensors of `all`, below so many `tubes`, that were tried ask for: of all divisions of the error between
    /// what is gathered, what is beyond and what is hidden in part, that which takes the least time.
    pub fn tried(self, target: f64, spread: Spread, (all, tubes): (usize, usize)) -> Self {
        // what is beyond has its part in a sensor's error as far as sensors do not measure it together
        let beyond = spread.beyond * (DIFFERENT + 1.0 / (all.max(1) as f64).sqrt()).min(1.0);
        let variance = PASSES * SHARE_OF_PATHS * target * target;
        let of = |part: u32| variance * f64::from(part) / f64::from(DIVISIONS);
        let divided = |[gathered, beside]: [u32; 2]| {
            let fewer = libm::pow(spread.gathered / of(gathered), 1.0 / GAIN_OF_EVEN);
            let beyond = (beyond / of(beside)).clamp(1.0, MOST_PATHS);
            let paths = (f64::from(Self::TRIED.per_sensor) * fewer).max(beyond).clamp(FEWEST_PATHS, MOST_PATHS);
            let connections = match spread.hidden {
                0.0 => 0.0,
                hidden => {
                    let fewer = libm::pow(hidden / of(DIVISIONS - gathered - beside), 1.0 / GAIN_OF_CONNECTIONS);
                    f64::from(Self::TRIED.per_opening) * fewer
                }
            };
            [paths, beyond, connections.clamp(f64::from(self.per_opening), MOST_PER_OPENING)]
        };
        let time = |[paths, beyond, connections]: &[f64; 3]| {
            paths + TIME_BEYOND * beyond + TIME_OF_CONNECTION * spread.ways * connections
        };
        let of_hidden = u32::from(spread.hidden > 0.0);
        let rest = |gathered: u32| (1..=DIVISIONS - gathered - of_hidden).map(move |beside| [gathered, beside]);
        let all = (1..DIVISIONS - of_hidden).flat_map(rest).map(divided);
        let least = all.min_by(|one, other| time(one).total_cmp(&time(other)));
        let [per_sensor, beyond, per_opening] =
            least.unwrap_or([FEWEST_PATHS, 1.0, PER_OPENING.fewest]).map(|number| number.round() as u32);
        let photons = (spread.by_one_photon / of(1) * tubes as f64).min(MOST_PHOTONS);
        Self { photons: self.photons.max(power_of_two(photons)), per_sensor, beyond, per_opening, ..self }
    }
}

/// Parts of the error that are divided.
const DIVISIONS: u32 = 16;

/// What a sensor has in some passes by the sizes of a trial, in lx.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tried {
    /// All of its light.
    pub lux: Moments,
    /// The part that surfaces reflect by the coarse solution.
    pub gathered: Moments,
    /// The part that this leaves out.
    pub beyond: Moments,
    /// The rest: light straight from its sources.
    pub straight: Moments,
    /// Variance in lx2 by what boxes hide in part, with one photon of each opening.
    pub by_one_photon: f64,
    /// Openings, luminaires and chains of mirrors to each of which it was connected by some ways.
    pub ways: f64,
}

impl Tried {
    /// Adds what a sensor has in a pass.
    pub fn push(&mut self, grid: &GridPass, sensor: usize) {
        let [lux, gathered, beyond] = [&grid.illuminance, &grid.gathered, &grid.residual].map(|values| values[sensor]);
        self.lux.push(lux);
        self.gathered.push(gathered);
        self.beyond.push(beyond);
        self.straight.push(lux - gathered - beyond);
    }
}

/// Variances relative to the squared illuminance of a sensor: means over some sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Variance of the part that is gathered, by as many paths as are tried.
    pub gathered: f64,
    /// Variance of the part beyond it, by one path.
    pub beyond: f64,
    /// Variance of what comes straight, by as many connections as are tried.
    pub hidden: f64,
    /// Openings, luminaires and chains of mirrors to each of which a sensor is connected so.
    pub ways: f64,
    /// Variance by what boxes hide in part, with one photon of each opening.
    pub by_one_photon: f64,
}

impl Spread {
    /// Computes the spread of sensors; `None` if none of them is lit.
    pub fn of(sensors: impl Iterator<Item = Tried>) -> Option<Self> {
        let [mut gathered, mut beyond, mut hidden, mut ways, mut by_one_photon] = [Moments::default(); 5];
        for tried in sensors.filter(|tried| tried.lux.mean > 0.0) {
            let relative = |moments: Moments| moments.m2 / (moments.count - 1.0) / tried.lux.mean.powi(2);
            gathered.push(relative(tried.gathered));
            beyond.push(relative(tried.beyond) * f64::from(Sizes::TRIED.beyond));
            hidden.push(relative(tried.straight));
            ways.push(tried.ways);
            by_one_photon.push(tried.by_one_photon / tried.lux.mean.powi(2));
        }
        let is_lit = gathered.count > 0.0;
        let [gathered, beyond, hidden, ways, by_one_photon] =
            [gathered, beyond, hidden, ways, by_one_photon].map(|all| all.mean);
        is_lit.then_some(Self { gathered, beyond, hidden, ways, by_one_photon })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NONE: Sizes = Sizes { photons: 64, per_sensor: 1, beyond: 1, per_opening: 4, per_pixel: 1 };

    /// By hand: 4.8 (1 %)^2 may be divided; what is gathered alone takes 15/16 of it, and (16/15)^(1/1.4) as many paths as were tried where
    /// these would have it whole; half the error takes 4^(1/1.4) as many; what many sensors measure together takes fewer paths of
    /// each; bounds hold.
    #[test]
    fn paths_follow_from_what_is_tried() {
        let spread = Spread { gathered: 4.8e-4, beyond: 0.0, hidden: 0.0, ways: 0.0, by_one_photon: 0.0 };
        let tried = |target: f64, spread: Spread, all: usize| NONE.tried(target, spread, (all, 1));
        assert_eq!([0.01, 0.005].map(|target| tried(target, spread, 81).per_sensor), [17, 45]);
        assert_eq!(tried(0.1, spread, 81), Sizes { per_sensor: 4, beyond: 1, ..NONE });
        let noisy = Spread { beyond: 0.1, ..spread };
        let [one, many] = [1, 10_000].map(|all| tried(0.02, noisy, all));
        assert!(one.beyond > 3 * many.beyond && one.per_sensor >= many.per_sensor, "{one:?} {many:?}");
        assert_eq!(tried(1e-6, noisy, 1), Sizes { per_sensor: 1024, beyond: 1024, ..NONE });
        // connections that cost nothing are many and leave the error to paths; dear ones are few
        let hidden = Spread { hidden: 4.8e-4, ways: 1e-9, ..spread };
        let [free, dear] = [hidden, Spread { ways: 40.0, ..hidden }].map(|spread| tried(0.005, spread, 81));
        assert!(free.per_opening > dear.per_opening && free.per_sensor < dear.per_sensor, "{free:?} {dear:?}");
        // by hand: a sixteenth of the error for what boxes hide in part
        let beside = tried(0.01, Spread { by_one_photon: 4.8e-4 / 16.0 * 100.0, ..spread }, 81);
        assert_eq!(beside, Sizes { photons: 128, ..tried(0.01, spread, 81) });
        assert!(dear.per_opening >= 4 && tried(0.01, spread, 81).per_opening == 4);
    }

    /// Two passes at 1 and 3 lx: a variance of 2 lx2, over the square of 2 lx; of one of four paths four times that.
    #[test]
    fn spreads_are_relative_to_the_light() {
        let of = |values: [f64; 2]| {
            let mut moments = Moments::default();
            values.into_iter().for_each(|value| moments.push(value));
            moments
        };
        let part = of([1.0, 3.0]);
        let dark = Tried { lux: of([0.0, 0.0]), ..Tried::default() };
        let by_one_photon = 8.0;
        let lit = Tried { lux: of([2.0, 2.0]), gathered: part, beyond: part, straight: part, ways: 3.0, by_one_photon };
        let spread = Spread { gathered: 0.5, beyond: 2.0, hidden: 0.5, ways: 3.0, by_one_photon: 2.0 };
        assert_eq!(Spread::of([lit, dark].into_iter()).unwrap(), spread);
        assert_eq!(Spread::of(std::iter::once(dark)), None);
    }
}

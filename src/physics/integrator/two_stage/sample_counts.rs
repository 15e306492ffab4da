//! Numbers of photons and paths of a pass, chosen from a small trial in the room so that about eight passes reach the requested accuracy.

use super::coarse::pixels;
use super::variances::{BEYOND_IN_TRIAL, GAIN_OF_EVEN, PASSES, RelativeVariances, Share};
use crate::integrator::diffuser_source::closure_source::{Beside, directional_photons};
use crate::integrator::diffuser_source::photon_counts::photons_for;
use crate::integrator::method::Task;
use crate::integrator::pass_size::PassSize;
use crate::sampling::power_of_two;
use crate::scene::Grid;

/// Fewest and most photons of a pass for grids, unless the document sets their number; with views the fewest are the most of grids.
const FEWEST_PHOTONS: f64 = 64.0;
const MOST_PHOTONS: f64 = 8192.0;
/// Most photons of a pass where they also bring light into the room beside that of Lambertian closures, or where an eye sees closures.
const MOST_DIRECTIONAL: f64 = 65_536.0;

/// Least number of pixels for each photon, and number of sensors for each of these pixels, so that the photons that an eye sees on the
/// closures, and their connections to sensors, take a few hundredths of the time of the paths from the pixels.
const PIXELS_OF_PHOTON: f64 = 16.0;
const SENSORS_OF_PIXEL: f64 = 64.0;

/// Fewest and most paths from a sensor in a pass, unless the document sets their number.
const FEWEST_PATHS: f64 = 4.0;
const MOST_PATHS: f64 = 1024.0;

/// Number of paths from a sensor in an average room, for forecasts of jobs before their rooms are tried.
pub const PATHS: PassSize = PassSize { for_one_percent: 16.0, growth: 2.0, fewest: FEWEST_PATHS, most: MOST_PATHS };

/// Number of paths from a sensor for each one that continues beyond the first surface, where the document sets the number of paths.
const PATHS_OF_ONE_BEYOND: u32 = 4;

/// Number of connections of a sensor to an opening that something may hide where no room is tried, and their largest number after a trial.
const PER_OPENING: PassSize = PassSize { for_one_percent: 8.0, growth: 2.0, fewest: 4.0, most: 64.0 };
const MOST_PER_OPENING: f64 = 1024.0;

/// Fraction of the squared error that paths may have: Student's quantile, and chance in the error estimates, take the rest. With 0.6 most
/// jobs have reached their error before the eighth pass, when grids of some dozen sensors are first judged; with 1 they take more passes,
/// which costs more.
const SHARE_OF_PATHS: f64 = 0.8;

/// Power of the number of low-discrepancy connections by which the variance of partly hidden light falls.
const GAIN_OF_CONNECTIONS: f64 = 1.5;

/// Time of a connection, in that of a ray that ends at the first surface.
const TIME_OF_CONNECTION: f64 = 0.5;

/// Time of a path beyond its first surface, in that of a ray that ends there.
pub const TIME_BEYOND: f64 = 6.0;

/// Numbers of paths and connections of the sensors of a grid in a pass.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SampleCounts {
    /// Number of paths from each sensor.
    pub per_sensor: u32,
    /// Number of these that continue beyond the first surface with a coarse solution.
    pub beyond: u32,
    /// Number of connections of a sensor to photons of an opening that something may hide.
    pub per_opening: u32,
}

impl SampleCounts {
    /// Returns the number of photons of a pass for a relative standard error `target`, or with views.
    pub fn photons(target: f64, task: &Task, beside: Beside) -> u64 {
        let tubes = &task.traceable.tubes;
        let of_lambertian = photons_for(tubes, target).clamp(FEWEST_PHOTONS, MOST_PHOTONS);
        let traced =
            if beside == Beside::Traced { directional_photons(tubes, target).min(MOST_DIRECTIONAL) } else { 0.0 };
        if task.views.is_empty() {
            return power_of_two(of_lambertian.max(traced));
        }
        let sensors: usize = task.all_grids.iter().map(Grid::len).sum();
        let of_each = PIXELS_OF_PHOTON.max(sensors as f64 / SENSORS_OF_PIXEL);
        power_of_two((pixels(task.views) as f64 / of_each).clamp(MOST_PHOTONS, MOST_DIRECTIONAL))
    }

    /// Returns the largest number of photons of a pass, where the document does not set it.
    pub const fn most_photons() -> f64 {
        MOST_DIRECTIONAL
    }

    /// Returns the number of connections to an opening that something may hide.
    fn per_opening(target: f64) -> u32 {
        PER_OPENING.of(target, 1.0).round() as u32
    }

    /// Returns the numbers for a relative standard error `target` with a number of paths from each sensor that the document sets.
    pub fn with_paths(per_sensor: u32, target: f64) -> Self {
        let beyond = per_sensor.div_ceil(PATHS_OF_ONE_BEYOND);
        Self { per_sensor, beyond, per_opening: Self::per_opening(target) }
    }

    /// Returns the numbers in an average room.
    pub fn usual(target: f64) -> Self {
        Self::with_paths(PATHS.power_of_two(target) as u32, target)
    }

    /// Numbers of a small trial of how much sensors differ from pass to pass.
    pub const TRIAL: Self = Self { per_sensor: 16, beyond: BEYOND_IN_TRIAL, per_opening: 4 };

    /// Returns the time of a pass of a sensor, in that of a ray that ends at the first surface.
    pub fn time_of_sensor(self) -> f64 {
        f64::from(self.per_sensor) + TIME_BEYOND * f64::from(self.beyond)
    }

    /// Returns the sizes for a sensor with this share of the paths.
    pub fn of_sensor(self, share: Share) -> Self {
        let of =
            |number: u32, share: f64, fewest: f64| (f64::from(number) * share).round().clamp(fewest, MOST_PATHS) as u32;
        let beyond = of(self.beyond, share.beyond, 1.0);
        Self { per_sensor: of(self.per_sensor, share.gathering, FEWEST_PATHS).max(beyond), beyond, ..self }
    }

    /// Returns the number of photons that the light of openings requires which boxes hide in part.
    pub fn photons_for_hidden(target: f64, spread: RelativeVariances, tubes: usize) -> u64 {
        power_of_two((spread.by_one_photon / part_of_variance(target, 1) * tubes as f64).min(MOST_PHOTONS))
    }

    /// Returns the numbers of paths and connections that the variances of the tried sensors, some of `all` of a grid, require: of all
    /// divisions of the squared error between gathered, residual and partly hidden light, the one that takes the least time.
    pub fn tried(target: f64, spread: RelativeVariances, all: usize) -> Self {
        let of = |part: u32| part_of_variance(target, part);
        let divided = |[gathered, residual]: [u32; 2]| {
            let fewer = libm::pow(spread.gathered / of(gathered), 1.0 / GAIN_OF_EVEN);
            let beyond = spread.beyond / spread.noise_of_residual(of(residual), all);
            let beyond = beyond.clamp(1.0, MOST_PATHS);
            let paths = (f64::from(Self::TRIAL.per_sensor) * fewer).max(beyond).clamp(FEWEST_PATHS, MOST_PATHS);
            let connections = Self::connections(spread, of(DIVISIONS - gathered - residual));
            [paths, beyond, connections]
        };
        let time = |[paths, beyond, connections]: &[f64; 3]| {
            paths + TIME_BEYOND * beyond + TIME_OF_CONNECTION * spread.hidden_sources * connections
        };
        let of_hidden = u32::from(spread.hidden + spread.missed > 0.0);
        let rest = |gathered: u32| (1..=DIVISIONS - gathered - of_hidden).map(move |residual| [gathered, residual]);
        let all = (1..DIVISIONS - of_hidden).flat_map(rest).map(divided);
        let least = all.min_by(|one, other| time(one).total_cmp(&time(other)));
        let [per_sensor, beyond, per_opening] =
            least.unwrap_or([FEWEST_PATHS, 1.0, 1.0]).map(|number| number.round() as u32);
        Self { per_sensor, beyond, per_opening }
    }

    /// Returns the number of connections, at least 1, that leave partly hidden light a relative variance of `allowed` in one pass: that of
    /// their values falls by a power of their number, and that of what all may have missed by twice this power.
    fn connections(spread: RelativeVariances, allowed: f64) -> f64 {
        let RelativeVariances { hidden, missed, .. } = spread;
        if hidden + missed <= 0.0 {
            return 1.0;
        }
        let falls_to = 2.0 * allowed / (hidden + (hidden * hidden + 4.0 * missed * allowed).sqrt());
        let number = f64::from(Self::TRIAL.per_opening) * libm::pow(falls_to, -1.0 / GAIN_OF_CONNECTIONS);
        number.clamp(1.0, MOST_PER_OPENING)
    }
}

/// Number of parts into which the squared error is divided.
const DIVISIONS: u32 = 16;

/// Returns the relative variance that some parts of the squared error leave to one pass.
fn part_of_variance(target: f64, parts: u32) -> f64 {
    PASSES * SHARE_OF_PATHS * target * target * f64::from(parts) / f64::from(DIVISIONS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks values computed by hand: 6.4 (1 %)^2 may be divided; gathered light alone takes 15/16 of it, and (16/15)^(1/1.4) as many
    /// paths as were tried, which would be enough if it had all; half the error takes 4^(1/1.4) as many; a residual that many sensors share
    /// takes fewer paths of each; bounds hold.
    #[test]
    fn paths_follow_from_what_is_tried() {
        let spread = RelativeVariances { gathered: 6.4e-4, ..RelativeVariances::default() };
        let tried = SampleCounts::tried;
        assert_eq!([0.01, 0.005].map(|target| tried(target, spread, 81).per_sensor), [17, 45]);
        assert_eq!(tried(0.1, spread, 81), SampleCounts { per_sensor: 4, beyond: 1, per_opening: 1 });
        let noisy = RelativeVariances { beyond: 0.1, ..spread };
        let [one, many] = [1, 10_000].map(|all| tried(0.02, noisy, all));
        assert!(one.beyond > 3 * many.beyond && one.per_sensor >= many.per_sensor, "{one:?} {many:?}");
        assert_eq!(tried(1e-6, noisy, 1), SampleCounts { per_sensor: 1024, beyond: 1024, per_opening: 1 });
        // connections that cost nothing are many and leave the error to paths; dear ones are few
        let hidden = RelativeVariances { hidden: 6.4e-4, hidden_sources: 1e-9, ..spread };
        let [free, dear] =
            [hidden, RelativeVariances { hidden_sources: 40.0, ..hidden }].map(|spread| tried(0.005, spread, 81));
        assert!(free.per_opening > dear.per_opening && free.per_sensor < dear.per_sensor, "{free:?} {dear:?}");
        // by hand: a sixteenth of the error for what boxes hide in part
        let by_one_photon = 6.4e-4 / 16.0 * 100.0;
        assert_eq!(SampleCounts::photons_for_hidden(0.01, RelativeVariances { by_one_photon, ..spread }, 1), 128);
    }

    /// Checks by hand that an eighth of a variance takes four times as many connections as were tried, and an eighth of what they may have
    /// missed twice as many; both together take more, and nothing takes one.
    #[test]
    fn connections_follow_from_what_is_hidden() {
        let of = |hidden: f64, missed: f64| {
            let found = RelativeVariances { hidden, missed, ..RelativeVariances::default() };
            SampleCounts::connections(found, 0.125)
        };
        assert!((of(1.0, 0.0) - 16.0).abs() < 1e-9 && (of(0.0, 1.0) - 8.0).abs() < 1e-9);
        assert!((16.0..24.0).contains(&of(1.0, 1.0)), "{}", of(1.0, 1.0));
        assert_eq!([of(0.0, 0.0), of(1e-9, 1e-9)], [1.0; 2]);
    }

    /// Checks two sensors by hand, and one without any share: each has a few paths, and of these one that continues.
    #[test]
    fn sensors_have_their_share() {
        let counts = SampleCounts { per_sensor: 20, beyond: 10, per_opening: 4 };
        let of = |gathering: f64, beyond: f64| counts.of_sensor(Share { gathering, beyond });
        assert_eq!(of(0.4, 1.6), SampleCounts { per_sensor: 16, beyond: 16, ..counts });
        assert_eq!(of(0.0, 0.0), SampleCounts { per_sensor: 4, beyond: 1, ..counts });
    }
}

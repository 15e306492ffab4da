//! Findings of a trial: variances of the parts of the light, and the shares of paths that sensors should have.

use crate::integrator::GridPass;
use crate::integrator::pass::{CAUTION, LEAST_SENSORS, remaining_noise};
use crate::statistics::Moments;

/// Number of passes in which the accuracy should be reached.
pub const PASSES: f64 = 8.0;

/// Power of the number of a sensor's low-discrepancy directions by which the variance of the gathered light falls.
pub const GAIN_OF_EVEN: f64 = 1.4;

/// Number of a sensor's paths that continue beyond the first surface in a pass of a trial.
pub const BEYOND_IN_TRIAL: u32 = 4;

/// Degrees of freedom of the mean over all sensors in the estimate of a sensor's variance, beside those of its own values.
const PRIOR: f64 = 8.0;

/// Values of a sensor in some passes by the sizes of a trial, in lx.
#[derive(Clone, Copy, Debug, Default)]
pub struct TrialValues {
    /// Illuminance by all light.
    pub lux: Moments,
    /// Illuminance to which errors are relative.
    pub scale: f64,
    /// Part that surfaces reflect by the coarse solution.
    pub gathered: Moments,
    /// Residual: the part that the coarse solution leaves out.
    pub beyond: Moments,
    /// Remaining part: light straight from its sources.
    pub straight: Moments,
    /// Variance by which residuals of sensors are expected to differ, relative to their squared gathered light; infinite where
    /// that is unknown.
    pub expected_spread: f64,
    /// Variance in lx2 by light that boxes partly hide, with one photon of each opening.
    pub by_one_photon: f64,
    /// Error in lx by obstacles that all connections of a job of such passes may have missed.
    pub missed: f64,
    /// Number of openings, luminaires and chains of mirrors to which the sensor has connections of their own.
    pub hidden_sources: f64,
}

impl TrialValues {
    /// Returns the variance of a part, relative to the squared scale, with its degrees of freedom; `None` without light.
    fn relative_variance(&self, part: Moments) -> Option<[f64; 2]> {
        let freedom = part.count - 1.0;
        (self.lux.mean > 0.0).then(|| [part.m2 / freedom / self.scale.powi(2), freedom])
    }

    /// Sets the scales of the sensors of a grid: their light, or a share of the mean where this is more.
    pub fn set_scales(sensors: &mut [Self], least_share_of_mean: f64) {
        let least =
            least_share_of_mean * sensors.iter().map(|tried| tried.lux.mean).sum::<f64>() / sensors.len().max(1) as f64;
        sensors.iter_mut().for_each(|tried| tried.scale = tried.lux.mean.max(least));
    }

    /// Adds the values of a sensor in one pass, and the light in lx that comes to it beside them.
    pub fn push(&mut self, grid: &GridPass, sensor: usize, beside: f64) {
        let [lux, gathered, beyond] = [&grid.illuminance, &grid.gathered, &grid.residual].map(|values| values[sensor]);
        self.lux.push(lux + beside);
        self.gathered.push(gathered);
        self.beyond.push(beyond);
        self.straight.push(lux - gathered - beyond);
    }
}

/// Numbers of a sensor's rays and paths, relative to their means over all sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Share {
    /// Number of all rays.
    pub gathering: f64,
    /// Number of those that continue beyond the first surface.
    pub beyond: f64,
}

impl Share {
    /// Share of a sensor that has as many as others.
    pub const EQUAL: Self = Self { gathering: 1.0, beyond: 1.0 };
}

/// Variances relative to the squared scale of a sensor: means over some sensors.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RelativeVariances {
    /// Variance of the gathered part, by the number of paths of the trial.
    pub gathered: f64,
    /// Variance of the residual, by one path.
    pub beyond: f64,
    /// Variance by which the residuals of sensors are expected to differ; not finite where that is unknown.
    pub spread: f64,
    /// Variance of the direct light, by the number of connections of the trial.
    pub hidden: f64,
    /// Variance of the direct light by obstacles that all connections of a job with those of the trial may have missed, in one pass.
    pub missed: f64,
    /// Number of openings, luminaires and chains of mirrors to which a sensor has connections of their own.
    pub hidden_sources: f64,
    /// Variance by light that boxes partly hide, with one photon of each opening.
    pub by_one_photon: f64,
}

impl RelativeVariances {
    /// Returns the variance of a sensor's residual in one pass by which the error of all passes is that of passes of this `variance`, where
    /// `sensors` share their residuals. With n sensors whose residuals differ by the spread S and have the noise y, the squared error is
    /// S y / (S + y) + y / n, with the spread that errors take for the expected one (docs/physics/statistics.md#residuals-of-a-coarse-solution). Where S is unknown, passes can show no spread
    /// below y / n^(1/2).
    pub fn noise_of_residual(&self, variance: f64, sensors: usize) -> f64 {
        if sensors < LEAST_SENSORS {
            return variance;
        }
        if !self.spread.is_finite() {
            return variance / remaining_noise(sensors);
        }
        // errors count the expected spread with caution, until passes have seen it
        let (spread, sensors) = (PASSES * CAUTION * self.spread, sensors as f64);
        let half = 0.5 * (spread * (sensors + 1.0) - variance * sensors);
        let root = (half * half + variance * sensors * spread).sqrt();
        // without cancellation
        if half > 0.0 { variance * sensors * spread / (half + root) } else { root - half }
    }

    /// Computes the spread of sensors; `None` if none of them is lit.
    pub fn of(sensors: impl IntoIterator<Item = TrialValues>) -> Option<Self> {
        let [mut gathered, mut beyond, mut spread, mut hidden, mut missed, mut hidden_sources, mut by_one_photon] =
            [Moments::default(); 7];
        for tried in sensors.into_iter().filter(|tried| tried.lux.mean > 0.0) {
            let relative = |moments: Moments| moments.m2 / (moments.count - 1.0) / tried.scale.powi(2);
            gathered.push(relative(tried.gathered));
            beyond.push(relative(tried.beyond) * f64::from(BEYOND_IN_TRIAL));
            spread.push(tried.expected_spread * (tried.gathered.mean / tried.scale).powi(2));
            hidden.push(relative(tried.straight));
            missed.push(PASSES * (tried.missed / tried.scale).powi(2));
            hidden_sources.push(tried.hidden_sources);
            by_one_photon.push(tried.by_one_photon / tried.scale.powi(2));
        }
        let is_lit = gathered.count > 0.0;
        let [gathered, beyond, spread, hidden, missed, hidden_sources, by_one_photon] =
            [gathered, beyond, spread, hidden, missed, hidden_sources, by_one_photon].map(|all| all.mean);
        is_lit.then_some(Self { gathered, beyond, spread, hidden, missed, hidden_sources, by_one_photon })
    }

    /// Divides the paths among sensors so that their squared errors have the least sum for the same time, and computes the variances by
    /// which the mean numbers follow; `None` if no sensor is lit.
    ///
    /// The variance v of a sensor's gathered light falls by the power g of its number of rays, so that numbers in proportion to
    /// v^(1/(1+g)) are best; those of paths for the residual are in proportion to v^(1/2) (Neyman 1934).
    pub fn of_shares(sensors: &[TrialValues]) -> Option<(Self, Vec<Share>)> {
        let means = Self::of(sensors.iter().copied())?;
        let of = |part: fn(&TrialValues) -> Moments, gain: f64| {
            divided(sensors.iter().map(|sensor| sensor.relative_variance(part(sensor))), 1.0 / (1.0 + gain))
        };
        let (gathered, rays) = of(|sensor| sensor.gathered, GAIN_OF_EVEN);
        let (beyond, paths) = of(|sensor| sensor.beyond, 1.0);
        let shares = rays.into_iter().zip(paths).map(|(gathering, beyond)| Share { gathering, beyond }).collect();
        Some((Self { gathered, beyond: beyond * f64::from(BEYOND_IN_TRIAL), ..means }, shares))
    }
}

/// Divides a number among sensors in proportion to a power of their variances, each given with its degrees of freedom; `None` is a sensor
/// without light, which gets the mean. Returns the power mean of the variances, and the parts relative to their mean.
fn divided(variances: impl Iterator<Item = Option<[f64; 2]>> + Clone, power: f64) -> (f64, Vec<f64>) {
    let mean = |of: &dyn Fn([f64; 2]) -> f64| {
        let mut all = Moments::default();
        variances.clone().flatten().for_each(|variance| all.push(libm::pow(of(variance), power)));
        libm::pow(all.mean, 1.0 / power)
    };
    let usual = mean(&|[variance, _]| variance);
    // a few passes tell little of one sensor
    let own = |[variance, freedom]: [f64; 2]| (freedom * variance + PRIOR * usual) / (freedom + PRIOR);
    let middle = mean(&own);
    let part = |variance| if middle > 0.0 { libm::pow(own(variance) / middle, power) } else { 1.0 };
    (middle, variances.map(|variance| variance.map_or(1.0, part)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks closed forms: residuals that do not differ are shared by all, those of few sensors by none; large differences leave each with
    /// its own noise; where many sensors differ by twice the error, their noise may be as large as that difference.
    #[test]
    fn noise_of_shared_residuals() {
        let of = |spread: f64, sensors: usize| {
            let spread = spread / (CAUTION * PASSES);
            RelativeVariances { spread, ..RelativeVariances::default() }.noise_of_residual(0.5, sensors)
        };
        assert_eq!([of(0.0, 100), of(0.0, LEAST_SENSORS - 1)], [50.0, 0.5]);
        assert!((of(1e12, 1_000_000) - 0.5).abs() < 1e-6);
        assert!((of(f64::INFINITY, 10_000) - 10.0).abs() < 1e-12);
        assert!((of(1.0, 1_000_000_000_000) - 1.0).abs() < 1e-9);
        let y = of(0.7, 81);
        assert!((0.7 * y / (0.7 + y) + y / 81.0 - 0.5).abs() < 1e-12, "{y}");
    }

    /// Checks standard deviations of 1 and 4, well known: the second sensor gets four times as many paths, and the mean number is that for
    /// a variance of (5 / 2)^2; where little is known of each, all get more nearly the same; one without light gets the mean.
    #[test]
    fn sensors_share_paths_by_their_deviation() {
        let (known, guessed) = (1e9, PRIOR);
        let of = |freedom: f64| divided([Some([1.0, freedom]), None, Some([16.0, freedom])].into_iter(), 0.5);
        let (mean, shares) = of(known);
        assert!((mean - 6.25).abs() < 1e-6, "{mean}");
        assert!(
            shares.iter().zip([0.4, 1.0, 1.6]).all(|(share, by_hand)| (share - by_hand).abs() < 1e-6),
            "{shares:?}"
        );
        // half of each variance is the power mean of both, 6.25
        let parts = [1.0, 16.0].map(|variance: f64| (0.5 * (variance + 6.25)).sqrt());
        let [low, high] = parts.map(|part| 2.0 * part / (parts[0] + parts[1]));
        let (_, shares) = of(guessed);
        assert!((shares[0] - low).abs() + (shares[2] - high).abs() < 1e-12, "{shares:?}");
        assert_eq!(divided([Some([0.0, known])].into_iter(), 0.5), (0.0, vec![1.0]));
    }

    /// Checks two passes at 1 and 3 lx: a variance of 2 lx2, over the square of 2 lx; of one of four paths four times that; an
    /// error of 0.5 lx, a quarter of that light, is eight times a sixteenth of its square in one of eight passes.
    #[test]
    fn spreads_are_relative_to_the_light() {
        let of = |values: [f64; 2]| {
            let mut moments = Moments::default();
            values.into_iter().for_each(|value| moments.push(value));
            moments
        };
        let part = of([1.0, 3.0]);
        let dark = TrialValues { lux: of([0.0, 0.0]), ..TrialValues::default() };
        let by_one_photon = 8.0;
        let lit = TrialValues {
            lux: of([2.0, 2.0]),
            scale: 2.0,
            gathered: part,
            beyond: part,
            straight: part,
            expected_spread: 0.25,
            missed: 0.5,
            hidden_sources: 3.0,
            by_one_photon,
        };
        let spread = RelativeVariances {
            gathered: 0.5,
            beyond: 2.0,
            spread: 0.25,
            hidden: 0.5,
            missed: 0.5,
            hidden_sources: 3.0,
            by_one_photon: 2.0,
        };
        assert_eq!(RelativeVariances::of([lit, dark]).unwrap(), spread);
        assert_eq!(RelativeVariances::of([dark]), None);
        // the mean of both is 1 lx, and three times that is more than either has
        let mut sensors = [lit, dark];
        TrialValues::set_scales(&mut sensors, 3.0);
        assert_eq!(sensors.map(|tried| tried.scale), [3.0, 3.0]);
    }
}

//! Illuminances of sensors as the sum of a coarse solution and a residual.
//!
//! A method that estimates most of a sensor's light by a coarse solution of the room, and the rest by few paths, reports both parts:
//! `coarse`, that of the coarse solution, has little noise, and an error that the paths of all sensors together measure; `beyond`, the
//! residual that it leaves out, is small and noisy. The residual that the sensors of a grid have in common is estimated from all their
//! paths. Only if sensors differ by more than their noise, each also counts its own residual, with the weight that gives the least error:
//! this is the estimator of James and Stein in the form of empirical Bayes (Efron and Morris 1973; Morris 1983), for relative residuals of
//! unknown mean.
//!
//! The variance tau^2 by which sensors truly differ is estimated from the mean excess of their squares over their noise: as the mean of a
//! normal distribution about that excess, with the excess' standard error, cut off below zero. So a difference too small to be seen in the
//! noise still has its part in the errors. Where the coarse solution tells how much sensors should differ, that counts, too: for all together,
//! and for each in proportion, as a sensor in a corner sees fewer patches than one in the middle of a room.
//!
//! A part of the light has the scales and weights of the whole. Then values are linear in the passes, and parts add up to the whole.
//!
//! See docs/physics/statistics.md#residuals-of-a-coarse-solution.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::integrator::GridPass;
use crate::integrator::pass::{CAUTION, LEAST_SCALE, LEAST_SENSORS, remaining_noise};
use crate::statistics::Moments;

/// Number of standard errors beyond which a spread is certain.
const CERTAIN: f64 = 2.0;

/// Illuminances of the sensors of a grid by a coarse solution, and the residuals beyond it.
#[derive(Clone, Debug, Default)]
pub struct Residuals {
    /// Illuminance in lx by the coarse solution, direct light included.
    coarse: Vec<Moments>,
    /// Illuminance in lx that the coarse solution leaves out.
    beyond: Vec<Moments>,
    /// Illuminance in lx by the coarse solution, without direct light.
    gathered: Vec<Moments>,
    /// Variance by which residuals are expected to differ, relative to the squared scale of a sensor; `None` where it is not known.
    expected_spread: Option<f64>,
    /// Ratios of the sensors' own expected variances to this mean; empty where all are 1.
    relative_spreads: Arc<[f64]>,
    pooled: Pooled,
}

/// Residual that sensors have in common.
#[derive(Clone, Debug, Default)]
pub struct Pooled {
    /// Light in lx to which the residual of each sensor is relative; 0 where no light is reflected.
    scales: Arc<[f64]>,
    /// Weight of each sensor's own residual, 0..1; empty where all are 1.
    own: Arc<[f64]>,
    /// Mean residual, relative to the scale of a sensor.
    mean: f64,
    variance_of_mean: f64,
    /// Variance of true residuals about it: mean over the sensors.
    spread: f64,
}

impl Residuals {
    /// Creates the residuals of `count` sensors, without any pass, with the variances by which they are expected to differ from the mean;
    /// none if these are not known.
    pub fn of_sensors(count: usize, expected_spreads: &[f64]) -> Self {
        let (coarse, beyond, gathered) = Default::default();
        let mut residuals = Self { coarse, beyond, gathered, ..Self::default() };
        for moments in [&mut residuals.coarse, &mut residuals.beyond, &mut residuals.gathered] {
            moments.resize(count, Moments::default());
        }
        if !expected_spreads.is_empty() {
            let mean = expected_spreads.iter().sum::<f64>() / expected_spreads.len() as f64;
            residuals.expected_spread = Some(mean);
            if mean > 0.0 {
                residuals.relative_spreads = expected_spreads.iter().map(|spread| spread / mean).collect();
            }
        }
        residuals
    }

    /// True if the method reports no residuals.
    pub fn is_empty(&self) -> bool {
        self.coarse.is_empty()
    }

    /// Adds a pass; [`Self::pool`] must follow.
    pub fn push(&mut self, GridPass { illuminance, residual, gathered, .. }: &GridPass) {
        let of_pass = illuminance.iter().zip(residual).zip(gathered);
        for (place, ((whole, beyond), gathered)) in of_pass.enumerate().take(self.coarse.len()) {
            self.coarse[place].push(whole - beyond);
            self.beyond[place].push(*beyond);
            self.gathered[place].push(*gathered);
        }
    }

    /// Calls `f` on every number in a fixed order, to read or to replace them; [`Self::pool`] must follow.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        self.coarse
            .iter_mut()
            .chain(&mut self.beyond)
            .chain(&mut self.gathered)
            .for_each(|moments| moments.for_each_value(f));
    }

    /// Returns the illuminance of a sensor in lx, and its variance; infinite with fewer than two passes.
    pub fn value_and_variance(&self, sensor: usize) -> (f64, f64) {
        let (value, [coarse, own, of_others]) = self.value_and_variances(sensor);
        (value, coarse + own + of_others)
    }

    /// Returns the ratio of the degrees of freedom of a variance by passes to those of the variances of some sensors, 0..1, by Welch and
    /// Satterthwaite: a sensor's coarse part and its own residual have those of passes, what many sensors share has many more. Mean over the
    /// sensors; 1 where none has an error.
    pub fn share_of_few(&self, sensors: impl Iterator<Item = usize>) -> f64 {
        let mut shares = Moments::default();
        for sensor in sensors {
            let (_, [coarse, own, of_others]) = self.value_and_variances(sensor);
            let all = coarse + own + of_others;
            if all > 0.0 && all.is_finite() {
                shares.push((coarse * coarse + own * own) / (all * all));
            }
        }
        if shares.count > 0.0 { shares.mean } else { 1.0 }
    }

    /// Returns the illuminance of a sensor in lx, and the parts of its variance: by the coarse part, by its own residual, and by the residual
    /// that it shares with others.
    fn value_and_variances(&self, sensor: usize) -> (f64, [f64; 3]) {
        let (coarse, beyond) = (&self.coarse[sensor], &self.beyond[sensor]);
        let Pooled { scales, own, mean, variance_of_mean, spread } = &self.pooled;
        let scale = scales.get(sensor).copied().unwrap_or_default();
        if scale <= 0.0 {
            return (coarse.mean, [coarse.variance_of_mean(), 0.0, 0.0]);
        }
        let own = own.get(sensor).copied().unwrap_or(1.0);
        let others = 1.0 - own;
        let value = coarse.mean + own * beyond.mean + others * mean * scale;
        let of_others = (others * scale).powi(2) * (spread * self.relative_spread(sensor) + variance_of_mean);
        // the own residual of a single pass has no variance yet
        let of_own = if own > 0.0 { own * own * beyond.variance_of_mean() } else { 0.0 };
        (value, [coarse.variance_of_mean(), of_own, of_others])
    }

    /// Returns the ratio of the variance by which a sensor's residual is expected to differ to the mean of all.
    fn relative_spread(&self, sensor: usize) -> f64 {
        self.relative_spreads.get(sensor).copied().unwrap_or(1.0)
    }

    /// Updates the residual that all sensors have in common, and returns it: that of a part of the light has the scales and weights of the
    /// `whole`, so that the values of parts add up to those of the whole.
    pub fn pool(&mut self, whole: Option<&Pooled>) -> &Pooled {
        self.pooled = match whole {
            Some(whole) if whole.scales.len() == self.coarse.len() => {
                self.common(whole.scales.clone(), Some(whole.own.clone()))
            }
            _ => self.common(self.scales(), None),
        };
        &self.pooled
    }

    /// Returns the scale of each sensor: its gathered light, or a share of the mean where this is more; 0 where no light is reflected.
    fn scales(&self) -> Arc<[f64]> {
        let is_lit = |sensor: usize| self.beyond[sensor].m2 > 0.0;
        let lit: Vec<f64> =
            (0..self.coarse.len()).filter(|sensor| is_lit(*sensor)).map(|sensor| self.gathered[sensor].mean).collect();
        let least = LEAST_SCALE * lit.iter().sum::<f64>() / lit.len().max(1) as f64;
        let scale = |sensor: usize| match is_lit(sensor) {
            true if least > 0.0 => self.gathered[sensor].mean.max(least),
            // without light by the coarse solution nothing is shared
            true => 1.0,
            false => 0.0,
        };
        (0..self.coarse.len()).map(scale).collect()
    }

    /// Computes the residual that sensors of these scales have in common, with the weights of own residuals that are given, or that are
    /// best: 1 where sensors are too few, or have no light by the coarse solution.
    fn common(&self, scales: Arc<[f64]>, own: Option<Arc<[f64]>>) -> Pooled {
        let members = || (0..scales.len()).filter(|sensor| scales[*sensor] > 0.0);
        let count = members().count() as f64;
        let is_dark = members().all(|sensor| self.gathered[sensor].mean <= 0.0);
        let apart = count < LEAST_SENSORS as f64 || is_dark || members().any(|sensor| self.beyond[sensor].count < 2.0);
        if apart && own.as_ref().is_none_or(|own| own.is_empty()) {
            return Pooled { scales, ..Pooled::default() };
        }
        let all: f64 = members().map(|sensor| scales[sensor]).sum();
        let mean = members().map(|sensor| self.beyond[sensor].mean).sum::<f64>() / all;
        let variance_of_mean =
            members().map(|sensor| self.beyond[sensor].variance_of_mean()).sum::<f64>() / (all * all);
        let noise = |sensor: usize| self.beyond[sensor].variance_of_mean() / scales[sensor].powi(2);
        let mut excess = Moments::default();
        for sensor in members() {
            // the mean takes part of a degree of freedom
            let square = (self.beyond[sensor].mean / scales[sensor] - mean).powi(2) * count / (count - 1.0);
            excess.push(square - noise(sensor));
        }
        let noise = members().map(noise).sum::<f64>() / count;
        let deviation = excess.standard_error();
        let spread = spread_of(excess.mean, deviation, self.expected_spread);
        let best = |sensor: usize| {
            let spread = spread * self.relative_spread(sensor);
            if spread + noise > 0.0 { spread / (spread + noise) } else { 1.0 }
        };
        let own = own.unwrap_or_else(|| (0..scales.len()).map(best).collect());
        Pooled { scales, own, mean, variance_of_mean, spread }
    }
}

/// Estimates the spread of residuals from the mean excess of their squares over their noise, the standard error `deviation` of this, and the
/// expected spread.
fn spread_of(excess: f64, deviation: f64, expected: Option<f64>) -> f64 {
    // an exponential distribution of the spread about zero moves the maximum of the normal one
    let expected = CAUTION * expected.map_or(f64::INFINITY, |expected| expected.max(f64::MIN_POSITIVE));
    let spread = mean_above_zero(excess - deviation * deviation / expected, deviation);
    // what many paths have seen counts, however little was expected
    spread.max(excess - CERTAIN * deviation)
}

/// Sensors of a grid that share their residuals.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sharing {
    /// Number of sensors.
    pub sensors: usize,
    /// Variance by which their residuals are expected to differ, relative to the squared light of a sensor; `None` where it is not known.
    pub expected_spread: Option<f64>,
}

impl Sharing {
    /// Predicts the parts of the variance of a sensor's residual that [`Residuals`] tells after this number of passes, at least 2: by its own
    /// residual, and by that which it shares with others. `noise` is the variance of one pass, relative to the squared light of a sensor.
    pub fn predicted_variances(self, noise: f64, passes: f64) -> [f64; 2] {
        let (noise, sensors) = (noise / passes, self.sensors as f64);
        if noise <= 0.0 || self.sensors < LEAST_SENSORS {
            return [noise, 0.0];
        }
        let spread = match self.expected_spread {
            Some(expected) => {
                // squares of normal deviations, less a variance that is estimated from the passes
                let squares = 2.0 * ((expected + noise).powi(2) + noise * noise / (passes - 1.0));
                spread_of(expected, (squares / sensors).sqrt(), self.expected_spread)
            }
            None => {
                let remaining = remaining_noise(self.sensors);
                noise * remaining / (1.0 - remaining)
            }
        };
        let own = spread / (spread + noise);
        [own * own * noise, (1.0 - own).powi(2) * (spread + noise / sensors)]
    }
}

/// Returns the mean of a normal distribution with this mean and standard deviation, cut off below zero.
fn mean_above_zero(mean: f64, deviation: f64) -> f64 {
    if deviation <= 0.0 {
        return mean.max(0.0);
    }
    let z = mean / deviation;
    if z < FAR_BELOW {
        // Mills' ratio
        return deviation / -z;
    }
    let density = libm::exp(-0.5 * z * z) / (2.0 * PI).sqrt();
    let above = 0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2);
    mean + deviation * density / above
}

/// Mean in standard deviations below which the asymptotic form is used.
const FAR_BELOW: f64 = -8.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};

    /// Returns a normal random number by two uniform ones.
    fn normal(random: &mut PathRandom) -> f64 {
        let [u, v] = random.uniform2();
        (-2.0 * (1.0 - u).ln()).sqrt() * (2.0 * PI * v).cos()
    }

    /// Returns a pass without direct light.
    fn pass_of(illuminance: Vec<f64>, residual: Vec<f64>) -> GridPass {
        let gathered = illuminance.iter().zip(&residual).map(|(whole, beyond)| whole - beyond).collect();
        GridPass { illuminance, residual, gathered, ..GridPass::default() }
    }

    /// Returns the root mean square of the errors, and of the estimated errors, over many jobs of 8 passes in which the residuals of the
    /// sensors have a noise of 10 lx a pass about 1 lx, and differ by `spread`; the known part has a noise of 1 lx a pass.
    fn errors(sensors: usize, spread: f64, expected: Option<f64>) -> [f64; 2] {
        let expected = expected.map_or_else(Vec::new, |expected| vec![expected; sensors]);
        let errors = errors_by_sensor(&vec![spread; sensors], &expected);
        [0, 1].map(|part| (errors.iter().map(|of| of[part].mean).sum::<f64>() / sensors as f64).sqrt())
    }

    /// Returns the squares of the errors, and of the estimated errors, of sensors that differ by a spread of their own.
    fn errors_by_sensor(spreads: &[f64], expected: &[f64]) -> Vec<[Moments; 2]> {
        let mut random = PathRandom::new(Key::new(3));
        let mut errors = vec![[Moments::default(); 2]; spreads.len()];
        for _ in 0..200 {
            let mut residuals = Residuals::of_sensors(spreads.len(), expected);
            let truth: Vec<f64> = spreads.iter().map(|spread| 1.0 + spread * normal(&mut random)).collect();
            for _ in 0..8 {
                let beyond: Vec<f64> = truth.iter().map(|mean| mean + 10.0 * normal(&mut random)).collect();
                let whole: Vec<f64> = beyond.iter().map(|beyond| 100.0 + normal(&mut random) + beyond).collect();
                residuals.push(&pass_of(whole, beyond));
                residuals.pool(None);
            }
            for (sensor, [actual, reported]) in errors.iter_mut().enumerate() {
                let (value, variance) = residuals.value_and_variance(sensor);
                actual.push((value - 100.0 - truth[sensor]).powi(2));
                reported.push(variance);
            }
        }
        errors
    }

    /// Sensors that do not differ have a fraction of their own noise, 3.5 lx; those that differ by much have all of it. The estimated
    /// errors are the actual ones, or up to twice these where few sensors leave open whether they differ.
    #[test]
    fn sensors_count_their_own_residual_as_far_as_they_differ() {
        let few = [(81, 0.0, 1.4), (81, 1.0, 1.5), (81, 2.0, 2.1), (81, 4.0, 2.8), (81, 40.0, 3.7)];
        for (sensors, spread, most) in few.into_iter().chain([(2400, 0.0, 0.8), (2400, 1.0, 1.2)]) {
            let [actual, reported] = errors(sensors, spread, None);
            assert!(actual < most, "{sensors} {spread}: {actual}");
            assert!((0.97..2.0).contains(&(reported / actual)), "{sensors} {spread}: {reported} {actual}");
        }
    }

    /// Checks that sensors share more where their differences are known beforehand: nearly all of the error is those differences.
    /// Differences that are larger than expected are seen, and smaller ones overestimated by no more than the caution.
    #[test]
    fn expected_differences_reduce_errors() {
        for (spread, expected, most) in [(1.0, 1.0, 1.3), (0.2, 0.2, 0.7), (1.0, 0.5, 1.4), (8.0, 0.5, 3.8)] {
            let [actual, reported] = errors(81, spread, Some((expected / 100.0_f64).powi(2)));
            assert!(actual < most, "{spread} {expected}: {actual}");
            assert!((0.85..1.8).contains(&(reported / actual)), "{spread} {expected}: {reported} {actual}");
        }
    }

    /// Checks that every ninth sensor, which differs by three times as much as the others, has an error of its own: with the mean spread of
    /// all it would be half of the actual one.
    #[test]
    fn sensors_that_differ_more_have_larger_errors() {
        let spreads: Vec<f64> = (0..81).map(|sensor| if sensor % 9 == 0 { 3.0 } else { 1.0 }).collect();
        let expected: Vec<f64> = spreads.iter().map(|spread| (spread / 100.0).powi(2)).collect();
        let errors = errors_by_sensor(&spreads, &expected);
        for first in [0, 1] {
            let some = errors.iter().skip(first).step_by(9);
            let [actual, reported] = [0, 1].map(|part| some.clone().map(|of| of[part].mean).sum::<f64>().sqrt());
            assert!((0.95..1.3).contains(&(reported / actual)), "{first}: {reported} {actual}");
        }
    }

    /// Predicted errors are those that jobs tell, within 15 %. Where nothing is known of how sensors differ, a fraction of the noise remains.
    #[test]
    fn errors_are_predicted_before_any_pass() {
        let [noise, passes] = [0.01, 8.0];
        for (sensors, spread) in [(81, 1.0), (81, 0.2), (81, 4.0), (2400, 1.0), (LEAST_SENSORS - 1, 1.0)] {
            let expected_spread = Some((spread / 100.0_f64).powi(2));
            let [_, told] = errors(sensors, spread, expected_spread);
            let residual = Sharing { sensors, expected_spread }.predicted_variances(noise, passes);
            let predicted = (1.0 / passes + 1e4 * residual.iter().sum::<f64>()).sqrt();
            assert!((predicted / told - 1.0).abs() < 0.15, "{sensors} {spread}: {predicted} {told}");
        }
        let [own, shared] = Sharing { sensors: 2400, expected_spread: None }.predicted_variances(noise, passes);
        let remaining = remaining_noise(2400) * noise / passes;
        assert!(((own + shared) / remaining - 1.0).abs() < 0.01 && own < 0.1 * shared, "{own} {shared} {remaining}");
    }

    /// Checks shares by hand: sensors with their own residuals alone have the degrees of freedom of passes where one part has all the noise, and
    /// twice these where two parts have half of it each; sensors that share a residual without noise of the coarse part have many more.
    #[test]
    fn what_many_share_has_many_degrees_of_freedom() {
        let of = |sensors: usize, known: f64, noise: &dyn Fn(usize, usize) -> f64| {
            let mut residuals = Residuals::of_sensors(sensors, &vec![1e-9; sensors]);
            for pass in 0..4 {
                let beyond: Vec<f64> = (0..sensors).map(|sensor| noise(pass, sensor)).collect();
                let whole = (0..sensors).map(|sensor| 100.0 + known * noise(pass, sensor) + beyond[sensor]).collect();
                residuals.push(&pass_of(whole, beyond));
                residuals.pool(None);
            }
            residuals.share_of_few(0..sensors)
        };
        let alternates = |pass: usize, sensor: usize| if (pass + sensor).is_multiple_of(2) { 1.0 } else { -1.0 };
        assert_eq!(of(1, 0.0, &alternates), 1.0);
        assert!((of(1, 1.0, &alternates) - 0.5).abs() < 1e-12);
        assert_eq!(of(1, 0.0, &|_, _| 0.0), 1.0);
        assert!(of(1000, 0.0, &alternates) < 1e-3, "{}", of(1000, 0.0, &alternates));
    }

    /// Few sensors, and sensors without light by the coarse solution, count their own residuals whole.
    #[test]
    fn few_sensors_stay_apart() {
        for (coarse, sensors) in [(100.0, LEAST_SENSORS - 1), (0.0, 100)] {
            let mut residuals = Residuals::of_sensors(sensors, &[]);
            for pass in 0..4 {
                let beyond: Vec<f64> = (0..sensors).map(|sensor| f64::from(pass) * sensor as f64).collect();
                let whole: Vec<f64> = beyond.iter().map(|beyond| coarse + beyond).collect();
                residuals.push(&pass_of(whole, beyond));
                residuals.pool(None);
            }
            for sensor in 0..sensors {
                let (value, variance) = residuals.value_and_variance(sensor);
                assert!((value - coarse - 1.5 * sensor as f64).abs() < 1e-9);
                assert!((variance - (sensor as f64).powi(2) * 5.0 / 12.0).abs() < 1e-9, "{variance}");
            }
        }
    }

    /// Closed forms: half of a normal distribution about zero has the mean sqrt(2 / pi); far above zero nothing is cut off; far below, the
    /// rest is an exponential distribution.
    #[test]
    fn the_part_above_zero() {
        assert!((mean_above_zero(0.0, 3.0) - 3.0 * (2.0 / PI).sqrt()).abs() < 1e-12);
        assert!((mean_above_zero(10.0, 1.0) - 10.0).abs() < 1e-12);
        assert_eq!([mean_above_zero(2.0, 0.0), mean_above_zero(-2.0, 0.0)], [2.0, 0.0]);
        let [near, far] = [mean_above_zero(FAR_BELOW + 1e-9, 1.0), mean_above_zero(FAR_BELOW - 1e-9, 1.0)];
        assert!((near / far - 1.0).abs() < 0.05, "{near} {far}");
    }
}

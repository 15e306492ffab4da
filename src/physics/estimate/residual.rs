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

use std::sync::Arc;

use super::spread::spread_of;
use crate::integrator::GridPass;
use crate::integrator::pass::{LEAST_SCALE, LEAST_SENSORS};
use crate::statistics::{Moments, median};

/// Light of a sensor by the coarse solution, relative to the median of all, above which it keeps its own residual: one close to a lit surface
/// sees patches that others hardly see, and would decide what they share.
const MOST_SCALE: f64 = 4.0;

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
    /// Variance of the true residual of each sensor about it.
    spreads: Vec<f64>,
}

impl Residuals {
    /// Creates the residuals of `count` sensors, without any pass, with the variances by which they are expected to differ from the mean;
    /// none if these are not known.
    pub fn of_sensors(count: usize, expected_spreads: &[f64]) -> Self {
        let none = vec![Moments::default(); count];
        let mut residuals = Self { coarse: none.clone(), beyond: none.clone(), gathered: none, ..Self::default() };
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
        let Pooled { scales, own, mean, variance_of_mean, spreads } = &self.pooled;
        let scale = scales.get(sensor).copied().unwrap_or_default();
        if scale <= 0.0 {
            return (coarse.mean, [coarse.variance_of_mean(), 0.0, 0.0]);
        }
        let own = own.get(sensor).copied().unwrap_or(1.0);
        let others = 1.0 - own;
        let value = coarse.mean + own * beyond.mean + others * mean * scale;
        let spread = spreads.get(sensor).copied().unwrap_or_default();
        let of_others = (others * scale).powi(2) * (spread + variance_of_mean);
        // the own residual of a single pass has no variance yet
        let of_own = if own > 0.0 { own * own * beyond.variance_of_mean() } else { 0.0 };
        (value, [coarse.variance_of_mean(), of_own, of_others])
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

    /// Returns the scale of each sensor: its gathered light, or a share of the median where this is more; 0 where no light is reflected.
    fn scales(&self) -> Arc<[f64]> {
        let is_lit = |sensor: usize| self.beyond[sensor].m2 > 0.0;
        let lit = (0..self.coarse.len()).filter(|sensor| is_lit(*sensor));
        let gathered = lit.map(|sensor| self.gathered[sensor].mean).filter(|lux| *lux > 0.0);
        let least = LEAST_SCALE * median(gathered.collect());
        let scale = |sensor: usize| match is_lit(sensor) {
            true if least > 0.0 => self.gathered[sensor].mean.max(least),
            // without light by the coarse solution nothing is shared
            true => 1.0,
            false => 0.0,
        };
        (0..self.coarse.len()).map(scale).collect()
    }

    /// Computes the residual that sensors of these scales have in common, with the weights of own residuals that are given, or that are
    /// best: 1 for sensors that are much brighter than others, and where sensors are too few, or have no light by the coarse solution.
    fn common(&self, scales: Arc<[f64]>, own: Option<Arc<[f64]>>) -> Pooled {
        let lit: Vec<usize> = (0..scales.len()).filter(|sensor| scales[*sensor] > 0.0).collect();
        let usual = median(lit.iter().map(|sensor| scales[*sensor]).collect());
        let alike: Vec<usize> = lit.iter().copied().filter(|sensor| scales[*sensor] <= MOST_SCALE * usual).collect();
        let is_dark = lit.iter().all(|sensor| self.gathered[*sensor].mean <= 0.0);
        let of_one_pass = lit.iter().any(|sensor| self.beyond[*sensor].count < 2.0);
        let apart = alike.len() < LEAST_SENSORS || is_dark || of_one_pass;
        if apart && own.as_ref().is_none_or(|own| own.is_empty()) {
            return Pooled { scales, ..Pooled::default() };
        }
        let count = alike.len() as f64;
        let of_all = |of: &dyn Fn(usize) -> f64| alike.iter().map(|sensor| of(*sensor)).sum::<f64>();
        let mean = of_all(&|sensor| self.beyond[sensor].mean) / of_all(&|sensor| scales[sensor]);
        let noise = |sensor: usize| self.beyond[sensor].variance_of_mean() / scales[sensor].powi(2);
        let mut excess = Moments::default();
        for sensor in &alike {
            // the mean takes part of a degree of freedom
            let square = (self.beyond[*sensor].mean / scales[*sensor] - mean).powi(2) * count / (count - 1.0);
            excess.push(square - noise(*sensor));
        }
        let noise = of_all(&noise) / count;
        let spread = spread_of(excess.mean, excess.standard_error(), self.expected_spread);
        // patches have errors of about the same lux for all: in dark places they are larger fractions of the light
        let relative = |sensor: usize| match self.relative_spreads.get(sensor) {
            Some(expected) => *expected,
            None => (usual / scales[sensor]).powi(2).max(1.0),
        };
        let spread = spread * count / of_all(&relative);
        let mut spreads = vec![0.0; scales.len()];
        alike.iter().for_each(|sensor| spreads[*sensor] = spread * relative(*sensor));
        let best = || {
            let mut own = vec![1.0; scales.len()];
            for sensor in &alike {
                let spread = spreads[*sensor];
                own[*sensor] = if spread + noise > 0.0 { spread / (spread + noise) } else { 1.0 };
            }
            own.into()
        };
        let own: Arc<[f64]> = own.unwrap_or_else(best);
        // shared as far as sensors do not count their own, so that the mean over all sensors is that of their own residuals
        let others = |sensor: usize| 1.0 - own.get(sensor).unwrap_or(&1.0);
        let shared = of_all(&|sensor| others(sensor) * scales[sensor]);
        if shared <= 0.0 {
            return Pooled { scales, own, ..Pooled::default() };
        }
        let mean = of_all(&|sensor| others(sensor) * self.beyond[sensor].mean) / shared;
        let variances = of_all(&|sensor| others(sensor).powi(2) * self.beyond[sensor].variance_of_mean());
        Pooled { own, mean, variance_of_mean: variances / (shared * shared), spreads, scales }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::super::spread::Sharing;
    use super::*;
    use crate::integrator::pass::remaining_noise;
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
        let errors = errors_by_sensor(&vec![(100.0, spread); sensors], &expected);
        [0, 1].map(|part| (errors.iter().map(|of| of[part].mean).sum::<f64>() / sensors as f64).sqrt())
    }

    /// Returns the squares of the errors, and of the estimated errors, of sensors with known light and a spread in lx of their own, whose
    /// residuals are about a hundredth of their light.
    fn errors_by_sensor(sensors: &[(f64, f64)], expected: &[f64]) -> Vec<[Moments; 2]> {
        let mut random = PathRandom::new(Key::new(3));
        let mut errors = vec![[Moments::default(); 2]; sensors.len()];
        for _ in 0..200 {
            let mut residuals = Residuals::of_sensors(sensors.len(), expected);
            let truth: Vec<f64> =
                sensors.iter().map(|(known, spread)| 0.01 * known + spread * normal(&mut random)).collect();
            let mut sum = Moments::default();
            for _ in 0..8 {
                let beyond: Vec<f64> = truth.iter().map(|mean| mean + 10.0 * normal(&mut random)).collect();
                let whole =
                    sensors.iter().zip(&beyond).map(|((known, _), beyond)| known + normal(&mut random) + beyond);
                let whole: Vec<f64> = whole.collect();
                sum.push(whole.iter().sum());
                residuals.push(&pass_of(whole, beyond));
                residuals.pool(None);
            }
            let values = (0..sensors.len()).map(|sensor| residuals.value_and_variance(sensor).0);
            assert!((values.sum::<f64>() / sum.mean - 1.0).abs() < 1e-12, "the mean is that of passes");
            for (sensor, [actual, reported]) in errors.iter_mut().enumerate() {
                let (value, variance) = residuals.value_and_variance(sensor);
                actual.push((value - sensors[sensor].0 - truth[sensor]).powi(2));
                reported.push(variance);
            }
        }
        errors
    }

    /// Checks that every ninth sensor, and those next to them, tell their errors within 0.9 to 1.4 times the actual ones.
    fn errors_of_ninths_are_honest(errors: &[[Moments; 2]]) {
        for first in [0, 1] {
            let [actual, reported] = of_every_ninth(errors, first);
            assert!((0.9..1.4).contains(&(reported / actual)), "{first}: {reported} {actual}");
        }
    }

    /// Returns the root mean squares of the errors, and of the estimated errors, of every ninth sensor from the `first` on.
    fn of_every_ninth(errors: &[[Moments; 2]], first: usize) -> [f64; 2] {
        let some = errors.iter().skip(first).step_by(9);
        [0, 1].map(|part| (some.clone().map(|of| of[part].mean).sum::<f64>() / some.clone().count() as f64).sqrt())
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
        let sensors: Vec<(f64, f64)> = (0..81).map(|sensor| (100.0, if sensor % 9 == 0 { 3.0 } else { 1.0 })).collect();
        let expected: Vec<f64> = sensors.iter().map(|(known, spread)| (spread / known).powi(2)).collect();
        errors_of_ninths_are_honest(&errors_by_sensor(&sensors, &expected));
    }

    /// Checks that every ninth sensor, which has a fifth of the light and differs by as many lx as the others, five times the fraction, has
    /// an error of its own where nothing tells how much sensors differ.
    #[test]
    fn dark_sensors_differ_by_more_of_their_light() {
        let sensors: Vec<(f64, f64)> =
            (0..81).map(|sensor| (if sensor % 9 == 0 { 20.0 } else { 100.0 }, 2.0)).collect();
        errors_of_ninths_are_honest(&errors_by_sensor(&sensors, &[]));
    }

    /// Checks that a sensor of 100 times the light, whose residual differs, does not decide what others share: with it they would be 3 lx
    /// off.
    #[test]
    fn sensors_beside_light_keep_their_residual() {
        let sensors: Vec<(f64, f64)> =
            (0..82).map(|sensor| if sensor == 81 { (10_000.0, 300.0) } else { (100.0, 0.0) }).collect();
        let errors = errors_by_sensor(&sensors, &[1e-6; 82]);
        let [actual, reported] = of_every_ninth(&errors[..81], 0);
        assert!(actual < 0.8 && (0.9..1.4).contains(&(reported / actual)), "{reported} {actual}");
        let [actual, reported] = errors[81].map(|of| of.mean.sqrt());
        assert!((0.9..1.1).contains(&(reported / actual)), "{reported} {actual}");
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
}

//! Illuminances of sensors that are known from a coarse solution, and what they are beyond it.
//!
//! A method that estimates most of a sensor's light by a coarse solution of the room, and the rest by few paths, tells the two apart:
//! `known` has little noise, and an error that the paths of all sensors together measure; `beyond`, what is left out, is small and noisy.
//! What the sensors of a grid have in common of it is found by all of their paths. Only where they differ by more than their noise does
//! each count its own, by the share that leaves the least error: this is the estimator of James and Stein in the form of empirical Bayes
//! (Efron and Morris 1973; Morris 1983), for relative residuals of unknown mean.
//!
//! The variance tau^2 by which sensors truly differ is the mean excess of their squares over their noise. It is taken as the mean of what
//! it may be: of a normal distribution about that mean excess, with the standard error of it, of which nothing is below zero. So what is
//! too small to be seen in the noise still has its part in the errors.
//!
//! See docs/physics/statistics.md#residuals-of-a-coarse-solution.

use std::f64::consts::PI;

use crate::integrator::GridPass;
use crate::statistics::Moments;

/// Sensors, at the least: fewer tell nothing of how they differ.
const LEAST_SENSORS: usize = 8;

/// Least scale of a sensor's residual, as a share of the mean over the grid.
const LEAST_SCALE: f64 = 0.1;

/// Illuminances of the sensors of a grid by a coarse solution and beyond it.
#[derive(Clone, Debug, Default)]
pub struct Residuals {
    /// Illuminance in lx by the coarse solution, straight light included.
    known: Vec<Moments>,
    /// Illuminance in lx that it leaves out.
    beyond: Vec<Moments>,
    /// Illuminance in lx that it gives.
    gathered: Vec<Moments>,
    pooled: Option<Pooled>,
}

/// Residual that sensors have in common.
#[derive(Clone, Copy, Debug)]
struct Pooled {
    /// Mean residual, relative to the scale of a sensor.
    mean: f64,
    variance_of_mean: f64,
    /// Variance of true residuals about it.
    spread: f64,
    /// Share of its own residual that a sensor counts.
    own: f64,
    /// Least scale of a sensor in lx.
    least_scale: f64,
}

impl Residuals {
    /// Makes room for so many sensors, without any pass.
    pub fn of_sensors(count: usize) -> Self {
        let none = vec![Moments::default(); count];
        Self { known: none.clone(), beyond: none.clone(), gathered: none, pooled: None }
    }

    /// True if the method tells no residuals.
    pub fn is_empty(&self) -> bool {
        self.known.is_empty()
    }

    /// Adds a pass.
    pub fn push(&mut self, GridPass { illuminance, residual, gathered, .. }: &GridPass) {
        let of_pass = illuminance.iter().zip(residual).zip(gathered);
        for (place, ((whole, beyond), gathered)) in of_pass.enumerate().take(self.known.len()) {
            self.known[place].push(whole - beyond);
            self.beyond[place].push(*beyond);
            self.gathered[place].push(*gathered);
        }
        self.pool();
    }

    /// Gives `f` every number in a fixed order, to read or to replace.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        self.known
            .iter_mut()
            .chain(&mut self.beyond)
            .chain(&mut self.gathered)
            .for_each(|moments| moments.for_each_value(f));
        self.pool();
    }

    /// Illuminance in lx of a sensor, and its variance; infinite with fewer than two passes.
    pub fn value_and_variance(&self, sensor: usize) -> (f64, f64) {
        let (known, beyond) = (&self.known[sensor], &self.beyond[sensor]);
        if !self.is_lit(sensor) {
            return (known.mean, known.variance_of_mean());
        }
        let Some(pooled) = &self.pooled else {
            return (known.mean + beyond.mean, known.variance_of_mean() + beyond.variance_of_mean());
        };
        let scale = self.gathered[sensor].mean.max(pooled.least_scale);
        let others = 1.0 - pooled.own;
        let value = known.mean + pooled.own * beyond.mean + others * pooled.mean * scale;
        let own = pooled.own * pooled.own * beyond.variance_of_mean();
        let of_others = (others * scale).powi(2) * (pooled.spread + pooled.variance_of_mean);
        (value, known.variance_of_mean() + own + of_others)
    }

    /// False for a sensor that gets no reflected light: nothing is left out of its light, and it has nothing in common with others.
    fn is_lit(&self, sensor: usize) -> bool {
        self.beyond[sensor].m2 > 0.0
    }

    /// Finds what the residuals of all sensors have in common.
    fn pool(&mut self) {
        self.pooled = self.in_common();
    }

    /// Returns what they have in common; `None` where they are too few, or have no light.
    fn in_common(&self) -> Option<Pooled> {
        let members = || (0..self.known.len()).filter(|sensor| self.is_lit(*sensor));
        let count = members().count() as f64;
        if count < LEAST_SENSORS as f64 || members().any(|sensor| self.beyond[sensor].count < 2.0) {
            return None;
        }
        let least_scale = LEAST_SCALE * members().map(|sensor| self.gathered[sensor].mean).sum::<f64>() / count;
        if least_scale <= 0.0 {
            return None;
        }
        let scale = |sensor: usize| self.gathered[sensor].mean.max(least_scale);
        let all: f64 = members().map(scale).sum();
        let mean = members().map(|sensor| self.beyond[sensor].mean).sum::<f64>() / all;
        let variance_of_mean =
            members().map(|sensor| self.beyond[sensor].variance_of_mean()).sum::<f64>() / (all * all);
        let noise = |sensor: usize| self.beyond[sensor].variance_of_mean() / scale(sensor).powi(2);
        let mut excess = Moments::default();
        for sensor in members() {
            // the mean has taken its part of a degree of freedom
            let square = (self.beyond[sensor].mean / scale(sensor) - mean).powi(2) * count / (count - 1.0);
            excess.push(square - noise(sensor));
        }
        let noise = members().map(noise).sum::<f64>() / count;
        let spread = mean_above_zero(excess.mean, excess.standard_error());
        let own = if spread + noise > 0.0 { spread / (spread + noise) } else { 1.0 };
        Some(Pooled { mean, variance_of_mean, spread, own, least_scale })
    }
}

/// Mean of the part above zero of a normal distribution with this mean and standard deviation.
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

/// Standard deviations below zero from which on a mean has an asymptotic form.
const FAR_BELOW: f64 = -8.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};

    /// A number of normal distribution by two even ones.
    fn normal(random: &mut PathRandom) -> f64 {
        let [u, v] = random.uniform2();
        (-2.0 * (1.0 - u).ln()).sqrt() * (2.0 * PI * v).cos()
    }

    /// A pass of no straight light.
    fn pass_of(illuminance: Vec<f64>, residual: Vec<f64>) -> GridPass {
        let gathered = illuminance.iter().zip(&residual).map(|(whole, beyond)| whole - beyond).collect();
        GridPass { illuminance, residual, gathered, ..GridPass::default() }
    }

    /// Root mean square of the errors, and of those told, over many jobs of 8 passes in which residuals of the sensors have a noise of
    /// 10 lx a pass about 1 lx, and differ by `spread`; the known part has a noise of 1 lx a pass.
    fn errors(sensors: usize, spread: f64) -> [f64; 2] {
        let mut random = PathRandom::new(Key::new(3));
        let (mut actual, mut told) = (Moments::default(), Moments::default());
        for _ in 0..200 {
            let mut residuals = Residuals::of_sensors(sensors);
            let truth: Vec<f64> = (0..sensors).map(|_| 1.0 + spread * normal(&mut random)).collect();
            for _ in 0..8 {
                let beyond: Vec<f64> = truth.iter().map(|mean| mean + 10.0 * normal(&mut random)).collect();
                let whole: Vec<f64> = beyond.iter().map(|beyond| 100.0 + normal(&mut random) + beyond).collect();
                residuals.push(&pass_of(whole, beyond));
            }
            for (sensor, truth) in truth.iter().enumerate() {
                let (value, variance) = residuals.value_and_variance(sensor);
                actual.push((value - 100.0 - truth).powi(2));
                told.push(variance);
            }
        }
        [actual.mean.sqrt(), told.mean.sqrt()]
    }

    /// Sensors that do not differ have a fraction of their own noise, 3.5 lx; those that differ by much have all of it; and the errors
    /// that are told are those that are made, or up to twice these where few sensors cannot tell whether they differ.
    #[test]
    fn sensors_count_their_own_residual_as_far_as_they_differ() {
        let few = [(81, 0.0, 1.4), (81, 1.0, 1.5), (81, 2.0, 2.1), (81, 4.0, 2.8), (81, 40.0, 3.7)];
        for (sensors, spread, most) in few.into_iter().chain([(2400, 0.0, 0.8), (2400, 1.0, 1.2)]) {
            let [actual, told] = errors(sensors, spread);
            assert!(actual < most, "{sensors} {spread}: {actual}");
            assert!((0.97..2.0).contains(&(told / actual)), "{sensors} {spread}: {told} {actual}");
        }
    }

    /// Few sensors, and sensors without light, count their own residuals whole.
    #[test]
    fn few_sensors_stay_apart() {
        for (known, sensors) in [(100.0, LEAST_SENSORS - 1), (0.0, 100)] {
            let mut residuals = Residuals::of_sensors(sensors);
            for pass in 0..4 {
                let beyond: Vec<f64> = (0..sensors).map(|sensor| f64::from(pass) * sensor as f64).collect();
                let whole: Vec<f64> = beyond.iter().map(|beyond| known + beyond).collect();
                residuals.push(&pass_of(whole, beyond));
            }
            for sensor in 0..sensors {
                let (value, variance) = residuals.value_and_variance(sensor);
                assert!((value - known - 1.5 * sensor as f64).abs() < 1e-9);
                assert!((variance - (sensor as f64).powi(2) * 5.0 / 12.0).abs() < 1e-9, "{variance}");
            }
        }
    }

    /// By the integral: half of a normal distribution about zero has the mean sqrt(2 / pi); far above zero nothing is cut off; far below,
    /// what is left is an exponential distribution.
    #[test]
    fn the_part_above_zero() {
        assert!((mean_above_zero(0.0, 3.0) - 3.0 * (2.0 / PI).sqrt()).abs() < 1e-12);
        assert!((mean_above_zero(10.0, 1.0) - 10.0).abs() < 1e-12);
        assert_eq!([mean_above_zero(2.0, 0.0), mean_above_zero(-2.0, 0.0)], [2.0, 0.0]);
        let [near, far] = [mean_above_zero(FAR_BELOW + 1e-9, 1.0), mean_above_zero(FAR_BELOW - 1e-9, 1.0)];
        assert!((near / far - 1.0).abs() < 0.05, "{near} {far}");
    }
}

//! Variance by which the true residuals of sensors differ: its estimate from some passes, and its prediction.

use std::f64::consts::PI;

use crate::integrator::pass::{CAUTION, LEAST_SENSORS, remaining_noise};

/// Number of standard errors beyond which a spread is certain.
const CERTAIN: f64 = 2.0;

/// Estimates the spread of residuals from the mean excess of their squares over their noise, the standard error `deviation` of this, and the
/// expected spread.
pub fn spread_of(excess: f64, deviation: f64, expected: Option<f64>) -> f64 {
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
    /// Predicts the parts of the variance of a sensor's residual that [`Residuals`](super::residual::Residuals) tells after this number of
    /// passes, at least 2: by its own residual, and by that which it shares with others. `noise` is the variance of one pass, relative to
    /// the squared light of a sensor.
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

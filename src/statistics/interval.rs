//! Quantiles for confidence intervals.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Two-sided normal quantile z of a `confidence` in 0..1, e.g. 1.95996 for 0.95.
///
/// ```
/// let quantile = skyduct::statistics::interval::two_sided_normal_quantile(0.95);
/// assert!((quantile - 1.959964).abs() < 1e-6);
/// ```
pub fn two_sided_normal_quantile(confidence: f64) -> f64 {
    on_every_machine(Normal::standard().inverse_cdf(0.5 * (1.0 + confidence)))
}

/// Two-sided quantile of Student's t of a `confidence` in 0..1 with `degrees` >= 1 degrees of freedom, e.g. 2.20099 for
/// 0.95 and 11; infinite without any.
///
/// Abramowitz and Stegun 1964, table 26.10:
///
/// ```
/// let quantile = skyduct::statistics::interval::two_sided_student_quantile(0.95, 11.0);
/// assert!((quantile - 2.201).abs() < 5e-4);
/// ```
pub fn two_sided_student_quantile(confidence: f64, degrees: f64) -> f64 {
    match StudentsT::new(0.0, 1.0, degrees) {
        Ok(distribution) => on_every_machine(distribution.inverse_cdf(0.5 * (1.0 + confidence))),
        Err(_) => f64::INFINITY,
    }
}

/// A quantile rounded to 2^-36, 1.5e-11. statrs takes the system's logarithm and exponential function, whose last bits differ
/// from machine to machine; the bits of results must not.
fn on_every_machine(quantile: f64) -> f64 {
    const STEPS: f64 = (1u64 << 36) as f64;
    (quantile * STEPS).round() / STEPS
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A standard normal number of a uniform one in 0..1.
    pub fn normal(uniform: f64) -> f64 {
        Normal::standard().inverse_cdf(uniform.clamp(1e-15, 1.0 - 1e-15))
    }

    /// Abramowitz and Stegun, table 26.10.
    #[test]
    fn quantiles_of_student() {
        for (confidence, degrees, quantile) in [(0.95, 1.0, 12.706), (0.95, 11.0, 2.201), (0.99, 30.0, 2.750)] {
            assert!((two_sided_student_quantile(confidence, degrees) - quantile).abs() < 6e-4);
        }
        assert_eq!(two_sided_student_quantile(0.95, 0.0), f64::INFINITY);
    }

    #[test]
    fn ninety_five_percent() {
        assert!((super::two_sided_normal_quantile(0.95) - 1.959963984540054).abs() < 1e-9);
    }
}

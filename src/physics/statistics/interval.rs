//! Quantiles for confidence intervals.

use std::cell::RefCell;
use std::collections::HashMap;

use statrs::distribution::{Continuous, ContinuousCDF, Normal, StudentsT};

/// Returns the two-sided normal quantile z of a `confidence` in 0..1, e.g. 1.95996 for 0.95.
///
/// ```
/// let quantile = skyduct_physics::statistics::interval::two_sided_normal_quantile(0.95);
/// assert!((quantile - 1.959964).abs() < 1e-6);
/// ```
pub fn two_sided_normal_quantile(confidence: f64) -> f64 {
    on_every_machine(Normal::standard().inverse_cdf(0.5 * (1.0 + confidence)))
}

/// Returns the two-sided quantile of Student's t for a `confidence` in 0..1 and `degrees` >= 1 degrees of freedom, e.g. 2.20099 for 0.95
/// and 11; infinite without any.
///
/// Abramowitz and Stegun 1964, table 26.10:
///
/// ```
/// let quantile = skyduct_physics::statistics::interval::two_sided_student_quantile(0.95, 11.0);
/// assert!((quantile - 2.201).abs() < 5e-4);
/// ```
pub fn two_sided_student_quantile(confidence: f64, degrees: f64) -> f64 {
    KNOWN.with_borrow_mut(|known| {
        if known.len() >= MOST_KNOWN {
            known.clear();
        }
        let quantile = || student_quantile(confidence, degrees);
        *known.entry([confidence, degrees].map(f64::to_bits)).or_insert_with(quantile)
    })
}

/// Largest number of cached quantiles: jobs need few, again and again.
const MOST_KNOWN: usize = 1024;

thread_local! {
    static KNOWN: RefCell<HashMap<[u64; 2], f64>> = RefCell::default();
}

fn student_quantile(confidence: f64, degrees: f64) -> f64 {
    let Ok(distribution) = StudentsT::new(0.0, 1.0, degrees) else { return f64::INFINITY };
    let z = two_sided_normal_quantile(confidence);
    if degrees > MANY_DEGREES {
        return on_every_machine(student_quantile_near(z, degrees));
    }
    let start = if degrees < FEW_DEGREES { z } else { student_quantile_near(z, degrees) };
    on_every_machine(upper_quantile(&distribution, 0.5 * (1.0 - confidence), start))
}

/// Returns the deviation of a normal distribution that is as likely as `t` >= 0 is of Student's distribution with `degrees` >= 1: the
/// number of true standard errors that a quotient by an estimated one corresponds to. It is at most 38, where probabilities underflow.
pub fn deviation_of_student(t: f64, degrees: f64) -> f64 {
    const MOST: f64 = 38.0;
    let tail = match StudentsT::new(0.0, 1.0, degrees) {
        Ok(distribution) if degrees <= MANY_DEGREES => distribution.sf(t),
        _ => return t.min(MOST),
    };
    if tail <= f64::MIN_POSITIVE {
        return MOST;
    }
    on_every_machine(Normal::standard().inverse_cdf(tail).abs().min(MOST))
}

/// Approximates the quantile of Student's t with some degrees of freedom from the quantile `z` of the normal distribution at the same
/// confidence: three terms of the asymptotic expansion (Abramowitz and Stegun 1964, 26.7.5). It is 0.4 % too small for 7 degrees and 0.95,
/// and takes a few multiplications.
pub fn student_quantile_near(z: f64, degrees: f64) -> f64 {
    let first = (z.powi(3) + z) / (4.0 * degrees);
    let second = (5.0 * z.powi(5) + 16.0 * z.powi(3) + 3.0 * z) / (96.0 * degrees * degrees);
    z + first + second
}

/// Degrees of freedom beyond which the asymptotic expansion is more accurate than the library's distribution, which loses a digit with each
/// power of ten.
const MANY_DEGREES: f64 = 1e5;

/// Degrees of freedom below which the asymptotic expansion is no better start of the iteration than the normal quantile.
const FEW_DEGREES: f64 = 4.0;

/// Most steps of the iteration: bisection alone needs some 60 beyond its bracket.
const MOST_STEPS: usize = 200;

/// Relative size of a step of Newton's method, whose error is about its square, below which the iteration ends.
const NEAR_ENOUGH: f64 = 1e-13;

/// Returns the value above which a fraction `tail` in 0..0.5 of a distribution about 0 lies, by Newton's method from `start`, and by
/// bisection where its steps leave the bracket.
///
/// The library's own inverse has no bound on its steps, and does not end for some degrees of freedom.
fn upper_quantile(distribution: &StudentsT, tail: f64, start: f64) -> f64 {
    let (mut low, mut high) = (0.0, f64::INFINITY);
    let mut t = start;
    for _ in 0..MOST_STEPS {
        let excess = distribution.sf(t) - tail;
        if excess > 0.0 {
            low = t
        } else {
            high = t
        }
        let newton = t + excess / distribution.pdf(t);
        let next = match newton > low && newton < high {
            true => newton,
            false if high.is_finite() => 0.5 * (low + high),
            false => 2.0 * t,
        };
        if (next - t).abs() <= NEAR_ENOUGH * t || next == low || next == high {
            return next;
        }
        t = next;
    }
    t
}

/// Rounds a quantile to 2^-36, 1.5e-11. statrs uses the system's logarithm and exponential function, whose last bits differ from machine to
/// machine; the bits of results must not.
fn on_every_machine(quantile: f64) -> f64 {
    const STEPS: f64 = (1u64 << 36) as f64;
    (quantile * STEPS).round() / STEPS
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Returns a standard normal number from a uniform one in 0..1.
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
    fn the_expansion_is_near_from_seven_degrees_on() {
        let z = two_sided_normal_quantile(0.95);
        for degrees in [7.0, 8.0, 15.0, 100.0] {
            let fraction = student_quantile_near(z, degrees) / two_sided_student_quantile(0.95, degrees);
            assert!(fraction < 1.0 && fraction > 0.995, "{degrees}: {fraction}");
        }
    }

    /// The tail beyond the quantile is that of the confidence, for any degrees of freedom, integer or not, few or many, and at any
    /// confidence.
    #[test]
    fn quantiles_of_student_end_and_are_right() {
        let whole = (1..300).map(f64::from);
        let parts = (0..600).map(|k| 1.0 + 0.37 * f64::from(k));
        let many = (3..6).map(|power| 10f64.powi(power) - 0.123);
        for degrees in whole.chain(parts).chain(many) {
            for confidence in [0.5, 0.9, 0.95, 0.99, 0.999_999] {
                let quantile = two_sided_student_quantile(confidence, degrees);
                let tail = StudentsT::new(0.0, 1.0, degrees).unwrap().sf(quantile);
                let wanted = 0.5 * (1.0 - confidence);
                // the rounding of the quantile, and that of 1 - confidence
                assert!((tail / wanted - 1.0).abs() < 1e-8, "{degrees} {confidence}: {quantile} {tail}");
            }
        }
        // one degree has the closed form tan(pi p / 2)
        assert!((two_sided_student_quantile(0.5, 1.0) - 1.0).abs() < 1e-10);
        // the expansion goes on where the equation ends
        for confidence in [0.5, 0.95, 0.999_999] {
            let [below, above] =
                [0.999_999, 1.000_001].map(|k| two_sided_student_quantile(confidence, k * MANY_DEGREES));
            assert!((above / below - 1.0).abs() < 1e-9, "{confidence}: {below} {above}");
        }
        assert!((two_sided_student_quantile(0.95, 1e9) - 1.959_963_987).abs() < 2e-9);
    }

    #[test]
    fn ninety_five_percent() {
        assert!((super::two_sided_normal_quantile(0.95) - 1.959963984540054).abs() < 1e-9);
    }
}

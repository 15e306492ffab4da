//! Two independent numbers with errors, and the probability that they differ by chance as much as they do.
#![allow(dead_code)] // each test binary uses its part

use statrs::distribution::{ContinuousCDF, StudentsT};

/// Share of a number that rounding may change: sums of closed forms in another order.
const ROUNDING: f64 = 1e-9;

/// Degrees of freedom of an error that was not estimated from a sample.
pub const KNOWN: f64 = 1e9;

/// A mean with its standard error, and the number of degrees of freedom of that error.
#[derive(Clone, Copy, Debug)]
pub struct Measured {
    pub value: f64,
    pub error: f64,
    pub degrees: f64,
}

/// The mean of a whole grid or view. Its error is told by its own spread from pass to pass: errors of neighbours are not
/// independent.
#[derive(Clone, Copy, Debug)]
pub struct Whole {
    pub value: f64,
    /// Standard error without what the method estimates of its own bias.
    pub noise: f64,
    /// Estimated bias with its sign; 0 of unbiased methods.
    pub bias: f64,
    pub degrees: f64,
}

impl Whole {
    pub fn measured(&self) -> Measured {
        Measured { value: self.value, error: self.noise.hypot(self.bias), degrees: self.degrees }
    }
}

/// Result of a comparison.
#[derive(Clone, Copy, Debug)]
pub struct Verdict {
    /// Difference in combined standard errors.
    pub t: f64,
    /// Two-sided probability of a difference of at least this size if there were none.
    pub probability: f64,
}

/// Compares a value with its oracle: Student's t of the difference beyond the oracle's systematic error, a `bound`
/// relative to its value, with the degrees of freedom of Welch and Satterthwaite.
pub fn compare(found: Measured, oracle: Measured, bound: f64) -> Verdict {
    let difference = found.value - oracle.value;
    let excess = (difference.abs() - (bound + ROUNDING) * oracle.value.abs()).max(0.0);
    // where no light is, nothing is random
    if excess == 0.0 {
        return Verdict { t: 0.0, probability: 1.0 };
    }
    let variances = [found.error.powi(2), oracle.error.powi(2)];
    let sum: f64 = variances.iter().sum();
    let degrees = sum * sum / (variances[0].powi(2) / found.degrees + variances[1].powi(2) / oracle.degrees);
    verdict(excess.copysign(difference) / sum.sqrt(), degrees)
}

fn verdict(t: f64, degrees: f64) -> Verdict {
    let probability = match StudentsT::new(0.0, 1.0, degrees.clamp(1.0, KNOWN)) {
        Ok(student) => 2.0 * student.cdf(-t.abs()),
        // an error of 0 and a difference
        Err(_) => 0.0,
    };
    Verdict { t, probability }
}

/// One of many measurements of the same number: a relative deviation, which is 0 but for errors.
#[derive(Clone, Copy, Debug)]
pub struct Deviation {
    pub value: f64,
    pub noise: f64,
    pub bias: f64,
    pub degrees: f64,
}

/// Relative deviation of a whole from its oracle; `None` in the dark.
pub fn deviation(found: &Whole, oracle: &Whole, bound: f64) -> Option<Deviation> {
    if oracle.value <= 0.0 {
        return None;
    }
    let oracle_error = oracle.noise.hypot(oracle.bias).hypot(bound * oracle.value);
    let variances = [found.noise.powi(2), oracle_error.powi(2)];
    let sum = variances.iter().sum::<f64>().max((ROUNDING * oracle.value).powi(2));
    let squares = variances[0].powi(2) / found.degrees + variances[1].powi(2) / oracle.degrees;
    Some(Deviation {
        value: found.value / oracle.value - 1.0,
        noise: sum.sqrt() / oracle.value,
        bias: found.bias / oracle.value,
        degrees: (sum * sum / squares).clamp(1.0, KNOWN),
    })
}

/// Noise below which a deviation gets no more weight: a scene in which next to nothing is random, as that of light straight
/// from a luminaire, does not stand for all others.
const EVEN: f64 = 2e-3;

/// Weighted mean of independent deviations, with its standard error, and its comparison with 0.
///
/// Weights are the inverse variances of the noise and of [`EVEN`]. As those are estimated, the variance of the mean is larger
/// than they say (Meier 1953). Biases of one method have one sign and add up; so do their estimates.
pub fn pool(deviations: &[Deviation]) -> (Measured, Verdict) {
    let weights: Vec<f64> = deviations.iter().map(|it| (it.noise.powi(2) + EVEN * EVEN).recip()).collect();
    let sum: f64 = weights.iter().sum();
    let shares = || deviations.iter().zip(weights.iter().map(|weight| weight / sum));
    let value: f64 = shares().map(|(it, share)| share * it.value).sum();
    let bias: f64 = shares().map(|(it, share)| share * it.bias).sum();
    let estimated: f64 = shares().map(|(it, share)| share * (1.0 - share) / it.degrees).sum();
    let parts = || shares().map(|(it, share)| ((share * it.noise).powi(2), it.degrees));
    let variance: f64 = parts().map(|(part, _)| part).sum();
    let degrees = variance * variance / parts().map(|(part, degrees)| part * part / degrees).sum::<f64>();
    let error = (variance * (1.0 + 4.0 * estimated) + bias * bias).sqrt();
    (Measured { value, error, degrees }, verdict(value / error, degrees))
}

/// Probability at which each of `comparisons` fails, so that all of them together fail by chance with `false_alarm`:
/// 1 - (1 - p)^n = false alarm (Sidak 1967).
pub fn each(false_alarm: f64, comparisons: usize) -> f64 {
    1.0 - (1.0 - false_alarm).powf(1.0 / comparisons as f64)
}

/// Standard errors that a probability stands for, of a normal distribution.
pub fn sigmas(probability: f64) -> f64 {
    -statrs::distribution::Normal::standard().inverse_cdf(0.5 * probability.max(1e-300))
}

#[test]
fn a_difference_is_judged_by_students_t() {
    let found = Measured { value: 1.0, error: 0.1, degrees: 11.0 };
    let exact = |value: f64| Measured { value, error: 0.0, degrees: KNOWN };
    // Abramowitz and Stegun 1964, table 26.10: 2.201 for 0.95 and 11 degrees
    let verdict = compare(found, exact(1.2201), 0.0);
    assert!((verdict.probability - 0.05).abs() < 1e-4 && (verdict.t + 2.201).abs() < 1e-6, "{verdict:?}");
    assert_eq!(compare(found, exact(1.2), 0.2).probability, 1.0);
    assert_eq!(compare(exact(1.0), exact(1.0 + 1e-12), 0.0).probability, 1.0);
    assert_eq!(compare(exact(1.0), exact(1.001), 0.0).probability, 0.0);
}

#[test]
fn a_common_deviation_is_seen_in_the_pool() {
    let one = Deviation { value: 0.01, noise: 0.01, bias: 0.0, degrees: 31.0 };
    let (mean, verdict) = pool(&[one; 64]);
    assert!((mean.value - 0.01).abs() < 1e-15 && (7.0..8.0).contains(&verdict.t), "{mean:?} {verdict:?}");
    let biased = Deviation { bias: 0.01, ..one };
    assert!(pool(&[biased; 64]).1.t < 1.0);
}

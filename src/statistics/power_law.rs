//! How the error of a running estimate falls with time: a power law, its exponent with a standard error, and what it foretells.

use super::interval::two_sided_student_quantile;

/// Fewest points that a fit takes: three steps between them, for an exponent and two degrees of freedom.
const FEWEST_POINTS: usize = 4;

/// The error of an estimate after some passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorPoint {
    /// Passes done, at least 2: one pass alone tells no error.
    pub passes: f64,
    /// Time that they took, above zero, in whatever unit the fit is to have.
    pub seconds: f64,
    /// Standard error, or a multiple of it, above zero.
    pub error: f64,
}

/// The law `error = last error * (seconds / last seconds)^exponent`, fitted to the errors that a job told after its passes.
///
/// Such errors are not independent: the one after 20 passes is made of the same passes as the one after 10, and of ten more. The
/// square of a standard error after n passes is a mean over n - 1 degrees of freedom, so that the logarithms of two of them,
/// after m < n passes, have the covariance of a random walk that runs backwards in u = 1 / (n - 1): tau^2 / (n - 1), whatever
/// m. Steps from one point to the next are therefore independent, with the variance tau^2 (u_m - u_n), and weighted least
/// squares over the steps is the best linear estimate (Gauss and Markov). The last point is met exactly, for what comes before
/// it says nothing about its deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// Slope in double logarithms: -1/2 of independent passes.
    pub exponent: f64,
    /// Standard error of the exponent.
    pub standard_error: f64,
    /// Degrees of freedom of the standard error, at least 2.
    pub degrees: usize,
    /// The last point, from which the law goes on.
    pub last: ErrorPoint,
    /// Standard deviation of the logarithm of the last error.
    deviation: f64,
}

/// A time that a law foretells, with an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Foretold {
    /// Time at which the law has the error that was asked for.
    pub seconds: f64,
    /// Lower end of the interval.
    pub from: f64,
    /// Upper end of the interval; infinite where it cannot be said that the error falls at all.
    pub to: f64,
}

impl PowerLaw {
    /// Fits the law to points in the order of their passes; those that no logarithm takes, and those that do not come after
    /// the one before, are left out. `None` with fewer than four others.
    pub fn fit(points: &[ErrorPoint]) -> Option<Self> {
        let mut usable: Vec<ErrorPoint> = Vec::new();
        for point in points.iter().filter(|point| is_usable(point)) {
            if usable.last().is_none_or(|last| last.passes < point.passes && last.seconds < point.seconds) {
                usable.push(*point);
            }
        }
        if usable.len() < FEWEST_POINTS {
            return None;
        }
        let last = *usable.last()?;
        // weight, and the steps of the logarithms of time and error
        let steps: Vec<[f64; 3]> = usable
            .windows(2)
            .map(|pair| {
                let weight = 1.0 / (1.0 / (pair[0].passes - 1.0) - 1.0 / (pair[1].passes - 1.0));
                [weight, libm::log(pair[1].seconds / pair[0].seconds), libm::log(pair[1].error / pair[0].error)]
            })
            .collect();
        let of_times: f64 = steps.iter().map(|[weight, time, _]| weight * time * time).sum();
        let exponent = steps.iter().map(|[weight, time, error]| weight * time * error).sum::<f64>() / of_times;
        let degrees = steps.len() - 1;
        let residuals = steps.iter().map(|[weight, time, error]| {
            let residual = error - exponent * time;
            weight * residual * residual
        });
        let tau_squared = residuals.sum::<f64>() / degrees as f64;
        let standard_error = (tau_squared / of_times).sqrt();
        let deviation = (tau_squared / (last.passes - 1.0)).sqrt();
        let law = Self { exponent, standard_error, degrees, last, deviation };
        (exponent.is_finite() && standard_error.is_finite()).then_some(law)
    }

    /// Error after `seconds`, above zero.
    pub fn error_at(&self, seconds: f64) -> f64 {
        self.last.error * libm::pow(seconds / self.last.seconds, self.exponent)
    }

    /// Interval around [`Self::error_at`] that has the law with a confidence of `confidence`, 0..1.
    pub fn band_at(&self, seconds: f64, confidence: f64) -> [f64; 2] {
        let beyond = libm::log(seconds / self.last.seconds) * self.standard_error;
        let half = two_sided_student_quantile(confidence, self.degrees as f64) * libm::hypot(beyond, self.deviation);
        [-half, half].map(|half| self.error_at(seconds) * libm::exp(half))
    }

    /// Time at which the law has `error`, above zero, and the interval that slopes within `confidence` have; `None` where the
    /// error does not fall.
    pub fn seconds_to(&self, error: f64, confidence: f64) -> Option<Foretold> {
        let half = two_sided_student_quantile(confidence, self.degrees as f64) * self.standard_error;
        let with_slope = |slope: f64| self.last.seconds * libm::pow(error / self.last.error, 1.0 / slope);
        let [steep, flat] = [self.exponent - half, self.exponent + half];
        if self.exponent >= 0.0 || !with_slope(self.exponent).is_finite() {
            return None;
        }
        let slowest = if flat < 0.0 { with_slope(flat) } else { f64::INFINITY };
        Some(Foretold { seconds: with_slope(self.exponent), from: with_slope(steep), to: slowest })
    }
}

fn is_usable(point: &ErrorPoint) -> bool {
    let is_positive = |value: f64| value.is_finite() && value > 0.0;
    point.passes >= 2.0 && is_positive(point.seconds) && is_positive(point.error)
}

#[cfg(test)]
mod tests {
    use rand_core::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    fn point(passes: u32, seconds: f64, error: f64) -> ErrorPoint {
        ErrorPoint { passes: f64::from(passes), seconds, error }
    }

    #[test]
    fn a_law_without_noise_is_found_and_goes_on() {
        let points: Vec<_> = (2..40).map(|k| point(k, 0.1 * f64::from(k), 3.0 * f64::from(k).powf(-0.75))).collect();
        let law = PowerLaw::fit(&points).unwrap();
        assert!((law.exponent + 0.75).abs() < 1e-12 && law.standard_error < 1e-12, "{law:?}");
        assert_eq!(law.degrees, 36);
        let ten_times = law.seconds_to(law.last.error / 10.0, 0.95).unwrap();
        let expected = 3.9 * 10f64.powf(1.0 / 0.75);
        assert!((ten_times.seconds / expected - 1.0).abs() < 1e-9, "{ten_times:?}");
        assert!((law.error_at(ten_times.seconds) * 10.0 / law.last.error - 1.0).abs() < 1e-9);
    }

    #[test]
    fn few_points_and_errors_that_do_not_fall_foretell_nothing() {
        assert_eq!(PowerLaw::fit(&[]), None);
        let few: Vec<_> = (1..5).map(|k| point(k, f64::from(k), 1.0 / f64::from(k))).collect();
        assert_eq!(PowerLaw::fit(&few), None, "the first pass has no error");
        let bad = [point(2, 1.0, f64::NAN), point(3, 0.0, 1.0), point(4, 2.0, 0.0), point(5, 3.0, f64::INFINITY)];
        assert_eq!(PowerLaw::fit(&bad), None);
        let rising: Vec<_> = (2..9).map(|k| point(k, f64::from(k), f64::from(k))).collect();
        assert_eq!(PowerLaw::fit(&rising).unwrap().seconds_to(0.1, 0.95), None);
    }

    /// Independent passes of 20 sensors with a true slope of -1/2: the 95 % interval of the slope has it in 95 % of the runs,
    /// within four standard errors of that share.
    #[test]
    fn the_interval_of_the_slope_covers_it_as_often_as_it_says() {
        const RUNS: u32 = 400;
        const SENSORS: usize = 20;
        let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
        let mut uniform = || (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        let mut covered = 0;
        for _ in 0..RUNS {
            let (mut sums, mut squares) = ([0.0; SENSORS], [0.0; SENSORS]);
            let mut points = Vec::new();
            for pass in 1..=32u32 {
                for (sum, square) in sums.iter_mut().zip(&mut squares) {
                    let radius = (-2.0 * (1.0 - uniform()).ln()).sqrt();
                    let value = radius * (std::f64::consts::TAU * uniform()).cos();
                    *sum += value;
                    *square += value * value;
                }
                let n = f64::from(pass);
                let variance: f64 = sums.iter().zip(&squares).map(|(sum, square)| square - sum * sum / n).sum();
                points.push(point(pass, n, (variance / (n * (n - 1.0).max(1.0))).sqrt()));
            }
            let law = PowerLaw::fit(&points).unwrap();
            let half = two_sided_student_quantile(0.95, law.degrees as f64) * law.standard_error;
            covered += u32::from((law.exponent + 0.5).abs() < half);
        }
        let share = f64::from(covered) / f64::from(RUNS);
        let tolerance = 4.0 * (0.95 * 0.05 / f64::from(RUNS)).sqrt();
        assert!((share - 0.95).abs() < tolerance, "{share} +- {tolerance}");
    }
}

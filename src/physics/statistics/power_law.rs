//! Power law by which the error of a running estimate falls with time: its exponent with a standard error, and predicted times.

use super::interval::two_sided_student_quantile;

/// Fewest points for a fit: three steps between them, for an exponent and two degrees of freedom.
const FEWEST_POINTS: usize = 4;

/// Exponent of the error of independent passes that all take the same time: sqrt(1 / n).
pub const OF_INDEPENDENT_PASSES: f64 = -0.5;

/// Prior standard deviation of exponents about [`OF_INDEPENDENT_PASSES`]. Passes of most methods are independent; kernels that shrink, and
/// biases that do not, give exponents up to -0.4 or -0.3, which the errors show in time.
const SPREAD: f64 = 0.05;

/// Prior noise of errors, as tau^2 of [`PowerLaw`]: that of one quantity whose passes are normal. The logarithm of its standard error after
/// n passes has the variance 1 / (2 (n - 1)).
const ASSUMED_NOISE: f64 = 0.5;

/// Degrees of freedom by which the prior noise is weighted: a few errors that lie on a line by chance are not taken as certain.
const ASSUMED_DEGREES: usize = 4;

/// Largest factor between a predicted time and the one by which errors fall with [`OF_INDEPENDENT_PASSES`].
const MOST_FROM_ROOT_LAW: f64 = 10.0;

/// Largest factor between a predicted time and an end of its interval.
pub const WIDEST: f64 = 1000.0;

/// Error of an estimate after some passes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorPoint {
    /// Number of passes done, at least 2: a single pass gives no error.
    pub passes: f64,
    /// Time that the passes took, above zero, in the unit that the fit is to have.
    pub seconds: f64,
    /// Standard error, or a multiple of it, above zero.
    pub error: f64,
}

/// Law `error = last error * (seconds / last seconds)^exponent`, fitted to the errors that a job estimated after its passes.
///
/// Such errors are not independent: the one after 20 passes is made of the same passes as the one after 10, and of ten more. The square of
/// a standard error after n passes is a mean over n - 1 degrees of freedom, so that the logarithms of two of them, after m < n passes, have
/// the covariance of a random walk that runs backwards in u = 1 / (n - 1): tau^2 / (n - 1), whatever m. Steps from one point to the next
/// are therefore independent, with the variance tau^2 (u_m - u_n), and weighted least squares over the steps is the best linear estimate
/// (Gauss and Markov). The law passes exactly through the last point, because earlier points contain no information about its deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PowerLaw {
    /// Slope in double logarithms: -1/2 for independent passes.
    pub exponent: f64,
    /// Standard error of the exponent.
    pub standard_error: f64,
    /// Degrees of freedom of the standard error, at least 2.
    pub degrees: usize,
    /// Last point, from which the law extrapolates.
    pub last: ErrorPoint,
    /// Standard deviation of the logarithm of the last error.
    deviation: f64,
}

/// Time predicted by a law, with an interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimePrediction {
    /// Time at which the law has the requested error.
    pub seconds: f64,
    /// Lower end of the interval.
    pub from: f64,
    /// Upper end of the interval, at most a thousand times `seconds`.
    pub to: f64,
}

/// Accumulated errors of a running estimate, from which its law can be computed at any time: sums over the steps between points, so that
/// one more point costs the same however many there were.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ErrorSteps {
    last: Option<ErrorPoint>,
    steps: usize,
    /// Weighted sums of products of the logarithmic steps: of time and time, time and error, error and error.
    of_times: f64,
    of_both: f64,
    of_errors: f64,
}

impl ErrorSteps {
    /// Accumulates the steps between points in the order of their passes.
    pub fn of(points: &[ErrorPoint]) -> Self {
        let mut steps = Self::default();
        points.iter().for_each(|point| steps.push(*point));
        steps
    }

    /// Adds the next point. A point is ignored if its error or time has no logarithm, or if it does not come after those before.
    pub fn push(&mut self, point: ErrorPoint) {
        if !is_usable(&point) {
            return;
        }
        if let Some(last) = self.last {
            if last.passes >= point.passes || last.seconds >= point.seconds {
                return;
            }
            let weight = 1.0 / (1.0 / (last.passes - 1.0) - 1.0 / (point.passes - 1.0));
            let (time, error) = (libm::log(point.seconds / last.seconds), libm::log(point.error / last.error));
            self.of_times += weight * time * time;
            self.of_both += weight * time * error;
            self.of_errors += weight * error * error;
            self.steps += 1;
        }
        self.last = Some(point);
    }

    /// Fits the law by weighted least squares; `None` with fewer than four points.
    pub fn law(&self) -> Option<PowerLaw> {
        let last = self.last.filter(|_| self.steps + 1 >= FEWEST_POINTS)?;
        let exponent = self.of_both / self.of_times;
        let degrees = self.steps - 1;
        // without noise only the rounding of the sums remains
        let tau_squared = (self.of_errors - exponent * self.of_both).max(0.0) / degrees as f64;
        let standard_error = (tau_squared / self.of_times).sqrt();
        let deviation = (tau_squared / (last.passes - 1.0)).sqrt();
        let law = PowerLaw { exponent, standard_error, degrees, last, deviation };
        (exponent.is_finite() && standard_error.is_finite()).then_some(law)
    }

    /// Returns the law for predicting times, from one point on; `None` without a usable point.
    ///
    /// Exponent and noise are estimated together with prior values: the exponent is the mean of [`OF_INDEPENDENT_PASSES`] and of the fitted
    /// one, weighted by their inverse variances, and the variance of the noise is the mean of the prior one and of that of the residuals,
    /// weighted by their degrees of freedom. A few points are extrapolated by the square root, and their weight grows with each further
    /// point.
    pub fn predictive_law(&self) -> Option<PowerLaw> {
        let last = self.last?;
        let observed = self.steps.saturating_sub(1);
        let degrees = ASSUMED_DEGREES + observed;
        let explained = if self.of_times > 0.0 { self.of_both * self.of_both / self.of_times } else { 0.0 };
        let residuals = (self.of_errors - explained).max(0.0);
        let tau_squared = (ASSUMED_DEGREES as f64 * ASSUMED_NOISE + residuals) / degrees as f64;
        let (assumed, fitted) = (1.0 / (SPREAD * SPREAD), self.of_times / tau_squared);
        let exponent = (assumed * OF_INDEPENDENT_PASSES + self.of_both / tau_squared) / (assumed + fitted);
        let standard_error = (assumed + fitted).recip().sqrt();
        let deviation = (tau_squared / (last.passes - 1.0)).sqrt();
        let law = PowerLaw { exponent, standard_error, degrees, last, deviation };
        (exponent.is_finite() && standard_error.is_finite()).then_some(law)
    }
}

impl PowerLaw {
    /// Fits the law to points in the order of their passes, as [`ErrorSteps`] accumulates them. `None` with fewer than four.
    pub fn fit(points: &[ErrorPoint]) -> Option<Self> {
        ErrorSteps::of(points).law()
    }

    /// Returns the error after `seconds`, above zero.
    pub fn error_at(&self, seconds: f64) -> f64 {
        self.last.error * libm::pow(seconds / self.last.seconds, self.exponent)
    }

    /// Returns the time, not before that of the last point, at which the law has `error` (above zero) or less. It is at most ten times, and
    /// at least a tenth of, the time by which errors that fall by the square root would get there: the exponent is uncertain, and far
    /// beyond the last point a small deviation of it would be a factor of thousands.
    pub fn time_of(&self, error: f64) -> f64 {
        let ratio = self.last.error / error;
        if ratio.is_nan() || ratio <= 1.0 {
            return self.last.seconds;
        }
        let by_the_root = ratio * ratio;
        let own = if self.exponent < 0.0 { libm::pow(ratio, -1.0 / self.exponent) } else { f64::INFINITY };
        let bounds = [by_the_root / MOST_FROM_ROOT_LAW, by_the_root * MOST_FROM_ROOT_LAW];
        self.last.seconds * own.clamp(bounds[0].max(1.0), bounds[1])
    }

    /// Returns the interval around [`Self::error_at`] that contains the law with probability `confidence`, 0..1.
    pub fn band_at(&self, seconds: f64, confidence: f64) -> [f64; 2] {
        let beyond = libm::log(seconds / self.last.seconds) * self.standard_error;
        let half = two_sided_student_quantile(confidence, self.degrees as f64) * libm::hypot(beyond, self.deviation);
        [-half, half].map(|half| self.error_at(seconds) * libm::exp(half))
    }

    /// Returns [`Self::time_of`] `error`, above zero, with the interval for exponents and last errors within `confidence`. Its ends differ
    /// from the time by a factor of a thousand at most.
    pub fn seconds_to(&self, error: f64, confidence: f64) -> TimePrediction {
        let seconds = self.time_of(error);
        let half = two_sided_student_quantile(confidence, self.degrees as f64);
        let ratio = libm::log(self.last.error / error).max(0.0);
        let with = |exponent: f64| if exponent < 0.0 { -ratio / exponent } else { f64::INFINITY };
        let middle = libm::log(seconds / self.last.seconds);
        let [sooner, later] = [-1.0, 1.0].map(|side| with(self.exponent + side * half * self.standard_error) - middle);
        // by the square root, the logarithm of the time has twice the deviation of that of the error
        let of_last = 2.0 * half * self.deviation;
        let off = |beside: f64| libm::exp(libm::hypot(beside, of_last).min(libm::log(WIDEST)));
        TimePrediction {
            seconds,
            from: (seconds / off(sooner.min(0.0))).max(self.last.seconds),
            to: seconds * off(later.max(0.0)),
        }
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
        // the residuals of 36 steps are what rounding leaves of their sums
        assert!((law.exponent + 0.75).abs() < 1e-12 && law.standard_error < 1e-8, "{law:?}");
        assert_eq!(law.degrees, 36);
        let ten_times = law.seconds_to(law.last.error / 10.0, 0.95);
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
    }

    /// Errors that rise, or hardly fall, many or few of them: no predicted time is more than ten times that of the square root, and no end
    /// of an interval is more than a thousand times off.
    #[test]
    fn no_course_of_errors_foretells_nonsense() {
        for (exponent, wave) in [(1.0, 0.0), (0.0, 0.0), (-0.01, 0.3), (-0.1, 0.0), (-0.5, 0.5), (-3.0, 0.0)] {
            for count in [2, 3, 4, 5, 8, 40, 2000] {
                let error = |k: u32| f64::from(k).powf(exponent) * (1.0 + wave * f64::from(k).sin());
                let points: Vec<_> = (2..2 + count).map(|k| point(k, 0.1 * f64::from(k), error(k))).collect();
                for law in [PowerLaw::fit(&points), ErrorSteps::of(&points).predictive_law()].into_iter().flatten() {
                    for ratio in [0.5, 1.0, 1.01, 3.0, 100.0, 1e6] {
                        let predicted = law.seconds_to(law.last.error / ratio, 0.95);
                        let by_the_root = law.last.seconds * ratio.max(1.0).powi(2);
                        let within = |value: f64, factor: f64, of: f64| {
                            value <= factor * of * (1.0 + 1e-12) && value * factor * (1.0 + 1e-12) >= of
                        };
                        assert!(
                            within(predicted.seconds, 10.0, by_the_root),
                            "{exponent} {count} {ratio}: {predicted:?}"
                        );
                        assert!(
                            within(predicted.from, 1000.0, predicted.seconds)
                                && within(predicted.to, 1000.0, predicted.seconds)
                                && predicted.from <= predicted.seconds
                                && predicted.to >= predicted.seconds,
                            "{exponent} {count} {ratio}: {predicted:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn few_points_are_extrapolated_by_the_square_root_and_many_by_themselves() {
        assert_eq!(ErrorSteps::of(&[point(1, 1.0, 0.1)]).predictive_law(), None, "one pass tells no error");
        let one = ErrorSteps::of(&[point(2, 0.2, 0.1)]).predictive_law().unwrap();
        assert_eq!((one.exponent, one.standard_error, one.degrees), (-0.5, SPREAD, ASSUMED_DEGREES));
        // a tenth of the error is a hundred times the work
        let predicted = one.seconds_to(0.01, 0.95);
        assert!((predicted.seconds / (100.0 * one.last.seconds) - 1.0).abs() < 1e-12);
        assert!(predicted.from < predicted.seconds && predicted.to > predicted.seconds);
        // however the errors lie, eight passes move the exponent by less than an end of what is assumed
        let courses: [fn(u32) -> f64; 3] = [|_| 1.0, |k| 1.0 / f64::from(k), |k| if k == 8 { 1.0 } else { 0.2 }];
        for error in courses {
            let points: Vec<_> = (2..=8).map(|k| point(k, f64::from(k), error(k))).collect();
            let law = ErrorSteps::of(&points).predictive_law().unwrap();
            assert!((law.exponent + 0.5).abs() < 2.0 * SPREAD, "{law:?}");
        }
        // the weight of the points grows with their number
        let exponent = |count: u32| {
            let points: Vec<_> = (2..count).map(|k| point(k, f64::from(k), f64::from(k).powf(-0.3))).collect();
            ErrorSteps::of(&points).predictive_law().unwrap().exponent
        };
        let exponents = [8, 16, 64, 256, 4096].map(exponent);
        assert!(exponents.is_sorted() && exponents[0] < -0.45 && exponents[4] > -0.301, "{exponents:?}");
    }

    /// Independent passes of 20 sensors with a true slope of -1/2: the 95 % interval of the slope contains it in 95 % of the runs, within
    /// four standard errors of that fraction.
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
        let fraction = f64::from(covered) / f64::from(RUNS);
        let tolerance = 4.0 * (0.95 * 0.05 / f64::from(RUNS)).sqrt();
        assert!((fraction - 0.95).abs() < tolerance, "{fraction} +- {tolerance}");
    }
}

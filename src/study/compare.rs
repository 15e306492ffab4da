//! Comparison of the values of grids with those of a reference, as all studies make it.

use serde::{Deserialize, Serialize};

use crate::document::result::GridResult;
use crate::estimate::{Estimate, FilmEstimate, GridEstimate};
use crate::integrator::pass::LEAST_SHARE_OF_MEAN;
use crate::statistics::interval::two_sided_student_quantile;

/// Illuminances with their standard errors in lux, for all grids of a job in sequence.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Values {
    /// Illuminances in lux; NaN inside solids.
    pub lux: Vec<f64>,
    /// Standard errors in lux; infinite where they are not available.
    pub errors: Vec<f64>,
    /// Number of sensors of each grid.
    pub grids: Vec<usize>,
    /// Degrees of freedom of the errors; infinite for those that are not estimated from passes.
    pub degrees_of_freedom: f64,
}

/// Degrees of freedom from which on Student's quantiles are the normal ones.
const MANY: f64 = 1e9;

/// Returns the fewest degrees of freedom of some grids.
fn least(degrees: impl Iterator<Item = f64>) -> f64 {
    degrees.fold(f64::INFINITY, f64::min)
}

/// Deviation of a job's values from those of a reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Deviation {
    /// Mean square of the relative deviations, including the variance of the reference.
    pub squared_error: f64,
    /// Fraction of the sensors whose interval contains the reference; `None` if no errors are available.
    pub covered: Option<f64>,
}

impl Values {
    /// Returns the values of an estimate of at least one pass.
    pub fn of_estimate(estimate: &Estimate) -> Self {
        let grids = &estimate.grids;
        let each = |of: fn(&GridEstimate, usize) -> f64| -> Vec<f64> {
            grids.iter().flat_map(|grid| (0..grid.sensors.len()).map(move |sensor| of(grid, sensor))).collect()
        };
        Self {
            lux: each(|grid, sensor| if grid.has_value(sensor) { grid.illuminance_lux(sensor) } else { f64::NAN }),
            errors: each(GridEstimate::standard_error_lux),
            grids: grids.iter().map(|grid| grid.sensors.len()).collect(),
            degrees_of_freedom: least(grids.iter().map(GridEstimate::degrees_of_freedom)),
        }
    }

    /// Returns the values of the grids of a finished job of so many passes, in the document's order.
    pub fn of_results(results: &[GridResult], passes: u64) -> Self {
        let errors = results.iter().flat_map(|grid| grid.standard_error_lux.iter().flatten());
        Self {
            lux: results
                .iter()
                .flat_map(|grid| grid.illuminance_lux.iter().flatten().map(|lux| lux.unwrap_or(f64::NAN)))
                .collect(),
            errors: errors.map(|error| error.unwrap_or(f64::INFINITY)).collect(),
            grids: results.iter().map(|grid| grid.illuminance_lux.iter().map(Vec::len).sum()).collect(),
            degrees_of_freedom: least(
                results.iter().map(|grid| grid.degrees_of_freedom.unwrap_or(passes.saturating_sub(1) as f64)),
            ),
        }
    }

    /// Returns the luminances in cd/m2 of blocks of 8 x 8 pixels, in place of the illuminances of sensors.
    pub fn of_view(film: &FilmEstimate) -> Self {
        let lux: Vec<f64> = film.blocks.iter().map(|block| block.mean).collect();
        let errors = (0..lux.len()).map(|block| film.block_standard_error_cd_m2(block)).collect();
        Self { grids: vec![lux.len()], lux, errors, degrees_of_freedom: film.passes - 1.0 }
    }

    /// Returns the value in lux that the error of each sensor is divided by, if these are the values of a reference: the sensor's
    /// own, or a hundredth of its grid's mean if that is larger.
    fn scales(&self) -> Vec<f64> {
        let mut rest = self.lux.as_slice();
        let mut scales = Vec::with_capacity(rest.len());
        for sensors in &self.grids {
            let (grid, others) = rest.split_at(*sensors);
            let mean = mean(grid.iter().copied().filter(|lux| !lux.is_nan()));
            let scale = |lux: &f64| if lux.is_nan() { f64::NAN } else { lux.max(LEAST_SHARE_OF_MEAN * mean) };
            scales.extend(grid.iter().map(scale));
            rest = others;
        }
        scales
    }

    /// Returns the deviation from a reference, and the fraction of the intervals at a confidence that contain it.
    pub fn deviation(&self, truth: &Self, confidence: f64) -> Deviation {
        Deviation { squared_error: self.squared_error(truth), covered: self.covered(truth, confidence) }
    }

    /// Returns the mean square of the relative deviations from a reference, including the reference's variance.
    pub fn squared_error(&self, truth: &Self) -> f64 {
        let deviations = self.lux.iter().zip(&truth.lux).zip(truth.scales());
        let deviations = deviations.filter(|((value, _), scale)| *scale > 0.0 && !value.is_nan());
        mean(deviations.map(|((value, truth), scale)| ((value - truth) / scale).powi(2)))
    }

    /// Returns the mean of the squared relative standard errors, which a reference adds to squared errors; `None` if no errors
    /// are available.
    pub fn relative_variance(&self) -> Option<f64> {
        let known = self.errors.iter().zip(self.scales()).filter(|(error, scale)| error.is_finite() && *scale > 0.0);
        let known: Vec<f64> = known.map(|(error, scale)| (error / scale).powi(2)).collect();
        (!known.is_empty()).then(|| mean(known.into_iter()))
    }

    /// Returns the fraction of the sensors whose interval contains the reference, with the reference's error included in the
    /// interval; `None` if no errors are available.
    pub fn covered(&self, truth: &Self, confidence: f64) -> Option<f64> {
        let quantile = two_sided_student_quantile(confidence, self.degrees_of_freedom.clamp(1.0, MANY));
        let sensors = self.lux.iter().zip(&self.errors).zip(truth.lux.iter().zip(&truth.errors));
        let told = sensors.filter(|((lux, error), (truth, _))| error.is_finite() && !lux.is_nan() && !truth.is_nan());
        let held: Vec<f64> =
            told.map(|(value, truth)| f64::from(holds((*value.0, *value.1), (*truth.0, *truth.1), quantile))).collect();
        (!held.is_empty()).then(|| mean(held.into_iter()))
    }
}

/// True if the deviation of a value from a true value is at most `quantile` times the root sum square of their standard errors.
/// An error of the true value that is not finite counts as zero.
pub fn holds((value, error): (f64, f64), (truth, truth_error): (f64, f64), quantile: f64) -> bool {
    let error = libm::hypot(error, if truth_error.is_finite() { truth_error } else { 0.0 });
    // closed forms of both agree up to rounding
    (value - truth).abs() <= quantile * error + 1e-9 * truth.abs()
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for value in values {
        sum += value;
        count += 1.0;
    }
    sum / count.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(lux: &[f64], error: f64) -> Values {
        Values { lux: lux.to_vec(), errors: vec![error; lux.len()], grids: vec![lux.len()], degrees_of_freedom: 1e6 }
    }

    /// Deviations of one percent at 100 lx and two at 50 lx; the error of a dark sensor is relative to a hundredth of the mean.
    #[test]
    fn errors_are_relative_to_the_reference() {
        let truth = values(&[100.0, 50.0], 0.5);
        assert!((values(&[101.0, 49.0], 0.0).squared_error(&truth) - 0.5 * (1e-4 + 4e-4)).abs() < 1e-15);
        assert!((truth.relative_variance().unwrap() - 0.5 * (2.5e-5 + 1e-4)).abs() < 1e-15);
        assert_eq!(values(&[100.0], f64::INFINITY).relative_variance(), None);
        let dark = values(&[200.0, 0.0], 0.0);
        assert!((values(&[200.0, 0.01], 0.0).squared_error(&dark) - 0.5 * 1e-4).abs() < 1e-15);
        assert_eq!(values(&[0.0], 0.0).squared_error(&values(&[0.0], 0.0)), 0.0);
    }

    #[test]
    fn intervals_hold_the_reference_or_not() {
        let truth = values(&[10.0, 10.0, 10.0, 10.0], 0.0);
        // 1.96 standard errors
        assert_eq!(values(&[10.19, 9.81, 10.21, 9.9], 0.1).covered(&truth, 0.95), Some(0.75));
        assert_eq!(values(&[10.19; 4], f64::INFINITY).covered(&truth, 0.95), None);
        assert_eq!(values(&[10.0; 4], 0.0).covered(&truth, 0.95), Some(1.0));
        // 0.15 of the value and 0.2 of the truth are 0.25 together
        let rough = values(&[10.0], 0.2);
        assert_eq!(values(&[10.48], 0.15).covered(&rough, 0.95), Some(1.0));
        assert_eq!(values(&[10.5], 0.15).covered(&rough, 0.95), Some(0.0));
    }
}

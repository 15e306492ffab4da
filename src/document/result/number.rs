//! Conversions of numbers for results.

use crate::estimate::GridEstimate;
use crate::estimate::grid_statistics::CONFIDENCE;
use crate::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};

/// Returns the value, or `None` (null in JSON) if it is infinite or not a number.
pub fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Returns the coverage factor of GUM, the number of standard errors that are half an interval of 95 %: Student's quantile for
/// `count` - 1 degrees of freedom (`count` passes), or the normal quantile for estimated `numerical` errors; `None` before the
/// second pass.
pub fn coverage_factor(count: f64, numerical: bool) -> Option<f64> {
    with_degrees(count, count - 1.0, numerical)
}

/// Returns the coverage factor of the standard errors of the sensors of a grid; `None` before the second pass.
pub fn coverage_factor_of_sensors(estimate: &GridEstimate) -> Option<f64> {
    with_degrees(estimate.passes(), degrees_of_sensors(estimate), estimate.numerical)
}

/// Returns the degrees of freedom of the standard errors of the sensors of a grid: the fewest of the whole and of its parts.
pub fn degrees_of_sensors(estimate: &GridEstimate) -> f64 {
    let all = std::iter::once(estimate).chain(&estimate.companions);
    all.map(GridEstimate::degrees_of_freedom).fold(f64::INFINITY, f64::min)
}

fn with_degrees(count: f64, degrees: f64, numerical: bool) -> Option<f64> {
    if count < 2.0 {
        None
    } else if numerical {
        finite(two_sided_normal_quantile(CONFIDENCE))
    } else {
        finite(two_sided_student_quantile(CONFIDENCE, degrees))
    }
}

/// Splits values into rows of `columns`.
pub fn rows<T: Clone>(values: &[T], columns: usize) -> Vec<Vec<T>> {
    values.chunks(columns.max(1)).map(<[T]>::to_vec).collect()
}

/// Returns the illuminance of a sensor; `None` inside solids.
pub(super) fn value(estimate: &GridEstimate, sensor: usize) -> Option<f64> {
    estimate.has_value(sensor).then(|| estimate.illuminance_lux(sensor))
}

/// Returns the standard error of a sensor; `None` inside solids, and where it is not finite.
pub(super) fn error(estimate: &GridEstimate, sensor: usize) -> Option<f64> {
    finite(estimate.standard_error_lux(sensor)).filter(|_| estimate.has_value(sensor))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with tabulated quantiles of Student for 1 and 7 degrees of freedom.
    #[test]
    fn coverage_factors_follow_the_passes() {
        for (count, numerical, factor) in
            [(2.0, false, 12.706), (8.0, false, 2.365), (1e9, false, 1.96), (2.0, true, 1.96)]
        {
            assert!((coverage_factor(count, numerical).unwrap() - factor).abs() < 1e-3, "{count} {numerical}");
        }
        assert_eq!([0.0, 1.0].map(|count| coverage_factor(count, true).or(coverage_factor(count, false))), [None; 2]);
    }
}

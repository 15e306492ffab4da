//! Numbers of results.

use crate::estimate::GridEstimate;
use crate::estimate::grid_statistics::CONFIDENCE;
use crate::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};

/// JSON has no infinity: `None` becomes null.
pub fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Returns the number of standard errors on either side of a value that are its interval of 95 %, GUM's coverage factor: Student's
/// quantile for one less than the `count` of passes, the normal one of estimated `numerical` errors; `None` before the second pass.
pub fn coverage_factor(count: f64, numerical: bool) -> Option<f64> {
    if count < 2.0 {
        None
    } else if numerical {
        finite(two_sided_normal_quantile(CONFIDENCE))
    } else {
        finite(two_sided_student_quantile(CONFIDENCE, count - 1.0))
    }
}

/// Values in rows of `columns`.
pub fn rows<T: Clone>(values: &[T], columns: usize) -> Vec<Vec<T>> {
    values.chunks(columns.max(1)).map(<[T]>::to_vec).collect()
}

/// Value of a sensor; `None` inside solids.
pub(super) fn value(estimate: &GridEstimate, sensor: usize) -> Option<f64> {
    estimate.has_value(sensor).then(|| estimate.illuminance_lux(sensor))
}

/// Standard error of a sensor, where it has a value and something is known of its error.
pub(super) fn error(estimate: &GridEstimate, sensor: usize) -> Option<f64> {
    finite(estimate.standard_error_lux(sensor)).filter(|_| estimate.has_value(sensor))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Student's quantiles of tables for 1 and 7 degrees of freedom.
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

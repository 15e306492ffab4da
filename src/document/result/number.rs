//! Numbers of results.

use crate::estimate::GridEstimate;

/// JSON has no infinity: `None` becomes null.
pub fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
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

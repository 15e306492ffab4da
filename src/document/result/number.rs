//! Numbers of results.

/// JSON has no infinity: `None` becomes null.
pub fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// Values in rows of `columns`.
pub fn rows<T: Clone>(values: &[T], columns: usize) -> Vec<Vec<T>> {
    values.chunks(columns.max(1)).map(<[T]>::to_vec).collect()
}

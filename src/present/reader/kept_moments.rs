//! Values of a grid at all moments of a year, as the file that is kept of them.

use crate::annual::metrics::Value;
use crate::output::npy;

/// Writes the values of a grid at all moments, and then their standard errors, sensor by sensor.
pub fn moments_npy(values: &[Value]) -> Vec<u8> {
    let of = |of: fn(&Value) -> f64| values.iter().map(move |value| of(value) as f32);
    npy::encode([2, values.len()], of(|value| value.value).chain(of(|value| value.standard_error)))
}

/// Reads what [`moments_npy`] wrote.
pub fn moments_of_npy(bytes: &[u8]) -> Result<Vec<Value>, String> {
    let numbers = npy::read(bytes).map_err(|error| error.to_string())?.values;
    let (values, errors) = numbers.split_at(numbers.len() / 2);
    let value = |(value, error): (&f32, &f32)| Value { value: f64::from(*value), standard_error: f64::from(*error) };
    Ok(values.iter().zip(errors).map(value).collect())
}

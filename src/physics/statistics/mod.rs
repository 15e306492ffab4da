//! Means, standard errors, confidence intervals, and the law by which errors fall with time.

pub mod interval;
pub mod moments;
pub mod power_law;

pub use moments::Moments;

/// Returns the median of some values, of an even number the greater one in the middle; 0 without values.
///
/// ```
/// use skyduct_physics::statistics::median;
///
/// assert_eq!([median(vec![3.0, 1.0, 2.0]), median(vec![1.0, 4.0]), median(Vec::new())], [2.0, 4.0, 0.0]);
/// ```
pub fn median(mut values: Vec<f64>) -> f64 {
    let middle = values.len() / 2;
    if values.is_empty() { 0.0 } else { *values.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

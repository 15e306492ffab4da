//! Deviations from a reference, collected into one check.

use crate::page::Check;

/// Deviations collected into one check.
pub struct Deviations {
    name: String,
    compared: usize,
    /// Largest absolute deviation so far.
    pub worst: f64,
}

impl Deviations {
    pub fn new(name: impl Into<String>) -> Self {
        Self { name: name.into(), compared: 0, worst: 0.0 }
    }

    /// Adds a deviation of any sign; NaN counts as infinite.
    pub fn add(&mut self, deviation: f64) {
        self.compared += 1;
        self.worst = if deviation.is_nan() { f64::INFINITY } else { self.worst.max(deviation.abs()) };
    }

    pub fn check(self, limit: f64, unit: &'static str) -> Check {
        let Self { name, compared, worst } = self;
        Check { name, compared, worst, limit, unit }
    }
}

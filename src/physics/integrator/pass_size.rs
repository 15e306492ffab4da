//! Size of a pass as a function of the accuracy that a job requests.
//!
//! The least number of passes should not already be more accurate than requested, and yet give reliable error estimates: rough answers have
//! small passes, fine ones large passes. A pass twice as large takes twice as long, and low-discrepancy points then reduce the variance
//! to less than half; how far below half decides by which power of the accuracy passes grow.

use crate::sampling::power_of_two;

/// Size of a pass as a function of the requested relative standard error: a number of photons, vertices or paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassSize {
    /// Size for a relative standard error of 1 %: with it 8 to some dozen passes are enough.
    pub for_one_percent: f64,
    /// Power of the accuracy with which the size grows.
    pub growth: f64,
    /// Smallest size: below it, errors estimated from few passes would not be reliable.
    pub fewest: f64,
    /// Largest size: above it, errors would be no smaller for the same time.
    pub most: f64,
}

impl PassSize {
    /// Returns the size for a relative standard error `target`, above 0, multiplied by `times` before it is limited.
    ///
    /// ```
    /// use skyduct_physics::integrator::pass_size::PassSize;
    ///
    /// let size = PassSize { for_one_percent: 100.0, growth: 2.0, fewest: 20.0, most: 1000.0 };
    /// assert_eq!([0.1, 0.01, 0.005, 0.001].map(|target| size.of(target, 1.0)), [20.0, 100.0, 400.0, 1000.0]);
    /// assert_eq!(size.of(0.01, 2.0), 200.0);
    /// ```
    pub fn of(&self, target: f64, times: f64) -> f64 {
        (self.for_one_percent * times * libm::pow(0.01 / target, self.growth)).clamp(self.fewest, self.most)
    }

    /// Returns the size rounded to a power of two, at which Sobol points are most uniform.
    pub fn power_of_two(&self, target: f64) -> u64 {
        power_of_two(self.of(target, 1.0))
    }
}

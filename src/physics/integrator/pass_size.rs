//! How large a pass is for the accuracy that a job asks for.
//!
//! The least number of passes should take less than the accuracy asked for, and so should the errors of so few passes be honest:
//! small passes for rough answers, larger ones for fine answers. A pass twice as large takes twice as long, and even points gain
//! more than half of the variance by it; how much more decides by which power of the accuracy passes grow.

use crate::sampling::power_of_two;

/// Size of a pass as a function of the relative standard error that is asked for: a number of photons, vertices or paths.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassSize {
    /// For a relative standard error of 1 %: by it 8 to some dozen passes are enough.
    pub for_one_percent: f64,
    /// Power of the accuracy by which it grows.
    pub growth: f64,
    /// Fewest: with fewer, errors of few passes would not be honest.
    pub fewest: f64,
    /// Most: with more, errors would be no smaller for the same time.
    pub most: f64,
}

impl PassSize {
    /// For a relative standard error `target`, above 0, of something `times` as large as usual.
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

    /// The same as a power of two: Sobol points are most even then.
    pub fn power_of_two(&self, target: f64) -> u64 {
        power_of_two(self.of(target, 1.0))
    }
}

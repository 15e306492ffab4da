//! Running mean and variance.

/// Count, mean and sum of squared deviations of independent replicates (Welford 1962).
///
/// Equal sequences of pushes give equal bits.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    /// Number of replicates, as a float so that checkpoints are one list of numbers.
    pub count: f64,
    /// Mean of the replicates, in their unit; zero without any.
    pub mean: f64,
    /// Sum of squared deviations from the mean.
    pub m2: f64,
}

impl Moments {
    /// Adds one replicate by Welford's update (1962). NaN and infinity are not rejected, and stay in the mean.
    #[inline]
    pub fn push(&mut self, value: f64) {
        self.count += 1.0;
        let delta = value - self.mean;
        self.mean += delta / self.count;
        self.m2 += delta * (value - self.mean);
    }

    /// Calls `f` on count, mean and squared deviations in this order, to read or to replace them, as checkpoints do.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        let Self { count, mean, m2 } = self;
        [count, mean, m2].into_iter().for_each(f);
    }

    /// Returns the variance of the mean; infinite with fewer than two replicates.
    #[inline]
    pub fn variance_of_mean(&self) -> f64 {
        if self.count < 2.0 { f64::INFINITY } else { self.m2 / (self.count - 1.0) / self.count }
    }

    /// Returns the standard error of the mean; infinite with fewer than two replicates.
    ///
    /// For 1, 2, 3 it is sqrt(1 / 3):
    ///
    /// ```
    /// let mut moments = skyduct_physics::statistics::Moments::default();
    /// [1.0, 2.0, 3.0].into_iter().for_each(|value| moments.push(value));
    /// assert!((moments.standard_error() - (1.0f64 / 3.0).sqrt()).abs() < 1e-15);
    /// ```
    pub fn standard_error(&self) -> f64 {
        self.variance_of_mean().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_of_integers_far_from_zero() {
        let mut all = Moments::default();
        (0..1000).for_each(|k| all.push(1e6 + f64::from(k * 7919 % 1000)));
        assert_eq!(all.count, 1000.0);
        assert!((all.mean - 1_000_499.5).abs() < 1e-9 * all.mean);
        let variance = (1000.0 * 1000.0 - 1.0) / 12.0; // of the integers 0..=999, population
        assert!((all.m2 / 1000.0 - variance).abs() < 1e-6 * variance);
    }
}

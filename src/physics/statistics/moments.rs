//! Running mean and variance.

/// Count, mean and sum of squared deviations of independent replicates (Welford 1962), mergeable (Chan et al. 1979).
///
/// Equal sequences of pushes and merges give equal bits.
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
    /// Adds one replicate in Welford's update (1962). NaN and infinity are taken as they are and stay.
    #[inline]
    pub fn push(&mut self, value: f64) {
        self.count += 1.0;
        let delta = value - self.mean;
        self.mean += delta / self.count;
        self.m2 += delta * (value - self.mean);
    }

    /// Adds the replicates of `other` as if they had been pushed after those that are here (Chan, Golub and LeVeque 1979).
    ///
    /// Two halves of 2, 4, 4, 4 and 5, 5, 7, 9, whose mean is 5 and whose squared deviations add up to 32:
    ///
    /// ```
    /// use skyduct_physics::statistics::Moments;
    ///
    /// let of = |values: [f64; 4]| {
    ///     let mut moments = Moments::default();
    ///     values.into_iter().for_each(|value| moments.push(value));
    ///     moments
    /// };
    /// let mut all = of([2.0, 4.0, 4.0, 4.0]);
    /// all.merge(&of([5.0, 5.0, 7.0, 9.0]));
    /// assert!(all.count == 8.0 && (all.mean - 5.0).abs() < 1e-14 && (all.m2 - 32.0).abs() < 1e-13);
    /// ```
    #[inline]
    pub fn merge(&mut self, other: &Self) {
        if other.count == 0.0 {
            return;
        }
        let count = self.count + other.count;
        let delta = other.mean - self.mean;
        self.mean += delta * other.count / count;
        self.m2 += other.m2 + delta * delta * self.count * other.count / count;
        self.count = count;
    }

    /// Gives `f` count, mean and squared deviations in this order, to read or to replace: checkpoints store them so.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        let Self { count, mean, m2 } = self;
        [count, mean, m2].into_iter().for_each(f);
    }

    /// Variance of the mean; infinite with fewer than two replicates.
    #[inline]
    pub fn variance_of_mean(&self) -> f64 {
        if self.count < 2.0 { f64::INFINITY } else { self.m2 / (self.count - 1.0) / self.count }
    }

    /// Standard error of the mean; infinite with fewer than two replicates.
    ///
    /// Of 1, 2, 3 it is sqrt(1 / 3):
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
    fn merge_equals_pushing_all() {
        let values: Vec<f64> = (0..1000).map(|k| 1e6 + f64::from(k * 7919 % 1000)).collect();
        let push = |values: &[f64]| {
            let mut moments = Moments::default();
            values.iter().for_each(|v| moments.push(*v));
            moments
        };
        let all = push(&values);
        let mut merged = push(&values[..137]);
        merged.merge(&push(&values[137..]));
        merged.merge(&Moments::default());
        assert_eq!(all.count, merged.count);
        assert!((all.mean - merged.mean).abs() < 1e-9 * all.mean);
        assert!((all.m2 - merged.m2).abs() < 1e-9 * all.m2);
        let variance = (1000.0 * 1000.0 - 1.0) / 12.0; // of the integers 0..=999, population
        assert!((all.m2 / 1000.0 - variance).abs() < 1e-6 * variance);
    }
}

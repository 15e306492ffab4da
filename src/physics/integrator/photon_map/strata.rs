//! Fixed points in strata of a square, and an estimate of the variance of their mean.

/// Strata of the unit square, columns x rows, with one point in each.
#[derive(Clone, Copy, Debug)]
pub struct Strata {
    columns: usize,
    pub rows: usize,
}

impl Strata {
    /// A single stratum: the whole square.
    pub const ONE: Self = Self { columns: 1, rows: 1 };

    /// Divides the square into `count` strata that are as nearly square as possible.
    pub fn new(count: u32) -> Self {
        let count = count as usize;
        let rows = (1..=count.isqrt()).rev().find(|rows| count.is_multiple_of(*rows)).unwrap_or(1);
        Self { columns: count / rows, rows }
    }

    /// Returns the number of strata.
    pub fn count(self) -> usize {
        self.columns * self.rows
    }

    /// Returns the point at coordinates 0..1 of a stratum.
    pub fn point(self, number: usize, [x, y]: [f64; 2]) -> [f64; 2] {
        let (column, row) = (number % self.columns, number / self.columns);
        [(column as f64 + x) / self.columns as f64, (row as f64 + y) / self.rows as f64]
    }

    /// Returns the number of blocks along columns and rows: 2 x 2 strata each, larger at the end of an odd number of strata.
    fn blocks(self) -> [usize; 2] {
        [self.columns, self.rows].map(|strata| (strata / 2).max(1))
    }

    /// Returns contrasts of the points' values, one for each block; none for a single point. Their squares add up to the variance of the
    /// mean of all points, or more: if a block has a points on one colour of a chequerboard and b on the other, with independent values of
    /// variance s^2, the difference of the two means has the variance s^2 (a + b) / (a b), and the block adds s^2 (a + b) / n^2 to the
    /// variance of the mean of all n points.
    pub fn contrasts(self, values: &[f64]) -> Vec<f64> {
        if self.count() < 2 {
            return Vec::new();
        }
        let [across, down] = self.blocks();
        let mut sums = vec![[(0.0, 0.0); 2]; across * down];
        for (number, value) in values.iter().enumerate() {
            let (column, row) = (number % self.columns, number / self.columns);
            let block = (row / 2).min(down - 1) * across + (column / 2).min(across - 1);
            let (sum, count) = &mut sums[block][(column + row) % 2];
            *sum += value;
            *count += 1.0;
        }
        let n = self.count() as f64;
        sums.iter()
            .map(|[(a, count_a), (b, count_b)]| (a / count_a - b / count_b) * (count_a * count_b).sqrt() / n)
            .collect()
    }

    /// Returns the number of contrasts.
    pub fn contrast_count(self) -> usize {
        if self.count() < 2 { 0 } else { self.blocks().iter().product() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};
    use crate::statistics::Moments;

    #[test]
    fn strata_are_as_square_as_can_be() {
        for (count, shape, contrasts) in
            [(2, [2, 1], 1), (4, [2, 2], 1), (6, [3, 2], 1), (7, [7, 1], 3), (16, [4, 4], 4)]
        {
            let strata = Strata::new(count);
            assert_eq!([strata.columns, strata.rows], shape);
            assert_eq!(strata.contrasts(&vec![0.0; count as usize]).len(), contrasts);
            assert_eq!(strata.contrast_count(), contrasts);
        }
        assert!(Strata::ONE.contrasts(&[1.0]).is_empty() && Strata::ONE.contrast_count() == 0);
    }

    /// Over many pixels the mean sum of squared contrasts is the variance of the mean of a pixel's points, for an edge across the pixel and
    /// for light that varies linearly, within 4 standard errors. Where strata cannot be paired diagonally it is more.
    #[test]
    fn contrasts_tell_the_sampling_error() {
        let edge = |[x, y]: [f64; 2]| if 0.8 * x + 0.6 * y < 0.55 { 3.0 } else { 1.0 };
        let slope = |[x, y]: [f64; 2]| 5.0 + 2.0 * x - 3.0 * y;
        for (name, light) in [("edge", &edge as &dyn Fn([f64; 2]) -> f64), ("slope", &slope)] {
            for count in [2, 4, 6, 7, 9, 16] {
                let strata = Strata::new(count);
                let mut random = PathRandom::new(Key::new(u64::from(count)));
                let (mut means, mut reported) = (Moments::default(), Moments::default());
                for _ in 0..20_000 {
                    let values: Vec<f64> =
                        (0..strata.count()).map(|number| light(strata.point(number, random.uniform2()))).collect();
                    means.push(values.iter().sum::<f64>() / f64::from(count));
                    reported.push(strata.contrasts(&values).iter().map(|contrast| contrast * contrast).sum());
                }
                let variance = means.m2 / (means.count - 1.0);
                let ratio = reported.mean / variance;
                println!("{name} {count}: {ratio}");
                // a variance of so many values is known within 1.5 %
                let error = 4.0 * (reported.standard_error() / variance).hypot(0.015 * ratio);
                assert!(ratio > 1.0 - error, "{name} {count}: {ratio}");
                if name == "slope" && [4, 16].contains(&count) {
                    assert!(ratio < 1.0 + error, "{name} {count}: {ratio}");
                }
            }
        }
    }
}

//! Owen-scrambled Sobol points in replicates of at most 2^16 points (Burley 2020, the sobol_burley crate).

use super::random::Key;
use super::streams::Stream;

/// Number of points in one replicate: the crate's sequences end there.
pub const REPLICATE_LEN: u64 = 1 << 16;

/// Independent randomisation of the Sobol sequence; its points are 4-dimensional sets, padded by fresh scrambles.
#[derive(Clone, Copy, Debug)]
pub struct Replicate {
    seed: u32,
}

impl Replicate {
    /// Returns the replicate that holds point number `index` of the stream `key`, and the point's number within it.
    #[inline]
    pub fn of(key: Key, index: u64) -> (Self, u16) {
        let replicate = Self { seed: key.stream(Stream::Replicate, index / REPLICATE_LEN).seed32() };
        (replicate, (index % REPLICATE_LEN) as u16)
    }

    /// Returns coordinates 4 `set`..4 `set` + 3 of point `index`, each in [0, 1) with 24 bits; `set` < 64.
    #[inline]
    pub fn point(&self, index: u16, set: u32) -> [f64; 4] {
        let [a, b, c, d] = sobol_burley::sample_4d(u32::from(index), set, self.seed);
        [f64::from(a), f64::from(b), f64::from(c), f64::from(d)]
    }
}

/// Returns the power of two that is nearest to a number >= 1 by its logarithm: Sobol points are most even in such numbers.
///
/// ```
/// use skyduct_physics::sampling::power_of_two;
///
/// assert_eq!([1.0, 5.6, 5.7, 1000.0].map(power_of_two), [1, 4, 8, 1024]);
/// ```
pub fn power_of_two(number: f64) -> u64 {
    1 << libm::round(libm::log2(number.max(1.0))).min(62.0) as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stratification: 4^k points of a net put one into each elementary square, so that every coordinate and the first pair are stratified.
    #[test]
    fn points_are_stratified() {
        let (replicate, first) = Replicate::of(Key::new(7), 0);
        assert_eq!(first, 0);
        for axis in 0..4 {
            let mut seen = [0; 256];
            for index in 0..256 {
                seen[(replicate.point(index, 1)[axis] * 256.0) as usize] += 1;
            }
            assert!(seen.iter().all(|n| *n == 1));
        }
    }

    #[test]
    fn blocks_are_separate_replicates() {
        let key = Key::new(1);
        let (a, i) = Replicate::of(key, 5);
        let (b, j) = Replicate::of(key, 5 + REPLICATE_LEN);
        assert_eq!(i, j);
        assert_ne!(a.point(i, 0), b.point(j, 0));
    }
}

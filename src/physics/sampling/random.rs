//! Counter-based random numbers: every value is a function of (job seed, pass, stream, path, position in the path).

use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Key of 64 bits hashed from counters; equal counters give equal keys on every machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Key(u64);

impl Key {
    /// Creates the root of a tree of keys; jobs take their `seed` here.
    pub fn new(seed: u64) -> Self {
        Self(mix(seed))
    }

    /// Returns the key of `counter` below this one.
    #[inline]
    pub fn child(self, counter: u64) -> Self {
        // the odd constant keeps child(0) apart from the parent
        Self(mix(self.0 ^ mix(counter.wrapping_add(0x9e37_79b9_7f4a_7c15))))
    }

    /// Returns the upper half of the key, as a seed for 32-bit generators.
    #[inline]
    pub fn seed32(self) -> u32 {
        (self.0 >> 32) as u32
    }
}

/// Mixes the bits of a number by the finaliser of SplitMix64 (Steele, Lea and Flood 2014, variant 13 of Stafford).
#[inline]
fn mix(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Random numbers of one path: xoshiro256++ seeded by the path's key.
#[derive(Clone, Debug)]
pub struct PathRandom(Xoshiro256PlusPlus);

impl PathRandom {
    /// Creates the stream of `key`, at its first number.
    #[inline]
    pub fn new(key: Key) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(key.0))
    }

    /// Returns a uniform number in [0, 1) with 53 bits.
    #[inline]
    pub fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Returns the next two numbers of the stream, each uniform in [0, 1).
    #[inline]
    pub fn uniform2(&mut self) -> [f64; 2] {
        [self.uniform(), self.uniform()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mean and neighbour correlation of many short streams: 4 standard errors.
    #[test]
    fn streams_are_uniform_and_independent() {
        let n = 100_000u64;
        let key = Key::new(0).child(3);
        let first = |path: u64| PathRandom::new(key.child(path)).uniform() - 0.5;
        let mean = (0..n).map(first).sum::<f64>() / n as f64;
        assert!(mean.abs() < 4.0 * (1.0 / 12.0 / n as f64).sqrt());
        let correlation = (0..n).map(|path| first(path) * first(path + 1)).sum::<f64>() / n as f64;
        assert!(correlation.abs() < 4.0 / 12.0 / (n as f64).sqrt());
    }

    #[test]
    fn extreme_seeds_differ() {
        assert_ne!(Key::new(0), Key::new(u64::MAX));
        assert_ne!(Key::new(0).child(0), Key::new(0));
    }
}

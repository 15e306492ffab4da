//! Numbers of one path: a low-discrepancy sequence for its first dimensions, then pseudo-random numbers.

use super::random::{Key, PathRandom};
use super::sobol::Replicate;
use super::streams::Stream;

/// Numbers of one path: Sobol points for its first dimensions, then counter-based random numbers.
#[derive(Clone, Debug)]
pub struct PathSamples {
    replicate: Replicate,
    index: u16,
    /// Next pair of Sobol coordinates.
    pair: u32,
    /// Number of pairs of Sobol coordinates; later draws are pseudo-random.
    pairs: u32,
    buffer: [f64; 4],
    /// Point that is returned before all others.
    first: Option<[f64; 2]>,
    /// Counter-based numbers of the same path, for draws that have no Sobol coordinates.
    pub random: PathRandom,
}

/// Number of pairs of Sobol coordinates per path: direction and entry point, then two directions after scattering.
pub const SOBOL_PAIRS: u32 = 4;

impl PathSamples {
    /// Creates the numbers of path `index` of the stream `stream`, with [`SOBOL_PAIRS`] pairs of Sobol coordinates.
    pub fn new(stream: Key, index: u64) -> Self {
        Self::with_pairs(stream, index, SOBOL_PAIRS)
    }

    /// Creates the numbers of path `index` with `pairs` <= 128 pairs of Sobol coordinates before counter-based random numbers.
    pub fn with_pairs(stream: Key, index: u64, pairs: u32) -> Self {
        let (replicate, number) = Replicate::of(stream, index);
        let random = PathRandom::new(stream.stream(Stream::PseudoRandom, 0).child(index));
        Self { replicate, index: number, pair: 0, pairs, buffer: [0.0; 4], first: None, random }
    }

    /// Sets a point of the unit square that is returned before all others.
    pub fn begin_with(&mut self, point: [f64; 2]) {
        self.first = Some(point);
    }

    /// Returns the next point of the unit square, both coordinates in [0, 1): a Sobol pair as long as there are any, then a random pair.
    #[inline]
    pub fn pair(&mut self) -> [f64; 2] {
        if let Some(first) = self.first.take() {
            return first;
        }
        if self.pair >= self.pairs {
            return self.random.uniform2();
        }
        if self.pair.is_multiple_of(2) {
            self.buffer = self.replicate.point(self.index, self.pair / 2);
        }
        let half = 2 * (self.pair % 2) as usize;
        self.pair += 1;
        [self.buffer[half], self.buffer[half + 1]]
    }
}

//! Sums over photons within a ball, eight at once: by vector instructions if the processor has AVX2, else one by one.
//!
//! Both implementations add the same single-precision numbers in the same order: sums are identical to the bit.

#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m256, __m256i, _CMP_LT_OQ};

#[cfg(target_arch = "x86_64")]
use pulp::x86::V3;

/// Number of photons that are processed at once.
pub const LANES: usize = 8;

/// Number of steps of [`LANES`] photons after which the single-precision sums are added to the double-precision ones.
const MOST_STEPS: usize = 1024;

/// Positions, surfaces and fluxes of photons, in the order of their cells; the lists of photons have [`LANES`] additional entries at the
/// end.
#[derive(Debug)]
pub struct Columns<const C: usize> {
    /// Positions in metres, by axis.
    pub places: [Vec<f32>; 3],
    /// Number of the surface that each photon lies on (see `LiesOn`).
    pub on: Vec<u32>,
    /// Fluxes, by channel.
    pub fluxes: [Vec<f32>; C],
    /// Index of the first photon of each cell, and at the end the number of photons.
    pub starts: Vec<u32>,
}

/// Ball within which photons on one surface are counted.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    pub centre: [f32; 3],
    pub radius_squared: f32,
    /// Squared radius of the disc of half the area.
    pub half_squared: f32,
    pub on: u32,
}

/// Block of cells, by its rows: numbers of the first cell of the first row, and of the cell past its end.
#[derive(Clone, Copy, Debug)]
pub struct Rows {
    pub first: usize,
    pub end: usize,
    /// Number of rows in a layer, and of layers.
    pub counts: [usize; 2],
    /// Number of cells from one row to the next, and from one layer to the next.
    pub strides: [usize; 2],
}

/// Sums of flux by channel in the whole ball and within half the area, and the number of photons in the whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BallSums<const C: usize> {
    pub whole: [f64; C],
    pub half: [f64; C],
    pub count: u64,
}

/// Sums the photons of some rows that lie in a ball.
#[inline]
pub fn within<const C: usize>(columns: &Columns<C>, rows: Rows, ball: Ball) -> BallSums<C> {
    let query = BallQuery { columns, rows, ball };
    #[cfg(target_arch = "x86_64")]
    if let Some(vectors) = V3::try_new() {
        return vectors.vectorize(Vectorized { query, vectors });
    }
    query.answer(OneByOne)
}

struct BallQuery<'a, const C: usize> {
    columns: &'a Columns<C>,
    rows: Rows,
    ball: Ball,
}

/// Sums by lane.
#[derive(Clone, Copy)]
struct LaneSums<const C: usize> {
    whole: [[f32; LANES]; C],
    half: [[f32; LANES]; C],
    count: [u32; LANES],
}

/// Up to [`LANES`] photons that follow each other.
struct LaneGroup<'a, const C: usize> {
    places: [&'a [f32; LANES]; 3],
    on: &'a [u32; LANES],
    fluxes: [&'a [f32; LANES]; C],
    /// Number of photons that count: the first ones.
    left: u32,
}

/// Implementation that processes several photons at once.
trait PhotonLanes: Copy {
    /// Adds the photons of a step that lie in the ball.
    fn add<const C: usize>(self, step: &LaneGroup<C>, ball: &Ball, sums: &mut LaneSums<C>);
}

impl<const C: usize> BallQuery<'_, C> {
    #[inline(always)]
    fn answer<L: PhotonLanes>(self, lanes: L) -> BallSums<C> {
        let Self { columns, rows, ball } = self;
        let nothing = LaneSums { whole: [[0.0; LANES]; C], half: [[0.0; LANES]; C], count: [0; LANES] };
        let mut found = BallSums { whole: [0.0; C], half: [0.0; C], count: 0 };
        let (mut sums, mut steps) = (nothing, 0);
        for layer in 0..rows.counts[1] {
            for row in 0..rows.counts[0] {
                let cell = row * rows.strides[0] + layer * rows.strides[1];
                let (mut at, to) =
                    (columns.starts[rows.first + cell] as usize, columns.starts[rows.end + cell] as usize);
                while at < to {
                    let left = (to - at).min(LANES) as u32;
                    // lists have as many entries more than photons
                    let Some(step) = columns.step(at, left) else { return found };
                    lanes.add(&step, &ball, &mut sums);
                    at += LANES;
                    steps += 1;
                    if steps == MOST_STEPS {
                        found.add(&sums);
                        (sums, steps) = (nothing, 0);
                    }
                }
            }
        }
        found.add(&sums);
        found
    }
}

impl<const C: usize> Columns<C> {
    #[inline(always)]
    fn step(&self, at: usize, left: u32) -> Option<LaneGroup<'_, C>> {
        const NOTHING: &[f32; LANES] = &[0.0; LANES];
        let mut step = LaneGroup { places: [NOTHING; 3], on: eight(&self.on, at)?, fluxes: [NOTHING; C], left };
        for axis in 0..3 {
            step.places[axis] = eight(&self.places[axis], at)?;
        }
        for channel in 0..C {
            step.fluxes[channel] = eight(&self.fluxes[channel], at)?;
        }
        Some(step)
    }
}

impl<const C: usize> BallSums<C> {
    /// Adds the sums of all lanes, in their order.
    #[inline(always)]
    fn add(&mut self, sums: &LaneSums<C>) {
        for channel in 0..C {
            for lane in 0..LANES {
                self.whole[channel] += f64::from(sums.whole[channel][lane]);
                self.half[channel] += f64::from(sums.half[channel][lane]);
            }
        }
        for lane in 0..LANES {
            self.count += u64::from(sums.count[lane]);
        }
    }
}

/// Returns the values at `at` and after it that are processed at once.
#[inline(always)]
fn eight<T>(values: &[T], at: usize) -> Option<&[T; LANES]> {
    values.get(at..)?.first_chunk()
}

/// Plain arithmetic, for every processor.
#[derive(Clone, Copy)]
struct OneByOne;

impl PhotonLanes for OneByOne {
    #[inline(always)]
    fn add<const C: usize>(self, step: &LaneGroup<C>, ball: &Ball, sums: &mut LaneSums<C>) {
        for lane in 0..LANES {
            let [dx, dy, dz] = [0, 1, 2].map(|axis| step.places[axis][lane] - ball.centre[axis]);
            let distance_squared = dx * dx + dy * dy + dz * dz;
            if step.on[lane] == ball.on && (lane as u32) < step.left && distance_squared < ball.radius_squared {
                sums.count[lane] += 1;
                for channel in 0..C {
                    sums.whole[channel][lane] += step.fluxes[channel][lane];
                    if distance_squared < ball.half_squared {
                        sums.half[channel][lane] += step.fluxes[channel][lane];
                    }
                }
            }
        }
    }
}

/// Query answered by vector instructions, with all functions that take part inlined.
#[cfg(target_arch = "x86_64")]
struct Vectorized<'a, const C: usize> {
    query: BallQuery<'a, C>,
    vectors: V3,
}

#[cfg(target_arch = "x86_64")]
impl<const C: usize> pulp::NullaryFnOnce for Vectorized<'_, C> {
    type Output = BallSums<C>;

    #[inline(always)]
    fn call(self) -> BallSums<C> {
        self.query.answer(self.vectors)
    }
}

#[cfg(target_arch = "x86_64")]
const NUMBERS: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7];

#[cfg(target_arch = "x86_64")]
impl PhotonLanes for V3 {
    #[inline(always)]
    fn add<const C: usize>(self, step: &LaneGroup<C>, ball: &Ball, sums: &mut LaneSums<C>) {
        let (avx, avx2) = (self.avx, self.avx2);
        let floats = |values: &[f32; LANES]| pulp::cast::<[f32; LANES], __m256>(*values);
        let numbers = |values: &[u32; LANES]| pulp::cast::<[u32; LANES], __m256i>(*values);
        let dx = avx._mm256_sub_ps(floats(step.places[0]), avx._mm256_set1_ps(ball.centre[0]));
        let dy = avx._mm256_sub_ps(floats(step.places[1]), avx._mm256_set1_ps(ball.centre[1]));
        let dz = avx._mm256_sub_ps(floats(step.places[2]), avx._mm256_set1_ps(ball.centre[2]));
        let [x, y, z] = [avx._mm256_mul_ps(dx, dx), avx._mm256_mul_ps(dy, dy), avx._mm256_mul_ps(dz, dz)];
        let distance_squared = avx._mm256_add_ps(avx._mm256_add_ps(x, y), z);
        let of_surface = avx2._mm256_cmpeq_epi32(numbers(step.on), avx._mm256_set1_epi32(ball.on as i32));
        let counted = avx2._mm256_cmpgt_epi32(avx._mm256_set1_epi32(step.left as i32), numbers(&NUMBERS));
        let whole = avx._mm256_set1_ps(ball.radius_squared);
        let whole = avx._mm256_cmp_ps::<_CMP_LT_OQ>(distance_squared, whole);
        let mask = avx2._mm256_and_si256(of_surface, counted);
        let whole = avx._mm256_and_ps(whole, pulp::cast::<__m256i, __m256>(mask));
        let half = avx._mm256_set1_ps(ball.half_squared);
        let half = avx._mm256_and_ps(avx._mm256_cmp_ps::<_CMP_LT_OQ>(distance_squared, half), whole);
        // a mask is minus one
        let count = avx2._mm256_sub_epi32(numbers(&sums.count), pulp::cast::<__m256, __m256i>(whole));
        sums.count = pulp::cast(count);
        for channel in 0..C {
            let flux = floats(step.fluxes[channel]);
            let sum = avx._mm256_add_ps(floats(&sums.whole[channel]), avx._mm256_and_ps(flux, whole));
            sums.whole[channel] = pulp::cast(sum);
            let sum = avx._mm256_add_ps(floats(&sums.half[channel]), avx._mm256_and_ps(flux, half));
            sums.half[channel] = pulp::cast(sum);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};

    /// Sums are identical to the bit with vector instructions and without, also over rows that begin and end anywhere, and of so many
    /// photons that sums are carried over in between.
    #[test]
    fn instructions_change_no_bit() {
        let mut random = PathRandom::new(Key::new(5));
        let (cells, photons) = ([5usize, 4, 3], 40_000usize);
        let mut column = |count: usize| -> Vec<f32> { (0..count).map(|_| random.uniform() as f32).collect() };
        let places = [(); 3].map(|()| column(photons + LANES));
        let fluxes = [(); 3].map(|()| column(photons + LANES));
        let all: usize = cells.iter().product();
        let mut starts: Vec<u32> = (0..all).map(|_| (random.uniform() * photons as f64) as u32).collect();
        starts.sort_unstable();
        starts[0] = 0;
        starts.push(photons as u32);
        let on = (0..photons + LANES).map(|photon| photon as u32 % 3).collect();
        let columns = Columns { places, on, fluxes, starts };
        let mut most = 0;
        for (radius_squared, on) in [(0.01f32, 0), (0.3, 1), (9.0, 2)] {
            let ball = Ball { centre: [0.5, 0.4, 0.6], radius_squared, half_squared: 0.5 * radius_squared, on };
            for (first, end, counts) in [(0, 5, [4, 3]), (1, 3, [2, 2]), (7, 9, [1, 1])] {
                let rows = Rows { first, end, counts, strides: [5, 20] };
                let found = within(&columns, rows, ball);
                let plain = BallQuery { columns: &columns, rows, ball }.answer(OneByOne);
                assert_eq!(found.whole.map(f64::to_bits), plain.whole.map(f64::to_bits));
                assert_eq!(found.half.map(f64::to_bits), plain.half.map(f64::to_bits));
                assert_eq!(found.count, plain.count);
                most = most.max(found.count);
            }
        }
        assert!(most > 10_000);
    }
}

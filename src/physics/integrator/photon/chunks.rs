//! Chunks of the photons of a pass: computed in parallel, and added up in their order.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

/// Fewest photons that one task traces.
const LEAST_CHUNK: u64 = 128;
/// Most photons that one task traces.
pub const MOST_CHUNK: u64 = 1024;

/// Number of photons of a pass, and of those that one task traces. The latter depends on the former alone, so that sums fold in the same
/// order on any number of threads.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chunks {
    photons: u64,
    size: u64,
}

impl Chunks {
    /// Divides photons that take about a microsecond or more each: into tasks of an eighth of them, within 128..1024, so that a small pass
    /// keeps several threads busy, too.
    pub fn of_long_paths(photons: u64) -> Self {
        Self { photons, size: (photons / 8).clamp(LEAST_CHUNK, MOST_CHUNK) }
    }

    /// Divides photons that take less than about a microsecond each: into the largest tasks, for starting a smaller task would cost as much
    /// as its photons.
    pub fn of_short_paths(photons: u64) -> Self {
        Self { photons, size: MOST_CHUNK }
    }

    /// Divides items each of which takes about as long as several photons: into tasks of `size` items.
    pub fn of_size(photons: u64, size: u64) -> Self {
        Self { photons, size: size.clamp(1, MOST_CHUNK) }
    }

    fn count(self) -> u64 {
        self.photons.div_ceil(self.size)
    }

    fn numbers(self, chunk: u64) -> Range<u64> {
        chunk * self.size..((chunk + 1) * self.size).min(self.photons)
    }
}

/// Most chunks that are computed before the first of them is folded, used where results are small: enough to keep all threads busy.
const MOST_CONCURRENT: u64 = 256;

/// Fewest chunks that are computed in parallel, however large their results are.
const LEAST_CONCURRENT: u64 = 16;

/// Bytes that the results of chunks waiting to be folded may take, unless these are only [`LEAST_CONCURRENT`] chunks.
const CONCURRENT_BYTES: u64 = 128 << 20;

/// Returns the number of chunks with results of `chunk_bytes` each that are held at the same time.
pub fn concurrent_chunks(chunk_bytes: u64) -> u64 {
    (CONCURRENT_BYTES / chunk_bytes.max(1)).clamp(LEAST_CONCURRENT, MOST_CONCURRENT)
}

/// Returns the largest number of sums over `sensors` sensors that chunks of a pass of `photons` hold at the same time.
pub fn concurrent_sums(sensors: usize, photons: u64) -> u64 {
    concurrent_chunks(8 * sensors as u64).min(Chunks::of_long_paths(photons).count())
}

/// Result of some photons of a pass.
pub trait Tally: Send {
    /// True if all numbers in the result are finite.
    fn is_finite(&self) -> bool;
}

/// Faults found while the results of photons were folded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Folded {
    /// Number of the first photon whose result is infinite or not a number.
    pub not_finite: Option<u64>,
}

/// Computes `of` for every chunk of photons on the current rayon pool, and passes the results to `fold` in the order of the photons;
/// returns `None` if `cancel` was raised meanwhile.
///
/// A result takes about `chunk_bytes`. Only a few are held at a time, so that a pass of many photons needs no more memory than one of few.
/// The number held changes no bit: `fold` gets the same results in the same order. If a result is not finite, the chunk's photons are
/// computed again one by one, to find the first at fault.
pub fn fold_chunks<T: Tally>(
    chunks: Chunks,
    chunk_bytes: u64,
    cancel: &AtomicBool,
    of: impl Fn(Range<u64>) -> T + Sync,
    mut fold: impl FnMut(T),
) -> Option<Folded> {
    let one = |chunk: u64| (!cancel.load(Ordering::Relaxed)).then(|| of(chunks.numbers(chunk)));
    let concurrent = concurrent_chunks(chunk_bytes);
    let (mut first, mut not_finite) = (0, None);
    while first < chunks.count() {
        let end = (first + concurrent).min(chunks.count());
        let results: Option<Vec<T>> = (first..end).into_par_iter().map(one).collect();
        for (chunk, result) in (first..end).zip(results?) {
            if not_finite.is_none() && !result.is_finite() {
                // where none is at fault alone, their sum has overflowed
                let at_fault = chunks.numbers(chunk).find(|number| !of(*number..number + 1).is_finite());
                not_finite = at_fault.or(Some(chunks.numbers(chunk).start));
            }
            fold(result);
        }
        first = end;
    }
    Some(Folded { not_finite })
}

#[cfg(test)]
mod tests {
    use super::*;

    impl Tally for Range<u64> {
        fn is_finite(&self) -> bool {
            true
        }
    }

    /// Range of photon numbers, with the number of the photon whose result is infinite.
    struct Faulty(Range<u64>, u64);

    impl Tally for Faulty {
        fn is_finite(&self) -> bool {
            !self.0.contains(&self.1)
        }
    }

    #[test]
    fn the_first_photon_at_fault_is_named() {
        for (at_fault, named) in [(0, Some(0)), (1023, Some(1023)), (4321, Some(4321)), (5000, None)] {
            let of = |range| Faulty(range, at_fault);
            let folded = fold_chunks(Chunks::of_long_paths(5000), 8, &AtomicBool::new(false), of, |_| {});
            assert_eq!(folded, Some(Folded { not_finite: named }));
        }
    }

    #[test]
    fn small_passes_are_divided_too() {
        let counts = |of: fn(u64) -> Chunks| [64, 512, 1024, 2048, 8192, 1 << 20].map(|photons| of(photons).count());
        assert_eq!(counts(Chunks::of_long_paths), [1, 4, 8, 8, 8, 1024]);
        assert_eq!(counts(Chunks::of_short_paths), [1, 1, 1, 2, 8, 1024]);
        assert_eq!([0, 1, 7, 64].map(|number| Chunks::of_size(number, 7).count()), [0, 1, 1, 10]);
        assert_eq!([512, 2048, 1 << 20].map(|photons| concurrent_sums(100, photons)), [4, 8, 256]);
    }

    #[test]
    fn every_photon_is_folded_once_and_in_order_whatever_is_held() {
        for photons in [0, 1, 1023, 1024, 1025, 40 * 1024 + 7, 300 * 1024] {
            for chunk_bytes in [0, 1 << 20, u64::MAX] {
                for chunks in [Chunks::of_long_paths(photons), Chunks::of_short_paths(photons)] {
                    let mut next = 0;
                    let in_order = |range: Range<u64>| {
                        assert_eq!(range.start, next);
                        next = range.end;
                    };
                    let folded = fold_chunks(chunks, chunk_bytes, &AtomicBool::new(false), |range| range, in_order);
                    assert_eq!(folded, Some(Folded { not_finite: None }));
                    assert_eq!(next, photons);
                }
            }
        }
    }

    #[test]
    fn a_cancelled_pass_gives_nothing() {
        assert_eq!(fold_chunks(Chunks::of_long_paths(5000), 8, &AtomicBool::new(true), |range| range, |_| {}), None);
    }
}

//! The photons of a pass in chunks: computed side by side, added up in their order.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

/// Photons that one task traces: fixed, so that sums fold in the same order on any number of threads.
pub const PHOTON_CHUNK: u64 = 1024;

/// Chunks that are computed before the first of them is folded, where they are small: enough to keep all threads busy.
const MOST_AT_ONCE: u64 = 256;

/// Fewest chunks that are computed side by side, however large they are.
const LEAST_AT_ONCE: u64 = 16;

/// Bytes that the chunks that wait to be folded may take, as long as there are not fewer than [`LEAST_AT_ONCE`] of them.
const BYTES_AT_ONCE: u64 = 128 << 20;

/// Number of chunks of `chunk_bytes` each that are held at the same time.
pub fn chunks_at_once(chunk_bytes: u64) -> u64 {
    (BYTES_AT_ONCE / chunk_bytes.max(1)).clamp(LEAST_AT_ONCE, MOST_AT_ONCE)
}

/// Number of sums over `sensors` sensors that chunks of a pass of `photons` hold at the same time.
pub fn sums_at_once(sensors: usize, photons: u64) -> u64 {
    chunks_at_once(8 * sensors as u64).min(photons.div_ceil(PHOTON_CHUNK))
}

/// What some photons of a pass give.
pub trait Tally: Send {
    /// False if a number in it is infinite or no number.
    fn is_finite(&self) -> bool;
}

/// What was noticed while photons were folded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Folded {
    /// Number of the first photon that gave something infinite or no number.
    pub not_finite: Option<u64>,
}

/// Computes `of` for every chunk of the photons 0..`photons` on the current rayon pool, and gives the results to `fold` in
/// the order of the photons; `None` when `cancel` was raised meanwhile.
///
/// A result takes about `chunk_bytes`. Few are held at a time, so that a pass of many photons needs no more memory than one
/// of few. How many are held changes no bit: `fold` sees the same results in the same order. Where a result is not finite, the
/// chunk's photons are computed again one by one, to name the first at fault.
pub fn fold_chunks<T: Tally>(
    photons: u64,
    chunk_bytes: u64,
    cancel: &AtomicBool,
    of: impl Fn(Range<u64>) -> T + Sync,
    mut fold: impl FnMut(T),
) -> Option<Folded> {
    let chunks = photons.div_ceil(PHOTON_CHUNK);
    let one = |chunk: u64| {
        let from = chunk * PHOTON_CHUNK;
        (!cancel.load(Ordering::Relaxed)).then(|| of(from..(from + PHOTON_CHUNK).min(photons)))
    };
    let at_once = chunks_at_once(chunk_bytes);
    let (mut first, mut not_finite) = (0, None);
    while first < chunks {
        let end = (first + at_once).min(chunks);
        let results: Option<Vec<T>> = (first..end).into_par_iter().map(one).collect();
        for (chunk, result) in (first..end).zip(results?) {
            if not_finite.is_none() && !result.is_finite() {
                let from = chunk * PHOTON_CHUNK;
                let mut numbers = from..(from + PHOTON_CHUNK).min(photons);
                // where none is at fault alone, their sum has overflowed
                not_finite = numbers.find(|number| !of(*number..number + 1).is_finite()).or(Some(from));
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

    /// The numbers of photons of which one gives an infinity.
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
            let folded = fold_chunks(5000, 8, &AtomicBool::new(false), of, |_| {});
            assert_eq!(folded, Some(Folded { not_finite: named }));
        }
    }

    #[test]
    fn every_photon_is_folded_once_and_in_order_whatever_is_held() {
        for photons in [0, 1, 1023, 1024, 1025, 40 * 1024 + 7, 300 * 1024] {
            for chunk_bytes in [0, 1 << 20, u64::MAX] {
                let mut next = 0;
                let folded = fold_chunks(
                    photons,
                    chunk_bytes,
                    &AtomicBool::new(false),
                    |range| range,
                    |range| {
                        assert_eq!(range.start, next);
                        next = range.end;
                    },
                );
                assert_eq!(folded, Some(Folded { not_finite: None }));
                assert_eq!(next, photons);
            }
        }
    }

    #[test]
    fn a_cancelled_pass_gives_nothing() {
        assert_eq!(fold_chunks(5000, 8, &AtomicBool::new(true), |range| range, |_| {}), None);
    }
}

//! The passes of each chunk, fixed by the job alone.

use std::ops::Range;

/// Passes of a first chunk; later ones double the job until they reach the longest that the job allows.
const FIRST_CHUNK: u64 = 8;

/// Chunks of passes 0..`most`: the first of 8, then each as long as all before it, never longer than `longest`.
pub(super) fn chunk_range(index: u64, longest: u64, most: u64) -> Option<Range<u64>> {
    let mut range = 0..FIRST_CHUNK.min(longest).min(most);
    for _ in 0..index {
        let length = range.end.min(longest);
        range = range.end..(range.end + length).min(most);
        if range.is_empty() {
            return None;
        }
    }
    (!range.is_empty()).then_some(range)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_cover_all_passes_once() {
        for (longest, most) in [(1, 5), (8, 8), (64, 1000), (4096, 4096), (3, 1), (7, 20)] {
            let mut next = 0;
            for index in 0.. {
                let Some(range) = chunk_range(index, longest, most) else { break };
                assert_eq!(range.start, next);
                assert!(range.end - range.start <= longest);
                next = range.end;
            }
            assert_eq!(next, most);
        }
    }
}

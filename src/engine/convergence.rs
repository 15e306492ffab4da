//! Choice of the passes of a job that are reported and kept (all of the first, then ever fewer, as errors fall ever slower), and of the
//! accuracies whose times are reported.

/// Number of passes up to which each one is kept.
const EVERY_PASS: u64 = 64;

/// Number of passes that are kept while their number doubles, after [`EVERY_PASS`].
const PER_DOUBLING: f64 = 8.0;

/// Relative errors to which the times are reported while a job runs and after it.
pub const ACCURACIES: [f64; 5] = [0.05, 0.02, 0.01, 0.005, 0.001];

/// Numbers of passes after which a progress image of every view is kept.
pub const PREVIEW_PASSES: [u64; 6] = [1, 4, 16, 64, 256, 1024];

/// True if pass number `passes` (the first is 1) has a row in the convergence table and an event: passes 1 to 64, then those nearest to
/// powers of 2^(1/8), about 9 % apart. A job of a million passes has 176 of them; `passes` of a row is the number of passes done, and the
/// last pass of a job is kept, too.
pub fn is_kept(passes: u64) -> bool {
    if passes <= EVERY_PASS {
        return true;
    }
    let step = (libm::log2(passes as f64) * PER_DOUBLING).round();
    libm::exp2(step / PER_DOUBLING).round() as u64 == passes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_million_passes_are_less_than_two_hundred_rows_without_wide_gaps() {
        let kept: Vec<u64> = (1..=1_000_000).filter(|pass| is_kept(*pass)).collect();
        assert!(kept.len() < 200, "{}", kept.len());
        assert_eq!(kept[..64], (1..=64).collect::<Vec<_>>());
        for pair in kept.windows(2) {
            assert!(pair[1] as f64 <= 1.1 * pair[0] as f64 + 1.0, "{pair:?}");
        }
        for power in [128, 1024, 4096, 65536, 524_288] {
            assert!(is_kept(power), "{power}");
        }
    }
}

//! Ends of paths: Russian roulette, and a limit of their length.

use crate::sampling::roulette::faint_survival;

/// Number of events after which a path is cut off; reached only in scenes that absorb nothing.
pub const MAX_EVENTS: u32 = 1_000_000;

/// Returns the probability with which a path survives that arrives with the weight `arriving` > 0 and would leave with `outgoing`; `first`
/// is its weight at the start. The weight of a survivor is divided by it, so that bright paths leave with the weight they arrived with.
#[inline]
pub fn survival(outgoing: f64, arriving: f64, first: f64) -> f64 {
    (outgoing / arriving * faint_survival(arriving, first)).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bright_paths_go_on_by_what_is_reflected_and_faint_ones_by_less() {
        assert_eq!(survival(0.4, 0.8, 1.0), 0.5);
        assert_eq!(survival(2.0, 0.5, 1.0), 1.0);
        assert!((survival(2e-4, 4e-4, 1.0) - 0.5 * 0.4).abs() < 1e-15);
    }
}

//! How paths end.

use crate::sampling::roulette::faint_survival;

/// Events of one path after which it is cut off; reached only by scenes that absorb nothing.
pub const MAX_EVENTS: u32 = 1_000_000;

/// Probability with which a path goes on that arrives with `arriving` > 0 and would leave with `leaving`; `first` is what
/// it carried at its start. A survivor is divided by it, so that it goes on with what arrived.
#[inline]
pub fn survival(leaving: f64, arriving: f64, first: f64) -> f64 {
    (leaving / arriving * faint_survival(arriving, first)).min(1.0)
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

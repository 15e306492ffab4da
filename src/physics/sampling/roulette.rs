//! Russian roulette of faint paths: the weight of those that end goes to those that survive, so that the mean is unchanged.

/// Fraction of its first throughput below which a path is subject to Russian roulette even where nothing absorbs.
const FAINT: f64 = 1e-3;

/// Returns the survival probability of a path that carries `carried` >= 0 of the `first` > 0 that it began with: 1 down to a thousandth of
/// it, then in proportion to `carried`. The weight of a survivor is divided by it.
///
/// ```
/// use skyduct_physics::sampling::roulette::faint_survival;
///
/// assert_eq!(faint_survival(0.5, 1.0), 1.0);
/// assert_eq!(faint_survival(0.0, 1.0), 0.0);
/// assert!((faint_survival(2e-4, 1.0) - 0.2).abs() < 1e-15);
/// ```
#[inline]
pub fn faint_survival(carried: f64, first: f64) -> f64 {
    if carried < FAINT * first { carried / (FAINT * first) } else { 1.0 }
}

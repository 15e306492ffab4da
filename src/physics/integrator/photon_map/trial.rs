//! Trials of progressive photon mapping: the error of many passes, predicted from a few passes with wider kernels.

use super::progressive::TRIAL_RADIUS;
use crate::integrator::trial::{Powers, TrialPasses};

/// Growth of work and variance with the number of photons; the work of each sensor or pixel itself does not grow.
const POWERS: Powers = Powers { work_of_place: 0.0, ..Powers::OF_PHOTONS };

/// Returns the relations between a trial and the method: the trial's kernels are [`TRIAL_RADIUS`] times as wide, and it has `tried` of the
/// method's `photons`. Wider kernels hold more photons and have more bias, which few photons then estimate better. `alpha` is that of the
/// method.
pub fn of_wider_kernels(tried: u64, photons: u64, alpha: f64) -> TrialPasses {
    TrialPasses {
        variance_of_kernels: TRIAL_RADIUS.powi(2),
        squared_bias: TRIAL_RADIUS.powi(-4),
        alpha: Some(alpha),
        ..TrialPasses::of_photons(tried, photons, POWERS)
    }
}

//! How a few passes of progressive photon mapping tell of many.

use super::progressive::TRIAL_RADIUS;
use crate::integrator::trial::{Powers, TrialPasses};

/// Every sensor gathers as before what more photons leave.
const POWERS: Powers = Powers { work_of_place: 0.0, ..Powers::OF_PHOTONS };

/// Passes with kernels that are [`TRIAL_RADIUS`] times as wide, and with `tried` of a method's `photons`: they hold more photons, and more
/// bias, which few photons tell the better. `alpha` of the method that is tried.
pub fn of_wider_kernels(tried: u64, photons: u64, alpha: f64) -> TrialPasses {
    TrialPasses {
        variance_of_kernels: TRIAL_RADIUS.powi(2),
        squared_bias: TRIAL_RADIUS.powi(-4),
        alpha: Some(alpha),
        ..TrialPasses::of_photons(tried, photons, POWERS)
    }
}

//! How a few passes of progressive photon mapping tell of many.

use super::progressive::TRIAL_RADIUS;
use crate::integrator::method::Trial;

/// A trial with kernels that are [`TRIAL_RADIUS`] times as wide, and `ratio` times the photons: they hold more photons, and more
/// bias, which few photons tell the better. `alpha` of the method that is tried.
pub fn of_wider_kernels(trial: Trial, ratio: f64, alpha: f64) -> Trial {
    Trial {
        work_of_pass: ratio,
        squared_bias: TRIAL_RADIUS.powi(-4),
        alpha: Some(alpha),
        ..trial.with_variance(TRIAL_RADIUS.powi(2) / ratio)
    }
}

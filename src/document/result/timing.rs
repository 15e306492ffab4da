//! What the computation achieved and what it cost.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::finite;
use crate::estimate::{Accuracy, Estimate};

/// Achieved relative errors at the asked confidence; null before the second pass, or without such output.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AccuracyResult {
    pub relative_error: Option<f64>,
    pub view_relative_error: Option<f64>,
    pub confidence: f64,
}

impl AccuracyResult {
    pub fn new(accuracy: Accuracy, confidence: f64) -> Self {
        Self {
            relative_error: accuracy.grids.and_then(finite),
            view_relative_error: accuracy.views.and_then(finite),
            confidence,
        }
    }
}

/// Cost of the computation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TimingResult {
    /// Render time in seconds.
    pub seconds: f64,
    pub passes: u64,
    pub photons: u64,
    pub rays: u64,
    /// Null when no time was measured.
    pub photons_per_second: Option<f64>,
    pub rays_per_second: Option<f64>,
}

impl TimingResult {
    pub fn new(estimate: &Estimate, seconds: f64) -> Self {
        let Estimate { passes, photons, rays, .. } = *estimate;
        Self {
            seconds,
            passes,
            photons,
            rays,
            photons_per_second: finite(photons as f64 / seconds),
            rays_per_second: finite(rays as f64 / seconds),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_time_is_null_and_not_infinite() {
        assert_eq!(TimingResult::new(&Estimate::default(), 0.0).photons_per_second, None);
    }
}

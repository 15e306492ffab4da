//! What the computation achieved and what it cost.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::finite;
use crate::estimate::{Accuracy, Estimate};

/// Achieved relative errors at the asked confidence; null before the second pass, or without such output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AccuracyResult {
    /// Error of the worst grid, root mean square over its sensors.
    pub relative_error: Option<f64>,
    /// Error of the worst view, root mean square over its blocks of 8 x 8 pixels.
    pub view_relative_error: Option<f64>,
    /// Passes that computed the grids: an output that is as accurate as asked is not computed any further. Null without
    /// grids.
    #[serde(default)]
    pub passes: Option<u64>,
    /// Passes that computed the views; null without views.
    #[serde(default)]
    pub view_passes: Option<u64>,
    /// What ended the grids, as of `stopped_by` of the job: `relative_error` where they were as accurate as asked before the views
    /// were. Null without grids.
    #[serde(default)]
    pub stopped_by: Option<String>,
    /// What ended the views, as of `stopped_by` of the job; null without views.
    #[serde(default)]
    pub view_stopped_by: Option<String>,
    /// Confidence that both errors hold with, as the document asks.
    pub confidence: f64,
}

impl AccuracyResult {
    /// Accuracy as JSON has it: what is not finite is null. `stopped_by`: what ended grids and views.
    pub fn new(
        accuracy: Accuracy,
        estimate: &Estimate,
        confidence: f64,
        [stopped_by, view_stopped_by]: [Option<String>; 2],
    ) -> Self {
        Self {
            stopped_by,
            view_stopped_by,
            passes: (!estimate.grids.is_empty()).then(|| estimate.passes_of_grids()),
            view_passes: (!estimate.views.is_empty()).then(|| estimate.passes_of_views()),
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
    /// Processor seconds of the threads that rendered; null where the system does not tell them.
    #[serde(default)]
    pub cpu_seconds: Option<f64>,
    /// Number of passes; 1 for a deterministic method.
    pub passes: u64,
    /// Number of photons that set out in all passes.
    pub photons: u64,
    /// Number of ray segments of all passes; a closed form through a guide counts as one.
    pub rays: u64,
    /// Rays that left tubes through gaps in their meshes.
    #[serde(default)]
    pub lost_rays: u64,
    /// Null when no time was measured.
    pub photons_per_second: Option<f64>,
    /// Null when no time was measured.
    pub rays_per_second: Option<f64>,
}

impl TimingResult {
    /// Cost of an estimate that took `seconds` to render, and `cpu_seconds` of the processors.
    pub fn new(estimate: &Estimate, seconds: f64, cpu_seconds: Option<f64>) -> Self {
        let Estimate { passes, photons, rays, lost_rays, .. } = *estimate;
        Self {
            seconds,
            cpu_seconds,
            passes,
            photons,
            rays,
            lost_rays,
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
        assert_eq!(TimingResult::new(&Estimate::default(), 0.0, None).photons_per_second, None);
    }
}

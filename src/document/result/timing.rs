//! Accuracy and cost of a computation.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::number::finite;
use crate::estimate::{Accuracy, Estimate};

/// Relative errors that were reached, at the requested confidence; null before the second pass, or without such output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct AccuracyResult {
    /// Relative error of the worst grid, root mean square over its sensors.
    pub relative_error: Option<f64>,
    /// Relative error of the worst view, root mean square over its blocks of 8 x 8 pixels.
    pub view_relative_error: Option<f64>,
    /// Number of passes that computed the grids; null without grids. An output that has reached the requested accuracy is not
    /// computed further.
    #[serde(default)]
    pub passes: Option<u64>,
    /// Number of passes that computed the views; null without views.
    #[serde(default)]
    pub view_passes: Option<u64>,
    /// Reason why the computation of the grids ended, as in `stopped_by` of the job; `relative_error` if they reached the
    /// requested accuracy before the views. Null without grids.
    #[serde(default)]
    pub stopped_by: Option<String>,
    /// Reason why the computation of the views ended, as in `stopped_by` of the job; null without views.
    #[serde(default)]
    pub view_stopped_by: Option<String>,
    /// Confidence of both errors, as requested by the document.
    pub confidence: f64,
}

impl AccuracyResult {
    /// Converts an accuracy to JSON, with null for errors that are not finite; `stopped_by` are the reasons why grids and views
    /// ended.
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
    /// Processor seconds of the threads that rendered; null where the operating system does not report them.
    #[serde(default)]
    pub cpu_seconds: Option<f64>,
    /// Number of passes; 1 for a deterministic method.
    pub passes: u64,
    /// Number of photons emitted in all passes.
    pub photons: u64,
    /// Number of ray segments in all passes; a closed form through a guide counts as one.
    pub rays: u64,
    /// Number of rays that left tubes through gaps in their meshes.
    #[serde(default)]
    pub lost_rays: u64,
    /// Photons per second of rendering; null when no time was measured.
    pub photons_per_second: Option<f64>,
    /// Ray segments per second of rendering; null when no time was measured.
    pub rays_per_second: Option<f64>,
}

impl TimingResult {
    /// Returns the cost of an estimate that took `seconds` to render, and `cpu_seconds` of processor time.
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

//! When a job stops.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::errors::Checks;
use super::limits::{CONFIDENCE, PASSES, RELATIVE_ERROR, SECONDS};
use crate::estimate::StopRule;

/// When a job is accurate enough, and its limits; the first one reached ends the job.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StopDocument {
    /// Relative error of the grids at the asked confidence, 0..1.
    pub relative_error: f64,
    /// Relative error of the views at the asked confidence, over blocks of 8 x 8 pixels.
    pub view_relative_error: f64,
    /// Confidence of the two-sided normal interval.
    pub confidence: f64,
    /// Passes after which the job ends, 1..1e9.
    pub max_passes: u64,
    /// Render time in seconds; the pass that runs when they are used up is dropped, a method without passes gives what it has
    /// reached by then. A service may allow less (one hour by default).
    pub max_seconds: f64,
}

impl Default for StopDocument {
    fn default() -> Self {
        Self { relative_error: 0.02, view_relative_error: 0.05, confidence: 0.95, max_passes: 4096, max_seconds: 600.0 }
    }
}

impl StopDocument {
    /// The rule that a job is judged by.
    pub fn rule(self) -> StopRule {
        let Self { relative_error, view_relative_error, confidence, max_passes, max_seconds } = self;
        StopRule { relative_error, view_relative_error, confidence, max_passes, max_seconds }
    }

    /// Refuses numbers out of their bounds.
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.number("/stop/relative_error", self.relative_error, RELATIVE_ERROR);
        checks.number("/stop/view_relative_error", self.view_relative_error, RELATIVE_ERROR);
        checks.number("/stop/confidence", self.confidence, CONFIDENCE);
        checks.number("/stop/max_passes", self.max_passes, PASSES);
        checks.number("/stop/max_seconds", self.max_seconds, SECONDS);
    }
}

//! Accuracy and limits at which a job ends.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::errors::Checks;
use super::limits::{CONFIDENCE, PASSES, RELATIVE_ERROR, SECONDS};
use crate::estimate::StopRule;

/// Accuracy that a job is computed to, and its limits; whichever is reached first ends the job.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields, default)]
pub struct StopDocument {
    /// Relative error of the grids at `confidence`, 0..1.
    pub relative_error: f64,
    /// Relative error of the views at `confidence`, over blocks of 8 x 8 pixels.
    pub view_relative_error: f64,
    /// Confidence of the two-sided normal interval.
    pub confidence: f64,
    /// Number of passes after which the job ends, 1..1e9.
    pub max_passes: u64,
    /// Render time in seconds after which the job ends. The unfinished pass is dropped; a method without passes returns the
    /// result reached so far. A service may allow less (one hour by default).
    pub max_seconds: f64,
}

impl Default for StopDocument {
    fn default() -> Self {
        Self { relative_error: 0.02, view_relative_error: 0.05, confidence: 0.95, max_passes: 4096, max_seconds: 600.0 }
    }
}

impl StopDocument {
    /// Returns the rule by which the job is stopped.
    pub fn rule(self) -> StopRule {
        let Self { relative_error, view_relative_error, confidence, max_passes, max_seconds } = self;
        StopRule { relative_error, view_relative_error, confidence, max_passes, max_seconds }
    }

    /// Adds a fault for each number that is out of its bounds.
    pub(crate) fn check(&self, checks: &mut Checks) {
        checks.number("/stop/relative_error", self.relative_error, RELATIVE_ERROR);
        checks.number("/stop/view_relative_error", self.view_relative_error, RELATIVE_ERROR);
        checks.number("/stop/confidence", self.confidence, CONFIDENCE);
        checks.number("/stop/max_passes", self.max_passes, PASSES);
        checks.number("/stop/max_seconds", self.max_seconds, SECONDS);
    }
}

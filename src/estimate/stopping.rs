//! When a job is accurate enough.

/// The document's `stop`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopRule {
    pub relative_error: f64,
    pub view_relative_error: f64,
    /// 0..1
    pub confidence: f64,
    pub max_passes: u64,
    pub max_seconds: f64,
}

/// Achieved relative errors at the asked confidence; `None` where the job has no such output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accuracy {
    pub grids: Option<f64>,
    pub views: Option<f64>,
}

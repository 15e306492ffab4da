//! Progress of a job, and the reason why it ended.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Reason why a job ended: it is as accurate as requested (`relative_error`); its passes or its seconds are used up (`max_passes`,
/// `max_seconds`); one computation gave everything, as accurately as requested, or by a formula whose error is not known (`exact`); many
/// passes have brought no light at all to a grid, and everything else is as accurate as requested (`no_light`); a user cancelled it
/// (`cancelled`). A method without passes that is less accurate than requested and cannot do better ends by `max_passes`, with its error.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StoppedBy {
    /// Every output is as accurate as requested.
    RelativeError,
    /// The document allows no more passes, or a method without passes can do no more.
    MaxPasses,
    /// The document or the service allows no more seconds.
    MaxSeconds,
    /// One computation gave everything, within the requested error, or by a formula whose error is not known.
    Exact,
    /// Many passes have brought no light at all to a grid: none can come, or too rarely to be found. Everything else is as accurate as
    /// requested.
    NoLight,
    /// A user cancelled the job; passes that were done count.
    Cancelled,
}

impl StoppedBy {
    /// True if the outputs are as accurate as requested.
    pub fn is_as_asked(self) -> bool {
        matches!(self, Self::RelativeError | Self::Exact)
    }

    /// Returns the name in JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::RelativeError => "relative_error",
            Self::MaxPasses => "max_passes",
            Self::MaxSeconds => "max_seconds",
            Self::Exact => "exact",
            Self::NoLight => "no_light",
            Self::Cancelled => "cancelled",
        }
    }
}

/// Row of the convergence table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PassReport {
    /// Passes done so far, this one included.
    pub passes: u64,
    /// Render seconds of the job so far, earlier chunks included.
    pub seconds: f64,
    /// Photons emitted so far.
    pub photons: u64,
    /// Ray segments so far; a closed form through a guide counts as one.
    pub rays: u64,
    /// Relative error of the grids at the requested confidence, to be compared with `stop.relative_error`; null before the second pass.
    pub relative_error: Option<f64>,
    /// Relative error of the views at the requested confidence, to be compared with `stop.view_relative_error`; null before the second
    /// pass.
    pub view_relative_error: Option<f64>,
    /// Degrees of freedom of `relative_error`, which is Student's quantile for these times a relative standard error: one less than passes,
    /// or more where sensors share a residual. Null before the second pass, and for passes that an older version rendered.
    #[serde(default)]
    pub degrees_of_freedom: Option<f64>,
    /// Mean illuminance of the first grid in lux.
    pub mean_lux: Option<f64>,
    /// Processor seconds of the threads that rendered the passes so far, earlier chunks included: those of the render pool, on which one
    /// job renders at a time. Null where the system does not report them, and for passes that an older version rendered.
    #[serde(default)]
    pub cpu_seconds: Option<f64>,
}

/// Progress of a job.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Progress {
    /// Passes done.
    pub passes: u64,
    /// Photons emitted.
    pub photons: u64,
    /// Ray segments; a closed form through a guide counts as one.
    pub rays: u64,
    /// Render seconds so far.
    pub seconds: f64,
    /// Relative error of the grids at the requested confidence; null before the second pass.
    pub relative_error: Option<f64>,
    /// Relative error of the views at the requested confidence; null before the second pass.
    pub view_relative_error: Option<f64>,
    /// Number of finished chunks of passes, after which a restart continues.
    pub chunks: u64,
    /// Processor seconds of the rendering threads; null where they are not known.
    #[serde(default)]
    pub cpu_seconds: Option<f64>,
}

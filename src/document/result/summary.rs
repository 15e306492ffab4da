//! What a job computed, in short.

use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::cross_check::CrossCheckResult;
use super::energy::EnergyResult;
use super::grid::{ExternalIlluminance, GridStatistics};
use super::timing::{AccuracyResult, TimingResult};
use super::tube::TubeResult;
use crate::document::errors::Warning;
use crate::document::provenance::Provenance;
use crate::document::schema::shapes::PixelCounts;

/// What is known of the results before the first pass.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct Known {
    /// The choices that explain factors of two between correct answers; where the sun is stands among them.
    pub provenance: Provenance,
    /// The same as `provenance` under its former name, which is deprecated.
    pub switches: Provenance,
    /// Unobstructed horizontal illuminance of sky and sun.
    pub external_horizontal_illuminance_lux: ExternalIlluminance,
}

impl Known {
    /// What is known, `provenance` under both of its names.
    pub fn new(provenance: Provenance, external_horizontal_illuminance_lux: ExternalIlluminance) -> Self {
        Self { switches: provenance.clone(), provenance, external_horizontal_illuminance_lux }
    }
}

/// What a job computed, in short; the grids and views have paths of their own. All but `provenance`, `switches` and
/// `external_horizontal_illuminance_lux` are absent until the job has finished.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct JobResults {
    /// Relative errors that were reached.
    pub accuracy: Option<AccuracyResult>,
    /// Name and version of the program that computed it.
    #[schema(example = "skyduct 0.1.0")]
    pub engine: Option<String>,
    /// Passes, photons, rays and seconds.
    pub timing: Option<TimingResult>,
    /// The choices that explain factors of two between correct answers.
    pub provenance: Option<Provenance>,
    /// The same as `provenance` under its former name, which is deprecated.
    pub switches: Option<Provenance>,
    /// Unobstructed horizontal illuminance of sky and sun.
    pub external_horizontal_illuminance_lux: Option<ExternalIlluminance>,
    /// One per grid.
    pub grids: Option<Vec<GridInShort>>,
    /// One per view.
    pub views: Option<Vec<ViewInShort>>,
    /// One per tube.
    pub tubes: Option<Vec<TubeResult>>,
    /// Null where no method follows the light from its sources to its end.
    pub energy: Option<EnergyResult>,
    /// What a second method found, where the document asks for `cross_check`; null where it does not, in the dark, and before the
    /// second pass.
    pub cross_check: Option<CrossCheckResult>,
    /// Id of the job that was rendered, where an equal one was, by the same program: all results are that one's, which may have been
    /// deleted since. Absent where this one was.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub computed_by: Option<Uuid>,
    /// What came up while the job was rendered, beside the `warnings` of its document.
    pub render_warnings: Option<Vec<Warning>>,
}

/// A view and its size.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct ViewInShort {
    /// Name of the view in the document.
    pub name: String,
    /// Width and height.
    #[schema(value_type = PixelCounts)]
    pub size_px: [usize; 2],
}

/// A grid's statistics.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct GridInShort {
    /// Name of the grid in the document.
    pub name: String,
    /// Statistics over the sensors.
    pub statistics: GridStatistics,
    /// Of the mean over the grid, that of its statistics: bias and the choice of fixed points are in it. Null before the second
    /// pass.
    pub mean_standard_error_lux: Option<f64>,
}

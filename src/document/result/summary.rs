//! Summary of a job's results.

use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::annual::VerdictResult;
use super::cross_check::CrossCheckResult;
use super::energy::EnergyResult;
use super::grid::{ExternalIlluminance, GridStatistics};
use super::timing::{AccuracyResult, TimingResult};
use super::tube::TubeResult;
use crate::document::errors::Warning;
use crate::document::provenance::Provenance;
use crate::document::schema::shapes::PixelCounts;

/// Results that are available before the first pass.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct Known {
    /// Modelling choices by which correct answers can differ by factors of two, with the sun's position among them.
    pub provenance: Provenance,
    /// Copy of `provenance` under its former name; deprecated.
    pub switches: Provenance,
    /// Unobstructed horizontal illuminance of sky and sun in lux.
    pub external_horizontal_illuminance_lux: ExternalIlluminance,
}

impl Known {
    /// Returns the results with a copy of `provenance` under its former name.
    pub fn new(provenance: Provenance, external_horizontal_illuminance_lux: ExternalIlluminance) -> Self {
        Self { switches: provenance.clone(), provenance, external_horizontal_illuminance_lux }
    }
}

/// Summary of a job's results; the grids and views have paths of their own. All fields but `provenance`, `switches` and
/// `external_horizontal_illuminance_lux` are absent until the job has finished.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct JobResults {
    /// Relative errors that were reached.
    pub accuracy: Option<AccuracyResult>,
    /// Name and version of the program that computed the results.
    #[schema(example = "skyduct 0.1.0")]
    pub engine: Option<String>,
    /// Hash (BLAKE3, hexadecimal) of the document with all defaults filled in, in a form that does not depend on white space and on the
    /// order of fields.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub document_hash: Option<String>,
    /// Numbers of passes, photons and rays, and the time they took.
    pub timing: Option<TimingResult>,
    /// Modelling choices by which correct answers can differ by factors of two.
    pub provenance: Option<Provenance>,
    /// Copy of `provenance` under its former name; deprecated.
    pub switches: Option<Provenance>,
    /// Unobstructed horizontal illuminance of sky and sun in lux.
    pub external_horizontal_illuminance_lux: Option<ExternalIlluminance>,
    /// Statistics of each grid, in the order of the document.
    pub grids: Option<Vec<GridInShort>>,
    /// Name and size of each view, in the order of the document.
    pub views: Option<Vec<ViewInShort>>,
    /// Fluxes through each tube, in the order of the document.
    pub tubes: Option<Vec<TubeResult>>,
    /// Energy balance; null where no method follows the light from its sources to its end.
    pub energy: Option<EnergyResult>,
    /// Comparison with a second method; null if the document does not ask for `cross_check`, in the dark, and before the second
    /// pass.
    pub cross_check: Option<CrossCheckResult>,
    /// Id of the equal job whose results these are, if one had already been rendered by the same program; it may have been
    /// deleted since. Absent if this job was rendered itself.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub computed_by: Option<Uuid>,
    /// Warnings that arose during rendering, in addition to the `warnings` of the document.
    pub render_warnings: Option<Vec<Warning>>,
}

/// A view and its size.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct ViewInShort {
    /// Name of the view in the document.
    pub name: String,
    /// Width and height in pixels.
    #[schema(value_type = PixelCounts)]
    pub size_px: [usize; 2],
}

/// Statistics of a grid.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct GridInShort {
    /// Name of the grid in the document.
    pub name: String,
    /// Statistics over the sensors.
    pub statistics: GridStatistics,
    /// Standard error of the mean over the grid in lux, as in `statistics`: it includes bias and the choice of fixed points. Null
    /// before the second pass.
    pub mean_standard_error_lux: Option<f64>,
    /// Criteria of schemes that name the moment of the job, such as 9:00 of a clear day at the equinox; absent where none does.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    #[schema(required = false)]
    pub verdicts: Vec<VerdictResult>,
}

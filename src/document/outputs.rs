//! Grids and views of a job document.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::schema::{CellCounts, PixelCounts, Vector};
use crate::scene::EstimateKind;

/// A grid of horizontal sensors that look up.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GridDocument {
    /// Unique among the grids; names the files of the result.
    #[schema(pattern = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    pub name: String,
    /// Above the floor, >= 0 and below the ceiling.
    #[schema(minimum = 0, maximum = 10_000)]
    pub height_m: f64,
    /// Number of cells along x and y, each 1..1000, at most 100000 together.
    #[schema(value_type = CellCounts)]
    pub cells: [u32; 2],
    /// Distance of the outer cells' edges from the walls.
    #[serde(default)]
    #[schema(minimum = 0, maximum = 5_000)]
    pub margin_m: f64,
    #[serde(default)]
    pub estimate: EstimateDocument,
}

/// What the value of a cell means.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum EstimateDocument {
    /// Illuminance at the cell's centre.
    #[default]
    Point,
    /// Mean illuminance over the cell.
    CellAverage,
}

impl From<EstimateDocument> for EstimateKind {
    fn from(estimate: EstimateDocument) -> Self {
        match estimate {
            EstimateDocument::Point => Self::Point,
            EstimateDocument::CellAverage => Self::CellAverage,
        }
    }
}

impl From<EstimateKind> for EstimateDocument {
    fn from(estimate: EstimateKind) -> Self {
        match estimate {
            EstimateKind::Point => Self::Point,
            EstimateKind::CellAverage => Self::CellAverage,
        }
    }
}

/// A perspective view.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ViewDocument {
    /// Unique among the views; names the files of the result.
    #[schema(pattern = "^[A-Za-z0-9][A-Za-z0-9._-]{0,63}$")]
    pub name: String,
    #[schema(value_type = Vector)]
    pub eye_m: [f64; 3],
    /// Differs from `eye_m`.
    #[schema(value_type = Vector)]
    pub look_at_m: [f64; 3],
    /// Not parallel to the viewing direction.
    #[serde(default = "default_up")]
    #[schema(value_type = Vector)]
    pub up: [f64; 3],
    #[serde(default = "default_fov")]
    #[schema(exclusive_minimum = 0, exclusive_maximum = 179)]
    pub vertical_fov_deg: f64,
    /// Width and height, each 1..8192, at most 16777216 pixels.
    #[serde(default = "default_size")]
    #[schema(value_type = PixelCounts)]
    pub size_px: [u32; 2],
}

fn default_up() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn default_fov() -> f64 {
    60.0
}

fn default_size() -> [u32; 2] {
    [512, 512]
}

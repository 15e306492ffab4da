//! Units of mesh coordinates, which OBJ files do not state.

use std::fmt;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

/// Unit of a mesh's coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Unit {
    M,
    Cm,
    Mm,
    In,
    Ft,
}

impl Unit {
    /// Returns the length of one unit in metres.
    pub fn metres(self) -> f64 {
        match self {
            Self::M => 1.0,
            Self::Cm => 0.01,
            Self::Mm => 0.001,
            Self::In => 0.0254,
            Self::Ft => 0.3048,
        }
    }
}

/// Writes the unit's name in documents.
impl fmt::Display for Unit {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(match self {
            Self::M => "m",
            Self::Cm => "cm",
            Self::Mm => "mm",
            Self::In => "in",
            Self::Ft => "ft",
        })
    }
}

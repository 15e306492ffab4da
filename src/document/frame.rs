//! Frames of meshes: OBJ files state neither the upward axis nor the unit of length.

use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::errors::FieldError;
use super::unit::Unit;
use crate::geometry::TriangleMesh;

/// Axis of a mesh's file that points upward. With `y`, the file's z axis points to the south of the room, as in files of Blender
/// and other programs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum Up {
    Y,
    #[default]
    Z,
}

impl Up {
    /// Converts a point of the file to axes whose z points upward.
    pub fn upright(self, [x, y, z]: [f64; 3]) -> DVec3 {
        match self {
            Self::Y => DVec3::new(x, 0.0 - z, y),
            Self::Z => DVec3::new(x, y, z),
        }
    }

    /// Returns the other axis.
    pub fn other(self) -> Self {
        match self {
            Self::Y => Self::Z,
            Self::Z => Self::Y,
        }
    }
}

/// Converts the mesh of a file to metres, with z upward.
pub fn upright(mesh: &TriangleMesh, unit: Unit, up: Up) -> TriangleMesh {
    let mut mesh = mesh.scaled(unit.metres());
    for position in &mut mesh.positions {
        *position = up.upright(position.to_array());
    }
    mesh
}

/// Appends to `errors` about a mesh's place that it would fit with the other axis upward, if `fits` is true for that axis.
pub fn hint_at_other_axis(errors: &mut [FieldError], up: Up, fits: impl Fn(Up) -> bool) {
    if errors.is_empty() || !fits(up.other()) {
        return;
    }
    for error in errors {
        error.detail += &format!("; with `\"up\": \"{}\"` it would fit", up.other());
    }
}

/// Writes the axis as documents name it.
impl fmt::Display for Up {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(match self {
            Self::Y => "y",
            Self::Z => "z",
        })
    }
}

//! Frames of meshes, and their rotation in a room: OBJ files state neither the upward axis nor the unit of length.

use std::fmt;

use glam::{DVec2, DVec3};
use serde::{Deserialize, Deserializer, Serialize};
use utoipa::openapi::RefOr;
use utoipa::openapi::schema::{OneOfBuilder, Schema};
use utoipa::{PartialSchema, ToSchema};

use super::errors::{Checks, FieldError};
use super::limits::TURN_DEG;
use super::read::one_or_three::OneOrThree;
use super::schema::shapes::{array, number};
use crate::geometry::TriangleMesh;
use crate::geometry::turn::unit_vector;

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

/// Frame of the coordinates of a file.
#[derive(Clone, Copy, Debug)]
pub struct FileFrame {
    /// Point of the file that is the mesh's origin, in its own units and axes.
    pub offset: DVec3,
    /// Length of a unit of the file in metres.
    pub metres: f64,
    /// Axis that points upward.
    pub up: Up,
}

impl FileFrame {
    /// Converts the mesh of a file to metres from its origin, with z upward.
    pub fn upright(self, mesh: &TriangleMesh) -> TriangleMesh {
        let mut mesh = mesh.clone();
        for position in &mut mesh.positions {
            // before anything rounds it: near the offset the difference is exact
            *position = self.up.upright(((*position - self.offset) * self.metres).to_array());
        }
        mesh
    }
}

/// Rotation about the axes of the room: one angle in degrees about z, or the angles about x, y and z, by which a mesh is turned in this
/// order. Each is clockwise seen from the positive end of its axis toward the origin; `25` means `[0, 0, 25]`, clockwise seen from above.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Rotation(OneOrThree);

impl Rotation {
    /// Turns a point about the origin.
    pub fn turned(self, mut point: DVec3) -> DVec3 {
        let angles = match self.0 {
            OneOrThree::One(about_z) => [0.0, 0.0, about_z],
            OneOrThree::Three(angles) => angles,
        };
        for (axis, angle) in angles.into_iter().enumerate().filter(|(_, angle)| *angle != 0.0) {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let turned = unit_vector(-angle.to_radians()).rotate(DVec2::new(point[u], point[v]));
            (point[u], point[v]) = turned.into();
        }
        point
    }

    /// Adds a fault for each angle out of its bounds.
    pub(crate) fn check(self, pointer: &str, checks: &mut Checks) {
        for (axis, angle) in self.0.numbers() {
            checks.number(&format!("{pointer}{axis}"), angle, TURN_DEG);
        }
    }
}

impl Default for Rotation {
    fn default() -> Self {
        Self(OneOrThree::One(0.0))
    }
}

impl<'de> Deserialize<'de> for Rotation {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        OneOrThree::read(deserializer, "a number or [x, y, z]").map(Self)
    }
}

impl PartialSchema for Rotation {
    fn schema() -> RefOr<Schema> {
        let description = "Rotation in degrees: one angle about z, or the angles about x, y and z, by which a mesh is turned in this order \
                           about the axes of the room. Each is clockwise seen from the positive end of its axis toward the origin; 25 \
                           means [0, 0, 25], clockwise seen from above.";
        let angles = array(3, number(TURN_DEG)).description(Some("About x, y and z."));
        let one = number(TURN_DEG).description(Some("About z, clockwise seen from above."));
        OneOfBuilder::new().item(one).item(angles).description(Some(description)).default(Some(0.0.into())).into()
    }
}

impl ToSchema for Rotation {}

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

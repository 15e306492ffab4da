//! Mesh objects as documents give them.

use std::collections::BTreeMap;
use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::surface::{Owner, SurfaceDocument, check_surface};
use crate::document::errors::{Checks, FieldError};
use crate::document::frame::{FileFrame, Rotation, Up};
use crate::document::limits::{MESH_OFFSET, MESH_POSITION_M, MESH_SCALE};
use crate::document::read::pointer::escape;
use crate::document::schema::shapes::{MeshOffset, MeshPosition};
use crate::document::unit::Unit;

/// Fields of a mesh in the room.
///
/// A point of the file comes to its place in this order: `offset` is subtracted, `unit` and `scale` make metres of it, `up` turns it
/// upright, `rotation_deg` turns it about the room's axes, and `position_m` is added.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshObjectDocument {
    /// Id of an uploaded mesh, or the path of a file beside the job file.
    pub mesh: String,
    /// Unit of the mesh's coordinates, which OBJ files do not state; required unless there is a `scale`, which is then in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unit: Option<Unit>,
    /// Factor for all coordinates: with a `unit` in addition to it, else the metres of one unit of the file, as 0.001 for millimetres.
    /// Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Axis of the file that points upward; with `y`, its z axis points to the south of the room's frame.
    #[serde(default)]
    #[schema(default = "z")]
    pub up: Up,
    /// Point of the file, in its own units and axes, that is the origin of the object: subtracted from all coordinates before anything
    /// else, so that those of a survey lose no digits. Default: the file's own origin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<MeshOffset>)]
    pub offset: Option<[f64; 3]>,
    /// Position of the mesh's origin in metres; may be far from the room if the mesh has coordinates of a survey and no `offset`.
    #[schema(value_type = MeshPosition)]
    pub position_m: [f64; 3],
    /// Rotation about the mesh's origin.
    #[serde(default)]
    pub rotation_deg: Rotation,
    /// Surfaces by the names of the materials in the file.
    pub surfaces: BTreeMap<String, SurfaceDocument>,
    /// Surfaces of the backs of sheets, by the names of the materials; default: `surfaces`, which are then those of the fronts alone. The
    /// front of a polygon is the side from which its corners run counter-clockwise. Of polygons that a file repeats, the first counts.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub back_surfaces: BTreeMap<String, SurfaceDocument>,
}

impl MeshObjectDocument {
    /// Adds the faults that show without the file.
    pub(super) fn check(&self, pointer: &str, checks: &mut Checks) {
        if self.unit.is_none() && self.scale.is_none() {
            checks.errors.push(FieldError::missing(format!("{pointer}/unit")));
        }
        if let Some(scale) = self.scale {
            checks.number(&format!("{pointer}/scale"), scale, MESH_SCALE);
        }
        if let Some(offset) = self.offset {
            checks.numbers(&format!("{pointer}/offset"), &offset, MESH_OFFSET);
        }
        checks.numbers(&format!("{pointer}/position_m"), &self.position_m, MESH_POSITION_M);
        self.rotation_deg.check(&format!("{pointer}/rotation_deg"), checks);
        for (field, surfaces) in [("surfaces", &self.surfaces), ("back_surfaces", &self.back_surfaces)] {
            for (name, surface) in surfaces {
                check_surface(&format!("{pointer}/{field}/{}", escape(name)), surface, Owner::Object, checks);
            }
        }
    }

    /// Returns the frame of the file's coordinates.
    pub(super) fn frame(&self) -> FileFrame {
        let metres = self.unit.unwrap_or(Unit::M).metres();
        let offset = self.offset.map_or(DVec3::ZERO, DVec3::from);
        FileFrame { offset, metres: metres * self.scale.unwrap_or(1.0), up: self.up }
    }

    /// Returns the words for the unit and the scale of the file, to begin a message with.
    pub(super) fn with_unit(&self) -> impl fmt::Display {
        let unit = self.unit.map(|unit| format!("the unit `{unit}`"));
        let scale = self.scale.map(|scale| format!("the scale {scale}"));
        format!("with {}", unit.into_iter().chain(scale).collect::<Vec<_>>().join(" and "))
    }
}

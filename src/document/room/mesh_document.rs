//! Mesh objects as documents give them.

use std::collections::BTreeMap;
use std::fmt;

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::surface::{Owner, SurfaceDocument, check_surface};
use crate::document::errors::{Checks, FieldError};
use crate::document::frame::{FileFrame, Rotation, Up};
use crate::document::limits::{INSTANCES, MESH_OFFSET, MESH_POSITION_M, MESH_SCALE};
use crate::document::read::pointer::escape;
use crate::document::schema::shapes::{MeshOffset, MeshPosition};
use crate::document::unit::Unit;
use crate::geometry::TriangleMesh;
use crate::geometry::placement::Placement;

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
    /// Position of the mesh's origin in metres; may be far from the room if the mesh has coordinates of a survey and no `offset`. Required
    /// unless there are `instances`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<MeshPosition>)]
    pub position_m: Option<[f64; 3]>,
    /// Rotation about the mesh's origin.
    #[serde(default)]
    pub rotation_deg: Rotation,
    /// Places of copies of the mesh, in place of `position_m`, 1..1024 (2048 of all objects): the mesh is in memory once. Each is turned by the
    /// object's `rotation_deg`, then by its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instances: Option<Vec<InstanceDocument>>,
    /// Surfaces by the names of the materials in the file.
    pub surfaces: BTreeMap<String, SurfaceDocument>,
    /// Surfaces of the backs of sheets, by the names of the materials; default: `surfaces`, which are then those of the fronts alone. The
    /// front of a polygon is the side from which its corners run counter-clockwise. Of polygons that a file repeats, the first counts.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub back_surfaces: BTreeMap<String, SurfaceDocument>,
}

/// Place of a copy of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct InstanceDocument {
    /// Position of the mesh's origin in metres.
    #[schema(value_type = MeshPosition)]
    pub position_m: [f64; 3],
    /// Rotation about the mesh's origin.
    #[serde(default)]
    pub rotation_deg: Rotation,
}

/// Place of a mesh, or of a copy of it.
pub(super) struct Place {
    /// Pointer to the object with the position.
    pub pointer: String,
    /// Position of the mesh's origin in m.
    pub position_m: DVec3,
    /// Rotations, one after the other.
    turns: [Rotation; 2],
}

impl Place {
    /// Returns the mesh, given in metres from its origin, at this place.
    pub fn put(&self, mut mesh: TriangleMesh) -> TriangleMesh {
        for position in &mut mesh.positions {
            *position = self.turned(*position) + self.position_m;
        }
        mesh
    }

    /// Returns the place as that of a copy whose own origin is at `middle` of the mesh.
    pub fn placement(&self, middle: DVec3) -> Placement {
        Placement::new(DVec3::AXES.map(|axis| self.turned(axis)), self.turned(middle) + self.position_m)
    }

    fn turned(&self, point: DVec3) -> DVec3 {
        self.turns.iter().fold(point, |point, turn| turn.turned(point))
    }
}

impl MeshObjectDocument {
    /// Returns the places of the mesh in the object at `pointer`.
    pub(super) fn places(&self, pointer: &str) -> Vec<Place> {
        let place = |pointer: String, position_m: &[f64; 3], second: Rotation| Place {
            pointer,
            position_m: DVec3::from(*position_m),
            turns: [self.rotation_deg, second],
        };
        let of_copies = self.instances.iter().flatten().enumerate();
        let of_copies =
            of_copies.map(|(k, of)| place(format!("{pointer}/instances/{k}"), &of.position_m, of.rotation_deg));
        let single = self.position_m.iter().map(|position| place(pointer.to_owned(), position, Rotation::default()));
        single.chain(of_copies).collect()
    }

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
        self.check_places(pointer, checks);
        self.rotation_deg.check(&format!("{pointer}/rotation_deg"), checks);
        for (field, surfaces) in [("surfaces", &self.surfaces), ("back_surfaces", &self.back_surfaces)] {
            for (name, surface) in surfaces {
                check_surface(&format!("{pointer}/{field}/{}", escape(name)), surface, Owner::Object, checks);
            }
        }
    }

    fn check_places(&self, pointer: &str, checks: &mut Checks) {
        match (&self.position_m, &self.instances) {
            (None, None) => checks.errors.push(FieldError::missing(format!("{pointer}/position_m"))),
            (Some(_), Some(_)) => {
                checks.refuse(format!("{pointer}/position_m"), "must be left out if there are `instances`");
            }
            (Some(position), None) => {
                checks.numbers(&format!("{pointer}/position_m"), position, MESH_POSITION_M);
            }
            (None, Some(instances)) => {
                let list = format!("{pointer}/instances");
                if instances.is_empty() {
                    checks.refuse(&list, "must have at least one place, or be left out");
                }
                if checks.at_most(&list, instances.len(), &INSTANCES, " places") {
                    for (number, of) in instances.iter().enumerate() {
                        checks.numbers(&format!("{list}/{number}/position_m"), &of.position_m, MESH_POSITION_M);
                        of.rotation_deg.check(&format!("{list}/{number}/rotation_deg"), checks);
                    }
                }
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

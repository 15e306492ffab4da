//! The tubes of a job document: cylinders or meshes, with their collectors and diffusers.

pub mod centre;
pub(super) mod check;
pub mod closure_shape;
pub mod collector;
pub(super) mod convert;
pub(super) mod crossing;
pub mod diffuser;
pub mod mesh;
pub(crate) mod opening;
pub mod part;

use std::collections::BTreeMap;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::frame::Up;
use crate::document::optics::Coefficient;
use crate::document::optics::mirror::MirrorDocument;
use crate::document::read::tagged::Fields;
use crate::document::schema::shapes::HorizonPoint;
use crate::document::unit::Unit;
use crate::scene::OpeningShape;
use crate::sky::direction;
use centre::CentreDocument;
use closure_shape::ClosureShapeDocument;
use collector::CollectorDocument;
use diffuser::DiffuserDocument;
use part::PartDocument;

/// A tubular daylight device above an opening in the ceiling.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
#[allow(clippy::large_enum_variant, reason = "most tubes are of cylinders")]
pub enum TubeDocument {
    /// Tube of cylinders, given by diameter and segments.
    Parametric(ParametricTube),
    /// Tube of triangles, from an uploaded mesh or a file.
    Mesh(MeshTubeDocument),
}

/// Tube of mirror cylinders of one diameter that meet in mitred elbows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ParametricTube {
    /// Centre of the opening in metres, `[x, y]`; `[x, y, z]` with `"normal": "face"` on a vertical face.
    pub centre_m: CentreDocument,
    /// Name of the face that the tube comes through; default: the ceiling above `centre_m`, or, where it has a z, the face that it lies on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<String>,
    /// Plane of the opening, and direction of the first segment.
    #[serde(default, skip_serializing_if = "OpeningNormal::is_plumb")]
    #[schema(default = "plumb")]
    pub normal: OpeningNormal,
    /// Length in metres by which a level opening hangs below the ceiling at its centre; default: 0. Below a sloped ceiling, enough that
    /// the opening does not cut it. What hangs into the room is not simulated.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schema(default = 0.0)]
    pub drop_m: f64,
    /// Inner diameter in metres; the opening must lie wholly in its face.
    pub diameter_m: f64,
    /// Specular reflectance of the wall per bounce.
    pub reflectance: MirrorDocument,
    /// Straight segments of the guide from the opening outward, 1..16. The first is vertical, or with `"normal": "face"` along the normal of the
    /// face; its tilt is not given.
    pub segments: Vec<SegmentDocument>,
    /// Collector, which covers the upper end.
    pub collector: CollectorDocument,
    /// Closure in the plane of the opening.
    pub diffuser: DiffuserDocument,
    /// Shape of the closure; default: the circle of the pipe.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub closure_shape: Option<ClosureShapeDocument>,
    /// Horizon of this tube's upper end, in place of that of `surroundings` and in the same form: `[azimuth_deg, altitude_deg]`, clockwise
    /// from north.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<HorizonPoint>>)]
    pub horizon: Option<Vec<[f64; 2]>>,
}

/// Straight segment of a guide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentDocument {
    /// Length along the axis between the centres of its mitres, in metres.
    pub length_m: f64,
    /// Tilt of the axis from the vertical in degrees, 0..135; default: 0, vertical.
    #[serde(default)]
    pub tilt_deg: f64,
    /// Azimuth in degrees toward which the segment is tilted, clockwise from the room's +y axis; default: 0.
    #[serde(default)]
    pub azimuth_deg: f64,
}

/// Tube as a triangle mesh, whose origin is the centre of the opening.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshTubeDocument {
    /// Id of an uploaded mesh, or the path of a file beside the job file.
    pub mesh: String,
    /// Unit of the mesh's coordinates, which OBJ files do not state.
    pub unit: Unit,
    /// Axis of the file that points upward; with `y`, its z axis points to the south of the room's frame before `rotation_deg` is
    /// applied.
    #[serde(default)]
    #[schema(default = "z")]
    pub up: Up,
    /// Centre of the opening in metres, `[x, y]`; `[x, y, z]` with `"normal": "face"` on a vertical face.
    pub centre_m: CentreDocument,
    /// Name of the ceiling or wall that the tube comes through; default: the one above `centre_m`, or that it lies on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub face: Option<String>,
    /// Plane of the opening; with `face`, z of the mesh is the normal of the face out of the room, and before `rotation_deg` its x axis is
    /// level, with y up the slope or the wall.
    #[serde(default, skip_serializing_if = "OpeningNormal::is_plumb")]
    #[schema(default = "plumb")]
    pub normal: OpeningNormal,
    /// Length in metres by which the level opening hangs below the ceiling at its centre; default: 0. Below a sloped ceiling, enough that
    /// the opening does not cut it. What hangs into the room is not simulated.
    #[serde(default, skip_serializing_if = "is_zero")]
    #[schema(default = 0.0)]
    pub drop_m: f64,
    /// Diameter of the opening in metres; the opening must lie wholly in the ceiling.
    pub opening_diameter_m: f64,
    /// Rotation in degrees, clockwise seen from above; with `"normal": "face"` from outside.
    #[serde(default)]
    #[schema(default = 0.0)]
    pub rotation_deg: f64,
    /// True, the default, if a mesh that is a round tube, straight or bent, is to be computed in closed form as the cylinders
    /// around its facets.
    #[serde(default = "recognise")]
    #[schema(default = true)]
    pub recognise: bool,
    /// Roles of the mesh's materials, by the names of the materials.
    pub parts: BTreeMap<String, PartDocument>,
    /// Horizon of this tube's upper end, in place of that of `surroundings` and in the same form: `[azimuth_deg, altitude_deg]`, clockwise
    /// from north.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Vec<HorizonPoint>>)]
    pub horizon: Option<Vec<[f64; 2]>>,
}

/// Plane of an opening.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum OpeningNormal {
    /// A level plane; the first segment is vertical.
    #[default]
    Plumb,
    /// The plane of the face that the tube comes through, such as a sloped ceiling or a wall; the first segment runs along its normal.
    Face,
}

impl OpeningNormal {
    fn is_plumb(&self) -> bool {
        *self == Self::Plumb
    }
}

impl ParametricTube {
    /// Returns unit vectors along the axes of the segments, from an opening with this unit normal out of the room.
    pub fn axes(&self, outward: DVec3) -> Vec<DVec3> {
        let axis = |(index, segment): (usize, &SegmentDocument)| match self.normal {
            OpeningNormal::Face if index == 0 => outward,
            _ => direction(0.5 * PI - segment.tilt_deg.to_radians(), segment.azimuth_deg.to_radians()),
        };
        self.segments.iter().enumerate().map(axis).collect()
    }
}

fn recognise() -> bool {
    true
}

fn is_zero(number: &f64) -> bool {
    *number == 0.0
}

/// Deserialises a tube, which has no `kind`: one with `mesh` or `parts` is a mesh.
impl<'de> Deserialize<'de> for TubeDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let fields = Fields::deserialize(deserializer)?;
        let tube = if fields.has("mesh") || fields.has("parts") {
            fields.read("a tube that is a mesh").map(Self::Mesh)
        } else {
            fields.read("a tube without `mesh`").map(Self::Parametric)
        };
        tube.map_err(D::Error::custom)
    }
}

/// Opening of a tube.
pub struct Opening {
    /// Centre of the opening in plan, in metres.
    pub centre: DVec2,
    /// Shape of the opening.
    pub shape: OpeningShape,
    /// Diameter or side of the opening in metres.
    pub width_m: f64,
    /// Place below the tube of the field that gives the width.
    pub width: &'static str,
}

impl TubeDocument {
    /// Returns the opening, with the name of the field that gives its width.
    pub fn opening(&self) -> Opening {
        let (centre, (diameter_m, diameter)) = (self.centre_m().in_plan(), self.diameter());
        match self {
            Self::Parametric(ParametricTube { closure_shape: Some(closure), .. }) => {
                let shape = closure.transition().opening();
                Opening { centre, shape, width_m: closure.side_m, width: "closure_shape/side_m" }
            }
            _ => {
                let shape = OpeningShape::Disc { radius: 0.5 * diameter_m };
                Opening { centre, shape, width_m: diameter_m, width: diameter }
            }
        }
    }

    /// Returns the diameter of the guide's lower end in metres, with the name of the field that gives it.
    pub fn diameter(&self) -> (f64, &'static str) {
        match self {
            Self::Parametric(tube) => (tube.diameter_m, "diameter_m"),
            Self::Mesh(tube) => (tube.opening_diameter_m, "opening_diameter_m"),
        }
    }

    /// Returns the plane of the opening.
    pub fn normal(&self) -> OpeningNormal {
        match self {
            Self::Parametric(tube) => tube.normal,
            Self::Mesh(tube) => tube.normal,
        }
    }

    /// Returns the centre of the opening as it is given.
    pub fn centre_m(&self) -> CentreDocument {
        match self {
            Self::Parametric(tube) => tube.centre_m,
            Self::Mesh(tube) => tube.centre_m,
        }
    }

    /// Returns the name of the face that the tube comes through, if it is given, and the length in metres by which the opening hangs
    /// below it.
    pub fn hangs(&self) -> (Option<&str>, f64) {
        match self {
            Self::Parametric(tube) => (tube.face.as_deref(), tube.drop_m),
            Self::Mesh(tube) => (tube.face.as_deref(), tube.drop_m),
        }
    }

    /// Returns the points of the tube's own horizon, if it has one.
    pub fn horizon(&self) -> Option<&[[f64; 2]]> {
        match self {
            Self::Parametric(tube) => tube.horizon.as_deref(),
            Self::Mesh(tube) => tube.horizon.as_deref(),
        }
    }

    /// Returns all coefficients, which may be coloured.
    pub fn coefficients(&self) -> Vec<Coefficient> {
        match self {
            Self::Parametric(tube) => {
                let ends = tube.collector.coefficients().into_iter().chain(tube.diffuser.coefficients());
                tube.reflectance.coefficients().into_iter().chain(ends).collect()
            }
            Self::Mesh(tube) => tube.parts.values().flat_map(PartDocument::coefficients).collect(),
        }
    }
}

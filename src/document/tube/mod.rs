//! The tubes of a job document: cylinders or meshes, their collectors and diffusers.

pub(super) mod check;
pub mod collector;
pub(super) mod convert;
pub(super) mod crossing;
pub mod diffuser;
pub mod mesh;
pub mod part;

use std::collections::BTreeMap;

use glam::DVec2;
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::frame::Up;
use crate::document::optics::Coefficient;
use crate::document::optics::mirror::MirrorDocument;
use crate::document::read::tagged::Fields;
use crate::document::schema::shapes::PlanePoint;
use crate::document::unit::Unit;
use collector::CollectorDocument;
use diffuser::DiffuserDocument;
use part::PartDocument;

/// A tubular daylight device above a round opening in the ceiling.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(untagged)]
pub enum TubeDocument {
    /// Cylinders, given by diameter and segments.
    Parametric(ParametricTube),
    /// Triangles of an uploaded mesh, or of a file.
    Mesh(MeshTubeDocument),
}

/// Equal mirror cylinders that meet in mitred elbows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ParametricTube {
    /// Centre of the opening in the ceiling plane.
    #[schema(value_type = PlanePoint)]
    pub centre_m: [f64; 2],
    /// Inner diameter; the opening lies wholly inside the ceiling.
    pub diameter_m: f64,
    /// Specular reflectance of the wall, per bounce.
    pub reflectance: MirrorDocument,
    /// Straight pieces of the guide from the ceiling upward, 1..16; the first is vertical.
    pub segments: Vec<SegmentDocument>,
    /// Cover of the upper end.
    pub collector: CollectorDocument,
    /// Closure in the plane of the ceiling.
    pub diffuser: DiffuserDocument,
}

/// A straight piece of a guide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentDocument {
    /// Length along the axis between mitre centres, in metres.
    pub length_m: f64,
    /// Lean of the axis from the vertical.
    #[serde(default)]
    pub tilt_deg: f64,
    /// Azimuth in degrees toward which the segment leans, clockwise from the room's +y axis.
    #[serde(default)]
    pub azimuth_deg: f64,
}

/// A tube as a triangle mesh; its origin sits in the centre of the opening.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshTubeDocument {
    /// Id of an uploaded mesh, or a file beside the job file.
    pub mesh: String,
    /// Unit of the mesh's coordinates; OBJ has none.
    pub unit: Unit,
    /// Axis of the file that points upward; `y`: its z points to the south, before `rotation_deg` turns it.
    #[serde(default)]
    #[schema(default = "z")]
    pub up: Up,
    /// Centre of the opening in the ceiling plane.
    #[schema(value_type = PlanePoint)]
    pub centre_m: [f64; 2],
    /// Diameter of the opening, which lies wholly inside the ceiling.
    pub opening_diameter_m: f64,
    /// Clockwise seen from above.
    #[serde(default)]
    #[schema(default = 0.0)]
    pub rotation_deg: f64,
    /// True, the default: a mesh that is a straight round tube is computed as the cylinder around its facets, in closed
    /// form.
    #[serde(default = "recognise")]
    #[schema(default = true)]
    pub recognise: bool,
    /// Roles of the mesh's materials, by their names.
    pub parts: BTreeMap<String, PartDocument>,
}

fn recognise() -> bool {
    true
}

/// A tube has no `kind`: with a mesh or parts of one it is a mesh.
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

/// Place where a tube comes through the ceiling.
pub struct Opening {
    /// Centre of the opening in the ceiling plane, in metres.
    pub centre: DVec2,
    /// Diameter of the opening.
    pub diameter_m: f64,
    /// Name of the field of the diameter.
    pub diameter: &'static str,
}

impl TubeDocument {
    /// The opening, and the field that says its diameter.
    pub fn opening(&self) -> Opening {
        let (centre_m, diameter_m, diameter) = match self {
            Self::Parametric(tube) => (tube.centre_m, tube.diameter_m, "diameter_m"),
            Self::Mesh(tube) => (tube.centre_m, tube.opening_diameter_m, "opening_diameter_m"),
        };
        Opening { centre: DVec2::from(centre_m), diameter_m, diameter }
    }

    /// Everything that may have a colour.
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

//! The room of a job document: its surfaces, the objects in it and its electric light.

pub(in crate::document) mod luminaire;
pub(in crate::document) mod mesh_object;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::optics::coefficient::Coefficient;
use crate::document::read::{Misfit, absent, required};
use crate::document::schema::{Albedo, BoxSize, Luminance, RoomSize, Vector};
use crate::document::tube::Unit;

/// A box room; its floor spans (0, 0, 0) to (size_x, size_y, 0).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomDocument {
    /// Extent along x, y and z, each 0.01..10000 m.
    #[schema(value_type = RoomSize)]
    pub size_m: [f64; 3],
    /// Azimuth of the room's +y axis, clockwise from north.
    #[serde(default)]
    #[schema(minimum = -360, maximum = 360)]
    pub rotation_deg: f64,
    #[serde(default)]
    pub surfaces: SurfacesDocument,
    /// At most 1000.
    #[serde(default)]
    #[schema(max_items = 1000)]
    pub objects: Vec<ObjectDocument>,
    /// At most 256.
    #[serde(default)]
    #[schema(max_items = 256)]
    pub luminaires: Vec<LuminaireDocument>,
}

/// The faces of the room; a single wall wins over `walls`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfacesDocument {
    /// Default: reflectance 0.2.
    #[serde(default = "default_floor")]
    pub floor: SurfaceDocument,
    /// Default: reflectance 0.5.
    #[serde(default = "default_walls")]
    pub walls: SurfaceDocument,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_north: Option<SurfaceDocument>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_east: Option<SurfaceDocument>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_south: Option<SurfaceDocument>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wall_west: Option<SurfaceDocument>,
    /// Default: reflectance 0.7.
    #[serde(default = "default_ceiling")]
    pub ceiling: SurfaceDocument,
}

fn default_floor() -> SurfaceDocument {
    SurfaceDocument::diffuse(0.2)
}

fn default_walls() -> SurfaceDocument {
    SurfaceDocument::diffuse(0.5)
}

fn default_ceiling() -> SurfaceDocument {
    SurfaceDocument::diffuse(0.7)
}

impl Default for SurfacesDocument {
    fn default() -> Self {
        Self {
            floor: default_floor(),
            walls: default_walls(),
            wall_north: None,
            wall_east: None,
            wall_south: None,
            wall_west: None,
            ceiling: default_ceiling(),
        }
    }
}

/// A surface: `reflectance` and perhaps `specular`, or `open` = missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SurfaceDocument {
    /// Diffuse (Lambertian), of a closed surface; < 1 in every channel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Albedo>)]
    pub reflectance: Option<Coefficient>,
    /// Reflectance about the mirror direction, beside the diffuse `reflectance` and the same at every angle (directional
    /// to hemispherical); `reflectance + specular` is < 1 in every channel. Default: 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<Albedo>)]
    pub specular: Option<Coefficient>,
    /// Of the specular part. 0, the default: an ideal mirror. From 0.02 to 1: a glossy lobe of GGX microfacets with alpha =
    /// roughness^2, height-correlated masking and shadowing, and compensation for multiple scattering, so that `specular`
    /// is its reflectance at every angle. Between 0 and 0.02 it is refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(minimum = 0, maximum = 1)]
    pub roughness: Option<f64>,
    /// The face is missing: light leaves, a camera may look in.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub open: bool,
}

impl SurfaceDocument {
    pub fn diffuse(reflectance: f64) -> Self {
        Self { reflectance: Some(Coefficient::Photopic(reflectance)), ..Self::default() }
    }
}

/// An object in the room.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", try_from = "RawObject")]
pub enum ObjectDocument {
    /// A box with vertical sides.
    Box {
        /// Extent along its own x, y and z, each > 0.
        #[schema(value_type = BoxSize)]
        size_m: [f64; 3],
        /// Centre of its base.
        #[schema(value_type = Vector)]
        position_m: [f64; 3],
        /// Clockwise seen from above.
        #[schema(required = false, default = 0.0, minimum = -360, maximum = 360)]
        rotation_deg: f64,
        surface: SurfaceDocument,
    },
    /// A triangle mesh.
    Mesh {
        /// Id of an uploaded mesh, or a file beside the job file.
        mesh: String,
        unit: Unit,
        /// Where the mesh's origin goes.
        #[schema(value_type = Vector)]
        position_m: [f64; 3],
        /// Clockwise seen from above.
        #[schema(required = false, default = 0.0, minimum = -360, maximum = 360)]
        rotation_deg: f64,
        /// By the name of the material in the file.
        surfaces: BTreeMap<String, SurfaceDocument>,
    },
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum ObjectKind {
    Box,
    Mesh,
}

/// The fields of all kinds of objects.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawObject {
    kind: ObjectKind,
    size_m: Option<[f64; 3]>,
    position_m: Option<[f64; 3]>,
    rotation_deg: Option<f64>,
    surface: Option<SurfaceDocument>,
    mesh: Option<String>,
    unit: Option<Unit>,
    surfaces: Option<BTreeMap<String, SurfaceDocument>>,
}

impl TryFrom<RawObject> for ObjectDocument {
    type Error = Misfit;

    fn try_from(raw: RawObject) -> Result<Self, Misfit> {
        match raw.kind {
            ObjectKind::Box => {
                let of = "an object of kind `box`";
                absent(&raw.mesh, "mesh", of)?;
                absent(&raw.unit, "unit", of)?;
                absent(&raw.surfaces, "surfaces", of)?;
                Ok(Self::Box {
                    size_m: required(raw.size_m, "size_m")?,
                    position_m: required(raw.position_m, "position_m")?,
                    rotation_deg: raw.rotation_deg.unwrap_or(0.0),
                    surface: required(raw.surface, "surface")?,
                })
            }
            ObjectKind::Mesh => {
                let of = "an object of kind `mesh`";
                absent(&raw.size_m, "size_m", of)?;
                absent(&raw.surface, "surface", of)?;
                Ok(Self::Mesh {
                    mesh: required(raw.mesh, "mesh")?,
                    unit: required(raw.unit, "unit")?,
                    position_m: required(raw.position_m, "position_m")?,
                    rotation_deg: raw.rotation_deg.unwrap_or(0.0),
                    surfaces: required(raw.surfaces, "surfaces")?,
                })
            }
        }
    }
}

/// A Lambertian area light: a thin black sheet inside the room that emits on one side and stops light on both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LuminaireDocument {
    pub kind: LuminaireKind,
    #[schema(value_type = Vector)]
    pub corner_m: [f64; 3],
    #[schema(value_type = Vector)]
    pub edge_u_m: [f64; 3],
    /// At a right angle to `edge_u_m`; light leaves along u x v.
    #[schema(value_type = Vector)]
    pub edge_v_m: [f64; 3],
    /// 0..1000000000, the same over the whole rectangle and in all directions.
    #[schema(value_type = Luminance)]
    pub luminance_cd_m2: Coefficient,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LuminaireKind {
    Rectangle,
}

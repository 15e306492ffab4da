//! The tubes of a job document: cylinders or meshes, their collectors and diffusers.

pub(in crate::document) mod check;
pub(in crate::document) mod mesh;

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::optics::coefficient::Coefficient;
use crate::document::optics::measured::MeasuredDocument;
use crate::document::optics::mirror::MirrorDocument;
use crate::document::read::{Misfit, absent, required};
use crate::document::schema::PlanePoint;

/// A tubular daylight device above a round opening in the ceiling.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(untagged, try_from = "RawTube")]
pub enum TubeDocument {
    Parametric(ParametricTube),
    Mesh(MeshTubeDocument),
}

/// Equal mirror cylinders that meet in mitred elbows.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ParametricTube {
    /// Centre of the opening in the ceiling plane.
    #[schema(value_type = PlanePoint)]
    pub centre_m: [f64; 2],
    /// Inner diameter; the opening lies wholly inside the ceiling.
    #[schema(exclusive_minimum = 0, maximum = 10_000)]
    pub diameter_m: f64,
    /// Specular, per bounce.
    pub reflectance: MirrorDocument,
    /// From the ceiling upward, 1..16; the first is vertical.
    #[schema(min_items = 1, max_items = 16)]
    pub segments: Vec<SegmentDocument>,
    pub collector: CollectorDocument,
    pub diffuser: DiffuserDocument,
}

/// A straight piece of a guide.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SegmentDocument {
    /// Along the axis between mitre centres.
    #[schema(exclusive_minimum = 0, maximum = 1000)]
    pub length_m: f64,
    /// Lean of the axis from the vertical.
    #[serde(default)]
    #[schema(minimum = 0, maximum = 135)]
    pub tilt_deg: f64,
    /// Toward which side it leans, clockwise from the room's +y axis.
    #[serde(default)]
    #[schema(minimum = -360, maximum = 360)]
    pub azimuth_deg: f64,
}

/// A tube as a triangle mesh; its z is up, its origin sits in the centre of the opening.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct MeshTubeDocument {
    /// Id of an uploaded mesh, or a file beside the job file.
    #[schema(min_length = 1, max_length = 1024)]
    pub mesh: String,
    /// Of the mesh's coordinates: OBJ has no units.
    pub unit: Unit,
    /// Centre of the opening in the ceiling plane.
    #[schema(value_type = PlanePoint)]
    pub centre_m: [f64; 2],
    #[schema(exclusive_minimum = 0, maximum = 10_000)]
    pub opening_diameter_m: f64,
    /// Clockwise seen from above.
    #[schema(required = false, default = 0.0, minimum = -360, maximum = 360)]
    pub rotation_deg: f64,
    /// Whether a mesh that is a straight round tube is computed as the cylinder around its facets, in closed form.
    #[schema(required = false, default = true)]
    pub recognise: bool,
    /// What each material of the mesh is, by its name.
    pub parts: BTreeMap<String, PartDocument>,
}

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
    /// Metres per unit.
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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawTube {
    centre_m: Option<[f64; 2]>,
    diameter_m: Option<f64>,
    reflectance: Option<MirrorDocument>,
    segments: Option<Vec<SegmentDocument>>,
    collector: Option<CollectorDocument>,
    diffuser: Option<DiffuserDocument>,
    mesh: Option<String>,
    unit: Option<Unit>,
    opening_diameter_m: Option<f64>,
    rotation_deg: Option<f64>,
    recognise: Option<bool>,
    parts: Option<BTreeMap<String, PartDocument>>,
}

impl TryFrom<RawTube> for TubeDocument {
    type Error = Misfit;

    fn try_from(raw: RawTube) -> Result<Self, Misfit> {
        if raw.mesh.is_some() || raw.parts.is_some() {
            let of = "a tube that is a mesh";
            absent(&raw.diameter_m, "diameter_m", of)?;
            absent(&raw.reflectance, "reflectance", of)?;
            absent(&raw.segments, "segments", of)?;
            absent(&raw.collector, "collector", of)?;
            absent(&raw.diffuser, "diffuser", of)?;
            return Ok(Self::Mesh(MeshTubeDocument {
                mesh: required(raw.mesh, "mesh")?,
                unit: required(raw.unit, "unit")?,
                centre_m: required(raw.centre_m, "centre_m")?,
                opening_diameter_m: required(raw.opening_diameter_m, "opening_diameter_m")?,
                rotation_deg: raw.rotation_deg.unwrap_or(0.0),
                recognise: raw.recognise.unwrap_or(true),
                parts: required(raw.parts, "parts")?,
            }));
        }
        let of = "a tube without `mesh`";
        absent(&raw.unit, "unit", of)?;
        absent(&raw.opening_diameter_m, "opening_diameter_m", of)?;
        absent(&raw.rotation_deg, "rotation_deg", of)?;
        absent(&raw.recognise, "recognise", of)?;
        Ok(Self::Parametric(ParametricTube {
            centre_m: required(raw.centre_m, "centre_m")?,
            diameter_m: required(raw.diameter_m, "diameter_m")?,
            reflectance: required(raw.reflectance, "reflectance")?,
            segments: required(raw.segments, "segments")?,
            collector: required(raw.collector, "collector")?,
            diffuser: required(raw.diffuser, "diffuser")?,
        }))
    }
}

/// What covers the upper end of a tube; directions are unchanged except by `dielectric_dome`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", try_from = "RawCollector")]
pub enum CollectorDocument {
    Open,
    /// A pane across the end of the tube.
    Flat {
        transmittance: Coefficient,
    },
    /// A thin hemisphere.
    Dome {
        transmittance: Coefficient,
    },
    /// A hemispherical shell that reflects and refracts by Fresnel; its inner radius is the tube's, its rim is black.
    DielectricDome {
        /// 1..4.
        #[schema(minimum = 1, maximum = 4)]
        refractive_index: f64,
        /// Up to 1.
        #[schema(exclusive_minimum = 0, maximum = 1)]
        thickness_m: f64,
        /// Napierian absorption coefficient of its material: s metres leave exp(-absorption s); 0 when absent.
        #[schema(required = false, default = 0.0, minimum = 0, maximum = 1_000_000)]
        absorption_per_m: f64,
    },
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum CollectorKind {
    Open,
    Flat,
    Dome,
    DielectricDome,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawCollector {
    kind: CollectorKind,
    transmittance: Option<Coefficient>,
    refractive_index: Option<f64>,
    thickness_m: Option<f64>,
    absorption_per_m: Option<f64>,
}

impl TryFrom<RawCollector> for CollectorDocument {
    type Error = Misfit;

    fn try_from(raw: RawCollector) -> Result<Self, Misfit> {
        let of = match raw.kind {
            CollectorKind::Open => "a collector of kind `open`",
            CollectorKind::Flat => "a collector of kind `flat`",
            CollectorKind::Dome => "a collector of kind `dome`",
            CollectorKind::DielectricDome => "a collector of kind `dielectric_dome`",
        };
        if let CollectorKind::DielectricDome = raw.kind {
            absent(&raw.transmittance, "transmittance", of)?;
            return Ok(Self::DielectricDome {
                refractive_index: required(raw.refractive_index, "refractive_index")?,
                thickness_m: required(raw.thickness_m, "thickness_m")?,
                absorption_per_m: raw.absorption_per_m.unwrap_or(0.0),
            });
        }
        absent(&raw.refractive_index, "refractive_index", of)?;
        absent(&raw.thickness_m, "thickness_m", of)?;
        absent(&raw.absorption_per_m, "absorption_per_m", of)?;
        if let CollectorKind::Open = raw.kind {
            absent(&raw.transmittance, "transmittance", of)?;
            return Ok(Self::Open);
        }
        let transmittance = required(raw.transmittance, "transmittance")?;
        Ok(match raw.kind {
            CollectorKind::Flat => Self::Flat { transmittance },
            _ => Self::Dome { transmittance },
        })
    }
}

/// What closes a tube in the plane of the ceiling; `transmittance + reflectance <= 1`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case", try_from = "RawDiffuser")]
pub enum DiffuserDocument {
    Open,
    /// Specular: the direction is unchanged.
    Clear {
        transmittance: Coefficient,
    },
    /// Scatters to the far side and back by Lambert's law.
    Lambertian {
        transmittance: Coefficient,
        #[schema(required = false)]
        reflectance: Coefficient,
    },
    /// A Lambertian and a clear zone, divided by a circle.
    Mixed {
        /// Radius of the dividing circle, within the opening.
        #[schema(minimum = 0, maximum = 5_000)]
        lambertian_radius_m: f64,
        /// Which zone is inside.
        inner: ZoneDocument,
        lambertian_transmittance: Coefficient,
        #[schema(required = false)]
        lambertian_reflectance: Coefficient,
        clear_transmittance: Coefficient,
    },
    Measured(MeasuredDocument),
}

/// A zone of a mixed diffuser.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZoneDocument {
    Lambertian,
    Clear,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum DiffuserKind {
    Open,
    Clear,
    Lambertian,
    Mixed,
    Measured,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawDiffuser {
    kind: DiffuserKind,
    transmittance: Option<Coefficient>,
    reflectance: Option<Coefficient>,
    lambertian_radius_m: Option<f64>,
    inner: Option<ZoneDocument>,
    lambertian_transmittance: Option<Coefficient>,
    lambertian_reflectance: Option<Coefficient>,
    clear_transmittance: Option<Coefficient>,
    incidence_deg: Option<Vec<f64>>,
    exit_deg: Option<Vec<f64>>,
    btdf_per_sr: Option<Vec<Vec<f64>>>,
    brdf_per_sr: Option<Vec<Vec<f64>>>,
}

impl TryFrom<RawDiffuser> for DiffuserDocument {
    type Error = Misfit;

    fn try_from(raw: RawDiffuser) -> Result<Self, Misfit> {
        let of = match raw.kind {
            DiffuserKind::Open => "a diffuser of kind `open`",
            DiffuserKind::Clear => "a diffuser of kind `clear`",
            DiffuserKind::Lambertian => "a diffuser of kind `lambertian`",
            DiffuserKind::Mixed => "a diffuser of kind `mixed`",
            DiffuserKind::Measured => "a diffuser of kind `measured`",
        };
        if let DiffuserKind::Measured = raw.kind {
            absent(&raw.transmittance, "transmittance", of)?;
            absent(&raw.reflectance, "reflectance", of)?;
            absent(&raw.lambertian_radius_m, "lambertian_radius_m", of)?;
            absent(&raw.inner, "inner", of)?;
            absent(&raw.lambertian_transmittance, "lambertian_transmittance", of)?;
            absent(&raw.lambertian_reflectance, "lambertian_reflectance", of)?;
            absent(&raw.clear_transmittance, "clear_transmittance", of)?;
            return Ok(Self::Measured(MeasuredDocument {
                incidence_deg: required(raw.incidence_deg, "incidence_deg")?,
                exit_deg: required(raw.exit_deg, "exit_deg")?,
                btdf_per_sr: required(raw.btdf_per_sr, "btdf_per_sr")?,
                brdf_per_sr: raw.brdf_per_sr,
            }));
        }
        absent(&raw.incidence_deg, "incidence_deg", of)?;
        absent(&raw.exit_deg, "exit_deg", of)?;
        absent(&raw.btdf_per_sr, "btdf_per_sr", of)?;
        absent(&raw.brdf_per_sr, "brdf_per_sr", of)?;
        if let DiffuserKind::Mixed = raw.kind {
            absent(&raw.transmittance, "transmittance", of)?;
            absent(&raw.reflectance, "reflectance", of)?;
            return Ok(Self::Mixed {
                lambertian_radius_m: required(raw.lambertian_radius_m, "lambertian_radius_m")?,
                inner: required(raw.inner, "inner")?,
                lambertian_transmittance: required(raw.lambertian_transmittance, "lambertian_transmittance")?,
                lambertian_reflectance: raw.lambertian_reflectance.unwrap_or_default(),
                clear_transmittance: required(raw.clear_transmittance, "clear_transmittance")?,
            });
        }
        absent(&raw.lambertian_radius_m, "lambertian_radius_m", of)?;
        absent(&raw.inner, "inner", of)?;
        absent(&raw.lambertian_transmittance, "lambertian_transmittance", of)?;
        absent(&raw.lambertian_reflectance, "lambertian_reflectance", of)?;
        absent(&raw.clear_transmittance, "clear_transmittance", of)?;
        if let DiffuserKind::Lambertian = raw.kind {
            return Ok(Self::Lambertian {
                transmittance: required(raw.transmittance, "transmittance")?,
                reflectance: raw.reflectance.unwrap_or_default(),
            });
        }
        absent(&raw.reflectance, "reflectance", of)?;
        if let DiffuserKind::Clear = raw.kind {
            return Ok(Self::Clear { transmittance: required(raw.transmittance, "transmittance")? });
        }
        absent(&raw.transmittance, "transmittance", of)?;
        Ok(Self::Open)
    }
}

/// What a material of a mesh tube is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "role", rename_all = "snake_case", try_from = "RawPart")]
pub enum PartDocument {
    /// A thin cover; the direction is unchanged. `transmittance + reflectance <= 1`.
    Collector {
        transmittance: Coefficient,
        #[schema(required = false)]
        reflectance: Coefficient,
    },
    /// A specular mirror.
    Pipe { reflectance: MirrorDocument },
    /// The closure, in the plane z = 0.
    Diffuser(DiffuserDocument),
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "snake_case")]
enum Role {
    Collector,
    Pipe,
    Diffuser,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RawPart {
    role: Role,
    kind: Option<DiffuserKind>,
    transmittance: Option<Coefficient>,
    reflectance: Option<MirrorDocument>,
    lambertian_radius_m: Option<f64>,
    inner: Option<ZoneDocument>,
    lambertian_transmittance: Option<Coefficient>,
    lambertian_reflectance: Option<Coefficient>,
    clear_transmittance: Option<Coefficient>,
    incidence_deg: Option<Vec<f64>>,
    exit_deg: Option<Vec<f64>>,
    btdf_per_sr: Option<Vec<Vec<f64>>>,
    brdf_per_sr: Option<Vec<Vec<f64>>>,
}

impl TryFrom<RawPart> for PartDocument {
    type Error = Misfit;

    fn try_from(raw: RawPart) -> Result<Self, Misfit> {
        if let Role::Diffuser = raw.role {
            let diffuser = RawDiffuser {
                kind: required(raw.kind, "kind")?,
                transmittance: raw.transmittance,
                reflectance: raw.reflectance.map(|value| value.constant("reflectance", "a diffuser")).transpose()?,
                lambertian_radius_m: raw.lambertian_radius_m,
                inner: raw.inner,
                lambertian_transmittance: raw.lambertian_transmittance,
                lambertian_reflectance: raw.lambertian_reflectance,
                clear_transmittance: raw.clear_transmittance,
                incidence_deg: raw.incidence_deg,
                exit_deg: raw.exit_deg,
                btdf_per_sr: raw.btdf_per_sr,
                brdf_per_sr: raw.brdf_per_sr,
            };
            return Ok(Self::Diffuser(diffuser.try_into()?));
        }
        let of = match raw.role {
            Role::Collector => "a part of role `collector`",
            _ => "a part of role `pipe`",
        };
        absent(&raw.kind, "kind", of)?;
        absent(&raw.lambertian_radius_m, "lambertian_radius_m", of)?;
        absent(&raw.inner, "inner", of)?;
        absent(&raw.lambertian_transmittance, "lambertian_transmittance", of)?;
        absent(&raw.lambertian_reflectance, "lambertian_reflectance", of)?;
        absent(&raw.clear_transmittance, "clear_transmittance", of)?;
        absent(&raw.incidence_deg, "incidence_deg", of)?;
        absent(&raw.exit_deg, "exit_deg", of)?;
        absent(&raw.btdf_per_sr, "btdf_per_sr", of)?;
        absent(&raw.brdf_per_sr, "brdf_per_sr", of)?;
        if let Role::Collector = raw.role {
            return Ok(Self::Collector {
                transmittance: required(raw.transmittance, "transmittance")?,
                reflectance: raw
                    .reflectance
                    .map_or(Ok(Coefficient::ZERO), |value| value.constant("reflectance", of))?,
            });
        }
        absent(&raw.transmittance, "transmittance", of)?;
        Ok(Self::Pipe { reflectance: required(raw.reflectance, "reflectance")? })
    }
}

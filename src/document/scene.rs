//! From a document to a scene, and what explains its results.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::errors::Checks;
use super::job::{EffectSwitch, JobDocument};
use super::optics::coefficient::Coefficient;
use super::room::mesh_object::mesh_objects;
use super::room::{ObjectDocument, RoomDocument, SurfaceDocument};
use super::sky::daylight::daylight;
use super::tube::mesh::mesh_tube;
use super::tube::{CollectorDocument, DiffuserDocument, ParametricTube, PartDocument, TubeDocument, ZoneDocument};
use super::validate::validate;
use super::{DocumentErrors, MeshSource, Warning};
use crate::guide::Section;
use crate::optics::{Collector, Diffuser, DiffuserZone, Specular, Surface};
use crate::plan::effects::EffectKind;
use crate::scene::{
    BoxObject, Channels, Face, Grid, Luminaire, Room, Scene, Segment, StraightOrBent, Tube, TubeShape, View,
};
use crate::sky::zenith::ZenithFormula;

/// The five switches that explain factors of two between "correct" answers; part of every result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Provenance {
    /// Null without a sky.
    pub zenith: Option<ZenithProvenance>,
    /// Null without a sky.
    pub sun: Option<SunProvenance>,
    /// Null without a sky.
    pub refraction: Option<RefractionProvenance>,
    /// Whether light reflected between the room's surfaces is in the result.
    pub interreflection: bool,
    /// One per tube.
    pub guides: Vec<GuideProvenance>,
}

/// How the absolute level of the sky was found.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ZenithProvenance {
    pub formula: ZenithFormulaName,
    /// Of the formula `dv_ev`: the ratio of diffuse to extraterrestrial illuminance, given or typical of the type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub dv_ev: Option<f64>,
    /// Of the formula `luminous_turbidity`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub luminous_turbidity: Option<f64>,
    pub zenith_luminance_cd_m2: f64,
    /// Unobstructed, of the sky alone.
    pub horizontal_illuminance_lux: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum ZenithFormulaName {
    GivenZenithLuminance,
    GivenHorizontalIlluminance,
    DvEv,
    LuminousTurbidity,
    IesHorizontalIlluminance,
}

impl From<ZenithFormula> for ZenithFormulaName {
    fn from(formula: ZenithFormula) -> Self {
        match formula {
            ZenithFormula::GivenZenithLuminance => Self::GivenZenithLuminance,
            ZenithFormula::GivenHorizontalIlluminance => Self::GivenHorizontalIlluminance,
            ZenithFormula::DiffuseRatio { .. } => Self::DvEv,
            ZenithFormula::Turbidity { .. } => Self::LuminousTurbidity,
            ZenithFormula::IesHorizontalIlluminance => Self::IesHorizontalIlluminance,
        }
    }
}

/// The sun's beam.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SunProvenance {
    pub on: bool,
    pub source: BeamSource,
    pub normal_illuminance_lux: f64,
    /// Unobstructed, of the beam alone.
    pub horizontal_illuminance_lux: f64,
    /// Apparent.
    pub altitude_deg: f64,
    /// Clockwise from north, 0..360.
    pub azimuth_deg: f64,
}

/// Where the beam's illuminance comes from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum BeamSource {
    /// The document.
    Given,
    /// The type of the sky has no sun.
    SunlessType,
    /// 133.8 klx exp(-a m Tv).
    Turbidity { luminous_turbidity: f64 },
    /// 127.5 klx exp(-c / sin(altitude)).
    Ies { extinction: f64 },
}

/// Refraction of the solar altitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum RefractionProvenance {
    /// The altitude comes from place and time, with refraction at 1013.25 mbar and 15 C.
    Applied { airless_altitude_deg: f64 },
    /// The document gives the sun's position, which counts as apparent.
    Given,
}

/// How a tube's guide is represented.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GuideProvenance {
    ClosedFormStraight,
    ClosedFormBent,
    /// A mesh that was recognised as a cylinder and is computed in closed form.
    ClosedFormStraightRecognised,
    /// Traced facet by facet.
    Mesh,
}

/// The scene of a document, with notes to its reader and what explains its results.
///
/// Validates first, so that a document made in code gets the same errors as one from text.
pub fn to_scene(
    document: &JobDocument,
    meshes: &dyn MeshSource,
) -> Result<(Scene, Vec<Warning>, Provenance), DocumentErrors> {
    let mut checks = Checks::default();
    validate(document, &mut checks);
    if !checks.errors.is_empty() {
        return Err(DocumentErrors(checks.errors));
    }
    let mut warnings = Vec::new();
    let daylight = daylight(document, &mut checks, &mut warnings);
    let (tubes, guides): (Vec<Tube>, Vec<GuideProvenance>) = document
        .tubes
        .iter()
        .enumerate()
        .filter_map(|(index, tube)| tube_of(&format!("/tubes/{index}"), tube, meshes, &mut checks))
        .unzip();
    let meshes = mesh_objects(&document.room, meshes, &mut checks);
    let views = views(document, &mut checks);
    if !checks.errors.is_empty() {
        return Err(DocumentErrors(checks.errors));
    }
    let off = document.effects.get(EffectKind::Interreflection.name()) == Some(&EffectSwitch::Off);
    let (daylight, mut provenance) = match daylight {
        Some((daylight, provenance)) => (Some(daylight), provenance),
        None => (None, Provenance { zenith: None, sun: None, refraction: None, interreflection: true, guides: vec![] }),
    };
    provenance.interreflection = !off;
    provenance.guides = guides;
    let channels = if is_coloured(document) { Channels::Rgb } else { Channels::Photopic };
    let scene = Scene {
        daylight,
        room: Room { meshes, ..room(&document.room) },
        tubes,
        grids: grids(document),
        views,
        channels,
    };
    Ok((scene, warnings, provenance))
}

pub(super) fn surface(surface: &SurfaceDocument) -> Option<Surface> {
    let reflectance = surface.reflectance.filter(|_| !surface.open)?;
    let specular = surface.specular.map(Coefficient::rgb).filter(|rgb| rgb.iter().any(|value| *value > 0.0));
    let roughness = surface.roughness.unwrap_or(0.0);
    let specular = specular.map(|reflectance| Specular { reflectance, roughness });
    Some(Surface { reflectance: reflectance.rgb(), specular })
}

fn room(room: &RoomDocument) -> Room {
    let faces = &room.surfaces;
    let wall = |single: &Option<SurfaceDocument>| surface(single.as_ref().unwrap_or(&faces.walls));
    let surfaces = Face::ALL.map(|face| match face {
        Face::West => wall(&faces.wall_west),
        Face::East => wall(&faces.wall_east),
        Face::South => wall(&faces.wall_south),
        Face::North => wall(&faces.wall_north),
        Face::Floor => surface(&faces.floor),
        Face::Ceiling => surface(&faces.ceiling),
    });
    let boxes = room.objects.iter().filter_map(|object| match object {
        ObjectDocument::Box { size_m, position_m, rotation_deg, surface: of_box } => Some(BoxObject {
            size: DVec3::from(*size_m),
            base: DVec3::from(*position_m),
            rotation: rotation_deg.to_radians(),
            surface: surface(of_box)?,
        }),
        ObjectDocument::Mesh { .. } => None,
    });
    let luminaires = room.luminaires.iter().map(|luminaire| Luminaire {
        corner: DVec3::from(luminaire.corner_m),
        edge_u: DVec3::from(luminaire.edge_u_m),
        edge_v: DVec3::from(luminaire.edge_v_m),
        luminance: luminaire.luminance_cd_m2.rgb(),
    });
    Room {
        size: DVec3::from(room.size_m),
        surfaces,
        boxes: boxes.collect(),
        meshes: Vec::new(),
        luminaires: luminaires.collect(),
    }
}

fn tube_of(
    pointer: &str,
    tube: &TubeDocument,
    meshes: &dyn MeshSource,
    checks: &mut Checks,
) -> Option<(Tube, GuideProvenance)> {
    match tube {
        TubeDocument::Parametric(tube) => Some(cylinders(tube)),
        TubeDocument::Mesh(document) => {
            let (mesh, diffuser) = mesh_tube(pointer, document, meshes, checks)?;
            let guide = match mesh.section {
                Section::Cylinder(_) => GuideProvenance::ClosedFormStraightRecognised,
                Section::Facets { .. } => GuideProvenance::Mesh,
            };
            let tube = Tube {
                centre: DVec2::from(document.centre_m),
                opening_radius: 0.5 * document.opening_diameter_m,
                shape: TubeShape::Mesh(mesh),
                diffuser,
            };
            Some((tube, guide))
        }
    }
}

fn cylinders(tube: &ParametricTube) -> (Tube, GuideProvenance) {
    let segments = tube.segments.iter().map(|segment| Segment {
        length_m: segment.length_m,
        tilt: segment.tilt_deg.to_radians(),
        azimuth: segment.azimuth_deg.to_radians(),
    });
    let shape = StraightOrBent {
        reflectance: tube.reflectance.mirror(),
        segments: segments.collect(),
        collector: collector(&tube.collector),
    };
    // as many vertical segments as one likes make one straight tube
    let straight = shape.segments.iter().all(|segment| segment.tilt == 0.0);
    let tube = Tube {
        centre: DVec2::from(tube.centre_m),
        opening_radius: 0.5 * tube.diameter_m,
        shape: TubeShape::Cylinders(shape),
        diffuser: diffuser(&tube.diffuser),
    };
    (tube, if straight { GuideProvenance::ClosedFormStraight } else { GuideProvenance::ClosedFormBent })
}

fn collector(collector: &CollectorDocument) -> Collector {
    match *collector {
        CollectorDocument::Open => Collector::Open,
        CollectorDocument::Flat { transmittance } => Collector::Flat { transmittance: transmittance.rgb() },
        CollectorDocument::Dome { transmittance } => Collector::Dome { transmittance: transmittance.rgb() },
        CollectorDocument::DielectricDome { refractive_index, thickness_m, absorption_per_m } => {
            Collector::DielectricDome { refractive_index, thickness_m, absorption_per_m }
        }
    }
}

pub(super) fn diffuser(diffuser: &DiffuserDocument) -> Diffuser {
    match *diffuser {
        DiffuserDocument::Open => Diffuser::Open,
        DiffuserDocument::Clear { transmittance } => Diffuser::Clear { transmittance: transmittance.rgb() },
        DiffuserDocument::Lambertian { transmittance, reflectance } => {
            Diffuser::Lambertian { transmittance: transmittance.rgb(), reflectance: reflectance.rgb() }
        }
        DiffuserDocument::Mixed {
            lambertian_radius_m,
            inner,
            lambertian_transmittance,
            lambertian_reflectance,
            clear_transmittance,
        } => Diffuser::Mixed {
            lambertian_radius_m,
            inner: match inner {
                ZoneDocument::Lambertian => DiffuserZone::Lambertian,
                ZoneDocument::Clear => DiffuserZone::Clear,
            },
            lambertian_transmittance: lambertian_transmittance.rgb(),
            lambertian_reflectance: lambertian_reflectance.rgb(),
            clear_transmittance: clear_transmittance.rgb(),
        },
        // the validation has built the table before; a bad one would let nothing pass
        DiffuserDocument::Measured(ref table) => {
            table.diffuser().map_or(Diffuser::Lambertian { transmittance: [0.0; 3], reflectance: [0.0; 3] }, |table| {
                Diffuser::Measured(table.into())
            })
        }
    }
}

fn grids(document: &JobDocument) -> Vec<Grid> {
    let [width, depth, _] = document.room.size_m;
    let grid = |grid: &super::outputs::GridDocument| {
        let cells = grid.cells.map(|cells| cells as usize);
        Grid::new(grid.name.clone(), grid.height_m, cells, grid.margin_m, [width, depth], grid.estimate.into())
    };
    document.grids.iter().map(grid).collect()
}

fn views(document: &JobDocument, checks: &mut Checks) -> Vec<View> {
    let mut views = Vec::with_capacity(document.views.len());
    for (index, view) in document.views.iter().enumerate() {
        let made = View::new(
            view.name.clone(),
            DVec3::from(view.eye_m),
            DVec3::from(view.look_at_m),
            DVec3::from(view.up),
            view.vertical_fov_deg.to_radians(),
            view.size_px.map(|size| size as usize),
        );
        match made {
            Some(view) => views.push(view),
            None => checks.refuse(format!("/views/{index}/up"), "must not be parallel to the viewing direction"),
        }
    }
    views
}

/// Whether any coefficient that takes part is `[r, g, b]`.
fn is_coloured(document: &JobDocument) -> bool {
    let faces = &document.room.surfaces;
    let single = [&faces.wall_north, &faces.wall_east, &faces.wall_south, &faces.wall_west];
    let of_faces = [Some(&faces.floor), Some(&faces.ceiling)].into_iter().chain(single.map(Option::as_ref)).flatten();
    let walls = single.iter().any(|wall| wall.is_none()).then_some(&faces.walls);
    let of_objects = document.room.objects.iter().flat_map(|object| match object {
        ObjectDocument::Box { surface, .. } => vec![surface],
        ObjectDocument::Mesh { surfaces, .. } => surfaces.values().collect(),
    });
    let surfaces =
        of_faces.chain(walls).chain(of_objects).flat_map(|surface| [surface.reflectance, surface.specular]).flatten();
    let tubes = document.tubes.iter().flat_map(tube_coefficients);
    let luminaires = document.room.luminaires.iter().map(|luminaire| luminaire.luminance_cd_m2);
    surfaces.chain(tubes).chain(luminaires).any(Coefficient::is_coloured)
}

fn tube_coefficients(tube: &TubeDocument) -> Vec<Coefficient> {
    match tube {
        TubeDocument::Parametric(tube) => {
            let mut coefficients = tube.reflectance.coefficients();
            if let CollectorDocument::Flat { transmittance } | CollectorDocument::Dome { transmittance } =
                tube.collector
            {
                coefficients.push(transmittance);
            }
            coefficients.extend(diffuser_coefficients(&tube.diffuser));
            coefficients
        }
        TubeDocument::Mesh(tube) => tube
            .parts
            .values()
            .flat_map(|part| match part {
                PartDocument::Collector { transmittance, reflectance } => vec![*transmittance, *reflectance],
                PartDocument::Pipe { reflectance } => reflectance.coefficients(),
                PartDocument::Diffuser(diffuser) => diffuser_coefficients(diffuser),
            })
            .collect(),
    }
}

fn diffuser_coefficients(diffuser: &DiffuserDocument) -> Vec<Coefficient> {
    match *diffuser {
        DiffuserDocument::Open | DiffuserDocument::Measured(_) => vec![],
        DiffuserDocument::Clear { transmittance } => vec![transmittance],
        DiffuserDocument::Lambertian { transmittance, reflectance } => vec![transmittance, reflectance],
        DiffuserDocument::Mixed { lambertian_transmittance, lambertian_reflectance, clear_transmittance, .. } => {
            vec![lambertian_transmittance, lambertian_reflectance, clear_transmittance]
        }
    }
}

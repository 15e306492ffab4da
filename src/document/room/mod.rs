//! The room of a job document: its surfaces, objects and luminaires.

pub(super) mod check;
pub(super) mod convert;
pub mod luminaire;
pub mod mesh_object;
pub mod object;
pub(super) mod openings;
pub mod plan;
pub(super) mod sheets;
pub mod surface;

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::errors::{Checks, FieldError, FieldErrorCode};
use crate::document::limits::ROOM_EDGE_M;
use crate::document::optics::Coefficient;
use crate::document::read::tagged::Fields;
use crate::document::schema::shapes::RoomSize;
use crate::scene::{Enclosure, EnclosureFace, FaceKind};
use luminaire::LuminaireDocument;
use object::ObjectDocument;
use plan::{CeilingDocument, PartitionDocument, PlanDocument};
use surface::SurfaceDocument;

/// A room: a box with `size_m`, or a `plan` with a `ceiling`. Its floor is at z = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomDocument {
    /// Extent of a box along x, y and z in metres, each 0.01..1000; its floor spans (0, 0, 0) to (size_x, size_y, 0). Required unless
    /// there is a `plan`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<RoomSize>)]
    pub size_m: Option<[f64; 3]>,
    /// Floor of a room with upright walls on a polygon, in place of `size_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanDocument>,
    /// Ceiling over the `plan`, required with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ceiling: Option<CeilingDocument>,
    /// Thin walls that stand in the room, at most 256.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub partitions: Vec<PartitionDocument>,
    /// Azimuth of the room's +y axis in degrees, clockwise from north.
    #[serde(default)]
    pub rotation_deg: f64,
    /// Surfaces of the faces.
    #[serde(default)]
    pub surfaces: SurfacesDocument,
    /// Objects in the room, at most 1000.
    #[serde(default)]
    pub objects: Vec<ObjectDocument>,
    /// Luminaires in the room, at most 256.
    #[serde(default)]
    pub luminaires: Vec<LuminaireDocument>,
}

/// Surfaces of the room's faces: of a kind of faces, or of one face, which takes precedence.
///
/// The faces of a box are `floor`, `wall_north`, `wall_east`, `wall_south`, `wall_west` and `ceiling`. Those of a plan are `floor`, a wall
/// `wall_K` for each edge K from 0, and `ceiling`, or `ceiling_0` and `ceiling_1` for the two planes of a gable.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct SurfacesDocument {
    /// Surface of the floor; default: reflectance 0.2.
    #[serde(default = "default_floor")]
    pub floor: SurfaceDocument,
    /// Surface of the walls; default: reflectance 0.5.
    #[serde(default = "default_walls")]
    pub walls: SurfaceDocument,
    /// Surface of the ceiling; default: reflectance 0.7.
    #[serde(default = "default_ceiling")]
    pub ceiling: SurfaceDocument,
    /// Surfaces of single faces by their names.
    #[serde(flatten)]
    #[schema(ignore)]
    pub single: BTreeMap<String, SurfaceDocument>,
}

/// Surfaces by kinds of faces, as they are read.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct KindSurfaces {
    #[serde(default = "default_floor")]
    floor: SurfaceDocument,
    #[serde(default = "default_walls")]
    walls: SurfaceDocument,
    #[serde(default = "default_ceiling")]
    ceiling: SurfaceDocument,
}

/// Deserialises the fields of kinds of faces, and any with a name that begins as those of single walls and ceilings do.
impl<'de> Deserialize<'de> for SurfacesDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let mut fields = Fields::deserialize(deserializer)?;
        let single =
            fields.take(|name| SINGLE.iter().any(|prefix| name.starts_with(prefix))).map_err(D::Error::custom)?;
        let KindSurfaces { floor, walls, ceiling } = fields.read("surfaces").map_err(D::Error::custom)?;
        Ok(Self { floor, walls, ceiling, single })
    }
}

/// Beginnings of the names of single faces.
const SINGLE: [&str; 2] = ["wall_", "ceiling_"];

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
        Self { floor: default_floor(), walls: default_walls(), ceiling: default_ceiling(), single: BTreeMap::new() }
    }
}

impl SurfacesDocument {
    /// Returns the surface of a face, and the name of the field that gives it.
    pub fn of_face<'a>(&'a self, face: &'a EnclosureFace) -> (&'a str, &'a SurfaceDocument) {
        match (self.single.get(&face.name), face.kind) {
            (Some(surface), _) => (&face.name, surface),
            (None, FaceKind::Floor) => ("floor", &self.floor),
            (None, FaceKind::Wall) => ("walls", &self.walls),
            (None, FaceKind::Ceiling) => ("ceiling", &self.ceiling),
        }
    }
}

impl RoomDocument {
    /// Returns a room in box form with default surfaces.
    pub fn cuboid(size_m: [f64; 3]) -> Self {
        Self {
            size_m: Some(size_m),
            plan: None,
            ceiling: None,
            partitions: Vec::new(),
            rotation_deg: 0.0,
            surfaces: SurfacesDocument::default(),
            objects: Vec::new(),
            luminaires: Vec::new(),
        }
    }

    /// Builds the faces of the room; `None` after a fault, which is added to `checks`, so that no other field can be checked against it.
    pub(crate) fn enclosure(&self, checks: &mut Checks) -> Option<Enclosure> {
        let mut enclosure = match (&self.size_m, &self.plan) {
            (Some(size), None) => {
                if self.ceiling.is_some() {
                    checks.refuse(
                        "/room/ceiling",
                        "must be left out without a `plan`: a box has the height of its `size_m`",
                    );
                }
                let good = checks.numbers("/room/size_m", size, ROOM_EDGE_M);
                good.then(|| Enclosure::cuboid(DVec3::from(*size), [None; 6]))
            }
            (None, Some(plan)) => match &self.ceiling {
                Some(ceiling) => plan.enclosure(ceiling, checks),
                None => {
                    checks.errors.push(FieldError::missing("/room/ceiling"));
                    None
                }
            },
            (Some(_), Some(_)) => {
                checks.refuse("/room/size_m", "must be left out if there is a `plan`");
                None
            }
            (None, None) => {
                let detail = "required, but missing: a room has either `size_m` or a `plan`";
                checks.refuse_as(FieldErrorCode::Missing, "/room/size_m", detail);
                None
            }
        }?;
        let surfaces: Vec<_> = enclosure.faces().iter().map(|face| self.surfaces.of_face(face).1.surface()).collect();
        enclosure.paint_all(surfaces);
        Some(enclosure)
    }

    /// Returns the extent along x, y and z in metres; zero for a room that was refused.
    pub fn extent_m(&self) -> [f64; 3] {
        self.enclosure(&mut Checks::default()).map_or([0.0; 3], |enclosure| enclosure.extent().to_array())
    }

    /// Returns the outline of the floor and its holes, in metres; empty for a room without any.
    pub fn rings(&self) -> Vec<Vec<DVec2>> {
        match (&self.plan, self.size_m) {
            (Some(plan), _) => plan.rings(),
            (None, Some([width, depth, _])) => {
                vec![[(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)].map(DVec2::from).to_vec()]
            }
            (None, None) => Vec::new(),
        }
    }

    /// Returns the number of walls.
    fn walls(&self) -> usize {
        self.plan.as_ref().map_or(4, |plan| plan.rings().iter().map(Vec::len).sum())
    }

    /// Returns all coefficients, which may be coloured, except those of `walls` where every wall has its own surface.
    pub fn coefficients(&self) -> impl Iterator<Item = Coefficient> {
        let faces = &self.surfaces;
        let own = faces.single.keys().filter(|name| name.starts_with("wall_")).count();
        let walls = (own < self.walls()).then_some(&faces.walls);
        let of_room = [&faces.floor, &faces.ceiling].into_iter().chain(walls).chain(faces.single.values());
        let of_partitions = self.partitions.iter().map(|partition| &partition.surface);
        let of_objects = self.objects.iter().flat_map(ObjectDocument::surfaces);
        let luminaires = self.luminaires.iter().map(|luminaire| luminaire.luminance_cd_m2);
        of_room.chain(of_partitions).chain(of_objects).flat_map(SurfaceDocument::coefficients).chain(luminaires)
    }
}

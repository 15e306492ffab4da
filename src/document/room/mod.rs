//! The room of a job document: its surfaces, objects and luminaires.

pub(super) mod check;
pub(super) mod closed;
pub(super) mod convert;
pub mod faces;
mod instances;
pub mod luminaire;
pub mod mesh_document;
pub mod mesh_object;
pub mod object;
pub(super) mod openings;
pub mod plan;
pub(super) mod planes;
mod rings;
pub(super) mod sheets;
pub mod surface;

use std::collections::BTreeMap;

use glam::{DVec2, DVec3};
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::document::errors::{Checks, FieldError, FieldErrorCode};
use crate::document::limits::ROOM_EDGE_M;
use crate::document::optics::Coefficient;
use crate::document::read::fault::Fault;
use crate::document::read::pointer::escape;
use crate::document::read::tagged::Fields;
use crate::document::schema::shapes::RoomSize;
use crate::scene::{Enclosure, EnclosureFace, FaceKind};
use faces::{ClosedRoom, FaceDocument, FaceKindDocument, closed_room};
use luminaire::LuminaireDocument;
use object::ObjectDocument;
use plan::{CeilingDocument, PartitionDocument, PlanDocument};
use rings::oriented;
use surface::SurfaceDocument;

/// A room: a box with `size_m`, a `plan` with a `ceiling`, or `faces`. Its lowest point is at z = 0.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct RoomDocument {
    /// Extent of a box along x, y and z in metres, each 0.01..1000; its floor spans (0, 0, 0) to (size_x, size_y, 0). Required unless
    /// there is a `plan` or there are `faces`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<RoomSize>)]
    pub size_m: Option<[f64; 3]>,
    /// Floor of a room with upright walls on a polygon, in place of `size_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub plan: Option<PlanDocument>,
    /// Ceiling over the `plan`, required with it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ceiling: Option<CeilingDocument>,
    /// Planar faces that close a room of any shape, 4..2000, in place of `size_m` and `plan`. An edge of one face may lie on edges of several
    /// others; corners closer than a millionth of the room's extent are taken for one. The lowest corner is at z = 0.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub faces: Option<Vec<FaceDocument>>,
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
/// `wall_K` for each edge K from 0, and `ceiling`, or `ceiling_0` and `ceiling_1` for the two planes of a gable. Those of `faces` have the
/// names that they state; `floor`, `walls` and `ceiling` are the kinds.
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

/// Deserialises the fields of kinds of faces, and all others as those of single faces, whose names are known when the room is.
impl<'de> Deserialize<'de> for SurfacesDocument {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        if let Some((name, _)) = value.as_object().and_then(|fields| fields.iter().find(|(_, value)| value.is_null())) {
            let message = "invalid type: null, expected a surface".to_owned();
            return Err(D::Error::custom(Fault { pointer: format!("/{}", escape(name)), message }));
        }
        let mut fields = Fields::deserialize(value).map_err(D::Error::custom)?;
        let single = fields.take(|name| !KINDS.contains(&name)).map_err(D::Error::custom)?;
        let KindSurfaces { floor, walls, ceiling } = fields.read("surfaces").map_err(D::Error::custom)?;
        Ok(Self { floor, walls, ceiling, single })
    }
}

/// Names of the surfaces of kinds of faces.
const KINDS: [&str; 3] = ["floor", "walls", "ceiling"];

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

impl RoomDocument {
    /// Returns a room in box form with default surfaces.
    pub fn cuboid(size_m: [f64; 3]) -> Self {
        Self {
            size_m: Some(size_m),
            plan: None,
            ceiling: None,
            faces: None,
            partitions: Vec::new(),
            rotation_deg: 0.0,
            surfaces: SurfacesDocument::default(),
            objects: Vec::new(),
            luminaires: Vec::new(),
        }
    }

    /// Returns a room of faces with default surfaces.
    pub fn of_faces(faces: Vec<FaceDocument>) -> Self {
        Self { size_m: None, faces: Some(faces), ..Self::cuboid([1.0; 3]) }
    }

    /// Builds the faces of the room; `None` after a fault, which is added to `checks`, so that no other field can be checked against it.
    pub(crate) fn enclosure(&self, checks: &mut Checks) -> Option<Enclosure> {
        if let (Some(_), None, _) | (_, None, Some(_)) = (&self.size_m, &self.plan, &self.faces)
            && self.ceiling.is_some()
        {
            checks.refuse("/room/ceiling", "must be left out without a `plan`");
        }
        let mut enclosure = match (&self.size_m, &self.plan, &self.faces) {
            (Some(size), None, None) => {
                let good = checks.numbers("/room/size_m", size, ROOM_EDGE_M);
                good.then(|| Enclosure::cuboid(DVec3::from(*size), [None; 6]))
            }
            (None, Some(plan), None) => match &self.ceiling {
                Some(ceiling) => plan.enclosure(ceiling, checks),
                None => {
                    checks.errors.push(FieldError::missing("/room/ceiling"));
                    None
                }
            },
            (None, None, Some(faces)) => closed_room(faces, checks).map(|room| room.enclosure),
            (None, None, None) => {
                let detail = "required, but missing: a room has either `size_m`, a `plan`, `faces` or `hbjson`";
                checks.refuse_as(FieldErrorCode::Missing, "/room/size_m", detail);
                None
            }
            (size, plan, _) => {
                let (field, other) = match (size, plan) {
                    (Some(_), Some(_)) => ("size_m", "a `plan`"),
                    (Some(_), None) => ("faces", "a `size_m`"),
                    (None, _) => ("faces", "a `plan`"),
                };
                checks.refuse(format!("/room/{field}"), format!("must be left out if there is {other}"));
                None
            }
        }?;
        let surfaces =
            enclosure.faces().iter().enumerate().map(|(number, face)| self.surface_of(number, face).1.surface());
        let surfaces: Vec<_> = surfaces.collect();
        enclosure.paint_all(surfaces);
        Some(enclosure)
    }

    /// Returns the surface of a face, given by its number, and the pointer to the field that gives it.
    pub fn surface_of(&self, number: usize, face: &EnclosureFace) -> (String, &SurfaceDocument) {
        let own = self.faces.as_ref().and_then(|faces| faces.get(number)?.surface.as_ref());
        if let Some(own) = own {
            return (format!("/room/faces/{number}/surface"), own);
        }
        let surfaces = &self.surfaces;
        let (field, surface) = match (surfaces.single.get(&face.name), face.kind) {
            (Some(single), _) => (escape(&face.name), single),
            (None, FaceKind::Floor) => ("floor".to_owned(), &surfaces.floor),
            (None, FaceKind::Wall) => ("walls".to_owned(), &surfaces.walls),
            (None, FaceKind::Ceiling) => ("ceiling".to_owned(), &surfaces.ceiling),
        };
        (format!("/room/surfaces/{field}"), surface)
    }

    /// Returns a sentence for each repair of the room's faces.
    pub fn repairs(&self) -> Vec<String> {
        match (&self.plan, &self.faces) {
            (Some(plan), _) => plan.repairs(),
            (None, Some(faces)) => {
                let room = closed_room(faces, &mut Checks::default());
                room.map_or(Vec::new(), |ClosedRoom { repairs, .. }| repairs)
            }
            (None, None) => Vec::new(),
        }
    }

    /// Returns the lowest and the highest corner of the bounds in metres; zero for a room that was refused.
    pub fn bounds_m(&self) -> [DVec3; 2] {
        self.enclosure(&mut Checks::default()).map_or([DVec3::ZERO; 2], |enclosure| enclosure.bounds())
    }

    /// Returns the outlines of the floor (counter-clockwise) and its holes (clockwise), in metres; empty for a room without any. Those of
    /// `faces` are the outlines of each face that is a floor, which may adjoin.
    pub fn rings(&self) -> Vec<Vec<DVec2>> {
        match (&self.plan, self.size_m, &self.faces) {
            (Some(plan), ..) => oriented(plan.rings()),
            (None, Some([width, depth, _]), _) => {
                vec![[(0.0, 0.0), (width, 0.0), (width, depth), (0.0, depth)].map(DVec2::from).to_vec()]
            }
            (None, None, Some(faces)) => {
                let floors = faces.iter().filter(|face| face.kind == FaceKindDocument::Floor);
                floors.flat_map(FaceDocument::rings_from_above).collect()
            }
            (None, None, None) => Vec::new(),
        }
    }

    /// True if any wall has the surface of `walls`.
    fn has_plain_walls(&self) -> bool {
        let single = &self.surfaces.single;
        if let Some(faces) = &self.faces {
            let is_plain = |face: &FaceDocument| face.surface.is_none() && !single.contains_key(&face.name);
            return faces.iter().any(|face| face.kind == FaceKindDocument::Wall && is_plain(face));
        }
        let walls = self.plan.as_ref().map_or(4, |plan| plan.rings().iter().map(Vec::len).sum());
        single.keys().filter(|name| name.starts_with("wall_")).count() < walls
    }

    /// Returns all coefficients, which may be coloured, except those of `walls` where every wall has its own surface.
    pub fn coefficients(&self) -> impl Iterator<Item = Coefficient> {
        let faces = &self.surfaces;
        let walls = self.has_plain_walls().then_some(&faces.walls);
        let of_room = [&faces.floor, &faces.ceiling].into_iter().chain(walls).chain(faces.single.values());
        let own = self.faces.iter().flatten().filter_map(|face| face.surface.as_ref());
        let of_partitions = self.partitions.iter().map(|partition| &partition.surface);
        let of_objects = self.objects.iter().flat_map(ObjectDocument::surfaces);
        let luminaires = self.luminaires.iter().map(|luminaire| luminaire.luminance_cd_m2);
        of_room
            .chain(own)
            .chain(of_partitions)
            .chain(of_objects)
            .flat_map(SurfaceDocument::coefficients)
            .chain(luminaires)
    }
}

//! Rooms above a plan: an outline with holes, the ceiling over it, and partitions.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::rings::{edges, fault_of_rings};
use super::surface::{Owner, SurfaceDocument, check_surface};
use crate::document::errors::{Checks, FieldErrorCode, tidy_m};
use crate::document::limits::{
    CEILING_HEIGHT_M, COORDINATE_M, CORNERS, HOLES, MOST_CORNERS, PITCH_DEG, ROOM_EDGE_M, TOUCHING_M, TURN_DEG,
};
use crate::document::read::tagged::{self, Reader, Tagged};
use crate::document::schema::shapes::{PlanePoint, Vector};
use crate::geometry::TriangleMesh;
use crate::geometry::covered::{self, Edge, bounds};
use crate::scene::prism::{CeilingPlane, KindSurfaces};
use crate::scene::{Enclosure, EnclosureError, MeshObject};

/// Distance of corners, as a fraction of the outline's extent, within which they are taken for one.
const SAME_CORNER: f64 = 1e-6;

/// Plan of a room: its floor seen from above.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PlanDocument {
    /// Corners of a simple polygon, x and y in metres, 3..256, in either sense. Edge K runs from corner K to the next one, and the wall on
    /// it has the name `wall_K`.
    #[schema(value_type = Vec<PlanePoint>)]
    pub outline_m: Vec<[f64; 2]>,
    /// Columns and cores, which reach from the floor to the ceiling: simple polygons within the outline, at most 64. Their edges are
    /// numbered after those of the outline.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schema(value_type = Vec<Vec<PlanePoint>>)]
    pub holes_m: Vec<Vec<[f64; 2]>>,
}

/// Ceiling over a plan.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum CeilingDocument {
    /// A level ceiling.
    Flat(FlatDocument),
    /// One plane that rises.
    Sloped(SlopedDocument),
    /// Two planes that meet in a ridge over the middle of the outline.
    Gable(GableDocument),
}

impl CeilingDocument {
    /// Returns the azimuth toward which the ceiling rises, of a gable one of two, in degrees clockwise from the room's +y axis; `None` if it
    /// is level.
    pub fn rises_toward_deg(&self) -> Option<f64> {
        match self {
            Self::Flat(_) => None,
            Self::Sloped(ceiling) => Some(ceiling.rise_toward_deg),
            Self::Gable(ceiling) => Some(ceiling.ridge_azimuth_deg + 90.0),
        }
    }
}

/// Fields of a level ceiling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct FlatDocument {
    /// Height above the floor in metres.
    pub height_m: f64,
}

/// Fields of a sloped ceiling.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct SlopedDocument {
    /// A point of the ceiling in metres.
    #[schema(value_type = Vector)]
    pub point_m: [f64; 3],
    /// Azimuth toward which the ceiling rises in degrees, clockwise from the room's +y axis.
    pub rise_toward_deg: f64,
    /// Angle between the ceiling and the horizontal in degrees.
    pub pitch_deg: f64,
}

/// Fields of a gable.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct GableDocument {
    /// Height of the ceiling in metres over the ends of the outline's extent across the ridge.
    pub eaves_m: f64,
    /// Height of the ridge in metres, over the middle of that extent; above `eaves_m`.
    pub ridge_m: f64,
    /// Azimuth of the ridge in degrees, clockwise from the room's +y axis.
    pub ridge_azimuth_deg: f64,
}

/// A partition: a thin upright wall that stands on the floor, with the same surface on both sides.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct PartitionDocument {
    /// One end, x and y in metres.
    #[schema(value_type = PlanePoint)]
    pub from_m: [f64; 2],
    /// The other end, x and y in metres.
    #[schema(value_type = PlanePoint)]
    pub to_m: [f64; 2],
    /// Height in metres, at most that of the ceiling.
    pub height_m: f64,
    /// Surface of both sides, which must not be `open`.
    pub surface: SurfaceDocument,
}

impl Tagged for CeilingDocument {
    const TAG: &'static str = "kind";
    const WHAT: &'static str = "a ceiling";
    const KINDS: &'static [(&'static str, Reader<Self>)] = &[
        ("flat", |fields, of| fields.read(of).map(Self::Flat)),
        ("sloped", |fields, of| fields.read(of).map(Self::Sloped)),
        ("gable", |fields, of| fields.read(of).map(Self::Gable)),
    ];
}

impl<'de> Deserialize<'de> for CeilingDocument {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

impl PlanDocument {
    /// Returns the outline and the holes in metres, as they are given.
    pub fn rings(&self) -> Vec<Vec<DVec2>> {
        let ring = |corners: &Vec<[f64; 2]>| corners.iter().copied().map(DVec2::from).collect();
        std::iter::once(&self.outline_m).chain(&self.holes_m).map(ring).collect()
    }

    /// Returns the distance in metres within which corners are taken for one.
    fn near_m(&self) -> f64 {
        let (low, high) = bounds(&mut edges(&self.rings()).map(|(_, edge)| edge).collect::<Vec<_>>().iter());
        (SAME_CORNER * (high - low).max_element()).max(TOUCHING_M)
    }

    /// Returns a sentence for each corner that is dropped because it repeats the one before it.
    pub fn repairs(&self) -> Vec<String> {
        let near = self.near_m();
        let repeats = |(number, [from, to]): (usize, Edge)| {
            (from.distance(to) <= near)
                .then(|| format!("edge {number} of the plan has no length: its ends were merged"))
        };
        edges(&self.rings()).filter_map(repeats).collect()
    }

    /// Builds the room below a ceiling, with open faces; `None` after a fault.
    pub(super) fn enclosure(&self, ceiling: &CeilingDocument, checks: &mut Checks) -> Option<Enclosure> {
        if !self.check_corners(checks) || !ceiling.check(checks) {
            return None;
        }
        let rings = self.rings();
        let (low, high) = bounds(edges(&rings[..1]).map(|(_, edge)| edge).collect::<Vec<_>>().iter());
        for (axis, extent) in (high - low).to_array().into_iter().enumerate() {
            if !ROOM_EDGE_M.contains(extent) {
                let along = ["x", "y"][axis];
                let detail = format!("the outline's extent along {along} must be {ROOM_EDGE_M} m, but is {extent} m");
                checks.refuse("/room/plan/outline_m", detail);
                return None;
            }
        }
        if !self.check_edges(checks) {
            return None;
        }
        let none = KindSurfaces { floor: None, walls: None, ceiling: None };
        match Enclosure::prism(&rings, self.near_m(), &ceiling.planes(&rings[0]), none) {
            Ok(enclosure) => Some(enclosure),
            Err(EnclosureError::LowCeiling { corner, height_m }) => {
                let detail = format!(
                    "the ceiling must be above the floor everywhere, but is at {height_m:.4} m over the corner \
                     ({}, {}) of the plan{}",
                    corner.x,
                    corner.y,
                    meeting(&ceiling.planes(&rings[0]), &rings[0])
                );
                checks.refuse("/room/ceiling", detail);
                None
            }
            Err(error) => {
                checks.refuse("/room/plan", error.to_string());
                None
            }
        }
    }

    /// Checks the numbers of corners and their coordinates.
    fn check_corners(&self, checks: &mut Checks) -> bool {
        if !checks.at_most("/room/plan/holes_m", self.holes_m.len(), &HOLES, " holes") {
            return false;
        }
        let holes = self.holes_m.iter().enumerate().map(|(hole, ring)| (format!("/room/plan/holes_m/{hole}"), ring));
        let corners: usize = self.rings().iter().map(Vec::len).sum();
        if corners > MOST_CORNERS {
            let detail = format!("at most {MOST_CORNERS} corners in all, but there are {corners}");
            checks.refuse_as(FieldErrorCode::TooMany, "/room/plan", detail);
            return false;
        }
        let mut good = true;
        for (pointer, ring) in std::iter::once(("/room/plan/outline_m".to_owned(), &self.outline_m)).chain(holes) {
            if !CORNERS.contains(&ring.len()) {
                let (least, most) = (CORNERS.start(), CORNERS.end());
                checks.refuse(&pointer, format!("must have {least}..{most} corners, but has {}", ring.len()));
                good = false;
            }
            for (corner, place) in ring.iter().enumerate() {
                good &= checks.numbers(&format!("{pointer}/{corner}"), place, COORDINATE_M);
            }
        }
        good
    }

    /// Checks that no two edges meet but neighbours at their common corner, and that holes lie within the outline.
    fn check_edges(&self, checks: &mut Checks) -> bool {
        let near = self.near_m();
        let Some((ring, fault)) = fault_of_rings(&self.rings(), near) else { return true };
        let place = |at: DVec2| format!("({:.6}, {:.6})", at.x, at.y);
        checks.refuse(ring_pointer(ring), fault.words("plan", near, place));
        false
    }
}

/// Returns the pointer to a ring of a plan, by its number from the outline, 0.
fn ring_pointer(number: usize) -> String {
    match number.checked_sub(1) {
        None => "/room/plan/outline_m".to_owned(),
        Some(hole) => format!("/room/plan/holes_m/{hole}"),
    }
}

impl CeilingDocument {
    fn check(&self, checks: &mut Checks) -> bool {
        match self {
            Self::Flat(flat) => checks.number("/room/ceiling/height_m", flat.height_m, CEILING_HEIGHT_M),
            Self::Sloped(sloped) => {
                checks.numbers("/room/ceiling/point_m", &sloped.point_m, COORDINATE_M)
                    & checks.number("/room/ceiling/rise_toward_deg", sloped.rise_toward_deg, TURN_DEG)
                    & checks.number("/room/ceiling/pitch_deg", sloped.pitch_deg, PITCH_DEG)
            }
            Self::Gable(gable) => {
                let good = checks.number("/room/ceiling/eaves_m", gable.eaves_m, CEILING_HEIGHT_M)
                    & checks.number("/room/ceiling/ridge_m", gable.ridge_m, CEILING_HEIGHT_M)
                    & checks.number("/room/ceiling/ridge_azimuth_deg", gable.ridge_azimuth_deg, TURN_DEG);
                if good && gable.ridge_m <= gable.eaves_m {
                    let detail = format!("must be above `eaves_m` ({} m), but is {} m", gable.eaves_m, gable.ridge_m);
                    checks.refuse("/room/ceiling/ridge_m", detail);
                }
                good && gable.ridge_m > gable.eaves_m
            }
        }
    }

    /// Returns the planes of the ceiling over an outline, the lowest of which counts.
    fn planes(&self, outline: &[DVec2]) -> Vec<CeilingPlane> {
        match self {
            Self::Flat(flat) => vec![CeilingPlane::flat(flat.height_m)],
            Self::Sloped(sloped) => {
                let point = DVec3::from(sloped.point_m);
                let rise = toward(sloped.rise_toward_deg) * libm::tan(sloped.pitch_deg.to_radians());
                vec![CeilingPlane { height_m: point.z - rise.dot(point.truncate()), rise }]
            }
            Self::Gable(gable) => {
                let across = toward(gable.ridge_azimuth_deg + 90.0);
                let places = || outline.iter().map(|corner| corner.dot(across));
                let (from, to) = (places().fold(f64::INFINITY, f64::min), places().fold(f64::NEG_INFINITY, f64::max));
                let slope = 2.0 * (gable.ridge_m - gable.eaves_m) / (to - from);
                let plane = |rise: f64, eaves: f64| CeilingPlane {
                    height_m: gable.eaves_m - rise * eaves,
                    rise: across * rise,
                };
                vec![plane(slope, from), plane(-slope, to)]
            }
        }
    }
}

/// Says where a sloped ceiling meets the floor on the outline.
fn meeting(planes: &[CeilingPlane], outline: &[DVec2]) -> String {
    let height = |corner: DVec2| {
        planes.iter().map(|plane| plane.height_m + plane.rise.dot(corner)).fold(f64::INFINITY, f64::min)
    };
    let ends = outline.iter().zip(outline.iter().cycle().skip(1));
    let points = ends.filter_map(|(from, to)| {
        let (start, end) = (height(*from), height(*to));
        let place = from.lerp(*to, start / (start - end));
        (start * end < 0.0).then(|| format!("({}, {})", tidy_m(place.x), tidy_m(place.y)))
    });
    match points.collect::<Vec<_>>().as_slice() {
        [] => String::new(),
        points => format!("; it meets the floor on the line through {}", points.join(" and ")),
    }
}

/// Returns the unit vector toward an azimuth in degrees; exact along the axes.
fn toward(azimuth_deg: f64) -> DVec2 {
    match azimuth_deg.rem_euclid(360.0) {
        0.0 => DVec2::Y,
        90.0 => DVec2::X,
        180.0 => DVec2::NEG_Y,
        270.0 => DVec2::NEG_X,
        _ => {
            let (sin, cos) = libm::sincos(azimuth_deg.to_radians());
            DVec2::new(sin, cos)
        }
    }
}

impl PartitionDocument {
    /// Returns the partition as two triangles; `None` for an open surface.
    pub(super) fn object(&self) -> Option<MeshObject> {
        let [from, to] = [self.from_m, self.to_m].map(DVec2::from);
        let mesh = TriangleMesh {
            positions: vec![from.extend(0.0), to.extend(0.0), to.extend(self.height_m), from.extend(self.height_m)],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
            triangle_materials: vec![0; 2],
            materials: vec![String::new()],
            ..TriangleMesh::default()
        };
        Some(MeshObject::new(mesh, vec![self.surface.surface()?]))
    }

    /// Adds the faults of a partition in a room, which is `None` if it was refused.
    pub(super) fn check(&self, pointer: &str, room: Option<&Enclosure>, checks: &mut Checks) {
        check_surface(&format!("{pointer}/surface"), &self.surface, Owner::Object, checks);
        let good = checks.numbers(&format!("{pointer}/from_m"), &self.from_m, COORDINATE_M)
            & checks.numbers(&format!("{pointer}/to_m"), &self.to_m, COORDINATE_M)
            & checks.number(&format!("{pointer}/height_m"), self.height_m, CEILING_HEIGHT_M);
        let Some(room) = room.filter(|_| good) else { return };
        let [from, to] = [self.from_m, self.to_m].map(DVec2::from);
        let hair = (SAME_CORNER * room.extent().max_element()).max(TOUCHING_M);
        if from.distance(to) <= hair {
            checks.refuse(format!("{pointer}/to_m"), "must differ from `from_m`");
            return;
        }
        let errors_before = checks.errors.len();
        let mut ceiling = f64::INFINITY;
        for (name, end) in [("from_m", from), ("to_m", to)] {
            match room.ceiling_height_m(end, hair) {
                Some(height) => ceiling = ceiling.min(height),
                None => checks.refuse(format!("{pointer}/{name}"), "must lie within the room"),
            }
        }
        if self.height_m > ceiling + TOUCHING_M {
            let detail = format!("must be at most {ceiling} m, the ceiling's height over its lower end");
            checks.refuse(format!("{pointer}/height_m"), detail);
        }
        let walls = room.section(hair);
        let cuts = walls.iter().filter_map(|wall| covered::crossing([from, to], *wall));
        let mut cuts: Vec<f64> = cuts.chain([0.0, 1.0]).collect();
        cuts.sort_by(f64::total_cmp);
        let is_inside = |pair: &[f64]| {
            let middle = from.lerp(to, 0.5 * (pair[0] + pair[1]));
            let is_short = (pair[1] - pair[0]) * from.distance(to) <= 2.0 * hair;
            is_short || covered::contains(&walls, middle) || covered::distance(&walls, middle) <= hair
        };
        if checks.errors.len() == errors_before && !cuts.windows(2).all(is_inside) {
            checks.refuse(pointer, "must not cross a wall");
        }
    }
}

//! Places of openings: each lies in a face or hangs below a ceiling, and none cuts a wall or another opening.

use glam::{DVec2, DVec3};

use super::check::check_course;
use super::{Opening, OpeningNormal, TubeDocument};
use crate::document::errors::{Checks, tidy_m};
use crate::document::hints;
use crate::document::limits::{DIAMETER_M, DROP_M, ON_FACE_M, TOUCHING_M};
use crate::document::room::RoomDocument;
use crate::document::room::plan::PartitionDocument;
use crate::geometry::OpeningFrame;
use crate::geometry::covered::{Edge, contains, distance};
use crate::scene::{Enclosure, EnclosureFace, Face, FaceKind, OpeningPlane, OpeningShape};

/// Least downward component of the normal of a face overhead, and of the upward one of a face that looks up.
const OVERHEAD: f64 = 1e-6;

/// An opening in its room.
#[derive(Clone, Copy, Debug)]
pub struct PlacedOpening {
    /// Number of the face that the tube comes through.
    pub face: usize,
    /// Length in metres by which the opening hangs below that face at its centre; 0 within rounding.
    pub drop_m: f64,
    /// Centre and plane of the opening.
    pub frame: OpeningFrame,
    /// Shape of the opening.
    pub shape: OpeningShape,
}

/// Reason why an opening has no place: the field of the tube, and a sentence.
type NoPlace = (&'static str, String);

impl PlacedOpening {
    /// Finds the face that a tube comes through, and the place of its opening; `None` where it has none.
    pub fn of(tube: &TubeDocument, enclosure: &Enclosure) -> Option<Self> {
        Self::find(tube, enclosure).ok()
    }

    fn find(tube: &TubeDocument, enclosure: &Enclosure) -> Result<Self, NoPlace> {
        match tube.normal() {
            OpeningNormal::Plumb => Self::find_level(tube, enclosure),
            OpeningNormal::Face => Self::find_in_face(tube, enclosure),
        }
    }

    fn find_level(tube: &TubeDocument, enclosure: &Enclosure) -> Result<Self, NoPlace> {
        let Opening { centre, shape, .. } = tube.opening();
        let (name, drop_m) = tube.hangs();
        let drop_m = if drop_m > TOUCHING_M { drop_m } else { 0.0 };
        let is_overhead = |face: &EnclosureFace| face.kind == FaceKind::Ceiling && looks_down(face);
        let face = match name {
            Some(name) => named(name, enclosure, is_overhead, "no ceiling has the name")?,
            None => ceiling_above(centre, enclosure)?,
        };
        let height_m = enclosure.height_at(face, centre) - drop_m;
        Ok(Self { face, drop_m, frame: OpeningFrame::level(centre.extend(height_m)), shape })
    }

    fn find_in_face(tube: &TubeDocument, enclosure: &Enclosure) -> Result<Self, NoPlace> {
        let Opening { centre, shape, .. } = tube.opening();
        let point = tube.centre_m().height_m.map(|height_m| centre.extend(height_m));
        let near = |face: &EnclosureFace, point: DVec3| face.polygon.distance(point) <= ON_FACE_M;
        let face = match (tube.hangs().0, point) {
            (Some(name), _) => named(name, enclosure, can_have_openings, "no ceiling or wall has the name")?,
            (None, None) => ceiling_above(centre, enclosure)?,
            (None, Some(point)) => {
                let found = enclosure.faces().iter().position(|face| can_have_openings(face) && near(face, point));
                found.ok_or_else(|| ("centre_m", "lies on no ceiling or wall of the room".to_owned()))?
            }
        };
        let of_face = &enclosure.faces()[face];
        let name = &of_face.name;
        let normal = of_face.polygon.normal();
        if normal.z > OVERHEAD {
            return Err(("face", format!("the face `{name}` looks up: no tube can come through it")));
        }
        let centre = match point {
            Some(point) if of_face.polygon.height(point).abs() <= ON_FACE_M => of_face.polygon.onto(point),
            Some(point) => {
                let off = of_face.polygon.height(point).abs();
                let nearest = of_face.polygon.onto(point);
                return Err((
                    "centre_m",
                    format!("is {off} m off the plane of `{name}`: the nearest point is {nearest}"),
                ));
            }
            None if looks_down(of_face) => centre.extend(enclosure.height_at(face, centre)),
            None => return Err(("centre_m", format!("must be [x, y, z] on the vertical face `{name}`"))),
        };
        Ok(Self { face, drop_m: 0.0, frame: OpeningFrame::facing_from(centre, -normal), shape })
    }

    /// Returns the plane of the opening for a scene.
    pub fn plane(&self) -> OpeningPlane {
        match self.frame.is_level() {
            true => OpeningPlane::Level { drop_m: self.drop_m },
            false => OpeningPlane::OfFace { height_m: self.frame.origin.z },
        }
    }

    /// Returns the height of the centre above the floor in m.
    pub fn height_m(&self) -> f64 {
        self.frame.origin.z
    }

    /// Returns the place of a point in the plane of the opening, in m from its centre along x and y of its levelled frame.
    pub fn away(&self, point: DVec3) -> DVec2 {
        self.frame.levelled_direction(point - self.frame.origin).truncate()
    }

    /// Returns the area in m2 of the opening that a simple polygon of its plane covers; of a level opening that below any polygon.
    pub fn area_below(&self, outline: &[DVec3]) -> f64 {
        let around: Vec<DVec2> = outline.iter().map(|corner| self.away(*corner)).collect();
        self.shape.area_in(&around)
    }

    /// True if the openings overlap: level ones in plan, others in their face.
    fn overlaps(&self, other: &Self) -> bool {
        let are_level = self.frame.is_level() && other.frame.is_level();
        if !are_level && self.face != other.face || self.frame.is_level() != other.frame.is_level() {
            return false;
        }
        let corners = |of: &Self| {
            let in_room = |corner: DVec2| of.frame.origin + of.frame.direction_in_room(corner.extend(0.0));
            of.shape.corners().map(|corners| corners.map(in_room))
        };
        let least = TOUCHING_M * self.shape.outer_radius();
        match (corners(self), corners(other)) {
            (Some(corners), _) => other.area_below(&corners) > least,
            (None, Some(corners)) => self.area_below(&corners) > least,
            (None, None) => {
                let reach = self.shape.outer_radius() + other.shape.outer_radius();
                self.away(other.frame.origin).length() < reach - TOUCHING_M
            }
        }
    }

    /// Returns how far an opening that overlaps another one must be moved straight away from it, at most, in m.
    fn missing_m(&self, other: &Self) -> f64 {
        let away = self.frame.origin - other.frame.origin;
        let away = if self.frame.is_level() { away.truncate().extend(0.0) } else { away };
        let toward = away.normalize_or(DVec3::X);
        [self, other].iter().map(|of| of.shape.extent_in(&of.frame, toward)).sum::<f64>() - away.length()
    }

    /// True if a partition cuts the opening, or stands against it.
    fn is_cut_by(&self, partition: &PartitionDocument) -> bool {
        let [from, to] = [partition.from_m, partition.to_m].map(DVec2::from);
        if self.frame.is_level() {
            let sheet = [from, to].map(|end| end - self.frame.origin.truncate());
            return partition.height_m > self.height_m() + TOUCHING_M && self.shape.meets(sheet, TOUCHING_M);
        }
        let height_m = partition.height_m;
        let corners = [from.extend(0.0), to.extend(0.0), to.extend(height_m), from.extend(height_m)];
        (0..corners.len()).any(|side| {
            let side = [corners[side], corners[(side + 1) % corners.len()]];
            let lies = side.iter().all(|end| self.frame.depth(*end) <= ON_FACE_M);
            lies && self.shape.meets(side.map(|end| self.away(end)), TOUCHING_M)
        })
    }
}

/// True if a face looks down, so that each place below it has one height.
fn looks_down(face: &EnclosureFace) -> bool {
    face.polygon.normal().z < -OVERHEAD
}

/// True if tubes can come through a face along its normal.
fn can_have_openings(face: &EnclosureFace) -> bool {
    face.kind != FaceKind::Floor
}

/// Finds the face of this name among those that count.
fn named(
    name: &str,
    enclosure: &Enclosure,
    counts: impl Fn(&EnclosureFace) -> bool,
    none: &str,
) -> Result<usize, NoPlace> {
    let found = enclosure.faces().iter().position(|face| face.name == name && counts(face));
    found.ok_or_else(|| {
        let others = enclosure.faces().iter().filter(|face| counts(face));
        let names: Vec<_> = others.map(|face| format!("`{}`", face.name)).collect();
        ("face", format!("{none} {name:?}; tubes come through {}", names.join(", ")))
    })
}

/// Finds the ceiling above a place in plan.
fn ceiling_above(centre: DVec2, enclosure: &Enclosure) -> Result<usize, NoPlace> {
    let face = match enclosure.as_box() {
        Some(_) => Some(Face::Ceiling as usize),
        None => enclosure.ceiling_above(centre),
    };
    let face = face.filter(|face| looks_down(&enclosure.faces()[*face]));
    face.ok_or_else(|| ("centre_m", "lies outside the plan of the room: no ceiling is above".to_owned()))
}

/// Adds the faults of the places of openings, and returns those of the tubes whose places are good, with the tubes' numbers.
pub(crate) fn check_openings(
    tubes: &[TubeDocument],
    room: &RoomDocument,
    enclosure: &Enclosure,
    checks: &mut Checks,
) -> Vec<(usize, PlacedOpening)> {
    let mut openings: Vec<(usize, PlacedOpening)> = Vec::new();
    for (index, tube) in tubes.iter().enumerate() {
        let pointer = format!("/tubes/{index}");
        let Opening { width_m, width, .. } = tube.opening();
        let (_, drop_m) = tube.hangs();
        let is_plumb = tube.normal() == OpeningNormal::Plumb;
        if !DIAMETER_M.contains(width_m)
            || !checks.number(&format!("{pointer}/drop_m"), drop_m, DROP_M)
            || (is_plumb && !check_extent(&pointer, tube, enclosure, checks))
        {
            continue;
        }
        let opening = match PlacedOpening::find(tube, enclosure) {
            Ok(opening) => opening,
            Err((field, detail)) => {
                checks.refuse(format!("{pointer}/{field}"), detail);
                continue;
            }
        };
        let is_placed = match is_plumb {
            true => check_level(&pointer, width, &opening, enclosure, checks),
            false => check_in_face(&pointer, width, &opening, enclosure, checks),
        };
        if !is_placed {
            continue;
        }
        if let TubeDocument::Parametric(tube) = tube
            && !is_plumb
        {
            check_course(&pointer, tube, opening.frame.outward(), checks);
        }
        let (place, surface) = room.surface_of(opening.face, &enclosure.faces()[opening.face]);
        if surface.open && place != "/room/surfaces/ceiling" {
            let detail = format!("must be false, because the opening of {pointer} needs a closed face");
            checks.refuse(format!("{place}/open"), detail);
        }
        if let Some((other, of)) = openings.iter().find(|(_, other)| opening.overlaps(other)) {
            let missing_m = tidy_m(opening.missing_m(of));
            let detail = format!(
                "the opening overlaps that of /tubes/{other}: they lie apart if it moves away by {missing_m} m"
            );
            checks.refuse(format!("{pointer}/centre_m"), detail);
        }
        for (number, partition) in room.partitions.iter().enumerate() {
            if opening.is_cut_by(partition) {
                let detail =
                    format!("must not cut the opening of {pointer}, which is {} m high", tidy_m(opening.height_m()));
                checks.refuse(format!("/room/partitions/{number}"), detail);
            }
        }
        openings.push((index, opening));
    }
    openings
}

/// Checks that an opening lies within the bounds of the room in plan; true if it does.
fn check_extent(pointer: &str, tube: &TubeDocument, enclosure: &Enclosure, checks: &mut Checks) -> bool {
    let Opening { centre, shape, width_m, width } = tube.opening();
    let radius = shape.extent_along(DVec2::X);
    // a turned square is wider than its side
    let wider = radius / (0.5 * width_m);
    let [low, high] = enclosure.bounds().map(|corner| corner.truncate());
    let widest = (high - low).min_element() / wider;
    if width_m > widest + TOUCHING_M {
        let pointer = format!("{pointer}/{width}");
        let hint = hints::of_number(&pointer, width_m, |meant| meant <= widest);
        let detail = format!("must be <= {widest}, to fit the ceiling's shorter edge, but is {width_m}{hint}");
        checks.refuse(pointer, detail);
        return false;
    }
    let mut inside = true;
    for axis in 0..2 {
        let (at, low, high) = (centre[axis], low[axis], high[axis]);
        if !(at - radius >= low - TOUCHING_M && at + radius <= high + TOUCHING_M) {
            let pointer = format!("{pointer}/centre_m/{axis}");
            let hint = hints::of_number(&pointer, at, |meant| meant - radius >= low && meant + radius <= high);
            let detail = format!(
                "the opening must lie wholly inside the ceiling ({low}..{high} m), but reaches from {} m to {} m{hint}",
                tidy_m(at - radius),
                tidy_m(at + radius)
            );
            checks.refuse(pointer, detail);
            inside = false;
        }
    }
    inside
}

/// Checks that a level opening lies wholly in its face, or hangs wholly in the room; true if it does.
fn check_level(
    pointer: &str,
    width: &str,
    opening: &PlacedOpening,
    enclosure: &Enclosure,
    checks: &mut Checks,
) -> bool {
    let PlacedOpening { face, drop_m, shape, .. } = *opening;
    let (centre, height_m) = (opening.frame.origin.truncate(), opening.height_m());
    let polygon = &enclosure.faces()[face].polygon;
    if polygon.distance(centre.extend(enclosure.height_at(face, centre))) > TOUCHING_M {
        checks.refuse(format!("{pointer}/centre_m"), "lies outside of the face that the tube comes through");
        return false;
    }
    let normal = polygon.normal();
    let uphill = normal.truncate();
    let rise = uphill.length() / -normal.z;
    let needed = shape.extent_along(uphill.normalize_or(DVec2::X)) * rise;
    if drop_m < needed - TOUCHING_M {
        // rounded up: a drop that the message names is accepted
        let needed = (needed * 1e6).ceil() / 1e6;
        let detail = format!(
            "must be at least {needed} m, so that the level opening hangs below the sloped ceiling as a whole, but is \
             {drop_m}"
        );
        checks.refuse(format!("{pointer}/drop_m"), detail);
        return false;
    }
    if height_m <= 0.0 {
        let detail =
            format!("must be < {} m, the height of the ceiling there, but is {drop_m}", tidy_m(height_m + drop_m));
        checks.refuse(format!("{pointer}/drop_m"), detail);
        return false;
    }
    let sides: Vec<Edge> = match drop_m > 0.0 {
        // a hair lower, so that an opening that touches the ceiling lies inside
        true => enclosure.section(height_m - TOUCHING_M),
        false => polygon.sides().map(|side| side.map(|end| end.truncate())).collect(),
    };
    // the section of a slope moves outward as it is lowered
    let slack = TOUCHING_M * (2.0 + 1.0 / rise.max(1e-3));
    let sides: Vec<Edge> = sides.iter().map(|side| side.map(|end| end - centre)).collect();
    check_inside((pointer, width), (&shape, &sides), slack, checks)
}

/// Checks that an opening in the plane of its face lies wholly in this face; true if it does.
fn check_in_face(
    pointer: &str,
    width: &str,
    opening: &PlacedOpening,
    enclosure: &Enclosure,
    checks: &mut Checks,
) -> bool {
    let sides = enclosure.faces()[opening.face].polygon.sides();
    let sides: Vec<Edge> = sides.map(|side| side.map(|end| opening.away(end))).collect();
    check_inside((pointer, width), (&opening.shape, &sides), 2.0 * TOUCHING_M, checks)
}

/// Checks that an opening lies within the sides of a figure, up to `slack` m; true if it does.
fn check_inside(
    (pointer, width): (&str, &str),
    (shape, sides): (&OpeningShape, &[Edge]),
    slack: f64,
    checks: &mut Checks,
) -> bool {
    let beyond = beyond(shape, sides);
    if beyond <= slack {
        return true;
    }
    let detail = format!(
        "the opening must lie wholly inside the room, but its rim is {} m beyond a wall or the ceiling",
        tidy_m(beyond)
    );
    checks.refuse(format!("{pointer}/{width}"), detail);
    false
}

/// Number of halvings by which the part of a square beyond a wall is found.
const HALVINGS: u32 = 52;

/// Returns the distance in metres by which the rim of an opening would have to move inward to lie within the sides of a figure; not
/// positive if it does. Sides are relative to the opening's centre.
fn beyond(shape: &OpeningShape, sides: &[Edge]) -> f64 {
    let (is_inside, to_sides) = (contains(sides, DVec2::ZERO), distance(sides, DVec2::ZERO));
    if !is_inside {
        return shape.outer_radius() + to_sides;
    }
    if let Some(radius) = shape.disc() {
        return radius - to_sides;
    }
    let meets = |inward: f64| sides.iter().any(|side| shape.meets(*side, inward));
    let (mut low, mut high) = (0.0, if meets(0.0) { shape.inner_radius() } else { 0.0 });
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        if meets(middle) { low = middle } else { high = middle }
    }
    high
}

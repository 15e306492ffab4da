//! Places of openings: each lies in a ceiling or hangs below one, and none cuts a wall or another opening.

use glam::DVec2;

use super::{Opening, TubeDocument};
use crate::document::errors::{Checks, tidy_m};
use crate::document::hints;
use crate::document::limits::{DIAMETER_M, DROP_M, TOUCHING_M};
use crate::document::room::RoomDocument;
use crate::geometry::covered::{Edge, contains, distance};
use crate::scene::{Enclosure, Face, FaceKind, OpeningShape};

/// Least downward component of the normal of a face that a tube can come through.
const OVERHEAD: f64 = 1e-6;

/// An opening in its room.
#[derive(Clone, Copy, Debug)]
pub struct PlacedOpening {
    /// Number of the face that the tube comes through.
    pub face: usize,
    /// Length in metres by which the opening hangs below that face at its centre; 0 within rounding.
    pub drop_m: f64,
    /// Centre in plan, in metres.
    pub centre: DVec2,
    /// Shape of the opening.
    pub shape: OpeningShape,
    /// Height above the floor in metres.
    pub height_m: f64,
}

impl PlacedOpening {
    /// Finds the face that a tube comes through, and the height of its opening; `None` where there is no such face.
    pub fn of(tube: &TubeDocument, enclosure: &Enclosure) -> Option<Self> {
        let Opening { centre, shape, .. } = tube.opening();
        let (name, drop_m) = tube.hangs();
        let drop_m = if drop_m > TOUCHING_M { drop_m } else { 0.0 };
        let face = match name {
            Some(name) => enclosure.faces().iter().position(|face| face.name == name),
            None if enclosure.as_box().is_some() => Some(Face::Ceiling as usize),
            None => enclosure.ceiling_above(centre),
        };
        let is_overhead = |face: &usize| {
            let face = &enclosure.faces()[*face];
            face.kind == FaceKind::Ceiling && face.polygon.normal().z < -OVERHEAD
        };
        let face = face.filter(is_overhead)?;
        let height_m = enclosure.height_at(face, centre) - drop_m;
        Some(Self { face, drop_m, centre, shape, height_m })
    }

    /// Returns the area in m2 of the opening that a simple polygon covers in plan.
    pub fn area_below(&self, outline: &[DVec2]) -> f64 {
        let around: Vec<DVec2> = outline.iter().map(|corner| *corner - self.centre).collect();
        self.shape.area_in(&around)
    }

    /// True if the openings overlap in plan.
    fn overlaps(&self, other: &Self) -> bool {
        let corners = |of: &Self| of.shape.corners().map(|corners| corners.map(|corner| of.centre + corner));
        let least = TOUCHING_M * self.shape.outer_radius();
        match (corners(self), corners(other)) {
            (Some(corners), _) => other.area_below(&corners) > least,
            (None, Some(corners)) => self.area_below(&corners) > least,
            (None, None) => {
                let reach = self.shape.outer_radius() + other.shape.outer_radius();
                other.centre.distance(self.centre) < reach - TOUCHING_M
            }
        }
    }
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
        if !DIAMETER_M.contains(width_m)
            || !checks.number(&format!("{pointer}/drop_m"), drop_m, DROP_M)
            || !check_extent(&pointer, tube, enclosure, checks)
        {
            continue;
        }
        let Some(opening) = face_of(&pointer, tube, enclosure, checks) else { continue };
        if !check_place(&pointer, width, &opening, enclosure, checks) {
            continue;
        }
        let (place, surface) = room.surface_of(opening.face, &enclosure.faces()[opening.face]);
        if surface.open && place != "/room/surfaces/ceiling" {
            let detail = format!("must be false, because the opening of {pointer} needs a closed ceiling");
            checks.refuse(format!("{place}/open"), detail);
        }
        if let Some((other, _)) = openings.iter().find(|(_, other)| opening.overlaps(other)) {
            checks.refuse(format!("{pointer}/centre_m"), format!("the opening overlaps that of /tubes/{other}"));
        }
        for (number, partition) in room.partitions.iter().enumerate() {
            let sheet = [partition.from_m, partition.to_m].map(|end| DVec2::from(end) - opening.centre);
            let reaches = partition.height_m > opening.height_m + TOUCHING_M;
            if reaches && opening.shape.meets(sheet, TOUCHING_M) {
                let detail =
                    format!("must not cut the opening of {pointer}, which is {} m high", tidy_m(opening.height_m));
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

/// Finds the opening of a tube; adds a fault where there is no face for it.
fn face_of(pointer: &str, tube: &TubeDocument, enclosure: &Enclosure, checks: &mut Checks) -> Option<PlacedOpening> {
    let found = PlacedOpening::of(tube, enclosure);
    if found.is_none() {
        let overhead = enclosure.faces().iter().filter(|face| face.kind == FaceKind::Ceiling);
        let names: Vec<_> = overhead.map(|face| format!("`{}`", face.name)).collect();
        match tube.hangs().0 {
            Some(name) => {
                let detail = format!("no ceiling has the name {name:?}; tubes come through {}", names.join(", "));
                checks.refuse(format!("{pointer}/face"), detail);
            }
            None => {
                checks.refuse(format!("{pointer}/centre_m"), "lies outside the plan of the room: no ceiling is above")
            }
        }
    }
    found
}

/// Checks that an opening lies wholly in its face, or hangs wholly in the room; true if it does.
fn check_place(
    pointer: &str,
    width: &str,
    opening: &PlacedOpening,
    enclosure: &Enclosure,
    checks: &mut Checks,
) -> bool {
    let PlacedOpening { face, drop_m, centre, shape, height_m } = *opening;
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
    let beyond = beyond(&shape, &sides.iter().map(|side| side.map(|end| end - centre)).collect::<Vec<_>>());
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

//! Luminaires: rectangles that lie in the room, cover no opening and emit into free space.

use glam::DVec3;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::object::BoxDocument;
use crate::document::errors::{Checks, tidy_m};
use crate::document::hints;
use crate::document::limits::{COORDINATE_M, LIGHT, TOUCHING_M};
use crate::document::optics::Coefficient;
use crate::document::schema::shapes::{Luminance, Vector};
use crate::geometry::planar::Polygon;
use crate::scene::Enclosure;
use crate::traceable::enclosure::TraceableEnclosure;

/// A Lambertian area light: a thin black rectangle in the room that emits on one side and blocks light from both.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct LuminaireDocument {
    /// Shape of the luminaire.
    pub kind: LuminaireKind,
    /// Corner from which both edges start, in metres.
    #[schema(value_type = Vector)]
    pub corner_m: [f64; 3],
    /// First edge in metres.
    #[schema(value_type = Vector)]
    pub edge_u_m: [f64; 3],
    /// Second edge in metres, at a right angle to `edge_u_m`; light leaves on the side of u x v.
    #[schema(value_type = Vector)]
    pub edge_v_m: [f64; 3],
    /// Luminance in cd/m2, 0..1000000000, uniform over the rectangle and the same in all directions.
    #[schema(value_type = Luminance)]
    pub luminance_cd_m2: Coefficient,
}

/// Shape of a luminaire.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum LuminaireKind {
    /// A rectangle, given by a corner and two edges.
    Rectangle,
}

/// Largest cosine of the angle between the edges, because decimal fractions rarely make an exact right angle.
const RIGHT_ANGLE: f64 = 1e-3;

/// Length in metres of the shortest edge allowed: a thousand times the tolerance for touching.
const SHORTEST_EDGE_M: f64 = 1e-6;

/// A half space: its points p have normal . p <= offset.
type HalfSpace = (DVec3, f64);

/// Corner, edges and unit normal of a luminaire.
#[derive(Clone, Debug)]
pub struct Sheet {
    corner: DVec3,
    u: DVec3,
    v: DVec3,
    normal: DVec3,
}

/// Checks the numbers and the shape of a luminaire and returns it as vectors; `None` after an error.
pub(crate) fn check_luminaire(pointer: &str, luminaire: &LuminaireDocument, checks: &mut Checks) -> Option<Sheet> {
    let LuminaireDocument { corner_m, edge_u_m, edge_v_m, luminance_cd_m2, .. } = *luminaire;
    let mut ok = true;
    for (channel, value) in luminance_cd_m2.channels() {
        ok &= checks.number(&format!("{pointer}/luminance_cd_m2{channel}"), value, LIGHT);
    }
    for (name, vector) in [("corner_m", corner_m), ("edge_u_m", edge_u_m), ("edge_v_m", edge_v_m)] {
        ok &= checks.numbers(&format!("{pointer}/{name}"), &vector, COORDINATE_M);
    }
    if !ok {
        return None;
    }
    let (corner, u, v) = (DVec3::from(corner_m), DVec3::from(edge_u_m), DVec3::from(edge_v_m));
    for (name, edge) in [("edge_u_m", u), ("edge_v_m", v)] {
        if edge.length() < SHORTEST_EDGE_M {
            let detail = format!("must be at least {SHORTEST_EDGE_M} m long, but is {} m", edge.length());
            checks.refuse(format!("{pointer}/{name}"), detail);
            ok = false;
        }
    }
    if ok && u.normalize().dot(v.normalize()).abs() > RIGHT_ANGLE {
        checks.refuse(format!("{pointer}/edge_v_m"), "must be at a right angle to `edge_u_m`");
        ok = false;
    }
    ok.then(|| Sheet { corner, u, v, normal: u.cross(v).normalize() })
}

/// Checks that a luminaire lies inside the room and emits into it; true if it does.
pub(crate) fn check_place(
    pointer: &str,
    sheet: &Sheet,
    (enclosure, traceable): (&Enclosure, &TraceableEnclosure),
    checks: &mut Checks,
) -> bool {
    let [lowest, highest] = enclosure.bounds();
    let errors_before = checks.errors.len();
    let thousandths =
        Sheet { corner: sheet.corner / 1000.0, u: sheet.u / 1000.0, v: sheet.v / 1000.0, ..sheet.clone() };
    let thousandths_fit =
        thousandths.corners().iter().all(|corner| corner.cmpge(lowest).all() && corner.cmple(highest).all());
    for (axis, (least, most)) in lowest.to_array().into_iter().zip(highest.to_array()).enumerate() {
        let reach = |f: fn(f64, f64) -> f64, start| sheet.corners().iter().map(|p| p[axis]).fold(start, f);
        let (from, to) = (reach(f64::min, f64::INFINITY), reach(f64::max, f64::NEG_INFINITY));
        if from < least - TOUCHING_M || to > most + TOUCHING_M {
            let corner = sheet.corner[axis];
            let pointer = format!("{pointer}/corner_m/{axis}");
            let fits = |meant: f64| meant - corner + from >= least && meant - corner + to <= most;
            let hint = match hints::of_number(&pointer, corner, fits) {
                hint if hint.is_empty() => {
                    hints::of_lengths([sheet.u.length(), sheet.v.length()], thousandths_fit).to_owned()
                }
                hint => hint,
            };
            let detail = format!(
                "the luminaire must be inside the room ({least}..{most} m), but reaches from {} m to {} m{hint}",
                tidy_m(from),
                tidy_m(to)
            );
            checks.refuse(pointer, detail);
        }
    }
    let [a, b, c, d] = sheet.corners();
    let is_inside = [a, b, c, d].iter().all(|corner| traceable.contains(*corner))
        && [[a, b], [b, c], [c, d], [d, a], [a, c], [b, d]].into_iter().all(|[from, to]| traceable.is_clear(from, to));
    if checks.errors.len() == errors_before && !is_inside {
        checks.refuse(format!("{pointer}/corner_m"), "the luminaire must be inside the room, but a part is outside");
    }
    let lies_on = |polygon: &Polygon| sheet.corners().iter().all(|corner| polygon.distance(*corner) <= TOUCHING_M);
    let leaves = |polygon: &Polygon| polygon.normal().dot(sheet.normal) < 0.0 && lies_on(polygon);
    if traceable.polygons.iter().any(leaves) {
        let detail = "the luminaire lies on the room's boundary and emits out of the room, along edge_u_m x edge_v_m: \
                      swap the two edges";
        checks.refuse(format!("{pointer}/edge_v_m"), detail);
    }
    checks.errors.len() == errors_before
}

/// True if the luminaire's rectangle, shifted by a few nanometres along its normal, has a part inside a box.
pub fn reaches_into(sheet: &Sheet, object: &BoxDocument) -> bool {
    let BoxDocument { size_m, position_m, rotation_deg, .. } = object;
    let (sin, cos) = libm::sincos(rotation_deg.to_radians());
    let base = DVec3::from(*position_m);
    let axes = [DVec3::new(cos, -sin, 0.0), DVec3::new(sin, cos, 0.0), DVec3::Z];
    let centre = base + DVec3::Z * (0.5 * size_m[2]);
    let inside = axes.iter().zip(size_m).flat_map(|(axis, size)| {
        let half = 0.5 * size - TOUCHING_M;
        [(*axis, axis.dot(centre) + half), (-*axis, half - axis.dot(centre))]
    });
    let polygon = sheet.corners().map(|corner| corner + sheet.normal * (3.0 * TOUCHING_M));
    has_area(clip(polygon.to_vec(), inside))
}

/// True if two luminaires that emit to the same side overlap in one plane.
pub fn overlap(sheet: &Sheet, other: &Sheet) -> bool {
    let apart = |corner: DVec3| (corner - other.corner).dot(other.normal).abs() > TOUCHING_M;
    if sheet.normal.dot(other.normal) < 0.0 || sheet.corners().into_iter().any(apart) {
        return false;
    }
    let side = |along: DVec3| {
        let across = along.cross(other.normal).normalize();
        let limits = other.corners().map(|corner| corner.dot(across));
        let (low, high) = limits.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x), h.max(x)));
        [(across, high - TOUCHING_M), (-across, -low - TOUCHING_M)]
    };
    has_area(clip(sheet.corners().to_vec(), [other.u, other.v].into_iter().flat_map(side)))
}

impl Sheet {
    /// Returns the corners in the order of the outline.
    pub fn corners(&self) -> [DVec3; 4] {
        [self.corner, self.corner + self.u, self.corner + self.u + self.v, self.corner + self.v]
    }
}

/// Returns the part of a convex polygon inside all half spaces (Sutherland and Hodgman 1974).
fn clip(mut polygon: Vec<DVec3>, half_spaces: impl IntoIterator<Item = HalfSpace>) -> Vec<DVec3> {
    for (normal, offset) in half_spaces {
        let height = |p: DVec3| normal.dot(p) - offset;
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (k, p) in polygon.iter().enumerate() {
            let next = polygon[(k + 1) % polygon.len()];
            let (here, there) = (height(*p), height(next));
            if here <= 0.0 {
                kept.push(*p);
            }
            if (here <= 0.0) != (there <= 0.0) {
                kept.push(p.lerp(next, here / (here - there)));
            }
        }
        polygon = kept;
    }
    polygon
}

fn has_area(polygon: Vec<DVec3>) -> bool {
    let Some(first) = polygon.first() else { return false };
    let twice: DVec3 = polygon.windows(2).map(|pair| (pair[0] - *first).cross(pair[1] - *first)).sum();
    twice.length() > 0.0
}

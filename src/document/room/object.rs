//! Objects in the room: boxes and meshes.

use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::mesh_document::MeshObjectDocument;
use super::surface::{Owner, SurfaceDocument, check_surface};
use crate::document::errors::{Checks, tidy_m};
use crate::document::hints;
use crate::document::limits::{COORDINATE_M, SIZE_M, TOUCHING_M, TURN_DEG};
use crate::document::read::tagged::{self, Reader, Tagged};
use crate::document::schema::shapes::{BoxSize, Vector};
use crate::geometry::covered::{covered, enclosed_area, polygon};
use crate::geometry::turn::rotation;
use crate::scene::Enclosure;

/// Fraction of a box's section that may lie outside the room, for rounding.
const SMALLEST_PART: f64 = 1e-6;

/// An object in the room.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ObjectDocument {
    /// A box with vertical sides.
    Box(BoxDocument),
    /// A triangle mesh.
    Mesh(MeshObjectDocument),
}

impl Tagged for ObjectDocument {
    const TAG: &'static str = "kind";
    const WHAT: &'static str = "an object";
    const KINDS: &'static [(&'static str, Reader<Self>)] =
        &[("box", |fields, of| fields.read(of).map(Self::Box)), ("mesh", |fields, of| fields.read(of).map(Self::Mesh))];
}

impl<'de> Deserialize<'de> for ObjectDocument {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        tagged::deserialize(deserializer)
    }
}

/// Fields of a box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct BoxDocument {
    /// Extent in metres along the box's own x, y and z axes, each > 0.
    #[schema(value_type = BoxSize)]
    pub size_m: [f64; 3],
    /// Centre of the box's base in metres.
    #[schema(value_type = Vector)]
    pub position_m: [f64; 3],
    /// Rotation in degrees, clockwise seen from above.
    #[serde(default)]
    #[schema(default = 0.0)]
    pub rotation_deg: f64,
    /// Surface of all six faces, which must not be `open`.
    pub surface: SurfaceDocument,
}

impl ObjectDocument {
    /// Adds the faults of an object; `room` is `None` if the room's faces were refused.
    pub(crate) fn check(&self, pointer: &str, room: Option<&Enclosure>, checks: &mut Checks) {
        match self {
            Self::Box(object) => object.check(pointer, room, checks),
            Self::Mesh(object) => object.check(pointer, checks),
        }
    }

    /// Returns the surfaces of the object: one for a box, one or two for each material of a mesh.
    pub fn surfaces(&self) -> Vec<&SurfaceDocument> {
        match self {
            Self::Box(object) => vec![&object.surface],
            Self::Mesh(object) => object.surfaces.values().chain(object.back_surfaces.values()).collect(),
        }
    }
}

/// Returns the corners of the base of a box of `size` about `middle`, turned clockwise seen from above.
pub fn footprint(size: DVec2, middle: DVec2, rotation_deg: f64) -> [DVec2; 4] {
    let (half, back) = (0.5 * size, rotation(rotation_deg.to_radians()).transpose());
    [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(x, y)| middle + back * (half * DVec2::new(x, y)))
}

impl BoxDocument {
    fn check(&self, pointer: &str, room: Option<&Enclosure>, checks: &mut Checks) {
        check_surface(&format!("{pointer}/surface"), &self.surface, Owner::Object, checks);
        let turn_ok = checks.number(&format!("{pointer}/rotation_deg"), self.rotation_deg, TURN_DEG);
        let size_ok = checks.numbers(&format!("{pointer}/size_m"), &self.size_m, SIZE_M);
        let position_ok = checks.numbers(&format!("{pointer}/position_m"), &self.position_m, COORDINATE_M);
        if let Some(room) = room.filter(|_| turn_ok && size_ok && position_ok)
            && self.check_bounds(pointer, room.bounds(), checks)
            && room.as_box().is_none()
        {
            self.check_walls(pointer, room, checks);
        }
    }

    /// Adds a fault for each axis along which the box reaches out of the bounds of the room; true if there is none.
    fn check_bounds(&self, pointer: &str, [low, high]: [DVec3; 2], checks: &mut Checks) -> bool {
        let mut good = true;
        let room = || low.to_array().into_iter().zip(high.to_array());
        let (base, size) = (DVec3::from(self.position_m), DVec3::from(self.size_m));
        let thousandths_fit =
            [(base, size / 1000.0), (base / 1000.0, size / 1000.0)].into_iter().any(|(base, size)| {
                let spans = self.spans(base, size).into_iter().zip(room());
                spans.into_iter().all(|((from, to), (low, high))| from >= low && to <= high)
            });
        for (axis, ((from, to), (low, high))) in self.spans(base, size).into_iter().zip(room()).enumerate() {
            if from < low - TOUCHING_M || to > high + TOUCHING_M {
                good = false;
                let pointer = format!("{pointer}/position_m/{axis}");
                let position = self.position_m[axis];
                // shifted to the position that may have been meant
                let fits = |meant: f64| meant - position + to <= high && meant - position + from >= low;
                let hint = match hints::of_number(&pointer, position, fits) {
                    hint if hint.is_empty() => hints::of_lengths(self.size_m, thousandths_fit).to_owned(),
                    hint => hint,
                };
                let detail = format!(
                    "the box must be inside the room ({low}..{high} m), but reaches from {} m to {} m{hint}",
                    tidy_m(from),
                    tidy_m(to)
                );
                checks.refuse(pointer, detail);
            }
        }
        good
    }

    /// Adds a fault if the box reaches through a wall or the ceiling of a room that is no box.
    fn check_walls(&self, pointer: &str, room: &Enclosure, checks: &mut Checks) {
        let outline = polygon(&self.footprint());
        let area = enclosed_area(&outline).abs();
        let hair = TOUCHING_M * room.scale_m().max(1.0);
        let (bottom, top) = (self.position_m[2], self.position_m[2] + self.size_m[2]);
        for height in [bottom + hair, top - hair] {
            let inside = enclosed_area(&covered(&outline, &[room.section(height)], hair)).abs();
            if inside < area * (1.0 - SMALLEST_PART) {
                let detail = format!(
                    "the box must be inside the room, but {:.3} m2 of its section at {height:.3} m lie outside",
                    area - inside
                );
                checks.refuse(format!("{pointer}/position_m"), detail);
                return;
            }
        }
    }

    /// Returns the corners of the box's base, seen from above.
    pub fn footprint(&self) -> [DVec2; 4] {
        let [size, position] = [self.size_m, self.position_m].map(|of| DVec3::from(of).truncate());
        footprint(size, position, self.rotation_deg)
    }

    /// Returns the extents along the room's axes of a box of this `size`, turned like this one, with the centre of its base at
    /// `base`.
    fn spans(&self, base: DVec3, size: DVec3) -> [(f64, f64); 3] {
        let (sin, cos) = libm::sincos(self.rotation_deg.to_radians());
        // half-widths of the rotated footprint
        let reach_x = 0.5 * (size.x * cos.abs() + size.y * sin.abs());
        let reach_y = 0.5 * (size.x * sin.abs() + size.y * cos.abs());
        [(base.x - reach_x, base.x + reach_x), (base.y - reach_y, base.y + reach_y), (base.z, base.z + size.z)]
    }
}

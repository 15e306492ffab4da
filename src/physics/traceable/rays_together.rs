//! Several rays through the room at once: where each ends, and whether boxes stand between pairs of points.

use glam::DVec3;

use super::block::ON_TARGET;
use super::boxes_together::{Each, NO_BOX, RaysBySide, TOGETHER};
use super::rays::RoomHit;
use super::scene::TraceableScene;
use super::surface_id::SurfaceId;

/// A ray from inside the room.
#[derive(Clone, Copy, Debug)]
pub struct RoomRay {
    /// In m.
    pub origin: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// The surface that it leaves, if any.
    pub from: Option<SurfaceId>,
}

/// Straight ways between pairs of points.
#[derive(Clone, Copy, Debug)]
pub struct Segments {
    /// Coordinates of the first points in m.
    pub start: [Each; 3],
    /// Ways from there to the others in m.
    pub way: [Each; 3],
    /// Number of the box on which each begins, which is not in its way; or [`NO_BOX`].
    own: Each,
}

impl Default for Segments {
    fn default() -> Self {
        Self { start: [[0.0; TOGETHER]; 3], way: [[0.0; TOGETHER]; 3], own: [NO_BOX; TOGETHER] }
    }
}

impl Segments {
    /// Sets one of them: where it begins, the way from there, and the box on which it begins, if it does on one.
    #[inline]
    pub fn set(&mut self, lane: usize, start: DVec3, way: DVec3, own: Option<usize>) {
        self.own[lane] = own.map_or(NO_BOX, |number| number as f64);
        for axis in 0..3 {
            self.start[axis][lane] = start[axis];
            self.way[axis][lane] = way[axis];
        }
    }
}

impl TraceableScene {
    /// The first thing that each ray meets, as [`Self::intersect`] finds it.
    pub fn intersect_together(&self, rays: &[RoomRay; TOGETHER]) -> [RoomHit; TOGETHER] {
        let faces = rays.map(|ray| self.way_to_face(ray.origin, ray.direction));
        let own = |from: Option<SurfaceId>| from.and_then(|surface| self.numbering.box_of(surface));
        let met = self.boxes_together.first_met(&RaysBySide {
            origin: [0, 1, 2].map(|axis| rays.map(|ray| ray.origin[axis])),
            direction: [0, 1, 2].map(|axis| rays.map(|ray| ray.direction[axis])),
            own: rays.map(|ray| own(ray.from).map_or(NO_BOX, |number| number as f64)),
            within: faces.map(|(distance, _)| distance),
        });
        std::array::from_fn(|lane| {
            let RoomRay { origin, direction, from } = rays[lane];
            if met[lane] == NO_BOX {
                return self.beyond_boxes(origin, direction, faces[lane], None, from);
            }
            let number = met[lane] as usize;
            match self.boxes[number].intersect(origin, direction) {
                Some(entry) => {
                    let hit = self.on_box(number, entry, origin, direction);
                    self.beyond_boxes(origin, direction, faces[lane], Some(hit), from)
                }
                // it passes an edge within rounding
                None => self.intersect(origin, direction, from),
            }
        })
    }

    /// For each way, 1 if no box stands between its ends, else 0; those on which it begins or ends do not count.
    pub fn clear_of_boxes(&self, segments: &Segments) -> Each {
        let Segments { start, way, own } = *segments;
        let within = [1.0 - ON_TARGET; TOGETHER];
        let met = self.boxes_together.first_met(&RaysBySide { origin: start, direction: way, own, within });
        met.map(|number| if number == NO_BOX { 1.0 } else { 0.0 })
    }
}

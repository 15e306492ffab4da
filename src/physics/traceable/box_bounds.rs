//! Axis-aligned bounds of boxes, tested [`WIDTH`] at a time: a filter that finds which of many boxes a ray may meet.

use glam::DVec3;
use smallvec::SmallVec;

use crate::geometry::lanes::{Lanes, Query, answer};
use crate::geometry::tree_ray::{Bounds, BoxRay, NO_BOXES, WIDTH};

/// Fraction of the room's scale by which bounds grow: more than the rounding of coordinates and distances to f32 (each below 2^-23 of
/// it).
const PADDING: f64 = 1e-6;

/// Number of boxes that most rays meet at most.
const FEW: usize = 8;

/// Axis-aligned bounds of boxes in f32, in groups of [`WIDTH`], in the order of the boxes' numbers.
#[derive(Clone, Debug, Default)]
pub struct BoxBounds {
    groups: Vec<Bounds>,
}

impl BoxBounds {
    /// Takes `spans`, the lowest and highest corner of each box in m, in a room of `scale` in m ([`crate::scene::Enclosure::scale_m`]).
    pub fn new(spans: &[[DVec3; 2]], scale: f64) -> Self {
        let padding = PADDING * scale;
        let group = |spans: &[[DVec3; 2]]| {
            let mut bounds = NO_BOXES;
            for (lane, [low, high]) in spans.iter().enumerate() {
                for axis in 0..3 {
                    bounds[axis][lane] = (low[axis] - padding) as f32;
                    bounds[axis + 3][lane] = (high[axis] + padding) as f32;
                }
            }
            bounds
        };
        Self { groups: spans.chunks(WIDTH).map(group).collect() }
    }

    /// Finds the numbers, in ascending order, of all boxes that `origin + t direction` meets at a t in 0..=`reach`, and of some that it
    /// narrowly misses. `origin` is in the room.
    #[inline]
    pub fn met(&self, origin: DVec3, direction: DVec3, reach: f64) -> SmallVec<[usize; FEW]> {
        // a little longer, so that rounding culls no box at the end
        let reach = reach as f32 * (1.0 + 4.0 * f32::EPSILON);
        answer(Met { bounds: self, ray: BoxRay::new(origin.as_vec3a(), direction.as_vec3a()), reach })
    }
}

/// Query for the boxes that a ray meets.
struct Met<'a> {
    bounds: &'a BoxBounds,
    ray: BoxRay,
    reach: f32,
}

impl Query for Met<'_> {
    type Answer = SmallVec<[usize; FEW]>;

    #[inline(always)]
    fn answer<L: Lanes>(self, lanes: L) -> Self::Answer {
        let mut numbers = SmallVec::new();
        let ray = lanes.for_boxes(&self.ray);
        for (group, bounds) in self.bounds.groups.iter().enumerate() {
            let (_, mut met) = lanes.enter(bounds, &ray, self.reach);
            while met != 0 {
                numbers.push(group * WIDTH + met.trailing_zeros() as usize);
                met &= met - 1;
            }
        }
        numbers
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom};
    use crate::scene::BoxObject;
    use crate::traceable::TraceableBox;

    /// Every box that a ray meets passes the filter, from anywhere in the room in any direction, also along axes and in the
    /// planes of faces; and most that it does not meet are kept back.
    #[test]
    fn no_box_is_missed() {
        let size = DVec3::new(4.0, 3.0, 2.5);
        let mut random = PathRandom::new(Key::new(31));
        let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
        let surface = crate::optics::Surface::diffuse([0.5; 3]);
        let boxes: Vec<TraceableBox> = (0..21)
            .map(|number| {
                let object = BoxObject {
                    size: DVec3::new(uniform(0.1, 0.6), uniform(0.1, 0.6), uniform(0.1, 1.0)),
                    base: DVec3::new(uniform(0.5, 3.5), uniform(0.5, 2.5), uniform(0.0, 1.0)),
                    rotation: if number % 2 == 0 { 0.0 } else { uniform(0.0, 7.0) },
                    surface,
                };
                TraceableBox::new(&object)
            })
            .collect();
        let bounds = BoxBounds::new(&boxes.iter().map(TraceableBox::bounds).collect::<Vec<_>>(), size.length());
        let (mut hits, mut passed) = (0, 0);
        for round in 0..20_000 {
            let mut point = || DVec3::new(uniform(0.0, size.x), uniform(0.0, size.y), uniform(0.0, size.z));
            let (mut origin, other) = (point(), point());
            let direction = match round % 4 {
                0 => DVec3::AXES[round / 4 % 3],
                1 => -DVec3::AXES[round / 4 % 3],
                _ => other - origin,
            };
            if round % 3 == 0 {
                // in the plane of a face
                let [low, high] = boxes[round % boxes.len()].bounds();
                origin[round / 3 % 3] = if round % 2 == 0 { low } else { high }[round / 3 % 3];
            }
            let reach = if round % 2 == 0 { f64::INFINITY } else { 1.0 };
            let met = bounds.met(origin, direction, reach);
            assert!(met.is_sorted());
            passed += met.len();
            for (number, object) in boxes.iter().enumerate() {
                if object.intersect(origin, direction).is_some_and(|(t, ..)| t <= reach) {
                    assert!(met.contains(&number), "{origin} {direction} {object:?}");
                    hits += 1;
                }
            }
        }
        assert!(hits > 5000 && passed < 3 * hits, "{hits} {passed}");
    }
}

//! Visibility between two points of the room, and between a point and a disc.

use std::f64::consts::FRAC_1_SQRT_2;

use glam::DVec3;

use super::block::ON_TARGET;
use super::obstacles::{Between, Shadow};
use super::scene::TraceableScene;
use super::surface_id::SurfaceId;
use crate::geometry::OpeningFrame;

/// Corners of a regular octagon of unit radius. Scaled by `OCTAGON_BESIDE_CIRCLE`, it encloses the unit circle with some to spare.
const OCTAGON: [[f64; 2]; 8] = [
    [1.0, 0.0],
    [FRAC_1_SQRT_2, FRAC_1_SQRT_2],
    [0.0, 1.0],
    [-FRAC_1_SQRT_2, FRAC_1_SQRT_2],
    [-1.0, 0.0],
    [-FRAC_1_SQRT_2, -FRAC_1_SQRT_2],
    [0.0, -1.0],
    [FRAC_1_SQRT_2, -FRAC_1_SQRT_2],
];
const OCTAGON_BESIDE_CIRCLE: f64 = 1.0824;

impl TraceableScene {
    /// True if nothing stands between two points of the room; the surfaces that they lie on do not count.
    #[inline]
    pub fn visible(&self, a: DVec3, from: Option<SurfaceId>, b: DVec3, to: Option<SurfaceId>) -> bool {
        if !self.obstructed {
            return true;
        }
        let own = |surface: Option<SurfaceId>| surface.and_then(|surface| self.numbering.box_of(surface));
        let (own_a, own_b) = (own(from), own(to));
        self.enclosure.is_clear(a, b)
            && !(self.openings_hang && self.opening_between(a, b))
            && self.no_luminaire_between(a, from, b, to)
            && self.box_bounds.met(a, b - a, 1.0).into_iter().all(|index| {
                Some(index) == own_a
                    || Some(index) == own_b
                    || self.boxes[index].intersect(a, b - a).is_none_or(|(t, ..)| t >= 1.0 - ON_TARGET)
            })
            && !self.meshes.as_ref().is_some_and(|meshes| meshes.blocks(a, b, 1.0 - ON_TARGET))
    }

    /// True if certainly nothing stands between any point within `reach` of `position`, at its height, and any point within `radius` of the
    /// centre of an opening before which it lies. `from` is the surface on which `position` lies; its own box is left out where `reach` is 0.
    pub fn leaves_clear(
        &self,
        position: DVec3,
        reach: f64,
        from: Option<SurfaceId>,
        opening: &OpeningFrame,
        radius: f64,
    ) -> bool {
        if !self.obstructed {
            return true;
        }
        // a box is convex: none of its points hides what another sees
        let own_box = from.filter(|_| reach == 0.0).and_then(|surface| self.numbering.box_of(surface));
        self.obstacles.leave_clear(position, reach, own_box, opening, radius)
    }

    /// Finds the obstacles that may stand between a point and any point within `radius` of the centre of an opening before which it lies.
    pub fn between(&self, position: DVec3, opening: &OpeningFrame, radius: f64) -> Between {
        self.obstacles.between(position, opening, radius)
    }

    /// True if one box certainly stands between each point of the convex hull of `points` and each point of a disc of `radius` in an opening,
    /// around its centre. A box is convex, and so are the region that it hides from a point and the set of points from which it hides one:
    /// testing the corners of the hull and of an octagon around the disc suffices.
    pub fn hides(&self, points: &[DVec3], opening: &OpeningFrame, radius: f64) -> bool {
        let Some(first) = points.first() else { return false };
        let centre = opening.origin;
        let corners: [DVec3; OCTAGON.len()] = OCTAGON
            .map(|[x, y]| centre + opening.direction_in_room(DVec3::new(x, y, 0.0)) * (radius * OCTAGON_BESIDE_CIRCLE));
        self.box_bounds.met(*first, centre - *first, 1.0).into_iter().any(|index| {
            let blocks = |from: DVec3, to: DVec3| {
                self.boxes[index].intersect(from, to - from).is_some_and(|(t, ..)| t < 1.0 - ON_TARGET)
            };
            points.iter().all(|point| corners.iter().all(|corner| blocks(*point, *corner)))
        })
    }

    /// Finds the shadows that light from `position` casts on the horizontal plane at `height`; box `but_for` casts none.
    pub fn shadows(&self, position: DVec3, height: f64, but_for: Option<usize>) -> impl Iterator<Item = Shadow> {
        self.obstacles.shadows(position, height, but_for)
    }

    /// True if a point is inside a box or on the lower side of one, or outside of the room.
    #[inline]
    pub fn is_in_solid(&self, point: DVec3) -> bool {
        self.boxes.iter().any(|object| object.contains(point)) || self.enclosure.is_outside(point)
    }

    /// True if a segment passes through an opening that hangs into the room, other than by ending in it.
    fn opening_between(&self, a: DVec3, b: DVec3) -> bool {
        let segment = b - a;
        self.tubes.iter().filter(|tube| tube.hangs).any(|tube| {
            let fraction = (tube.frame.origin.z - a.z) / segment.z;
            let inside = fraction * segment.length() > self.coinciding() && fraction < 1.0 - ON_TARGET;
            inside && tube.has(a + segment * fraction)
        })
    }

    fn no_luminaire_between(&self, a: DVec3, from: Option<SurfaceId>, b: DVec3, to: Option<SurfaceId>) -> bool {
        self.luminaires.iter().all(|luminaire| {
            Some(luminaire.surface) == from
                || Some(luminaire.surface) == to
                || luminaire
                    .intersect(a, b - a)
                    .is_none_or(|t| t >= 1.0 - ON_TARGET || t * (b - a).length() <= self.coinciding())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optics::Surface;
    use crate::sampling::{Key, PathRandom, warp};
    use crate::scene::BoxObject;
    use crate::traceable::test_rooms::{compiled, empty};

    /// No ray reaches a disc from any point of a cell from which `hides` reports it hidden, and the shadows of `between` hide exactly the
    /// points of the disc that rays do not reach.
    #[test]
    fn hidden_discs_are_reached_by_no_ray() {
        let surface = Surface::diffuse([0.5; 3]);
        let object =
            |x: f64, size: DVec3| BoxObject { size, base: DVec3::new(x, 3.0, 0.0), rotation: 0.4 * x, surface };
        let mut scene = empty(DVec3::new(6.0, 6.0, 3.0), Some(surface));
        scene.room.boxes = vec![object(2.0, DVec3::new(0.5, 3.0, 2.0)), object(4.0, DVec3::new(0.8, 1.0, 1.5))];
        let scene = compiled(&scene);
        let mut random = PathRandom::new(Key::new(8));
        let (mut hidden, mut in_part) = (0, 0);
        for _ in 0..4000 {
            let mut uniform = |low: f64, high: f64| low + (high - low) * random.uniform();
            let place = DVec3::new(uniform(0.2, 5.8), uniform(0.2, 5.8), 0.01);
            let (centre, radius) = (DVec3::new(uniform(0.5, 5.5), uniform(0.5, 5.5), 3.0), uniform(0.05, 0.4));
            let corners =
                [[-0.1, -0.1], [-0.1, 0.1], [0.1, -0.1], [0.1, 0.1]].map(|[x, y]| place + DVec3::new(x, y, 0.0));
            if corners.iter().chain([&place]).any(|corner| scene.is_in_solid(*corner)) {
                continue;
            }
            let opening = OpeningFrame::level(centre);
            let between = scene.between(place, &opening, radius);
            let all_hidden = scene.hides(&corners, &opening, radius);
            hidden += usize::from(all_hidden);
            for _ in 0..20 {
                let to = centre + (warp::disc(random.uniform2()) * radius).extend(0.0);
                let [u, v] = random.uniform2().map(|number| 0.2 * number - 0.1);
                let from = place + DVec3::new(u, v, 0.0);
                let reaches = !scene.is_in_solid(from) && scene.visible(from, None, to, None);
                assert!(!all_hidden || !reaches, "{from} {to}");
                let seen = scene.visible(place, None, to, None);
                assert_eq!(seen, !between.hides(to.truncate()), "{place} {to}");
                in_part += usize::from(!seen && !all_hidden);
            }
        }
        assert!(hidden > 100 && in_part > 100, "{hidden} {in_part}");
    }
}

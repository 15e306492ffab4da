//! Shapes of openings, each in its plane around its centre.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

use glam::{DVec2, DVec3};

use crate::geometry::OpeningFrame;
use crate::geometry::covered::{contains, covered, cross, distance, enclosed_area, polygon};
use crate::geometry::disc::{disc_disc_area, disc_polygon_area};
use crate::sampling::warp;

/// Fraction of a square's side within which edges coincide.
const COINCIDING: f64 = 1e-9;

/// Shape of an opening. Points are given relative to its centre, in m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum OpeningShape {
    /// Lower end of a pipe.
    Disc {
        /// Radius in m.
        radius: f64,
    },
    /// Square that a transition below the pipe lights evenly.
    Square {
        /// Length of a side in m.
        side: f64,
        /// Unit vector along two of the sides.
        along: DVec2,
    },
}

impl OpeningShape {
    /// Returns the area in m2.
    #[inline]
    pub fn area_m2(&self) -> f64 {
        match *self {
            Self::Disc { radius } => PI * radius * radius,
            Self::Square { side, .. } => side * side,
        }
    }

    /// Returns the radius of a disc; `None` for other shapes.
    pub fn disc(&self) -> Option<f64> {
        match *self {
            Self::Disc { radius } => Some(radius),
            Self::Square { .. } => None,
        }
    }

    /// Returns the radius in m of the smallest disc around the opening.
    #[inline]
    pub fn outer_radius(&self) -> f64 {
        match *self {
            Self::Disc { radius } => radius,
            Self::Square { side, .. } => side * FRAC_1_SQRT_2,
        }
    }

    /// Returns the radius in m of the largest disc around the centre inside the opening.
    pub fn inner_radius(&self) -> f64 {
        match *self {
            Self::Disc { radius } => radius,
            Self::Square { side, .. } => 0.5 * side,
        }
    }

    /// Returns half of the extent in m along a unit vector.
    pub fn extent_along(&self, toward: DVec2) -> f64 {
        match *self {
            Self::Disc { radius } => radius,
            Self::Square { side, along } => 0.5 * side * (along.dot(toward).abs() + along.perp_dot(toward).abs()),
        }
    }

    /// Returns half of the extent in m along a unit vector of the room, in the plane of an opening with this frame.
    pub fn extent_in(&self, frame: &OpeningFrame, toward: DVec3) -> f64 {
        let within = frame.levelled_direction(toward).truncate();
        within.length() * self.extent_along(within.normalize_or(DVec2::X))
    }

    /// Returns a point of the opening; uniform numbers in 0..1 give uniform points.
    #[inline]
    pub fn point(&self, [u, v]: [f64; 2]) -> DVec2 {
        match *self {
            Self::Disc { radius } => warp::disc([u, v]) * radius,
            Self::Square { side, along } => along.rotate(DVec2::new(u - 0.5, v - 0.5) * side),
        }
    }

    /// Iterates over the middles of `edge` x `edge` equal parts of the opening.
    pub fn points(self, edge: usize) -> impl Iterator<Item = DVec2> {
        let middle = move |part: usize| (part as f64 + 0.5) / edge as f64;
        (0..edge * edge).map(move |number| self.point([middle(number / edge), middle(number % edge)]))
    }

    /// Returns the point of the rim in the direction of a unit vector.
    pub fn rim(&self, toward: DVec2) -> DVec2 {
        match *self {
            Self::Disc { radius } => radius * toward,
            Self::Square { side, along } => {
                toward * (0.5 * side / along.dot(toward).abs().max(along.perp_dot(toward).abs()))
            }
        }
    }

    /// True if a point lies in the opening.
    #[inline]
    pub fn contains(&self, away: DVec2) -> bool {
        match *self {
            Self::Disc { radius } => away.length_squared() < radius * radius,
            Self::Square { side, along } => along_sides(side, along, away).abs().max_element() < 0.5,
        }
    }

    /// Returns the distance in m of a point from the opening, 0 inside.
    #[inline]
    pub fn distance(&self, away: DVec2) -> f64 {
        match *self {
            Self::Disc { radius } => (away.length() - radius).max(0.0),
            Self::Square { side, along } => {
                (along_sides(side, along, away).abs() - 0.5).max(DVec2::ZERO).length() * side
            }
        }
    }

    /// Returns the corners of a square, counter-clockwise seen from above; `None` for a disc.
    pub fn corners(&self) -> Option<[DVec2; 4]> {
        match *self {
            Self::Disc { .. } => None,
            Self::Square { side, along } => Some(corners(side, along)),
        }
    }

    /// Returns the area in m2 of the opening within `radius` m of a point.
    #[inline]
    pub fn area_within(&self, away: DVec2, radius: f64) -> f64 {
        match *self {
            Self::Disc { radius: own } => disc_disc_area(radius, own, away.length()),
            Self::Square { side, along } => disc_polygon_area(away, radius, &corners(side, along)),
        }
    }

    /// Returns the area in m2 that the opening shares with a simple polygon.
    pub fn area_in(&self, outline: &[DVec2]) -> f64 {
        match *self {
            Self::Disc { radius } => disc_polygon_area(DVec2::ZERO, radius, outline).abs(),
            Self::Square { side, along } => {
                let own = polygon(&corners(side, along));
                enclosed_area(&covered(&own, &[polygon(outline)], COINCIDING * side))
            }
        }
    }

    /// True if a segment has a part in the opening, farther than `inward` m from its rim.
    pub fn meets(&self, segment: [DVec2; 2], inward: f64) -> bool {
        match *self {
            Self::Disc { radius } => distance(&[segment], DVec2::ZERO) < radius - inward,
            Self::Square { side, along } => {
                let within = side - 2.0 * inward;
                let own = polygon(&corners(within, along));
                within > 0.0 && (contains(&own, segment[0]) || cross(&own, &[segment]))
            }
        }
    }
}

fn corners(side: f64, along: DVec2) -> [DVec2; 4] {
    [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|corner| along.rotate(DVec2::from(corner) * side))
}

/// Returns the coordinates of a point along the sides of a square, -0.5..0.5 inside.
fn along_sides(side: f64, along: DVec2, away: DVec2) -> DVec2 {
    DVec2::new(along.dot(away), along.perp_dot(away)) / side
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::turn::unit_vector;
    use crate::sampling::{Key, PathRandom};

    const SHAPES: [OpeningShape; 2] =
        [OpeningShape::Disc { radius: 0.3 }, OpeningShape::Square { side: 0.6, along: DVec2::new(0.8, 0.6) }];

    /// Random points lie in the opening, and a fraction of them within a disc and within a triangle that is that of the areas (4 standard
    /// deviations of 100 000 points); distances are those to the nearest of many points of the rim.
    #[test]
    fn areas_and_distances_are_those_of_points() {
        let mut random = PathRandom::new(Key::new(1));
        for shape in SHAPES {
            let (away, radius) = (DVec2::new(0.2, -0.1), 0.25);
            let triangle = [DVec2::new(-0.1, -0.5), DVec2::new(0.1, 0.5), DVec2::new(-0.7, 0.3)];
            let edges = polygon(&triangle);
            let (mut in_disc, mut in_triangle) = (0.0, 0.0);
            for _ in 0..100_000 {
                let point = shape.point(random.uniform2());
                assert!(shape.contains(point) && point.length() <= shape.outer_radius());
                in_disc += f64::from(u8::from(point.distance(away) < radius));
                in_triangle += f64::from(u8::from(contains(&edges, point)));
            }
            for (found, area) in [(in_disc, shape.area_within(away, radius)), (in_triangle, shape.area_in(&triangle))] {
                let fraction: f64 = area / shape.area_m2();
                let error = (fraction * (1.0 - fraction) / 1e5).sqrt();
                assert!((found / 1e5 - fraction).abs() < 4.0 * error, "{shape:?} {found} {fraction}");
            }
            let rim: Vec<DVec2> = (0..10_000).map(|k| shape.rim(unit_vector(6.3e-4 * f64::from(k)))).collect();
            let to_rim = |point: DVec2| rim.iter().map(|of| of.distance(point)).fold(f64::INFINITY, f64::min);
            for point in [DVec2::new(0.5, 0.1), DVec2::new(-0.3, 0.6), DVec2::new(0.0, -0.47)] {
                assert!((shape.distance(point) - to_rim(point)).abs() < 1e-6 && !shape.contains(point));
                assert!(!shape.meets([point, 2.0 * point], 0.0) && shape.meets([2.0 * point, -point], 0.2));
                let across = |at: f64| [at * point - point.perp(), at * point + point.perp()];
                let rim = shape.extent_along(point.normalize()) / point.length();
                assert!(shape.meets(across(0.999 * rim), 0.0) && !shape.meets(across(1.001 * rim), 0.0));
                assert!(!shape.meets(across(0.999 * rim), 0.01));
            }
            let widest = rim.iter().map(|of| of.x).fold(0.0, f64::max);
            assert!((shape.extent_along(DVec2::X) - widest).abs() < 1e-4);
            let lengths = || rim.iter().map(|of| of.length());
            assert!((shape.inner_radius() - lengths().fold(f64::INFINITY, f64::min)).abs() < 1e-6);
            assert!((shape.outer_radius() - lengths().fold(0.0, f64::max)).abs() < 1e-4);
        }
    }
}

//! Obstructions: boxes outdoors, turned into the horizon of one point.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::Horizon;

/// Number of azimuths, beside those of corners, at which the outline of obstructions is found.
const AZIMUTHS: usize = 720;

/// Angle in radians on either side of a corner at which the outline is found: far below the width of the sun's disc.
const BESIDE: f64 = 1e-9;

/// Fraction of an edge by which a ray may miss its ends, for rounding.
const ROUNDING: f64 = 1e-12;

/// A box with vertical sides; light is taken to come neither through it nor from below it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Obstruction {
    /// Corners of the base, seen from above, in m.
    pub corners: [DVec2; 4],
    /// Height of the top in m.
    pub top_m: f64,
}

impl Obstruction {
    /// Returns the distance in m, in plan, of a point from the box; 0 inside.
    pub fn distance_m(&self, from: DVec2) -> f64 {
        let edges = || self.edges();
        let turns = edges().map(|(start, end)| (end - start).perp_dot(from - start));
        let inside = turns.clone().all(|turn| turn >= 0.0) || turns.clone().all(|turn| turn <= 0.0);
        let to_edge = |(start, end): (DVec2, DVec2)| {
            let edge = end - start;
            let along = ((from - start).dot(edge) / edge.length_squared()).clamp(0.0, 1.0);
            (from - start - edge * along).length()
        };
        if inside { 0.0 } else { edges().map(to_edge).fold(f64::INFINITY, f64::min) }
    }

    /// Returns the altitude in radians of the box's upper edge along a horizontal unit vector, seen from a point outside it; 0 where it is
    /// not above the horizontal.
    fn altitude(&self, from: DVec3, ray: DVec2) -> f64 {
        let distance = |(start, end): (DVec2, DVec2)| {
            let (edge, to_start) = (end - start, start - from.truncate());
            let across = ray.perp_dot(edge);
            let (distance, along) = (to_start.perp_dot(edge) / across, to_start.perp_dot(ray) / across);
            // a ray along an edge has no crossing with it, but meets its neighbours
            (distance > 0.0 && (-ROUNDING..=1.0 + ROUNDING).contains(&along)).then_some(distance)
        };
        let nearest = self.edges().filter_map(distance).fold(f64::INFINITY, f64::min);
        libm::atan2(self.top_m - from.z, nearest).max(0.0)
    }

    fn edges(&self) -> impl Iterator<Item = (DVec2, DVec2)> + Clone {
        (0..4).map(|k| (self.corners[k], self.corners[(k + 1) % 4]))
    }
}

impl Horizon {
    /// Creates the horizon of obstructions seen from a point outside them, in front of another one; `None` if no part of it is above 0.
    ///
    /// It is exact at the corners of boxes and at the other horizon's points, and linear between azimuths half a degree apart.
    pub fn with_obstructions(behind: Option<&Self>, obstructions: &[Obstruction], from: DVec3) -> Option<Self> {
        let above: Vec<&Obstruction> = obstructions.iter().filter(|box_| box_.top_m > from.z).collect();
        if above.is_empty() {
            return behind.cloned();
        }
        let corners = above.iter().flat_map(|box_| box_.corners).map(|corner| corner - from.truncate());
        let corners = corners.map(|corner| libm::atan2(corner.x, corner.y));
        let jumps = corners.chain(behind.into_iter().flat_map(Self::azimuths));
        let even = (0..AZIMUTHS).map(|number| TAU * number as f64 / AZIMUTHS as f64);
        let beside = jumps.flat_map(|azimuth| [azimuth - BESIDE, azimuth + BESIDE]);
        let mut azimuths: Vec<f64> = beside.map(|azimuth| azimuth.rem_euclid(TAU)).chain(even).collect();
        azimuths.sort_by(f64::total_cmp);
        azimuths.dedup();
        let altitude = |azimuth: f64| {
            let (sin, cos) = libm::sincos(azimuth);
            let ray = DVec2::new(sin, cos);
            let of_boxes = above.iter().map(|box_| box_.altitude(from, ray)).fold(0.0, f64::max);
            (azimuth, behind.map_or(0.0, |horizon| horizon.altitude(azimuth)).max(of_boxes))
        };
        let points: Vec<(f64, f64)> = azimuths.into_iter().map(altitude).collect();
        Self::new(points, 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::direction;

    /// Box of 4 m by 2 m whose near side is 6 m north of the origin, turned or not.
    fn wall(turn: f64) -> Obstruction {
        let corner = |x: f64, y: f64| DVec2::from_angle(turn).rotate(DVec2::new(x, y));
        Obstruction { corners: [corner(-2.0, 6.0), corner(2.0, 6.0), corner(2.0, 8.0), corner(-2.0, 8.0)], top_m: 5.0 }
    }

    /// Checks the upper edge of the near side, tan(altitude) = height cos(azimuth) / distance, and the corners, beside which the sky is
    /// free.
    #[test]
    fn a_box_hides_what_is_behind_its_upper_edge() {
        for turn in [0.0, 1.0, 2.5, -0.3] {
            let horizon = Horizon::with_obstructions(None, &[wall(turn)], DVec3::new(0.0, 0.0, 1.0)).unwrap();
            // north turns anticlockwise with the box
            let at = |azimuth: f64| horizon.altitude(azimuth - turn);
            let corner = libm::atan2(2.0, 6.0);
            for azimuth in [0.0, 0.1, 0.25, corner - 1e-6, -0.05, 1e-6 - corner] {
                let expected = libm::atan(4.0 * libm::cos(azimuth) / 6.0);
                assert!((at(azimuth) - expected).abs() < 2e-5, "{turn} {azimuth}: {} {expected}", at(azimuth));
            }
            for azimuth in [corner + 1e-6, 0.5, 3.0, -corner - 1e-6] {
                assert_eq!(at(azimuth), 0.0, "{turn} {azimuth}");
            }
            assert!((horizon.largest_altitude() - libm::atan(4.0 / 6.0)).abs() < 2e-5);
        }
        assert!(Horizon::with_obstructions(None, &[wall(0.0)], DVec3::new(0.0, 0.0, 5.0)).is_none());
    }

    /// Checks that the higher one of a box and the horizon behind it counts, in a frame that is turned against that of the horizon.
    #[test]
    fn the_higher_outline_counts() {
        let degrees = f64::to_radians;
        let points = vec![(0.0, degrees(10.0)), (degrees(180.0), degrees(40.0))];
        let hills = Horizon::new(points, degrees(90.0)).unwrap();
        let both = Horizon::with_obstructions(Some(&hills), &[wall(0.0)], DVec3::ZERO).unwrap();
        for number in 0..720 {
            let azimuth = degrees(0.5 * f64::from(number) + 0.2);
            let expected =
                hills.altitude(azimuth).max(wall(0.0).altitude(DVec3::ZERO, direction(0.0, azimuth).truncate()));
            assert!((both.altitude(azimuth) - expected).abs() < 1e-3, "{number}");
            assert!(
                both.hides(direction(expected - 2e-3, azimuth)) && !both.hides(direction(expected + 2e-3, azimuth))
            );
        }
    }

    #[test]
    fn distances_are_those_of_the_nearest_edge() {
        for (from, expected) in [((0.0, 0.0), 6.0), ((5.0, 10.0), 13f64.sqrt()), ((0.0, 7.0), 0.0), ((-3.0, 7.5), 1.0)]
        {
            assert!((wall(0.0).distance_m(DVec2::from(from)) - expected).abs() < 1e-12, "{from:?}");
        }
    }
}

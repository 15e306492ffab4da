//! Horizon profiles, which hide a part of the sky and the sun.

use std::f64::consts::{PI, TAU};
use std::num::NonZeroUsize;

use gauss_quad::GaussLegendre;
use glam::DVec3;

use super::sun::HALF_ANGLE;
use super::{SkyDistribution, Sun};
use crate::sampling::warp;

/// Number of azimuths, and of heights at each, at which a sky behind a horizon is integrated.
const AZIMUTHS: usize = 360;
const HEIGHTS: usize = 8;

/// Number of pieces of equal width into which a sector of azimuths is divided at least.
const PIECES: usize = 4;

/// Number of directions along each side of the square that is mapped to the sun's disc.
const DISC: usize = 64;

/// Angle in radians from the sun's centre beyond which there is nothing of its disc.
const EDGE: f64 = HALF_ANGLE + 1e-9;

/// Horizon profile: an altitude for each azimuth, linear between points, all round.
#[derive(Clone, Debug, PartialEq)]
pub struct Horizon {
    /// Azimuths and altitudes in radians; the azimuths ascend within 0..=2 pi.
    points: Vec<(f64, f64)>,
    /// Azimuth of the +y axis in that of the points, in radians.
    rotation: f64,
    /// Sines of the least and of the largest altitude.
    heights: [f64; 2],
}

impl Horizon {
    /// Creates a horizon from azimuths (clockwise from north, ascending within 0..=2 pi) and altitudes (0..=pi/2), in radians, for a frame
    /// whose +y axis has the azimuth `rotation`; `None` if no point is above 0.
    ///
    /// ```
    /// use skyduct_physics::sky::{Horizon, direction};
    ///
    /// let degrees = f64::to_radians;
    /// // a hill in the east
    /// let points = [(0.0, 0.0), (90.0, 20.0), (180.0, 0.0)].map(|(azimuth, altitude)| (degrees(azimuth), degrees(altitude)));
    /// let horizon = Horizon::new(points.into(), 0.0).ok_or("flat")?;
    /// assert!(horizon.hides(direction(degrees(9.9), degrees(45.0))));
    /// assert!(!horizon.hides(direction(degrees(10.1), degrees(45.0))));
    /// assert!(!horizon.hides(direction(0.0, degrees(270.0))));
    /// # Ok::<(), &str>(())
    /// ```
    pub fn new(points: Vec<(f64, f64)>, rotation: f64) -> Option<Self> {
        let altitudes = || points.iter().map(|(_, altitude)| *altitude);
        let (least, most) = (altitudes().fold(f64::INFINITY, f64::min), altitudes().fold(0.0, f64::max));
        (most > 0.0).then(|| Self { points, rotation, heights: [least, most].map(libm::sin) })
    }

    /// Lists the azimuths of the points in radians, clockwise from the +y axis.
    pub(super) fn azimuths(&self) -> impl Iterator<Item = f64> {
        self.points.iter().map(|(azimuth, _)| azimuth - self.rotation)
    }

    /// Returns the largest altitude in radians.
    pub fn largest_altitude(&self) -> f64 {
        libm::asin(self.heights[1])
    }

    /// True if the unit vector `direction`, at or above the horizontal, points below the profile.
    #[inline]
    pub fn hides(&self, direction: DVec3) -> bool {
        let [least, most] = self.heights;
        if direction.z < least {
            return true;
        }
        direction.z < most && direction.z < libm::sin(self.altitude(libm::atan2(direction.x, direction.y)))
    }

    /// Returns the altitude in radians at an azimuth in radians, clockwise from the +y axis.
    pub(super) fn altitude(&self, azimuth: f64) -> f64 {
        let azimuth = (azimuth + self.rotation).rem_euclid(TAU) % TAU;
        let (count, after) = (self.points.len(), self.points.partition_point(|(at, _)| *at <= azimuth));
        let (mut from, mut to) = (self.points[(after + count - 1) % count], self.points[after % count]);
        from.0 -= if after == 0 { TAU } else { 0.0 };
        to.0 += if after == count { TAU } else { 0.0 };
        from.1 + (to.1 - from.1) * (azimuth - from.0) / (to.0 - from.0)
    }

    /// Computes the fraction of a sky's horizontal illuminance that comes from below the profile, by a rule over azimuths and heights.
    ///
    /// Below a ring of the altitude a it is (3 sin^2 a + 4 sin^3 a) / 7 under the traditional overcast sky:
    ///
    /// ```
    /// use skyduct_physics::sky::{CieType, Horizon, SkyDistribution};
    ///
    /// let overcast = SkyDistribution::new(CieType::TRADITIONAL_OVERCAST, glam::DVec3::Z);
    /// let ring = Horizon::new(vec![(0.0, 20f64.to_radians())], 0.0).ok_or("flat")?;
    /// let z = 20f64.to_radians().sin();
    /// assert!((ring.hidden_fraction(&overcast) - (3.0 * z * z + 4.0 * z * z * z) / 7.0).abs() < 1e-12);
    /// # Ok::<(), &str>(())
    /// ```
    pub fn hidden_fraction(&self, distribution: &SkyDistribution) -> f64 {
        let light =
            |(toward, solid_angle): (DVec3, f64)| solid_angle * toward.z * distribution.relative_luminance(toward);
        self.hidden(AZIMUTHS, HEIGHTS).map(light).sum::<f64>() / distribution.horizontal_ratio()
    }

    /// Lists directions below the profile and above the horizontal with their solid angles in sr: in the middle of even sectors, at the nodes
    /// of a Gauss-Legendre rule over the height. The weight of a node is the part of its range of heights that the profile hides in the
    /// sector, so that none of it is missed, however narrow it is.
    pub fn hidden(&self, azimuths: usize, heights: usize) -> impl Iterator<Item = (DVec3, f64)> {
        let rule = GaussLegendre::new(NonZeroUsize::new(heights).unwrap_or(NonZeroUsize::MIN));
        let mut rule = rule.as_node_weight_pairs().to_vec();
        rule.sort_by(|a, b| a.0.total_cmp(&b.0));
        let step = TAU / azimuths as f64;
        let mut sectors = vec![Vec::new(); azimuths];
        for (middle, width) in self.pieces(step / PIECES as f64) {
            sectors[((middle / step) as usize).min(azimuths - 1)].push((width, libm::sin(self.altitude(middle))));
        }
        sectors.into_iter().enumerate().flat_map(move |(number, pieces)| {
            let (sin, cos) = libm::sincos(step * (number as f64 + 0.5));
            let half = 0.5 * pieces.iter().map(|(_, top)| *top).fold(0.0, f64::max);
            let mut low = 0.0;
            let at = |(node, weight): &(f64, f64)| {
                let range = half * weight;
                let hidden: f64 = pieces.iter().map(|(width, top)| width * (top - low).clamp(0.0, range)).sum();
                low += range;
                let z = half * (1.0 + node);
                let radius = ((1.0 - z) * (1.0 + z)).max(0.0).sqrt();
                (DVec3::new(radius * sin, radius * cos, z), hidden)
            };
            rule.iter().map(at).collect::<Vec<_>>()
        })
    }

    /// Divides the azimuths, clockwise from the +y axis, into pieces of at most some radians that end at the points of the profile. Returns the
    /// middle of each piece and its width in radians.
    fn pieces(&self, most: f64) -> Vec<(f64, f64)> {
        let even = (0..=(TAU / most).round() as usize).map(|number| (most * number as f64).min(TAU));
        let mut ends: Vec<f64> = even.chain(self.azimuths().map(|azimuth| azimuth.rem_euclid(TAU))).collect();
        ends.sort_by(f64::total_cmp);
        let of = |pair: [f64; 2]| (0.5 * (pair[0] + pair[1]), pair[1] - pair[0]);
        ends.array_windows().map(|pair| of(*pair)).filter(|(_, width)| *width > 0.0).collect()
    }

    /// Returns the fraction of the sun's disc that is above the profile, within 0.002.
    pub fn uncovered(&self, sun: &Sun) -> f64 {
        let [least, most] = self.altitudes_near(sun.direction);
        let altitude = libm::asin(sun.direction.z.clamp(-1.0, 1.0));
        if altitude > most + EDGE {
            return 1.0;
        }
        if altitude < least - EDGE {
            return 0.0;
        }
        let at = |number: usize| (number as f64 + 0.5) / DISC as f64;
        let places = (0..DISC).flat_map(|row| (0..DISC).map(move |column| [at(row), at(column)]));
        let seen = places.filter(|place| !self.hides(warp::around(sun.direction, warp::cone(*place, HALF_ANGLE))));
        seen.count() as f64 / (DISC * DISC) as f64
    }

    /// Returns the least and the largest altitude in radians over the azimuths that the sun's disc around a unit vector has.
    fn altitudes_near(&self, direction: DVec3) -> [f64; 2] {
        let sine = libm::sin(EDGE) / direction.truncate().length();
        let width = if sine < 1.0 { libm::asin(sine) } else { PI };
        let azimuth = libm::atan2(direction.x, direction.y);
        let away = |at: f64| (at - self.rotation - azimuth + PI).rem_euclid(TAU) - PI;
        let within = self.points.iter().filter(|(at, _)| away(*at).abs() <= width).map(|(_, altitude)| *altitude);
        let edges = [-width, width].map(|away| self.altitude(azimuth + away));
        within
            .chain(edges)
            .fold([PI, 0.0], |[least, most]: [f64; 2], altitude| [least.min(altitude), most.max(altitude)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sky::{CieType, direction};

    fn horizon(points: &[(f64, f64)], rotation_deg: f64) -> Horizon {
        let points = points.iter().map(|(azimuth, altitude)| (azimuth.to_radians(), altitude.to_radians()));
        Horizon::new(points.collect(), rotation_deg.to_radians()).unwrap()
    }

    /// Checks altitudes between points, across north, at a jump there, and in a rotated frame.
    #[test]
    fn altitudes_are_linear_between_points() {
        let across = horizon(&[(30.0, 10.0), (300.0, 40.0)], 0.0);
        let altitude = |horizon: &Horizon, azimuth_deg: f64| horizon.altitude(azimuth_deg.to_radians()).to_degrees();
        for (azimuth, expected) in
            [(30.0, 10.0), (165.0, 25.0), (300.0, 40.0), (345.0, 25.0), (-15.0, 25.0), (0.0, 20.0)]
        {
            assert!((altitude(&across, azimuth) - expected).abs() < 1e-9, "{azimuth}");
        }
        let jump = horizon(&[(0.0, 0.0), (360.0, 36.0)], 0.0);
        for (azimuth, expected) in [(0.0, 0.0), (90.0, 9.0), (-10.0, 35.0), (350.0, 35.0)] {
            assert!((altitude(&jump, azimuth) - expected).abs() < 1e-9, "{azimuth}");
        }
        let rotated = horizon(&[(30.0, 10.0), (300.0, 40.0)], 50.0);
        assert!((altitude(&rotated, 250.0) - 40.0).abs() < 1e-9);
        assert!(Horizon::new(vec![(0.0, 0.0), (1.0, 0.0)], 0.0).is_none());
    }

    /// Checks a level ring, which covers circular segments of the disc, and a vertical edge through its centre.
    #[test]
    fn a_disc_is_covered_by_its_fraction() {
        let sun = |altitude_deg: f64| Sun {
            direction: direction(altitude_deg.to_radians(), 1.0),
            normal_illuminance_lux: 60_000.0,
        };
        let ring = horizon(&[(0.0, 20.0)], 0.0);
        for share in [-1.1f64, -0.7, 0.0, 0.4, 1.1] {
            let inside = share.clamp(-1.0, 1.0);
            let expected = 1.0 - (inside.acos() - inside * (1.0 - inside * inside).sqrt()) / PI;
            let found = ring.uncovered(&sun(20.0 + share * HALF_ANGLE.to_degrees()));
            assert!((found - expected).abs() < 2e-3, "{share}: {found} {expected}");
            assert!(share.abs() < 1.0 || found == expected, "{share}: {found}");
        }
        let middle = 1f64.to_degrees();
        let edge = horizon(&[(0.0, 0.0), (middle, 0.0), (middle + 1e-9, 60.0), (180.0, 60.0), (180.1, 0.0)], 0.0);
        assert!((edge.uncovered(&sun(30.0)) - 0.5).abs() < 2e-3);
    }

    /// Compares the hidden fraction behind a jagged horizon with a fine lattice over the dome.
    #[test]
    fn hidden_fractions_agree_with_a_lattice() {
        let jagged = horizon(&[(0.0, 5.0), (40.0, 45.0), (90.0, 0.0), (200.0, 30.0), (330.0, 12.0)], 25.0);
        for cie_type in [CieType::UNIFORM, CieType::new(12).unwrap()] {
            let distribution = SkyDistribution::new(cie_type, direction(0.6, 2.0));
            let (mut hidden, mut all) = (0.0, 0.0);
            for (row, column) in (0..400).flat_map(|row| (0..1000).map(move |column| (row, column))) {
                let z = (f64::from(row) + 0.5) / 400.0;
                let toward = direction(z.asin(), TAU * (f64::from(column) + 0.5) / 1000.0);
                let light = z * distribution.relative_luminance(toward);
                all += light;
                hidden += if jagged.hides(toward) { light } else { 0.0 };
            }
            let found = jagged.hidden_fraction(&distribution);
            assert!((found - hidden / all).abs() < 1e-3, "{found} {}", hidden / all);
        }
    }

    /// Compares what thirty masts hide of a uniform sky, wherever they stand, with the integral: each hides sin^2 of its altitude.
    #[test]
    fn narrow_masts_are_hidden_as_a_whole() {
        let uniform = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
        for turn_deg in [0.0, 0.5, 1.0, 1.3] {
            let masts = (0..30).flat_map(|mast| {
                let at = 12.0 * f64::from(mast) + 2.0;
                [(at, 0.0), (at + 1e-9, 50.0), (at + 0.3, 50.0), (at + 0.3 + 1e-9, 0.0)]
            });
            let masts = horizon(&masts.collect::<Vec<_>>(), turn_deg);
            let expected = 30.0 * 0.3 / 360.0 * 50f64.to_radians().sin().powi(2);
            let found = masts.hidden_fraction(&uniform);
            assert!((found / expected - 1.0).abs() < 1e-3, "{turn_deg}: {found} {expected}");
            let coarse: f64 = masts.hidden(180, 10).map(|(toward, solid_angle)| solid_angle * toward.z / PI).sum();
            assert!((coarse / expected - 1.0).abs() < 1e-3, "{turn_deg}: {coarse} {expected}");
        }
    }
}

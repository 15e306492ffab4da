//! Zenith angles over the sun's disc, and integrals over them.
//!
//! The light that a straight pipe sends from the sun to a point has kinks and jumps over the zenith angles of the disc, where an edge of the
//! opening cuts the visible disc or the number of reflections changes. Simpson's rule halves the intervals where it finds them.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, PI};

use crate::sky::Sun;
use crate::sky::sun::HALF_ANGLE;

/// Largest number of times that an interval is halved.
const MOST_HALVINGS: u32 = 10;

/// Number of times that the position of the steps along the arcs changes by a whole step over the places of the disc: the errors of arcs
/// are those of independent places.
const STEPS_TURNED: f64 = 618.033_988_7;

/// A quadrature node: one zenith angle on the solar disc.
#[derive(Clone, Copy, Debug)]
pub struct SunNode {
    /// Zenith angle in radians.
    pub zenith_angle: f64,
    /// Integration step of the zenith angle in radians.
    pub step: f64,
    /// Half width in azimuth of the disc at this zenith angle, in radians.
    pub half_azimuth: f64,
}

/// Zenith angles from zenith to horizon, in radians.
pub const ABOVE_HORIZON: [f64; 2] = [0.0, FRAC_PI_2];

/// Part of the sun's disc within some zenith angles.
#[derive(Clone, Copy, Debug)]
pub struct SunDisc {
    /// Zenith angle of the sun in radians.
    centre: f64,
    /// Middle and half width of the range of zenith angles, in radians.
    middle: f64,
    half: f64,
}

impl SunDisc {
    /// Returns the part of the disc within the zenith angles `low` to `high`; `None` where there is none.
    pub fn within(sun: &Sun, [low, high]: [f64; 2]) -> Option<Self> {
        let centre = libm::atan2(sun.direction.truncate().length(), sun.direction.z);
        let (low, high) = ((centre - HALF_ANGLE).max(low), (centre + HALF_ANGLE).min(high));
        let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
        (half > 0.0).then_some(Self { centre, middle, half })
    }

    /// Returns the node at a place in 0..1 of the range, where places crowd toward its ends, for an interval of places of this `width`;
    /// `None` for zenith angles that no light from above has.
    pub fn node(&self, place: f64, width: f64) -> Option<SunNode> {
        let t = PI * (place - 0.5);
        let zenith_angle = self.middle + self.half * libm::sin(t);
        // sin^2 of half the azimuth at which the disc ends, free of cancellation
        let half_squared = libm::sin(0.5 * HALF_ANGLE).powi(2);
        let across = half_squared - libm::sin(0.5 * (zenith_angle - self.centre)).powi(2);
        let fraction = across / (libm::sin(zenith_angle) * libm::sin(self.centre));
        let half_azimuth = if fraction >= 1.0 { PI } else { 2.0 * libm::asin(fraction.max(0.0).sqrt()) };
        let step = self.half * libm::cos(t) * PI * width;
        (zenith_angle > 0.0 && zenith_angle < FRAC_PI_2).then_some(SunNode { zenith_angle, step, half_azimuth })
    }
}

/// Returns the quadrature nodes of the part of the sun's disc within some zenith angles: `count` intervals that crowd toward the ends,
/// each with a node at the position `shift` (0..1).
pub fn sun_nodes(sun: &Sun, (count, shift): (usize, f64), within: [f64; 2]) -> Vec<SunNode> {
    let width = 1.0 / count as f64;
    let node = |disc: SunDisc| (0..count).filter_map(move |k| disc.node((k as f64 + shift) * width, width));
    SunDisc::within(sun, within).into_iter().flat_map(node).collect()
}

/// Integral over the zenith angles of the disc, by Simpson's rule at first.
pub struct OverDisc<F> {
    disc: SunDisc,
    of_node: F,
    first: Vec<Interval>,
}

/// Values of the integrand at both ends of an interval of places on the disc and in its middle.
#[derive(Clone, Copy)]
struct Interval {
    from: f64,
    width: f64,
    values: [f64; 3],
}

impl Interval {
    /// Returns the integral by Simpson's rule.
    fn integral(&self) -> f64 {
        let [low, middle, high] = self.values;
        self.width / 6.0 * (low + 4.0 * middle + high)
    }
}

impl<F: Fn(SunNode, f64) -> f64> OverDisc<F> {
    /// Computes the integral with a number of intervals; `of_node` returns the value of a node, with the position in 0..1 of the steps
    /// along its arc.
    pub fn new(disc: SunDisc, intervals: usize, of_node: F) -> Self {
        let mut over = Self { disc, of_node, first: Vec::new() };
        let width = 1.0 / intervals as f64;
        let values: Vec<f64> = (0..=2 * intervals).map(|number| over.at(0.5 * width * number as f64)).collect();
        let interval = |number: usize| {
            let values = [0, 1, 2].map(|place| values[2 * number + place]);
            Interval { from: width * number as f64, width, values }
        };
        over.first = (0..intervals).map(interval).collect();
        over
    }

    /// Returns the number of intervals at first.
    pub fn intervals(&self) -> usize {
        self.first.len()
    }

    /// Returns the integral by the first intervals.
    pub fn first(&self) -> f64 {
        self.first.iter().map(Interval::integral).sum()
    }

    /// Computes the integral, halving intervals until each of the first has about this error; also returns the sum of the squares of what
    /// it estimates their errors to be, from the changes by the last halvings.
    pub fn refined(&self, of_interval: f64) -> (f64, f64) {
        let mut squared = 0.0;
        let sum = self.first.iter().map(|interval| self.integral(*interval, of_interval, 0, &mut squared)).sum();
        (sum, squared)
    }

    /// Returns the value per place of the disc.
    fn at(&self, place: f64) -> f64 {
        self.disc.node(place, 1.0).map_or(0.0, |node| (self.of_node)(node, (place * STEPS_TURNED).fract()))
    }

    fn integral(&self, interval: Interval, tolerated: f64, halvings: u32, squared: &mut f64) -> f64 {
        let Interval { from, width, values } = interval;
        let half = 0.5 * width;
        let [low, middle, high] = values;
        let halves = [(from, low, middle), (from + half, middle, high)].map(|(from, low, high)| Interval {
            from,
            width: half,
            values: [low, self.at(from + 0.5 * half), high],
        });
        let both = halves.iter().map(Interval::integral).sum::<f64>();
        let changed = both - interval.integral();
        if changed.abs() <= tolerated || halvings == MOST_HALVINGS {
            *squared += changed * changed;
            return both;
        }
        // errors of intervals are independent
        halves.into_iter().map(|half| self.integral(half, FRAC_1_SQRT_2 * tolerated, halvings + 1, squared)).sum()
    }
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use glam::{DVec2, DVec3};

    use super::*;
    use crate::guide::StraightGuide;
    use crate::guide::sun_arcs::PointBelow;
    use crate::optics::Spectrum;
    use crate::sky::direction;

    /// Checks points that receive much of their sunlight from a narrow range of zenith angles, which up to 32 nodes at equal steps miss (by
    /// 2.5 and 0.5 %): the errors are below the tolerance, and of the order of those estimated, by far fewer nodes.
    #[test]
    fn narrow_ranges_are_found() {
        let sun =
            Sun { direction: direction(60f64.to_radians(), 200f64.to_radians()), normal_illuminance_lux: 60_000.0 };
        let collector_transmittance = [1.0; 3];
        let guide = StraightGuide { radius: 0.15, length: 1.0, reflectance: [0.98; 3].into(), collector_transmittance };
        for foot in [DVec2::new(1.7, -0.1), DVec2::new(-0.1, 1.5)] {
            let point = PointBelow { guide: &guide, zone: (0.0, 0.15), depth: 2.7, foot };
            let arrives = |_, toward: DVec3| Spectrum::<1>([toward.z]);
            let truth = point.sunlight(&sun, (2000, 0.5), (16, 1.0), arrives).illuminance.luminance();
            let count = Cell::new(0);
            let disc = SunDisc::within(&sun, point.zenith_angles()).unwrap();
            let over = OverDisc::new(disc, 32, |node, step| {
                count.set(count.get() + 1);
                point.of_node(&sun, node, (8, 1.0 - step), arrives).illuminance.luminance()
            });
            let (found, squared) = over.refined(2e-4 * truth / (32f64).sqrt());
            assert!((found - truth).abs() < 2e-4 * truth, "{found} {truth}");
            assert!((found - truth).abs() < 10.0 * squared.sqrt(), "{found} {truth} {squared}");
            assert!(count.get() < 500, "{count:?}");
        }
    }
}

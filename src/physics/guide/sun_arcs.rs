//! Sunlight at a point below a straight pipe, by integration along arcs of the opening from which the sun is visible.
//!
//! A straight pipe keeps the zenith angle, so that light of one zenith angle reaches a point from an arc of the opening around the point's
//! foot. Along the arc the azimuth outside is a smooth function except where the number of reflections changes; these places are found by
//! bisection, and the part of every interval that sees the solar disc by linear interpolation. Sampling directions instead would hit the
//! disc once in some hundred times: after n reflections the azimuth turns 2 n + 1 times as fast as at the arc.

use std::f64::consts::{PI, TAU};

use glam::{DVec2, DVec3};

use super::StraightGuide;
use super::sun_disc::{SunNode, sun_nodes};
use crate::geometry::cylinder::{LEAST_HALF_CHORD, cosine_of_incidence};
use crate::geometry::turn::{angle_between, unit_vector};
use crate::optics::Spectrum;
use crate::sky::Sun;

/// Number of steps along the arc of each zenith angle.
pub const STEPS: usize = 8;

/// Largest number of bisections of an interval in which the number of reflections changes or the azimuth is not linear.
const MOST_HALVINGS: u32 = 12;

/// Change of azimuth between two places, in radians, above which the interval is bisected.
const LARGEST_TURN: f64 = 0.3;

/// Change of azimuth, in radians, above which an interval that sees the sun in part is bisected, as the slope gives the visible part; four
/// half widths of the disc if that is more, up to [`LARGEST_TURN`].
const LARGEST_TURN_LIT: f64 = 0.01;

/// A point below the clear zone of a straight pipe.
#[derive(Clone, Copy, Debug)]
pub struct PointBelow<'a> {
    /// Pipe above the point.
    pub guide: &'a StraightGuide,
    /// Inner and outer radius of the clear zone in m.
    pub zone: (f64, f64),
    /// Depth below the opening in m, > 0.
    pub depth: f64,
    /// Horizontal position relative to the axis of the pipe, in m.
    pub foot: DVec2,
}

/// Illuminance of a point by the sun, and the number of rays computed for it.
#[derive(Clone, Copy, Debug)]
pub struct SunReceived<const C: usize> {
    /// Illuminance in lux.
    pub illuminance: Spectrum<C>,
    /// Number of rays up the pipe.
    pub rays: u64,
}

impl PointBelow<'_> {
    /// Returns the range of zenith angles in radians of light from the clear zone to the point.
    pub fn zenith_angles(&self) -> [f64; 2] {
        let distance = self.foot.length();
        [distance - self.zone.1, distance + self.zone.1].map(|reach| libm::atan2(reach.max(0.0), self.depth))
    }

    /// Computes the illuminance by the sun with a number of nodes on the disc, at a position in their intervals, as the sum of those of
    /// [`Self::of_node`].
    pub fn sunlight<const C: usize>(
        &self,
        sun: &Sun,
        nodes: (usize, f64),
        steps: (usize, f64),
        mut arrives: impl FnMut(DVec2, DVec3) -> Spectrum<C>,
    ) -> SunReceived<C> {
        let mut all = SunReceived { illuminance: Spectrum::ZERO, rays: 0 };
        for node in sun_nodes(sun, nodes, self.zenith_angles()) {
            let found = self.of_node(sun, node, steps, &mut arrives);
            all.illuminance += found.illuminance;
            all.rays += found.rays;
        }
        all
    }

    /// Computes the illuminance by the sun at one node of the disc, by a number of steps along the arc, the first one ending at a fraction
    /// (above 0, to 1) of a step. `arrives` returns the factor on light through a place of the opening, given from its centre, along a unit
    /// vector up from the point: the cosine at the receiver times the transmittance of the closure, and zero if the path is occluded.
    pub fn of_node<const C: usize>(
        &self,
        sun: &Sun,
        node: SunNode,
        steps: (usize, f64),
        mut arrives: impl FnMut(DVec2, DVec3) -> Spectrum<C>,
    ) -> SunReceived<C> {
        let distance = self.foot.length();
        let inward = if distance > 0.0 { -self.foot / distance } else { DVec2::X };
        let sun_azimuth = angle_between(inward, sun.direction.truncate());
        let reach = self.depth * libm::tan(node.zenith_angle);
        // half the angle of the arc of this radius around the point's foot that lies within a circle around the axis
        let half_arc = |radius: f64| {
            if reach + distance <= radius {
                PI
            } else if reach >= distance + radius || distance >= reach + radius {
                0.0
            } else {
                let cosine = (reach * reach + distance * distance - radius * radius) / (2.0 * reach * distance);
                libm::acos(cosine.clamp(-1.0, 1.0))
            }
        };
        let (near, far) = (if self.zone.0 > 0.0 { half_arc(self.zone.0) } else { 0.0 }, half_arc(self.zone.1));
        if far <= near {
            return SunReceived { illuminance: Spectrum::ZERO, rays: 0 };
        }
        let (sin, cos) = libm::sincos(node.zenith_angle);
        let half_azimuth = node.half_azimuth;
        let mut arc =
            Arc { guide: self.guide, reach, foot: self.foot, inward, sin, cos, sun_azimuth, half_azimuth, rays: 0 };
        let mut sum = Spectrum::ZERO;
        let mut lit = |arc: &Arc, VisibleArc { angle, length, bounces }: VisibleArc| {
            let (offset, direction) = arc.ray(angle);
            let mirrors = arc.mirrors::<C>(offset, direction, bounces);
            sum += arrives(offset, direction) * mirrors * length;
        };
        match near > 0.0 {
            true => {
                arc.for_each_lit(-far, -near, steps, &mut lit);
                arc.for_each_lit(near, far, steps, &mut lit);
            }
            false => arc.for_each_lit(-far, far, steps, &mut lit),
        }
        let collector = Spectrum::<C>::from_rgb(self.guide.collector_transmittance);
        let illuminance = sum * collector * (sin * node.step * sun.luminance_cd_m2());
        SunReceived { illuminance, rays: arc.rays }
    }
}

/// Arc of the opening from which light of one zenith angle reaches a point.
struct Arc<'a> {
    guide: &'a StraightGuide,
    reach: f64,
    foot: DVec2,
    inward: DVec2,
    sin: f64,
    cos: f64,
    /// Azimuth of the sun from `inward`, in radians.
    sun_azimuth: f64,
    half_azimuth: f64,
    rays: u64,
}

/// Direction outside the pipe of the light that passes one place of the arc to the point.
#[derive(Clone, Copy)]
struct Outside {
    angle: f64,
    /// Azimuth from the centre of the disc in radians, -pi..pi.
    azimuth: f64,
    bounces: f64,
    /// Sine of the angle between the ray and the radius where it meets the wall, seen along the axis.
    skew: f64,
    /// Number of chords after the first reflection; below 0 without any reflection.
    chords: f64,
}

/// Behaviour of the light along the arc between two places.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Course {
    /// No view of the disc from any place.
    Dark,
    /// Constant number of reflections.
    Smooth,
    /// Possible change of the number of reflections.
    Unknown,
}

/// A piece of the arc from which the sun is visible.
#[derive(Clone, Copy)]
struct VisibleArc {
    /// Angle of its middle along the arc, in radians.
    angle: f64,
    /// Length in radians.
    length: f64,
    bounces: f64,
}

impl Arc<'_> {
    /// Passes the pieces between two angles that see the disc to `lit`.
    fn for_each_lit(
        &mut self,
        from: f64,
        to: f64,
        (steps, shift): (usize, f64),
        lit: &mut impl FnMut(&Self, VisibleArc),
    ) {
        let step = (to - from) / steps as f64;
        let mut before = self.outside(from);
        for number in 0..=steps {
            let end = (from + (number as f64 + shift) * step).min(to);
            if end > before.angle {
                let next = self.outside(end);
                self.between(before, next, MOST_HALVINGS, lit);
                before = next;
            }
        }
    }

    /// Returns the place of the opening at an angle of the arc, and the direction from the point toward it.
    fn ray(&self, angle: f64) -> (DVec2, DVec3) {
        let along = unit_vector(angle).rotate(self.inward);
        (self.foot + along * self.reach, (along * self.sin).extend(self.cos))
    }

    /// Follows the ray from a place of the arc up the pipe in projection along the axis: by equal chords, each reflection turning it by pi
    /// + 2 asin(s).
    fn outside(&mut self, angle: f64) -> Outside {
        self.rays += 1;
        let radius = self.guide.radius;
        let along = unit_vector(angle).rotate(self.inward);
        let skew = (along.perp_dot(self.foot) / radius).clamp(-1.0, 1.0);
        let half_chord = (1.0 - skew * skew).sqrt();
        let to_wall = radius * half_chord - (self.reach + self.foot.dot(along));
        let chords = (self.guide.length * self.sin / self.cos - to_wall) / (2.0 * radius * half_chord);
        // along the wall the number of chords has no bound
        let bounces = if half_chord < LEAST_HALF_CHORD { f64::INFINITY } else { (chords.floor() + 1.0).max(0.0) };
        let turn = if bounces > 0.0 && bounces.is_finite() { bounces * (PI + 2.0 * libm::asin(skew)) } else { 0.0 };
        let azimuth = angle + turn - self.sun_azimuth;
        Outside { angle, azimuth: azimuth - TAU * (azimuth / TAU).round(), bounces, skew, chords }
    }

    /// Classifies the arc between two places as certainly dark, smooth, or unknown.
    ///
    /// In projection along the axis, s = (d / R) sin(v - v_0), d the distance of the point from the axis; the number of chords after the
    /// first reflection is g = (L tan(theta) - distance to the wall) / (2 R c), c = cos(asin s), and the azimuth is v + n (pi - 2 asin s),
    /// n the whole number above g. So between two places s changes by at most (d / R) dv, g by (d / R) (1 + s / c) / (2 c) + g s (d / R) /
    /// c^2 times dv, and where n is constant the azimuth by 1 + 2 n (d / R) / c times dv, with the largest s and the least c in between.
    fn course(&self, a: Outside, b: Outside) -> Course {
        let length = b.angle - a.angle;
        let eccentricity = self.foot.length() / self.guide.radius;
        let skew = a.skew.abs().max(b.skew.abs()) + eccentricity * length;
        if skew >= 1.0 {
            return Course::Unknown;
        }
        let cosine = (1.0 - skew * skew).sqrt();
        let chords = a.chords.abs().max(b.chords.abs()) + 1.0;
        let per_angle =
            eccentricity * (1.0 + skew / cosine) / (2.0 * cosine) + chords * skew * eccentricity / (cosine * cosine);
        let grown = per_angle * length;
        let stays = (a.chords - grown).max(-1.0).floor() == (a.chords + grown).max(-1.0).floor();
        let jumps_once = grown < 1.0 && (a.bounces - b.bounces).abs() == 1.0;
        let turn = length * (1.0 + 2.0 * a.bounces.max(b.bounces) * eccentricity / cosine);
        if (stays || jumps_once) && a.azimuth.abs().min(b.azimuth.abs()) - turn > self.half_azimuth {
            Course::Dark
        } else if stays {
            Course::Smooth
        } else {
            Course::Unknown
        }
    }

    fn between(&mut self, a: Outside, b: Outside, halvings: u32, lit: &mut impl FnMut(&Self, VisibleArc)) {
        let length = b.angle - a.angle;
        let (low, high) =
            (a.azimuth.min(b.azimuth).max(-self.half_azimuth), a.azimuth.max(b.azimuth).min(self.half_azimuth));
        let turn = b.azimuth - a.azimuth;
        let is_lit = low <= high;
        let largest =
            if is_lit { LARGEST_TURN_LIT.max(4.0 * self.half_azimuth).min(LARGEST_TURN) } else { LARGEST_TURN };
        let course = self.course(a, b);
        if course == Course::Dark {
            return;
        }
        if course == Course::Smooth && turn.abs() < largest {
            if is_lit {
                let (middle, fraction) = match turn {
                    0.0 => (0.5, 1.0),
                    _ => ((0.5 * (low + high) - a.azimuth) / turn, (high - low) / turn.abs()),
                };
                lit(
                    self,
                    VisibleArc { angle: a.angle + middle * length, length: fraction * length, bounces: a.bounces },
                );
            }
            return;
        }
        if halvings == 0 {
            for end in [a, b].into_iter().filter(|end| end.azimuth.abs() <= self.half_azimuth) {
                lit(self, VisibleArc { angle: end.angle, length: 0.5 * length, bounces: end.bounces });
            }
            return;
        }
        let middle = self.outside(0.5 * (a.angle + b.angle));
        self.between(a, middle, halvings - 1, lit);
        self.between(middle, b, halvings - 1, lit);
    }

    fn mirrors<const C: usize>(&self, offset: DVec2, direction: DVec3, bounces: f64) -> Spectrum<C> {
        let cosine = || cosine_of_incidence(self.guide.radius, offset.extend(0.0), direction);
        self.guide.reflectance.power(cosine, bounces)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::guide::transmittance::beam_transmission;
    use crate::sky::direction;

    /// Checks that the flux on a level plane below a pipe is the flux that the pipe passes: over high and low suns and many reflections.
    #[test]
    fn the_plane_receives_what_the_pipe_passes() {
        for (altitude_deg, length) in [(75.0, 0.6), (50.0, 1.0), (35.0, 3.0)] {
            let up = direction(f64::to_radians(altitude_deg), 2.0);
            let sun = Sun { direction: up, normal_illuminance_lux: 50_000.0 };
            let (radius, reflectance, depth) = (0.127, 0.9, 1.5);
            let collector_transmittance = [0.8; 3];
            let guide = StraightGuide { radius, length, reflectance: [reflectance; 3].into(), collector_transmittance };
            let reach = depth / up.z * up.truncate().length() + radius;
            let cells = 160;
            let cell = 2.0 * reach / f64::from(cells);
            let mut flux = 0.0;
            for (i, k) in (0..cells).flat_map(|i| (0..cells).map(move |k| (i, k))) {
                let foot = DVec2::new(f64::from(i) + 0.5, f64::from(k) + 0.5) * cell - reach;
                let point = PointBelow { guide: &guide, zone: (0.0, radius), depth, foot };
                let found = point.sunlight::<1>(&sun, (8, 0.5), (8, 1.0), |_, toward| Spectrum([toward.z]));
                flux += found.illuminance.0[0] * cell * cell;
            }
            let tangent = up.truncate().length() / up.z;
            let passed = beam_transmission(length / (2.0 * radius), tangent, reflectance);
            let expected = 0.8 * passed * 50_000.0 * up.z * PI * radius * radius;
            assert!((flux / expected - 1.0).abs() < 5e-3, "{altitude_deg}: {flux} {expected}");
        }
    }
}

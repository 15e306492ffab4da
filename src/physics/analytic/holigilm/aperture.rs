//! Light that reaches a sensor unscattered through one opening, followed backward into sky and sun.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use glam::{DVec2, DVec3};

use crate::analytic::Tube;
use crate::geometry::cylinder::traverse;
use crate::geometry::disc::disc_irradiance;
use crate::geometry::turn::unit_vector;
use crate::guide::{End, Guide, StraightGuide, Transit};
use crate::optics::Spectrum;
use crate::sampling::{CONES_SHARE, Key, NestedCones, PathRandom, Replicate, warp};
use crate::sky::sun::HALF_ANGLE;
use crate::sky::{Sky, Sun};

/// Times that an interval between two nodes is halved where the number of reflections changes within.
const MOST_HALVINGS: u32 = 12;

/// Turn between two nodes, in radians, above which the interval is halved too.
const LARGEST_TURN: f64 = 0.3;

/// A sensor that looks up, below the clear zone of a tube.
pub(super) struct Aperture<'a> {
    pub tube: &'a Tube,
    pub sensor: DVec3,
    /// Inner and outer radius of the clear zone.
    pub zone: (f64, f64),
}

/// Zenith angles over the solar disc.
#[derive(Clone, Copy, Debug)]
pub(super) struct SunNode {
    pub zenith_angle: f64,
    /// Step of the zenith angle, radians.
    pub step: f64,
    /// Half of the azimuths that the disc covers at this zenith angle, radians.
    pub half_azimuth: f64,
}

/// Midpoints of `count` intervals that crowd toward the disc's upper and lower rim; none below the horizon.
pub(super) fn sun_nodes(sun: &Sun, count: usize) -> Vec<SunNode> {
    let centre = libm::atan2(sun.direction.truncate().length(), sun.direction.z);
    let half_squared = libm::sin(0.5 * HALF_ANGLE).powi(2);
    (0..count)
        .filter_map(|k| {
            let t = PI * ((k as f64 + 0.5) / count as f64 - 0.5);
            let zenith_angle = centre + HALF_ANGLE * libm::sin(t);
            if !(zenith_angle > 0.0 && zenith_angle < FRAC_PI_2) {
                return None;
            }
            // sin^2 of half the azimuth at which the disc ends, free of cancellation
            let across = half_squared - libm::sin(0.5 * (zenith_angle - centre)).powi(2);
            let share = across / (libm::sin(zenith_angle) * libm::sin(centre));
            let half_azimuth = if share >= 1.0 { PI } else { 2.0 * libm::asin(share.max(0.0).sqrt()) };
            Some(SunNode { zenith_angle, step: HALF_ANGLE * libm::cos(t) * PI / count as f64, half_azimuth })
        })
        .collect()
}

impl Aperture<'_> {
    /// Sky light in lux from `count` points of one replicate.
    ///
    /// Points of the zone are uniform; the mean of luminance times transmission, weighted by the geometry factor, is
    /// multiplied by the factor's exact integral: where nothing is lost and the sky is uniform, the result is exact.
    pub fn sky(&self, sky: &Sky, stream: Key, count: u64) -> f64 {
        let (inner, outer) = self.zone;
        let depth = self.tube.origin.z - self.sensor.z;
        let offset = (self.sensor - self.tube.origin).truncate().length();
        let mut random = PathRandom::new(stream);
        let (mut weights, mut sum) = (0.0, 0.0);
        for number in 0..count {
            let (replicate, index) = Replicate::of(stream, number);
            let [u, v, ..] = replicate.point(index, 0);
            let local = warp::annulus([u, v], inner, outer).extend(0.0);
            let way = self.tube.origin + local - self.sensor;
            let squared = way.length_squared();
            let geometry = depth * depth / (squared * squared);
            weights += geometry;
            let transit: Transit<1> = self.tube.guide.up(local, way / squared.sqrt(), &mut random);
            if transit.end == End::Top {
                sum += geometry * transit.weight().luminance() * sky.luminance(transit.direction);
            }
        }
        let disc = |radius: f64| disc_irradiance(radius, depth, offset).vertical;
        let factor = disc(outer) - if inner > 0.0 { disc(inner) } else { 0.0 };
        PI * factor * sum / weights
    }

    /// Sunlight in lux through a straight tube, on `nodes` of the disc with `steps` directions each; and the rays taken.
    ///
    /// A straight tube keeps the zenith angle, so the light comes from an arc of the opening for each zenith angle of the
    /// disc. Along the arc the azimuth outside changes smoothly between the points where the number of reflections
    /// changes; these are found by halving, and the share of every interval that sees the disc by linear interpolation.
    pub fn sun(&self, guide: &StraightGuide, sun: &Sun, nodes: &[SunNode], steps: usize) -> (f64, u64) {
        let depth = self.tube.origin.z - self.sensor.z;
        let foot = (self.sensor - self.tube.origin).truncate();
        let distance = foot.length();
        let inward = if distance > 0.0 { -foot / distance } else { DVec2::X };
        let sun_azimuth = libm::atan2(sun.direction.y, sun.direction.x);
        let (mut lux, mut rays) = (0.0, 0);
        for node in nodes {
            let reach = depth * libm::tan(node.zenith_angle);
            // half the arc of this radius around the sensor's foot that lies within a circle around the tube's axis
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
                continue;
            }
            let (sin, cos) = libm::sincos(node.zenith_angle);
            let mut arc =
                Arc { guide, reach, foot, inward, sin, cos, sun_azimuth, half_azimuth: node.half_azimuth, rays: 0 };
            let pieces = if near > 0.0 { vec![(-far, -near), (near, far)] } else { vec![(-far, far)] };
            let seen: f64 = pieces.into_iter().map(|(from, to)| arc.seen(from, to, steps)).sum();
            lux += seen * sin * cos * node.step;
            rays += arc.rays;
        }
        let collector = Spectrum::<1>::from_rgb(guide.collector_transmittance).luminance();
        (lux * sun.luminance_cd_m2() * collector, rays)
    }
}

/// The points of the opening that a sensor sees at one zenith angle.
struct Arc<'a> {
    guide: &'a StraightGuide,
    reach: f64,
    foot: DVec2,
    inward: DVec2,
    sin: f64,
    cos: f64,
    sun_azimuth: f64,
    half_azimuth: f64,
    rays: u64,
}

/// Origin outside of the light that a point of the arc sends to the sensor.
#[derive(Clone, Copy)]
struct Outside {
    angle: f64,
    /// Azimuth from the middle of the disc, -pi..pi.
    azimuth: f64,
    bounces: f64,
}

impl Arc<'_> {
    /// The arc in radians on which the disc is seen, times the share of light that the mirrors leave.
    fn seen(&mut self, from: f64, to: f64, steps: usize) -> f64 {
        let mut before = self.outside(from);
        let mut sum = 0.0;
        for step in 1..=steps {
            let next = self.outside(from + (to - from) * step as f64 / steps as f64);
            sum += self.between(before, next, MOST_HALVINGS);
            before = next;
        }
        sum
    }

    fn outside(&mut self, angle: f64) -> Outside {
        self.rays += 1;
        let along = unit_vector(angle).rotate(self.inward);
        let local = (self.foot + along * self.reach).extend(0.0);
        let direction = (along * self.sin).extend(self.cos);
        let passage = traverse(self.guide.radius, local, direction, self.guide.length);
        let azimuth = libm::atan2(passage.direction.y, passage.direction.x) - self.sun_azimuth;
        Outside { angle, azimuth: (azimuth + PI).rem_euclid(TAU) - PI, bounces: passage.bounces }
    }

    fn between(&mut self, a: Outside, b: Outside, halvings: u32) -> f64 {
        let smooth = a.bounces == b.bounces && (b.azimuth - a.azimuth).abs() < LARGEST_TURN;
        let length = b.angle - a.angle;
        if smooth {
            let share = self.share(a.azimuth, b.azimuth);
            return if share > 0.0 { length * share * self.mirrors(a.bounces) } else { 0.0 };
        }
        if halvings == 0 {
            let at = |end: Outside| self.share(end.azimuth, end.azimuth) * self.mirrors(end.bounces);
            return 0.5 * length * (at(a) + at(b));
        }
        let middle = self.outside(0.5 * (a.angle + b.angle));
        self.between(a, middle, halvings - 1) + self.between(middle, b, halvings - 1)
    }

    fn mirrors(&self, bounces: f64) -> f64 {
        self.guide.reflectance.power::<1>(|| 1.0, bounces).0[0]
    }

    /// Share of azimuths between two that lie on the disc.
    fn share(&self, a: f64, b: f64) -> f64 {
        let half = self.half_azimuth;
        let (low, high) = (a.min(b), a.max(b));
        if high == low {
            return if low.abs() <= half { 1.0 } else { 0.0 };
        }
        ((high.min(half) - low.max(-half)) / (high - low)).max(0.0)
    }
}

/// Illuminance in lux at a point of the opening's upper side, from the sky through the guide: `count` points of one
/// replicate.
///
/// `point` is measured in m from the centre of the opening. E = integral of L R^n cos(theta), L the luminance of the sky
/// where the ray that goes up leaves the guide after n mirrors of reflectance R; `stream` has its random numbers.
pub fn illuminance_above(guide: &Guide, sky: &Sky, point: DVec2, stream: Key, count: u64) -> f64 {
    let mut random = PathRandom::new(stream);
    let cones = guide.cones();
    let sum: f64 = (0..count)
        .map(|number| {
            let (replicate, index) = Replicate::of(stream, number);
            let [u, v, ..] = replicate.point(index, 0);
            luminance_from(guide, sky, point, upward([u, v], cones.as_ref()), &mut random)
        })
        .sum();
    PI * sum / count as f64
}

/// Direction up by a point of the unit square, and its weight against cosine-distributed ones: these, or most of them from the
/// cones of a guide that has any.
pub(super) fn upward([u, v]: [f64; 2], cones: Option<&NestedCones>) -> (DVec3, f64) {
    let Some(cones) = cones else { return (warp::cosine_hemisphere([u, v]), 1.0) };
    let direction = if u < CONES_SHARE {
        cones.sample([u / CONES_SHARE, v])
    } else {
        warp::cosine_hemisphere([(u - CONES_SHARE) / (1.0 - CONES_SHARE), v])
    };
    let by_cosine = direction.z / PI;
    (direction, by_cosine / ((1.0 - CONES_SHARE) * by_cosine + CONES_SHARE * cones.density(direction)))
}

/// Luminance in cd/m2 that arrives at a point of the opening's upper side from a direction, times the direction's weight; zero
/// from where the guide sends the ray back.
pub(super) fn luminance_from(
    guide: &Guide,
    sky: &Sky,
    point: DVec2,
    (direction, weight): (DVec3, f64),
    random: &mut PathRandom,
) -> f64 {
    let transit: Transit<1> = guide.up(point.extend(0.0), direction, random);
    if transit.end == End::Top { weight * transit.weight().luminance() * sky.luminance(transit.direction) } else { 0.0 }
}

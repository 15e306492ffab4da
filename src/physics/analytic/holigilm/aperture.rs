//! Light that reaches a sensor unscattered through one opening, traced backward to sky and sun.

use std::cell::Cell;
use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::analytic::Tube;
use crate::geometry::disc::disc_irradiance;
use crate::guide::sun_arcs::{PointBelow, STEPS};
use crate::guide::sun_disc::{OverDisc, SunDisc};
use crate::guide::{End, Guide, StraightGuide, Transit};
use crate::optics::Spectrum;
use crate::sampling::{CONES_SHARE, Key, NestedCones, PathRandom, Replicate, warp};
use crate::sky::{Sky, Sun};

/// A sensor that looks up, below the clear zone of a tube.
pub(super) struct Aperture<'a> {
    pub tube: &'a Tube,
    pub sensor: DVec3,
    /// Inner and outer radius of the clear zone, in m.
    pub zone: (f64, f64),
}

impl Aperture<'_> {
    /// Computes the sky light in lux from `count` points of one replicate.
    ///
    /// Points of the zone are uniform; the mean of luminance times transmission, weighted by the geometry factor, is multiplied by the
    /// exact integral of that factor: where nothing is lost and the sky is uniform, the result is exact.
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
            let to_opening = self.tube.origin + local - self.sensor;
            let squared = to_opening.length_squared();
            let geometry = depth * depth / (squared * squared);
            weights += geometry;
            let transit: Transit<1> = self.tube.guide.up(local, to_opening / squared.sqrt(), &mut random);
            if transit.end == End::Top {
                sum += geometry * transit.weight().luminance() * sky.luminance(transit.direction);
            }
        }
        let disc = |radius: f64| disc_irradiance(radius, depth, offset).vertical;
        let factor = disc(outer) - if inner > 0.0 { disc(inner) } else { 0.0 };
        PI * factor * sum / weights
    }

    /// Computes the sunlight in lux through a straight tube with about this relative error, from a number of intervals of the disc on; also
    /// returns the estimate of its error and the number of rays.
    pub fn sun(&self, guide: &StraightGuide, sun: &Sun, tolerance: f64, intervals: usize) -> (f64, f64, u64) {
        let below = self.sensor - self.tube.origin;
        let point = PointBelow { guide, zone: self.zone, depth: -below.z, foot: below.truncate() };
        let Some(disc) = SunDisc::within(sun, point.zenith_angles()) else { return (0.0, 0.0, 0) };
        let rays = Cell::new(0);
        let over = OverDisc::new(disc, intervals, |node, step| {
            let arrives = |_, direction: DVec3| Spectrum::<1>([direction.z]);
            let found = point.of_node(sun, node, (STEPS, 1.0 - step), arrives);
            rays.set(rays.get() + found.rays);
            found.illuminance.luminance()
        });
        let (lux, squared) = over.refined(tolerance * over.first() / (intervals as f64).sqrt());
        (lux, squared.sqrt(), rays.get())
    }
}

/// Computes the illuminance in lux at a point of the opening's upper side, from the sky through the guide: `count` points of one
/// replicate.
///
/// `point` is measured in m from the centre of the opening. E = integral of L R^n cos(theta), L the luminance of the sky in the direction
/// in which the ray traced upward leaves the guide after n reflections of reflectance R; `stream` keys its random numbers.
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

/// Samples an upward direction by a point of the unit square, and returns its weight against a cosine distribution: from that
/// distribution, or, for a guide with cones, mostly from the cones.
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

/// Computes the luminance in cd/m2 that arrives at a point of the opening's upper side from a direction, times the direction's weight;
/// zero where the guide sends the ray back.
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

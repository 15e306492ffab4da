//! Light that passes a closure unscattered, followed backward: from a sensor through the opening and up the guide.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::guide::sun_arcs::PointBelow;
use crate::guide::{End, Guide, RayCount, Transit};
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::close_points::is_near_opening;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Replicate, Stream, warp};
use crate::scene::Sensor;
use crate::sky::{OutsidePart, Sun};
use crate::traceable::{TraceableScene, TraceableTube, opening_weight};

/// Number of backward rays toward the sky through each of the nearest openings, per sensor and pass.
const SKY_RAYS: PassSize = PassSize { for_one_percent: 16.0, growth: 1.0, fewest: 4.0, most: 256.0 };

/// Number of openings that count as nearest to a sensor: where there are more, most of them send it little.
const NEAREST: usize = 4;

/// Number of zenith angles of the sun's disc per sensor and pass: where an edge cuts the visible disc, the error depends on it.
const SUN_NODES: PassSize = PassSize { for_one_percent: 8.0, growth: 0.3, fewest: 4.0, most: 32.0 };

/// Number of steps along the arc of each zenith angle.
const SUN_STEPS: usize = 8;

/// Number of rays toward the sky for each zenith angle where the number of rays is given, and the largest number of zenith angles then.
const RAYS_PER_NODE: u64 = 4;
const MOST_NODES_BY_RAYS: u64 = 16;

/// Numbers of rays and zenith angles by which a sensor looks up through openings in a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LooksUp {
    sky_rays: f64,
    sun_nodes: usize,
}

impl LooksUp {
    /// Chooses the numbers for a relative standard error `target`.
    pub fn new(target: f64) -> Self {
        Self { sky_rays: SKY_RAYS.of(target, 1.0), sun_nodes: SUN_NODES.of(target, 1.0).round() as usize }
    }

    /// Chooses the numbers for about `rays` rays through each of the nearest openings.
    pub fn by_rays(rays: u64) -> Self {
        let sun_nodes = (rays / RAYS_PER_NODE).clamp(SUN_NODES.fewest as u64, MOST_NODES_BY_RAYS) as usize;
        Self { sky_rays: (rays as f64).min(SKY_RAYS.most), sun_nodes }
    }

    /// Divides the rays of a sensor among openings, by the light that each would send it.
    fn sky_rays_toward(self, openings: &[(usize, Backward)]) -> Vec<f64> {
        let weights: Vec<f64> = openings.iter().map(|(_, backward)| backward.weight()).collect();
        let (total, all) = (self.sky_rays * openings.len().min(NEAREST) as f64, weights.iter().sum::<f64>());
        weights.into_iter().map(|weight| total * weight / all).collect()
    }
}

/// Computes the light that reaches a sensor unscattered through the closures of the tubes that `by` selects, in lx, and the number of rays.
pub fn unscattered(
    scene: &TraceableScene,
    sensor: Sensor,
    stream: Key,
    looks_up: LooksUp,
    by: impl Fn(&TraceableTube) -> bool,
) -> (f64, RayCount) {
    let (mut lux, mut traced) = (0.0, RayCount::default());
    let all = openings(scene, sensor, |tube| tube.is_daylit() && by(tube));
    let wanted = looks_up.sky_rays_toward(&all);
    for ((number, backward), wanted) in all.iter().zip(wanted) {
        let stream = stream.child(*number as u64);
        let (sky, sky_rays) = backward.sky(stream.stream(Stream::SkyFromBelow, 0), wanted);
        let sun = backward.tube.sun;
        let of_sun = |sun: &Sun| backward.sun(sun, stream.stream(Stream::SunFromBelow, 0), looks_up.sun_nodes);
        let (sun, sun_rays) = sun.as_ref().map(of_sun).unwrap_or_default();
        lux += sky + sun;
        traced += sky_rays + sun_rays;
    }
    (lux, traced)
}

/// Computes the light of a sun that reaches a sensor unscattered through straight tubes, in lx, and the number of rays.
pub fn unscattered_sun(
    scene: &TraceableScene,
    sensor: Sensor,
    stream: Key,
    looks_up: LooksUp,
    sun: &Sun,
) -> (f64, RayCount) {
    let (mut lux, mut traced) = (0.0, RayCount::default());
    for (number, backward) in openings(scene, sensor, |_| true) {
        let stream = stream.child(number as u64).stream(Stream::SunFromBelow, 0);
        let Some(sun) = backward.tube.before(*sun) else { continue };
        let (of_tube, rays) = backward.sun(&sun, stream, looks_up.sun_nodes);
        lux += of_tube;
        traced += rays;
    }
    (lux, traced)
}

/// Follows rays from a sensor through the clear zones of openings to the outside. Passes the part that each meets, the illuminance in lx per
/// cd/m2 of the luminance to which that of this part is relative, and the unit vector toward it to `found`; returns the number of rays.
pub fn toward_outside(
    scene: &TraceableScene,
    sensor: Sensor,
    stream: Key,
    looks_up: LooksUp,
    mut found: impl FnMut(OutsidePart, f64, DVec3),
) -> RayCount {
    let all = openings(scene, sensor, |_| true);
    let wanted = looks_up.sky_rays_toward(&all);
    let of_tube = |((number, backward), wanted): (&(usize, Backward), f64)| {
        let stream = stream.child(*number as u64).stream(Stream::SkyFromBelow, 0);
        backward.toward_sky(stream, wanted, |per_luminance, toward| {
            if let Some((part, share)) = backward.tube.outside(toward) {
                found(part, share * per_luminance, toward);
            }
        })
    };
    all.iter().zip(wanted).map(of_tube).sum()
}

/// Finds the tubes that `by` selects whose clear zones may light a sensor; none inside solids.
fn openings(
    scene: &TraceableScene,
    Sensor { position: sensor, normal }: Sensor,
    by: impl Fn(&TraceableTube) -> bool,
) -> Vec<(usize, Backward<'_>)> {
    if scene.is_in_solid(sensor) {
        return Vec::new();
    }
    let mut openings = Vec::new();
    for (number, tube) in scene.tubes.iter().enumerate().filter(|(_, tube)| tube.frame.depth(sensor) > 0.0 && by(tube))
    {
        if let Some(zone) = tube.specular_zone() {
            openings.push((number, Backward { scene, tube, sensor, normal, zone }));
        }
    }
    openings
}

/// Computes the sky light that reaches a point of a surface straight through clear closures, in lx, by one ray to each tube, and the number
/// of rays.
pub fn sky_through_openings(
    scene: &TraceableScene,
    (position, normal): (DVec3, DVec3),
    samples: &mut PathSamples,
) -> (Spectrum<3>, RayCount) {
    let (mut lux, mut traced) = (Spectrum::ZERO, RayCount::default());
    for tube in scene.tubes.iter().filter(|tube| tube.frame.depth(position) > 0.0) {
        let Some(sky) = &tube.sky else { continue };
        let Some(zone) = tube.specular_zone() else { continue };
        let backward = Backward { scene, tube, sensor: position, normal, zone };
        let (inner, outer) = zone;
        let area = PI * (outer * outer - inner * inner);
        let point = tube.at(warp::annulus(samples.pair(), inner, outer));
        if let Some((weight, toward)) = backward.through(point, &mut samples.random, &mut traced) {
            lux += weight * (area * sky.luminance(toward));
        }
    }
    (lux, traced)
}

/// Light that reaches a sensor unscattered through one tube, followed backward.
struct Backward<'a> {
    scene: &'a TraceableScene,
    tube: &'a TraceableTube,
    sensor: DVec3,
    /// Unit normal of the sensor.
    normal: DVec3,
    /// Inner and outer radius of the diffuser's clear zone in m.
    zone: (f64, f64),
}

impl Backward<'_> {
    /// Estimates the relative contribution of a uniformly bright opening to the sensor: more than 0 wherever it sends any light.
    fn weight(&self) -> f64 {
        opening_weight(&self.tube.frame, self.zone.1, self.sensor, self.normal) * self.zone.1 * self.zone.1
    }

    /// Computes the sky light that reaches the sensor, with [`Self::toward_sky`].
    fn sky(&self, stream: Key, wanted: f64) -> (f64, RayCount) {
        let Some(sky) = &self.tube.sky else { return (0.0, RayCount::default()) };
        let mut lux = 0.0;
        let rays =
            self.toward_sky(stream, wanted, |per_luminance, toward| lux += per_luminance * sky.luminance(toward));
        (lux, rays)
    }

    /// Follows rays to uniform points of the clear zone and on to the sky, and passes the illuminance per luminance in the direction of each
    /// to `found`. Very near to the opening the important ones are rare and bright: there
    /// every other ray takes a cosine-distributed direction instead, and both share the light by the balance heuristic (Veach and Guibas
    /// 1995).
    ///
    /// `wanted` is the mean number of rays; a fractional number is rounded up or down at random.
    fn toward_sky(&self, stream: Key, wanted: f64, mut found: impl FnMut(f64, DVec3)) -> RayCount {
        let (inner, outer) = self.zone;
        let area = PI * (outer * outer - inner * inner);
        let near = is_near_opening(self.scene, self.tube, self.sensor);
        let mut random = PathRandom::new(stream);
        // as many of both kinds
        let wanted = if near { 2.0 * (0.5 * wanted).ceil() } else { wanted };
        let whole = wanted == wanted.floor();
        let count = if whole { wanted as u64 } else { (wanted + random.uniform()) as u64 };
        let mut rays = RayCount::default();
        for number in 0..count {
            let (replicate, index) = Replicate::of(stream, number);
            let [u, v, ..] = replicate.point(index, 0);
            let point = match near && number % 2 == 1 {
                true => self.point_by_cosine([u, v]),
                false => Some(self.tube.at(warp::annulus([u, v], inner, outer))),
            };
            let Some(point) = point else { continue };
            if let Some((weight, toward)) = self.through(point, &mut random, &mut rays) {
                // combined density of both kinds of rays, relative to uniform points of the zone
                let fraction = if near { 2.0 / (1.0 + self.cosine_density(point) * area) } else { 1.0 };
                found(fraction * weight.luminance() * area / wanted, toward);
            }
        }
        rays
    }

    /// Returns the point of the clear zone in a cosine-distributed direction, if this meets the zone.
    fn point_by_cosine(&self, uniform: [f64; 2]) -> Option<DVec3> {
        let direction = warp::around(self.normal, warp::cosine_hemisphere(uniform));
        let frame = &self.tube.frame;
        let rise = frame.up(direction);
        if rise <= 0.0 {
            return None;
        }
        let point = frame.onto(self.sensor + direction * (frame.depth(self.sensor) / rise));
        let radius = self.tube.away(point).length();
        (self.zone.0..self.zone.1).contains(&radius).then_some(point)
    }

    /// Returns the density per m2 of points in cosine-distributed directions.
    fn cosine_density(&self, point: DVec3) -> f64 {
        let to_point = point - self.sensor;
        let distance_squared = to_point.length_squared();
        to_point.dot(self.normal).max(0.0) * self.tube.frame.up(to_point) / (PI * distance_squared * distance_squared)
    }

    /// Computes the sunlight through a straight pipe, by the arcs of the opening in which the disc is visible, at random zenith angles of
    /// it.
    fn sun(&self, sun: &Sun, stream: Key, nodes: usize) -> (f64, RayCount) {
        let Guide::Straight(guide) = &self.tube.guide else { return (0.0, RayCount::default()) };
        let below = self.sensor - self.tube.frame.origin;
        let point = PointBelow { guide, zone: self.zone, depth: -below.z, foot: below.truncate() };
        let [node, step] = PathRandom::new(stream).uniform2();
        let arrives = |offset: DVec2, direction: DVec3| -> Spectrum<3> {
            let place = self.tube.at(offset);
            let cosine = direction.dot(self.normal);
            match self.tube.closure_at(place).unscattered() {
                Some(transmittance) if cosine > 0.0 && self.scene.visible(self.sensor, None, place, None) => {
                    transmittance * cosine
                }
                _ => Spectrum::ZERO,
            }
        };
        let found = point.sunlight(sun, (nodes, node), (SUN_STEPS, 1.0 - step), arrives);
        let rays = RayCount { followed: found.rays, ..RayCount::default() };
        (found.illuminance.luminance(), rays)
    }

    /// Follows a ray from the sensor through `point` of the opening: returns geometry factor times transmittances, and the direction
    /// outside.
    fn through(&self, point: DVec3, random: &mut PathRandom, rays: &mut RayCount) -> Option<(Spectrum<3>, DVec3)> {
        let transmittance: Spectrum<3> = self.tube.closure_at(point).unscattered()?;
        let to_point = point - self.sensor;
        let distance_squared = to_point.length_squared();
        let direction = to_point / distance_squared.sqrt();
        if !self.scene.visible(self.sensor, None, point, None) {
            return None;
        }
        let transit: Transit<3> = self.tube.up(point, direction, random);
        *rays += 1;
        *rays += transit.ray_count();
        if transit.end != End::Top {
            return None;
        }
        let cosines = direction.dot(self.normal).max(0.0) * self.tube.frame.up(direction);
        Some((transit.weight() * transmittance * (cosines / distance_squared), transit.direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::disc::far_disc_illuminance;
    use crate::optics::{Collector, Diffuser};
    use crate::scene::{Daylight, Face, OpeningPlane, Segment, StraightOrBent, Tube, TubeShape};
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{CieType, Sky, SkyDistribution};
    use crate::statistics::Moments;
    use crate::traceable::test_rooms::{compiled, empty};

    /// Checks that below a lossless pipe a clear opening is as bright as a uniform sky: points that look up, sideways and askew get what a
    /// disc sends them in closed form, in every channel, within four standard errors.
    #[test]
    fn openings_light_surfaces_as_discs_do() {
        let (luminance, transmittance) = (3000.0, [0.9, 0.8, 0.5]);
        let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
        let sky = Some(Sky::new(distribution, luminance));
        let tube = Tube {
            face: Face::Ceiling as usize,
            plane: OpeningPlane::Level { drop_m: 0.0 },
            centre: DVec2::new(1.0, 1.2),
            opening_radius: 0.3,
            transition: None,
            shape: TubeShape::Cylinders(StraightOrBent {
                reflectance: [1.0; 3].into(),
                segments: vec![Segment { length_m: 1.0, tilt: 0.0, azimuth: 0.0 }],
                collector: Collector::Open,
                cut: None,
            }),
            diffuser: Diffuser::Clear { transmittance },
            surroundings: None,
        };
        let mut scene = empty(DVec3::new(3.0, 2.0, 2.5), None);
        scene.daylight = Some(Daylight { sky, sun: None, formula: ZenithFormula::GivenZenithLuminance });
        scene.tubes = vec![tube];
        let traceable = compiled(&scene);
        let (stream, mut number) = (Key::new(8), 0);
        for position in [DVec3::new(0.0, 0.4, 0.1), DVec3::new(0.1, 1.9, 1.5), DVec3::new(2.9, 0.3, 0.7)] {
            let away = tube_axis(&traceable) - position;
            let toward_axis = away.truncate().normalize().extend(0.0);
            for normal in [DVec3::Z, toward_axis, (toward_axis + 0.5 * DVec3::Z).normalize()] {
                let mut sums = [Moments::default(); 3];
                for _ in 0..4000 {
                    number += 1;
                    let mut samples = PathSamples::new(stream, number);
                    let (lux, rays) = sky_through_openings(&traceable, (position, normal), &mut samples);
                    assert!(rays.followed >= 2);
                    sums.iter_mut().zip(lux.0).for_each(|(sum, lux)| sum.push(lux));
                }
                let facing = [normal.z, normal.dot(toward_axis)];
                let factor = far_disc_illuminance(0.3, away.z, away.truncate().length(), facing);
                for (sum, transmittance) in sums.iter().zip(transmittance) {
                    let truth = PI * luminance * transmittance * factor;
                    assert!(
                        (sum.mean - truth).abs() <= 4.0 * sum.standard_error(),
                        "{position} {normal}: {truth} {sum:?}"
                    );
                }
            }
        }
    }

    fn tube_axis(scene: &TraceableScene) -> DVec3 {
        scene.tubes[0].frame.origin
    }
}

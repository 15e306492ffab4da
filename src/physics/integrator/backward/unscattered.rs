//! Light that passes a closure unscattered, followed backward: from a sensor through the opening and up the guide.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DVec2, DVec3};

use crate::geometry::turn::unit_vector;
use crate::guide::{End, Guide, RayCount, Transit};
use crate::integrator::photon::close_points::is_near_opening;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Replicate, Stream, warp};
use crate::scene::Sensor;
use crate::sky::sun::HALF_ANGLE;
use crate::traceable::{TraceableScene, TraceableTube};

/// Backward rays per sensor and pass, at most: toward the sky, and toward the sun.
const SKY_RAYS: u64 = 256;
const SUN_RAYS: u64 = 1024;

/// Light that reaches a sensor straight through closures of the tubes that `by` picks, in lux, by at most `rays`
/// rays to each tube, and the rays it took.
pub fn unscattered(
    scene: &TraceableScene,
    Sensor { position: sensor, normal }: Sensor,
    stream: Key,
    rays: u64,
    by: impl Fn(&TraceableTube) -> bool,
) -> (f64, RayCount) {
    let (mut lux, mut taken) = (0.0, RayCount::default());
    if scene.is_in_solid(sensor) {
        return (lux, taken);
    }
    for (number, tube) in scene.tubes.iter().enumerate().filter(|(_, tube)| tube.daylit && by(tube)) {
        let Some(zone) = tube.diffuser.specular_zone(tube.opening_radius) else { continue };
        if tube.origin.z <= sensor.z {
            continue;
        }
        let backward = Backward { scene, tube, sensor, normal, zone };
        let stream = stream.child(number as u64);
        let (sky, sky_rays) = backward.sky(stream.stream(Stream::SkyFromBelow, 0), rays.min(SKY_RAYS));
        let (sun, sun_rays) = backward.sun(stream.stream(Stream::SunFromBelow, 0), rays.min(SUN_RAYS));
        lux += sky + sun;
        taken += sky_rays + sun_rays;
    }
    (lux, taken)
}

/// Sky light that reaches a point of a surface straight through clear closures, in lx, by one ray to each tube, and the rays it took.
pub fn sky_through_openings(
    scene: &TraceableScene,
    (position, normal): (DVec3, DVec3),
    samples: &mut PathSamples,
) -> (Spectrum<3>, RayCount) {
    let (mut lux, mut taken) = (Spectrum::ZERO, RayCount::default());
    let Some(sky) = &scene.sky else { return (lux, taken) };
    for tube in scene.tubes.iter().filter(|tube| tube.daylit && tube.origin.z > position.z) {
        let Some(zone) = tube.diffuser.specular_zone(tube.opening_radius) else { continue };
        let backward = Backward { scene, tube, sensor: position, normal, zone };
        let (inner, outer) = zone;
        let area = PI * (outer * outer - inner * inner);
        let point = tube.origin + warp::annulus(samples.pair(), inner, outer).extend(0.0);
        if let Some((weight, toward)) = backward.through(point, &mut samples.random, &mut taken) {
            lux += weight * (area * sky.luminance(toward));
        }
    }
    (lux, taken)
}

/// Light that reaches a sensor unscattered through one tube, followed backward.
struct Backward<'a> {
    scene: &'a TraceableScene,
    tube: &'a TraceableTube,
    sensor: DVec3,
    /// Unit normal of what is lit.
    normal: DVec3,
    /// Inner and outer radius of the diffuser's clear zone.
    zone: (f64, f64),
}

impl Backward<'_> {
    /// Sky light: uniform points of the clear zone. Very near to the opening these are rare and bright: there every other ray takes a
    /// direction that the cosine demands instead, and both share the light by the balance heuristic (Veach and Guibas 1995).
    fn sky(&self, stream: Key, count: u64) -> (f64, RayCount) {
        let Some(sky) = &self.scene.sky else { return (0.0, RayCount::default()) };
        let (inner, outer) = self.zone;
        let area = PI * (outer * outer - inner * inner);
        let near = is_near_opening(self.scene, self.tube, self.sensor);
        let mut random = PathRandom::new(stream);
        let mut sum = 0.0;
        let mut rays = RayCount::default();
        for number in 0..count {
            let (replicate, index) = Replicate::of(stream, number);
            let [u, v, ..] = replicate.point(index, 0);
            let point = match near && number % 2 == 1 {
                true => self.point_by_cosine([u, v]),
                false => Some(self.tube.origin + warp::annulus([u, v], inner, outer).extend(0.0)),
            };
            let Some(point) = point else { continue };
            if let Some((weight, toward)) = self.through(point, &mut random, &mut rays) {
                // per density of the other half of the rays, in points of the zone
                let share = if near { 2.0 / (1.0 + self.cosine_density(point) * area) } else { 1.0 };
                sum += share * weight.luminance() * sky.luminance(toward);
            }
        }
        (sum * area / count as f64, rays)
    }

    /// The point of the clear zone in a direction that the cosine demands, if it meets the zone.
    fn point_by_cosine(&self, uniform: [f64; 2]) -> Option<DVec3> {
        let direction = warp::around(self.normal, warp::cosine_hemisphere(uniform));
        if direction.z <= 0.0 {
            return None;
        }
        let mut point = self.sensor + direction * ((self.tube.origin.z - self.sensor.z) / direction.z);
        point.z = self.tube.origin.z;
        let radius = (point - self.tube.origin).truncate().length();
        (self.zone.0..self.zone.1).contains(&radius).then_some(point)
    }

    /// Density of such points per m2.
    fn cosine_density(&self, point: DVec3) -> f64 {
        let way = point - self.sensor;
        let distance_squared = way.length_squared();
        way.dot(self.normal).max(0.0) * way.z / (PI * distance_squared * distance_squared)
    }

    /// Sunlight: only points from which the zenith angle is the sun's, which a straight tube conserves.
    fn sun(&self, stream: Key, count: u64) -> (f64, RayCount) {
        let Some(sun) = &self.scene.sun else { return (0.0, RayCount::default()) };
        if !matches!(self.tube.guide, Guide::Straight(_)) {
            return (0.0, RayCount::default());
        }
        let height = self.tube.origin.z - self.sensor.z;
        let zenith_angle = libm::atan2(sun.direction.truncate().length(), sun.direction.z);
        let foot = self.sensor.truncate() - self.tube.origin.truncate();
        let distance = foot.length();
        let (inner, outer) = self.zone;
        // radii around the sensor's foot: the sun's band, cut by the opening
        let reach = |angle: f64| height * libm::tan(angle.clamp(0.0, FRAC_PI_2 - 1e-6));
        let from = reach(zenith_angle - HALF_ANGLE).max(distance - outer).max(0.0);
        let to = reach(zenith_angle + HALF_ANGLE).min(distance + outer);
        if to <= from {
            return (0.0, RayCount::default());
        }
        let mut random = PathRandom::new(stream);
        let mut sum = 0.0;
        let mut rays = RayCount::default();
        for number in 0..count {
            let (replicate, index) = Replicate::of(stream, number);
            let [u, v, ..] = replicate.point(index, 0);
            let radius = (from * from + u * (to * to - from * from)).sqrt();
            // half the arc of this radius that lies above the opening
            let cosine = if radius + distance <= outer || distance == 0.0 || radius == 0.0 {
                -1.0
            } else {
                (radius * radius + distance * distance - outer * outer) / (2.0 * radius * distance)
            };
            let half_arc = libm::acos(cosine.clamp(-1.0, 1.0));
            if half_arc == 0.0 {
                continue;
            }
            let angle = (2.0 * v - 1.0) * half_arc;
            let inward = if distance > 0.0 { -foot / distance } else { DVec2::X };
            let offset = foot + unit_vector(angle).rotate(inward) * radius;
            if offset.length_squared() < inner * inner {
                continue;
            }
            let area_per_sample = half_arc * (to * to - from * from);
            let point = self.tube.origin + offset.extend(0.0);
            if let Some((weight, toward)) = self.through(point, &mut random, &mut rays)
                && sun.covers(toward)
                && toward.z > 0.0
            {
                sum += weight.luminance() * area_per_sample;
            }
        }
        (sum * sun.luminance_cd_m2() / count as f64, rays)
    }

    /// Follows a ray from the sensor through `point` of the opening: geometry factor times transmittances, and the
    /// direction outside.
    fn through(&self, point: DVec3, random: &mut PathRandom, rays: &mut RayCount) -> Option<(Spectrum<3>, DVec3)> {
        let transmittance: Spectrum<3> = self.tube.closure_at(point).unscattered()?;
        let way = point - self.sensor;
        let distance_squared = way.length_squared();
        let direction = way / distance_squared.sqrt();
        if !self.scene.visible(self.sensor, None, point, None) {
            return None;
        }
        let transit: Transit<3> = self.tube.guide.up(point - self.tube.origin, direction, random);
        *rays += 1;
        *rays += transit.ray_count();
        if transit.end != End::Top {
            return None;
        }
        let cosines = direction.dot(self.normal).max(0.0) * direction.z;
        Some((transit.weight() * transmittance * (cosines / distance_squared), transit.direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::disc::far_disc_illuminance;
    use crate::optics::{Collector, Diffuser};
    use crate::scene::{Channels, Daylight, Enclosure, Face, Room, Scene, Segment, StraightOrBent, Tube, TubeShape};
    use crate::sky::zenith::ZenithFormula;
    use crate::sky::{CieType, Sky, SkyDistribution};
    use crate::statistics::Moments;
    use crate::traceable::Follow;

    /// Below a lossless pipe a clear opening is as bright as a uniform sky: points that look up, sideways and askew get what a disc
    /// sends them in closed form, in every channel, within four standard errors.
    #[test]
    fn openings_light_surfaces_as_discs_do() {
        let (luminance, transmittance) = (3000.0, [0.9, 0.8, 0.5]);
        let distribution = SkyDistribution::new(CieType::UNIFORM, DVec3::Z);
        let sky = Some(Sky { distribution, zenith_luminance_cd_m2: luminance });
        let size = DVec3::new(3.0, 2.0, 2.5);
        let tube = Tube {
            face: Face::Ceiling as usize,
            drop_m: 0.0,
            centre: DVec2::new(1.0, 1.2),
            opening_radius: 0.3,
            shape: TubeShape::Cylinders(StraightOrBent {
                reflectance: [1.0; 3].into(),
                segments: vec![Segment { length_m: 1.0, tilt: 0.0, azimuth: 0.0 }],
                collector: Collector::Open,
            }),
            diffuser: Diffuser::Clear { transmittance },
        };
        let scene = Scene {
            daylight: Some(Daylight { sky, sun: None, formula: ZenithFormula::GivenZenithLuminance }),
            room: Room {
                enclosure: Enclosure::cuboid(size, [None; 6]),
                boxes: Vec::new(),
                meshes: Vec::new(),
                luminaires: Vec::new(),
            },
            tubes: vec![tube],
            grids: Vec::new(),
            views: Vec::new(),
            channels: Channels::Rgb,
        };
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        let traceable = TraceableScene::new(&scene, follow).unwrap();
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
        scene.tubes[0].origin
    }
}

//! Expected differences between the residuals of sensors: each sees other patches, whose luminances have errors of their own.
//!
//! A patch has few rays and connections, and its luminance the error by their chance. Light of a patch that a sensor sees under the factor k
//! adds k^2 times its variance to the squared residual of the sensor. Two independent sets of directions from a sensor estimate the sum over
//! all patches without bias: the mean, over all pairs of one direction of each set, of the variance of a patch that both meet.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::exchange::{Exchange, Solution};
use super::patch_rays::{OpeningLight, RAYS, variance_of_sum};
use crate::integrator::pass::LEAST_SCALE;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, lattice, warp};
use crate::scene::Sensor;
use crate::statistics::median;
use crate::traceable::TraceableScene;

impl Exchange {
    /// Estimates the variances of luminances, in (cd/m2)^2, of patches of these reflectances, by the differences between rays of neighbouring
    /// strata and between connections of neighbouring parts; `other` are the variances of illuminances by other light, in lx^2.
    pub(super) fn variances<const C: usize>(
        &self,
        (reflectances, other): (&[Spectrum<C>], &[f64]),
        light: &[(Spectrum<C>, DVec2)],
        luminances: &[Spectrum<C>],
    ) -> Vec<f64> {
        let found = |(number, weight): &(u32, f64)| {
            luminances.get(*number as usize).map_or(0.0, |luminance| luminance.luminance() * weight / RAYS as f64)
        };
        let straight = |of: &OpeningLight| of.lux(light).luminance() / PI;
        let patches = self.met_by_each().zip(self.openings_of_each());
        patches
            .zip(reflectances)
            .enumerate()
            .map(|(number, ((met, of_openings), reflectance))| {
                let by_rays: f64 = met.chunks_exact(2).map(|pair| (found(&pair[0]) - found(&pair[1])).powi(2)).sum();
                let by_connections: f64 = of_openings
                    .chunks_exact(RAYS)
                    .map(|parts| variance_of_sum(&std::array::from_fn(|part| straight(&parts[part]))))
                    .sum();
                let by_other = other.get(number).map_or(0.0, |variance| variance / (PI * PI));
                reflectance.luminance().powi(2) * (by_rays + by_connections + by_other)
            })
            .collect()
    }
}

/// Number of directions in each of two sets from a sensor, by which the expected spread is estimated.
const DIRECTIONS: usize = 32;

/// Variances by which the residuals of some sensors of a grid are expected to differ.
#[derive(Clone, Debug)]
pub struct ExpectedSpreads {
    /// Position of each sensor, and its variance relative to the squared light of the solution there.
    sensors: Vec<(DVec3, f64)>,
}

impl ExpectedSpreads {
    /// Returns the mean over the sensors.
    pub fn mean(&self) -> f64 {
        self.sensors.iter().map(|(_, spread)| spread).sum::<f64>() / self.sensors.len().max(1) as f64
    }

    /// Returns those of sensors at some positions: that of the nearest known one, but at least the mean, as few directions must not make the
    /// error of a sensor much smaller than that of others; all divided by one number, so that their mean stays.
    pub fn at(&self, positions: &[DVec3]) -> Vec<f64> {
        let least = self.mean();
        let near = |position: &DVec3| {
            let distance = |(of, _): &&(DVec3, f64)| of.distance_squared(*position);
            let nearest = self.sensors.iter().min_by(|one, other| distance(one).total_cmp(&distance(other)));
            nearest.map_or(0.0, |(_, spread)| *spread).max(least)
        };
        let found: Vec<f64> = positions.iter().map(near).collect();
        let sum: f64 = found.iter().sum();
        let ratio = if sum > 0.0 { least * found.len() as f64 / sum } else { 1.0 };
        found.into_iter().map(|spread| spread * ratio).collect()
    }
}

impl<const C: usize> Solution<C> {
    /// Estimates the variances by which residuals of sensors differ because each sees other patches, relative to the squared light of the
    /// solution at a sensor.
    pub fn expected_spreads(&self, scene: &TraceableScene, sensors: &[Sensor], key: Key) -> ExpectedSpreads {
        let of_sensor = |(number, sensor): (usize, &Sensor)| {
            let mut random = PathRandom::new(key.child(number as u64));
            let [first, second] = [0, 1].map(|_| -> Vec<(u32, f64)> {
                let shift = random.uniform2();
                let met = |direction: usize| {
                    let point = lattice::point(direction as f64, DIRECTIONS as f64, shift);
                    let direction = warp::around(sensor.normal, warp::cosine_hemisphere(point));
                    self.met(scene, (sensor.position, direction), &mut random)
                };
                (0..DIRECTIONS).filter_map(met).filter(|(patch, _)| (*patch as usize) < self.luminances.len()).collect()
            });
            let light: f64 = first
                .iter()
                .chain(&second)
                .map(|(patch, weight)| weight * self.luminances[*patch as usize].luminance())
                .sum();
            let both = |(patch, weight): &(u32, f64)| {
                let times: f64 = second.iter().filter(|(other, _)| other == patch).map(|(_, weight)| weight).sum();
                weight * times * self.variances[*patch as usize]
            };
            [light / (2 * DIRECTIONS) as f64, first.iter().map(both).sum::<f64>() / (DIRECTIONS * DIRECTIONS) as f64]
        };
        let found: Vec<[f64; 2]> = sensors.par_iter().enumerate().map(of_sensor).collect();
        let least = LEAST_SCALE * median(found.iter().map(|[light, _]| *light).collect());
        let relative = |[light, variance]: &[f64; 2]| match least > 0.0 {
            true => variance / light.max(least).powi(2),
            false => 0.0,
        };
        let sensors = sensors.iter().zip(&found).map(|(sensor, found)| (sensor.position, relative(found)));
        ExpectedSpreads { sensors: sensors.collect() }
    }

    /// Finds the patch by which a ray from a sensor counts reflected light, and its weight: the first that it meets, or the next one after a
    /// reflection by a close surface. `None` where it has no patch.
    fn met(
        &self,
        scene: &TraceableScene,
        (from, direction): (DVec3, DVec3),
        random: &mut PathRandom,
    ) -> Option<(u32, f64)> {
        let hit = scene.intersect(from, direction, None);
        let surface = scene.surface_at(hit.place);
        let patch = self.number(surface, hit.position)?;
        if !self.is_close(patch, (hit.position - from).length_squared()) {
            return Some((patch, 1.0));
        }
        let reflectance = scene.optics(surface)?.diffuse::<3>().luminance();
        let direction = warp::around(hit.normal, warp::cosine_hemisphere(random.uniform2()));
        let next = scene.intersect(hit.position, direction, Some(surface));
        Some((self.number(scene.surface_at(next.place), next.position)?, reflectance))
    }
}

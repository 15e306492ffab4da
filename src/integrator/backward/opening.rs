//! Paths that are followed backward through a closure and up the guide.

use std::f64::consts::PI;

use glam::DVec3;

use super::vertex::{Ray, Scatter, Vertex};
use super::walk::{Daylight, Path};
use crate::guide::{End, Transit};
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Closure, Spectrum};
use crate::sampling::{PathRandom, warp};

/// Least share with which a path goes on from a measured diffuser.
pub const LEAST_MEASURED_SHARE: f64 = 0.05;

impl Path<'_> {
    /// A ray meets an opening from below: adds the sky that it finds, and returns how it comes back into the room.
    pub(super) fn enter_tube<const C: usize>(
        &mut self,
        daylight: &impl Daylight<C>,
        index: usize,
        mut position: DVec3,
        ray: &Ray<C>,
        sum: &mut Spectrum<C>,
    ) -> Option<Ray<C>> {
        let scene = self.scene;
        let tube = &scene.tubes[index];
        let (mut direction, mut weight) = (ray.direction, ray.weight);
        let mut share_of_sky = daylight.found_share(scene, index, ray, position);
        let climbs = share_of_sky.is_some() || (scene.guide_return && tube.guide.returns_light());
        for _ in 0..MAX_EVENTS {
            let from_below = direction.z > 0.0;
            let closure = tube.closure_at(position);
            let scatter = Scatter { transmitted: !from_below, eye_cosine: direction.z.abs() };
            // what goes on down into the room, and what goes up
            let (down, up, upward) = if let Closure::Specular { transmittance } = closure {
                weight *= Spectrum::from_rgb(transmittance);
                if !from_below {
                    return Some(Ray { origin: position, direction, from: None, weight, last: None, from_eye: false });
                }
                (Spectrum::ZERO, weight, direction)
            } else {
                let mut shares = shares::<C>(closure, scatter.eye_cosine);
                if matches!(closure, Closure::Measured(_)) {
                    // a table need not be reciprocal: the eye may see light where it would send none
                    shares = shares.map(|share| share.map(|share| share.max(LEAST_MEASURED_SHARE)));
                }
                let point = self.samples.pair();
                let above = Scatter { transmitted: from_below, ..scatter };
                let (upward, factor) = above_closure(closure, above, point, &mut self.samples.random);
                (weight * shares[usize::from(from_below)], weight * factor, upward)
            };
            let (mut returning, mut place) = (Spectrum::ZERO, (position, direction));
            if climbs && up.max() > 0.0 {
                let transit: Transit<C> = tube.guide.up(position - tube.origin, upward, &mut self.samples.random);
                self.rays += u64::from(transit.rays);
                let arriving = up * transit.weight();
                if transit.end == End::Top {
                    if let Some(share) = share_of_sky {
                        let toward = transit.direction;
                        let sky = scene.sky.as_ref().map_or(0.0, |sky| share * sky.luminance(toward));
                        *sum += arriving * sky;
                    }
                } else if transit.end == End::Opening && scene.guide_return {
                    returning = arriving;
                    place = (tube.origin + transit.position, transit.direction);
                    place.0.z = tube.origin.z;
                }
            }
            // one of the two goes on, by roulette
            let both = returning.max() + down.max();
            let survival = (both / weight.max()).min(1.0);
            if both <= 0.0 || self.samples.random.uniform() >= survival {
                return None;
            }
            let returns = returning.max() / both;
            if self.samples.random.uniform() >= returns {
                let goes_on = weight * (1.0 / (survival * (1.0 - returns)));
                return self.leave_closure(daylight, position, -direction, closure, scatter, goes_on, sum);
            }
            weight = returning * (1.0 / (survival * returns));
            (position, direction) = place;
            share_of_sky = share_of_sky.map(|_| 1.0);
        }
        None
    }

    /// The lower side of a closure scatters light of the room toward the eye.
    #[allow(clippy::too_many_arguments)]
    fn leave_closure<const C: usize>(
        &mut self,
        daylight: &impl Daylight<C>,
        position: DVec3,
        eye: DVec3,
        closure: Closure<'_>,
        scatter: Scatter,
        weight: Spectrum<C>,
        sum: &mut Spectrum<C>,
    ) -> Option<Ray<C>> {
        let (diffuse, table) = match closure {
            Closure::Lambertian { transmittance, reflectance } => {
                (weight * Spectrum::from_rgb(if scatter.transmitted { transmittance } else { reflectance }), None)
            }
            Closure::Measured(table) => (weight, Some((table, scatter))),
            Closure::Specular { .. } => return None,
        };
        let vertex = Vertex {
            position,
            normal: DVec3::NEG_Z,
            surface: None,
            eye,
            diffuse,
            lobe: None,
            diffuse_share: 1.0,
            table,
        };
        *sum += self.connect(daylight, &vertex);
        let point = self.samples.pair();
        self.scatter(&vertex, point)
    }
}

/// A direction above a closure from which it scatters light toward the eye, and BSDF times cosine over its density.
pub fn above_closure<const C: usize>(
    closure: Closure<'_>,
    scatter: Scatter,
    point: [f64; 2],
    random: &mut PathRandom,
) -> (DVec3, Spectrum<C>) {
    let Scatter { transmitted, eye_cosine } = scatter;
    let table = match closure {
        Closure::Measured(table) => Some((table, table.shares(eye_cosine)[usize::from(!transmitted)])),
        _ => None,
    };
    // a table is sampled as if it were reciprocal, which is likely; the cosine covers what it leaves out
    let table = table.filter(|(_, share)| *share > 0.0);
    let table_share = if table.is_some() { 0.5 } else { 0.0 };
    let direction = match &table {
        Some((table, _)) if random.uniform() < table_share => table.sample(transmitted, eye_cosine, point),
        _ => warp::cosine_hemisphere(point),
    };
    let cosine = direction.z;
    if cosine <= 0.0 {
        return (direction, Spectrum::ZERO);
    }
    let mut density = (1.0 - table_share) * cosine / PI;
    if let Some((table, share)) = table {
        density += table_share * table.per_sr(transmitted, eye_cosine, cosine) * cosine / share;
    }
    let bsdf = match closure {
        Closure::Lambertian { transmittance, reflectance } => {
            Spectrum::from_rgb(if transmitted { transmittance } else { reflectance }) * (1.0 / PI)
        }
        Closure::Measured(table) => Spectrum::ONE * table.per_sr(transmitted, cosine, eye_cosine),
        Closure::Specular { .. } => Spectrum::ZERO,
    };
    (direction, bsdf * (cosine / density))
}

/// Transmittance and reflectance of a closure for light at a cosine of incidence.
pub fn shares<const C: usize>(closure: Closure<'_>, cosine: f64) -> [Spectrum<C>; 2] {
    match closure {
        Closure::Lambertian { transmittance, reflectance } => [transmittance, reflectance].map(Spectrum::from_rgb),
        Closure::Measured(table) => table.shares(cosine).map(|share| Spectrum::ONE * share),
        Closure::Specular { transmittance } => [Spectrum::from_rgb(transmittance), Spectrum::ZERO],
    }
}

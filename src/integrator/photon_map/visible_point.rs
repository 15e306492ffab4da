//! Eyes: where what they see begins, and their rays' way by mirrors, glossy lobes and tubes.
//!
//! Rays find the diffuse parts of surfaces, whose light is gathered from photons, and go on into a direction of the specular
//! part. A diffuser that a glossy lobe reflects is found in two ways, by connections to its photons and by the direction
//! that the ray takes; they share it by the balance heuristic (Veach and Guibas 1995).

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::maps::{Gathered, Mapper, Maps};
use super::near_light::share_of;
use crate::guide::{End, Transit};
use crate::integrator::ViewPass;
use crate::integrator::backward::room_entry::enter_room;
use crate::integrator::roulette::MAX_REFLECTIONS;
use crate::optics::{Closure, Spectrum};
use crate::sampling::{Key, PathRandom};
use crate::scene::View;
use crate::traceable::{Place, RoomHit, SurfaceId};

/// Ways of one eye ray up into tubes.
const MAX_EYE_TRANSITS: u32 = 64;

/// Specular reflections of one eye ray that are followed for sure; farther ones by roulette.
const SURE_REFLECTIONS: u32 = 8;

/// Results of `of` for every pixel of a view, of its number and its column and row; `None` when cancelled.
pub fn pixels<T: Send>(view: &View, cancel: &AtomicBool, of: impl Fn(usize, [usize; 2]) -> T + Sync) -> Option<Vec<T>> {
    let [width, height] = view.size_px;
    let rows: Option<Vec<_>> = (0..height)
        .into_par_iter()
        .map(|row| {
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            Some((0..width).map(|column| of(row * width + column, [column, row])).collect::<Vec<_>>())
        })
        .collect();
    Some(rows?.into_iter().flatten().collect())
}

/// One view of one pass, a ray to a random point of every pixel; `luminance` along a direction has the pixel's key and
/// its random numbers. `None` when cancelled.
pub fn view<const C: usize>(
    view: &View,
    stream: Key,
    cancel: &AtomicBool,
    luminance: impl Fn(DVec3, Key, &mut PathRandom) -> Gathered<C> + Sync,
) -> Option<ViewPass> {
    let seen = pixels(view, cancel, |pixel, place| {
        let key = stream.child(pixel as u64);
        let mut random = PathRandom::new(key);
        let direction = direction(view, place, random.uniform2());
        luminance(direction, key, &mut random)
    })?;
    Some(ViewPass::of(&seen))
}

/// Unit direction through the point at coordinates 0..1 of the pixel in a column and row.
pub fn direction(view: &View, [column, row]: [usize; 2], [x, y]: [f64; 2]) -> DVec3 {
    view.ray_direction(column as f64 + x, row as f64 + y)
}

impl ViewPass {
    /// Pass of a view made of what is seen in each pixel.
    pub fn of<const C: usize>(pixels: &[Gathered<C>]) -> Self {
        Self {
            luminance: pixels.iter().flat_map(|pixel| pixel.irradiance.0).collect(),
            bias: pixels.iter().map(|pixel| pixel.bias).collect(),
            ..Self::default()
        }
    }
}

/// Luminance in cd/m2 that an eye sees along `direction`, with its estimated bias.
///
/// `irradiance` is asked at every diffuse part that the ray meets, with the ray's weight there.
pub fn luminance<const C: usize>(
    mapper: &Mapper<C>,
    maps: &Maps<C>,
    eye: DVec3,
    direction: DVec3,
    random: &mut PathRandom,
    mut irradiance: impl FnMut(&RoomHit, SurfaceId, Spectrum<C>, &mut PathRandom) -> Gathered<C>,
) -> Gathered<C> {
    // the sum of what diffuse parts send along the path
    let mut seen = Gathered::NOTHING;
    let scene = &*mapper.scene;
    let Some(mut origin) = enter_room(scene, eye, direction) else { return seen };
    let mut direction = direction;
    let mut from = None;
    let mut weight = Spectrum::<C>::ONE;
    // density per sr of the ray's direction when a glossy lobe chose it
    let mut chosen = None;
    // whether the beams at a glossy surface were gathered that the ray comes from
    let mut beams_gathered = false;
    let (mut transits, mut reflections) = (0, 0);
    while transits < MAX_EYE_TRANSITS && reflections < MAX_REFLECTIONS {
        let hit = scene.intersect(origin, direction, from);
        let index = match hit.place {
            Place::Surface(surface) => {
                if let Some(luminaire) = scene.luminaire(surface) {
                    seen.irradiance += weight * luminaire.seen(direction);
                    return seen;
                }
                let Some(optics) = scene.optics(surface) else { return seen };
                if optics.gathers() {
                    let brdf = Spectrum::from_rgb(optics.reflectance) * (1.0 / PI);
                    let part = irradiance(&hit, surface, weight, random);
                    seen.found += part.found;
                    seen.bias += part.bias * (weight * brdf).luminance();
                    seen.irradiance += part.irradiance * weight * brdf;
                }
                let Some(specular) = &optics.specular else { return seen };
                let reflectance = Spectrum::from_rgb(specular.reflectance);
                if let Some(lobe) = &specular.lobe {
                    let reflected = mapper.diffusers_in_lobe(maps, lobe, &hit, Some(surface), -direction, random);
                    seen.irradiance += reflected * weight * reflectance;
                    if optics.gathers_beams() {
                        let (beams, bias) = mapper.beams_in_lobe(maps, maps.radius, lobe, &hit, -direction);
                        seen.irradiance += beams * weight * reflectance;
                        seen.bias += bias * (weight * reflectance).luminance();
                    }
                }
                reflections += 1;
                let survival = if reflections > SURE_REFLECTIONS { reflectance.max() } else { 1.0 };
                if survival < 1.0 && random.uniform() >= survival {
                    return seen;
                }
                weight = weight * reflectance * (1.0 / survival);
                let point = random.uniform2();
                (origin, from) = (hit.position, Some(surface));
                let toward = specular.reflect(hit.normal, -direction, point, random);
                chosen = specular.lobe.as_ref().map(|lobe| lobe.density(hit.normal, -direction, toward));
                beams_gathered = optics.gathers_beams();
                direction = toward;
                continue;
            }
            Place::Opening(index) => index,
        };
        transits += 1;
        from = None;
        let tube = &scene.tubes[index];
        let transmittance = match tube.closure_at(hit.position) {
            Closure::Lambertian { .. } => {
                let exitance = mapper.exitance(maps, index, hit.position);
                seen.irradiance += exitance * weight * (share_of(chosen, tube, hit.position - origin) / PI);
                return seen;
            }
            Closure::Measured(table) => {
                let luminance = mapper.measured_luminance(maps, index, table, hit.position, direction);
                seen.irradiance += luminance * weight * share_of(chosen, tube, hit.position - origin);
                return seen;
            }
            Closure::Specular { transmittance } => transmittance,
        };
        let transit: Transit<C> = tube.guide.up(hit.position - tube.origin, direction, random);
        weight = weight * transit.weight() * Spectrum::from_rgb(transmittance);
        match transit.end {
            End::Top => {
                let toward = transit.direction;
                let sky = scene.sky.as_ref().map_or(0.0, |sky| sky.luminance(toward));
                let sun = scene.sun.filter(|sun| !beams_gathered && sun.covers(toward) && toward.z > 0.0);
                let outside = sky + sun.map_or(0.0, |sun| sun.luminance_cd_m2());
                seen.irradiance += weight * outside;
                return seen;
            }
            // back into the room, through the closure again
            End::Opening if scene.guide_return => {
                (chosen, beams_gathered) = (None, false);
                origin = tube.origin + transit.position;
                origin.z = tube.origin.z;
                direction = transit.direction;
                match tube.closure_at(origin) {
                    Closure::Specular { transmittance } => weight *= Spectrum::from_rgb(transmittance),
                    Closure::Lambertian { .. } | Closure::Measured(_) => return seen,
                }
            }
            End::Opening | End::Lost | End::Cut => return seen,
        }
    }
    seen
}

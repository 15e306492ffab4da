//! Stochastic progressive photon mapping with independent passes.
//!
//! Every pass traces its own photons and eye rays and gathers with a radius that depends on the pass' number alone (Knaus
//! and Zwicker 2011), so that passes are independent replicates. Light that a diffuser or a tube's scattering sends
//! straight to a point is computed from the pass' own photons at the diffuser, light straight from a luminaire in closed
//! form or from points of its area, not by density estimation (`direct_light`); kernels and their bias are those of
//! `photon_maps`.
//!
//! Photons are gathered for the diffuse part of a surface alone. The specular part, mirror or glossy lobe, is followed: eye
//! rays gather where they meet a diffuse part and go on into a direction of the specular part. A diffuser that a glossy lobe
//! reflects is found in two ways, by connections to its photons and by the direction that the ray takes; they share it by
//! the balance heuristic (Veach and Guibas 1995).

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::direct_light::share_of;
use super::eye::enter_room;
use super::kernel::{Kernel, NO_SURFACE, Place};
use super::photon_maps::{Gathered, Mapper, Maps};
use super::{GridPass, Integrator, Pass, ViewPass};
use crate::guide::{End, Transit};
use crate::optics::{Closure, Spectrum};
use crate::sampling::{Key, PathRandom};
use crate::scene::{EstimateKind, Grid, View};

/// Settings of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Photons emitted per pass, all tubes and sources together; 64..=16_777_216.
    pub photons_per_pass: u64,
    /// Gather radius of the first pass in metres; `None`: a twentieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// The squared radius shrinks by (i + alpha) / (i + 1) from pass i to i + 1; 0 < alpha < 1.
    pub alpha: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: 65_536, initial_radius_m: None, alpha: 2.0 / 3.0 }
    }
}

/// Share of the shortest edge of the room that is the default first radius.
const DEFAULT_RADIUS_SHARE: f64 = 0.05;

/// Photons at each diffuser, and points of each luminaire in a square of strata, to which a sensor is connected.
const SENSOR_CONNECTIONS: usize = 256;
const SENSOR_STRATA: usize = 8;

/// Ways of one eye ray up into tubes.
const MAX_EYE_TRANSITS: u32 = 64;

/// Specular reflections of one eye ray that are followed for sure; farther ones by roulette.
const SURE_REFLECTIONS: u32 = 8;

/// Specular reflections of one eye ray; roulette lets a share of at most albedo^10000 come so far, 5e-5 for albedo 0.999.
const MAX_REFLECTIONS: u32 = 10_000;

/// Streams of random numbers within a pass.
const EYE_STREAM: u64 = 1 << 32;
const SENSOR_STREAM: u64 = 1 << 33;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct Sppm<const C: usize> {
    mapper: Mapper<C>,
    views: Vec<View>,
    initial_radius: f64,
    alpha: f64,
    seed: Key,
}

impl<const C: usize> Sppm<C> {
    pub fn new(kernel: Arc<Kernel>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        Self {
            initial_radius: settings.initial_radius_m.unwrap_or(DEFAULT_RADIUS_SHARE * kernel.size.min_element()),
            mapper: Mapper::new(kernel, grids, !views.is_empty(), settings.photons_per_pass),
            views: views.to_vec(),
            alpha: settings.alpha,
            seed: Key::new(seed),
        }
    }

    /// Gather radius of a pass in metres: r_1 sqrt(prod_{k=1..i} (k + alpha) / (k + 1)), Knaus and Zwicker 2011.
    fn radius(&self, pass: u64) -> f64 {
        // the product is Gamma(i + 1 + alpha) / (Gamma(1 + alpha) Gamma(i + 2)) with i passes before
        let i = pass as f64;
        let ln_gamma = statrs::function::gamma::ln_gamma;
        let log = ln_gamma(i + 1.0 + self.alpha) - ln_gamma(1.0 + self.alpha) - ln_gamma(i + 2.0);
        self.initial_radius * (0.5 * log).exp()
    }

    /// One grid of one pass.
    fn grid(&self, number: usize, maps: &Maps<C>, key: Key) -> GridPass {
        let mapper = &self.mapper;
        let grid = &mapper.grids[number];
        let stream = key.child(SENSOR_STREAM + number as u64);
        let values: Vec<(f64, f64)> = (0..grid.len())
            .into_par_iter()
            .map(|index| {
                let mut random = PathRandom::new(stream.child(index as u64));
                let (i, j) = (index % grid.cells[0], index / grid.cells[0]);
                let mut sensor = DVec3::new(grid.x_m[i], grid.y_m[j], grid.height_m);
                if grid.estimate == EstimateKind::CellAverage {
                    let [u, v] = random.uniform2();
                    sensor.x += (u - 0.5) * grid.cell_size_m[0];
                    sensor.y += (v - 0.5) * grid.cell_size_m[1];
                }
                let direct =
                    mapper.diffuser_irradiance(maps, sensor, DVec3::Z, NO_SURFACE, SENSOR_CONNECTIONS, &mut random);
                let electric = mapper.luminaire_irradiance(sensor, DVec3::Z, NO_SURFACE, SENSOR_STRATA, &mut random);
                let gathered = mapper.plane_irradiance(maps, number, sensor);
                (direct.luminance() + electric.luminance() + gathered.irradiance.luminance(), gathered.bias)
            })
            .collect();
        let (illuminance, bias) = values.into_iter().unzip();
        GridPass { illuminance, bias }
    }

    /// One view of one pass.
    fn view(&self, number: usize, maps: &Maps<C>, key: Key, cancel: &AtomicBool) -> Option<ViewPass> {
        let view = &self.views[number];
        let stream = key.child(EYE_STREAM + number as u64);
        let [width, height] = view.size_px;
        let rows: Option<Vec<_>> = (0..height)
            .into_par_iter()
            .map(|row| {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let pixels = (0..width).map(|column| {
                    let mut random = PathRandom::new(stream.child((row * width + column) as u64));
                    let [x, y] = random.uniform2();
                    let direction = view.ray_direction(column as f64 + x, row as f64 + y);
                    self.luminance(maps, view.eye, direction, &mut random)
                });
                Some(pixels.collect::<Vec<_>>())
            })
            .collect();
        let mut pass = ViewPass::default();
        for pixel in rows?.into_iter().flatten() {
            pass.luminance.extend(pixel.irradiance.0);
            pass.bias.push(pixel.bias);
        }
        Some(pass)
    }

    /// Luminance in cd/m2 that an eye sees along `direction`.
    fn luminance(&self, maps: &Maps<C>, eye: DVec3, direction: DVec3, random: &mut PathRandom) -> Gathered<C> {
        // the sum of what diffuse parts send along the path
        let mut seen = Gathered { irradiance: Spectrum::ZERO, bias: 0.0 };
        let kernel = &*self.mapper.kernel;
        let Some(mut origin) = enter_room(kernel, eye, direction) else { return seen };
        let mut direction = direction;
        let mut from = NO_SURFACE;
        let mut weight = Spectrum::<C>::ONE;
        // density per sr of the ray's direction when a glossy lobe chose it
        let mut chosen = None;
        let (mut transits, mut reflections) = (0, 0);
        while transits < MAX_EYE_TRANSITS && reflections < MAX_REFLECTIONS {
            let hit = kernel.intersect(origin, direction, from);
            let index = match hit.place {
                Place::Surface(surface) => {
                    if let Some(luminaire) = kernel.luminaire(surface) {
                        seen.irradiance += weight * luminaire.seen(direction);
                        return seen;
                    }
                    let Some(optics) = &kernel.surfaces[surface as usize] else { return seen };
                    if optics.gathers() {
                        let brdf = Spectrum::from_rgb(optics.reflectance) * (1.0 / PI);
                        let part = self.mapper.irradiance(maps, hit.position, hit.normal, surface, random);
                        seen.bias += part.bias * (weight * brdf).luminance();
                        seen.irradiance += part.irradiance * weight * brdf;
                    }
                    let Some(specular) = &optics.specular else { return seen };
                    let reflectance = Spectrum::from_rgb(specular.reflectance);
                    if let Some(lobe) = &specular.lobe {
                        let reflected = self.mapper.diffusers_in_lobe(maps, lobe, &hit, surface, -direction, random);
                        seen.irradiance += reflected * weight * reflectance;
                    }
                    reflections += 1;
                    let survival = if reflections > SURE_REFLECTIONS { reflectance.max() } else { 1.0 };
                    if survival < 1.0 && random.uniform() >= survival {
                        return seen;
                    }
                    weight = weight * reflectance * (1.0 / survival);
                    let point = random.uniform2();
                    (origin, from) = (hit.position, surface);
                    let toward = specular.reflect(hit.normal, -direction, point, random);
                    chosen = specular.lobe.as_ref().map(|lobe| lobe.density(hit.normal, -direction, toward));
                    direction = toward;
                    continue;
                }
                Place::Opening(index) => index,
            };
            transits += 1;
            from = NO_SURFACE;
            let tube = &kernel.tubes[index];
            let transmittance = match tube.closure_at(hit.position) {
                Closure::Lambertian { .. } => {
                    let exitance = self.mapper.exitance(maps, index, hit.position);
                    seen.irradiance += exitance * weight * (share_of(chosen, tube, hit.position - origin) / PI);
                    return seen;
                }
                Closure::Measured(table) => {
                    let luminance = self.mapper.measured_luminance(maps, index, table, hit.position, direction);
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
                    let sky = kernel.sky.as_ref().map_or(0.0, |sky| sky.luminance(toward));
                    let sun = kernel.sun.filter(|sun| sun.covers(toward) && toward.z > 0.0);
                    let outside = sky + sun.map_or(0.0, |sun| sun.luminance_cd_m2());
                    seen.irradiance += weight * outside;
                    return seen;
                }
                // back into the room, through the closure again
                End::Opening if kernel.guide_return => {
                    chosen = None;
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
}

impl<const C: usize> Integrator for Sppm<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.child(pass);
        let radius = self.radius(pass);
        let (maps, account) = self.mapper.maps(key, radius, cancel)?;
        let grids = (0..self.mapper.grids.len()).map(|number| self.grid(number, &maps, key)).collect();
        let views = (0..self.views.len()).map(|number| self.view(number, &maps, key, cancel)).collect::<Option<_>>()?;
        Some(Pass { grids, views, account, photons: self.mapper.photons() })
    }
}

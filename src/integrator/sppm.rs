//! Stochastic progressive photon mapping with independent passes.
//!
//! Every pass traces its own photons and eye rays and gathers with a radius that depends on the pass' number alone (Knaus
//! and Zwicker 2011), so that passes are independent replicates. Light that a diffuser or a tube's scattering sends
//! straight to a point is computed from the pass' own photons at the diffuser, light straight from a luminaire in closed
//! form or from points of its area, not by density estimation; kernels are
//! clipped to the surface they lie on and count photons of that surface only. The bias of the kernel is estimated from
//! the same photons at two radii: on a whole disc it grows with the squared radius, so bias(r) = 2 (E(r) - E(r / sqrt 2));
//! on a clipped one, which lies to one side of its centre, with the radius: bias(r) = (E(r) - E(r / sqrt 2)) / (1 - 1 / sqrt 2).
//!
//! Photons are gathered for the diffuse part of a surface alone. The specular part, mirror or glossy lobe, is followed: eye
//! rays gather where they meet a diffuse part and go on into a direction of the specular part. A diffuser that a glossy lobe
//! reflects is found in two ways, by connections to its photons and by the direction that the ray takes; they share it by
//! the balance heuristic (Veach and Guibas 1995).

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::domain::Domain;
use super::emission::{Emission, PathSamples};
use super::eye::enter_room;
use super::kernel::{Kernel, NO_SURFACE, Place, RoomHit, SurfaceId, SurfaceKernel, TubeKernel};
use super::light_path::{Account, Flight, Origin, Scattering, Visitor, trace};
use super::photon_grid::{Photon, PhotonGrid};
use super::{GridPass, Integrator, PHOTON_CHUNK, Pass, ViewPass};
use crate::geometry::disc::disc_disc_area;
use crate::guide::{End, Transit};
use crate::optics::{Closure, Diffuser, Glossy, MeasuredDiffuser, Spectrum};
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

/// Photons at each diffuser to which a visible point and a sensor are connected.
const POINT_CONNECTIONS: usize = 4;
const SENSOR_CONNECTIONS: usize = 256;

/// Points of each luminaire, in a square of strata, to which they are connected where something can stand between.
const POINT_STRATA: usize = 2;
const SENSOR_STRATA: usize = 8;

/// Ways of one eye ray up into tubes.
const MAX_EYE_TRANSITS: u32 = 64;

/// Specular reflections of one eye ray that are followed for sure; farther ones by roulette.
const SURE_REFLECTIONS: u32 = 8;

/// Specular reflections of one eye ray; roulette lets a share of at most albedo^10000 come so far, 5e-5 for albedo 0.999.
const MAX_REFLECTIONS: u32 = 10_000;

/// A clipped kernel below this share of the full disc has no room for photons.
const LEAST_KERNEL: f64 = 1e-6;

/// Streams of random numbers within a pass.
const EYE_STREAM: u64 = 1 << 32;
const SENSOR_STREAM: u64 = 1 << 33;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct Sppm<const C: usize> {
    kernel: Arc<Kernel>,
    emission: Emission,
    grids: Vec<Grid>,
    grid_domains: Vec<Domain>,
    views: Vec<View>,
    domains: Vec<Domain>,
    initial_radius: f64,
    alpha: f64,
    seed: Key,
}

/// Photons of one pass.
struct Maps<const C: usize> {
    /// On surfaces, but for light straight from a diffuser.
    surfaces: PhotonGrid<C>,
    /// Crossings of each grid's plane, downward, but for light straight from a diffuser.
    planes: Vec<PhotonGrid<C>>,
    /// Scattered downward at each tube's diffuser.
    exits: Vec<Vec<Photon<C>>>,
    exit_grid: PhotonGrid<C>,
    /// Of measured diffusers: `surface` counts a tube's exits.
    measured_exits: Vec<Option<PhotonGrid<C>>>,
    /// Directions of the light that arrived at a tube's exits, where it is measured; flux is then what arrived.
    incidents: Vec<Vec<DVec3>>,
    radius: f64,
}

/// Irradiance in lux and its estimated bias.
#[derive(Clone, Copy)]
struct Gathered<const C: usize> {
    irradiance: Spectrum<C>,
    bias: f64,
}

impl<const C: usize> Sppm<C> {
    pub fn new(kernel: Arc<Kernel>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        Self {
            emission: Emission::new(&kernel, settings.photons_per_pass),
            grids: grids.to_vec(),
            grid_domains: grids.iter().map(|grid| Domain::horizontal_plane(&kernel, grid.height_m)).collect(),
            views: views.to_vec(),
            domains: Domain::of_surfaces(&kernel),
            initial_radius: settings.initial_radius_m.unwrap_or(DEFAULT_RADIUS_SHARE * kernel.size.min_element()),
            alpha: settings.alpha,
            seed: Key::new(seed),
            kernel,
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

    fn trace_photons(&self, key: Key, cancel: &AtomicBool) -> Option<(Store<'_, C>, Account)> {
        let photons = self.emission.photons();
        let chunks: Option<Vec<_>> = (0..photons.div_ceil(PHOTON_CHUNK))
            .into_par_iter()
            .map(|chunk| {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let mut store = Store::new(&self.kernel, &self.grids, !self.views.is_empty());
                let mut account = Account::new(self.kernel.tubes.len());
                for number in chunk * PHOTON_CHUNK..((chunk + 1) * PHOTON_CHUNK).min(photons) {
                    let (photon, mut samples) = self.emission.photon(&self.kernel, key, number);
                    if let Some(photon) = photon {
                        trace::<C>(&self.kernel, &photon, &mut samples, &mut store, &mut account);
                    }
                }
                Some((store, account))
            })
            .collect();
        let mut all = Store::new(&self.kernel, &self.grids, !self.views.is_empty());
        let mut account = Account::new(self.kernel.tubes.len());
        for (store, part) in chunks? {
            all.append(store);
            account.add(&part);
        }
        Some((all, account))
    }

    /// One grid of one pass.
    fn grid(&self, number: usize, maps: &Maps<C>, key: Key) -> GridPass {
        let (grid, domain) = (&self.grids[number], &self.grid_domains[number]);
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
                    self.diffuser_irradiance(maps, sensor, DVec3::Z, NO_SURFACE, SENSOR_CONNECTIONS, &mut random);
                let electric = self.luminaire_irradiance(sensor, DVec3::Z, NO_SURFACE, SENSOR_STRATA, &mut random);
                let full = PI * maps.radius * maps.radius;
                let gathered =
                    density(&maps.planes[number], |radius| domain.area(sensor, radius), full, sensor, maps.radius, 0);
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
        let Some(mut origin) = enter_room(&self.kernel, eye, direction) else { return seen };
        let mut direction = direction;
        let mut from = NO_SURFACE;
        let mut weight = Spectrum::<C>::ONE;
        // density per sr of the ray's direction when a glossy lobe chose it
        let mut chosen = None;
        let (mut transits, mut reflections) = (0, 0);
        while transits < MAX_EYE_TRANSITS && reflections < MAX_REFLECTIONS {
            let hit = self.kernel.intersect(origin, direction, from);
            let index = match hit.place {
                Place::Surface(surface) => {
                    if let Some(luminaire) = self.kernel.luminaire(surface) {
                        seen.irradiance += weight * luminaire.seen(direction);
                        return seen;
                    }
                    let Some(optics) = &self.kernel.surfaces[surface as usize] else { return seen };
                    if optics.gathers() {
                        let brdf = Spectrum::from_rgb(optics.reflectance) * (1.0 / PI);
                        let part = self.irradiance(maps, hit.position, hit.normal, surface, random);
                        seen.bias += part.bias * (weight * brdf).luminance();
                        seen.irradiance += part.irradiance * weight * brdf;
                    }
                    let Some(specular) = &optics.specular else { return seen };
                    let reflectance = Spectrum::from_rgb(specular.reflectance);
                    if let Some(lobe) = &specular.lobe {
                        let reflected = self.diffusers_in_lobe(maps, lobe, &hit, surface, -direction, random);
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
            let tube = &self.kernel.tubes[index];
            let transmittance = match tube.closure_at(hit.position) {
                Closure::Lambertian { .. } => {
                    let exitance = self.exitance(maps, index, hit.position);
                    seen.irradiance += exitance * weight * (share_of(chosen, tube, hit.position - origin) / PI);
                    return seen;
                }
                Closure::Measured(table) => {
                    let luminance = self.measured_luminance(maps, index, table, hit.position, direction);
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
                    let sky = self.kernel.sky.as_ref().map_or(0.0, |sky| sky.luminance(toward));
                    let sun = self.kernel.sun.filter(|sun| sun.covers(toward) && toward.z > 0.0);
                    let outside = sky + sun.map_or(0.0, |sun| sun.luminance_cd_m2());
                    seen.irradiance += weight * outside;
                    return seen;
                }
                // back into the room, through the closure again
                End::Opening if self.kernel.guide_return => {
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

    /// Irradiance of a surface point.
    fn irradiance(
        &self,
        maps: &Maps<C>,
        position: DVec3,
        normal: DVec3,
        surface: SurfaceId,
        random: &mut PathRandom,
    ) -> Gathered<C> {
        let mut gathered = match self.kernel.meshes.as_ref().and_then(|meshes| Some((meshes, meshes.facet(surface)?))) {
            Some((meshes, facet)) => {
                let area = |radius| meshes.facets.area_within(facet, position, radius);
                let full = meshes.facets.areas_m2[facet].min(PI * maps.radius * maps.radius);
                density(&maps.surfaces, area, full, position, maps.radius, surface)
            }
            None => {
                let domain = &self.domains[surface as usize];
                let area = |radius| domain.area(position, radius);
                density(&maps.surfaces, area, PI * maps.radius * maps.radius, position, maps.radius, surface)
            }
        };
        let direct = self.diffuser_irradiance(maps, position, normal, surface, POINT_CONNECTIONS, random);
        gathered.irradiance += direct;
        gathered.irradiance += self.luminaire_irradiance(position, normal, surface, POINT_STRATA, random);
        gathered
    }

    /// Irradiance straight from the diffusers, by connections to some of the photons that they scattered.
    fn diffuser_irradiance(
        &self,
        maps: &Maps<C>,
        position: DVec3,
        normal: DVec3,
        surface: SurfaceId,
        connections: usize,
        random: &mut PathRandom,
    ) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        for (index, exits) in maps.exits.iter().enumerate() {
            let diffuser = &self.kernel.tubes[index].diffuser;
            let count = connections.min(exits.len());
            for k in 0..count {
                let stratum = (k as f64 + random.uniform()) / count as f64;
                let number = ((stratum * exits.len() as f64) as usize).min(exits.len() - 1);
                let exit = &exits[number];
                let way = exit.position - position;
                let distance_squared = way.length_squared();
                let cosines = way.dot(normal) * way.z;
                if cosines > 0.0 && way.z > 0.0 && self.kernel.visible(position, surface, exit.position, NO_SURFACE) {
                    let mut geometry = cosines / (distance_squared * distance_squared) / PI;
                    if let Diffuser::Measured(table) = diffuser {
                        let down = way.z / distance_squared.sqrt();
                        geometry *= PI * measured_per_sr(table, maps.incidents[index][number], down);
                    }
                    sum += exit.flux * (geometry * exits.len() as f64 / count as f64);
                }
            }
        }
        sum
    }

    /// Irradiance straight from the luminaires: in closed form, or from `strata` x `strata` points of each.
    fn luminaire_irradiance(
        &self,
        position: DVec3,
        normal: DVec3,
        surface: SurfaceId,
        strata: usize,
        random: &mut PathRandom,
    ) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        for luminaire in self.kernel.luminaires.iter().filter(|luminaire| luminaire.emits()) {
            if !self.kernel.luminaires_obstructed {
                sum += luminaire.irradiance(position, normal);
                continue;
            }
            let share = 1.0 / strata as f64;
            for stratum in 0..strata * strata {
                let [u, v] = random.uniform2();
                let source = luminaire
                    .point([((stratum % strata) as f64 + u) * share, ((stratum / strata) as f64 + v) * share])
                    .clamp(DVec3::ZERO, self.kernel.size);
                let arriving: Spectrum<C> = luminaire.connection(source, position, normal);
                if arriving.max() > 0.0 && self.kernel.visible(position, surface, source, luminaire.surface) {
                    sum += arriving * (share * share);
                }
            }
        }
        sum
    }

    /// Luminance in cd/m2 of a measured diffuser along the eye ray's `direction` to a point of its lower side.
    fn measured_luminance(
        &self,
        maps: &Maps<C>,
        index: usize,
        table: &MeasuredDiffuser,
        position: DVec3,
        direction: DVec3,
    ) -> Spectrum<C> {
        let tube = &self.kernel.tubes[index];
        let radius = maps.radius.min(0.25 * tube.opening_radius);
        let mut sum = Spectrum::ZERO;
        if let Some(grid) = &maps.measured_exits[index] {
            grid.for_each_within(position, radius, |photon, _| {
                let incident = maps.incidents[index][photon.surface as usize];
                sum += photon.flux * measured_per_sr(table, incident, direction.z);
            });
        }
        let area = disc_disc_area(radius, tube.opening_radius, (position - tube.origin).truncate().length());
        if area < LEAST_KERNEL * PI * radius * radius { Spectrum::ZERO } else { sum * (1.0 / area) }
    }

    /// Luminance toward `eye` (a unit vector) of the diffusers in a glossy lobe of reflectance 1, the share of connections.
    fn diffusers_in_lobe(
        &self,
        maps: &Maps<C>,
        lobe: &Glossy,
        hit: &RoomHit,
        surface: SurfaceId,
        eye: DVec3,
        random: &mut PathRandom,
    ) -> Spectrum<C> {
        let mut sum = Spectrum::ZERO;
        for (index, exits) in maps.exits.iter().enumerate() {
            let tube = &self.kernel.tubes[index];
            let count = POINT_CONNECTIONS.min(exits.len());
            for k in 0..count {
                let stratum = (k as f64 + random.uniform()) / count as f64;
                let number = ((stratum * exits.len() as f64) as usize).min(exits.len() - 1);
                let exit = &exits[number];
                let way = exit.position - hit.position;
                let distance_squared = way.length_squared();
                let toward = way / distance_squared.sqrt();
                let density = if toward.z > 0.0 { lobe.density(hit.normal, eye, toward) } else { 0.0 };
                if density > 0.0 && self.kernel.visible(hit.position, surface, exit.position, NO_SURFACE) {
                    let connected = connection_density(tube, way);
                    let share = connected / (density + connected);
                    let per_sr = match &tube.diffuser {
                        Diffuser::Measured(table) => {
                            toward.z * measured_per_sr(table, maps.incidents[index][number], toward.z)
                        }
                        _ => toward.z / PI,
                    };
                    let geometry = density * per_sr / distance_squared;
                    sum += exit.flux * (share * geometry * exits.len() as f64 / count as f64);
                }
            }
        }
        sum
    }

    /// Luminous exitance in lm/m2 of a diffuser at a point of its lower side.
    fn exitance(&self, maps: &Maps<C>, index: usize, position: DVec3) -> Spectrum<C> {
        let tube = &self.kernel.tubes[index];
        let radius = maps.radius.min(0.25 * tube.opening_radius);
        let (flux, _) = maps.exit_grid.gather(position, radius, index as SurfaceId);
        let distance = (position - tube.origin).truncate().length();
        let mut area = disc_disc_area(radius, tube.opening_radius, distance);
        if let Some((inner, outer)) = tube.diffuser.specular_zone(tube.opening_radius) {
            area -= disc_disc_area(radius, outer, distance) - disc_disc_area(radius, inner, distance);
        }
        if area < LEAST_KERNEL * PI * radius * radius { Spectrum::ZERO } else { flux * (1.0 / area) }
    }
}

impl<const C: usize> Integrator for Sppm<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.child(pass);
        let radius = self.radius(pass);
        let (store, account) = self.trace_photons(key, cancel)?;
        let measured = |tube: usize| matches!(self.kernel.tubes[tube].diffuser, Diffuser::Measured(_));
        let all_exits: Vec<Photon<C>> =
            (0..store.exits.len()).filter(|tube| !measured(*tube)).flat_map(|tube| store.exits[tube].clone()).collect();
        let measured_exits = (0..store.exits.len())
            .map(|tube| {
                let exits = store.exits[tube].iter().enumerate();
                let numbered: Vec<_> =
                    exits.map(|(number, exit)| Photon { surface: number as SurfaceId, ..*exit }).collect();
                let cell = radius.min(0.25 * self.kernel.tubes[tube].opening_radius);
                (measured(tube) && !self.views.is_empty()).then(|| PhotonGrid::new(&numbered, cell))
            })
            .collect();
        let maps = Maps {
            surfaces: PhotonGrid::new(&store.surfaces, radius),
            planes: store.planes.iter().map(|photons| PhotonGrid::new(photons, radius)).collect(),
            exit_grid: PhotonGrid::new(&all_exits, radius.min(0.25 * self.smallest_opening())),
            exits: store.exits,
            measured_exits,
            incidents: store.incidents,
            radius,
        };
        let grids = (0..self.grids.len()).map(|number| self.grid(number, &maps, key)).collect();
        let views = (0..self.views.len()).map(|number| self.view(number, &maps, key, cancel)).collect::<Option<_>>()?;
        Some(Pass { grids, views, account, photons: self.emission.photons() })
    }
}

impl<const C: usize> Sppm<C> {
    fn smallest_opening(&self) -> f64 {
        self.kernel.tubes.iter().map(|tube| tube.opening_radius).fold(f64::INFINITY, f64::min)
    }
}

/// BTDF or BRDF per sr of a measured diffuser for light that leaves downward with the given cosine.
fn measured_per_sr(table: &MeasuredDiffuser, incident: DVec3, exit_cosine: f64) -> f64 {
    table.per_sr(incident.z < 0.0, incident.z.abs(), exit_cosine)
}

/// The share of a diffuser's light that a ray takes which finds it along `way`; `chosen` is the density with which a
/// glossy lobe chose the direction, `None` when none did.
fn share_of(chosen: Option<f64>, tube: &TubeKernel, way: DVec3) -> f64 {
    chosen.map_or(1.0, |density| density / (density + connection_density(tube, way)))
}

/// Connections per sr along `way` to a diffuser, as if its photons were even on the opening: what the two ways to find it
/// share its light by.
fn connection_density(tube: &TubeKernel, way: DVec3) -> f64 {
    let distance_squared = way.length_squared();
    let area = PI * tube.opening_radius * tube.opening_radius;
    POINT_CONNECTIONS as f64 * distance_squared * distance_squared.sqrt() / (way.z * area)
}

/// Irradiance by density estimation on a clipped disc, with its bias estimated from the half of the disc's area; `area` of
/// the disc of a radius, at most `full`.
fn density<const C: usize>(
    photons: &PhotonGrid<C>,
    area: impl Fn(f64) -> f64,
    full: f64,
    centre: DVec3,
    radius: f64,
    surface: SurfaceId,
) -> Gathered<C> {
    let half_radius = radius * std::f64::consts::FRAC_1_SQRT_2;
    let (whole_area, half_area) = (area(radius), area(half_radius));
    let least = LEAST_KERNEL * full;
    if whole_area < least || half_area < least {
        return Gathered { irradiance: Spectrum::ZERO, bias: 0.0 };
    }
    let (whole, half) = photons.gather(centre, radius, surface);
    let irradiance = whole * (1.0 / whole_area);
    // to one side the kernel sees the gradient, around the centre only the curvature
    let clipped = whole_area < (1.0 - 1e-9) * PI * radius * radius;
    let factor = if clipped { 1.0 / (1.0 - std::f64::consts::FRAC_1_SQRT_2) } else { 2.0 };
    let bias = factor * (irradiance.luminance() - half.luminance() / half_area);
    Gathered { irradiance, bias }
}

/// Whether light comes straight from where it is computed without density estimation.
fn is_direct(origin: Origin) -> bool {
    matches!(origin, Origin::Diffuser | Origin::Luminaire(_))
}

/// Photons that one pass keeps.
struct Store<'a, const C: usize> {
    kernel: &'a Kernel,
    heights: Vec<f64>,
    /// Height above a plane at which it counts as reached.
    contact: f64,
    keeps_surfaces: bool,
    surfaces: Vec<Photon<C>>,
    planes: Vec<Vec<Photon<C>>>,
    exits: Vec<Vec<Photon<C>>>,
    incidents: Vec<Vec<DVec3>>,
}

impl<'a, const C: usize> Store<'a, C> {
    fn new(kernel: &'a Kernel, grids: &[Grid], keeps_surfaces: bool) -> Self {
        Self {
            kernel,
            heights: grids.iter().map(|grid| grid.height_m).collect(),
            contact: kernel.contact(),
            keeps_surfaces,
            surfaces: Vec::new(),
            planes: vec![Vec::new(); grids.len()],
            exits: vec![Vec::new(); kernel.tubes.len()],
            incidents: vec![Vec::new(); kernel.tubes.len()],
        }
    }

    fn append(&mut self, mut other: Self) {
        self.surfaces.append(&mut other.surfaces);
        for (all, part) in self.planes.iter_mut().zip(&mut other.planes) {
            all.append(part);
        }
        for (all, part) in self.exits.iter_mut().zip(&mut other.exits) {
            all.append(part);
        }
        for (all, part) in self.incidents.iter_mut().zip(&mut other.incidents) {
            all.append(part);
        }
    }
}

impl<const C: usize> Visitor<C> for Store<'_, C> {
    fn scattered(&mut self, scattering: &Scattering<'_, C>, _: &mut PathSamples) {
        if let Some(tube) = scattering.diffuser {
            // of a lobe what arrives counts, with its direction
            let flux = scattering.lobe.map_or(scattering.leaving, |lobe| lobe.flux);
            self.incidents[tube].extend(scattering.lobe.map(|lobe| lobe.incident));
            let photon = Photon { position: scattering.position, surface: tube as SurfaceId, flux };
            self.exits[tube].push(photon);
        }
    }

    fn emitted(&mut self, _: &Scattering<C>, _: &mut PathSamples) {}

    fn flew(&mut self, flight: &Flight<C>) {
        if is_direct(flight.origin) {
            return;
        }
        for (height, photons) in self.heights.iter().zip(&mut self.planes) {
            let level = height + self.contact;
            if flight.from.z > level && flight.to.z <= level {
                let share = (flight.from.z - height) / (flight.from.z - flight.to.z);
                let crossing: DVec2 = flight.from.truncate().lerp(flight.to.truncate(), share);
                photons.push(Photon { position: crossing.extend(*height), surface: 0, flux: flight.flux });
            }
        }
    }

    fn arrived(&mut self, surface: SurfaceId, position: DVec3, flux: Spectrum<C>, origin: Origin) {
        let gathers = || self.kernel.surfaces[surface as usize].as_ref().is_some_and(SurfaceKernel::gathers);
        if self.keeps_surfaces && !is_direct(origin) && gathers() {
            self.surfaces.push(Photon { position, surface, flux });
        }
    }
}

//! Photon maps: the photons of one pass, sorted for gathering on surfaces, on the planes of grids, and at diffusers.
//!
//! For final gathering, caustics are kept in maps of their own: light that has not been scattered diffusely since it left a luminaire, a
//! diffuser or a clear closure, except direct light from luminaires and diffusers.
//!
//! Direct light from a diffuser or a luminaire is not density-estimated: `photon_map::near_light` computes it. Kernels are clipped to the
//! surface they lie on and count photons of that surface only. The bias of a kernel is estimated from the same photons at two radii: on a
//! whole disc it grows with the squared radius, so bias(r) = 2 (E(r) - E(r / sqrt 2)); on a clipped disc, which lies to one side of its
//! centre, it grows with the radius: bias(r) = (E(r) - E(r / sqrt 2)) / (1 - 1 / sqrt 2).
//!
//! Both factors are derived in docs/physics/rooms.md#the-bias-of-a-clipped-disc.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::domain::Domain;
use super::grid::{LiesOn, Photon, PhotonGrid};
use super::progressive::scaled_count;
use super::store::{Caustics, FollowedBackward, PhotonStore, Sunbeam, Tube};
use super::surfaces::Surfaces;
use crate::integrator::PhotonCount;
use crate::integrator::photon::chunks::{Chunks, Tally, fold_chunks};
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::integrator::photon::path::trace;
use crate::optics::{Diffuser, Glossy, Spectrum, SurfaceOptics};
use crate::sampling::{Key, PathRandom};
use crate::scene::Grid;
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableScene, TraceableTube};

/// Number of points per side of the square of strata on each luminaire, and number of photons at each diffuser, that a visible point is
/// connected to.
pub const POINT_STRATA: usize = 2;
pub const POINT_CONNECTIONS: usize = 4;

/// Smallest area of a clipped kernel, as a fraction of the full disc, on which photons are counted; a smaller one estimates 0.
pub const LEAST_KERNEL: f64 = 1e-6;

/// Largest radius within which sunbeams are gathered, in radii of the smallest opening.
const BEAM_RADIUS: f64 = 0.2;

/// Scene, emission and clipped domains from which the photon maps of a pass are made.
#[derive(Debug)]
pub struct Mapper<const C: usize> {
    pub scene: Arc<TraceableScene>,
    emission: Emission,
    /// Number of the sun's photons per sr and per m2 of area perpendicular to its direction, by tube.
    sun_densities: Vec<f64>,
    pub grids: Vec<Grid>,
    grid_domains: Vec<Domain>,
    surfaces: Surfaces,
    /// True if photons on surfaces and at diffusers are needed.
    keeps_surfaces: bool,
    /// Light that the caustics leave out; `None` if caustics have no maps of their own.
    caustics: Option<Caustics>,
    /// True if photons that are counted there can cross the planes of grids.
    crosses_planes: bool,
}

/// Position of a photon in the list that it is taken from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Numbered(pub u32);

impl LiesOn for Numbered {
    fn number(self) -> u32 {
        self.0
    }
}

/// Photons of one pass.
pub struct Maps<const C: usize> {
    /// Photons on surfaces, without direct light from diffusers and luminaires.
    pub surfaces: PhotonGrid<C>,
    /// Caustics on surfaces, if they have maps of their own; these photons are among `surfaces` too.
    pub caustics: PhotonGrid<C>,
    /// Photons that cross each grid's plane downward, without direct light from diffusers and luminaires; only caustics if these have maps
    /// of their own.
    pub planes: Vec<PhotonGrid<C, ()>>,
    /// Photons scattered downward at each tube's diffuser.
    pub exits: Vec<Vec<Photon<C, Tube>>>,
    pub exit_grid: PhotonGrid<C, Tube>,
    /// Photons scattered at diffusers with a measured BSDF, by tube; `None` for other tubes.
    pub measured_exits: Vec<Option<PhotonGrid<C, Numbered>>>,
    /// Directions of the light that arrived at a tube's exits, for a measured diffuser; the flux of an exit is then that which arrived.
    pub incidents: Vec<Vec<DVec3>>,
    /// Sunbeams through clear closures that arrive at glossy surfaces, also by way of mirrors and lobes, numbered as in `beam_arrivals`.
    beams: PhotonGrid<C, Numbered>,
    /// Surface that each sunbeam arrives at, with its tube and direction.
    beam_arrivals: Vec<(SurfaceId, Sunbeam)>,
    /// Mean flux in lm of the photons that cross each grid's plane, and that of the brightest of them (see `brightest_lm`); where none
    /// crosses, the mean flux of the photons on surfaces.
    crossing_lm: Vec<[f64; 2]>,
    /// Mean flux in lm of the photons on surfaces; where none lies there, that of the photons at diffusers, or else of all photons.
    pub on_surfaces_lm: f64,
    /// Radius in metres for which the photons are sorted: gathering within any other radius is right too, and as fast within one of this
    /// order.
    pub radius: f64,
}

/// Irradiance in lux with its estimated bias and the number of photons.
#[derive(Clone, Copy)]
pub struct Gathered<const C: usize> {
    pub irradiance: Spectrum<C>,
    pub bias: f64,
    /// Number of photons in the kernel, scaled to its full disc.
    pub found: f64,
}

impl<const C: usize> Gathered<C> {
    pub const NOTHING: Self = Self { irradiance: Spectrum::ZERO, bias: 0.0, found: 0.0 };

    /// Adds irradiance from another estimate, with its bias.
    pub fn add_light(&mut self, other: &Self) {
        self.irradiance += other.irradiance;
        self.bias += other.bias;
    }
}

impl<const C: usize> Mapper<C> {
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], keeps_surfaces: bool, photons_per_pass: u64) -> Self {
        let emission = Emission::new(&scene, photons_per_pass);
        let sun_densities = (0..scene.tubes.len()).map(|tube| emission.sun_density(&scene, tube)).collect();
        Self {
            emission,
            sun_densities,
            grids: grids.to_vec(),
            grid_domains: grids.iter().map(|grid| Domain::horizontal_plane(&scene, grid.height_m)).collect(),
            surfaces: Surfaces::new(&scene),
            keeps_surfaces,
            caustics: None,
            crosses_planes: scene.tubes.iter().any(passes_unscattered) || reflects(&scene, |_| true),
            scene,
        }
    }

    /// Keeps caustics in maps of their own: planes then count nothing else. `backward`: light that is followed backward, by tube.
    pub fn with_caustics(self, backward: Vec<FollowedBackward>) -> Self {
        let left = |(tube, by): (&TraceableTube, &FollowedBackward)| passes_unscattered(tube) && !(by.sky && by.sun);
        let crosses_planes =
            self.scene.tubes.iter().zip(&backward).any(left) || reflects(&self.scene, SurfaceOptics::is_specular);
        Self { caustics: Some(Caustics { backward }), crosses_planes, ..self }
    }

    /// Returns the number of photons per pass.
    pub fn photons(&self) -> u64 {
        self.emission.photons()
    }

    /// Traces the photons of the pass with this key and sorts them for a gather radius in metres; returns `None` if cancelled.
    pub fn maps(&self, key: Key, radius: f64, cancel: &AtomicBool) -> Option<(Maps<C>, PhotonTotals)> {
        let (store, totals) = self.trace_photons(key, cancel)?;
        let measured = |tube: usize| matches!(self.scene.tubes[tube].diffuser, Diffuser::Measured(_));
        let all_exits: Vec<Photon<C, Tube>> =
            (0..store.exits.len()).filter(|tube| !measured(*tube)).flat_map(|tube| store.exits[tube].clone()).collect();
        let measured_exits = (0..store.exits.len())
            .map(|tube| {
                let numbered = numbered(store.exits[tube].iter());
                let cell = radius.min(0.25 * self.scene.tubes[tube].opening.inner_radius());
                measured(tube).then(|| PhotonGrid::new(&numbered, cell))
            })
            .collect();
        let nearest_lm = if self.scene.is_dark() {
            0.0
        } else {
            let arrived = totals.energy.emitted + totals.energy.luminaires;
            let exits = mean_lm(store.exits.iter().flatten());
            exits.unwrap_or(arrived / self.photons().max(1) as f64)
        };
        let on_surfaces_lm = mean_lm(&store.surfaces).unwrap_or(nearest_lm);
        let maps = Maps {
            crossing_lm: store
                .planes
                .iter()
                .map(|plane| [mean_lm(plane), brightest_lm(plane)].map(|flux| flux.unwrap_or(on_surfaces_lm)))
                .collect(),
            on_surfaces_lm,
            beams: PhotonGrid::new(&numbered(store.beams.iter().map(|(photon, _)| photon)), radius),
            beam_arrivals: store.beams.iter().map(|(photon, beam)| (photon.on, *beam)).collect(),
            surfaces: PhotonGrid::new(&store.surfaces, radius),
            caustics: PhotonGrid::new(&store.caustics, radius),
            planes: store.planes.iter().map(|photons| PhotonGrid::new(photons, radius)).collect(),
            exit_grid: PhotonGrid::new(&all_exits, radius.min(0.25 * self.smallest_opening())),
            exits: store.exits,
            measured_exits,
            incidents: store.incidents,
            radius,
        };
        Some((maps, totals))
    }

    fn store(&self) -> PhotonStore<'_, C> {
        PhotonStore::new(&self.scene, &self.grids, self.keeps_surfaces, self.caustics.as_ref())
    }

    fn trace_photons(&self, key: Key, cancel: &AtomicBool) -> Option<(PhotonStore<'_, C>, PhotonTotals)> {
        let chunk = |numbers: Range<u64>| {
            let mut store = self.store();
            let mut totals = PhotonTotals::new(self.scene.tubes.len());
            for number in numbers {
                let (photon, mut samples) = self.emission.photon(&self.scene, key, number);
                if let Some(photon) = photon {
                    store.begin(&photon);
                    trace::<C>(&self.scene, &photon, &mut samples, &mut store, &mut totals);
                }
            }
            (store, totals)
        };
        let mut all = self.store();
        let mut totals = PhotonTotals::new(self.scene.tubes.len());
        let folded = fold_chunks(
            Chunks::of_long_paths(self.emission.photons()),
            0,
            cancel,
            chunk,
            |(store, part): (PhotonStore<C>, PhotonTotals)| {
                all.append(store);
                totals.add(&part);
            },
        )?;
        totals.not_finite = folded.not_finite;
        Some((all, totals))
    }

    /// Estimates the irradiance of a surface point from photons within `radius` metres, and by connections to diffusers and luminaires.
    pub fn irradiance(
        &self,
        maps: &Maps<C>,
        radius: f64,
        position: DVec3,
        normal: DVec3,
        surface: SurfaceId,
        random: &mut PathRandom,
    ) -> Gathered<C> {
        let mut gathered = self.indirect(maps, radius, position, surface);
        let direct = self.diffuser_irradiance(maps, position, normal, Some(surface), POINT_CONNECTIONS, random);
        gathered.add_light(&direct);
        gathered.irradiance += self.luminaire_irradiance(position, normal, Some(surface), POINT_STRATA, random);
        gathered
    }

    /// Estimates the indirect irradiance of a surface point from photons within `radius` metres.
    pub fn indirect(&self, maps: &Maps<C>, radius: f64, position: DVec3, surface: SurfaceId) -> Gathered<C> {
        self.on_surface(&maps.surfaces, radius, position, surface)
    }

    /// Estimates the irradiance of a surface point by caustics from photons within `radius` metres, if caustics have maps of their own.
    pub fn caustics(&self, maps: &Maps<C>, radius: f64, position: DVec3, surface: SurfaceId) -> Gathered<C> {
        self.on_surface(&maps.caustics, radius, position, surface)
    }

    /// Returns the luminance in cd/m2 toward `eye` (a unit vector) of a glossy lobe of reflectance 1 lit by sunbeams through clear
    /// closures, and its estimated bias. This is the part that photons count: the balance heuristic divides the light between them and the
    /// eye ray, which continues in a direction sampled from the lobe and may meet the sun (Veach and Guibas 1995).
    pub fn beams_in_lobe(&self, maps: &Maps<C>, lobe: &Glossy, hit: &RoomHit, eye: DVec3) -> (Spectrum<C>, f64) {
        let Place::Surface(surface) = hit.place else { return (Spectrum::ZERO, 0.0) };
        let radius = self.beam_radius(maps);
        let half_squared = 0.5 * (radius * radius);
        let (mut whole, mut half) = (Spectrum::<C>::ZERO, Spectrum::<C>::ZERO);
        maps.beams.for_each_within(hit.position, radius, |number, flux, distance_squared| {
            let (of, beam) = maps.beam_arrivals[number as usize];
            if of == surface {
                let brdf = lobe.density(hit.normal, -beam.direction, eye) / eye.dot(hit.normal);
                let chosen = lobe.density(hit.normal, eye, -beam.direction);
                let gathered = self.beams_gathered(maps, beam.tube, -beam.direction.dot(hit.normal));
                let fraction = gathered / (gathered + chosen);
                whole += flux * (brdf * fraction);
                if distance_squared < half_squared {
                    half += flux * (brdf * fraction);
                }
            }
        });
        if whole.max() <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let seen = self.per_area(radius, hit.position, surface, whole, half, 0);
        (seen.irradiance, seen.bias)
    }

    /// Returns the number of photons per sr, about a direction in which the sun is seen through a tube, that are gathered on a surface
    /// where its light arrives at this cosine: the balance heuristic compares it with the density of an eye ray.
    pub fn beams_gathered(&self, maps: &Maps<C>, tube: usize, cosine: f64) -> f64 {
        let radius = self.beam_radius(maps);
        self.sun_densities[tube] * PI * radius * radius * cosine.max(0.0)
    }

    /// Returns the radius in metres within which sunbeams are gathered. It is bounded by the openings, because a beam is as wide as its
    /// opening.
    fn beam_radius(&self, maps: &Maps<C>) -> f64 {
        maps.radius.min(BEAM_RADIUS * self.smallest_opening())
    }

    fn on_surface(&self, photons: &PhotonGrid<C>, radius: f64, position: DVec3, surface: SurfaceId) -> Gathered<C> {
        let (whole, half, count) = photons.gather(position, radius, surface);
        self.per_area(radius, position, surface, whole, half, count)
    }

    /// Returns the density per m2 of the flux on a surface: `whole` within `radius` metres, and `half` within half that area.
    fn per_area(
        &self,
        radius: f64,
        position: DVec3,
        surface: SurfaceId,
        whole: Spectrum<C>,
        half: Spectrum<C>,
        count: u64,
    ) -> Gathered<C> {
        let sums = (whole, half, count);
        let area = |radius| self.surfaces.area(&self.scene, surface, position, radius);
        density(sums, area, self.surfaces.full(&self.scene, surface, radius), radius)
    }

    /// Estimates the illuminance of a point of the plane of grid `number`, by all indirect light, or by caustics if these have maps of
    /// their own, from photons within `radius` metres; also returns the number of photons it comes from.
    pub fn plane_irradiance(
        &self,
        maps: &Maps<C>,
        radius: f64,
        number: usize,
        sensor: DVec3,
    ) -> (Gathered<C>, PhotonCount) {
        let domain = &self.grid_domains[number];
        let sums = maps.planes[number].gather(sensor, radius, ());
        let full = PI * radius * radius;
        let area = domain.area(sensor, radius);
        // no light arrives under solids that stand on the plane
        let can_come = self.crosses_planes && area >= LEAST_KERNEL * full;
        let [one_lux, brightest_lux] =
            if can_come { maps.crossing_lm[number].map(|flux| flux / area) } else { [0.0; 2] };
        let count = PhotonCount { found: sums.2 as f64, one_lux, brightest_lux };
        (density(sums, |radius| domain.area(sensor, radius), full, radius), count)
    }

    /// True if a point of the plane of grid `number`, or the whole plane within `reach` metres of it, is inside a box or a closed mesh.
    pub fn is_covered(&self, number: usize, sensor: DVec3, reach: f64) -> bool {
        let reach = reach.max(self.scene.coinciding());
        self.grid_domains[number].area(sensor, reach) < LEAST_KERNEL * PI * reach * reach
    }

    fn smallest_opening(&self) -> f64 {
        self.scene.tubes.iter().map(|tube| tube.opening.inner_radius()).fold(f64::INFINITY, f64::min)
    }
}

impl<const C: usize> Tally for (PhotonStore<'_, C>, PhotonTotals) {
    fn is_finite(&self) -> bool {
        self.0.is_finite() && self.1.is_finite()
    }
}

/// Estimates irradiance on a clipped disc, with the bias estimated from the disc of half the area. The arguments are the flux in the whole
/// and the half disc and the number of photons in the whole one, a function that returns the clipped area in m2 of a disc by its radius,
/// the largest such area `full`, and the radius in m.
pub fn density<const C: usize>(
    (whole, half, count): (Spectrum<C>, Spectrum<C>, u64),
    area: impl Fn(f64) -> f64,
    full: f64,
    radius: f64,
) -> Gathered<C> {
    let half_radius = radius * std::f64::consts::FRAC_1_SQRT_2;
    let (whole_area, half_area) = (area(radius), area(half_radius));
    let least = LEAST_KERNEL * full;
    if whole_area < least || half_area < least {
        return Gathered::NOTHING;
    }
    let irradiance = whole * (1.0 / whole_area);
    // a clipped kernel is biased by the gradient, a whole one only by the curvature
    let clipped = whole_area < (1.0 - 1e-9) * PI * radius * radius;
    let factor = if clipped { 1.0 / (1.0 - std::f64::consts::FRAC_1_SQRT_2) } else { 2.0 };
    let bias = factor * (irradiance.luminance() - half.luminance() / half_area);
    Gathered { irradiance, bias, found: scaled_count(count, PI * radius * radius, whole_area) }
}

/// Returns the mean flux in lm of some photons; `None` without any.
fn mean_lm<'a, const C: usize, On: 'a>(photons: impl IntoIterator<Item = &'a Photon<C, On>>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for photon in photons {
        sum += photon.flux.luminance();
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// Returns the flux in lm of the photons that dominate the variance of the sum: the mean weighted by squared flux; `None` without any.
fn brightest_lm<'a, const C: usize, On: 'a>(photons: impl IntoIterator<Item = &'a Photon<C, On>>) -> Option<f64> {
    let (mut squares, mut cubes) = (0.0, 0.0);
    for photon in photons {
        let flux = photon.flux.luminance();
        squares += flux * flux;
        cubes += flux * flux * flux;
    }
    (squares > 0.0).then(|| cubes / squares)
}

/// True if a tube lets light pass into the room unscattered.
fn passes_unscattered(tube: &TraceableTube) -> bool {
    tube.specular_zone().is_some()
}

/// True if some surface whose optics satisfy `part` reflects light that is followed.
fn reflects(scene: &TraceableScene, part: impl Fn(&SurfaceOptics) -> bool) -> bool {
    let bright = |surface: &&SurfaceOptics| surface.gathers() || surface.is_specular();
    scene.interreflection && scene.all_optics().filter(bright).any(part)
}

/// Replaces the surface or tube of each photon by its position in the list.
fn numbered<'a, const C: usize, On: Copy + 'a>(
    photons: impl Iterator<Item = &'a Photon<C, On>>,
) -> Vec<Photon<C, Numbered>> {
    let numbers = (0..).map(Numbered);
    photons.zip(numbers).map(|(photon, on)| Photon { position: photon.position, on, flux: photon.flux }).collect()
}

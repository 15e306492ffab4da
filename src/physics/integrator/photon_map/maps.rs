//! Photon maps: the photons of one pass, sorted for gathering on surfaces and grids' planes, and at diffusers.
//!
//! Final gathering wants caustics apart: light that has not been scattered diffusely since it left a luminaire, a diffuser
//! or a clear closure, but for what comes straight from the former two.
//!
//! Light that a diffuser or a luminaire sends straight to a point is not density-estimated: `photon_map::near_light`
//! computes it. Kernels are clipped to the surface they lie on and count photons of that surface only. The bias of a
//! kernel is estimated from the same photons at two radii: on a whole disc it grows with the squared radius, so bias(r) =
//! 2 (E(r) - E(r / sqrt 2)); on a clipped one, which lies to one side of its centre, with the radius: bias(r) = (E(r) -
//! E(r / sqrt 2)) / (1 - 1 / sqrt 2).
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
use crate::integrator::photon::ledger::Account;
use crate::integrator::photon::path::trace;
use crate::optics::{Diffuser, Glossy, Spectrum, SurfaceOptics};
use crate::sampling::{Key, PathRandom};
use crate::scene::Grid;
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableScene, TraceableTube};

/// Points of each luminaire, in a square of strata, and photons at each diffuser, to which a visible point is connected.
pub const POINT_STRATA: usize = 2;
pub const POINT_CONNECTIONS: usize = 4;

/// A clipped kernel below this share of the full disc has no room for photons.
pub const LEAST_KERNEL: f64 = 1e-6;

/// Largest radius within which sunbeams are gathered, in radii of the smallest opening.
const BEAM_RADIUS: f64 = 0.2;

/// A scene as its photons are mapped.
#[derive(Debug)]
pub struct Mapper<const C: usize> {
    pub scene: Arc<TraceableScene>,
    emission: Emission,
    /// Photons of the sun per sr and per m2 across its direction, by tube.
    sun_densities: Vec<f64>,
    pub grids: Vec<Grid>,
    grid_domains: Vec<Domain>,
    surfaces: Surfaces,
    /// True if photons on surfaces, and at points of diffusers, are looked for.
    keeps_surfaces: bool,
    /// `None`: caustics are not set apart.
    caustics: Option<Caustics>,
    /// True if photons can cross the planes of grids that count there.
    crosses_planes: bool,
}

/// Position of a photon in the list that it comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Numbered(pub u32);

impl LiesOn for Numbered {
    fn number(self) -> u32 {
        self.0
    }
}

/// Photons of one pass.
pub struct Maps<const C: usize> {
    /// Photons on surfaces, without light straight from a diffuser.
    pub surfaces: PhotonGrid<C>,
    /// Caustics on surfaces, where they are set apart; they are among `surfaces` too.
    pub caustics: PhotonGrid<C>,
    /// Crossings of each grid's plane, downward, but for light straight from a diffuser; caustics only where they are set
    /// apart.
    pub planes: Vec<PhotonGrid<C, ()>>,
    /// Scattered downward at each tube's diffuser.
    pub exits: Vec<Vec<Photon<C, Tube>>>,
    pub exit_grid: PhotonGrid<C, Tube>,
    /// Exits of measured diffusers.
    pub measured_exits: Vec<Option<PhotonGrid<C, Numbered>>>,
    /// Directions of the light that arrived at a tube's exits, where it is measured; flux is then what arrived.
    pub incidents: Vec<Vec<DVec3>>,
    /// Sunbeams through clear closures that arrive at glossy surfaces, also by mirrors and lobes, numbered as `beam_arrivals`.
    beams: PhotonGrid<C, Numbered>,
    /// The surface of each, and where it comes from.
    beam_arrivals: Vec<(SurfaceId, Sunbeam)>,
    /// Mean flux in lm of the photons that cross each grid's plane, and that of the brightest, or where none does, of those nearest
    /// to doing so.
    crossing_lm: Vec<[f64; 2]>,
    /// Mean flux in lm of the photons on surfaces, or where none lies there, of those nearest to doing so.
    pub on_surfaces_lm: f64,
    /// Radius in metres for which the photons are sorted: gathering within any other is right, too, and as fast within
    /// one of this order.
    pub radius: f64,
}

/// Irradiance in lux and its estimated bias.
#[derive(Clone, Copy)]
pub struct Gathered<const C: usize> {
    pub irradiance: Spectrum<C>,
    pub bias: f64,
    /// Photons in the kernel, scaled to its full disc.
    pub found: f64,
}

impl<const C: usize> Gathered<C> {
    pub const NOTHING: Self = Self { irradiance: Spectrum::ZERO, bias: 0.0, found: 0.0 };

    /// Adds light that comes otherwise, and its bias.
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

    /// Sets caustics apart: planes then count nothing else. `backward`: by tube.
    pub fn with_caustics(self, backward: Vec<FollowedBackward>) -> Self {
        let left = |(tube, by): (&TraceableTube, &FollowedBackward)| passes_unscattered(tube) && !(by.sky && by.sun);
        let crosses_planes =
            self.scene.tubes.iter().zip(&backward).any(left) || reflects(&self.scene, SurfaceOptics::is_specular);
        Self { caustics: Some(Caustics { backward }), crosses_planes, ..self }
    }

    /// Photons per pass.
    pub fn photons(&self) -> u64 {
        self.emission.photons()
    }

    /// Traces the photons of the pass with this key and sorts them for a gather radius in metres; `None` when cancelled.
    pub fn maps(&self, key: Key, radius: f64, cancel: &AtomicBool) -> Option<(Maps<C>, Account)> {
        let (store, account) = self.trace_photons(key, cancel)?;
        let measured = |tube: usize| matches!(self.scene.tubes[tube].diffuser, Diffuser::Measured(_));
        let all_exits: Vec<Photon<C, Tube>> =
            (0..store.exits.len()).filter(|tube| !measured(*tube)).flat_map(|tube| store.exits[tube].clone()).collect();
        let measured_exits = (0..store.exits.len())
            .map(|tube| {
                let numbered = numbered(store.exits[tube].iter());
                let cell = radius.min(0.25 * self.scene.tubes[tube].opening_radius);
                measured(tube).then(|| PhotonGrid::new(&numbered, cell))
            })
            .collect();
        let nearest_lm = if self.scene.is_dark() {
            0.0
        } else {
            let arrived = account.ledger.emitted + account.ledger.luminaires;
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
        Some((maps, account))
    }

    fn store(&self) -> PhotonStore<'_, C> {
        PhotonStore::new(&self.scene, &self.grids, self.keeps_surfaces, self.caustics.as_ref())
    }

    fn trace_photons(&self, key: Key, cancel: &AtomicBool) -> Option<(PhotonStore<'_, C>, Account)> {
        let chunk = |numbers: Range<u64>| {
            let mut store = self.store();
            let mut account = Account::new(self.scene.tubes.len());
            for number in numbers {
                let (photon, mut samples) = self.emission.photon(&self.scene, key, number);
                if let Some(photon) = photon {
                    store.begin(&photon);
                    trace::<C>(&self.scene, &photon, &mut samples, &mut store, &mut account);
                }
            }
            (store, account)
        };
        let mut all = self.store();
        let mut account = Account::new(self.scene.tubes.len());
        let folded = fold_chunks(
            Chunks::of_long_paths(self.emission.photons()),
            0,
            cancel,
            chunk,
            |(store, part): (PhotonStore<C>, Account)| {
                all.append(store);
                account.add(&part);
            },
        )?;
        account.not_finite = folded.not_finite;
        Some((all, account))
    }

    /// Irradiance of a surface point, photons gathered within `radius` metres.
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

    /// Irradiance of a surface point by all light that is not direct, within `radius` metres.
    pub fn indirect(&self, maps: &Maps<C>, radius: f64, position: DVec3, surface: SurfaceId) -> Gathered<C> {
        self.on_surface(&maps.surfaces, radius, position, surface)
    }

    /// Irradiance of a surface point by caustics, where they are set apart.
    pub fn caustics(&self, maps: &Maps<C>, radius: f64, position: DVec3, surface: SurfaceId) -> Gathered<C> {
        self.on_surface(&maps.caustics, radius, position, surface)
    }

    /// Luminance in cd/m2 toward `eye` (a unit vector) of a glossy lobe of reflectance 1 in sunbeams through clear closures, and
    /// its estimated bias: the share of it that photons count, by the balance heuristic between them and the eye's ray, which
    /// goes on in a direction of the lobe and may meet the sun (Veach and Guibas 1995).
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
                let share = gathered / (gathered + chosen);
                whole += flux * (brdf * share);
                if distance_squared < half_squared {
                    half += flux * (brdf * share);
                }
            }
        });
        if whole.max() <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let seen = self.per_area(radius, hit.position, surface, whole, half, 0);
        (seen.irradiance, seen.bias)
    }

    /// Photons per sr, about a direction in which the sun is seen through a tube, that are gathered on a surface on which its
    /// light arrives at this cosine: what the balance heuristic compares with the density of an eye ray.
    pub fn beams_gathered(&self, maps: &Maps<C>, tube: usize, cosine: f64) -> f64 {
        let radius = self.beam_radius(maps);
        self.sun_densities[tube] * PI * radius * radius * cosine.max(0.0)
    }

    /// Radius in metres within which sunbeams are gathered: a beam is as wide as an opening.
    fn beam_radius(&self, maps: &Maps<C>) -> f64 {
        maps.radius.min(BEAM_RADIUS * self.smallest_opening())
    }

    fn on_surface(&self, photons: &PhotonGrid<C>, radius: f64, position: DVec3, surface: SurfaceId) -> Gathered<C> {
        let (whole, half, count) = photons.gather(position, radius, surface);
        self.per_area(radius, position, surface, whole, half, count)
    }

    /// Density of what lies on a surface within `radius` metres, and within the half of that area.
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

    /// Illuminance of a point of the plane of grid `number` by all light that is not direct, or by caustics, within `radius`
    /// metres, and the photons that it comes from.
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
        // under what stands on the plane no light comes
        let can_come = self.crosses_planes && area >= LEAST_KERNEL * full;
        let [one_lux, brightest_lux] =
            if can_come { maps.crossing_lm[number].map(|flux| flux / area) } else { [0.0; 2] };
        let count = PhotonCount { found: sums.2 as f64, one_lux, brightest_lux };
        (density(sums, |radius| domain.area(sensor, radius), full, radius), count)
    }

    /// True if a point of the plane of grid `number`, or all that is within `reach` metres of it there, is inside a box or a closed
    /// mesh.
    pub fn is_covered(&self, number: usize, sensor: DVec3, reach: f64) -> bool {
        let reach = reach.max(self.scene.coinciding());
        self.grid_domains[number].area(sensor, reach) < LEAST_KERNEL * PI * reach * reach
    }

    fn smallest_opening(&self) -> f64 {
        self.scene.tubes.iter().map(|tube| tube.opening_radius).fold(f64::INFINITY, f64::min)
    }
}

impl<const C: usize> Tally for (PhotonStore<'_, C>, Account) {
    fn is_finite(&self) -> bool {
        self.0.is_finite() && self.1.is_finite()
    }
}

/// Irradiance by density estimation on a clipped disc, with its bias estimated from the half of the disc's area; the sums of
/// whole and half and the number of photons, `area` of the disc of a radius, at most `full`.
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
    // to one side the kernel sees the gradient, around the centre only the curvature
    let clipped = whole_area < (1.0 - 1e-9) * PI * radius * radius;
    let factor = if clipped { 1.0 / (1.0 - std::f64::consts::FRAC_1_SQRT_2) } else { 2.0 };
    let bias = factor * (irradiance.luminance() - half.luminance() / half_area);
    Gathered { irradiance, bias, found: scaled_count(count, PI * radius * radius, whole_area) }
}

/// Mean flux in lm of some photons; `None` without any.
fn mean_lm<'a, const C: usize, On: 'a>(photons: impl IntoIterator<Item = &'a Photon<C, On>>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0.0);
    for photon in photons {
        sum += photon.flux.luminance();
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count)
}

/// Flux in lm of the photons that the variance of their sum comes from, the mean weighted by squares; `None` without any.
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
    tube.diffuser.specular_zone(tube.opening_radius).is_some()
}

/// True if a surface of which `part` is true reflects light that is followed.
fn reflects(scene: &TraceableScene, part: impl Fn(&SurfaceOptics) -> bool) -> bool {
    let bright = |surface: &&SurfaceOptics| surface.gathers() || surface.is_specular();
    scene.interreflection && scene.all_optics().filter(bright).any(part)
}

/// The same light with its positions in the list.
fn numbered<'a, const C: usize, On: Copy + 'a>(
    photons: impl Iterator<Item = &'a Photon<C, On>>,
) -> Vec<Photon<C, Numbered>> {
    let numbers = (0..).map(Numbered);
    photons.zip(numbers).map(|(photon, on)| Photon { position: photon.position, on, flux: photon.flux }).collect()
}

//! Exchange of light between patches: where rays from each end, the direct light of openings, and the radiosities that follow.

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::area::Area;
use super::bright_patches::{BrightPatches, Target};
use super::met_patches::{FINDING, MetPatch, MetPatches, NOT_FOUND};
use super::other_light::other_light;
use super::patch_rays::{OpeningLight, PatchRays, RAYS, bright_patches};
use super::patches::Patches;
use super::source_images::source_images;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{Mirrors, RoomHit, SurfaceId, SurfacePoint, TraceableScene};

/// Change, as a fraction of all radiosities, below which the iteration ends, and the largest number of sweeps: a remaining error costs
/// time, but adds no bias.
const CHANGED: f64 = 1e-3;
const SWEEPS: usize = 64;

/// Exchange of light between patches, and the direct light of openings: everything that depends on the room alone.
#[derive(Debug)]
pub struct Exchange {
    patches: Patches,
    /// Number of each patch among those that rays meet.
    numbers: Vec<u32>,
    /// Squared lengths of the patches in m2, by these numbers: a sensor that is closer sees the gradient within a patch.
    lengths_squared: Vec<f64>,
    /// Rectangles of the patches, by these numbers; `None` for those of facets.
    areas: Vec<Option<Area>>,
    /// Surfaces of the patches, by these numbers.
    surfaces: Vec<SurfaceId>,
    /// Patches that rays from the starts of paths meet first, by these numbers.
    seen: Vec<u32>,
    /// Patches in which the rays of each patch end, by these numbers, with the weight of their luminances; equally many for each patch, the
    /// first [`RAYS`] of them not aimed.
    met: Vec<(u32, f64)>,
    /// Light by openings: equally many parts for each patch.
    pub(super) of_openings: Vec<OpeningLight>,
    /// Plane mirrors of the room, and narrow lobes as if they were mirrors: the solution may be coarse.
    mirrors: Mirrors,
    /// Points of each patch, at which light that does not come from Lambertian openings is computed; empty where there is none.
    points: Vec<[SurfacePoint; RAYS]>,
}

impl Exchange {
    /// Finds the patches that rays from `starts` meet, directly or after reflections, and how they exchange light: always the same for the same
    /// scene, starts and key. `edge` is the approximate length of an edge of a patch in m. Edges are shorter where luminaires give light, and,
    /// if this is asked for, the sun through clear zones. `random` is the key of the rays between patches. `None` where no light is
    /// reflected, and when `cancel` was raised meanwhile.
    pub fn new(
        (scene, with_clear_zones): (&TraceableScene, bool),
        starts: &[SurfacePoint],
        edge: f64,
        (random, cancel): (Key, &AtomicBool),
    ) -> Option<Self> {
        if !scene.interreflection {
            return None;
        }
        let patches = Patches::new((scene, with_clear_zones), edge);
        let MetPatches { numbers, found, first_seen } = MetPatches::of(scene, &patches, starts, cancel)?;
        let area = |(patch, number): (usize, &u32)| {
            let found = found.get(*number as usize)?;
            Some((*number, patches.area(found.surface, patch)))
        };
        let mut areas = vec![None; found.len()];
        for (number, area) in numbers.iter().enumerate().filter_map(area) {
            areas[number as usize] = area;
        }
        let mirrors = scene.mirrors_and_narrow_lobes();
        let is_cancelled = || cancel.load(Ordering::Relaxed);
        let of_patch = |(number, (patch, area)): (usize, (&MetPatch, &Option<Area>))| {
            let mut random = PathRandom::new(random.child(0).child(number as u64));
            let points = (!is_cancelled()).then(|| patch.spread_points(scene, *area, &mut random))?;
            Some(PatchRays::of((scene, &mirrors), points, &mut random))
        };
        let lit: Option<Vec<PatchRays>> = found.par_iter().zip(&areas).enumerate().map(of_patch).collect();
        let lit = lit?;
        let of_openings = lit.iter().flat_map(|lit| lit.of_openings.iter().copied()).collect();
        let surfaces: Vec<SurfaceId> = found.iter().map(|patch| patch.surface).collect();
        let bright = bright_patches(scene, &lit, &surfaces, &areas);
        let number_of = |point: SurfacePoint| Some(numbers[patches.at(point.surface?, point.position)?]);
        let ends = |(number, lit): (usize, &PatchRays)| {
            let random = random.child(1).child(number as u64);
            (!is_cancelled()).then(|| lit.ends((scene, &bright), number_of, &mut PathRandom::new(random)))
        };
        let met: Option<Vec<Vec<(u32, f64)>>> = lit.par_iter().enumerate().map(ends).collect();
        let met = met?.concat();
        let length = |area: &Option<Area>| area.map_or(edge * edge, |area| area.length_squared());
        let lengths_squared = areas.iter().map(length).collect();
        let seen =
            first_seen.iter().filter_map(|point| Some(numbers[patches.at(point.surface?, point.position)?])).collect();
        let is_lit = with_clear_zones || scene.luminaires.iter().any(TraceableLuminaire::emits);
        let points = if is_lit { lit.into_iter().map(|lit| lit.points).collect() } else { Vec::new() };
        let exchange =
            Self { lengths_squared, numbers, areas, surfaces, seen, met, of_openings, mirrors, points, patches };
        (!exchange.surfaces.is_empty()).then_some(exchange)
    }

    /// Returns the number of rays and connections of which the exchange was computed.
    pub fn rays(&self) -> f64 {
        (self.surfaces.len() * (FINDING + RAYS) + self.met.len()) as f64
    }

    /// Returns the patches in which the rays of each patch end, those that are not aimed first, with the weight of their luminances.
    pub(super) fn met_by_each(&self) -> impl Iterator<Item = &[(u32, f64)]> {
        self.met.chunks_exact(self.met.len() / self.surfaces.len())
    }

    /// Returns the light of each patch by openings.
    pub(super) fn openings_of_each(&self) -> impl Iterator<Item = &[OpeningLight]> {
        self.of_openings.chunks_exact(self.of_openings.len() / self.surfaces.len())
    }

    /// Computes the radiosities in a scene of this room where openings send light of these fluxes in lm, as from Lambertian surfaces, with
    /// these centroids in m from their centres (Gauss and Seidel's sweeps). The light of sky and sun through clear zones of straight tubes counts
    /// if this is asked for.
    pub fn solve<const C: usize>(
        self: &Arc<Self>,
        (scene, with_clear_zones): (&TraceableScene, bool),
        light: &[(Spectrum<C>, DVec2)],
    ) -> Solution<C> {
        let (mut straight, other_variances): (Vec<_>, Vec<_>) =
            other_light((scene, &self.mirrors, with_clear_zones), &self.points).into_iter().unzip();
        straight.resize(self.surfaces.len(), Spectrum::ZERO);
        // the solution scales with the flux of the openings only where other light adds nothing
        let alone = straight.iter().all(|lux: &Spectrum<C>| lux.max() <= 0.0);
        for (lux, of_openings) in straight.iter_mut().zip(self.openings_of_each()) {
            of_openings.iter().for_each(|of| *lux += of.lux(light));
        }
        let luminances = self.luminances(scene, &straight, 1);
        self.solution(scene, light, luminances, (&other_variances, alone))
    }

    /// Returns the diffuse reflectance of each patch.
    fn reflectances<const C: usize>(&self, scene: &TraceableScene) -> Vec<Spectrum<C>> {
        let of = |surface: &SurfaceId| scene.optics(*surface).map_or(Spectrum::ZERO, |optics| optics.diffuse());
        self.surfaces.iter().map(of).collect()
    }

    /// Computes the luminances in cd/m2 of all patches from their direct illuminances in lx in `columns` different lights, those of a patch
    /// side by side.
    pub(super) fn luminances<const C: usize>(
        &self,
        scene: &TraceableScene,
        straight: &[Spectrum<C>],
        columns: usize,
    ) -> Vec<Spectrum<C>> {
        let reflectances = self.reflectances(scene);
        let mut radiosities: Vec<Spectrum<C>> =
            straight.iter().enumerate().map(|(place, lux)| reflectances[place / columns] * *lux).collect();
        let mut sums = vec![Spectrum::ZERO; columns];
        for _ in 0..SWEEPS {
            let (mut changed, mut all) = (0.0, 0.0);
            for (patch, met) in self.met_by_each().enumerate() {
                sums.fill(Spectrum::ZERO);
                for (number, weight) in met {
                    let first = *number as usize * columns;
                    let of_other = radiosities.get(first..first + columns).unwrap_or_default();
                    sums.iter_mut().zip(of_other).for_each(|(sum, of_other)| *sum += *of_other * *weight);
                }
                let members = met[..RAYS].iter().filter(|(number, _)| *number != NOT_FOUND).count();
                let places = patch * columns..(patch + 1) * columns;
                for ((old, lux), sum) in radiosities[places.clone()].iter_mut().zip(&straight[places]).zip(&sums) {
                    let radiosity = reflectances[patch] * (*lux + *sum * (1.0 / members.max(1) as f64));
                    changed += (radiosity.max() - old.max()).abs();
                    all += radiosity.max().abs();
                    *old = radiosity;
                }
            }
            if changed <= CHANGED * all {
                break;
            }
        }
        radiosities.iter_mut().for_each(|radiosity| *radiosity = *radiosity * (1.0 / PI));
        radiosities
    }

    /// Makes the solution of luminances in cd/m2 by the light of openings, with the variances of illuminances by other light; `alone` if
    /// there is none.
    pub(super) fn solution<const C: usize>(
        self: &Arc<Self>,
        scene: &TraceableScene,
        light: &[(Spectrum<C>, DVec2)],
        luminances: Vec<Spectrum<C>>,
        (other_variances, alone): (&[f64], bool),
    ) -> Solution<C> {
        let all: f64 = light.iter().map(|(flux, _)| flux.luminance()).sum();
        let seen = self.seen.iter().filter_map(|number| Some(luminances.get(*number as usize)?.luminance()));
        let mean = seen.clone().sum::<f64>() / seen.count().max(1) as f64;
        let patches = luminances.iter().map(Spectrum::luminance).zip(self.areas.iter().copied());
        let bright_patches = BrightPatches::new(patches, &source_images(scene, light), mean);
        let variances = self.variances((&self.reflectances(scene), other_variances), light, &luminances);
        let flux = (alone && all > 0.0).then_some(all);
        Solution { variances, exchange: self.clone(), bright_patches, luminances, flux }
    }
}

/// Radiosities of patches.
#[derive(Clone, Debug)]
pub struct Solution<const C: usize> {
    pub(super) exchange: Arc<Exchange>,
    /// Luminances in cd/m2, by the number of the patch.
    pub(super) luminances: Vec<Spectrum<C>>,
    /// Variances of these luminances in (cd/m2)^2, by the chance of the rays and connections of each patch.
    pub(super) variances: Vec<f64>,
    /// Patches that are much brighter than most.
    bright_patches: BrightPatches,
    /// Luminous flux of all openings in lm, to which the luminances are proportional; `None` where they are not.
    flux: Option<f64>,
}

impl<const C: usize> Solution<C> {
    /// Returns the factor of all luminances where openings send `flux` lm in all, with the same distribution among them.
    pub fn times(&self, flux: f64) -> f64 {
        self.flux.map_or(1.0, |own| flux / own)
    }

    /// Returns the luminance in cd/m2 that a surface reflects diffusely at a point, by its patch; `None` where it has no solution, and where
    /// a `sensor` sees the gradient within the patch.
    #[inline]
    pub fn luminance(&self, surface: SurfaceId, point: DVec3, sensor: Option<DVec3>) -> Option<Spectrum<C>> {
        let number = self.number(surface, point)?;
        let is_close = |sensor: DVec3| self.is_close(number, (point - sensor).length_squared());
        if sensor.is_some_and(is_close) { None } else { self.luminances.get(number as usize).copied() }
    }

    /// True if a sensor at this squared distance in m2 from a point of a patch is closer to it than the patch is long.
    #[inline]
    pub(super) fn is_close(&self, patch: u32, squared: f64) -> bool {
        self.exchange.lengths_squared.get(patch as usize).is_some_and(|length| squared < *length)
    }

    #[inline]
    pub(super) fn number(&self, surface: SurfaceId, point: DVec3) -> Option<u32> {
        let Exchange { patches, numbers, .. } = &*self.exchange;
        Some(numbers[patches.at(surface, point)?])
    }

    /// Returns the patches at which rays are aimed; `None` where none is bright.
    #[inline]
    pub fn bright_patches(&self) -> Option<&BrightPatches> {
        Some(&self.bright_patches).filter(|bright_patches| !bright_patches.is_empty())
    }

    /// True if a point of a surface is part of what a ray was aimed at, or shows it.
    #[inline]
    pub fn shows(&self, target: Target, surface: SurfaceId, point: DVec3) -> bool {
        match target {
            Target::Patch(number) => self.number(surface, point) == Some(number),
            Target::Image(in_surface) => surface == in_surface,
        }
    }

    /// Returns the density per sr of the aimed rays from a place that would end in a point of a surface.
    #[inline]
    pub fn aimed_density(&self, from: DVec3, surface: SurfaceId, hit: &RoomHit) -> f64 {
        let bright = &self.bright_patches;
        let per_area = self.number(surface, hit.position).map_or(0.0, |number| bright.density(number));
        let of_patch = if per_area > 0.0 { density_toward(per_area, from, hit) } else { 0.0 };
        of_patch + bright.density_of_images(surface, from, hit.position)
    }
}

/// Converts a density per m2 of points on a surface to one per sr of directions, seen from a place whose ray meets the surface at `hit`.
fn density_toward(per_area: f64, from: DVec3, hit: &RoomHit) -> f64 {
    let to_hit = hit.position - from;
    let squared = to_hit.length_squared();
    let cosine = -to_hit.dot(hit.normal) / squared.sqrt();
    per_area * squared / cosine.max(f64::MIN_POSITIVE)
}

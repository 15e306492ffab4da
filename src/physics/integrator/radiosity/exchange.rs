//! Exchange of light between patches: where rays from each end, the direct light of openings, and the radiosities that follow.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;
use rayon::prelude::*;

use super::bright_patches::{Area, BrightPatches};
use super::gradients::of_opening;
use super::other_light::other_light;
use super::patches::Patches;
use crate::integrator::diffuser_source::cells::per_lumen;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, warp};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{Place, SurfaceId, SurfacePoint, TraceableScene};

/// Number of rays from each patch, one in each stratum of directions.
pub(super) const RAYS: usize = STRATA * STRATA;
pub(super) const STRATA: usize = 4;

/// Number of rays from each patch that are aimed at bright patches, if there are any.
const AIMED: usize = 4;

/// Number of rays from each patch by which others are found.
const FINDING: usize = 4;

/// Number of rays from each start of paths by which the first patches are found.
const FROM_STARTS: usize = 16;

/// Change, as a fraction of all radiosities, below which the iteration ends, and the largest number of sweeps: a remaining error costs
/// time, but adds no bias.
const CHANGED: f64 = 1e-3;
const SWEEPS: usize = 64;

/// Mark of a ray that ends in no patch: it brings no light.
const NONE: u32 = u32::MAX;
/// Mark of a ray that ends in a patch which was not found: it is left out of the mean.
const NOT_FOUND: u32 = u32::MAX - 1;

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
    /// Illuminances by openings in lx per lumen, with the number of the tube: equally many for each patch.
    pub(super) of_openings: Vec<(u32, f64)>,
    /// Points of each patch, at which light that does not come from Lambertian openings is computed; empty where there is none.
    points: Vec<[SurfacePoint; RAYS]>,
}

/// Points of a patch that rays have met.
struct MetPatch {
    surface: SurfaceId,
    points: Vec<SurfacePoint>,
}

impl MetPatch {
    /// Chooses a point in each of as many equal parts of the patch as it has rays; instead, one that rays have met in a patch of facets, and
    /// where the chosen point lies in a solid.
    fn spread_points(
        &self,
        scene: &TraceableScene,
        area: Option<Area>,
        random: &mut PathRandom,
    ) -> [SurfacePoint; RAYS] {
        let area = area.filter(|_| scene.numbering.facet_of(self.surface).is_none());
        std::array::from_fn(|number| {
            let met = self.points[number % self.points.len()];
            let Some(Area { corner, edges }) = area else { return met };
            let [row, column] = [number / STRATA, number % STRATA].map(|stratum| stratum as f64);
            let [u, v] = random.uniform2();
            let position = corner + edges[0] * ((row + u) / STRATA as f64) + edges[1] * ((column + v) / STRATA as f64);
            let is_free = !scene.is_in_solid(position + met.normal * (2.0 * scene.coinciding()));
            if is_free { SurfacePoint { position, ..met } } else { met }
        })
    }
}

impl Exchange {
    /// Finds the patches that rays from `starts` meet, directly or after reflections; always the same for the same scene and starts. `edge`
    /// is the approximate length of an edge of a patch in m. Edges are shorter where luminaires give light, and, if this is asked for, the sun
    /// through clear zones. `None` where no light is reflected.
    pub fn new((scene, with_clear_zones): (&TraceableScene, bool), starts: &[SurfacePoint], edge: f64) -> Option<Self> {
        if !scene.interreflection {
            return None;
        }
        let patches = Patches::new((scene, with_clear_zones), edge);
        let mut numbers = vec![NOT_FOUND; patches.count];
        let mut found: Vec<MetPatch> = Vec::new();
        let key = Key::new(0);
        let (mut first, mut rays): (usize, Vec<Option<RayEnd>>) = (0, Vec::new());
        rays.par_extend(starts.par_iter().enumerate().flat_map_iter(|(number, start)| {
            let mut random = PathRandom::new(key.child(number as u64));
            (0..FROM_STARTS).map(move |stratum| ray(scene, start, stratum, &mut random))
        }));
        let first_seen: Vec<SurfacePoint> = rays.iter().flatten().map(|end| end.point).collect();
        loop {
            for RayEnd { point, .. } in rays.drain(..).flatten() {
                let Some(surface) = point.surface else { continue };
                let Some(patch) = patches.at(surface, point.position) else { continue };
                if numbers[patch] == NOT_FOUND {
                    numbers[patch] = found.len() as u32;
                    found.push(MetPatch { surface, points: Vec::new() });
                    // rays rarely meet every part of a cell
                    let face = scene.enclosure.polygons.get(surface.index());
                    for (part, position) in patches.beside(surface, patch) {
                        if numbers[part] == NOT_FOUND && face.is_none_or(|face| face.contains(position)) {
                            numbers[part] = found.len() as u32;
                            found.push(MetPatch { surface, points: vec![SurfacePoint { position, ..point }] });
                        }
                    }
                }
                let MetPatch { points, .. } = &mut found[numbers[patch] as usize];
                if points.len() < RAYS {
                    points.push(point);
                }
            }
            if first == found.len() {
                break;
            }
            rays.par_extend(found[first..].par_iter().enumerate().flat_map_iter(|(number, patch)| {
                let mut random = PathRandom::new(key.child(1).child((first + number) as u64));
                (0..FINDING).map(move |ray_number| {
                    let stratum = ray_number * (RAYS / FINDING) + ray_number;
                    ray(scene, &patch.points[ray_number % patch.points.len()], stratum, &mut random)
                })
            }));
            first = found.len();
        }
        let area = |(patch, number): (usize, &u32)| {
            let found = found.get(*number as usize)?;
            Some((*number, patches.area(found.surface, patch)))
        };
        let mut areas = vec![None; found.len()];
        for (number, area) in numbers.iter().enumerate().filter_map(area) {
            areas[number as usize] = area;
        }
        let of_patch = |(number, (patch, area)): (usize, (&MetPatch, &Option<Area>))| {
            let mut random = PathRandom::new(key.child(2).child(number as u64));
            PatchRays::of(scene, patch.spread_points(scene, *area, &mut random), &mut random)
        };
        let lit: Vec<PatchRays> = found.par_iter().zip(&areas).enumerate().map(of_patch).collect();
        let of_openings = lit.iter().flat_map(|lit| lit.of_openings.iter().copied()).collect();
        let surfaces: Vec<SurfaceId> = found.iter().map(|patch| patch.surface).collect();
        let bright = bright_patches(scene, &lit, &surfaces, &areas);
        let number_of = |point: SurfacePoint| Some(numbers[patches.at(point.surface?, point.position)?]);
        let of_patch = |(number, lit): (usize, &PatchRays)| {
            let weight = |met: u32, end: &RayEnd| {
                let aimed = bright.density(met) * AIMED as f64;
                let scattered = end.per_area.map(|per_area| per_area * RAYS as f64);
                end.weight * scattered.filter(|_| aimed > 0.0).map_or(1.0, |scattered| scattered / (scattered + aimed))
            };
            let ended = |end: &Option<RayEnd>| {
                let found = end.and_then(|end| number_of(end.point).map(|met| (met, weight(met, &end))));
                found.unwrap_or((NONE, 0.0))
            };
            let mut random = PathRandom::new(key.child(4).child(number as u64));
            let aimed = |ray_number: usize| {
                let [u, v] = random.uniform2();
                let point = &lit.points[ray_number * (RAYS / AIMED) + ray_number];
                let (patch, end) = aimed_ray(scene, point, bright.at([(ray_number as f64 + u) / AIMED as f64, v]))?;
                number_of(end.point).filter(|met| *met == patch).map(|met| (met, weight(met, &end)))
            };
            let count = if bright.is_empty() { 0 } else { AIMED };
            let aimed: Vec<_> = (0..count).map(aimed).map(|end| end.unwrap_or((NONE, 0.0))).collect();
            lit.met.iter().map(ended).chain(aimed).collect()
        };
        let met: Vec<Vec<(u32, f64)>> = lit.par_iter().enumerate().map(of_patch).collect();
        let met = met.concat();
        let length = |area: &Option<Area>| area.map_or(edge * edge, |area| area.length_squared());
        let lengths_squared = areas.iter().map(length).collect();
        let seen =
            first_seen.iter().filter_map(|point| Some(numbers[patches.at(point.surface?, point.position)?])).collect();
        let is_lit = with_clear_zones || scene.luminaires.iter().any(TraceableLuminaire::emits);
        let points = if is_lit { lit.into_iter().map(|lit| lit.points).collect() } else { Vec::new() };
        let exchange = Self { lengths_squared, numbers, areas, surfaces, seen, met, of_openings, points, patches };
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

    /// Returns the illuminances of each patch by openings, in lx per lumen, with the number of the tube.
    pub(super) fn openings_of_each(&self) -> impl Iterator<Item = &[(u32, f64)]> {
        self.of_openings.chunks_exact(self.of_openings.len() / self.surfaces.len())
    }

    /// Computes the radiosities in a scene of this room where openings send these fluxes in lm, as from Lambertian surfaces (Gauss and
    /// Seidel's sweeps). The light of sky and sun through clear zones of straight tubes counts if this is asked for.
    pub fn solve<const C: usize>(
        self: &Arc<Self>,
        (scene, with_clear_zones): (&TraceableScene, bool),
        fluxes: &[Spectrum<C>],
    ) -> Solution<C> {
        let (mut straight, other_variances): (Vec<_>, Vec<_>) =
            other_light((scene, with_clear_zones), &self.points).into_iter().unzip();
        straight.resize(self.surfaces.len(), Spectrum::ZERO);
        // the solution scales with the flux of the openings only where other light adds nothing
        let alone = straight.iter().all(|lux: &Spectrum<C>| lux.max() <= 0.0);
        for (lux, of_openings) in straight.iter_mut().zip(self.openings_of_each()) {
            of_openings.iter().for_each(|(tube, per_lumen)| {
                *lux += fluxes.get(*tube as usize).map_or(Spectrum::ZERO, |flux| *flux * *per_lumen);
            });
        }
        let reflectance =
            |surface: &SurfaceId| scene.optics(*surface).map_or(Spectrum::ZERO, |optics| optics.diffuse());
        let reflectances: Vec<Spectrum<C>> = self.surfaces.iter().map(reflectance).collect();
        let mut radiosities: Vec<Spectrum<C>> =
            reflectances.iter().zip(&straight).map(|(by, lux)| *by * *lux).collect();
        for _ in 0..SWEEPS {
            let (mut changed, mut all) = (0.0, 0.0);
            for (patch, met) in self.met_by_each().enumerate() {
                let mut sum = Spectrum::ZERO;
                for (number, weight) in met {
                    if let Some(of_other) = radiosities.get(*number as usize) {
                        sum += *of_other * *weight;
                    }
                }
                let members = met[..RAYS].iter().filter(|(number, _)| *number != NOT_FOUND).count();
                let radiosity = reflectances[patch] * (straight[patch] + sum * (1.0 / members.max(1) as f64));
                changed += (radiosity.max() - radiosities[patch].max()).abs();
                all += radiosity.max();
                radiosities[patch] = radiosity;
            }
            if changed <= CHANGED * all {
                break;
            }
        }
        radiosities.iter_mut().for_each(|radiosity| *radiosity = *radiosity * (1.0 / PI));
        let all: f64 = fluxes.iter().map(Spectrum::luminance).sum();
        let seen = self.seen.iter().filter_map(|number| Some(radiosities.get(*number as usize)?.luminance()));
        let mean = seen.clone().sum::<f64>() / seen.count().max(1) as f64;
        let bright_patches =
            BrightPatches::new(radiosities.iter().map(Spectrum::luminance).zip(self.areas.iter().copied()), mean);
        let variances = self.variances((&reflectances, &other_variances), fluxes, &radiosities);
        Solution {
            variances,
            exchange: self.clone(),
            bright_patches,
            luminances: radiosities,
            flux: (alone && all > 0.0).then_some(all),
        }
    }
}

/// Rays of one patch, and its direct light by openings.
struct PatchRays {
    /// Ends of its rays.
    met: [Option<RayEnd>; RAYS],
    of_openings: Vec<(u32, f64)>,
    /// Points of the patch from which they start.
    points: [SurfacePoint; RAYS],
}

impl PatchRays {
    fn of(scene: &TraceableScene, points: [SurfacePoint; RAYS], random: &mut PathRandom) -> Self {
        // parts of the patch in an order that is unrelated to that of the directions
        let met = std::array::from_fn(|number| ray(scene, &points[number * 7 % RAYS], number, random));
        let start = random.uniform();
        let mut of_openings: Vec<_> = (0..RAYS)
            .map(|number| {
                let point = &points[number];
                // uniform choices among the openings, in an order that is unrelated to that of the spots
                let choice = (start + (number * 7 % RAYS) as f64 / RAYS as f64).fract();
                let Some((tube, probability)) = scene.openings.choose(point.position, point.normal, choice) else {
                    return (0, 0.0);
                };
                let of_tube = &scene.tubes[tube];
                let to = of_tube.point(random.uniform2());
                let lux = of_opening(of_tube, point.position, point.normal) / of_tube.opening.area_m2();
                let is_seen = lux > 0.0
                    && of_tube.frame.depth(point.position) > 0.0
                    && scene.visible(to, None, point.position, point.surface);
                (tube as u32, if is_seen { lux / (probability * RAYS as f64) } else { 0.0 })
            })
            .collect();
        if !scene.mirrors.is_empty() {
            of_openings.extend(points.iter().map(|point| by_mirrors(scene, point, random)));
        }
        Self { met, of_openings, points }
    }
}

/// Estimates the illuminance of a spot by one random opening and chain of mirrors, in lx per lumen, with the number of the tube.
fn by_mirrors(scene: &TraceableScene, point: &SurfacePoint, random: &mut PathRandom) -> (u32, f64) {
    let mut found = || {
        let (chain, of_chain) = scene.mirrors.choose(point.position, random.uniform())?;
        let (image, normal) = scene.mirrors.image(chain, (point.position, point.normal));
        let (tube, of_tube) = scene.openings.choose(image, normal, random.uniform())?;
        let of_opening = &scene.tubes[tube];
        let source = (of_opening.point(random.uniform2()), None);
        let path = scene.mirror_path::<3>(chain, (point.position, point.surface), source)?;
        let [unfolded, normal] = [path.unfolded, normal].map(|v| of_opening.frame.levelled_direction(v));
        let lux = per_lumen(unfolded, normal).max(0.0) * path.reflectance.luminance();
        Some((tube as u32, lux / (of_chain * of_tube * RAYS as f64)))
    };
    found().unwrap_or((0, 0.0))
}

/// Finds the patches that are bright by the light of openings of equal exitance, or by that of luminaires.
fn bright_patches(
    scene: &TraceableScene,
    patches: &[PatchRays],
    surfaces: &[SurfaceId],
    areas: &[Option<Area>],
) -> BrightPatches {
    let emitting = || scene.luminaires.iter().filter(|luminaire| luminaire.emits());
    let luminances = |(patch, surface): (&PatchRays, &SurfaceId)| {
        let reflectance = scene.optics(*surface).map_or(0.0, |optics| optics.diffuse::<3>().luminance());
        let of_tube =
            |(tube, lux): &(u32, f64)| lux * scene.tubes.get(*tube as usize).map_or(0.0, |tube| tube.opening.area_m2());
        let of_luminaires = |point: &SurfacePoint| -> f64 {
            emitting().map(|of| of.irradiance::<1>(point.position, point.normal).luminance()).sum()
        };
        let by_luminaires =
            if emitting().next().is_some() { patch.points.iter().map(of_luminaires).sum() } else { 0.0 };
        [patch.of_openings.iter().map(of_tube).sum(), by_luminaires].map(|lux: f64| reflectance * lux)
    };
    let luminances: Vec<[f64; 2]> = patches.iter().zip(surfaces).map(luminances).collect();
    let area = |area: &Option<Area>| area.map_or(0.0, |area| area.area_m2());
    let all: f64 = areas.iter().map(area).sum();
    let means = [0, 1].map(|kind| luminances.iter().zip(areas).map(|(of, on)| of[kind] * area(on)).sum::<f64>() / all);
    // each kind of light counts relative to its mean
    let relative =
        |of: &[f64; 2]| of.iter().zip(means).map(|(of, mean)| if mean > 0.0 { of / mean } else { 0.0 }).sum();
    let kinds = means.iter().filter(|mean| **mean > 0.0).count();
    BrightPatches::new(luminances.iter().map(relative).zip(areas.iter().copied()), kinds as f64)
}

/// Traces a ray from a spot to a point of a patch, and returns its end with the number of the patch; `None` where something hides the point
/// from the spot.
fn aimed_ray(scene: &TraceableScene, from: &SurfacePoint, (patch, to): (u32, DVec3)) -> Option<(u32, RayEnd)> {
    let direction = (to - from.position).try_normalize()?;
    if direction.dot(from.normal) <= 0.0 {
        return None;
    }
    let hit = scene.intersect(from.position, direction, from.surface);
    let Place::Surface(met) = hit.place else { return None };
    let point = SurfacePoint { position: hit.position, normal: hit.normal, surface: Some(met) };
    Some((patch, RayEnd { point, weight: 1.0, per_area: Some(per_area(from, &point)) }))
}

/// Returns the density per m2 of a surface with which rays from a spot end at a point that it sees: the cosine law.
fn per_area(from: &SurfacePoint, to: &SurfacePoint) -> f64 {
    let away = to.position - from.position;
    let squared = away.length_squared();
    (away.dot(from.normal) * -away.dot(to.normal) / (PI * squared * squared)).max(0.0)
}

/// End of a ray.
#[derive(Clone, Copy)]
struct RayEnd {
    point: SurfacePoint,
    /// Reflectance of mirrors on the path, divided by the probability of this path.
    weight: f64,
    /// Density per m2 of rays that are not aimed; `None` after a mirror, by which no ray is aimed.
    per_area: Option<f64>,
}

/// Traces a ray from a spot in a stratum of directions and returns its end; `None` in an opening. At a surface that is partly a mirror
/// chance decides whether it is reflected or ends.
fn ray(scene: &TraceableScene, from: &SurfacePoint, stratum: usize, random: &mut PathRandom) -> Option<RayEnd> {
    let [u, v] = random.uniform2();
    let (row, column) = (stratum / STRATA, stratum % STRATA);
    let at = [(row as f64 + u) / STRATA as f64, (column as f64 + v) / STRATA as f64];
    let mut direction = warp::around(from.normal, warp::cosine_hemisphere(at));
    let (mut position, mut surface, mut weight) = (from.position, from.surface, 1.0);
    for turn in 0..MOST_TURNS {
        let hit = scene.intersect(position, direction, surface);
        let Place::Surface(met) = hit.place else { return None };
        let point = SurfacePoint { position: hit.position, normal: hit.normal, surface: Some(met) };
        let per_area = (turn == 0).then(|| per_area(from, &point));
        let Some(optics) = scene.optics(met).filter(|optics| optics.is_mirror()) else {
            return Some(RayEnd { point, weight, per_area });
        };
        let [diffuse, specular] = [optics.diffuse::<3>(), optics.specular()].map(|part| part.luminance());
        let turns = specular / (diffuse + specular).max(f64::MIN_POSITIVE);
        if random.uniform() >= turns {
            return Some(RayEnd { point, weight: weight / (1.0 - turns), per_area });
        }
        weight *= specular / turns;
        direction = optics.reflect(hit.normal, -direction, [0.0; 2], random)?;
        (position, surface) = (hit.position, Some(met));
    }
    None
}

/// Largest number of mirrors that reflect a ray.
const MOST_TURNS: usize = 8;

/// Radiosities of patches.
#[derive(Clone, Debug)]
pub struct Solution<const C: usize> {
    exchange: Arc<Exchange>,
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

    /// Returns the number of the patch of a point, and the fraction of aimed rays that end there per m2; `None` where there is no patch.
    #[inline]
    pub fn aimed(&self, surface: SurfaceId, point: DVec3) -> Option<(u32, f64)> {
        let number = self.number(surface, point)?;
        Some((number, self.bright_patches.density(number)))
    }
}

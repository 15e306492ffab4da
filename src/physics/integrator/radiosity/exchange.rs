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
const STRATA: usize = 4;

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
    /// Patches in which the rays of each patch end, by these numbers, with the reflectance of mirrors on the path.
    pub(super) met: Vec<(u32, f64)>,
    /// Illuminances by openings in lx per lumen, with the number of the tube: equally many for each patch.
    pub(super) of_openings: Vec<(u32, f64)>,
    /// Points of each patch, at which light that does not come from Lambertian openings is computed; empty where there is none.
    points: Vec<Vec<SurfacePoint>>,
}

/// Points of a patch that rays have met.
struct MetPatch {
    surface: SurfaceId,
    points: Vec<SurfacePoint>,
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
        let of_patch = |(number, patch): (usize, &MetPatch)| {
            let mut random = PathRandom::new(key.child(2).child(number as u64));
            PatchRays::of(scene, patch, &mut random)
        };
        let lit: Vec<PatchRays> = found.par_iter().enumerate().map(of_patch).collect();
        let number = |end: &Option<RayEnd>| {
            let patch = end.and_then(|end| Some((patches.at(end.point.surface?, end.point.position)?, end.weight)));
            patch.map_or((NONE, 0.0), |(patch, weight)| (numbers[patch], weight))
        };
        let met = lit.iter().flat_map(|lit| lit.met.iter().map(number)).collect();
        let of_openings = lit.iter().flat_map(|lit| lit.of_openings.iter().copied()).collect();
        let surfaces: Vec<SurfaceId> = found.iter().map(|patch| patch.surface).collect();
        let area = |(patch, number): (usize, &u32)| {
            let found = found.get(*number as usize)?;
            Some((*number, patches.area(found.surface, patch)))
        };
        let mut areas = vec![None; found.len()];
        for (number, area) in numbers.iter().enumerate().filter_map(area) {
            areas[number as usize] = area;
        }
        let length = |area: &Option<Area>| area.map_or(edge * edge, |area| area.length_squared());
        let lengths_squared = areas.iter().map(length).collect();
        let seen =
            first_seen.iter().filter_map(|point| Some(numbers[patches.at(point.surface?, point.position)?])).collect();
        let is_lit = with_clear_zones || scene.luminaires.iter().any(TraceableLuminaire::emits);
        let points = if is_lit { found.into_iter().map(|patch| patch.points).collect() } else { Vec::new() };
        let exchange = Self { lengths_squared, numbers, areas, surfaces, seen, met, of_openings, points, patches };
        (!exchange.surfaces.is_empty()).then_some(exchange)
    }

    /// Returns the number of rays and connections of which the exchange was computed.
    pub fn rays(&self) -> f64 {
        (self.surfaces.len() * (FINDING + 2 * RAYS)) as f64
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
        let mut straight = other_light((scene, with_clear_zones), &self.points);
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
            for (patch, met) in self.met.chunks_exact(RAYS).enumerate() {
                let (mut sum, mut members) = (Spectrum::ZERO, 0_u32);
                for (number, weight) in met {
                    if let Some(of_other) = radiosities.get(*number as usize) {
                        sum += *of_other * *weight;
                    }
                    members += u32::from(*number != NOT_FOUND);
                }
                let radiosity = reflectances[patch] * (straight[patch] + sum * (1.0 / f64::from(members.max(1))));
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
        let variances = self.variances(&reflectances, fluxes, &radiosities);
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
}

impl PatchRays {
    fn of(scene: &TraceableScene, patch: &MetPatch, random: &mut PathRandom) -> Self {
        let point = |number: usize| &patch.points[number % patch.points.len()];
        let met = std::array::from_fn(|number| ray(scene, point(number), number, random));
        let start = random.uniform();
        let mut of_openings: Vec<_> = (0..RAYS)
            .map(|number| {
                let point = point(number);
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
            of_openings.extend((0..RAYS).map(|number| by_mirrors(scene, point(number), random)));
        }
        Self { met, of_openings }
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

/// End of a ray.
#[derive(Clone, Copy)]
struct RayEnd {
    point: SurfacePoint,
    /// Reflectance of mirrors on the path, divided by the probability of this path.
    weight: f64,
}

/// Traces a ray from a spot in a stratum of directions and returns its end; `None` in an opening. At a surface that is partly a mirror
/// chance decides whether it is reflected or ends.
fn ray(scene: &TraceableScene, from: &SurfacePoint, stratum: usize, random: &mut PathRandom) -> Option<RayEnd> {
    let [u, v] = random.uniform2();
    let (row, column) = (stratum / STRATA, stratum % STRATA);
    let at = [(row as f64 + u) / STRATA as f64, (column as f64 + v) / STRATA as f64];
    let mut direction = warp::around(from.normal, warp::cosine_hemisphere(at));
    let (mut position, mut surface, mut weight) = (from.position, from.surface, 1.0);
    for _ in 0..MOST_TURNS {
        let hit = scene.intersect(position, direction, surface);
        let Place::Surface(met) = hit.place else { return None };
        let point = SurfacePoint { position: hit.position, normal: hit.normal, surface: Some(met) };
        let Some(optics) = scene.optics(met).filter(|optics| optics.is_mirror()) else {
            return Some(RayEnd { point, weight });
        };
        let [diffuse, specular] = [optics.diffuse::<3>(), optics.specular()].map(|part| part.luminance());
        let turns = specular / (diffuse + specular).max(f64::MIN_POSITIVE);
        if random.uniform() >= turns {
            return Some(RayEnd { point, weight: weight / (1.0 - turns) });
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

//! Search for the patches of a room that paths can meet.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::area::Area;
use super::patch_rays::{RAYS, RayEnd, STRATA, ray};
use super::patches::Patches;
use crate::sampling::{Key, PathRandom};
use crate::traceable::{SurfaceId, SurfacePoint, TraceableScene, TraceableTube};

/// Number of rays from each patch by which others are found.
pub const FINDING: usize = 4;

/// Number of rays from each start of paths by which the first patches are found.
const FROM_STARTS: usize = 16;

/// Mark of a ray that ends in a patch which was not found: it is left out of the mean.
pub const NOT_FOUND: u32 = u32::MAX - 1;

/// Patches that rays from the starts of paths meet, directly or after reflections.
pub struct MetPatches {
    /// Number of each patch among those that were found; [`NOT_FOUND`] of others.
    pub numbers: Vec<u32>,
    pub found: Vec<MetPatch>,
    /// Points that the rays from the starts meet.
    pub first_seen: Vec<SurfacePoint>,
}

impl MetPatches {
    /// Follows rays from the starts, and from the patches that they find; `None` when cancelled.
    pub fn of(scene: &TraceableScene, patches: &Patches, starts: &[SurfacePoint], cancel: &AtomicBool) -> Option<Self> {
        let mut numbers = vec![NOT_FOUND; patches.count];
        let mut found: Vec<MetPatch> = Vec::new();
        let key = Key::new(0);
        let (mut first, mut rays): (usize, Vec<Option<RayEnd>>) = (0, Vec::new());
        rays.par_extend(starts.par_iter().enumerate().flat_map_iter(|(number, start)| {
            let mut random = PathRandom::new(key.child(number as u64));
            (0..FROM_STARTS).map(move |stratum| ray(scene, start, stratum, &mut random))
        }));
        let first_seen: Vec<SurfacePoint> = rays.iter().flatten().map(|end| end.point).collect();
        // rays rarely meet a small closure
        let on_closures = scene.tubes.iter().enumerate().flat_map(|(number, tube)| {
            let surface = scene.numbering.closure(number);
            points_of(tube, surface).filter(move |_| scene.optics(surface).is_some())
        });
        rays.extend(on_closures.map(|point| Some(RayEnd { point, weight: 1.0, per_area: None })));
        loop {
            for RayEnd { point, .. } in rays.drain(..).flatten() {
                let Some(surface) = point.surface else { continue };
                let Some(patch) = patches.at(surface, point.position) else { continue };
                if numbers[patch] == NOT_FOUND {
                    numbers[patch] = found.len() as u32;
                    found.push(MetPatch { surface, points: Vec::new() });
                    // rays rarely meet every part of a cell
                    for (part, position) in patches.beside(surface, patch) {
                        if numbers[part] == NOT_FOUND && is_within(scene, surface, position) {
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
                return Some(Self { numbers, found, first_seen });
            }
            if cancel.load(Ordering::Relaxed) {
                return None;
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
    }
}

/// True if a point of the rectangle around a surface is a point of the surface.
fn is_within(scene: &TraceableScene, surface: SurfaceId, position: DVec3) -> bool {
    match scene.numbering.closure_of(surface) {
        Some(tube) => scene.tubes[tube].has(position),
        None => scene.enclosure.polygons.get(surface.index()).is_none_or(|face| face.contains(position)),
    }
}

/// Iterates over a point of each of as many equal parts of a closure as a patch has rays.
fn points_of(tube: &TraceableTube, surface: SurfaceId) -> impl Iterator<Item = SurfacePoint> {
    let normal = tube.frame.normal();
    let point = move |away| SurfacePoint { position: tube.at(away), normal, surface: Some(surface) };
    tube.opening.points(STRATA).map(point)
}

/// Points of a patch that rays have met.
pub struct MetPatch {
    pub surface: SurfaceId,
    pub points: Vec<SurfacePoint>,
}

impl MetPatch {
    /// Chooses a point in each of as many equal parts of the patch as it has rays; instead, one that rays have met in a patch of facets, and
    /// where the chosen point lies in a solid.
    pub fn spread_points(
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
            let is_closure = scene.numbering.closure_of(self.surface).is_some();
            let is_free = match is_closure {
                true => is_within(scene, self.surface, position),
                false => !scene.is_in_solid(position + met.normal * (2.0 * scene.coinciding())),
            };
            if is_free { SurfacePoint { position, ..met } } else { met }
        })
    }
}

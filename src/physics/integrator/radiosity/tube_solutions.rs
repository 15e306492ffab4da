//! Coarse solutions of the light of each opening by itself: that of one lumen, and of its first moments.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use super::patch_rays::OpeningLight;
use super::{Exchange, Solution};
use crate::optics::Spectrum;
use crate::traceable::{SurfaceId, TraceableScene, TraceableTube};

/// Number of lights of an opening: a lumen that leaves it evenly, and its moments along x and y.
pub const MOMENTS: usize = 3;

/// Largest size of all solutions in bytes, and number of patches of a large room: fine patches of many tubes would take gigabytes.
const MOST_BYTES: usize = 256 << 20;
const MANY_PATCHES: usize = 20_000;

/// Estimates the memory in bytes that the solutions for some tubes take while they are computed: direct light, and luminances.
pub fn bytes_of_solutions(tubes: usize, channels: usize) -> usize {
    2 * (MANY_PATCHES * tubes * MOMENTS * channels * size_of::<f64>()).min(MOST_BYTES)
}

/// Solutions for the light of each opening by itself.
#[derive(Clone, Debug)]
pub struct TubeSolutions<const C: usize> {
    /// Solution for one lumen from every opening.
    pub all: Arc<Solution<C>>,
    /// Luminances of the patches in cd/m2 in each light, those of a patch side by side.
    luminances: Vec<Spectrum<C>>,
    /// Number of lights: [`MOMENTS`] of each tube.
    columns: usize,
}

impl<const C: usize> TubeSolutions<C> {
    /// Computes the solutions for white light that leaves the openings of a scene evenly, from the exchange of another solution; `None`
    /// without tubes, and where they would take too much memory.
    pub fn new(scene: &TraceableScene, Solution { exchange, .. }: &Solution<C>) -> Option<Self> {
        let columns = scene.tubes.len() * MOMENTS;
        let bytes = exchange.openings_of_each().count() * columns * size_of::<Spectrum<C>>();
        if columns == 0 || bytes > MOST_BYTES {
            return None;
        }
        let straight = direct_light(scene, exchange, columns);
        let luminances = exchange.luminances(scene, &straight, columns);
        let even = |of_patch: &[Spectrum<C>]| {
            of_patch.iter().step_by(MOMENTS).fold(Spectrum::ZERO, |sum, luminance| sum + *luminance)
        };
        let light = |tube: &TraceableTube| (if emits(tube) { Spectrum::ONE } else { Spectrum::ZERO }, DVec2::ZERO);
        let light: Vec<_> = scene.tubes.iter().map(light).collect();
        let all = luminances.chunks_exact(columns).map(even).collect();
        let all = Arc::new(exchange.solution(scene, &light, all, (&[], true)));
        Some(Self { all, luminances, columns })
    }

    /// Returns the number of lights.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Returns the luminances in cd/m2 that a surface reflects diffusely at a point in each light; none where it has no solution.
    #[inline]
    pub fn at(&self, surface: SurfaceId, point: DVec3) -> &[Spectrum<C>] {
        let patch = self.all.number(surface, point).map(|number| number as usize * self.columns);
        patch.and_then(|first| self.luminances.get(first..first + self.columns)).unwrap_or_default()
    }
}

/// True if some light leaves a closure as from a Lambertian sheet.
fn emits(tube: &TraceableTube) -> bool {
    tube.even_zone().is_some()
}

/// Computes the direct illuminances of the patches in lx in each light, those of a patch side by side.
///
/// A lumen with the centroid c in m has the illuminance E + g c, which is E + 4 m c / r with the moment m: m = g r / 4 (the mean square of a
/// coordinate over the unit disc is 1/4).
fn direct_light<const C: usize>(scene: &TraceableScene, exchange: &Exchange, columns: usize) -> Vec<Spectrum<C>> {
    let quarter = |tube: &TraceableTube| 0.25 * tube.opening.outer_radius();
    let of_patch = |of_openings: &[OpeningLight]| {
        let mut lit = vec![0.0; columns];
        for light in of_openings {
            if let Some(tube) = scene.tubes.get(light.tube as usize).filter(|tube| emits(tube)) {
                let moments = light.per_metre * quarter(tube);
                let of_light = [light.per_lumen, moments.x, moments.y];
                lit[light.tube as usize * MOMENTS..].iter_mut().zip(of_light).for_each(|(lit, lux)| *lit += lux);
            }
        }
        lit
    };
    let lit = exchange.openings_of_each().flat_map(of_patch);
    lit.map(|lux| Spectrum::ONE * lux).collect()
}

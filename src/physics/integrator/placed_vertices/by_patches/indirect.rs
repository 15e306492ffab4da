//! What reflected light gives to the surfaces of a room, roughly: on patches, per lumen that leaves each opening.
//!
//! From every patch some rays find what it sees, and how openings light that; the illuminances of all patches solve the equations
//! that these rays make ([`radiosity`](super::radiosity)). Sensors gather by it. It need not be right: what it has wrong is noise of
//! the residual, never a bias.

use std::any::Any;
use std::sync::Arc;

use super::patches::{Patched, Patches};
use super::radiosity::{Exchange, Straight};
use crate::integrator::placed_vertices::panels::{Panel, surfaces};
use crate::kept::Kept;
use crate::optics::Spectrum;
use crate::traceable::{SurfaceId, TOGETHER, TraceableScene, TraceableTube};

/// Rays from all patches together, about, and most and fewest of one: whole groups.
const RAYS: usize = 131_072;
const MOST_RAYS: usize = 32;
const FEWEST_RAYS: usize = 2 * TOGETHER;

/// Looks from a patch at an opening that tell how all of it is seen.
const ENOUGH_LOOKS: u32 = 8;

/// Rooms whose light is kept: some megabytes.
const MOST_KEPT: usize = 16;

/// Light on patches by the lumens that leave openings.
#[derive(Debug)]
pub struct Indirect<const C: usize> {
    pub patches: Patches,
    /// Reflectance of each patch.
    pub reflectances: Vec<Spectrum<C>>,
    /// Of each opening.
    openings: Vec<OfOpening<C>>,
}

/// What comes from one opening.
#[derive(Debug)]
struct OfOpening<const C: usize> {
    /// Illuminance of each patch by reflected light, in lx per lumen in every channel.
    per_lumen: Vec<Spectrum<C>>,
    /// How each patch sees it.
    sight: Vec<Sight>,
}

/// How a patch sees an opening, by looks from some of its points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// Not at all, or it faces away.
    Hidden,
    /// Some of the looks saw it, or there are too few of them.
    Partly,
    /// All of them did.
    Whole,
}

/// Light of one pass on patches.
#[derive(Debug)]
pub struct Lit<const C: usize> {
    /// Illuminance of each patch in lx by reflected light, times its reflectance.
    pub reflected: Vec<Spectrum<C>>,
    /// Of each opening: its lumens times the reflectance of each patch that sees it whole, else nothing.
    pub straight: Vec<Vec<Spectrum<C>>>,
}

impl<const C: usize> Indirect<C> {
    /// The light in a scene with these panels: kept, or computed anew.
    pub fn of(scene: &TraceableScene, panels: &[Panel]) -> Arc<Self> {
        static KEPT: Kept<Vec<u64>, Arc<dyn Any + Send + Sync>> = Kept::new(MOST_KEPT);
        let anew = || Arc::new(Self::new(scene, panels));
        KEPT.get(key::<C>(scene, panels), || anew()).downcast().unwrap_or_else(|_| anew())
    }

    /// Patches that know nothing: no reflected light, and sight of no opening.
    #[cfg(test)]
    pub fn unknowing(scene: &TraceableScene, panels: &[Panel]) -> Arc<Self> {
        let mut indirect = Self::new(scene, panels);
        for OfOpening { per_lumen, sight, .. } in &mut indirect.openings {
            per_lumen.fill(Spectrum::ZERO);
            sight.fill(Sight::Hidden);
        }
        Arc::new(indirect)
    }

    fn new(scene: &TraceableScene, panels: &[Panel]) -> Self {
        let patches = Patches::new(panels);
        let reflectance = |surface: SurfaceId| scene.optics(surface).map_or(Spectrum::ZERO, |optics| optics.diffuse());
        let of_face = |(face, surface): (&Patched, SurfaceId)| std::iter::repeat_n(reflectance(surface), face.count());
        let mut reflectances: Vec<Spectrum<C>> = patches.faces.iter().zip(surfaces(scene)).flat_map(of_face).collect();
        reflectances.extend(scene.tubes.iter().map(of_closure));
        let exchange = Exchange::new(scene, &patches, surfaces(scene), &reflectances, rays_of(patches.count));
        let openings = scene.tubes.iter().enumerate().map(|(number, tube)| {
            let Straight { looks, seen, .. } = &exchange.straight[number];
            let sight = sight(&patches, tube, looks, seen);
            let mut per_lumen = exchange.reflected(number, &reflectances);
            per_lumen.truncate(patches.count);
            OfOpening { per_lumen, sight }
        });
        let openings = openings.collect();
        reflectances.truncate(patches.count);
        Self { patches, reflectances, openings }
    }

    /// The light where so many lumens leave each opening.
    pub fn lit(&self, lumens: &[Spectrum<C>]) -> Lit<C> {
        let mut reflected = vec![Spectrum::ZERO; self.patches.count];
        for (of, lumens) in self.openings.iter().zip(lumens) {
            reflected.iter_mut().zip(&of.per_lumen).for_each(|(sum, lux)| *sum += *lux * *lumens);
        }
        reflected.iter_mut().zip(&self.reflectances).for_each(|(lux, by)| *lux *= *by);
        let straight = |(of, lumens): (&OfOpening<C>, &Spectrum<C>)| {
            let patches = self.reflectances.iter().zip(&of.sight);
            patches.map(|(by, sight)| if *sight == Sight::Whole { *by * *lumens } else { Spectrum::ZERO }).collect()
        };
        let straight = self.openings.iter().zip(lumens).map(straight).collect();
        Lit { reflected, straight }
    }

    /// How patches see the opening of a tube.
    #[inline]
    pub fn sight(&self, tube: usize) -> &[Sight] {
        &self.openings[tube].sight
    }
}

/// Share of light that a closure scatters back into the room, where it is a sheet.
fn of_closure<const C: usize>(tube: &TraceableTube) -> Spectrum<C> {
    tube.diffuser.sheet_reflectance().map_or(Spectrum::ZERO, Spectrum::from_rgb)
}

/// How each patch sees an opening, of those who look at it: faces that look away from it do not see it.
fn sight(patches: &Patches, tube: &TraceableTube, looks: &[u32], seen: &[u32]) -> Vec<Sight> {
    let away = patches
        .faces
        .iter()
        .flat_map(|face| std::iter::repeat_n(face.faces_away(tube.origin, tube.opening_radius), face.count()));
    let sight = |(away, (looks, seen)): (bool, (&u32, &u32))| match *seen {
        _ if away => Sight::Hidden,
        _ if *looks < ENOUGH_LOOKS => Sight::Partly,
        0 => Sight::Hidden,
        seen if seen == *looks => Sight::Whole,
        _ => Sight::Partly,
    };
    away.zip(looks.iter().zip(seen)).map(sight).collect()
}

/// Rays from every patch.
fn rays_of(patches: usize) -> usize {
    (RAYS / patches.max(1)).clamp(FEWEST_RAYS, MOST_RAYS) / FEWEST_RAYS * FEWEST_RAYS
}

/// Everything that the light follows from in a scene of faces, boxes and openings, in bits.
fn key<const C: usize>(scene: &TraceableScene, panels: &[Panel]) -> Vec<u64> {
    let of_panel = |(panel, surface): (&Panel, SurfaceId)| {
        let vectors = [panel.corner, panel.u, panel.v].into_iter().flat_map(|vector| vector.to_array());
        let reflectance: Spectrum<C> = scene.optics(surface).map_or(Spectrum::ZERO, |optics| optics.diffuse());
        vectors.chain(reflectance.0).collect::<Vec<f64>>()
    };
    let of_tube = |tube: &TraceableTube| {
        let place = [tube.origin.x, tube.origin.y, tube.origin.z, tube.opening_radius];
        place.into_iter().chain(of_closure::<C>(tube).0).collect::<Vec<f64>>()
    };
    let counts = [C, panels.len(), scene.tubes.len()].map(|count| count as f64);
    let numbers = counts.into_iter().chain(panels.iter().zip(surfaces(scene)).flat_map(of_panel));
    numbers.chain(scene.tubes.iter().flat_map(of_tube)).map(f64::to_bits).collect()
}

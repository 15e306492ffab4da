//! What reflected light gives to the surfaces of a room, roughly: on patches, per lumen that leaves each opening.
//!
//! From every patch some rays find what it sees; the illuminances of all patches solve the equations that these rays make
//! (radiosity by rays). Sensors gather by it, and vertices put right what it has wrong, so that it decides how much noise there is,
//! never what comes out.

use std::any::Any;
use std::sync::Arc;

use glam::DVec3;

use super::panels::{Panel, surfaces};
use super::patches::Patches;
use crate::integrator::lamp::cells::{is_far, per_lumen};
use crate::kept::Kept;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, Replicate, warp};
use crate::traceable::{Place, RoomHit, RoomRay, Segments, SurfaceId, TOGETHER, TraceableScene, TraceableTube};

/// Rays from all patches together, about, and most and fewest of one.
const RAYS: usize = 131_072;
const MOST_RAYS: usize = 32;
const FEWEST_RAYS: usize = 8;

/// Tubes that every group of rays looks at; of more, each has its turn.
const TUBES_AT_ONCE: usize = 4;

/// Rooms whose light is kept: some megabytes.
const MOST_KEPT: usize = 16;

/// Light is reflected again until what is added is less than this share of it, and at most so many times: more often only where surfaces
/// absorb less than some percent.
const ADDED: f64 = 1e-3;
const REFLECTIONS: usize = 200;

/// Distance from a patch, in shares of its size, at which rays begin.
const HAIR: f64 = 1e-6;

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

/// How a patch sees an opening, by its rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sight {
    /// Not at all, or it faces away.
    Hidden,
    /// Some of the rays came there.
    Partly,
    /// All of them.
    Whole,
}

/// Light of one pass on patches.
#[derive(Debug)]
pub struct Lit<const C: usize> {
    /// Illuminance of each patch in lx by reflected light, times its reflectance.
    pub reflected: Vec<Spectrum<C>>,
    /// Lumens that leave each opening.
    pub lumens: Vec<Spectrum<C>>,
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
        for OfOpening { per_lumen, sight } in &mut indirect.openings {
            per_lumen.fill(Spectrum::ZERO);
            sight.fill(Sight::Hidden);
        }
        Arc::new(indirect)
    }

    fn new(scene: &TraceableScene, panels: &[Panel]) -> Self {
        let patches = Patches::new(panels);
        let rays_of_patch = rays_of(patches.count);
        // every tube has its turn in some of the groups
        let turns = (scene.tubes.len() / TUBES_AT_ONCE).clamp(1, rays_of_patch / TOGETHER);
        let reflectance = |surface: SurfaceId| scene.optics(surface).map_or(Spectrum::ZERO, |optics| optics.diffuse());
        let mut reflectances = Vec::with_capacity(patches.count);
        let mut met = Vec::with_capacity(patches.count * rays_of_patch);
        let none = || vec![Spectrum::<C>::ZERO; patches.count];
        let mut first: Vec<Vec<Spectrum<C>>> = scene.tubes.iter().map(|_| none()).collect();
        let mut seen = vec![vec![0; patches.count]; scene.tubes.len()];
        for (face, surface) in patches.faces.iter().zip(surfaces(scene)) {
            for [corner, u, v] in face.patches() {
                let patch = reflectances.len();
                reflectances.push(reflectance(surface));
                let stream = Key::new(patch as u64);
                let mut random = PathRandom::new(stream);
                let (replicate, start) = Replicate::of(stream, 0);
                for group in 0..rays_of_patch / TOGETHER {
                    let rays: [RoomRay; TOGETHER] = std::array::from_fn(|lane| {
                        let [s, t, a, b] = replicate.point(start + (group * TOGETHER + lane) as u16, 0);
                        let origin = corner + u * s + v * t + face.normal * (HAIR * u.length());
                        let direction = warp::around(face.normal, warp::cosine_hemisphere([a, b]));
                        RoomRay { origin, direction, from: Some(surface) }
                    });
                    let hits = scene.intersect_together(&rays);
                    met.extend(hits.iter().map(|hit| patch_of(&patches, hit)));
                    for (number, tube) in scene.tubes.iter().enumerate().skip(group % turns).step_by(turns) {
                        let point = |random: &mut PathRandom| {
                            tube.origin + (warp::disc(random.uniform2()) * tube.opening_radius).extend(0.0)
                        };
                        first[number][patch] += reflected(scene, &hits, tube, point(&mut random));
                        let to = point(&mut random);
                        let own = scene.numbering.box_of(surface).map_or(-1.0, |number| number as f64);
                        let mut up = Segments { own: [own; TOGETHER], ..Segments::default() };
                        (0..TOGETHER).for_each(|lane| up.set(lane, rays[lane].origin, to - rays[lane].origin));
                        let faces = |ray: &RoomRay| (to - ray.origin).dot(face.normal) > 0.0;
                        let clear = scene.clear_of_boxes(&up);
                        seen[number][patch] +=
                            rays.iter().zip(clear).filter(|(ray, clear)| *clear > 0.0 && faces(ray)).count();
                    }
                }
            }
        }
        let openings = first.into_iter().zip(seen).enumerate().map(|(tube, (mut first, seen))| {
            let groups = (0..rays_of_patch / TOGETHER).filter(|group| group % turns == tube % turns).count();
            let rays = groups * TOGETHER;
            first.iter_mut().for_each(|lux| *lux = *lux * (1.0 / rays as f64));
            let sight = |seen: usize| match seen {
                0 => Sight::Hidden,
                seen if seen == rays => Sight::Whole,
                _ => Sight::Partly,
            };
            let sight = seen.into_iter().map(sight).collect();
            OfOpening { per_lumen: solve(&first, &met, &reflectances, rays_of_patch), sight }
        });
        let openings = openings.collect();
        Self { patches, reflectances, openings }
    }

    /// The light where so many lumens leave each opening.
    pub fn lit(&self, lumens: Vec<Spectrum<C>>) -> Lit<C> {
        let mut reflected = vec![Spectrum::ZERO; self.patches.count];
        for (of, lumens) in self.openings.iter().zip(&lumens) {
            reflected.iter_mut().zip(&of.per_lumen).for_each(|(sum, lux)| *sum += *lux * *lumens);
        }
        reflected.iter_mut().zip(&self.reflectances).for_each(|(lux, by)| *lux *= *by);
        let straight = |(of, lumens): (&OfOpening<C>, &Spectrum<C>)| {
            let patches = self.reflectances.iter().zip(&of.sight);
            patches.map(|(by, sight)| if *sight == Sight::Whole { *by * *lumens } else { Spectrum::ZERO }).collect()
        };
        let straight = self.openings.iter().zip(&lumens).map(straight).collect();
        Lit { reflected, lumens, straight }
    }

    /// How patches see the opening of a tube.
    #[inline]
    pub fn sight(&self, tube: usize) -> &[Sight] {
        &self.openings[tube].sight
    }
}

/// Rays from every patch, whole groups of them.
fn rays_of(patches: usize) -> usize {
    (RAYS / patches.max(1)).clamp(FEWEST_RAYS, MOST_RAYS) / TOGETHER * TOGETHER
}

/// Everything that the light follows from in a scene of faces, boxes and openings, in bits.
fn key<const C: usize>(scene: &TraceableScene, panels: &[Panel]) -> Vec<u64> {
    let of_panel = |(panel, surface): (&Panel, SurfaceId)| {
        let vectors = [panel.corner, panel.u, panel.v].into_iter().flat_map(|vector| vector.to_array());
        let reflectance: Spectrum<C> = scene.optics(surface).map_or(Spectrum::ZERO, |optics| optics.diffuse());
        vectors.chain(reflectance.0).collect::<Vec<f64>>()
    };
    let of_tube = |tube: &TraceableTube| [tube.origin.x, tube.origin.y, tube.origin.z, tube.opening_radius];
    let counts = [C, panels.len(), scene.tubes.len()].map(|count| count as f64);
    let numbers = counts.into_iter().chain(panels.iter().zip(surfaces(scene)).flat_map(of_panel));
    numbers.chain(scene.tubes.iter().flat_map(of_tube)).map(f64::to_bits).collect()
}

/// The patch that is met.
fn patch_of(patches: &Patches, hit: &RoomHit) -> Option<usize> {
    match hit.place {
        Place::Surface(surface) => patches.faces.get(surface.index()).map(|face| face.at(hit.position)),
        Place::Opening(_) => None,
    }
}

/// Pi times the luminances of hits in cd/m2 by one lumen from a point of an opening, added up.
fn reflected<const C: usize>(
    scene: &TraceableScene,
    hits: &[RoomHit; TOGETHER],
    tube: &TraceableTube,
    from: DVec3,
) -> Spectrum<C> {
    let surface = |hit: &RoomHit| match hit.place {
        Place::Surface(surface) => Some(surface),
        Place::Opening(_) => None,
    };
    let mut ways = Segments::default();
    for (lane, hit) in hits.iter().enumerate() {
        ways.set(lane, hit.position, from - hit.position);
        ways.own[lane] = surface(hit).map_or(-1.0, |surface| scene.box_with(surface.index() as f64));
    }
    let mut sum = Spectrum::ZERO;
    for (hit, clear) in hits.iter().zip(scene.clear_of_boxes(&ways)) {
        let lux = per_lumen(from - hit.position, hit.normal) * clear;
        if lux > 0.0 && is_far(tube.origin, tube.opening_radius, hit.position, 0.0) {
            let optics = surface(hit).and_then(|surface| scene.optics(surface));
            sum += optics.map_or(Spectrum::ZERO, |optics| optics.diffuse()) * lux;
        }
    }
    sum
}

/// Illuminances of the patches where light that is reflected once gives `first`, and rays from each meet `met`.
fn solve<const C: usize>(
    first: &[Spectrum<C>],
    met: &[Option<usize>],
    reflectances: &[Spectrum<C>],
    rays: usize,
) -> Vec<Spectrum<C>> {
    let mut lux = first.to_vec();
    let all = |lux: &[Spectrum<C>]| lux.iter().map(Spectrum::luminance).sum::<f64>();
    for _ in 0..REFLECTIONS {
        let before = all(&lux);
        let exitances: Vec<Spectrum<C>> = lux.iter().zip(reflectances).map(|(lux, by)| *lux * *by).collect();
        for ((lux, first), met) in lux.iter_mut().zip(first).zip(met.chunks(rays)) {
            let mut sum = Spectrum::ZERO;
            met.iter().flatten().for_each(|patch| sum += exitances[*patch]);
            *lux = *first + sum * (1.0 / rays as f64);
        }
        if all(&lux) - before <= ADDED * before {
            break;
        }
    }
    lux
}

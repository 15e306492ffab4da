//! Eye rays of methods that gather photons: their start in the room, and their paths by way of mirrors, glossy lobes and tubes.
//!
//! A ray gathers light from photons at the diffuse parts of surfaces, and continues in a direction sampled from the specular part. A
//! diffuser or a luminaire that a glossy lobe reflects is found in two ways, by connections to its photons or points and by the sampled
//! direction; the balance heuristic combines them (Veach and Guibas 1995).

use std::cell::Cell;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::maps::{Gathered, Mapper, Maps};
use super::near_light::{luminaire_weight, opening_weight};
use super::outline::{MIRRORS, OutlinedView};
use crate::integrator::ViewPass;
use crate::integrator::backward::meeting::{Meeting, Ray, Walk};
use crate::integrator::backward::opening::DaylightWeights;
use crate::integrator::backward::room_entry::enter_room;
use crate::integrator::backward::vertex::Vertex;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Stream};
use crate::scene::View;
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableScene};

/// Number of specular reflections of one eye ray that are followed without Russian roulette.
const SURE_REFLECTIONS: u32 = 8;

/// Computes `of` for every pixel of a view, from its number and its column and row; returns `None` if cancelled.
pub fn pixels<T: Send>(view: &View, cancel: &AtomicBool, of: impl Fn(usize, [usize; 2]) -> T + Sync) -> Option<Vec<T>> {
    let [width, height] = view.size_px;
    let rows: Option<Vec<_>> = (0..height)
        .into_par_iter()
        .map(|row| {
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            Some((0..width).map(|column| of(row * width + column, [column, row])).collect::<Vec<_>>())
        })
        .collect();
    Some(rows?.into_iter().flatten().collect())
}

/// Renders one view of one pass, with a ray through a random point of every pixel. `luminance` returns the luminance along a ray, by the
/// pixel's number and key and the random numbers. Returns `None` if cancelled.
pub fn view<const C: usize>(
    (mapper, maps): (&Mapper<C>, &Maps<C>),
    outlined: &OutlinedView,
    (key, number): (Key, usize),
    cancel: &AtomicBool,
    luminance: impl Fn(EyeRay, usize, Key, PathSamples) -> Gathered<C> + Sync,
) -> Option<Vec<Gathered<C>>> {
    let view = &outlined.view;
    let [rays, of_straight] = streams(key, number);
    pixels(view, cancel, |pixel, place| {
        let key = rays.child(pixel as u64);
        let mut samples = independent(key);
        let direction = direction(view, place, samples.pair());
        let ray = EyeRay { eye: view.eye, direction, straight: !outlined.is_outlined(pixel) };
        let mut seen = luminance(ray, pixel, key, samples);
        if !ray.straight {
            seen.add_light(&outlined.straight(mapper, maps, place, of_straight.child(pixel as u64)));
        }
        seen
    })
}

/// Returns the random streams of a pass for the rays of view `number`, and for the rays that look for direct light in outlined pixels.
pub fn streams(pass: Key, number: usize) -> [Key; 2] {
    [Stream::GatheringView, Stream::StraightToEye].map(|stream| pass.stream(stream, number as u64))
}

/// A ray from an eye.
#[derive(Clone, Copy, Debug)]
pub struct EyeRay {
    /// Position of the eye, in the room or outside, in m.
    pub eye: DVec3,
    /// Unit vector of the ray.
    pub direction: DVec3,
    /// True if the ray counts diffusers and luminaires that it meets directly or by way of mirrors.
    pub straight: bool,
}

/// Returns the random numbers of an eye ray that is the only one of its key.
pub fn independent(key: Key) -> PathSamples {
    PathSamples::with_pairs(key, 0, 0)
}

/// Returns the unit direction through the point at coordinates 0..1 of the pixel in a column and row.
pub fn direction(view: &View, [column, row]: [usize; 2], [x, y]: [f64; 2]) -> DVec3 {
    view.ray_direction(column as f64 + x, row as f64 + y)
}

impl ViewPass {
    /// Creates the pass of a view from the luminances of its pixels.
    pub fn of<const C: usize>(pixels: &[Gathered<C>]) -> Self {
        Self {
            luminance: pixels.iter().flat_map(|pixel| pixel.irradiance.0).collect(),
            bias: pixels.iter().map(|pixel| pixel.bias).collect(),
            ..Self::default()
        }
    }
}

/// Computes the luminance in cd/m2 that an eye sees along a ray, with its estimated bias.
///
/// `irradiance` is called for every diffuse part of a surface that the ray meets, with the ray's weight there.
pub fn luminance<const C: usize>(
    mapper: &Mapper<C>,
    maps: &Maps<C>,
    ray: EyeRay,
    samples: PathSamples,
    irradiance: impl Fn(&RoomHit, SurfaceId, Spectrum<C>, &mut PathRandom) -> Gathered<C>,
) -> Gathered<C> {
    let scene = &*mapper.scene;
    let EyeRay { eye, direction, straight } = ray;
    let Some(origin) = enter_room(scene, eye, direction) else { return Gathered::NOTHING };
    let gathering = MapGathering { mapper, maps, irradiance, found: Cell::new(0.0), bias: Cell::new(0.0) };
    let mut walk = Walk::new(scene, samples, SURE_REFLECTIONS);
    let trace = EyePathState { origin, lobe: None, beams: None, counted: (!straight).then_some(MIRRORS) };
    walk.luminance(&gathering, origin, direction, trace);
    Gathered { irradiance: walk.sum, found: gathering.found.get(), bias: gathering.bias.get() }
}

/// Gathering of light from photon maps along the path of an eye ray.
struct MapGathering<'a, const C: usize, F> {
    mapper: &'a Mapper<C>,
    maps: &'a Maps<C>,
    irradiance: F,
    /// Number of photons found.
    found: Cell<f64>,
    /// Estimated bias in cd/m2.
    bias: Cell<f64>,
}

/// Glossy surface where sunbeams were gathered.
#[derive(Clone, Copy)]
struct BeamsGathered {
    /// Probability density per sr of the direction in which the eye ray left it.
    density: f64,
    /// Cosine of that direction.
    cosine: f64,
}

/// State of an eye ray along its path.
#[derive(Clone, Copy)]
struct EyePathState {
    /// Point where it left the last vertex, in m.
    origin: DVec3,
    /// Probability density per sr of its direction if a glossy lobe sampled it.
    lobe: Option<f64>,
    /// Data of the first glossy surface of the path where sunbeams were gathered, by which the sun's light is weighted; `None` before: the
    /// ray then counts all of it.
    beams: Option<BeamsGathered>,
    /// Number of further mirrors up to which other rays count the diffusers and luminaires that the ray meets; `None` if the ray counts
    /// them itself.
    counted: Option<u32>,
}

impl<const C: usize, F> Meeting<C> for MapGathering<'_, C, F>
where
    F: Fn(&RoomHit, SurfaceId, Spectrum<C>, &mut PathRandom) -> Gathered<C>,
{
    const FOLLOWS_DIFFUSE: bool = false;
    type Trace = EyePathState;
    /// First glossy surface of the path where sunbeams were gathered.
    type Arrival = Option<BeamsGathered>;

    fn arrives(&self, state: &EyePathState, _: f64) -> Self::Arrival {
        state.beams
    }

    fn arrives_at_closure(&self) -> Self::Arrival {
        None
    }

    fn arrives_at_sensor(&self) -> Self::Arrival {
        None
    }

    fn connect(&self, walk: &mut Walk<'_, C>, vertex: &Vertex<'_, C>, beams: &Self::Arrival) {
        let Some((surface, optics)) = vertex.surface.and_then(|surface| Some((surface, walk.scene.optics(surface)?)))
        else {
            return;
        };
        let Vertex { position, normal, eye, weight, .. } = *vertex;
        let hit = RoomHit { position, normal, place: Place::Surface(surface) };
        if optics.gathers() {
            let brdf = optics.diffuse() * (1.0 / PI);
            let part = (self.irradiance)(&hit, surface, weight, &mut walk.samples.random);
            self.found.set(self.found.get() + part.found);
            self.bias.set(self.bias.get() + part.bias * (weight * brdf).luminance());
            walk.sum += part.irradiance * weight * brdf;
        }
        if let Some(lobe) = optics.lobe() {
            let (mapper, maps) = (self.mapper, self.maps);
            let weight = weight * optics.specular();
            let random = &mut walk.samples.random;
            walk.sum += mapper.diffusers_in_lobe(maps, lobe, &hit, Some(surface), eye, random) * weight;
            walk.sum += mapper.luminaires_in_lobe(lobe, &hit, Some(surface), eye, random) * weight;
            if beams.is_none() {
                let (beams, bias) = mapper.beams_in_lobe(maps, lobe, &hit, eye);
                walk.sum += beams * weight;
                self.bias.set(self.bias.get() + bias * weight.luminance());
            }
        }
    }

    fn leaves(
        &self,
        _: &TraceableScene,
        vertex: &Vertex<'_, C>,
        beams: &Self::Arrival,
        toward: DVec3,
        density: f64,
    ) -> EyePathState {
        let here = BeamsGathered { density, cosine: toward.dot(vertex.normal) };
        EyePathState { origin: vertex.position, lobe: Some(density), beams: Some(beams.unwrap_or(here)), counted: None }
    }

    fn turns(&self, _: &TraceableScene, state: &EyePathState, _: SurfaceId) -> EyePathState {
        EyePathState { lobe: None, counted: state.counted.and_then(|mirrors| mirrors.checked_sub(1)), ..*state }
    }

    fn passes(&self, state: &EyePathState) -> EyePathState {
        EyePathState { lobe: None, counted: None, ..*state }
    }

    fn luminaire_weight(
        &self,
        scene: &TraceableScene,
        number: usize,
        ray: &Ray<C, EyePathState>,
        position: DVec3,
    ) -> f64 {
        let EyePathState { origin, lobe, counted, .. } = ray.trace;
        if counted.is_some() { 0.0 } else { luminaire_weight(lobe, &scene.luminaires[number], position - origin) }
    }

    /// Ends the path at a diffuser, whose luminance is estimated from the photons that it scattered.
    fn meets_opening(
        &self,
        walk: &mut Walk<'_, C>,
        tube: usize,
        ray: &Ray<C, EyePathState>,
        position: DVec3,
    ) -> Option<DaylightWeights> {
        let of_tube = &walk.scene.tubes[tube];
        let closure = of_tube.closure_at(position);
        if closure.unscattered::<C>().is_some() {
            let sun = ray.trace.beams.map_or(1.0, |BeamsGathered { density, cosine }| {
                density / (density + self.mapper.beams_gathered(self.maps, tube, cosine))
            });
            return Some(DaylightWeights { sky: 1.0, sky_later: 1.0, sun });
        }
        if ray.trace.counted.is_some() {
            return None;
        }
        let seen = self.mapper.luminance(self.maps, tube, closure, position, ray.direction);
        let weight = ray.weight * opening_weight(ray.trace.lobe, of_tube, position - ray.trace.origin);
        walk.sum += seen.irradiance * weight;
        self.bias.set(self.bias.get() + seen.bias * weight.luminance());
        None
    }
}

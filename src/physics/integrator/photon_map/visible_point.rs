//! Eyes: where what they see begins, and their rays' way by mirrors, glossy lobes and tubes.
//!
//! Rays find the diffuse parts of surfaces, whose light is gathered from photons, and go on into a direction of the specular
//! part. A diffuser or a luminaire that a glossy lobe reflects is found in two ways, by connections to its photons or points and by
//! the direction that the ray takes; they share it by the balance heuristic (Veach and Guibas 1995).

use std::cell::Cell;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::maps::{Gathered, Mapper, Maps};
use super::near_light::{share_of, share_of_luminaire};
use super::outline::{MIRRORS, OutlinedView};
use crate::integrator::ViewPass;
use crate::integrator::backward::opening::DaylightShare;
use crate::integrator::backward::room_entry::enter_room;
use crate::integrator::backward::vertex::Vertex;
use crate::integrator::backward::walk::{Meeting, Ray, Walk};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Stream};
use crate::scene::View;
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableScene};

/// Specular reflections of one eye ray that no roulette decides, as long as they are worth it.
const SURE_REFLECTIONS: u32 = 8;

/// Results of `of` for every pixel of a view, of its number and its column and row; `None` when cancelled.
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

/// One view of one pass, a ray to a random point of every pixel; `luminance` along a direction has what of straight light that
/// ray counts, the pixel's number and key, and its random numbers. `None` when cancelled.
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

/// Streams under the key of a pass for the rays of view `number`, and for those that look for straight light.
pub fn streams(pass: Key, number: usize) -> [Key; 2] {
    [Stream::GatheringView, Stream::StraightToEye].map(|stream| pass.stream(stream, number as u64))
}

/// A ray from an eye.
#[derive(Clone, Copy, Debug)]
pub struct EyeRay {
    /// Where it starts, in the room or outside.
    pub eye: DVec3,
    /// Unit vector.
    pub direction: DVec3,
    /// True if it counts what shines into the eye straight or by way of mirrors.
    pub straight: bool,
}

/// Numbers of an eye ray that is the only one of its key.
pub fn independent(key: Key) -> PathSamples {
    PathSamples::with_pairs(key, 0, 0)
}

/// Unit direction through the point at coordinates 0..1 of the pixel in a column and row.
pub fn direction(view: &View, [column, row]: [usize; 2], [x, y]: [f64; 2]) -> DVec3 {
    view.ray_direction(column as f64 + x, row as f64 + y)
}

impl ViewPass {
    /// Pass of a view made of what is seen in each pixel.
    pub fn of<const C: usize>(pixels: &[Gathered<C>]) -> Self {
        Self {
            luminance: pixels.iter().flat_map(|pixel| pixel.irradiance.0).collect(),
            bias: pixels.iter().map(|pixel| pixel.bias).collect(),
            ..Self::default()
        }
    }
}

/// Luminance in cd/m2 that an eye sees along a ray, with its estimated bias.
///
/// `irradiance` is asked at every diffuse part that the ray meets, with the ray's weight there.
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
    let gathering = Gathering { mapper, maps, irradiance, found: Cell::new(0.0), bias: Cell::new(0.0) };
    let mut walk = Walk::new(scene, samples, SURE_REFLECTIONS);
    let trace = EyeWay { origin, lobe: None, beams: None, counted: (!straight).then_some(MIRRORS) };
    walk.luminance(&gathering, origin, direction, trace);
    Gathered { irradiance: walk.sum, found: gathering.found.get(), bias: gathering.bias.get() }
}

/// Light that is gathered from photon maps along the way of an eye ray.
struct Gathering<'a, const C: usize, F> {
    mapper: &'a Mapper<C>,
    maps: &'a Maps<C>,
    irradiance: F,
    /// Photons found.
    found: Cell<f64>,
    /// Estimated bias in cd/m2.
    bias: Cell<f64>,
}

/// A glossy surface where sunbeams were gathered.
#[derive(Clone, Copy)]
struct BeamsGathered {
    /// Density per sr of the direction in which the eye ray left it.
    density: f64,
    /// Cosine of that direction.
    cosine: f64,
}

/// What an eye ray remembers of its way.
#[derive(Clone, Copy)]
struct EyeWay {
    /// Where it left the last vertex.
    origin: DVec3,
    /// Density per sr of its direction when a glossy lobe chose it.
    lobe: Option<f64>,
    /// What the sun's light is shared by since beams were gathered at a glossy surface; the first one of the way counts all.
    beams: Option<BeamsGathered>,
    /// Mirrors still to come up to which other rays count the diffusers and luminaires that the way comes upon; `None`: they do not.
    counted: Option<u32>,
}

impl<const C: usize, F> Meeting<C> for Gathering<'_, C, F>
where
    F: Fn(&RoomHit, SurfaceId, Spectrum<C>, &mut PathRandom) -> Gathered<C>,
{
    const FOLLOWS_DIFFUSE: bool = false;
    type Trace = EyeWay;
    /// Where beams were gathered before.
    type Arrival = Option<BeamsGathered>;

    fn arrives(&self, way: &EyeWay, _: f64) -> Self::Arrival {
        way.beams
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
    ) -> EyeWay {
        let here = BeamsGathered { density, cosine: toward.dot(vertex.normal) };
        EyeWay { origin: vertex.position, lobe: Some(density), beams: Some(beams.unwrap_or(here)), counted: None }
    }

    fn turns(&self, _: &TraceableScene, way: &EyeWay, _: SurfaceId) -> EyeWay {
        EyeWay { lobe: None, counted: way.counted.and_then(|mirrors| mirrors.checked_sub(1)), ..*way }
    }

    fn passes(&self, way: &EyeWay) -> EyeWay {
        EyeWay { lobe: None, counted: None, ..*way }
    }

    fn luminaire_share(&self, scene: &TraceableScene, number: usize, ray: &Ray<C, EyeWay>, position: DVec3) -> f64 {
        let EyeWay { origin, lobe, counted, .. } = ray.trace;
        if counted.is_some() { 0.0 } else { share_of_luminaire(lobe, &scene.luminaires[number], position - origin) }
    }

    /// A diffuser ends the path: what it sends is known from the photons that it scattered.
    fn meets_opening(
        &self,
        walk: &mut Walk<'_, C>,
        tube: usize,
        ray: &Ray<C, EyeWay>,
        position: DVec3,
    ) -> Option<DaylightShare> {
        let of_tube = &walk.scene.tubes[tube];
        let closure = of_tube.closure_at(position);
        if closure.unscattered::<C>().is_some() {
            let sun = ray.trace.beams.map_or(1.0, |BeamsGathered { density, cosine }| {
                density / (density + self.mapper.beams_gathered(self.maps, tube, cosine))
            });
            return Some(DaylightShare { sky: 1.0, sky_later: 1.0, sun });
        }
        if ray.trace.counted.is_some() {
            return None;
        }
        let seen = self.mapper.luminance(self.maps, tube, closure, position, ray.direction);
        let weight = ray.weight * share_of(ray.trace.lobe, of_tube, position - ray.trace.origin);
        walk.sum += seen.irradiance * weight;
        self.bias.set(self.bias.get() + seen.bias * weight.luminance());
        None
    }
}

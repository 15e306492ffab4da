//! Backward paths of a whole pass: those of the sensors of a grid, and those of the pixels of a view.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::meeting::{Meeting, Ray, Walk};
use super::next_event::{Daylight, NextEvent, PathState};
use super::vertex::Vertex;
use crate::guide::RayCount;
use crate::integrator::backward::room_entry::enter_room;
use crate::integrator::radiosity::Aim;
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Replicate, Stream, lattice, warp};
use crate::scene::{EstimateKind, Grid, Sensor, View};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{Place, TraceableScene};

/// Number of pairs of Sobol coordinates of a path from an eye, whose points are low-discrepancy together with those of neighbouring pixels:
/// a third pair gains nothing.
pub const SOBOL_PAIRS_SEEN: u32 = 2;

/// Numbers of backward paths and of their random decisions.
#[derive(Clone, Copy)]
pub struct Sampling {
    /// Number of paths per sensor or pixel.
    pub paths: u32,
    /// Number of a sensor's paths that continue beyond the first surface that has a coarse solution; `None` where there is no coarse
    /// solution.
    pub beyond: Option<u32>,
    /// Number of first reflections of each path without Russian roulette.
    pub certain: u32,
    /// Number of pairs of Sobol coordinates of each path.
    pub pairs: u32,
}

impl Sampling {
    fn walk<const C: usize>(self, scene: &TraceableScene, stream: Key, number: u64) -> Walk<'_, C> {
        Walk::new(scene, PathSamples::with_pairs(stream, number, self.pairs), self.certain)
    }
}

/// Low-discrepancy directions of a sensor's paths, and the choice of those that continue beyond the coarse solution; both differ between
/// keys.
///
/// The directions are those of a lattice ([`lattice`]).
struct SensorDirections {
    paths: f64,
    shift: [f64; 2],
    /// Number of paths for each one that continues.
    stride: f64,
    /// Lower bound, not yet rounded up, of the number of the next path that continues.
    next: f64,
}

impl SensorDirections {
    fn new(sampling: Sampling, beyond: u32, random: &mut PathRandom) -> Self {
        let paths = f64::from(sampling.paths);
        let stride = paths / f64::from(beyond);
        Self { paths, shift: random.uniform2(), stride, next: random.uniform() * stride }
    }

    /// Returns the point of a path, and the number of paths that it represents if it continues; 0 if it does not. Must be called for the
    /// paths in turn.
    fn path(&mut self, number: u64) -> ([f64; 2], f64) {
        let number = number as f64;
        let stands_for = if self.next < number + 1.0 { self.stride } else { 0.0 };
        self.next += stands_for;
        (lattice::point(number, self.paths, self.shift), stands_for)
    }
}

/// Computes `of` for every index below `count` in parallel; `None` when cancelled.
pub fn each<T: Send>(count: usize, cancel: &AtomicBool, of: impl Fn(usize) -> T + Sync) -> Option<Vec<T>> {
    let going_on = |index: usize| (!cancel.load(Ordering::Relaxed)).then(|| of(index));
    (0..count).into_par_iter().map(going_on).collect()
}

/// Returns sensor `index` of a grid, lifted slightly off the surface on which it lies; of a cell the centre.
pub fn lifted(scene: &TraceableScene, grid: &Grid, index: usize) -> Sensor {
    let Sensor { position, normal } = grid.sensor(index);
    Sensor { position: position + normal * scene.contact(), normal }
}

/// Illuminance of a sensor in lx.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lux {
    /// Illuminance in lx by all paths.
    pub whole: f64,
    /// Part of it in lx that a coarse solution leaves out.
    pub beyond: f64,
}

/// Computes the illuminance of sensor `index` of a grid by backward paths, and the number of their rays; 0 where it lies inside a solid.
pub fn sensor<const C: usize>(
    scene: &TraceableScene,
    grid: &Grid,
    index: usize,
    sampling: Sampling,
    stream: Key,
    daylight: &impl Daylight<C>,
) -> (Lux, RayCount) {
    // such a sensor gets light by its paths only from what surfaces reflect
    let gathers = (daylight.luminaires_at_sensor().is_some()
        || !scene.luminaires.iter().any(TraceableLuminaire::emits))
        && (0..scene.tubes.len()).all(|tube| !daylight.lights_sensor(tube));
    paths(scene, (grid, index), (sampling, gathers), stream, &NextEvent(daylight))
}

/// Follows the backward paths of sensor `index` of a grid, and returns their light and the number of their rays; 0 where it lies inside a
/// solid. `gathers` is true if a sensor that is a point gets light by its paths only from what surfaces reflect.
pub fn paths<const C: usize>(
    scene: &TraceableScene,
    (grid, index): (&Grid, usize),
    (sampling, gathers): (Sampling, bool),
    stream: Key,
    meeting: &impl Meeting<C, Trace = PathState>,
) -> (Lux, RayCount) {
    let Sensor { position: centre, normal } = lifted(scene, grid, index);
    let (mut lux, mut rays) = (Lux::default(), RayCount::default());
    if grid.is_inside(index) {
        return (lux, rays);
    }
    let mut random = PathRandom::new(stream.stream(Stream::GatherDirections, 0));
    let mut spread = sampling.beyond.map(|beyond| SensorDirections::new(sampling, beyond, &mut random));
    let mut going_on = 0;
    let is_point = grid.estimate == EstimateKind::Point && !scene.is_in_solid(centre);
    for number in 0..u64::from(sampling.paths) {
        let next = spread.as_mut().map(|spread| spread.path(number));
        if let Some((point, 0.0)) = next
            && gathers
            && is_point
        {
            let of_ray = FirstHitLight::from_sensor(scene, meeting, Sensor { position: centre, normal }, point);
            let Some(mut gathered) = of_ray else { continue };
            if !gathered.follow(scene, meeting, &mut random) {
                let mut walk: Walk<'_, C> = sampling.walk(scene, stream, number);
                walk.stands_for = Some(0.0);
                walk.follow(meeting, gathered.ray);
                gathered.sum += walk.sum;
                lux.beyond += walk.beyond.luminance();
                rays += walk.rays;
            }
            lux.whole += gathered.sum.luminance();
            rays += gathered.rays;
            continue;
        }
        // the paths that continue have consecutive numbers, which keeps their points uniform
        let number = match next {
            Some((_, stands_for)) if stands_for > 0.0 => {
                going_on += 1;
                going_on - 1
            }
            Some(_) => u64::from(sampling.paths) + number,
            None => number,
        };
        let mut walk: Walk<'_, C> = sampling.walk(scene, stream, number);
        let mut position = centre;
        if grid.estimate == EstimateKind::CellAverage {
            let [u, v] = walk.samples.pair();
            position.x += (u - 0.5) * grid.cell_size_m[0];
            position.y += (v - 0.5) * grid.cell_size_m[1];
        }
        if let Some((point, stands_for)) = next {
            walk.samples.begin_with(point);
            walk.stands_for = Some(stands_for);
        }
        if is_point || !scene.is_in_solid(position) {
            walk.illuminance(meeting, Sensor { position, normal });
        }
        let whole = walk.sum.luminance();
        lux.whole += whole;
        lux.beyond += walk.beyond.luminance();
        rays += walk.rays;
    }
    let paths = f64::from(sampling.paths);
    (Lux { whole: lux.whole / paths, beyond: lux.beyond / paths }, rays)
}

/// Light found by a sensor's ray that ends at the first surface with a coarse solution, and by its reflections if that is a mirror: a
/// faster form of [`Walk`].
struct FirstHitLight<const C: usize> {
    /// Illuminance in lux.
    sum: Spectrum<C>,
    /// Part of the ray that is not yet followed.
    ray: Ray<C, PathState>,
    rays: u64,
}

/// Fraction of a ray's first weight below which Russian roulette decides whether a mirror reflects it.
const FAINT: f64 = 0.2;

impl<const C: usize> FirstHitLight<C> {
    /// Makes a ray from a sensor in the direction given by a point of the unit square; `None` where it would be aimed below the horizon.
    fn from_sensor(
        scene: &TraceableScene,
        meeting: &impl Meeting<C, Trace = PathState>,
        sensor: Sensor,
        point: [f64; 2],
    ) -> Option<Self> {
        let bright = meeting.bright_patches();
        let fraction = bright.map_or(0.0, |bright| bright.fraction(0.0));
        let aim = bright.map_or(Aim::Elsewhere(point), |bright| bright.aim(fraction, point));
        let (direction, target) = match aim {
            Aim::At(target, place) => ((place - sensor.position).try_normalize()?, Some(target)),
            Aim::Elsewhere(point) => (warp::around(sensor.normal, warp::cosine_hemisphere(point)), None),
        };
        let cosine = direction.dot(sensor.normal);
        let rest = 1.0 - fraction;
        let arrival = meeting.arrives_at_sensor();
        let trace = meeting.leaves(scene, &Vertex::sensor(sensor), &arrival, direction, cosine / PI);
        let trace = if bright.is_some() { meeting.is_aimed(trace, target, fraction) } else { trace };
        let (origin, weight) = (sensor.position, Spectrum::ONE * (PI / rest));
        let ray = Ray { origin, direction, from: None, weight, reflected: true, trace };
        (cosine > 0.0).then_some(Self { sum: Spectrum::ZERO, ray, rays: 0 })
    }

    /// Follows the ray; returns false where it meets a lobe, or something without a coarse solution, and must be followed by a walk from there.
    #[inline]
    fn follow(
        &mut self,
        scene: &TraceableScene,
        meeting: &impl Meeting<C, Trace = PathState>,
        random: &mut PathRandom,
    ) -> bool {
        for _ in 0..MAX_EVENTS {
            let Ray { origin, direction, from, weight, trace, .. } = self.ray;
            let hit = scene.intersect(origin, direction, from);
            let Place::Surface(surface) = hit.place else { return false };
            let optics = scene.optics(surface).filter(|optics| optics.is_specular());
            if optics.is_some_and(|optics| !optics.is_mirror()) {
                return false;
            }
            let weight = weight * meeting.aim_weight(&self.ray, surface, &hit);
            if weight.max() <= 0.0 {
                return true;
            }
            let coarse = meeting.reflected(&self.ray, surface, hit.position);
            let Some(coarse) = coarse else { return false };
            self.rays += 1;
            self.sum += weight * coarse;
            meeting.counts((surface, hit.position), weight, 1.0, 0.0);
            let Some(optics) = optics else { return true };
            let weight = weight * optics.specular();
            let survival = (weight.max() / (FAINT * PI)).min(1.0);
            if survival <= 0.0 || random.uniform() >= survival {
                return true;
            }
            let Some(direction) = optics.reflect(hit.normal, -direction, [0.0; 2], random) else { return true };
            let trace = meeting.turns(scene, &trace, surface);
            let (origin, from, weight) = (hit.position, Some(surface), weight * (1.0 / survival));
            self.ray = Ray { origin, direction, from, weight, reflected: true, trace };
        }
        true
    }
}

/// Computes the luminance in cd/m2 of every pixel of a view by backward paths, channels interleaved, and the number of their rays; `None`
/// when cancelled.
pub fn view<const C: usize>(
    scene: &TraceableScene,
    view: &View,
    sampling: Sampling,
    stream: Key,
    daylight: &impl Daylight<C>,
    cancel: &AtomicBool,
) -> Option<(Vec<f64>, RayCount)> {
    let pixels =
        each(view.size_px[0] * view.size_px[1], cancel, |index| pixel(scene, view, index, sampling, stream, daylight))?;
    let mut luminance = Vec::new();
    let mut rays = RayCount::default();
    for (seen, of_pixel) in pixels {
        luminance.extend(seen.0);
        rays += of_pixel;
    }
    Some((luminance, rays))
}

/// Computes the luminance of one pixel in cd/m2, and the number of rays traced for it.
fn pixel<const C: usize>(
    scene: &TraceableScene,
    view: &View,
    pixel: usize,
    sampling: Sampling,
    stream: Key,
    daylight: &impl Daylight<C>,
) -> (Spectrum<C>, RayCount) {
    let (column, row) = (pixel % view.size_px[0], pixel / view.size_px[0]);
    let (mut luminance, mut rays) = (Spectrum::ZERO, RayCount::default());
    let paths = u64::from(sampling.paths);
    let first = number_in_squares([column, row]) * paths;
    for number in first..first + paths {
        let mut walk: Walk<'_, C> = sampling.walk(scene, stream, number);
        let [x, y] = place_in_pixel(stream, number, paths, &mut walk.samples);
        let direction = view.ray_direction(column as f64 + x, row as f64 + y);
        if let Some(origin) = enter_room(scene, view.eye, direction) {
            walk.luminance(&NextEvent(daylight), origin, direction, PathState::FROM_EYE);
        }
        luminance += walk.sum;
        rays += walk.rays;
    }
    (luminance * (1.0 / f64::from(sampling.paths)), rays)
}

/// Returns a point of a pixel, both coordinates in 0..1, for path `number` where each pixel has `paths`.
pub fn place_in_pixel(stream: Key, number: u64, paths: u64, samples: &mut PathSamples) -> [f64; 2] {
    if paths == 1 {
        // the low-discrepancy points are worth more to directions, which neighbouring pixels share
        return samples.random.uniform2();
    }
    let [x, y, ..] = beside_directions(stream, number);
    [x, y]
}

/// Returns low-discrepancy numbers of path `number` of a view for what is not a direction: a point of its pixel, then two choices.
pub fn beside_directions(stream: Key, number: u64) -> [f64; 4] {
    let (replicate, number) = Replicate::of(stream.stream(Stream::PlacesInPixels, 0), number);
    replicate.point(number, 0)
}

/// Numbers a pixel along a curve that fills one aligned square of 2^k x 2^k pixels after the other, for every k (Morton 1966).
///
/// Points of a Sobol sequence with these numbers are uniform over each such square, so that the errors of neighbouring pixels compensate
/// each other (Ahmed and Wonka 2020).
pub fn number_in_squares([column, row]: [usize; 2]) -> u64 {
    bits_apart(column as u32) | bits_apart(row as u32) << 1
}

/// Returns the bits of a number, each followed by a zero.
fn bits_apart(number: u32) -> u64 {
    let halves = [
        (16, 0x0000_ffff_0000_ffff),
        (8, 0x00ff_00ff_00ff_00ff),
        (4, 0x0f0f_0f0f_0f0f_0f0f),
        (2, 0x3333_3333_3333_3333),
        (1, 0x5555_5555_5555_5555),
    ];
    halves.into_iter().fold(u64::from(number), |bits, (width, mask)| (bits | bits << width) & mask)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks that every aligned square of 16 x 16 pixels has one point in each of as many equal parts of the unit square, wherever it
    /// lies, and so has every one of 4 x 4; no two pixels have one number.
    #[test]
    fn squares_of_pixels_share_even_points() {
        let key = Key::new(3);
        for side in [4, 16] {
            for [left, top] in [[0, 0], [side, 0], [48, 16], [272, 1040]] {
                let mut seen = vec![0; side * side];
                for place in 0..side * side {
                    let number = number_in_squares([left + place % side, top + place / side]);
                    let mut samples = PathSamples::with_pairs(key, number, 1);
                    let part = |at: f64| (at * side as f64) as usize;
                    let [x, y] = samples.pair();
                    seen[part(y) * side + part(x)] += 1;
                }
                assert!(seen.iter().all(|count| *count == 1), "{side} {left} {top}: {seen:?}");
            }
        }
        let mut numbers: Vec<u64> = (0..64 * 64).map(|place| number_in_squares([place % 64, place / 64])).collect();
        numbers.sort_unstable();
        assert!(numbers.into_iter().eq(0..64 * 64));
    }
}

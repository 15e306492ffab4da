//! Backward paths of a whole pass: of the sensors of a grid, of the pixels of a view.

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::next_event::{Daylight, NextEvent, Way};
use super::walk::Walk;
use crate::guide::RayCount;
use crate::integrator::backward::room_entry::enter_room;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples};
use crate::scene::{EstimateKind, Grid, View};
use crate::traceable::TraceableScene;

/// Numbers by which backward paths are drawn.
#[derive(Clone, Copy)]
pub struct Sampling {
    /// Number of paths per sensor or pixel.
    pub paths: u32,
    /// First reflections of each that no roulette decides.
    pub certain: u32,
    /// Pairs of Sobol coordinates of each.
    pub pairs: u32,
}

impl Sampling {
    fn walk<const C: usize>(self, scene: &TraceableScene, stream: Key, number: u64) -> Walk<'_, C> {
        Walk::new(scene, PathSamples::with_pairs(stream, number, self.pairs), self.certain)
    }
}

/// Results of `of` for every index below `count`; `None` when cancelled.
pub fn each<T: Send>(count: usize, cancel: &AtomicBool, of: impl Fn(usize) -> T + Sync) -> Option<Vec<T>> {
    let going_on = |index: usize| (!cancel.load(Ordering::Relaxed)).then(|| of(index));
    (0..count).into_par_iter().map(going_on).collect()
}

/// Centre of sensor `index` of a grid.
pub fn centre(scene: &TraceableScene, grid: &Grid, index: usize) -> DVec3 {
    grid.centre(index) + DVec3::Z * scene.contact()
}

/// Illuminance in lux of sensor `index` of a grid by backward paths, and the rays they took.
pub fn sensor<const C: usize>(
    scene: &TraceableScene,
    grid: &Grid,
    index: usize,
    sampling: Sampling,
    stream: Key,
    daylight: &impl Daylight<C>,
) -> (f64, RayCount) {
    let centre = centre(scene, grid, index);
    let (mut lux, mut rays) = (0.0, RayCount::default());
    for number in 0..u64::from(sampling.paths) {
        let mut walk: Walk<'_, C> = sampling.walk(scene, stream, number);
        let mut position = centre;
        if grid.estimate == EstimateKind::CellAverage {
            let [u, v] = walk.samples.pair();
            position.x += (u - 0.5) * grid.cell_size_m[0];
            position.y += (v - 0.5) * grid.cell_size_m[1];
        }
        if !scene.is_in_box(position) {
            walk.illuminance(&NextEvent(daylight), position);
        }
        lux += walk.sum.luminance();
        rays += walk.rays;
    }
    (lux / f64::from(sampling.paths), rays)
}

/// Luminance in cd/m2 of every pixel of a view by backward paths each, channels interleaved, and the rays they took; `None`
/// when cancelled.
pub fn view<const C: usize>(
    scene: &TraceableScene,
    view: &View,
    sampling: Sampling,
    stream: Key,
    daylight: &impl Daylight<C>,
    cancel: &AtomicBool,
) -> Option<(Vec<f64>, RayCount)> {
    let pixels = each(view.size_px[0] * view.size_px[1], cancel, |index| {
        pixel(scene, view, index, sampling, stream.child(index as u64), daylight)
    })?;
    let mut luminance = Vec::new();
    let mut rays = RayCount::default();
    for (seen, of_pixel) in pixels {
        luminance.extend(seen.0);
        rays += of_pixel;
    }
    Some((luminance, rays))
}

/// Luminance of one pixel in cd/m2, and the rays it took.
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
    for number in 0..u64::from(sampling.paths) {
        let mut walk: Walk<'_, C> = sampling.walk(scene, stream, number);
        let [x, y] = walk.samples.pair();
        let direction = view.ray_direction(column as f64 + x, row as f64 + y);
        if let Some(origin) = enter_room(scene, view.eye, direction) {
            walk.luminance(&NextEvent(daylight), origin, direction, Way::FROM_EYE);
        }
        luminance += walk.sum;
        rays += walk.rays;
    }
    (luminance * (1.0 / f64::from(sampling.paths)), rays)
}

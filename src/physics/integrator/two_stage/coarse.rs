//! A coarse solution of what surfaces reflect, which is found before any path is followed.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::integrator::lamp::beside::{Lamps, Lit};
use crate::integrator::method::Task;
use crate::integrator::radiosity::{Exchange, Solution};
use crate::sampling::{Key, Stream};
use crate::scene::{Grid, View};

/// Photons down each tube by which the room is tried.
pub const PHOTONS_DOWN_EACH: u64 = 64;

/// Passes of the trial; the random numbers of the coarse solution come behind theirs.
pub const TRIED_PASSES: u64 = 4;

/// Sensors of some grids that have a value.
pub fn valued(grids: &[Grid]) -> usize {
    grids.iter().map(Grid::valued).sum()
}

/// Pixels of some views.
pub fn pixels(views: &[View]) -> usize {
    views.iter().map(|view| view.size_px[0] * view.size_px[1]).sum()
}

/// Solves coarsely for the light of a few photons that surfaces reflect.
pub fn reflected<const C: usize>(task: &Task, exchange: &Arc<Exchange<C>>, seed: u64, target: f64) -> Arc<Solution<C>> {
    let scene = task.traceable;
    let photons = PHOTONS_DOWN_EACH * scene.tubes.len().max(1) as u64;
    let key = Key::new(seed).stream(Stream::SizeTrial, TRIED_PASSES);
    let lit = Lamps::new(scene, &[], (photons, target), seed).pass(scene, key, &AtomicBool::new(false));
    let fluxes = lit.map_or_else(Vec::new, |lit: Lit<C>| lit.lamps.fluxes());
    Arc::new(exchange.solve(&fluxes))
}

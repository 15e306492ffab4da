//! What is found out in the room before any path: a coarse solution of what surfaces reflect.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::integrator::lamp::beside::{Lamps, Lit};
use crate::integrator::method::Task;
use crate::integrator::radiosity::{Exchange, Solution};
use crate::sampling::{Key, Stream};
use crate::scene::{Grid, View};

/// Photons down each tube by which the room is tried.
pub const PHOTONS_DOWN_EACH: u64 = 64;

/// Number of the coarse solution's random numbers, behind those of all passes of the trial.
const COARSE: u64 = 4;

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
    let key = Key::new(seed).stream(Stream::SizeTrial, COARSE);
    let lit = Lamps::new(scene, &[], (photons, target), seed).pass(scene, key, &AtomicBool::new(false));
    let fluxes = lit.map_or_else(Vec::new, |lit: Lit<C>| lit.lamps.fluxes());
    Arc::new(exchange.solve(&fluxes))
}

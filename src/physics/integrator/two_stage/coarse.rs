//! Coarse solution of the light that surfaces reflect, which is computed before any path is followed.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::integrator::diffuser_source::closure_source::{ClosureLight, ClosureSource};
use crate::integrator::method::Task;
use crate::integrator::radiosity::{Exchange, Solution};
use crate::sampling::{Key, Stream};
use crate::scene::{Grid, View};

/// Number of photons down each tube in a trial of the room.
pub const PHOTONS_DOWN_EACH: u64 = 64;

/// Number of passes of the trial; the random numbers of the coarse solution follow theirs.
pub const TRIED_PASSES: u64 = 4;

/// Counts the sensors of some grids that have a value.
pub fn valued(grids: &[Grid]) -> usize {
    grids.iter().map(Grid::valued).sum()
}

/// Counts the pixels of some views.
pub fn pixels(views: &[View]) -> usize {
    views.iter().map(|view| view.size_px[0] * view.size_px[1]).sum()
}

/// Computes a coarse solution of the light that surfaces reflect, from a few photons.
pub fn reflected<const C: usize>(task: &Task, exchange: &Arc<Exchange<C>>, seed: u64, target: f64) -> Arc<Solution<C>> {
    let scene = task.traceable;
    let photons = PHOTONS_DOWN_EACH * scene.tubes.len().max(1) as u64;
    let key = Key::new(seed).stream(Stream::SizeTrial, TRIED_PASSES);
    let lit = ClosureSource::new(scene, &[], (photons, target), seed).pass(scene, key, &AtomicBool::new(false));
    let fluxes = lit.map_or_else(Vec::new, |lit: ClosureLight<C>| lit.lambertian.fluxes());
    Arc::new(exchange.solve(&fluxes))
}

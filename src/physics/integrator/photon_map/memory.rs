//! Memory of the photon maps of a pass.

use super::grid::MAX_CELLS;
use crate::integrator::method::Load;

/// Most bytes that the cells of one sorted set of photons take: two numbers each.
const CELLS: f64 = 2.0 * 4.0 * MAX_CELLS;

/// Fraction of the surfaces hit by a photon to which it flies downward through the plane of a grid.
const DOWNWARD: f64 = 0.6;

/// Returns the bytes of the maps of a pass of `photons`, each stored `surfaces` times at every surface that it hits, and once at its
/// diffuser and wherever it crosses the planes of grids.
pub fn bytes(photons: u64, surfaces: f64, load: &Load) -> f64 {
    let grids = load.grids as f64;
    let crossings = grids * DOWNWARD * load.events;
    let kept = (1.0 + crossings + surfaces * load.events) * load.photon_bytes() * Load::COPIES;
    photons as f64 * kept + (grids + 4.0) * CELLS
}

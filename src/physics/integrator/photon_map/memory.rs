//! Memory that the photon maps of a pass take.

use super::grid::MAX_CELLS;
use crate::integrator::method::Load;

/// Bytes of the cells of one sorted set of photons, at most: two numbers each.
const CELLS: f64 = 2.0 * 4.0 * MAX_CELLS;

/// Share of the surfaces that a photon meets which lie beyond the plane of a grid on its way down.
const DOWNWARD: f64 = 0.6;

/// Bytes of the maps of a pass of `photons`, each kept `surfaces` times at every surface that it meets, at its diffuser,
/// and where it crosses the planes of grids.
pub fn bytes(photons: u64, surfaces: f64, load: &Load) -> f64 {
    let grids = load.grids as f64;
    let crossings = grids * DOWNWARD * load.events;
    let kept = (1.0 + crossings + surfaces * load.events) * load.photon_bytes() * Load::COPIES;
    photons as f64 * kept + (grids + 4.0) * CELLS
}

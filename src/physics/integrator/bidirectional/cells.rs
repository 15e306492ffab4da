//! Cells of grids, and which sensors and flights a photon's vertex counts for.

use glam::DVec3;

use crate::scene::{EstimateKind, Grid};

/// Largest number of sensors that one vertex is connected to; larger grids are connected to a random subset of about this size.
const CONNECTIONS: usize = 1024;

/// True for grids of means over cells.
pub fn is_average(grid: &Grid) -> bool {
    grid.estimate == EstimateKind::CellAverage
}

/// Returns the stride through the row-major sensors to which a photon's vertex is connected.
pub fn stride(grid: &Grid) -> usize {
    grid.len().div_ceil(CONNECTIONS)
}

/// Returns the distance in m within which cells count the flights of vertices that only photons can find.
pub fn near(grid: &Grid) -> f64 {
    0.5 * grid.cell_size_m[0].max(grid.cell_size_m[1])
}

/// Returns a point of a sensor's cell; `offset` from its centre, in cells.
pub fn place(grid: &Grid, index: usize, offset: [f64; 2], height: f64) -> DVec3 {
    let centre = grid.centre(index);
    DVec3::new(centre.x + offset[0] * grid.cell_size_m[0], centre.y + offset[1] * grid.cell_size_m[1], height)
}

//! Cells of the faces where sunlight lands that passes clear zones unscattered.

use glam::DVec3;

use crate::analytic::patches::{Mesh, Patch};

/// Number of times that the edges of a patch are halved to get the cells in which landing light is counted.
pub const HALVINGS: u32 = 5;

/// Number of cells along an edge of a patch.
const EDGE: usize = 1 << HALVINGS;

/// Flux in lm that lands in each cell of a room's faces.
#[derive(Clone, Debug)]
pub struct Landed {
    /// Flux of the cells by patch, the patch's second axis running fastest; `None` where nothing lands.
    patches: Vec<Option<Box<[f64]>>>,
}

impl Landed {
    /// Prepares the cells of a mesh, on which nothing has landed.
    pub fn nowhere(mesh: &Mesh) -> Self {
        Self { patches: vec![None; mesh.patches.len()] }
    }

    /// Adds light that lands on a face.
    pub fn add(&mut self, mesh: &Mesh, face: usize, position: DVec3, flux: f64) {
        let patch = mesh.patch_at(face, position);
        let cell = cell(&mesh.patches[patch], position);
        self.patches[patch].get_or_insert_with(|| vec![0.0; EDGE * EDGE].into())[cell] += flux;
    }

    /// Adds the light of another count on the same mesh.
    pub fn merge(&mut self, other: Self) {
        for (sums, cells) in self.patches.iter_mut().zip(other.patches) {
            match (sums, cells) {
                (Some(sums), Some(cells)) => sums.iter_mut().zip(&cells).for_each(|(sum, flux)| *sum += flux),
                (sums, Some(cells)) => *sums = Some(cells),
                (_, None) => {}
            }
        }
    }

    /// Multiplies all light by `factor`.
    pub fn scale(&mut self, factor: f64) {
        self.patches.iter_mut().flatten().flatten().for_each(|flux| *flux *= factor);
    }

    /// Computes the flux in lm on each patch.
    pub fn by_patch(&self) -> impl Iterator<Item = f64> {
        self.patches.iter().map(|cells| cells.as_ref().map_or(0.0, |cells| cells.iter().sum()))
    }

    /// True if light lands on a patch.
    pub fn reaches(&self, patch: usize) -> bool {
        self.patches[patch].is_some()
    }

    /// Returns the flux in lm that lands in one cell, given by its numbers along the patch's first and second axis.
    pub fn flux(&self, patch: usize, [i, j]: [usize; 2]) -> f64 {
        self.patches[patch].as_ref().map_or(0.0, |cells| cells[i * EDGE + j])
    }
}

/// Returns the two axes along which a patch extends, in the order of its cells.
pub fn axes(patch: &Patch) -> [usize; 2] {
    [(patch.axis() + 1) % 3, (patch.axis() + 2) % 3]
}

/// Returns the number of the cell of a patch that holds a point.
fn cell(patch: &Patch, position: DVec3) -> usize {
    let index = |k: usize| {
        let fraction = (position[k] - patch.low[k]) / (patch.high[k] - patch.low[k]);
        // the patch of a point on a border may be found by other roundings
        ((fraction * EDGE as f64).max(0.0) as usize).min(EDGE - 1)
    };
    let [u, v] = axes(patch);
    index(u) * EDGE + index(v)
}

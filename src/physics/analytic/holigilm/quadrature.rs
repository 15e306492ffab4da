//! Means over the cells of grids and the patches of the room, by Gauss' rule.

use std::num::NonZeroUsize;

use gauss_quad::GaussLegendre;
use glam::DVec3;

use crate::analytic::patches::Patch;
use crate::scene::Grid;

/// Returns the position of a sensor, or of the centre of its cell.
pub fn centre(grid: &Grid, sensor: usize) -> DVec3 {
    DVec3::new(grid.x_m[sensor % grid.cells[0]], grid.y_m[sensor / grid.cells[0]], grid.height_m)
}

/// Returns Gauss-Legendre nodes in -0.5..0.5 and weights that add up to one.
pub fn gauss(points: usize) -> Vec<(f64, f64)> {
    let rule = GaussLegendre::new(NonZeroUsize::new(points).unwrap_or(NonZeroUsize::MIN));
    rule.as_node_weight_pairs().iter().map(|(node, weight)| (0.5 * node, 0.5 * weight)).collect()
}

/// Computes the mean over the cell around `centre` by a product of two rules.
pub fn cell_mean(grid: &Grid, centre: DVec3, rule: &[(f64, f64)], at: impl Fn(DVec3) -> f64) -> f64 {
    let mut sum = 0.0;
    for (x, weight_x) in rule {
        for (y, weight_y) in rule {
            let offset = DVec3::new(x * grid.cell_size_m[0], y * grid.cell_size_m[1], 0.0);
            sum += weight_x * weight_y * at(centre + offset);
        }
    }
    sum
}

/// Computes the mean over a patch of the values that `at` returns for a point and the patch's normal.
pub fn patch_mean(patch: &Patch, rule: &[(f64, f64)], at: impl Fn(DVec3, DVec3) -> f64) -> f64 {
    let (u, v) = ((patch.axis() + 1) % 3, (patch.axis() + 2) % 3);
    let extent = patch.high - patch.low;
    let mut sum = 0.0;
    for (a, weight_a) in rule {
        for (b, weight_b) in rule {
            let mut point = patch.centre();
            point[u] += a * extent[u];
            point[v] += b * extent[v];
            sum += weight_a * weight_b * at(point, patch.normal());
        }
    }
    sum
}

//! Openings that sensors see whole, in part or not at all.

use glam::DVec3;
use rayon::prelude::*;

use crate::integrator::backward::pass::lifted;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::TraceableScene;

/// Returns the largest distance in m of the points of a sensor from its centre.
pub fn reach(grid: &Grid) -> f64 {
    match grid.estimate {
        EstimateKind::CellAverage => 0.5 * libm::hypot(grid.cell_size_m[0], grid.cell_size_m[1]),
        EstimateKind::Point => 0.0,
    }
}

/// Returns a point of a cell in m from its centre, for two numbers in 0..1.
pub fn point_of_cell(grid: &Grid, [u, v]: [f64; 2]) -> DVec3 {
    DVec3::new((u - 0.5) * grid.cell_size_m[0], (v - 0.5) * grid.cell_size_m[1], 0.0)
}

/// Part of an opening that a sensor sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VisiblePart {
    /// Certainly the whole opening.
    Whole,
    /// Certainly nothing of it.
    Hidden,
    /// Unknown part, of which only boxes can hide something from the sensor, which is a point.
    PastBoxes,
    /// Unknown part.
    InPart,
}

/// Finds the part of each opening that each sensor of a grid sees, tube by tube.
pub fn visible_parts(scene: &TraceableScene, grid: &Grid) -> Vec<VisiblePart> {
    let reach = reach(grid);
    let of_sensor = |sensor: usize| {
        let position = lifted(scene, grid, sensor).position;
        let corners: Vec<DVec3> = match grid.estimate {
            EstimateKind::Point => vec![position],
            EstimateKind::CellAverage => {
                CORNERS.into_iter().map(|corner| position + point_of_cell(grid, corner)).collect()
            }
        };
        let is_cut = grid.is_cut(sensor);
        scene.tubes.iter().map(move |tube| {
            let (opening, radius) = (&tube.frame, tube.opening.outer_radius());
            if !is_cut && scene.leaves_clear(position, reach, None, opening, radius) {
                VisiblePart::Whole
            } else if scene.hides(&corners, opening, radius) {
                VisiblePart::Hidden
            } else if grid.estimate == EstimateKind::Point && !scene.between(position, opening, radius).is_more {
                VisiblePart::PastBoxes
            } else {
                VisiblePart::InPart
            }
        })
    };
    (0..grid.len()).into_par_iter().flat_map_iter(of_sensor).collect()
}

/// Corners of a cell, in its edges.
const CORNERS: [[f64; 2]; 4] = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]];

//! Starts of the paths that find the patches of a room before the first pass.

use crate::integrator::backward::pass::lifted;
use crate::integrator::backward::room_entry::enter_room;
use crate::scene::{Grid, View};
use crate::traceable::{Place, SurfacePoint, TraceableScene};

/// Largest number of sensors of a grid, and of pixels of a row, from which patches are found.
const STARTS_OF_GRID: usize = 256;
const STARTS_OF_ROW: usize = 16;

/// Chooses starts of paths: some of the sensors, and points that eyes see.
pub fn starts(scene: &TraceableScene, grids: &[Grid], views: &[View]) -> Vec<SurfacePoint> {
    let mut starts = Vec::new();
    for grid in grids.iter().map(|grid| grid.thinned(STARTS_OF_GRID)) {
        let valued = (0..grid.len()).filter(|sensor| !grid.is_inside(*sensor));
        starts.extend(valued.map(|sensor| SurfacePoint::from(lifted(scene, &grid, sensor))));
    }
    for view in views {
        let [columns, rows] = view.size_px;
        let step = columns.max(rows).div_ceil(STARTS_OF_ROW);
        for (x, y) in (0..rows).step_by(step).flat_map(|y| (0..columns).step_by(step).map(move |x| (x, y))) {
            let direction = view.ray_direction(x as f64 + 0.5, y as f64 + 0.5);
            let Some(origin) = enter_room(scene, view.eye, direction) else { continue };
            let hit = scene.intersect(origin, direction, None);
            if let Place::Surface(surface) = hit.place {
                starts.push(SurfacePoint { position: hit.position, normal: hit.normal, surface: Some(surface) });
            }
        }
    }
    starts
}

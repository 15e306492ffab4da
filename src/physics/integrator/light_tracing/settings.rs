//! The settings of light tracing, and how many photons a pass has.

use crate::integrator::method::Task;
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::close_points::points_nearer_than;

/// Settings of light tracing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Photons emitted per pass, all tubes and sources together; 64..=16_777_216; `None`: by the accuracy asked for.
    pub photons_per_pass: Option<u64>,
}

/// Most photons of a pass, unless the document says how many.
pub const MOST: f64 = 8192.0;

/// Photons of a pass, unless the document says how many: what is rare needs so many for honest errors.
const USUAL: PassSize = PassSize { for_one_percent: 2048.0, growth: 1.0, fewest: 512.0, most: MOST };
/// And most of all points beside a wall.
const BESIDE_WALLS: PassSize = PassSize { for_one_percent: MOST, growth: 1.0, fewest: MOST, most: MOST };

/// Share of the room's shortest edge within which points are beside a wall.
const BESIDE: f64 = 0.05;

/// Photons of a pass for a relative standard error `target` of what is traced beside other light.
pub fn photons_for(target: f64) -> u64 {
    USUAL.power_of_two(target)
}

impl Settings {
    /// Photons of a pass of a task for a relative standard error `target`.
    pub fn photons(&self, task: &Task, target: f64) -> u64 {
        let near = BESIDE * task.traceable.enclosure.shortest_edge_m();
        let size = if points_nearer_than(task.traceable, task.grids, near) { BESIDE_WALLS } else { USUAL };
        self.photons_per_pass.unwrap_or(size.power_of_two(target))
    }
}

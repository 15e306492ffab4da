//! Settings of light tracing, and the number of photons of a pass.

use crate::integrator::method::Task;
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::close_points::points_nearer_than;

/// Settings of light tracing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Number of photons emitted per pass, all tubes and sources together; 64..=16_777_216; `None`: by the requested accuracy.
    pub photons_per_pass: Option<u64>,
}

/// Largest number of photons of a pass, unless the document sets it.
pub const MOST: f64 = 8192.0;

/// Number of photons of a pass, unless the document sets it: rare light needs this many for reliable error estimates.
const USUAL: PassSize = PassSize { for_one_percent: 2048.0, growth: 1.0, fewest: 512.0, most: MOST };
/// Number of photons of a pass where points lie beside a wall.
const BESIDE_WALLS: PassSize = PassSize { for_one_percent: MOST, growth: 1.0, fewest: MOST, most: MOST };

/// Fraction of the room's shortest edge within which points are beside a wall.
const BESIDE: f64 = 0.05;

/// Returns the number of photons of a pass for a relative standard error `target`, for light that is traced beside other light.
pub fn photons_for(target: f64) -> u64 {
    USUAL.power_of_two(target)
}

impl Settings {
    /// Returns the number of photons of a pass of a task for a relative standard error `target`.
    pub fn photons(&self, task: &Task, target: f64) -> u64 {
        let near = BESIDE * task.traceable.enclosure.shortest_edge_m();
        let size = if points_nearer_than(task.traceable, task.grids, near) { BESIDE_WALLS } else { USUAL };
        self.photons_per_pass.unwrap_or(size.power_of_two(target))
    }
}

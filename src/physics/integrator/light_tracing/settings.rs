//! The settings of light tracing, and how many photons a pass has.

use super::strips::{has_points_very_near, has_strips};
use crate::integrator::lamp::sizes::are_straight;
use crate::integrator::method::Task;
use crate::integrator::pass_size::PassSize;

/// Settings of light tracing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Photons emitted per pass, all tubes and sources together; 64..=16_777_216; `None`: by the accuracy asked for.
    pub photons_per_pass: Option<u64>,
}

/// Most photons of a pass, unless the document says how many.
pub const MOST: f64 = 8192.0;

/// Photons of a pass, unless the document says how many: where strips beside sensors take the rare and bright connections, few are enough.
const WITH_STRIPS: PassSize = PassSize { for_one_percent: 512.0, growth: 1.0, fewest: 128.0, most: MOST };
/// Elsewhere what is rare needs more of them for honest errors, and so does the flux through bends and facets.
const WITHOUT_STRIPS: PassSize = PassSize { for_one_percent: 2048.0, growth: 1.0, fewest: 512.0, most: MOST };
/// And most of all points so near to a wall that it has no strip.
const VERY_NEAR: PassSize = PassSize { for_one_percent: MOST, growth: 1.0, fewest: MOST, most: MOST };

/// Photons of a pass for a relative standard error `target` of what is traced beside other light.
pub fn photons_for(target: f64) -> u64 {
    WITHOUT_STRIPS.power_of_two(target)
}

impl Settings {
    /// Photons of a pass of a task for a relative standard error `target`.
    pub fn photons(&self, task: &Task, target: f64) -> u64 {
        let scene = task.traceable;
        let size = if has_points_very_near(scene, task.grids) {
            VERY_NEAR
        } else if are_straight(&scene.tubes) && has_strips(scene, task.grids) {
            WITH_STRIPS
        } else {
            WITHOUT_STRIPS
        };
        self.photons_per_pass.unwrap_or(size.power_of_two(target))
    }
}

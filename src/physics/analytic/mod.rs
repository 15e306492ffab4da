//! Solvers without random passes: one computation gives values and, where it can be estimated, their numerical error.

pub mod holigilm;
pub mod jenkins;
pub mod patches;
pub mod radiosity;

use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;

use crate::guide::Guide;
use crate::optics::Diffuser;
use crate::scene::Grid;
use crate::sky::{Sky, Sun};

/// A tube with the properties that the solvers use.
#[derive(Clone, Debug)]
pub struct Tube {
    /// Centre of the opening, in the ceiling plane.
    pub origin: DVec3,
    /// Radius of the opening and of the guide, in metres.
    pub radius: f64,
    /// Mirrors and collector, as the integrators trace them.
    pub guide: Guide,
    /// The closure in the plane of the ceiling.
    pub diffuser: Diffuser,
}

/// An empty box room under tubes, in one photopic channel.
#[derive(Clone, Debug)]
pub struct Installation {
    /// The sky; `None` where it gives no light.
    pub sky: Option<Sky>,
    /// The sun; `None` where there is no beam.
    pub sun: Option<Sun>,
    /// Extent of the room along x, y and z in m.
    pub size: DVec3,
    /// Diffuse reflectance per face, in the order of [`crate::scene::Face`]; `None` where a face is open.
    pub reflectance: [Option<f64>; 6],
    /// Tubes above the ceiling, in the scene's order.
    pub tubes: Vec<Tube>,
    /// Grids to be computed, in the scene's order.
    pub grids: Vec<Grid>,
    /// True if light that is reflected between the faces counts.
    pub interreflection: bool,
    /// True if light counts that goes up into a guide and comes back down.
    pub guide_return: bool,
}

/// A solver that computes its result in one call, without passes.
pub trait Solver: Send + Sync {
    /// Computes on the current rayon pool until the solution is done or `cancel` is raised; then it ends soon and returns what it has
    /// found by then, with [`Ending::CutShort`]; `None` if that is nothing.
    fn solve(&self, cancel: &AtomicBool) -> Option<Solution>;
}

/// Reason why a solver ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Ending {
    /// The solution is as accurate as requested, or cannot be refined further.
    #[default]
    Done,
    /// The computation was cancelled before that.
    CutShort,
}

/// True once cancellation is requested.
fn is_raised(cancel: &AtomicBool) -> bool {
    cancel.load(Ordering::Relaxed)
}

/// Result of a solver.
#[derive(Clone, Debug, Default)]
pub struct Solution {
    /// Illuminances, in the order of the installation's grids.
    pub grids: Vec<GridSolution>,
    /// Fluxes, in the order of the installation's tubes.
    pub tubes: Vec<TubeSolution>,
    /// Places where the light ended; all zero when the solver does not follow it.
    pub balance: Balance,
    /// Number of rays that the rules of integration followed; zero for pure formulae.
    pub rays: u64,
    /// Reason why the computation ended.
    pub ending: Ending,
}

/// Illuminance of one grid in lux, one value per sensor.
#[derive(Clone, Debug, Default)]
pub struct GridSolution {
    /// Illuminance per sensor, in the order of [`Grid::centre`].
    pub illuminance: Vec<f64>,
    /// Estimated numerical error per sensor; empty when there is no estimate.
    pub error: Vec<f64>,
}

/// Flux through one tube in lm.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TubeSolution {
    /// Flux that reaches the collector from outside.
    pub at_collector: Quantity,
    /// Flux that arrives at the closure from above.
    pub at_diffuser: Quantity,
    /// Flux that leaves the closure downward.
    pub into_room: Quantity,
}

/// A value and its estimated numerical error; `None` when there is no estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quantity {
    /// Value in the unit of the quantity.
    pub value: f64,
    /// Estimated numerical error in the same unit, >= 0.
    pub error: Option<f64>,
}

impl Quantity {
    /// Returns the ratio to another quantity; its error is the sum of the relative errors of both, as if they were of opposite sign.
    pub fn over(self, other: Self) -> Self {
        let value = self.value / other.value;
        let errors = self.error.zip(other.error);
        Self { value, error: errors.map(|(error, of_other)| (error + value.abs() * of_other) / other.value.abs()) }
    }
}

/// Flux in lm by the places where it ended; `emitted` minus all others is the error of the solver.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Balance {
    /// Flux that reaches the collectors from outside.
    pub emitted: f64,
    /// Flux absorbed by collectors on the way in.
    pub collector: f64,
    /// Flux absorbed by mirrors on the way down.
    pub guide: f64,
    /// Flux that leaves at the upper end of a guide.
    pub guide_top: f64,
    /// Flux absorbed by diffusers.
    pub diffuser: f64,
    /// Flux absorbed by the faces of the room.
    pub room: f64,
    /// Flux that leaves through open faces.
    pub open_surfaces: f64,
}

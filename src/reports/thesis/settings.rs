//! Settings of the report: the amount of computation, and a callback for its progress.

use super::printed;

/// Amount of computation of the report.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Passes of the longest series; all other numbers of passes are proportional to it.
    pub passes: u64,
    /// Photons per pass of the methods that trace light from its sources.
    pub photons_per_pass: u64,
    /// Side of the pictures in pixels.
    pub size_px: usize,
    /// Cells along each side of the floor's grid; odd, so that one is under the pipe.
    pub cells: usize,
    /// Hit points along each side of the floor for the printed update.
    pub points: usize,
    /// Number of discs in simulations of the updates.
    pub discs: u64,
}

/// Passes of the longest series to which the argument of [`Settings::share`] refers.
pub const FULL_PASSES: u64 = 1024;

/// Fewest passes of a job: fewer give no standard error.
const LEAST_PASSES: u64 = 8;

impl Settings {
    /// Creates the settings of the report with `passes` in the longest series.
    pub fn new(passes: u64) -> Self {
        Self {
            passes,
            photons_per_pass: printed::PHOTONS_PER_PASS,
            size_px: 128,
            cells: 21,
            points: 256,
            discs: 65_536,
        }
    }

    /// Returns the passes of a job that has `full` of them when the longest series has 1024; at least 8.
    pub fn share(&self, full: u64) -> u64 {
        (full * self.passes).div_ceil(FULL_PASSES).max(LEAST_PASSES)
    }
}

/// Callback with the name of each part before it runs.
pub type Progress<'a> = &'a (dyn Fn(&str) + Sync);

//! What each part of the report is given: the amount of computation, and who hears its name.

use super::printed;

/// Amount of computation of the report.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Passes of the longest series; all other numbers of passes are shares of it.
    pub passes: u64,
    /// Photons of each pass of the methods that follow light from its sources.
    pub photons_per_pass: u64,
    /// Side of the pictures.
    pub size_px: usize,
    /// Cells along each side of the floor's grid; an odd number, so that one is under the pipe.
    pub cells: usize,
    /// Hit points along each side of the floor for the printed update.
    pub points: usize,
    /// Discs of the simulated updates.
    pub discs: u64,
}

/// Passes for which the shares of [`Settings::share`] are given.
pub const FULL_PASSES: u64 = 1024;

/// Fewer tell no standard error.
const LEAST_PASSES: u64 = 8;

impl Settings {
    /// The settings of the report with `passes` in the longest series.
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

    /// Passes of a job that has `full` when the longest series has 1024.
    pub fn share(&self, full: u64) -> u64 {
        (full * self.passes).div_ceil(FULL_PASSES).max(LEAST_PASSES)
    }
}

/// Hears the name of each part before it runs.
pub type Progress<'a> = &'a (dyn Fn(&str) + Sync);

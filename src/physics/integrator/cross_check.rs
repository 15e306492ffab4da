//! Passes of a method, each with a pass of another method that must find the same values.

use std::sync::atomic::AtomicBool;

use super::photon_map::progressive::Carried;
use super::{GridPass, Integrator, Pass};

/// Method with its check, whose values are the last ones beside each grid.
pub struct CrossChecked {
    /// Method whose values count.
    pub checked: Box<dyn Integrator>,
    /// Other method of the same grids, whose passes are independent of each other and of the checked ones.
    pub check: Box<dyn Integrator>,
    /// Number of grids.
    pub grids: usize,
}

impl Integrator for CrossChecked {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        self.pass_after(pass, &Carried::default(), cancel)
    }

    fn start(&self) -> Pass {
        let mut start = self.checked.start();
        let mut check = self.check.start().grids;
        start.grids.resize(self.grids, GridPass::default());
        check.resize(self.grids, GridPass::default());
        start.grids.iter_mut().zip(check).for_each(|(grid, check)| grid.companions.push(check));
        start
    }

    fn pass_after(&self, pass: u64, before: &Carried, cancel: &AtomicBool) -> Option<Pass> {
        let mut checked = self.checked.pass_after(pass, before, cancel)?;
        let check = self.check.pass(pass, cancel)?;
        checked.totals.rays += check.totals.rays;
        checked.totals.not_finite = checked.totals.not_finite.or(check.totals.not_finite);
        checked.photons += check.photons;
        checked.grids.iter_mut().zip(check.grids).for_each(|(grid, check)| grid.companions.push(check));
        Some(checked)
    }
}

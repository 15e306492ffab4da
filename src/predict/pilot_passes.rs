//! Passes of a pilot's trial: their time limit, cost and values.

use std::cell::Cell;
use std::sync::atomic::{AtomicBool, Ordering};

use super::pilot_sample::{Places, Sample};
use crate::engine::cancel::Stop;
use crate::engine::spent::Clocks;
use crate::estimate::error_law::ErrorLaw;
use crate::integrator::trial::Ratios;
use crate::integrator::{Integrator, Pass};

/// Budget of one thread of a pilot.
pub struct Budget {
    /// Clocks of the thread, from the pilot's start.
    pub clocks: Clocks,
    /// Processor seconds that the thread may take in all.
    pub seconds: f64,
}

impl Budget {
    /// Returns the processor seconds that are left.
    pub fn left(&self) -> f64 {
        self.seconds - self.clocks.spent().cpu()
    }
}

/// Time limit of a trial.
pub struct Clock<'a> {
    /// Signal that ends a running pass.
    pub stop: Stop,
    /// Flag that is raised when the predictions are no longer wanted.
    cancel: Option<&'a AtomicBool>,
    /// Clocks of the threads, and the processor seconds after which no pass begins, except to reach the least number; `None` without a
    /// limit.
    end: Option<(Clocks, f64)>,
    /// Processor seconds of set-up that do not count.
    aside: Cell<f64>,
}

impl<'a> Clock<'a> {
    /// Starts a clock of this thread, or its pool: after this number of processor seconds no pass begins, except to reach the least number.
    pub fn new(stop: &Stop, cancel: &'a AtomicBool, seconds: f64) -> Self {
        Self { stop: stop.clone(), cancel: Some(cancel), end: Some((Clocks::start(), seconds)), aside: Cell::default() }
    }

    /// Returns a clock without a time limit.
    pub fn unbounded() -> Self {
        Self { stop: Stop::default(), cancel: None, end: None, aside: Cell::default() }
    }

    /// Puts processor seconds of set-up aside, which do not count.
    pub fn put_aside(&self, seconds: f64) {
        self.aside.set(self.aside.get() + seconds);
    }

    /// Returns the processor seconds that were put aside.
    pub fn aside(&self) -> f64 {
        self.aside.get()
    }

    /// Returns the processor seconds until no pass begins any more.
    pub fn left(&self) -> f64 {
        match &self.end {
            _ if self.is_over() => 0.0,
            Some((clocks, seconds)) => (seconds + self.aside.get() - clocks.spent().cpu()).max(0.0),
            None => f64::INFINITY,
        }
    }

    /// True once no pass begins any more, except to reach the least number.
    pub fn is_over(&self) -> bool {
        self.stop.reason().is_some()
            || self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
            || self.end.as_ref().is_some_and(|(clocks, seconds)| clocks.spent().cpu() >= *seconds + self.aside.get())
    }
}

/// Passes of a trial, and the processor seconds of each.
#[derive(Default)]
pub struct Passes {
    /// Passes in their order.
    pub found: Vec<Pass>,
    start: Pass,
    seconds: Vec<f64>,
}

/// Fewest passes from which error laws are derived: the third shows how reliable the spread of two is.
pub const LEAST_PASSES: usize = 3;

impl Passes {
    /// Adds at most `count` passes: the least number unless a running pass must end, and more of them as long as there is time.
    pub fn run(&mut self, integrator: &dyn Integrator, count: usize, clock: &Clock<'_>) {
        if self.found.is_empty() {
            self.start = integrator.start();
        }
        let mut carried = self.found.last().unwrap_or(&self.start).carried.clone();
        for _ in 0..count {
            if clock.stop.reason().is_some() || (self.found.len() >= LEAST_PASSES && clock.is_over()) {
                return;
            }
            let clocks = Clocks::start();
            let Some(pass) = integrator.pass_after(self.found.len() as u64, &carried, clock.stop.flag()) else {
                return;
            };
            self.seconds.push(clocks.spent().cpu());
            carried.clone_from(&pass.carried);
            self.found.push(pass);
        }
    }

    /// Returns the processor seconds of a pass: the median of all but the first one, which runs with cold caches.
    pub fn cost(&self) -> Option<f64> {
        let mut warm: Vec<f64> = self.seconds.iter().skip(usize::from(self.seconds.len() > 1)).copied().collect();
        warm.sort_by(f64::total_cmp);
        warm.get(warm.len() / 2).copied()
    }

    /// Estimates the standard deviation of the logarithm of the cost, from the quartiles of the passes.
    pub fn deviation(&self) -> f64 {
        let mut sorted = self.seconds.clone();
        sorted.sort_by(f64::total_cmp);
        let quartile = |quarters: usize| sorted.get(quarters * sorted.len() / 4).copied().unwrap_or(f64::NAN);
        let spread = 0.74 * libm::log(quartile(3) / quartile(1)) / (sorted.len() as f64).sqrt();
        if spread.is_finite() { spread } else { 0.0 }
    }

    /// Derives the error laws of all grids, or views, for passes with these ratios to those that were run; `alpha` where gather radii
    /// shrink. `None` with fewer than [`LEAST_PASSES`].
    pub fn laws(&self, sample: &Sample, ratios: &Ratios, alpha: Option<f64>) -> Option<Vec<ErrorLaw>> {
        let each = |places: Places| ErrorLaw::of(&places.found(), ratios, alpha);
        if self.found.len() < LEAST_PASSES {
            return None;
        }
        sample.values(&self.start, &self.found).into_iter().map(each).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Set-up that is put aside leaves the time for passes as it was.
    #[test]
    fn set_up_that_is_put_aside_does_not_count() {
        let (stop, cancel) = (Stop::default(), AtomicBool::new(false));
        let clock = Clock::new(&stop, &cancel, 0.0);
        assert!(clock.is_over() && clock.left() == 0.0);
        clock.put_aside(1000.0);
        clock.put_aside(1000.0);
        assert!(!clock.is_over() && clock.left() > 1000.0 && clock.aside() == 2000.0);
        cancel.store(true, Ordering::Relaxed);
        assert!(clock.is_over());
    }
}

//! The passes of a pilot's trial: how long they run, what they cost, and what they found.

use std::sync::atomic::{AtomicBool, Ordering};

use super::cancel::Stop;
use super::pilot_sample::{Places, Sample};
use super::spent::Clocks;
use crate::estimate::error_law::ErrorLaw;
use crate::integrator::trial::Ratios;
use crate::integrator::{Integrator, Pass};

/// When a trial ends.
pub struct Clock<'a> {
    /// Ends a running pass.
    pub stop: Stop,
    /// Raised when nobody waits any more.
    cancel: Option<&'a AtomicBool>,
    /// Clocks of the threads, and the processor seconds after which no pass begins, but for the least number; `None`: as many as are
    /// asked for.
    end: Option<(Clocks, f64)>,
}

impl<'a> Clock<'a> {
    /// A clock of this thread, or its pool: after so many processor seconds no pass begins, but for the least number.
    pub fn new(stop: &Stop, cancel: &'a AtomicBool, seconds: f64) -> Self {
        Self { stop: stop.clone(), cancel: Some(cancel), end: Some((Clocks::start(), seconds)) }
    }

    /// A clock that ends nothing.
    pub fn unbounded() -> Self {
        Self { stop: Stop::default(), cancel: None, end: None }
    }

    /// Processor seconds until no pass begins any more.
    pub fn left(&self) -> f64 {
        match &self.end {
            _ if self.is_over() => 0.0,
            Some((clocks, seconds)) => (seconds - clocks.spent().cpu()).max(0.0),
            None => f64::INFINITY,
        }
    }

    /// True once no pass begins any more, but for the least number.
    pub fn is_over(&self) -> bool {
        self.stop.reason().is_some()
            || self.cancel.is_some_and(|cancel| cancel.load(Ordering::Relaxed))
            || self.end.as_ref().is_some_and(|(clocks, seconds)| clocks.spent().cpu() >= *seconds)
    }
}

/// The passes of a trial, and the processor seconds that each took.
#[derive(Default)]
pub struct Passes {
    /// In their order.
    pub found: Vec<Pass>,
    seconds: Vec<f64>,
}

/// Passes without which no law is known: the third tells what the spread of two is worth.
pub const LEAST_PASSES: usize = 3;

impl Passes {
    /// Adds `count` passes at most: the least number unless a running pass must end, and then as long as there is time.
    pub fn run(&mut self, integrator: &dyn Integrator, count: usize, clock: &Clock<'_>) {
        let mut carried = match self.found.last() {
            Some(pass) => pass.carried.clone(),
            None => integrator.start().carried,
        };
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

    /// Processor seconds of a pass: the median but for the first one, which meets cold memory.
    pub fn cost(&self) -> Option<f64> {
        let mut warm: Vec<f64> = self.seconds.iter().skip(usize::from(self.seconds.len() > 1)).copied().collect();
        warm.sort_by(f64::total_cmp);
        warm.get(warm.len() / 2).copied()
    }

    /// Standard deviation of the logarithm of the cost, by the quartiles of the passes.
    pub fn deviation(&self) -> f64 {
        let mut sorted = self.seconds.clone();
        sorted.sort_by(f64::total_cmp);
        let quartile = |quarters: usize| sorted.get(quarters * sorted.len() / 4).copied().unwrap_or(f64::NAN);
        let spread = 0.74 * libm::log(quartile(3) / quartile(1)) / (sorted.len() as f64).sqrt();
        if spread.is_finite() { spread } else { 0.0 }
    }

    /// The laws of all grids, or views, of passes that have these ratios to those found; `alpha` where gather radii shrink.
    pub fn laws(&self, sample: &Sample, ratios: &Ratios, alpha: Option<f64>) -> Option<Vec<ErrorLaw>> {
        let each = |places: Places| ErrorLaw::of(&places.found(), ratios, alpha);
        if self.found.len() < LEAST_PASSES {
            return None;
        }
        sample.values(&self.found).into_iter().map(each).collect()
    }
}

//! Rendering of a job, pass after pass, until its stop rule, the clock or a user ends it.

use super::ahead::Outcome;
use super::cancel::{Stop, StopReason};
use super::integrators::Added;
use super::memory::default_limit_bytes;
use super::prepare::RenderJob;
use super::progress::{PassReport, StoppedBy};
use super::spent::{Clocks, Spent};
use crate::estimate::Estimate;
use crate::estimate::stopping::{WaitingFor, Wanted, is_judged};

/// A job rendered to its end, or up to a pass.
pub struct Rendered {
    /// Estimate of all passes.
    pub estimate: Estimate,
    /// Time that all passes took to render.
    pub spent: Spent,
    /// Reason why the job ended.
    pub stopped_by: StoppedBy,
}

/// Condition at which passes end without a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ends {
    /// End when all outputs are as accurate as requested; one that is, is not computed any further.
    WhenAccurate,
    /// End with the last pass that the document allows.
    WithTheLast,
}

/// A failure of the program, not of the document: a sum that is not finite, or a result that cannot be written.
#[derive(Clone, Debug, thiserror::Error)]
pub enum RenderError {
    /// A sum became infinite or no number.
    #[error("pass {pass}{}: {place} is not finite", photon.map(|photon| format!(", photon {photon}")).unwrap_or_default())]
    NotFinite {
        /// Number of the pass, from 0.
        pass: u64,
        /// Number of the first photon at fault, from 0; `None` where it was a path from a sensor or pixel.
        photon: Option<u64>,
        /// Sensor or pixel, in words.
        place: String,
    },
    /// A result could not be written.
    #[error("{file}: {reason}")]
    Output {
        /// Name of the result.
        file: String,
        /// Message of the encoder.
        reason: String,
    },
}

/// State of a job after a pass.
#[derive(Clone, Copy)]
pub struct SoFar<'a> {
    /// Estimate of all passes so far.
    pub estimate: &'a Estimate,
    /// Condition that the job waits for; `None` after its last pass.
    pub waiting_for: Option<WaitingFor>,
}

/// Starts the threads of the global rayon pool and determines the memory limit, in the background: that takes a moment, in which a job can
/// be read.
pub fn warm_up() {
    let all = || {
        rayon::current_num_threads();
        default_limit_bytes();
    };
    // where no thread can be had, the first pass finds out
    let _ = std::thread::Builder::new().spawn(all);
}

impl RenderJob {
    /// Renders the next pass on the current rayon pool and adds it to `estimate`, and its time to `spent`; calls `heard` after it. Returns
    /// the reason why the job ends with it, if it does: its own rule, or `stop`, which the caller raises when the job's seconds are over. A
    /// pass counts whole or not at all: one that `stop` ends adds nothing.
    pub fn render_pass(
        &self,
        estimate: &mut Estimate,
        spent: &mut Spent,
        stop: &Stop,
        heard: &mut dyn FnMut(&PassReport, SoFar<'_>),
    ) -> Result<Option<StoppedBy>, RenderError> {
        self.add_pass((estimate, spent), None, stop, heard)
    }

    /// Adds the next pass as [`Self::render_pass`] does, with the same bits, where its outcome was computed `ahead`.
    pub fn add_pass(
        &self,
        (estimate, spent): (&mut Estimate, &mut Spent),
        ahead: Option<Outcome>,
        stop: &Stop,
        heard: &mut dyn FnMut(&PassReport, SoFar<'_>),
    ) -> Result<Option<StoppedBy>, RenderError> {
        // the caller that raises it may be late on a busy machine
        if spent.seconds >= self.stop.max_seconds {
            stop.raise(StopReason::OutOfTime);
        }
        self.next_pass((estimate, spent), ahead, stop, heard, Ends::WhenAccurate)
    }

    /// Adds the next pass as [`Self::add_pass`] does, of a job that ends at its own condition `ends`.
    fn next_pass(
        &self,
        (estimate, spent): (&mut Estimate, &mut Spent),
        ahead: Option<Outcome>,
        stop: &Stop,
        heard: &mut dyn FnMut(&PassReport, SoFar<'_>),
        ends: Ends,
    ) -> Result<Option<StoppedBy>, RenderError> {
        // built before the clocks start
        let engine = self.engine();
        let (ahead, spent_ahead) = ahead.map_or((None, Spent::NOTHING), |ahead| (Some(ahead.results), ahead.spent));
        let (clocks, spent_before, pass) = (Clocks::start(), spent.and(spent_ahead), estimate.passes);
        let wanted = match ends {
            Ends::WhenAccurate => self.wanted_after(estimate),
            Ends::WithTheLast => Wanted::ALL,
        };
        let added = match stop.reason() {
            None => engine.add_pass(pass, estimate, wanted, ahead, stop.flag()),
            Some(_) => Added::Nothing,
        };
        let ended = (added != Added::Pass).then(|| stop.reason().map(StoppedBy::from)).flatten();
        *spent = spent_before.and(clocks.spent());
        if added == Added::Nothing || stop.reason() == Some(StopReason::Abandoned) {
            // a method that gives nothing would be asked for ever
            return Ok(ended.or(Some(StoppedBy::Cancelled)));
        }
        if let Some(place) = estimate.first_not_finite() {
            return Err(RenderError::NotFinite { pass, photon: estimate.not_finite, place });
        }
        let accuracy = self.accuracy(estimate);
        let report = self.report_of(estimate, accuracy, *spent);
        let ended = ended.or_else(|| match ends {
            Ends::WhenAccurate => self.stop_after(estimate),
            Ends::WithTheLast => self.is_complete(estimate.passes).then_some(StoppedBy::MaxPasses),
        });
        let waiting_for = self.waiting_for(estimate, accuracy).filter(|_| ended.is_none());
        heard(&report, SoFar { estimate, waiting_for });
        // what is made of a pass takes time, too
        *spent = spent_before.and(clocks.spent());
        Ok(ended)
    }

    /// Returns the outputs that the pass after those of `before` is to compute, from `before` alone, so that it does not matter which
    /// process rendered them: an output that was accurate enough when it was judged is not computed again.
    pub(super) fn wanted_after(&self, before: &Estimate) -> Wanted {
        let computed = Wanted {
            grids: before.passes_of_grids() == before.passes,
            views: before.passes_of_views() == before.passes,
        };
        if is_judged(before.passes) { computed.still(self.stop.wanted(before)) } else { computed }
    }

    /// Renders pass after pass on the current rayon pool until the job's own rule, its seconds or `stop` ends it.
    pub fn render(&self, stop: &Stop, heard: &mut dyn FnMut(&PassReport, SoFar<'_>)) -> Result<Rendered, RenderError> {
        if !self.make_ready_unless(stop.flag()) {
            let stopped_by = stop.reason().map_or(StoppedBy::Cancelled, StoppedBy::from);
            return Ok(Rendered { estimate: Estimate::empty(&self.scene), spent: Spent::NOTHING, stopped_by });
        }
        stop.within(self.stop.max_seconds, || {
            self.render_while(|estimate, spent| self.render_pass(estimate, spent, stop, heard))
        })
    }

    /// Renders a job as [`Self::render`] does, on a thread of the global pool: a pass then need not be handed over to the pool, which takes
    /// as long as a small pass.
    pub fn render_on_pool(
        &self,
        stop: &Stop,
        heard: &mut (dyn FnMut(&PassReport, SoFar<'_>) + Send),
    ) -> Result<Rendered, RenderError> {
        rayon::scope(|_| self.render(stop, heard))
    }

    /// Renders all `max_passes`, regardless of accuracy and time, so that the result is the same on every machine.
    pub fn render_all_passes(&self, heard: &mut dyn FnMut(&PassReport, SoFar<'_>)) -> Result<Estimate, RenderError> {
        let stop = Stop::default();
        let next = |estimate: &mut Estimate, spent: &mut Spent| {
            self.next_pass((estimate, spent), None, &stop, heard, Ends::WithTheLast)
        };
        Ok(self.render_while(next)?.estimate)
    }

    /// Adds pass after pass with `next` to an empty estimate, until it returns the reason why the job ends.
    fn render_while(
        &self,
        mut next: impl FnMut(&mut Estimate, &mut Spent) -> Result<Option<StoppedBy>, RenderError>,
    ) -> Result<Rendered, RenderError> {
        let (mut estimate, mut spent) = (self.empty_estimate(), Spent::NOTHING);
        loop {
            if let Some(stopped_by) = next(&mut estimate, &mut spent)? {
                return Ok(Rendered { estimate, spent, stopped_by });
            }
        }
    }
}

impl From<StopReason> for StoppedBy {
    fn from(reason: StopReason) -> Self {
        match reason {
            StopReason::OutOfTime => Self::MaxSeconds,
            StopReason::Cancelled | StopReason::Abandoned => Self::Cancelled,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::analytic::{Ending, GridSolution, Solution, Solver};
    use crate::document::NoFiles;
    use crate::engine::integrators::Engine;
    use crate::engine::prepare::prepare;

    /// Solver whose job is ended within it, for a reason, when it has found 7 lx +- 1.
    struct EndsWithin(Stop, StopReason);

    impl Solver for EndsWithin {
        fn solve(&self, cancel: &AtomicBool) -> Option<Solution> {
            self.0.raise(self.1);
            assert!(cancel.load(Ordering::Relaxed));
            let grid = GridSolution { illuminance: vec![7.0], error: vec![1.0] };
            Some(Solution { grids: vec![grid], ending: Ending::CutShort, ..Solution::default() })
        }
    }

    /// Writes the document of a room of 3 m with a tube and one grid, with further members of the job and of the grid.
    fn document(of_job: &str, of_grid: &str) -> String {
        format!(
            r#"{{
                "sky": {{ "cie_type": 5, "sun_position": {{ "altitude_deg": 40, "azimuth_deg": 200 }} }},
                "room": {{ "size_m": [3, 3, 3] }},
                "tubes": [{{ "centre_m": [1.5, 1.5], "diameter_m": 0.3, "reflectance": 0.98,
                            "segments": [{{ "length_m": 1 }}], "collector": {{ "kind": "open" }},
                            "diffuser": {{ "kind": "lambertian", "transmittance": 0.6 }} }}],
                "grids": [{{ "name": "g", "height_m": 0.8, {of_grid} }}]
                {of_job}
            }}"#
        )
    }

    /// A job in parts is prepared without a trial of its room for each part; what is known of it does not ask for one.
    #[test]
    fn a_job_is_made_ready_when_it_is_rendered() {
        let document = document("", r#""cells": [2, 2], "components": true"#);
        let prepared = prepare(document.as_bytes(), &NoFiles).unwrap();
        assert!(!prepared.is_dark() && !prepared.is_complete(1) && prepared.memory().total() > 0.0);
        assert!(prepared.engine.get().is_none());
        prepared.make_ready();
        assert!(prepared.engine.get().is_some());
    }

    /// A job that a user has cancelled builds no integrators, and keeps none that it has begun with: it can be rendered later.
    #[test]
    fn a_cancelled_job_is_not_made_ready() {
        for of_grid in [r#""cells": [2, 2], "components": true"#, r#""cells": [2, 2]"#] {
            let prepared = prepare(document("", of_grid).as_bytes(), &NoFiles).unwrap();
            let stop = Stop::default();
            stop.raise(StopReason::Cancelled);
            let rendered = prepared.render(&stop, &mut |_, _| panic!("no pass is reported")).unwrap();
            assert_eq!((rendered.stopped_by, rendered.estimate.passes), (StoppedBy::Cancelled, 0));
            assert_eq!(prepared.empty_estimate_unless(stop.flag()).passes, 0);
            assert!(prepared.engine.get().is_none());
            let rendered = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap();
            assert!(rendered.estimate.passes > 0 && prepared.engine.get().is_some());
        }
    }

    /// A partial solution counts when its job ends, and the job ends for the reason that was given; a worker that has lost the job gets no
    /// report.
    #[test]
    fn a_solver_that_is_cut_short_gives_what_it_has() {
        let ends = [
            (StopReason::OutOfTime, StoppedBy::MaxSeconds, true),
            (StopReason::Cancelled, StoppedBy::Cancelled, true),
            (StopReason::Abandoned, StoppedBy::Cancelled, false),
        ];
        for (reason, stopped_by, is_heard) in ends {
            let document = document(r#", "method": "holigilm""#, r#""cells": [1, 1]"#);
            let stop = Stop::default();
            let mut prepared = prepare(document.as_bytes(), &NoFiles).unwrap();
            prepared.engine = Engine::Solver(Box::new(EndsWithin(stop.clone(), reason))).into();
            let mut heard = 0;
            let rendered = prepared.render(&stop, &mut |_, _| heard += 1).unwrap();
            assert_eq!((rendered.stopped_by, heard > 0), (stopped_by, is_heard), "{reason:?}");
            if is_heard {
                let grid = &rendered.estimate.grids[0];
                assert_eq!(grid.illuminance_lux(0), 7.0);
                assert!((grid.standard_error_lux(0) - 1.0).abs() < 1e-12);
                assert_eq!(prepared.no_results(rendered.stopped_by, &rendered.estimate), None);
            }
        }
    }
}

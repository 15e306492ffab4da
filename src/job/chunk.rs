//! Passes in order: rendered in chunks, until a rule, the clock or somebody ends the job.

use std::time::Instant;

use super::cancel::{Stop, StopReason};
use super::engine::Added;
use super::memory::default_limit_bytes;
use super::prepare::Prepared;
use super::progress::{PassReport, StoppedBy};
use super::spent::{Clocks, Spent};
use crate::estimate::Estimate;
use crate::estimate::stopping::{WaitingFor, Wanted};

/// A rendered range of passes.
pub struct Chunk {
    /// Estimate of these passes alone (and what passes hand on): merge it onto the estimate of all earlier chunks.
    pub estimate: Estimate,
    /// Time that these passes took to render.
    pub spent: Spent,
    /// The chunk was cut short, and the job ends with it.
    pub ended: Option<StopReason>,
}

/// A job rendered to its end.
pub struct Rendered {
    /// Everything that the passes have added up to.
    pub estimate: Estimate,
    /// Time that all passes took to render.
    pub spent: Spent,
    /// What ended the job.
    pub stopped_by: StoppedBy,
}

/// When passes end by themselves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ends {
    /// When all outputs are as accurate as asked; an output that is, is not computed any further.
    WhenAccurate,
    /// With the last pass that the document allows.
    WithTheLast,
}

/// A failure of the program, not of the document: a sum that is not finite, or a result that cannot be written.
#[derive(Debug, thiserror::Error)]
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
        /// Words of the encoder.
        reason: String,
    },
}

/// Everything up to a pass: passes of earlier chunks, and those of the running one.
#[derive(Clone, Copy)]
pub struct SoFar<'a> {
    earlier: &'a Estimate,
    chunk: Option<&'a Estimate>,
    waiting_for: Option<WaitingFor>,
}

impl<'a> SoFar<'a> {
    /// Nothing but passes of chunks that have ended.
    pub fn ended(estimate: &'a Estimate) -> Self {
        Self { earlier: estimate, chunk: None, waiting_for: None }
    }

    /// What the job goes on for after this pass; `None` after its last one.
    pub fn waiting_for(&self) -> Option<WaitingFor> {
        self.waiting_for
    }

    /// Both in one. This copies every pixel of every view: ask for it only when somebody waits for it.
    pub fn merged(&self) -> Estimate {
        let mut merged = self.earlier.clone();
        if let Some(chunk) = self.chunk {
            merged.merge(chunk);
        }
        merged
    }
}

/// Starts the threads of the usual pool and asks the system for its memory, in the background: that takes a moment, in which a job can
/// be read.
pub fn warm_up() {
    let all = || {
        rayon::current_num_threads();
        default_limit_bytes();
    };
    // where no thread can be had, the first pass finds out
    let _ = std::thread::Builder::new().spawn(all);
}

impl Prepared {
    /// Renders chunk `index` on the current rayon pool; `before` is the merged estimate of all earlier chunks and
    /// `spent_before` their render time. `heard` is called after every pass, in order. The caller raises `stop` when the
    /// job's seconds are over. The chunk ends early where the job is accurate enough ([`Judgements`](crate::estimate::stopping::Judgements)).
    pub fn render_chunk(
        &self,
        index: u64,
        before: &Estimate,
        spent_before: Spent,
        stop: &Stop,
        heard: &mut dyn FnMut(&PassReport, SoFar<'_>),
    ) -> Result<Chunk, RenderError> {
        self.render_passes(index, (before, spent_before), stop, heard, Ends::WhenAccurate)
    }

    /// Renders a chunk, after an estimate that took some time, until its end or as it `ends` by itself.
    fn render_passes(
        &self,
        index: u64,
        (before, spent_before): (&Estimate, Spent),
        stop: &Stop,
        heard: &mut dyn FnMut(&PassReport, SoFar<'_>),
        ends: Ends,
    ) -> Result<Chunk, RenderError> {
        let (clocks, begun) = (Clocks::start(), Instant::now());
        let mut estimate = self.empty_estimate();
        estimate.carried.clone_from(&before.carried);
        let mut ended = None;
        let mut wanted = match ends {
            Ends::WhenAccurate => self.wanted_after(before),
            Ends::WithTheLast => Wanted::ALL,
        };
        let passes = self.chunk(index).unwrap_or(0..0);
        for pass in passes.clone() {
            // who raises it may be late on a busy machine
            let seconds = spent_before.seconds + begun.elapsed().as_secs_f64();
            if ends == Ends::WhenAccurate && seconds >= self.stop.max_seconds {
                stop.raise(StopReason::OutOfTime);
            }
            let added = match stop.reason() {
                None => self.engine.add_pass(pass, &mut estimate, wanted, stop.flag()),
                Some(_) => Added::Nothing,
            };
            if added != Added::Pass {
                ended = stop.reason();
            }
            if added == Added::Nothing || ended == Some(StopReason::Abandoned) {
                break;
            }
            if let Some(place) = estimate.first_not_finite() {
                return Err(RenderError::NotFinite { pass, photon: estimate.not_finite, place });
            }
            let spent = spent_before.and(clocks.spent());
            let judged = before.judged_with(&estimate);
            let accuracy = self.accuracy(&judged);
            let report = self.report_of(&judged, accuracy, spent);
            // whoever renders chunks looks at the end of each
            let is_judged = |waits: &WaitingFor| *waits == WaitingFor::NextJudgement && pass + 1 == passes.end;
            let waiting_for = self.waiting_for(&judged, accuracy);
            let waiting_for = waiting_for.filter(|waits| ended.is_none() && !is_judged(waits));
            heard(&report, SoFar { earlier: before, chunk: Some(&estimate), waiting_for });
            let mut accurate = false;
            if ends == Ends::WhenAccurate && self.stop.judgements.is_after(report.passes) {
                let now = self.stop.wanted(&judged);
                (wanted, accurate) = (wanted.still(now), !now.any());
            }
            if ended.is_some() || self.is_complete(report.passes) || accurate {
                break;
            }
        }
        Ok(Chunk { estimate, spent: clocks.spent(), ended })
    }

    /// What passes after these are to compute, whoever computed these, and in however many chunks.
    fn wanted_after(&self, before: &Estimate) -> Wanted {
        let computed = Wanted {
            grids: before.passes_of_grids() == before.passes,
            views: before.passes_of_views() == before.passes,
        };
        if self.stop.judgements.is_after(before.passes) { computed.still(self.stop.wanted(before)) } else { computed }
    }

    /// Renders chunk after chunk on the current rayon pool until the job's own rule, its seconds or `stop` ends it.
    pub fn render(&self, stop: &Stop, heard: &mut dyn FnMut(&PassReport, SoFar<'_>)) -> Result<Rendered, RenderError> {
        stop.within(self.stop.max_seconds, || {
            let chunk = |index, before: &Estimate, spent, heard: &mut dyn FnMut(&PassReport, SoFar<'_>)| {
                self.render_chunk(index, before, spent, stop, heard)
            };
            self.render_while(chunk, heard, |index, estimate| self.stop_after(index, estimate))
        })
    }

    /// As [`Self::render`], on a thread of the usual pool: a pass then need not be handed over to it, which takes as long as small ones.
    pub fn render_on_pool(
        &self,
        stop: &Stop,
        heard: &mut (dyn FnMut(&PassReport, SoFar<'_>) + Send),
    ) -> Result<Rendered, RenderError> {
        rayon::scope(|_| self.render(stop, heard))
    }

    /// Renders all `max_passes`, however accurate the job is and whatever the time: the same on every machine.
    pub fn render_all_passes(&self, heard: &mut dyn FnMut(&PassReport, SoFar<'_>)) -> Result<Estimate, RenderError> {
        let past_the_last = |index, _: &Estimate| self.chunk(index + 1).is_none().then_some(StoppedBy::MaxPasses);
        let chunk = |index, before: &Estimate, spent, heard: &mut dyn FnMut(&PassReport, SoFar<'_>)| {
            self.render_passes(index, (before, spent), &Stop::default(), heard, Ends::WithTheLast)
        };
        let rendered = self.render_while(chunk, heard, past_the_last)?;
        Ok(rendered.estimate)
    }

    /// Renders chunk after chunk by `render`, which is given the chunk's number, the estimate before it and its time.
    fn render_while(
        &self,
        render: impl Fn(u64, &Estimate, Spent, &mut dyn FnMut(&PassReport, SoFar<'_>)) -> Result<Chunk, RenderError>,
        heard: &mut dyn FnMut(&PassReport, SoFar<'_>),
        rule: impl Fn(u64, &Estimate) -> Option<StoppedBy>,
    ) -> Result<Rendered, RenderError> {
        let mut estimate = self.empty_estimate();
        let mut spent = Spent::NOTHING;
        let mut index = 0;
        loop {
            let chunk = render(index, &estimate, spent, heard)?;
            estimate.merge(&chunk.estimate);
            spent = spent.and(chunk.spent);
            let ended = chunk.ended.map(StoppedBy::from);
            if let Some(stopped_by) = ended.or_else(|| rule(index, &estimate)) {
                return Ok(Rendered { estimate, spent, stopped_by });
            }
            index += 1;
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
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::analytic::{Ending, GridSolution, Solution, Solver};
    use crate::document::MeshSource;
    use crate::geometry::TriangleMesh;
    use crate::job::engine::Engine;
    use crate::job::prepare::prepare;

    struct NoMeshes;

    impl MeshSource for NoMeshes {
        fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
            Err("none".to_owned())
        }
    }

    /// A solver whose job ends within it, for a reason, when it has found 7 lx +- 1.
    struct EndsWithin(Stop, StopReason);

    impl Solver for EndsWithin {
        fn solve(&self, cancel: &AtomicBool) -> Option<Solution> {
            self.0.raise(self.1);
            assert!(cancel.load(Ordering::Relaxed));
            let grid = GridSolution { illuminance: vec![7.0], error: vec![1.0] };
            Some(Solution { grids: vec![grid], ending: Ending::CutShort, ..Solution::default() })
        }
    }

    /// What a solver has found when its job ends counts, and the job ends by the reason it was given; who has lost the job
    /// hears of nothing.
    #[test]
    fn a_solver_that_is_cut_short_gives_what_it_has() {
        let ends = [
            (StopReason::OutOfTime, StoppedBy::MaxSeconds, true),
            (StopReason::Cancelled, StoppedBy::Cancelled, true),
            (StopReason::Abandoned, StoppedBy::Cancelled, false),
        ];
        for (reason, stopped_by, is_heard) in ends {
            let document = r#"{
                "sky": { "cie_type": 5, "sun_position": { "altitude_deg": 40, "azimuth_deg": 200 } },
                "room": { "size_m": [3, 3, 3] },
                "tubes": [{ "centre_m": [1.5, 1.5], "diameter_m": 0.3, "reflectance": 0.98,
                            "segments": [{ "length_m": 1 }], "collector": { "kind": "open" },
                            "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }],
                "grids": [{ "name": "g", "height_m": 0.8, "cells": [1, 1] }],
                "method": "holigilm"
            }"#;
            let stop = Stop::default();
            let mut prepared = prepare(document.as_bytes(), &NoMeshes).unwrap();
            prepared.engine = Engine::Solver(Box::new(EndsWithin(stop.clone(), reason)));
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

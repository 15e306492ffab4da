//! Pilot: the first passes of every method on some sensors and pixels, from which the time of a job is predicted (`predict/predictions.rs`).
//!
//! Each thread runs one method at a time by itself, so that the processor seconds of a pass are measured without what small passes lose
//! when they are divided; a job's passes are divided among all threads. The pilot is bounded by the clocks of its threads: methods divide
//! the time that is left, that of the plan first, whose set-up does not count. A method that does not fit stays unknown. The keys of the
//! pilot's random numbers are not those of the job, so that no sample of a job decides when it stops.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread::scope;
use std::time::{Duration, Instant};

use super::pilot_outcome::{Outcome, cheapen_the_looser};
use super::pilot_passes::{Budget, Clock, LEAST_PASSES, Passes};
use super::pilot_run::Run;
use super::pilot_sample::Sample;
use super::predictions::{
    Measured, MethodPredictions, OutputPredictions, PREDICTED_ACCURACIES, PredictedTime, Predictions,
};
use crate::analytic::Ending;
use crate::engine::cancel::Stop;
use crate::engine::prepare::RenderJob;
use crate::engine::spent::Clocks;
use crate::estimate::Estimate;
use crate::estimate::error_law::{ErrorLaw, Judged};
use crate::integrator::Method;
use crate::integrator::method::{self, Computation, Task, Trial};
use crate::integrator::radiosity::SharedExchanges;
use crate::plan::YearMethod;
use crate::plan::choose::{MethodChoice, refuses};
use crate::statistics::interval::two_sided_normal_quantile;

/// Processor seconds of each thread in which all methods are tried, beside the set-up of those of the plan. Together with other set-up that
/// cannot be interrupted they are less than 0.2 s.
const BUDGET: f64 = 0.15;

/// Processor seconds that the set-up of a planned method may take beside the budget: without it nothing would be known of a job in a room whose
/// exchange of light takes long to compute.
const SET_UP_OF_PLAN: f64 = 0.4;

/// Wall-clock seconds after which the pilot ends in any case: other work of the machine makes it no longer than that.
const MOST_SECONDS: f64 = 0.6;

/// Multiple of its part of the budget that a method may take where a pass has begun.
const GRACE: f64 = 3.0;

/// Largest number of passes of the first size that is tried, and of every other size.
const MOST_PASSES: usize = 7;
const MOST_PASSES_EACH: usize = 5;

/// Number of passes on few places, which show the cost of a pass apart from its places.
const FEW_PLACES_PASSES: usize = 2;

/// Factor by which these passes have fewer places than the others.
const FEW_PLACES: usize = 4;

/// Processor seconds of a pass below which it is not divided any further.
const GRAIN: f64 = 5e-4;

/// Work of each further thread in a pass, as a fraction of that of the first: some of a pass is not divided, and parts are not even. On two
/// processors 0.36 to 0.91 in the passes of light tracing and of responses of S1 and S3, whose processor seconds are 11 to 210 ms in all.
const OF_FURTHER_THREADS: f64 = 0.75;

/// Standard deviation of the logarithm of the cost of a pass, beside the spread of the trial's passes.
const OF_COST: f64 = 0.15;

/// Bits that turn the seed of a job into that of its pilot, by exclusive or.
const PILOT: u64 = 0x70_69_6c_6f_74;

/// Reason that is given for years whose moments are traced, which take most of the time.
const UNTRIED: &str = "the moments of a year are not tried";

/// Predicts the time that each method would take to each accuracy; `cancel` ends the pilot early, with fewer predictions.
pub fn predict(prepared: &RenderJob, cancel: &AtomicBool) -> Predictions {
    predict_within(prepared, cancel, Duration::from_secs_f64(MOST_SECONDS))
}

/// Predicts as [`predict`] does, within a wall-clock time.
fn predict_within(prepared: &RenderJob, cancel: &AtomicBool, most: Duration) -> Predictions {
    let start = Instant::now();
    let threads = rayon::current_num_threads();
    let task = Task::whole(&prepared.scene, &prepared.traceable);
    let outputs = [task.without_views(), task.without_grids()];
    let planned = [&prepared.plan.methods.grids, &prepared.plan.methods.views];
    let mut rows: [Vec<MethodPredictions>; 2] = [Vec::new(), Vec::new()];
    let mut trials = Vec::new();
    for (output, (task, planned)) in outputs.iter().zip(planned).enumerate() {
        if task.grids.is_empty() && task.views.is_empty() {
            continue;
        }
        for (method, is_planned) in methods(prepared, planned.as_ref()) {
            let refusal = refuses(method, task);
            if refusal.is_none() {
                trials.push(Tried::new(prepared, output, rows[output].len(), method, *task, is_planned));
            }
            rows[output].push(MethodPredictions {
                method: method.name().to_owned(),
                planned: is_planned,
                refusal: refusal.map(Into::into),
                seconds_to_first_number: None,
                asked: None,
                accuracies: Vec::new(),
            });
        }
    }
    trials.sort_by_key(|tried| !tried.is_planned);
    let judged = prepared
        .least_passes()
        .map(|least| Judged { confidence: prepared.stop.confidence, least_passes: least.unwrap_or(1) });
    let asked = [prepared.stop.relative_error, prepared.stop.view_relative_error];
    let pilot = Pilot { prepared, threads, end: start + most, cancel, asked, judged };
    for (output, row, outcome) in pilot.run(trials) {
        let is_untried = output == 0 && prepared.plan.methods.year == Some(YearMethod::Moments);
        let time_to = |accuracy: f64| match is_untried {
            true => PredictedTime::unknown(accuracy, UNTRIED),
            false => outcome.time_to(accuracy),
        };
        let row = &mut rows[output][row];
        row.seconds_to_first_number = outcome.first_number.filter(|_| !is_untried);
        row.accuracies = PREDICTED_ACCURACIES.iter().map(|accuracy| time_to(*accuracy)).collect();
        row.asked = Some(time_to(asked[output]));
    }
    let [grids, views] = [0, 1].map(|output| {
        let rows = std::mem::take(&mut rows[output]);
        (!rows.is_empty()).then(|| OutputPredictions::new(asked[output], rows))
    });
    let pilot_seconds = start.elapsed().as_secs_f64();
    Predictions { pilot_seconds, threads, confidence: prepared.stop.confidence, grids, views }
}

/// Lists the methods to be predicted, each with the settings that the plan has chosen if it takes it, and whether it does.
fn methods<'a>(prepared: &'a RenderJob, planned: Option<&'a MethodChoice>) -> impl Iterator<Item = (&'a Method, bool)> {
    prepared.offered.iter().map(move |offered| {
        let planned = planned.map(|choice| &choice.method).filter(|planned| planned.name() == offered.name());
        (planned.unwrap_or(offered), planned.is_some())
    })
}

/// Method to be tried on an output.
struct Tried<'a> {
    output: usize,
    row: usize,
    method: &'a Method,
    task: Task<'a>,
    sample: Sample,
    exchanges: SharedExchanges,
    is_planned: bool,
}

impl<'a> Tried<'a> {
    fn new(
        prepared: &RenderJob,
        output: usize,
        row: usize,
        method: &'a Method,
        task: Task<'a>,
        is_planned: bool,
    ) -> Self {
        let target = prepared.stop.target(task.grids, task.views);
        let trial = method.described().trial(&task, target);
        let sample = Sample::new(&task, trial.most_places);
        let exchanges = SharedExchanges::new(&prepared.traceable, 1);
        Self { output, row, method, task, sample, exchanges, is_planned }
    }

    /// Returns the trial by which passes for a relative standard error `target` are predicted.
    fn trial(&self, target: f64) -> Trial {
        self.method.described().trial(&self.task, target)
    }
}

/// Derives the laws of the errors of a method's own passes, on the grids alone where there are any, or else on the views, from a number of
/// passes of its trial; as [`predict`] does, but without a clock. `None` where the method refuses, has no passes, or too few.
pub fn laws(prepared: &RenderJob, method: &str, passes: usize) -> Option<Vec<ErrorLaw>> {
    let task = Task::whole(&prepared.scene, &prepared.traceable);
    let of_plan = &prepared.plan.methods;
    let (task, planned) =
        if task.grids.is_empty() { (task, &of_plan.views) } else { (task.without_views(), &of_plan.grids) };
    let is_meant = |offered: &Method| offered.name() == method && refuses(offered, &task).is_none();
    let (method, _) = methods(prepared, planned.as_ref()).find(|(offered, _)| is_meant(offered))?;
    let tried = Tried::new(prepared, 0, 0, method, task, false);
    let (target, sample) = (prepared.stop.target(task.grids, task.views), &tried.sample);
    let trial = tried.trial(target);
    let Computation::Passes(integrator) = trial.method.build(&sample.task(&task), prepared.seed ^ PILOT, target) else {
        return None;
    };
    let mut found = Passes::default();
    found.run(integrator.as_ref(), passes, &Clock::unbounded());
    found.laws(sample, &trial.passes.ratios(trial.passes.tried), trial.passes.alpha)
}

struct Pilot<'a> {
    prepared: &'a RenderJob,
    threads: usize,
    end: Instant,
    cancel: &'a AtomicBool,
    asked: [f64; 2],
    judged: [Judged; 2],
}

impl Pilot<'_> {
    /// Tries the methods in their order, one on each thread.
    fn run(&self, trials: Vec<Tried<'_>>) -> Vec<(usize, usize, Outcome)> {
        let threads = self.threads.min(trials.len());
        let outcomes = Mutex::new(Vec::new());
        let queue = Mutex::new(VecDeque::from(trials));
        let next = |budget: &Budget| {
            let mut queue = queue.lock().unwrap_or_else(PoisonError::into_inner);
            let left = self.left(budget);
            let share = left * threads as f64 / queue.len().max(1) as f64;
            queue.pop_front().map(|tried| (tried, share.min(left)))
        };
        let work = || {
            let mut budget = Budget { clocks: Clocks::start(), seconds: BUDGET };
            while let Some((tried, share)) = next(&budget) {
                let mut outcome = self.outcome(&tried, share, &mut budget);
                outcome.is_busy = Instant::now() >= self.end && budget.left() > 0.0;
                outcomes.lock().unwrap_or_else(PoisonError::into_inner).push((tried.output, tried.row, outcome));
            }
        };
        scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| {
                    // without a pool no method is tried
                    if let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads(1).build() {
                        pool.install(work);
                    }
                });
            }
        });
        outcomes.into_inner().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the processor seconds that the pilot has left for a thread.
    fn left(&self, budget: &Budget) -> f64 {
        let on_the_wall = self.end.saturating_duration_since(Instant::now()).as_secs_f64();
        budget.left().clamp(0.0, on_the_wall)
    }

    /// Returns the accuracies of a row, the loosest first.
    fn accuracies(&self, output: usize) -> Vec<f64> {
        let mut all: Vec<f64> = PREDICTED_ACCURACIES.into_iter().chain([self.asked[output]]).collect();
        all.sort_by(|a, b| b.total_cmp(a));
        all.dedup();
        all
    }

    /// Tries a method for `share` processor seconds of the budget of a thread.
    fn outcome(&self, tried: &Tried<'_>, share: f64, budget: &mut Budget) -> Outcome {
        let accuracies = self.accuracies(tried.output);
        if self.prepared.is_dark() {
            let times =
                accuracies.into_iter().map(|accuracy| PredictedTime::known(accuracy, 0.0, 0.0, Some(0.0), None));
            return Outcome { first_number: Some(0.0), times: times.collect(), is_busy: false };
        }
        let stop = Stop::default();
        let left = self.left(budget);
        if left <= 0.0 || self.cancel.load(Ordering::Relaxed) {
            return Outcome::default();
        }
        let clock = Clock::new(&stop, self.cancel, share);
        // a running pass is ended by wall-clock time: its limit allows for the part of the processor that other work has taken so far
        let spent = budget.clocks.spent();
        let slowness = (spent.seconds / spent.cpu()).clamp(1.0, MOST_SECONDS / BUDGET);
        let slowness = if slowness.is_finite() { slowness } else { 1.0 };
        let on_the_wall = self.end.saturating_duration_since(Instant::now()).as_secs_f64();
        let of_set_up = if tried.is_planned { SET_UP_OF_PLAN } else { 0.0 };
        let most = (slowness * (of_set_up + (GRACE * share).min(left))).min(on_the_wall);
        let mut outcome = stop.within(most, || match tried.method.described().passes() {
            method::Passes::None => self.solver(tried, &accuracies, &clock),
            _ => self.passes(tried, &accuracies, &clock),
        });
        cheapen_the_looser(&mut outcome.times);
        budget.seconds += clock.aside();
        outcome
    }

    fn seed(&self) -> u64 {
        self.prepared.seed ^ PILOT
    }

    /// Returns the relative standard error for which the passes of a trial are sized that reach a relative error at the confidence of the job.
    fn target(&self, tried: &Tried, relative_error: f64) -> f64 {
        self.prepared.stop.target_of(relative_error, tried.task.grids, tried.task.views)
    }

    /// Returns the wall-clock seconds of a job's work of this number of processor seconds, divided among its threads.
    fn shared(&self, seconds: f64) -> f64 {
        let threads = (seconds / GRAIN).clamp(1.0, self.threads as f64);
        seconds / (1.0 + OF_FURTHER_THREADS * (threads - 1.0))
    }

    /// Tries a method with passes: each accuracy is predicted from the tried passes that are nearest in size to its own.
    fn passes(&self, tried: &Tried<'_>, accuracies: &[f64], clock: &Clock<'_>) -> Outcome {
        let runs = self.runs(tried, accuracies, clock);
        let mut outcome = Outcome::default();
        for accuracy in accuracies {
            let trial = tried.trial(self.target(tried, *accuracy));
            let Some(run) = Run::nearest(&runs, &trial.passes, *accuracy) else { break };
            let Some(measured) = self.measured(tried, run, &trial) else { break };
            outcome.first_number.get_or_insert(measured.seconds_to_first_number());
            outcome.times.push(measured.time_to(*accuracy, self.judged[tried.output]));
        }
        outcome
    }

    /// Runs passes of all sizes that accuracies demand, as far as there is time: the smallest first, then those for the requested accuracy,
    /// then the others.
    fn runs(&self, tried: &Tried<'_>, accuracies: &[f64], clock: &Clock<'_>) -> Vec<Run> {
        let mut runs: Vec<Run> = Vec::new();
        let smallest_and_asked = accuracies.first().into_iter().chain([&self.asked[tried.output]]);
        for accuracy in smallest_and_asked.chain(accuracies) {
            let trial = tried.trial(self.target(tried, *accuracy));
            if runs.iter().any(|run| run.tells(&trial.passes, *accuracy, self.asked[tried.output])) {
                continue;
            }
            if runs.last().is_some_and(|run| run.expected_seconds(trial.passes.tried) >= clock.left()) {
                continue;
            }
            let most = if runs.is_empty() { MOST_PASSES } else { MOST_PASSES_EACH };
            let run = self.run_of(tried, &trial, *accuracy, most, clock);
            // the first one has computed what later ones share
            let first = runs.first().map_or(0.0, |run| run.setup_seconds);
            runs.extend(run.map(|run| Run { setup_seconds: run.setup_seconds.max(first), ..run }));
        }
        runs
    }

    /// Runs at most `most` passes of the trial for an accuracy; `None` where there is no time for the least number.
    fn run_of(&self, tried: &Tried<'_>, trial: &Trial, accuracy: f64, most: usize, clock: &Clock<'_>) -> Option<Run> {
        let Tried { task, sample, .. } = tried;
        let build = |sample: &Sample| {
            let clocks = Clocks::start();
            let task = Task { exchanges: Some(&tried.exchanges), cancel: clock.stop.flag(), ..sample.task(task) };
            match trial.method.build(&task, self.seed(), self.target(tried, accuracy)) {
                Computation::Passes(integrator) => Some((integrator, clocks.spent().cpu())),
                Computation::Solution(_) => None,
            }
        };
        let clocks = Clocks::start();
        let (integrator, setup_seconds) = build(sample)?;
        if tried.is_planned {
            clock.put_aside(setup_seconds);
        }
        let (mut built, mut rebuilding) = (setup_seconds, setup_seconds);
        let mut passes = Passes::default();
        passes.run(integrator.as_ref(), 1, clock);
        let few = Sample::new(task, sample.places() / FEW_PLACES);
        let mut of_few = Passes::default();
        let needs_few =
            sample.places() < sample.all || trial.passes.powers.work_of_pass != trial.passes.powers.work_of_place;
        let needs_few = needs_few && few.places() < sample.places();
        if needs_few && !clock.is_over() {
            let (integrator, seconds) = build(&few)?;
            (built, rebuilding) = (built + seconds, 2.0 * seconds);
            of_few.run(integrator.as_ref(), FEW_PLACES_PASSES, clock);
        }
        passes.run(integrator.as_ref(), most - 1, clock);
        let cost = passes.cost()?;
        let of_place =
            if needs_few { ((cost - of_few.cost()?) / (sample.places() - few.places()) as f64).max(0.0) } else { 0.0 };
        let of_pass = (cost - of_place * sample.places() as f64).max(0.0);
        let spent = clocks.spent().cpu() - built;
        let size = trial.passes.tried;
        let run = Run { size, accuracy, passes, setup_seconds, rebuilding, of_pass, of_place, spent };
        (run.passes.found.len() >= LEAST_PASSES).then_some(run)
    }

    /// Predicts the cost and the error laws of the method's own passes, of which `trial` has small versions, from the passes of `run`.
    fn measured(&self, tried: &Tried<'_>, run: &Run, trial: &Trial) -> Option<Measured> {
        let ratios = trial.passes.ratios(run.size);
        let of_places = run.of_place * tried.sample.all as f64 * ratios.work_of_place;
        Some(Measured {
            setup_seconds: run.setup_seconds,
            seconds_per_pass: self.shared(run.of_pass * ratios.work_of_pass + of_places),
            cost_deviation: libm::hypot(OF_COST, run.passes.deviation()),
            laws: run.passes.laws(&tried.sample, &ratios, trial.passes.alpha)?,
            passes: run.passes.found.len(),
        })
    }

    /// Tries a method without passes: it is solved to one accuracy after the other, as long as there is time.
    fn solver(&self, tried: &Tried<'_>, accuracies: &[f64], clock: &Clock<'_>) -> Outcome {
        let mut outcome = Outcome::default();
        let mut solved: Option<(f64, Option<f64>)> = None;
        for accuracy in accuracies {
            let reaches = solved.is_some_and(|(_, error)| error.is_none_or(|error| error <= *accuracy));
            if !reaches {
                let clocks = Clocks::start();
                let task = Task { cancel: clock.stop.flag(), ..tried.task };
                let built = tried.method.described().build(&task, self.seed(), self.target(tried, *accuracy));
                let Computation::Solution(solver) = built else { break };
                let Some(solution) = (!clock.is_over()).then(|| solver.solve(clock.stop.flag())).flatten() else {
                    break;
                };
                if solution.ending == Ending::CutShort {
                    break;
                }
                let seconds = self.shared(clocks.spent().cpu());
                let mut estimate = Estimate::empty(&self.prepared.scene);
                estimate.push_solution(&solution);
                outcome.first_number.get_or_insert(seconds);
                solved = Some((seconds, self.prepared.accuracy(&estimate).grids));
            }
            let Some((seconds, error)) = solved else { break };
            let factor = libm::exp(two_sided_normal_quantile(self.prepared.stop.confidence) * OF_COST);
            outcome.times.push(match error {
                None => PredictedTime::unknown(*accuracy, "the method is a formula whose error is not known"),
                Some(error) if error > *accuracy => PredictedTime::unknown(
                    *accuracy,
                    format!("the method cannot be more accurate than {:.2} %", 100.0 * error),
                ),
                Some(_) => PredictedTime::known(*accuracy, seconds, seconds / factor, Some(seconds * factor), None),
            });
        }
        outcome
    }
}

#[cfg(test)]
mod tests {
    use super::super::pilot_outcome::BUSY;
    use super::*;
    use crate::document::NoFiles;
    use crate::engine::prepare::prepare;

    /// When the wall-clock time is over before the processor time, the reason that is given is the machine, not the method.
    #[test]
    fn a_busy_machine_is_told_as_the_reason() {
        let prepared = prepare(include_bytes!("../../examples/cornell_box.json"), &NoFiles).unwrap();
        let predictions = predict_within(&prepared, &AtomicBool::new(false), Duration::ZERO);
        let outputs = [&predictions.grids, &predictions.views].into_iter().flatten();
        let tried: Vec<_> = outputs.flat_map(|output| &output.methods).filter(|row| row.refusal.is_none()).collect();
        assert!(!tried.is_empty());
        for row in tried {
            assert!(row.accuracies.iter().all(|time| time.reason.as_deref() == Some(BUSY)), "{row:?}");
        }
    }
}

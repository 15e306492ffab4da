//! The integrators of a plan, which add pass after pass to an estimate.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::analytic::{Ending, Solver};
use crate::estimate::stopping::Wanted;
use crate::estimate::{Estimate, StopRule};
use crate::integrator::components::InParts;
use crate::integrator::cross_check::CrossChecked;
use crate::integrator::method::{Computation, Task};
use crate::integrator::moments::at_moments;
use crate::integrator::photon_map::progressive::Carried;
use crate::integrator::radiosity::SharedExchanges;
use crate::integrator::{Integrator, Pass};
use crate::plan::{MethodChoice, Methods};
use crate::scene::Scene;
use crate::traceable::TraceableScene;
use crate::traceable::luminaire::TraceableLuminaire;

/// Number of the cross-check among the seeds of a job; parts of the light count from 1.
const CHECK: u64 = 0;
/// Number of the moments of a year among the seeds of a job, above those of all parts.
const MOMENTS: u64 = 1 << 32;

/// The integrators of a plan.
pub(super) enum Engine {
    /// Nothing is lit: every value is exactly zero.
    Dark,
    /// One computation gives all results.
    Solver(Box<dyn Solver>),
    /// One method that computes grids and views in the same passes.
    Shared(Box<dyn Integrator>),
    Separate {
        grids: Option<Box<dyn Integrator>>,
        views: Option<Box<dyn Integrator>>,
    },
}

/// Outcome of adding a pass to an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Added {
    /// One whole pass.
    Pass,
    /// Partial solution of a solver that was cancelled: it counts as a pass, and none follows.
    CutShort,
    /// Nothing: the pass was cancelled.
    Nothing,
}

/// Results of one pass of a job's methods.
#[derive(Default)]
pub(super) struct Results {
    /// Pass of the grids, or of the one method that computes grids and views.
    pub grids: Option<Pass>,
    /// Pass of the views, where they have a method of their own.
    pub views: Option<Pass>,
}

/// Factor of the requested error where a method computes all light of an output.
const WHOLE: f64 = 1.0;

/// Derives the seed of a part of a job, far from that of the job and of other jobs; methods hash it to random numbers.
fn seed_of(seed: u64, number: u64) -> u64 {
    // the odd number next to 2^64 over the golden ratio
    seed.wrapping_add((number + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Returns the number n of parts that the light of grids is the sum of: each source, and daylight through each tube. Where all give the same
/// light, their sum has n times the light and n^(1/2) times the error of each.
fn lights(scene: &TraceableScene) -> usize {
    scene.sources().map(|source| if source.is_daylight() { scene.tubes.len() } else { 1 }).sum()
}

/// Returns a scene in which ground and buildings around the tubes give no light.
fn without_light_around(scene: &TraceableScene) -> TraceableScene {
    let mut dark = scene.clone();
    for tube in &mut dark.tubes {
        tube.surroundings = tube.surroundings.as_ref().map(|around| Arc::new(around.dark()));
    }
    dark
}

impl Engine {
    /// True of a scene without light, of which no responses are wanted either.
    pub(super) fn is_dark(traceable: &TraceableScene, scene: &Scene) -> bool {
        let electric = traceable.luminaires.iter().any(TraceableLuminaire::emits);
        let responses = scene.grids.iter().any(|grid| grid.responses.are_reported());
        !traceable.has_sky() && !traceable.has_sun() && !electric && !responses
    }

    /// Builds the integrators of a plan. What is returned once `cancel` is raised is not to be used: no further integrator is built then.
    pub(super) fn new(
        (scene, traceable): (&Scene, &Arc<TraceableScene>),
        methods: &Methods,
        stop: &StopRule,
        seed: u64,
        cancel: &AtomicBool,
    ) -> Self {
        if Self::is_dark(traceable, scene) {
            return Self::Dark;
        }
        let task = Task { cancel, ..Task::whole(scene, traceable) };
        let is_cancelled = || cancel.load(Ordering::Relaxed);
        let build = |choice: &MethodChoice, task: Task, seed: u64, share: f64| {
            choice.method.described().build(&task, seed, share * stop.target(task.grids, task.views))
        };
        if let Some(of_both) = methods.grids.as_ref().filter(|_| methods.passes_are_common()) {
            return match build(of_both, task, seed, WHOLE) {
                Computation::Passes(integrator) => Self::Shared(integrator),
                Computation::Solution(solver) => Self::Solver(solver),
            };
        }
        let mut grids = None;
        if let Some(choice) = &methods.grids {
            let (count, of_whole) = (scene.grids.len(), task.without_views());
            let parts = lights(traceable);
            let exchanges = SharedExchanges::new(traceable, parts);
            // sensors that are far from a tube have the light of others
            let least_share_of_mean = of_whole.least_share_of_mean.max(1.0 - 1.0 / parts as f64);
            let of_part = |part: Arc<TraceableScene>, number| {
                if is_cancelled() {
                    return None;
                }
                let task = Task { traceable: &part, exchanges: Some(&exchanges), least_share_of_mean, ..of_whole };
                match build(choice, task, seed_of(seed, number), (parts as f64).sqrt()) {
                    Computation::Passes(integrator) => Some(integrator),
                    Computation::Solution(_) => None,
                }
            };
            let in_parts = methods.parts.and_then(|_| InParts::new(traceable, count, of_part));
            if is_cancelled() {
                return Self::Dark;
            }
            let checked: Box<dyn Integrator> = match in_parts {
                Some(parts) => Box::new(parts),
                None => match build(choice, of_whole, seed, WHOLE) {
                    Computation::Passes(integrator) => integrator,
                    Computation::Solution(solver) => return Self::Solver(solver),
                },
            };
            let dark_around = scene.moments.as_ref().filter(|moments| !moments.surroundings_shine);
            let dark_around = dark_around.map(|_| Arc::new(without_light_around(traceable)));
            let of_moments = Task { traceable: dark_around.as_ref().unwrap_or(traceable), ..task };
            let checked = at_moments(checked, &of_moments, seed_of(seed, MOMENTS), stop.target(task.grids, &[]));
            let check = methods.check.as_ref().map(|check| build(check, of_whole, seed_of(seed, CHECK), WHOLE));
            grids = Some(match check {
                Some(Computation::Passes(check)) => Box::new(CrossChecked { checked, check, grids: count }),
                // no solver checks passes
                Some(Computation::Solution(_)) | None => checked,
            });
        }
        let of_views = methods.views.as_ref().filter(|_| !is_cancelled());
        let views = match of_views.map(|choice| build(choice, task.without_grids(), seed, WHOLE)) {
            Some(Computation::Passes(integrator)) => Some(integrator),
            // no method without passes computes views
            Some(Computation::Solution(_)) | None => None,
        };
        Self::Separate { grids, views }
    }

    /// Prepares an empty estimate for its first pass.
    pub(super) fn begin(&self, estimate: &mut Estimate) {
        match self {
            Self::Dark | Self::Solver(_) => {}
            Self::Shared(integrator) => {
                let start = integrator.start();
                estimate.begin(Some(&start), Some(&start));
            }
            Self::Separate { grids, views } => {
                let [grids, views] = [grids, views].map(|method| method.as_ref().map(|method| method.start()));
                estimate.begin(grids.as_ref(), views.as_ref());
            }
        }
    }

    /// True if no pass depends on what earlier ones left, so that passes can be computed in any order. A solver has no passes.
    pub(super) fn passes_are_independent(&self) -> bool {
        let are = |method: &dyn Integrator| method.start().carried == Carried::default();
        match self {
            Self::Dark => true,
            Self::Solver(_) => false,
            Self::Shared(method) => are(method.as_ref()),
            Self::Separate { grids, views } => [grids, views].into_iter().flatten().all(|method| are(method.as_ref())),
        }
    }

    /// Adds pass `number` of the wanted outputs to an estimate of the passes before it: its results that were computed `ahead`, or else
    /// computes it. A method that computes grids and views together computes both.
    pub(super) fn add_pass(
        &self,
        number: u64,
        estimate: &mut Estimate,
        wanted: Wanted,
        ahead: Option<Results>,
        cancel: &AtomicBool,
    ) -> Added {
        match self {
            Self::Dark => {
                let dark = estimate.dark_pass();
                estimate.push(Some(&dark), Some(&dark));
            }
            Self::Solver(solver) => {
                let Some(solution) = solver.solve(cancel) else { return Added::Nothing };
                estimate.push_solution(&solution);
                if solution.ending == Ending::CutShort {
                    return Added::CutShort;
                }
            }
            Self::Shared(_) | Self::Separate { .. } => {
                let ahead = ahead.filter(|ahead| self.have_all(ahead, wanted));
                let computed = || self.results(number, &estimate.carried, wanted, cancel);
                let Some(results) = ahead.or_else(computed) else { return Added::Nothing };
                let (grids, views) = (results.grids.as_ref(), results.views.as_ref());
                match self {
                    Self::Shared(_) => estimate.push(grids, grids),
                    _ => estimate.push(grids.filter(|_| wanted.grids), views.filter(|_| wanted.views)),
                }
            }
        }
        Added::Pass
    }

    /// Computes pass `number` of the wanted outputs after passes that left the state `before`; `None` where it was cancelled, and of a
    /// scene without light or a solver.
    pub(super) fn results(
        &self,
        number: u64,
        before: &Carried,
        wanted: Wanted,
        cancel: &AtomicBool,
    ) -> Option<Results> {
        let run = |method: &dyn Integrator| method.pass_after(number, before, cancel);
        match self {
            Self::Dark | Self::Solver(_) => None,
            Self::Shared(method) => Some(Results { grids: Some(run(method.as_ref())?), views: None }),
            Self::Separate { grids, views } => {
                let (grids, views) = (grids.iter().find(|_| wanted.grids), views.iter().find(|_| wanted.views));
                let grids = grids.map(|method| run(method.as_ref()));
                let views = views.map(|method| run(method.as_ref()));
                if matches!(grids, Some(None)) || matches!(views, Some(None)) {
                    return None;
                }
                Some(Results { grids: grids.flatten(), views: views.flatten() })
            }
        }
    }

    /// True if results have all wanted outputs.
    fn have_all(&self, results: &Results, wanted: Wanted) -> bool {
        match self {
            Self::Dark | Self::Solver(_) => false,
            Self::Shared(_) => results.grids.is_some(),
            Self::Separate { grids, views } => {
                (results.grids.is_some() || grids.is_none() || !wanted.grids)
                    && (results.views.is_some() || views.is_none() || !wanted.views)
            }
        }
    }
}

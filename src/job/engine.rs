//! The integrators of a plan, which add pass after pass to an estimate.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::analytic::{Ending, Solver};
use crate::estimate::stopping::Wanted;
use crate::estimate::{Estimate, StopRule};
use crate::integrator::Integrator;
use crate::integrator::method::{Computation, Task};
use crate::integrator::some_sensors::SomeSensors;
use crate::plan::{MethodChoice, Methods};
use crate::scene::Scene;
use crate::statistics::interval::two_sided_normal_quantile;
use crate::traceable::TraceableScene;
use crate::traceable::luminaire::TraceableLuminaire;

/// The integrators of a plan.
pub(super) enum Engine {
    /// Nothing is lit: every value is exactly zero.
    Dark,
    /// One computation gives everything.
    Solver(Box<dyn Solver>),
    /// One method computes grids and views in the same passes.
    Shared(Box<dyn Integrator>),
    Separate {
        grids: Option<Box<dyn Integrator>>,
        views: Option<Box<dyn Integrator>>,
    },
}

/// What was added to an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Added {
    /// One whole pass.
    Pass,
    /// What a solver had found when it was cancelled: it counts as a pass, and none follows.
    CutShort,
    /// Nothing: the pass was cancelled.
    Nothing,
}

impl Engine {
    pub(super) fn new(
        traceable: &Arc<TraceableScene>,
        scene: &Scene,
        methods: &Methods,
        stop: &StopRule,
        seed: u64,
    ) -> Self {
        let electric = traceable.luminaires.iter().any(TraceableLuminaire::emits);
        if traceable.sky.is_none() && traceable.sun.is_none() && !electric {
            return Self::Dark;
        }
        let target = stop.relative_error / two_sided_normal_quantile(stop.confidence);
        let task = Task::whole(scene, traceable);
        let build = |choice: &MethodChoice, task: Task| choice.method.described().build(&task, seed, target);
        let shared = methods.share_passes();
        let of_grids = methods.grids.as_ref();
        let grids = match of_grids.map(|choice| build(choice, if shared { task } else { task.without_views() })) {
            Some(Computation::Solution(solver)) => return Self::Solver(solver),
            Some(Computation::Passes(integrator)) if shared => return Self::Shared(integrator),
            Some(Computation::Passes(all)) => Some(match &methods.beside_surfaces {
                None => all,
                Some(some) => {
                    let few = some.as_grids(&scene.grids);
                    let task = Task { grids: &few, ..task.without_views() };
                    match build(&some.choice, task) {
                        Computation::Passes(integrator) => {
                            Box::new(SomeSensors { all, some: integrator, places: some.places.clone() })
                        }
                        // no solver computes some sensors
                        Computation::Solution(_) => all,
                    }
                }
            }),
            None => None,
        };
        let of_views = methods.views.as_ref();
        let views = match of_views.map(|choice| build(choice, task.without_grids())) {
            Some(Computation::Passes(integrator)) => Some(integrator),
            // no method without passes computes views
            Some(Computation::Solution(_)) | None => None,
        };
        Self::Separate { grids, views }
    }

    /// Prepares an estimate of no passes.
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

    /// Adds pass `number` of what is wanted to an estimate of the passes before it; a method that computes grids and views
    /// together computes both.
    pub(super) fn add_pass(&self, number: u64, estimate: &mut Estimate, wanted: Wanted, cancel: &AtomicBool) -> Added {
        let run =
            |integrator: &dyn Integrator, estimate: &Estimate| integrator.pass_after(number, &estimate.carried, cancel);
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
            Self::Shared(integrator) => {
                let Some(pass) = run(integrator.as_ref(), estimate) else { return Added::Nothing };
                estimate.push(Some(&pass), Some(&pass));
            }
            Self::Separate { grids, views } => {
                let (grids, views) = (grids.iter().find(|_| wanted.grids), views.iter().find(|_| wanted.views));
                let grid_pass = grids.map(|integrator| run(integrator.as_ref(), estimate));
                let view_pass = views.map(|integrator| run(integrator.as_ref(), estimate));
                if matches!(grid_pass, Some(None)) || matches!(view_pass, Some(None)) {
                    return Added::Nothing;
                }
                estimate.push(grid_pass.flatten().as_ref(), view_pass.flatten().as_ref());
            }
        }
        Added::Pass
    }
}

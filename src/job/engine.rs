//! The integrators of a plan, which add pass after pass to an estimate.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::analytic::Solver;
use crate::estimate::{Estimate, StopRule};
use crate::integrator::bidirectional::Bidirectional;
use crate::integrator::light_tracing::LightTracing;
use crate::integrator::path_tracing::PathTracing;
use crate::integrator::photon_mapping::PhotonMapping;
use crate::integrator::ppm::Ppm;
use crate::integrator::sppm::Sppm;
use crate::integrator::two_stage::TwoStage;
use crate::integrator::{Integrator, Method, deterministic};
use crate::plan::Methods;
use crate::scene::{Channels, Grid, Scene, View};
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

impl Engine {
    pub(super) fn new(
        kernel: Arc<TraceableScene>,
        scene: &Scene,
        methods: &Methods,
        stop: &StopRule,
        seed: u64,
    ) -> Self {
        let electric = kernel.luminaires.iter().any(TraceableLuminaire::emits);
        if kernel.sky.is_none() && kernel.sun.is_none() && !electric {
            return Self::Dark;
        }
        let target = stop.relative_error / two_sided_normal_quantile(stop.confidence);
        if let Some(choice) = &methods.grids
            && let Some(solver) = deterministic::solver(&choice.method, &kernel, scene, target, seed)
        {
            return Self::Solver(solver);
        }
        let build = |method: &Method, grids: &[Grid], views: &[View]| -> Option<Box<dyn Integrator>> {
            match scene.channels {
                Channels::Photopic => integrator::<1>(method, kernel.clone(), grids, views, seed),
                Channels::Rgb => integrator::<3>(method, kernel.clone(), grids, views, seed),
            }
        };
        let shared = methods.grids.as_ref().filter(|_| methods.share_passes());
        if let Some(integrator) = shared.and_then(|choice| build(&choice.method, &scene.grids, &scene.views)) {
            return Self::Shared(integrator);
        }
        let Methods { grids, views } = methods;
        Self::Separate {
            grids: grids.as_ref().and_then(|choice| build(&choice.method, &scene.grids, &[])),
            views: views.as_ref().and_then(|choice| build(&choice.method, &[], &scene.views)),
        }
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

    /// Adds pass `number` to an estimate of those before it; false when cancelled.
    pub(super) fn add_pass(&self, number: u64, estimate: &mut Estimate, cancel: &AtomicBool) -> bool {
        let run =
            |integrator: &dyn Integrator, estimate: &Estimate| integrator.pass_after(number, &estimate.carried, cancel);
        match self {
            Self::Dark => {
                let dark = estimate.dark_pass();
                estimate.push(Some(&dark), Some(&dark));
            }
            Self::Solver(solver) => {
                let Some(solution) = solver.solve(cancel) else { return false };
                estimate.push_solution(&solution);
            }
            Self::Shared(integrator) => {
                let Some(pass) = run(integrator.as_ref(), estimate) else { return false };
                estimate.push(Some(&pass), Some(&pass));
            }
            Self::Separate { grids, views } => {
                let grid_pass = grids.as_ref().map(|integrator| run(integrator.as_ref(), estimate));
                let view_pass = views.as_ref().map(|integrator| run(integrator.as_ref(), estimate));
                if matches!(grid_pass, Some(None)) || matches!(view_pass, Some(None)) {
                    return false;
                }
                estimate.push(grid_pass.flatten().as_ref(), view_pass.flatten().as_ref());
            }
        }
        true
    }
}

/// The integrator of a method that computes passes.
fn integrator<const C: usize>(
    method: &Method,
    kernel: Arc<TraceableScene>,
    grids: &[Grid],
    views: &[View],
    seed: u64,
) -> Option<Box<dyn Integrator>> {
    match method {
        Method::LightTracing(settings) => Some(Box::new(LightTracing::<C>::new(kernel, grids, settings, seed))),
        Method::Ppm(settings) => Some(Box::new(Ppm::<C>::new(kernel, grids, views, settings, seed))),
        Method::Sppm(settings) => Some(Box::new(Sppm::<C>::new(kernel, grids, views, settings, seed))),
        Method::PathTracing(settings) => Some(Box::new(PathTracing::<C>::new(kernel, grids, views, settings, seed))),
        Method::Bidirectional(settings) => {
            Some(Box::new(Bidirectional::<C>::new(kernel, grids, views, settings, seed)))
        }
        Method::PhotonMapping(settings) => {
            Some(Box::new(PhotonMapping::<C>::new(kernel, grids, views, settings, seed)))
        }
        Method::TwoStage(settings) => Some(Box::new(TwoStage::<C>::new(kernel, grids, views, settings, seed))),
        Method::Holigilm | Method::Jenkins(_) => None,
    }
}

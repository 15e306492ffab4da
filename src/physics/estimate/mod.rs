//! Estimates with errors, as sums over passes.

pub mod discrepancy;
pub mod error_law;
pub mod film;
pub mod grid;
pub mod grid_statistics;
pub mod residual;
pub mod spread;
pub mod stopping;

pub use discrepancy::Discrepancy;
pub use film::FilmEstimate;
pub use grid::GridEstimate;
pub use stopping::{Accuracy, StopRule};

use self::grid::push_with_error;
use crate::analytic::{Balance, Quantity, Solution};
use crate::guide::RayCount;
use crate::integrator::photon::energy_balance::{PhotonTotals, TubeFlux};
use crate::integrator::photon_map::progressive::Carried;
use crate::integrator::{GridPass, Pass, ViewPass};
use crate::scene::Scene;
use crate::statistics::Moments;

pub use crate::integrator::photon::energy_balance::EnergyBalance;

/// State of a job: the sum of all its passes. Chunks are merged in their order only.
#[derive(Clone, Debug, Default)]
pub struct Estimate {
    /// Number of passes; a solution counts as one.
    pub passes: u64,
    /// Number of photons emitted in all passes.
    pub photons: u64,
    /// Number of ray segments of all passes; a closed form through a guide counts as one.
    pub rays: u64,
    /// Number of rays that left guides through gaps in their meshes.
    pub lost_rays: u64,
    /// Illuminances, in the order of the scene's grids.
    pub grids: Vec<GridEstimate>,
    /// Luminances, in the order of the scene's views.
    pub views: Vec<FilmEstimate>,
    /// Fluxes, in the order of the scene's tubes.
    pub tubes: Vec<TubeEstimate>,
    /// Flux by the places where it ended, in lm: the sum over the passes.
    pub energy: EnergyBalance,
    /// Number of the first photon of the last pass whose result is infinite or not a number: a fault of the program, which ends the job.
    pub not_finite: Option<u64>,
    /// Statistics of points that the last pass hands to the next one; empty where passes are independent.
    pub carried: Carried,
}

/// Flux through one tube in lm, per pass.
#[derive(Clone, Copy, Debug, Default)]
pub struct TubeEstimate {
    /// Flux that reaches the collector from outside.
    pub at_collector: Moments,
    /// Flux that arrives at the closure from above.
    pub at_diffuser: Moments,
    /// Flux that leaves the closure downward.
    pub into_room: Moments,
    /// Part of `into_room` that leaves with a Lambertian distribution; no replicates if that is unknown.
    pub evenly: Moments,
    /// Ratio of `into_room` to `at_collector`, of the passes in which light arrives: their spread tells the error of the ratio of means, in
    /// which what both fluxes have in common cancels.
    pub transmission: Moments,
}

impl Estimate {
    /// Creates an estimate of no passes for a scene's outputs.
    pub fn empty(scene: &Scene) -> Self {
        Self {
            grids: scene.grids.iter().map(GridEstimate::of).collect(),
            views: scene.views.iter().map(|view| FilmEstimate::empty(view.size_px, scene.channels.count())).collect(),
            tubes: vec![TubeEstimate::default(); scene.tubes.len()],
            ..Self::default()
        }
    }

    /// Returns the pass of a scene without light: zeros in the shape of this estimate.
    pub fn dark_pass(&self) -> Pass {
        let grid = |grid: &GridEstimate| GridPass { illuminance: vec![0.0; grid.sensors.len()], ..GridPass::default() };
        let view = |view: &FilmEstimate| ViewPass { luminance: vec![0.0; view.mean.len()], ..ViewPass::default() };
        Pass {
            grids: self.grids.iter().map(grid).collect(),
            views: self.views.iter().map(view).collect(),
            totals: PhotonTotals::new(self.tubes.len()),
            ..Pass::default()
        }
    }

    /// Allocates the values that passes compute in addition to illuminances and luminances, and takes the state from which the first pass
    /// starts: `grids` and `views` as in [`Self::push`], from [`crate::integrator::Integrator::start`].
    pub fn begin(&mut self, grids: Option<&Pass>, views: Option<&Pass>) {
        for (estimate, start) in self.grids.iter_mut().zip(grids.iter().flat_map(|start| &start.grids)) {
            estimate.begin(start);
        }
        for (estimate, start) in self.views.iter_mut().zip(views.iter().flat_map(|start| &start.views)) {
            estimate.contrasts = vec![Moments::default(); start.contrasts.len()];
        }
        for start in [grids, views].into_iter().flatten() {
            self.carried.replace(&start.carried);
        }
    }

    /// Returns the number of passes that computed the grids, or that would have if there were any; a solution counts as one.
    pub fn passes_of_grids(&self) -> u64 {
        let count = self.grids.first().and_then(|grid| grid.sensors.first()).map(|sensor| sensor.count as u64);
        count.unwrap_or(self.passes).min(self.passes)
    }

    /// Returns the number of passes that computed the views, or that would have if there were any.
    pub fn passes_of_views(&self) -> u64 {
        self.views.first().map_or(self.passes, |view| view.passes as u64)
    }

    /// Returns the number of passes that computed the fluxes and the energy balance: those of the grids, or else of the views.
    pub fn passes_of_energy(&self) -> u64 {
        if self.grids.is_empty() { self.passes_of_views() } else { self.passes_of_grids() }
    }

    /// Adds one pass. `grids` and `views` come from the methods that compute them, and are `None` once they are accurate enough; both may
    /// be the same pass.
    ///
    /// Fluxes and the energy balance are those of the passes that compute the grids, or of the views if there are no grids.
    pub fn push(&mut self, grids: Option<&Pass>, views: Option<&Pass>) {
        self.passes += 1;
        for pass in [grids, views.filter(|views| !grids.is_some_and(|grids| std::ptr::eq(*views, grids)))] {
            self.photons += pass.map_or(0, |pass| pass.photons);
            let rays = pass.map_or_else(RayCount::default, |pass| pass.totals.rays);
            self.rays += rays.followed;
            self.lost_rays += rays.lost;
            self.not_finite = self.not_finite.or(pass.and_then(|pass| pass.totals.not_finite));
        }
        if let Some(pass) = grids {
            self.grids.iter_mut().zip(&pass.grids).for_each(|(estimate, grid)| estimate.push(grid));
        }
        if let Some(pass) = views {
            self.views.iter_mut().zip(&pass.views).for_each(|(estimate, view)| estimate.push(view));
        }
        if let Some(pass) = if self.grids.is_empty() { views } else { grids } {
            self.energy.add(&pass.totals.energy);
            self.tubes.iter_mut().zip(&pass.totals.tubes).for_each(|(estimate, flux)| estimate.push(flux));
        }
        for pass in [grids, views].into_iter().flatten() {
            self.carried.replace(&pass.carried);
        }
    }

    /// Adds the result of a solver, which counts as one pass.
    pub fn push_solution(&mut self, solution: &Solution) {
        self.passes += 1;
        self.rays += solution.rays;
        self.grids.iter_mut().zip(&solution.grids).for_each(|(estimate, grid)| estimate.push_solution(grid));
        for (estimate, flux) in self.tubes.iter_mut().zip(&solution.tubes) {
            let of = |moments: &mut Moments, quantity: Quantity| {
                push_with_error(moments, quantity.value, quantity.error);
            };
            of(&mut estimate.at_collector, flux.at_collector);
            of(&mut estimate.at_diffuser, flux.at_diffuser);
            of(&mut estimate.into_room, flux.into_room);
            if flux.at_collector.value > 0.0 {
                of(&mut estimate.transmission, flux.into_room.over(flux.at_collector));
            }
        }
        let Balance { emitted, collector, guide, guide_top, diffuser, room, open_surfaces } = solution.balance;
        self.energy.add(&EnergyBalance {
            emitted,
            luminaires: 0.0,
            collector,
            guide,
            guide_top,
            diffuser,
            room,
            open_surfaces,
            cut: 0.0,
            lost: 0.0,
        });
    }

    /// Calls `f` on every floating-point value in a fixed order, as checkpoints and checks need.
    pub fn for_each_value(&mut self, f: &mut impl FnMut(&mut f64)) {
        self.grids.iter_mut().for_each(|grid| grid.for_each_value(f));
        self.views.iter_mut().for_each(|view| view.for_each_value(f));
        for tube in &mut self.tubes {
            let TubeEstimate { at_collector, at_diffuser, into_room, evenly, transmission } = tube;
            [at_collector, at_diffuser, into_room, evenly, transmission]
                .into_iter()
                .for_each(|moments| moments.for_each_value(f));
        }
        self.energy.values_mut().into_iter().for_each(&mut *f);
        self.carried.for_each_value(f);
    }

    /// Returns the place of the first value that is not finite, if there is one: a fault of the program, never to be hidden.
    pub fn first_not_finite(&self) -> Option<String> {
        let grid = self.grids.iter().enumerate().find_map(|(number, grid)| {
            let is_not_finite = |value: &Moments| !(value.mean.is_finite() && value.m2.is_finite());
            let of_moments = || {
                let each = grid.moments.len() / grid.sensors.len().max(1);
                Some(grid.moments.iter().position(is_not_finite)? / each.max(1))
            };
            let sensor = grid.sensors.iter().position(is_not_finite).or_else(of_moments)?;
            Some(format!("sensor {} of grid {}", sensor + 1, number + 1))
        });
        let grid_or_view = grid.or_else(|| {
            self.views.iter().enumerate().find_map(|(number, view)| {
                let pixel = view.mean.iter().position(|value| !value.is_finite())? / view.channels.max(1);
                Some(format!("pixel {} of view {}", pixel + 1, number + 1))
            })
        });
        let mut energy = self.energy;
        let tubes = self.tubes.iter().position(|tube| {
            let TubeEstimate { at_collector, at_diffuser, into_room, evenly, transmission } = tube;
            [at_collector, at_diffuser, into_room, evenly, transmission].iter().any(|flux| !flux.mean.is_finite())
        });
        let energy_not_finite = energy.values_mut().into_iter().any(|value| !value.is_finite());
        grid_or_view
            .or_else(|| tubes.map(|number| format!("the flux through tube {}", number + 1)))
            .or_else(|| energy_not_finite.then(|| "the energy balance".to_owned()))
    }
}

impl TubeEstimate {
    fn push(&mut self, flux: &TubeFlux) {
        self.at_collector.push(flux.at_collector);
        self.at_diffuser.push(flux.at_diffuser);
        self.into_room.push(flux.into_room);
        self.evenly.push(flux.evenly);
        if flux.at_collector > 0.0 {
            self.transmission.push(flux.into_room / flux.at_collector);
        }
    }
}

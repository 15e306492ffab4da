//! Coarse solution of the light that surfaces reflect, which is computed before any path is followed.

use std::sync::Arc;

use crate::integrator::backward::pass::lifted;
use crate::integrator::diffuser_source::closure_source::{Beside, ClosureLight, ClosureSource};
use crate::integrator::method::Task;
use crate::integrator::radiosity::{Exchange, ExpectedSpreads, Solution};
use crate::sampling::{Key, Stream};
use crate::scene::{Grid, Sensor, View};
use crate::traceable::SurfacePoint;

/// Number of photons down each tube in a trial of the room.
pub const PHOTONS_DOWN_EACH: u64 = 128;

/// Number of passes of the trial; the random numbers of the coarse solution follow theirs.
pub const TRIED_PASSES: u64 = 4;

/// Counts the pixels of some views.
pub fn pixels(views: &[View]) -> usize {
    views.iter().map(|view| view.size_px[0] * view.size_px[1]).sum()
}

/// Largest number of sensors of a grid by which the spread of its residuals is expected.
const SENSORS: usize = 100;

/// Coarse solution of the light that surfaces reflect, from a few photons.
#[derive(Debug)]
pub struct Coarse<const C: usize> {
    pub solution: Arc<Solution<C>>,
    /// Variances by which the residuals of sensors are expected to differ, by grid; empty in rooms with objects, lobes, mirrors or clear
    /// zones, where they are not known.
    pub spreads: Vec<ExpectedSpreads>,
    /// Number of rays and connections that it costs.
    pub rays: f64,
}

impl<const C: usize> Coarse<C> {
    /// Computes a coarse solution with patches of about `edge` m around the `starts` of paths; `None` where no light is reflected, and
    /// when cancelled.
    pub fn new(
        (task, beside): (&Task, Beside),
        starts: &[SurfacePoint],
        edge: f64,
        (seed, target): (u64, f64),
    ) -> Option<Self> {
        let scene = task.traceable;
        let with_clear_zones = beside == Beside::Connected;
        let random = Key::new(seed).stream(Stream::PatchRays, 0);
        let exchange = match task.exchanges {
            Some(shared) if scene.interreflection => {
                shared.exchange(with_clear_zones, starts, edge, (random, task.cancel))?
            }
            _ => Arc::new(Exchange::new((scene, with_clear_zones), starts, edge, (random, task.cancel))?),
        };
        let photons = PHOTONS_DOWN_EACH * scene.tubes.len().max(1) as u64;
        let key = Key::new(seed).stream(Stream::SizeTrial, TRIED_PASSES);
        let lit = ClosureSource::new((task, beside), &[], (photons, target), seed).pass(scene, key, task.cancel);
        let light = lit.map_or_else(Vec::new, |lit: ClosureLight<C>| lit.lambertian.fluxes_with_centroids());
        let solution = exchange.solve((scene, with_clear_zones), &light);
        Some(Self {
            spreads: Self::spreads((task, beside), &solution, key),
            rays: task.exchanges.map_or(exchange.rays(), |shared| shared.cost(exchange.rays())),
            solution: Arc::new(solution),
        })
    }

    /// Estimates the variances by which the residuals of sensors beyond a solution are expected to differ, by grid; none where they are not
    /// known.
    pub fn spreads((task, beside): (&Task, Beside), solution: &Solution<C>, key: Key) -> Vec<ExpectedSpreads> {
        let scene = task.traceable;
        // light by lobes and mirrors makes sensors differ by more than the errors of their patches, and so do patches that lie in part below
        // an object or in a beam
        if !scene.is_bare() || beside == Beside::Connected {
            return Vec::new();
        }
        let spread = |(number, grid): (usize, &Grid)| {
            let some = grid.thinned(SENSORS);
            let valued = (0..some.len()).filter(|sensor| !some.is_inside(*sensor));
            let sensors: Vec<Sensor> = valued.map(|sensor| lifted(scene, &some, sensor)).collect();
            solution.expected_spreads(scene, &sensors, key.stream(Stream::Grid, number as u64))
        };
        task.all_grids.iter().enumerate().map(spread).collect()
    }
}

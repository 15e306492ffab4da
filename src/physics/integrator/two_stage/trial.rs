//! What is found out in the room before the first pass: a coarse solution of what surfaces reflect, and how many paths, connections and
//! photons a pass needs.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::sizes::{PATHS, Sizes, Spread, Tried};
use super::straight::Sensors;
use super::{Settings, TwoStage, valued};
use crate::integrator::lamp::beside::{Lamps, Lit};
use crate::integrator::method::Task;
use crate::integrator::radiosity::{Exchange, Solution};
use crate::sampling::{Key, Stream};
use crate::scene::Grid;
use crate::traceable::TraceableScene;

/// Sensors of a grid that are tried, at most, passes, and photons down each tube.
const TRIED_SENSORS: usize = 36;
const TRIED_PASSES: u64 = 4;
const TRIED_PHOTONS: u64 = 64;

impl<const C: usize> TwoStage<C> {
    /// Sizes of a pass, by a small trial where the document does not say how many paths there are.
    pub(super) fn sizes(
        task: &Task,
        settings: &Settings,
        reflected: Option<&Arc<Solution<C>>>,
        (seed, target): (u64, f64),
    ) -> Sizes {
        let scene = task.traceable;
        let photons = Sizes::photons(target, &scene.tubes, !task.views.is_empty());
        let sizes = Sizes {
            photons: settings.photons_per_pass.unwrap_or(photons),
            per_sensor: 1,
            beyond: 1,
            per_opening: Sizes::per_opening(target),
            per_pixel: settings.samples_per_pixel,
        };
        match settings.samples_per_sensor {
            Some(paths) => sizes.with_paths(paths),
            None => Self::tried(scene, task.grids, reflected, (seed, target)).map_or_else(
                || sizes.with_paths(PATHS.power_of_two(target) as u32),
                |spread| {
                    let tried = sizes.tried(target, spread, (valued(task.grids), scene.tubes.len()));
                    Sizes { photons: settings.photons_per_pass.unwrap_or(tried.photons), ..tried }
                },
            ),
        }
    }

    /// Solves coarsely for the light of a few photons that surfaces reflect.
    pub(super) fn reflected(task: &Task, exchange: &Arc<Exchange<C>>, seed: u64, target: f64) -> Arc<Solution<C>> {
        let scene = task.traceable;
        let photons = TRIED_PHOTONS * scene.tubes.len().max(1) as u64;
        let key = Key::new(seed).stream(Stream::SizeTrial, TRIED_PASSES);
        let lit = Lamps::new(scene, &[], (photons, target), seed).pass(scene, key, &AtomicBool::new(false));
        let fluxes = lit.map_or_else(Vec::new, |lit: Lit<C>| lit.lamps.fluxes());
        Arc::new(exchange.solve(&fluxes))
    }

    /// Tries paths from some sensors and returns how much they differ; `None` without sensors.
    fn tried(
        scene: &Arc<TraceableScene>,
        grids: &[Grid],
        reflected: Option<&Arc<Solution<C>>>,
        (seed, target): (u64, f64),
    ) -> Option<Spread> {
        let grids: Vec<Grid> = grids.iter().map(|grid| grid.thinned(TRIED_SENSORS)).collect();
        let photons = TRIED_PHOTONS * scene.tubes.len().max(1) as u64;
        let sizes = Sizes { photons, ..Sizes::TRIED };
        let method = Self::sized(scene, (&grids, &[]), (sizes, target), reflected.cloned(), seed);
        let key = |pass: u64| method.seed.stream(Stream::SizeTrial, pass);
        // the light is the same in all: how much it differs is no matter of paths
        let light = method.lit(key(0), &AtomicBool::new(false))?;
        let tried = |number: usize, sensor: usize| {
            let sensors = Sensors { number, grid: &grids[number], pass: 0, offsets: None, stream: key(0) };
            let straight = method.connections.straight(scene, &light.lamps, sensors, sensor);
            Tried {
                ways: method.connections.ways(scene, number, sensor) as f64,
                by_one_photon: straight.by_one_photon,
                ..Tried::default()
            }
        };
        let of_grid = |(number, grid): (usize, &Grid)| (0..grid.len()).map(|sensor| tried(number, sensor)).collect();
        let mut values: Vec<Vec<Tried>> = grids.iter().enumerate().map(of_grid).collect();
        for pass in 0..TRIED_PASSES {
            let (found, _) = method.grids(&light.lamps, key(pass), pass, &AtomicBool::new(false))?;
            for (values, grid) in values.iter_mut().zip(&found) {
                for (sensor, tried) in values.iter_mut().enumerate() {
                    let [lux, gathered, beyond] =
                        [&grid.illuminance, &grid.gathered, &grid.residual].map(|values| values[sensor]);
                    tried.lux.push(lux);
                    tried.gathered.push(gathered);
                    tried.beyond.push(beyond);
                    tried.straight.push(lux - gathered - beyond);
                }
            }
        }
        Spread::of(values.into_iter().flatten())
    }
}

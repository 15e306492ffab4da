//! Trials in the room, before the first pass: how many paths, connections and photons a pass has, and how sensors divide the paths.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::coarse::{Coarse, PHOTONS_DOWN_EACH, TRIED_PASSES, valued};
use super::passes::TwoStage;
use super::sample_counts::{PATHS, SampleCounts};
use super::settings::Settings;
use super::straight::GridSensors;
use super::variances::{RelativeVariances, Share, TrialValues};
use crate::integrator::diffuser_source::closure_source::Beside;
use crate::integrator::method::Task;
use crate::sampling::Stream;
use crate::scene::Grid;
use crate::traceable::TraceableScene;

/// Largest number of sensors of a grid in the first trial.
const TRIED_SENSORS: usize = 36;

impl<const C: usize> TwoStage<C> {
    /// Chooses the sizes of a pass, by a small trial where the document does not set the number of paths.
    pub(super) fn counts(
        (task, beside): (&Task, Beside),
        settings: &Settings,
        coarse: Option<&Coarse<C>>,
        (seed, target): (u64, f64),
    ) -> (SampleCounts, Option<RelativeVariances>) {
        let scene = task.traceable;
        let photons = SampleCounts::photons(target, task, beside);
        let counts = SampleCounts {
            photons: settings.photons_per_pass.unwrap_or(photons),
            per_sensor: 1,
            beyond: 1,
            per_opening: SampleCounts::per_opening(target),
            per_pixel: settings.samples_per_pixel,
        };
        match settings.samples_per_sensor {
            Some(paths) => (counts.with_paths(paths), None),
            None => {
                let some: Vec<Grid> = task.grids.iter().map(|grid| grid.thinned(TRIED_SENSORS)).collect();
                let values = Self::tried((scene, beside), &some, coarse, (seed, target, TRIED_PASSES));
                let spread = values.and_then(|values| RelativeVariances::of(values.into_iter().flatten()));
                let sized = spread.map_or_else(
                    || counts.with_paths(PATHS.power_of_two(target) as u32),
                    |spread| Self::sized(counts, task, settings, target, spread),
                );
                (sized, spread)
            }
        }
    }

    /// Returns the sizes of a pass that the spread of tried sensors requires, with the number of photons that the document sets.
    fn sized(
        counts: SampleCounts,
        task: &Task,
        settings: &Settings,
        target: f64,
        spread: RelativeVariances,
    ) -> SampleCounts {
        let tried = counts.tried(target, spread, (valued(task.grids), task.traceable.tubes.len()));
        SampleCounts { photons: settings.photons_per_pass.unwrap_or(tried.photons), ..tried }
    }

    /// Divides the paths of a long job among its sensors, by a trial of all of them; `None` where the document sets their number, and in
    /// jobs that are too short to gain by it.
    pub(super) fn divided(
        (task, beside): (&Task, Beside),
        settings: &Settings,
        coarse: Option<&Coarse<C>>,
        (seed, target): (u64, f64),
        counts: &mut SampleCounts,
    ) -> Option<Vec<Vec<Share>>> {
        let passes = counts.trial_of_all().filter(|_| settings.samples_per_sensor.is_none())?;
        let values = Self::tried((task.traceable, beside), task.grids, coarse, (seed, target, passes))?;
        let (spread, shares) = RelativeVariances::of_shares(&values.concat())?;
        *counts = Self::sized(*counts, task, settings, target, spread);
        let mut shares = shares.into_iter();
        Some(values.iter().map(|of_grid| shares.by_ref().take(of_grid.len()).collect()).collect())
    }

    /// Computes trial passes of the sensors of some grids; `None` without sensors.
    fn tried(
        (scene, beside): (&Arc<TraceableScene>, Beside),
        grids: &[Grid],
        coarse: Option<&Coarse<C>>,
        (seed, target, passes): (u64, f64, u64),
    ) -> Option<Vec<Vec<TrialValues>>> {
        let photons = PHOTONS_DOWN_EACH * scene.tubes.len().max(1) as u64;
        let counts = SampleCounts { photons, ..SampleCounts::TRIAL };
        let method = Self::with_counts((scene, beside), (grids, &[]), (counts, target), coarse, seed);
        let key = |pass: u64| method.seed.stream(Stream::SizeTrial, pass);
        // all passes have the same light, because its variance does not depend on paths
        let light = method.lit(key(0), &AtomicBool::new(false))?;
        let tried = |number: usize, sensor: usize| {
            let sensors = GridSensors { number, grid: &grids[number], pass: 0, offsets: None, stream: key(0) };
            let straight = method.connections.straight(scene, &light.lambertian, sensors, sensor);
            TrialValues {
                expected_spread: method.spreads.get(number).copied().unwrap_or(f64::INFINITY),
                hidden_sources: method.connections.hidden_sources(scene, number, sensor) as f64,
                by_one_photon: straight.by_one_photon,
                ..TrialValues::default()
            }
        };
        let of_grid = |(number, grid): (usize, &Grid)| (0..grid.len()).map(|sensor| tried(number, sensor)).collect();
        let mut values: Vec<Vec<TrialValues>> = grids.iter().enumerate().map(of_grid).collect();
        for pass in 0..passes {
            let (found, _) = method.grids(&light.lambertian, key(pass), pass, &AtomicBool::new(false))?;
            for (number, (values, grid)) in values.iter_mut().zip(&found).enumerate() {
                let straight = light.directional.get(number).filter(|_| beside == Beside::Connected);
                for (sensor, tried) in values.iter_mut().enumerate() {
                    tried.push(grid, sensor, straight.map_or(0.0, |grid| grid.illuminance[sensor]));
                }
            }
        }
        Some(values)
    }
}

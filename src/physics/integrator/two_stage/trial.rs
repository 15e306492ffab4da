//! Trials in the room, before the first pass: how many paths, connections and photons a pass has, and how sensors divide the paths.

use super::coarse::{Coarse, PHOTONS_DOWN_EACH, TRIED_PASSES};
use super::passes::TwoStage;
use super::sample_counts::SampleCounts;
use super::settings::Settings;
use super::sizes::Sizes;
use super::straight::GridSensors;
use super::variances::{PASSES, RelativeVariances, Share, TrialValues};
use crate::integrator::diffuser_source::closure_source::{Beside, ClosureSource};
use crate::integrator::method::Task;
use crate::integrator::radiosity::ExpectedSpreads;
use crate::sampling::Stream;
use crate::scene::Grid;

/// Largest number of sensors of a grid in the first trial.
pub const TRIED_SENSORS: usize = 36;

impl<const C: usize> TwoStage<C> {
    /// Chooses the sizes of a pass, by a small trial where the document does not set the number of paths; returns the variances that the
    /// trial found in each grid, too.
    pub(super) fn sizes(
        (task, beside): (&Task, Beside),
        settings: &Settings,
        coarse: Option<&Coarse<C>>,
        (seed, target): (u64, f64),
    ) -> (Sizes, Vec<Option<RelativeVariances>>) {
        let untried = vec![None; task.grids.len()];
        if settings.samples_per_sensor.is_some() {
            return (Self::sized((task, beside), settings, target, &untried), untried);
        }
        let some: Vec<Grid> = task.all_grids.iter().map(|grid| grid.thinned(TRIED_SENSORS)).collect();
        let values = Self::tried((task, beside), &some, coarse, (seed, target, TRIED_PASSES));
        let variances = values.map_or(untried, |grids| grids.into_iter().map(RelativeVariances::of).collect());
        (Self::sized((task, beside), settings, target, &variances), variances)
    }

    /// Returns the sizes of a pass that the variances of the sensors of each grid require, with the numbers that the document sets.
    fn sized(
        (task, beside): (&Task, Beside),
        settings: &Settings,
        target: f64,
        variances: &[Option<RelativeVariances>],
    ) -> Sizes {
        let tubes = task.traceable.tubes.len();
        let hidden = variances.iter().flatten().map(|of| SampleCounts::photons_for_hidden(target, *of, tubes));
        let photons = hidden.fold(SampleCounts::photons(target, task, beside), u64::max);
        let of_grid = |(variances, grid): (&Option<RelativeVariances>, &Grid)| match settings.samples_per_sensor {
            Some(paths) => SampleCounts::with_paths(paths, target),
            None => variances.map_or_else(
                || SampleCounts::usual(target),
                |variances| SampleCounts::tried(target, variances, grid.valued()),
            ),
        };
        Sizes {
            photons: settings.photons_per_pass.unwrap_or(photons),
            grids: variances.iter().zip(task.all_grids).map(of_grid).collect(),
            per_pixel: settings.samples_per_pixel,
        }
    }

    /// Divides the paths of a long job among the sensors of each grid, by a trial of all of them; `None` where the document sets their
    /// number, and in jobs that are too short to gain by it.
    pub(super) fn divided(
        (task, beside): (&Task, Beside),
        settings: &Settings,
        coarse: Option<&Coarse<C>>,
        (seed, target): (u64, f64),
        sizes: &mut Sizes,
    ) -> Option<Vec<Vec<Share>>> {
        let sensors: Vec<usize> = task.all_grids.iter().map(Grid::valued).collect();
        let passes = sizes.trial_of_all(&sensors).filter(|_| settings.samples_per_sensor.is_none())?;
        let values = Self::tried((task, beside), task.grids, coarse, (seed, target, passes))?;
        let divided = values.iter().map(|of_grid| match RelativeVariances::of_shares(of_grid) {
            Some((variances, shares)) => (Some(variances), shares),
            None => (None, vec![Share::EQUAL; of_grid.len()]),
        });
        let (variances, shares): (Vec<_>, Vec<_>) = divided.unzip();
        *sizes = Self::sized((task, beside), settings, target, &variances);
        Some(shares)
    }

    /// Computes trial passes of the sensors of some grids; `None` without sensors.
    fn tried(
        (task, beside): (&Task, Beside),
        grids: &[Grid],
        coarse: Option<&Coarse<C>>,
        (seed, target, passes): (u64, f64, u64),
    ) -> Option<Vec<Vec<TrialValues>>> {
        let scene = task.traceable;
        let photons = PHOTONS_DOWN_EACH * scene.tubes.len().max(1) as u64;
        let sizes = Sizes { photons, grids: vec![SampleCounts::TRIAL; grids.len()], per_pixel: 0 };
        // values of traced light are not needed: its variance does not depend on paths
        let lit = if beside == Beside::Traced { &[] } else { grids };
        let closures = ClosureSource::new((task, beside), lit, (photons, target), seed);
        let method = Self::with_sizes((scene, closures), (grids, &[]), sizes, coarse, seed);
        let key = |pass: u64| method.seed.stream(Stream::SizeTrial, pass);
        // all passes have the same light, because its variance does not depend on paths
        let light = method.lit(key(0), task.cancel)?;
        let tried = |number: usize, sensor: usize| {
            let sensors = GridSensors { number, grid: &grids[number], pass: 0, offsets: None, stream: key(0) };
            let straight = method.connections.straight(scene, &light.lambertian, sensors, sensor);
            TrialValues {
                expected_spread: method.spreads.get(number).map_or(f64::INFINITY, ExpectedSpreads::mean),
                hidden_sources: method.connections.hidden_sources(scene, number, sensor) as f64,
                by_one_photon: straight.by_one_photon,
                missed: straight.missed_by_connections / PASSES,
                ..TrialValues::default()
            }
        };
        let of_grid = |(number, grid): (usize, &Grid)| (0..grid.len()).map(|sensor| tried(number, sensor)).collect();
        let mut values: Vec<Vec<TrialValues>> = grids.iter().enumerate().map(of_grid).collect();
        for pass in 0..passes {
            let (found, _) = method.grids(&light.lambertian, key(pass), pass, task.cancel)?;
            for (number, (values, grid)) in values.iter_mut().zip(&found).enumerate() {
                let straight = light.directional.get(number).filter(|_| beside == Beside::Connected);
                for (sensor, tried) in values.iter_mut().enumerate() {
                    tried.push(grid, sensor, straight.map_or(0.0, |grid| grid.illuminance[sensor]));
                }
            }
        }
        values.iter_mut().for_each(|grid| TrialValues::set_scales(grid, task.least_share_of_mean));
        Some(values)
    }
}

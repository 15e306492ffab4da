//! Responses to openings beside the light of a grid: how many paths they take, by a small trial in the room.

use std::sync::Arc;

use super::coarse::{Coarse, TRIED_PASSES};
use super::passes::TwoStage;
use super::sample_counts::SampleCounts;
use super::settings::Settings;
use super::trial::TRIED_SENSORS;
use super::variances::{RelativeVariances, TrialValues};
use crate::integrator::diffuser_source::closure_source::Beside;
use crate::integrator::method::Task;
use crate::integrator::radiosity::{ExpectedSpreads, TubeSolutions};
use crate::integrator::room_matrix::{MatrixCounts, MatrixEstimator, PATCHES, PATHS_TO_PATCHES};
use crate::sampling::{Key, Stream};
use crate::scene::{Grid, Responses};

/// Number of paths of a sensor for each point of a patch to which it is connected where something may stand between, for the light of
/// patches.
const PATHS_OF_ONE_POINT: u32 = 8;

/// Number of connections of a sensor to an opening that something may hide for each point of a patch, for the light of whole openings.
const CONNECTIONS_OF_ONE_POINT: u32 = SampleCounts::TRIAL.per_opening;

/// Number of the first replicate of a trial: passes of a job are fewer.
const FIRST_TRIED: u64 = 1 << 61;

impl From<SampleCounts> for MatrixCounts {
    fn from(counts: SampleCounts) -> Self {
        let points = counts.per_opening.div_ceil(CONNECTIONS_OF_ONE_POINT);
        Self { paths: counts.per_sensor, beyond: counts.beyond, points }
    }
}

impl<const C: usize> TwoStage<C> {
    /// Builds the estimator of the responses that grids ask for; `None` where none does.
    pub(super) fn responses(
        (task, beside): (&Task, Beside),
        settings: &Settings,
        coarse: Option<&Coarse<C>>,
        (seed, target): (u64, f64),
    ) -> Option<MatrixEstimator<C>> {
        if task.grids.iter().all(|grid| !grid.responses.are_reported()) {
            return None;
        }
        let of_whole = task.grids.iter().any(|grid| grid.responses == Responses::ToTubes);
        let solutions = coarse.filter(|_| of_whole).and_then(|of| TubeSolutions::new(task.traceable, &of.solution));
        let solutions = solutions.map(Arc::new);
        let seed = Key::new(seed);
        let key = seed.stream(Stream::RoomPass, FIRST_TRIED + TRIED_PASSES);
        let spreads = match &solutions {
            Some(solutions) => Coarse::spreads((task, beside), &solutions.all, key),
            None => Vec::new(),
        };
        let built = |grids: &[Grid], counts: &[MatrixCounts]| {
            MatrixEstimator::new(task.traceable, grids, counts, (solutions.clone(), spreads.clone()), seed)
        };
        let some: Vec<Grid> = task.grids.iter().map(|grid| grid.thinned(TRIED_SENSORS)).collect();
        let is_tried = of_whole && settings.samples_per_sensor.is_none();
        let values = is_tried.then(|| {
            let trial = built(&some, &vec![SampleCounts::TRIAL.into(); some.len()]);
            tried(task, &some, &trial, &spreads)
        });
        let of_grid = |(number, grid): (usize, &Grid)| {
            let (whole, paths) = (grid.responses == Responses::ToTubes, settings.samples_per_sensor);
            let variances = values.as_ref().and_then(|all| RelativeVariances::of(all.get(number)?.iter().copied()));
            match (whole, paths) {
                (true, None) => variances.map_or_else(
                    || SampleCounts::usual(target).into(),
                    |variances| SampleCounts::tried(target, variances, grid.valued()).into(),
                ),
                (true, Some(paths)) => SampleCounts::with_paths(paths, target).into(),
                (false, paths) => {
                    let paths = paths.unwrap_or(PATHS_TO_PATCHES);
                    MatrixCounts { paths, beyond: paths, points: paths.div_ceil(PATHS_OF_ONE_POINT) }
                }
            }
        };
        let counts: Vec<MatrixCounts> = task.grids.iter().enumerate().map(of_grid).collect();
        Some(built(task.grids, &counts))
    }
}

/// Computes replicates of the responses of some sensors to all openings together.
fn tried<const C: usize>(
    task: &Task,
    grids: &[Grid],
    trial: &MatrixEstimator<C>,
    spreads: &[ExpectedSpreads],
) -> Vec<Vec<TrialValues>> {
    let tried = |number: usize, sensor: usize| TrialValues {
        expected_spread: spreads.get(number).map_or(f64::INFINITY, ExpectedSpreads::mean),
        // a point is one in each patch
        hidden_sources: trial.seen_in_part(number, sensor) as f64
            * (PATCHES as f64 / f64::from(CONNECTIONS_OF_ONE_POINT)),
        ..TrialValues::default()
    };
    let of_grid = |(number, grid): (usize, &Grid)| (0..grid.len()).map(|sensor| tried(number, sensor)).collect();
    let mut values: Vec<Vec<TrialValues>> = grids.iter().enumerate().map(of_grid).collect();
    for pass in FIRST_TRIED..FIRST_TRIED + TRIED_PASSES {
        let Some(replicate) = trial.replicate(pass, grids.len(), task.cancel) else { break };
        for (values, responses) in values.iter_mut().zip(&replicate.grids) {
            if let Some(to_all) = responses.first().filter(|to_all| !to_all.residual.is_empty()) {
                values.iter_mut().enumerate().for_each(|(sensor, tried)| tried.push(to_all, sensor, 0.0));
            }
        }
    }
    values.iter_mut().for_each(|grid| TrialValues::set_scales(grid, task.least_share_of_mean));
    values
}

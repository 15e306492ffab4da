//! Sample of a job's outputs for a pilot: some sensors of each grid, and some windows of views.

use crate::estimate::error_law::PilotResults;
use crate::estimate::film::BLOCK_PX;
use crate::estimate::grid::{contrasts_of, sampling_variance};
use crate::estimate::spread::Sharing;
use crate::estimate::{FilmEstimate, GridEstimate};
use crate::integrator::Pass;
use crate::integrator::method::Task;
use crate::scene::{Channels, Grid, View};
use crate::statistics::Moments;

/// Number of windows of all views together; each is one block of pixels high.
const WINDOWS: usize = 4;

/// Golden ratio, whose multiples spread windows over the width.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Grids and views for a trial, as a sample of the job's outputs.
pub struct Sample {
    grids: Vec<Grid>,
    windows: Vec<View>,
    /// Number of the view that each window shows.
    views: Vec<usize>,
    /// Number of sensors of the job's grids, or of pixels of its views.
    pub all: usize,
    /// Number of sensors of each of the job's grids that have a value.
    sensors: Vec<usize>,
    channels: Channels,
}

/// Values of passes at the sampled places of one grid, or of one view.
#[derive(Default)]
pub struct Places {
    values: Vec<Vec<f64>>,
    bias: Vec<Vec<f64>>,
    fixed: Vec<f64>,
    residual: Vec<Vec<f64>>,
    sharing: Sharing,
    share: f64,
}

impl Places {
    /// Returns the values in the form from which error laws are derived.
    pub fn found(&self) -> PilotResults<'_> {
        let Self { values, bias, fixed, residual, sharing, share } = self;
        PilotResults { values, bias, fixed, residual, sharing: *sharing, fraction: *share }
    }
}

impl Sample {
    /// Selects about `most` sensors, or pixels, of a task of grids or of views at most; at least one sensor of every grid, or block of
    /// pixels.
    pub fn new(task: &Task, most: usize) -> Self {
        let sensors: usize = task.grids.iter().map(Grid::len).sum();
        let pixels: usize = task.views.iter().map(pixels).sum();
        let per_grid = most / task.grids.len().max(1);
        let grids = task.grids.iter().map(|grid| if sensors <= most { grid.clone() } else { some_of(grid, per_grid) });
        let mut windows = Vec::new();
        for (number, view) in task.views.iter().enumerate() {
            if pixels <= most {
                windows.push((number, view.clone()));
                continue;
            }
            // WINDOWS for all views together, but at least one for each view, and otherwise no more than `most` pixels hold
            let width = (most / WINDOWS / BLOCK_PX).div_ceil(BLOCK_PX) * BLOCK_PX;
            let of_view = (WINDOWS / task.views.len()).max(1).min((most / (width * BLOCK_PX)).max(1));
            windows.extend((0..of_view).map(|window| (number, window_of(view, width, window, of_view))));
        }
        let (views, windows) = windows.into_iter().unzip();
        let valued = task.grids.iter().map(Grid::valued).collect();
        let (all, channels) = (sensors + pixels, task.scene.channels);
        Self { grids: grids.collect(), windows, views, all, sensors: valued, channels }
    }

    /// Restricts a task to the places of this sample.
    pub fn task<'a>(&'a self, task: &Task<'a>) -> Task<'a> {
        Task { grids: &self.grids, views: &self.windows, ..*task }
    }

    /// Returns the number of sensors, or pixels, of the sample.
    pub fn places(&self) -> usize {
        self.grids.iter().map(Grid::len).sum::<usize>() + self.windows.iter().map(pixels).sum::<usize>()
    }

    /// Returns the values of passes that follow `start`, for every grid, or for every view that a window shows.
    pub fn values(&self, start: &Pass, passes: &[Pass]) -> Vec<Places> {
        let share = self.places() as f64 / self.all as f64;
        let of_grid = |number: usize| {
            let of_passes = || passes.iter().filter_map(move |pass| pass.grids.get(number));
            let mut estimate = GridEstimate::of(&self.grids[number]);
            of_passes().for_each(|pass| estimate.push(pass));
            let sensors = estimate.sensors.len();
            let fixed = |sensor: usize| sampling_variance(contrasts_of(&estimate.contrasts, sensors, sensor));
            let fixed = if estimate.contrasts.is_empty() { Vec::new() } else { estimate.valued().map(fixed).collect() };
            let of_valued = |values: &[f64], free: &[f64]| -> Vec<f64> {
                let valued = estimate.valued().filter(|sensor| *sensor < values.len());
                valued.map(|sensor| values[sensor] / free.get(sensor).unwrap_or(&1.0)).collect()
            };
            let free = estimate.free.as_deref().unwrap_or_default();
            let residual: Vec<Vec<f64>> = of_passes().map(|pass| of_valued(&pass.residual, free)).collect();
            let mut values: Vec<Vec<f64>> = of_passes().map(|pass| of_valued(&pass.illuminance, free)).collect();
            for (values, residual) in values.iter_mut().zip(&residual) {
                values.iter_mut().zip(residual).for_each(|(value, of)| *value -= of);
            }
            // residuals are expected to differ in proportion to the gathered light
            let spreads = start.grids.get(number).map_or(&[][..], |grid| &grid.expected_spreads);
            let spread = (!spreads.is_empty()).then(|| mean(spreads.iter().copied()));
            let squares = of_passes().flat_map(|pass| {
                let valued = estimate.valued().filter(|sensor| *sensor < pass.gathered.len());
                let lit = valued.filter(|sensor| pass.illuminance[*sensor] > 0.0);
                lit.map(|sensor| (pass.gathered[sensor] / pass.illuminance[sensor]).powi(2))
            });
            let part = mean(squares);
            Places {
                values,
                bias: of_passes().map(|pass| of_valued(&pass.bias, free)).collect(),
                fixed,
                residual,
                sharing: Sharing { sensors: self.sensors[number], expected_spread: spread.map(|spread| spread * part) },
                share,
            }
        };
        let of_view = |view: usize| {
            let mut places = Places { share, ..Places::default() };
            let windows = || (0..self.windows.len()).filter(move |window| self.views[*window] == view);
            let empty = |window: usize| FilmEstimate::empty(self.windows[window].size_px, self.channels.count());
            for pass in passes {
                let (mut values, mut bias) = (Vec::new(), Vec::new());
                for window in windows() {
                    let Some(seen) = pass.views.get(window) else { continue };
                    let mut film = empty(window);
                    film.push(seen);
                    values.extend(film.blocks.iter().map(|block| block.mean));
                    if !seen.bias.is_empty() {
                        bias.extend(film.block_bias.iter().map(|block| block.mean));
                    }
                }
                places.values.push(values);
                places.bias.push(bias);
            }
            for window in windows() {
                let mut film = empty(window);
                passes.iter().filter_map(|pass| pass.views.get(window)).for_each(|seen| film.push(seen));
                if !film.contrasts.is_empty() {
                    places.fixed.extend((0..film.blocks.len()).map(|block| film.block_sampling_variance(block)));
                }
            }
            places
        };
        let mut views = self.views.clone();
        views.dedup();
        (0..self.grids.len()).map(of_grid).chain(views.into_iter().map(of_view)).collect()
    }
}

/// Returns the mean of some values, 0 of none.
fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let mut moments = Moments::default();
    values.for_each(|value| moments.push(value));
    moments.mean
}

/// Selects about `most` sensors of a grid at most, or as few more as it takes to include one that has a value.
fn some_of(grid: &Grid, most: usize) -> Grid {
    let mut most = most.max(1);
    loop {
        let some = grid.thinned(most);
        if some.valued() > 0 || some.len() == grid.len() {
            return some;
        }
        most *= 4;
    }
}

/// Returns window `number` of `count` of a view: at blocks of the whole, spread over height and width.
fn window_of(view: &View, width: usize, number: usize, count: usize) -> View {
    let size_px = [width.min(view.size_px[0]), BLOCK_PX.min(view.size_px[1])];
    let at = [(GOLDEN * (number + 1) as f64).fract(), (number as f64 + 0.5) / count as f64];
    let first = [0, 1].map(|axis| {
        let free = view.size_px[axis] - size_px[axis];
        (at[axis] * free as f64 / BLOCK_PX as f64).round() as usize * BLOCK_PX
    });
    let first = [0, 1].map(|axis| first[axis].min(view.size_px[axis] - size_px[axis]));
    view.window(first, size_px)
}

fn pixels(view: &View) -> usize {
    view.size_px[0] * view.size_px[1]
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::document::NoFiles;
    use crate::engine::prepare::prepare;
    use crate::integrator::method::Computation;

    /// Passes of a sample have the sizes of the job's, although many sensors share a residual more than few: the rays that sensors add to a
    /// pass are as many for each, within a tenth by which the lengths of their paths differ. By the numbers of their own sensors they would
    /// differ by 28 %.
    #[test]
    fn samples_have_passes_of_the_jobs_size() {
        let document = include_bytes!("../../tests/reference/scenes/S1.json");
        let prepared = prepare(document, &NoFiles).unwrap();
        let task = Task::whole(&prepared.scene, &prepared.traceable);
        let method = prepared.offered.iter().find(|method| method.name() == "two_stage").unwrap();
        let rays = |most: usize| {
            let sample = Sample::new(&task, most);
            let target = prepared.stop.target(task.grids, task.views);
            let Computation::Passes(integrator) = method.described().build(&sample.task(&task), 7, target) else {
                panic!("{} has passes", method.name());
            };
            let rays = |pass: u64| integrator.pass(pass, &AtomicBool::new(false)).unwrap().totals.rays.followed as f64;
            (sample.places() as f64, (0..16).map(rays).sum::<f64>() / 16.0)
        };
        let [few, some, all] = [4, 16, 81].map(rays);
        let of_each =
            |(fewer, of_fewer): (f64, f64), (more, of_more): (f64, f64)| (of_more - of_fewer) / (more - fewer);
        let ratio = of_each(few, some) / of_each(some, all);
        assert_eq!([few.0, some.0, all.0], [4.0, 16.0, 81.0]);
        assert!((ratio - 1.0).abs() < 0.1, "{few:?} {some:?} {all:?}: {ratio}");
    }
}

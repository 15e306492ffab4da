//! Errors of runs against more accurate references.

use std::path::Path;

use serde_json::Value;

use super::case::Run;
use crate::page::ReportError;
use skyduct::estimate::{FilmEstimate, GridEstimate};

/// Reference illuminances of a grid in lux, each with its standard error.
pub struct Reference {
    lux: Vec<f64>,
    standard_error_lux: Vec<f64>,
}

impl Reference {
    /// Reads a file of `tests/reference/scenes`.
    pub fn read(file: &Path) -> Result<Self, ReportError> {
        let read = super::scenes::read(file)?;
        let numbers = |field: &str| numbers(&read[field]);
        Ok(Self { lux: numbers("illuminance_lux"), standard_error_lux: numbers("standard_error_lux") })
    }

    /// Computes the mean square of the relative error of a grid over its sensors, less the variance of the reference; may be
    /// below zero.
    fn mean_square(&self, grid: &GridEstimate) -> f64 {
        let known = self.lux.iter().zip(&self.standard_error_lux).enumerate();
        let squares = known
            .map(|(sensor, (lux, error))| ((grid.illuminance_lux(sensor) - lux) / lux).powi(2) - (error / lux).powi(2));
        squares.sum::<f64>() / self.lux.len() as f64
    }

    /// Computes the root mean square of the relative error of the first grid, over the sensors and over runs with seeds of
    /// their own; the variance of the reference is subtracted.
    pub fn error(&self, runs: &[Run]) -> f64 {
        let squares: f64 = runs.iter().map(|run| self.mean_square(&run.estimate.grids[0])).sum();
        (squares / runs.len() as f64).max(0.0).sqrt()
    }
}

/// Returns all numbers of nested arrays, in order.
fn numbers(value: &Value) -> Vec<f64> {
    match value {
        Value::Array(values) => values.iter().flat_map(numbers).collect(),
        value => value.as_f64().into_iter().collect(),
    }
}

/// Computes the relative error of a picture against a better one: the root mean square over the pixels with a luminance in
/// `range` (cd/m2), over their mean. The variance of the better one, estimated from its passes, is subtracted.
pub fn pixel_error(film: &FilmEstimate, better: &FilmEstimate, range: std::ops::Range<f64>) -> f64 {
    let passes = better.passes;
    let pixels = (0..better.m2.len()).filter(|pixel| range.contains(&better.luminance_cd_m2(*pixel)));
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for pixel in pixels {
        let truth = better.luminance_cd_m2(pixel);
        squares += (film.luminance_cd_m2(pixel) - truth).powi(2) - better.m2[pixel] / (passes - 1.0) / passes;
        sum += truth;
        count += 1.0;
    }
    (squares / count).max(0.0).sqrt() / (sum / count)
}

/// Computes the relative error of a picture against a better one as [`pixel_error`] does, but over blocks of pixels and
/// relative to each block: the measure by which jobs with views end.
pub fn block_error(film: &FilmEstimate, better: &FilmEstimate) -> f64 {
    let mean = better.blocks.iter().map(|block| block.mean).sum::<f64>() / better.blocks.len() as f64;
    let squares = film.blocks.iter().zip(&better.blocks).map(|(block, truth)| {
        let scale = truth.mean.max(0.01 * mean);
        ((block.mean - truth.mean).powi(2) - truth.standard_error().powi(2)) / (scale * scale)
    });
    (squares.sum::<f64>() / better.blocks.len() as f64).max(0.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use skyduct::estimate::Estimate;
    use skyduct::integrator::{GridPass, ViewPass};

    fn run(lux: &[f64]) -> Run {
        let mut grid = GridEstimate::empty(lux.len());
        grid.push(&GridPass { illuminance: lux.to_vec(), ..GridPass::default() });
        let estimate = Estimate { grids: vec![grid], ..Estimate::default() };
        Run { set_up: 0.0, passes: 0.0, estimate, told: 0.0, met: true }
    }

    #[test]
    fn errors_are_relative_to_each_sensor_and_less_those_of_the_reference() {
        let exact = Reference { lux: vec![10.0, 100.0], standard_error_lux: vec![0.0, 0.0] };
        assert!((exact.error(&[run(&[11.0, 90.0])]) - 0.1).abs() < 1e-12);
        assert!((exact.error(&[run(&[11.0, 90.0]), run(&[10.0, 100.0])]) - 0.1 / 2f64.sqrt()).abs() < 1e-12);
        let rough = Reference { standard_error_lux: vec![1.0, 10.0], ..exact };
        assert!(rough.error(&[run(&[11.0, 90.0])]) < 1e-7);
        assert!((rough.error(&[run(&[12.0, 120.0])]) - 0.03f64.sqrt()).abs() < 1e-12);
    }

    #[test]
    fn pictures_are_compared_where_their_luminance_lies_in_the_range() {
        let film = |passes: &[[f64; 2]]| {
            let mut film = FilmEstimate::empty([2, 1], 1);
            passes
                .iter()
                .for_each(|luminance| film.push(&ViewPass { luminance: luminance.to_vec(), ..ViewPass::default() }));
            film
        };
        let better = film(&[[1.0, 50.0], [1.0, 50.0]]);
        assert!((pixel_error(&film(&[[1.2, 0.0]]), &better, 0.5..5.0) - 0.2).abs() < 1e-12);
        assert!((block_error(&film(&[[1.0, 101.0]]), &better) - 1.0).abs() < 1e-12);
        // two passes 0.9 and 1.1 have a standard error of 0.1
        let noisy = film(&[[0.9, 50.0], [1.1, 50.0]]);
        assert!((pixel_error(&film(&[[1.2, 0.0]]), &noisy, 0.5..5.0) - 0.03f64.sqrt()).abs() < 1e-9);
    }
}

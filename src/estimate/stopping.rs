//! When a job is accurate enough.

use super::{Estimate, FilmEstimate, GridEstimate};
use crate::statistics::interval::two_sided_normal_quantile;

/// The document's `stop`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StopRule {
    /// Largest relative error of the grids at `confidence`, > 0.
    pub relative_error: f64,
    /// Largest relative error of the views at `confidence`, > 0, over blocks of pixels.
    pub view_relative_error: f64,
    /// Confidence of the errors, 0..1.
    pub confidence: f64,
    /// Passes after which the job ends in any case.
    pub max_passes: u64,
    /// Seconds of rendering after which the job ends in any case.
    pub max_seconds: f64,
}

/// Achieved relative errors at the asked confidence; `None` where the job has no such output, or nothing is known of its
/// error: before the second pass, or by a formula.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accuracy {
    /// Relative error of the worst grid.
    pub grids: Option<f64>,
    /// Relative error of the worst view.
    pub views: Option<f64>,
}

/// Passes below which the standard error of a grid is too uncertain to stop by: with 32, its own error is 13 %.
pub const LEAST_PASSES: u64 = 32;

/// Passes below which a view is not judged; few are enough, because its accuracy is judged over thousands of blocks.
pub const LEAST_VIEW_PASSES: u64 = 8;

/// Values below this share of the mean are judged as if they were as large.
const LEAST_SHARE_OF_MEAN: f64 = 0.01;

impl StopRule {
    /// Root mean square over sensors of z se / max(E, 0.01 mean E), the worst grid and the worst view.
    pub fn accuracy(&self, estimate: &Estimate) -> Accuracy {
        let z = two_sided_normal_quantile(self.confidence);
        // one pass tells no error, one solution does
        let known = |error: &f64| estimate.passes >= 2 || error.is_finite();
        let worst =
            |errors: &mut dyn Iterator<Item = f64>| errors.reduce(f64::max).filter(known).map(|error| z * error);
        Accuracy {
            grids: worst(&mut estimate.grids.iter().map(grid_error)),
            views: worst(&mut estimate.views.iter().map(film_error)),
        }
    }

    /// True if every output is as accurate as asked.
    pub fn accurate_enough(&self, estimate: &Estimate) -> bool {
        let accuracy = self.accuracy(estimate);
        let least = if estimate.grids.is_empty() { LEAST_VIEW_PASSES } else { LEAST_PASSES };
        estimate.passes >= least
            && accuracy.grids.is_none_or(|error| error <= self.relative_error)
            && accuracy.views.is_none_or(|error| error <= self.view_relative_error)
    }
}

fn grid_error(grid: &GridEstimate) -> f64 {
    let sensors = 0..grid.sensors.len();
    relative_error(sensors.map(|sensor| (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor))).collect())
}

fn film_error(film: &FilmEstimate) -> f64 {
    let blocks = 0..film.blocks.len();
    relative_error(blocks.map(|block| (film.blocks[block].mean, film.block_standard_error_cd_m2(block))).collect())
}

/// Root mean square of se / max(value, 0.01 mean); zero when nothing is lit.
fn relative_error(values: Vec<(f64, f64)>) -> f64 {
    let mean = values.iter().map(|(value, _)| value).sum::<f64>() / values.len() as f64;
    let squares = values.iter().map(|(value, error)| {
        let scale = value.max(LEAST_SHARE_OF_MEAN * mean);
        if *error == 0.0 { 0.0 } else { (error / scale).powi(2) }
    });
    (squares.sum::<f64>() / values.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::Moments;

    fn rule() -> StopRule {
        StopRule { relative_error: 0.02, view_relative_error: 0.05, confidence: 0.95, max_passes: 10, max_seconds: 1.0 }
    }

    fn estimate(sensors: &[(f64, f64)], passes: u64) -> Estimate {
        let n = passes as f64;
        let moments = |(mean, se): &(f64, f64)| Moments { count: n, mean: *mean, m2: se * se * n * (n - 1.0) };
        let sensors: Vec<_> = sensors.iter().map(moments).collect();
        let bias = vec![Moments::default(); sensors.len()];
        let grid = GridEstimate { bias, sensors, ..GridEstimate::default() };
        Estimate { passes, grids: vec![grid], ..Estimate::default() }
    }

    #[test]
    fn formula_of_the_contract() {
        let accuracy = rule().accuracy(&estimate(&[(100.0, 1.0), (50.0, 1.0)], 16));
        let expected = 1.959964 * ((0.01f64.powi(2) + 0.02f64.powi(2)) / 2.0).sqrt();
        assert!((accuracy.grids.unwrap() - expected).abs() < 1e-6);
        // a dark sensor is judged against a hundredth of the mean
        let accuracy = rule().accuracy(&estimate(&[(100.0, 0.0), (0.0, 0.01)], 16));
        assert!((accuracy.grids.unwrap() - 1.959964 * (0.02f64.powi(2) / 2.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn nothing_lit_is_accurate_and_few_passes_are_not() {
        assert!(rule().accurate_enough(&estimate(&[(0.0, 0.0), (0.0, 0.0)], LEAST_PASSES)));
        assert!(!rule().accurate_enough(&estimate(&[(1.0, 0.0)], LEAST_PASSES - 1)));
        assert_eq!(rule().accuracy(&estimate(&[(1.0, 0.0)], 1)).grids, None);
    }
}

//! When a job is accurate enough.

use super::{Estimate, FilmEstimate, GridEstimate};
use crate::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};

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

/// The outputs that are less accurate than asked, and wanted in further passes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// True for the grids.
    pub grids: bool,
    /// True for the views.
    pub views: bool,
}

impl Wanted {
    /// Grids and views.
    pub const ALL: Self = Self { grids: true, views: true };

    /// True if another pass is wanted.
    pub fn any(self) -> bool {
        self.grids || self.views
    }

    /// What is still wanted after a later judgement: what was accurate enough once is not computed again.
    pub fn still(self, later: Self) -> Self {
        Self { grids: self.grids && later.grids, views: self.views && later.views }
    }
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

/// Passes below which no output is judged.
pub const LEAST_PASSES: u64 = 8;

/// Values that, times passes, make the root mean square of their standard errors certain to about 13 %: 32 passes of one.
const VALUES_TIMES_PASSES: u64 = 64;

/// Passes after which even one value is judged.
const ENOUGH_PASSES: u64 = 32;

/// Passes below which the accuracy of an output of `values` sensors or blocks is too uncertain to stop by: 8 from eight values on, 16
/// from four on, 32 for a single one. Measured at 8, 16 and 32 passes, the error of the claimed error is 27, 18, 13 % for one value,
/// 17, 12, 8 % for four, and 7, 4, 3 % for 81.
///
/// ```
/// use skyduct::estimate::stopping::least_passes;
///
/// assert_eq!([1, 2, 4, 8, 81].map(least_passes), [32, 32, 16, 8, 8]);
/// ```
pub fn least_passes(values: usize) -> u64 {
    VALUES_TIMES_PASSES.div_ceil(values.max(1) as u64).clamp(LEAST_PASSES, ENOUGH_PASSES)
}

/// True if a job that may end early asks itself after `passes` passes whether it is accurate enough: at 8, and then whenever a quarter
/// is added, so that it never does much more than it must.
///
/// ```
/// use skyduct::estimate::stopping::is_judged_after;
///
/// let judged: Vec<u64> = (0..40).filter(|passes| is_judged_after(*passes)).collect();
/// assert_eq!(judged, [8, 10, 12, 15, 18, 22, 27, 33]);
/// ```
pub fn is_judged_after(passes: u64) -> bool {
    let mut judged = LEAST_PASSES;
    while judged < passes {
        judged += judged / 4;
    }
    judged == passes
}

/// Values below this share of the mean are judged as if they were as large.
const LEAST_SHARE_OF_MEAN: f64 = 0.01;

impl StopRule {
    /// Root mean square over sensors of t se / max(E, 0.01 mean E), the worst grid and the worst view; t is Student's quantile for
    /// the passes that computed it, and that of the normal distribution for a solution.
    pub fn accuracy(&self, estimate: &Estimate) -> Accuracy {
        let t = |passes: u64| match passes {
            0 | 1 => two_sided_normal_quantile(self.confidence),
            passes => two_sided_student_quantile(self.confidence, passes as f64 - 1.0),
        };
        // one pass tells no error, one solution does
        let known = |error: &f64| estimate.passes >= 2 || error.is_finite();
        let worst = |passes: u64, errors: &mut dyn Iterator<Item = f64>| {
            errors.reduce(f64::max).filter(known).map(|error| t(passes) * error)
        };
        Accuracy {
            grids: worst(estimate.passes_of_grids(), &mut estimate.grids.iter().map(grid_error)),
            views: worst(estimate.passes_of_views(), &mut estimate.views.iter().map(film_error)),
        }
    }

    /// The outputs that are less accurate than asked, or whose accuracy is too uncertain after so few passes.
    pub fn wanted(&self, estimate: &Estimate) -> Wanted {
        let accuracy = self.accuracy(estimate);
        let least = |values: &mut dyn Iterator<Item = usize>| values.map(least_passes).max();
        let wanted = |least: Option<u64>, passes: u64, error: Option<f64>, limit: f64| {
            least.is_some_and(|least| passes < least || error.is_some_and(|error| error > limit))
        };
        let of_grids = least(&mut estimate.grids.iter().map(|grid| grid.sensors.len()));
        let of_views = least(&mut estimate.views.iter().map(|view| view.blocks.len()));
        Wanted {
            grids: wanted(of_grids, estimate.passes_of_grids(), accuracy.grids, self.relative_error),
            views: wanted(of_views, estimate.passes_of_views(), accuracy.views, self.view_relative_error),
        }
    }

    /// True if every output is as accurate as asked.
    pub fn accurate_enough(&self, estimate: &Estimate) -> bool {
        !self.wanted(estimate).any()
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
        // Student's quantile for 15 degrees of freedom
        let expected = 2.131450 * ((0.01f64.powi(2) + 0.02f64.powi(2)) / 2.0).sqrt();
        assert!((accuracy.grids.unwrap() - expected).abs() < 1e-6);
        // a dark sensor is judged against a hundredth of the mean
        let accuracy = rule().accuracy(&estimate(&[(100.0, 0.0), (0.0, 0.01)], 16));
        assert!((accuracy.grids.unwrap() - 2.131450 * (0.02f64.powi(2) / 2.0).sqrt()).abs() < 1e-6);
    }

    #[test]
    fn nothing_lit_is_accurate_and_few_passes_are_not() {
        assert!(rule().accurate_enough(&estimate(&[(0.0, 0.0), (0.0, 0.0)], ENOUGH_PASSES)));
        assert!(!rule().accurate_enough(&estimate(&[(1.0, 0.0)], ENOUGH_PASSES - 1)));
        assert_eq!(rule().accuracy(&estimate(&[(1.0, 0.0)], 1)).grids, None);
    }
}

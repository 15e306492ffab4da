//! Stopping rule: the accuracy at which a job ends.

use super::film::block_count;
use super::{Estimate, FilmEstimate, GridEstimate};
use crate::integrator::pass::LEAST_SHARE_OF_MEAN;
use crate::scene::{Grid, View};
use crate::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};

/// Value of the document's `stop`.
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

/// Outputs that are less accurate than requested, so that further passes must compute them.
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

    /// True if another pass is needed.
    pub fn any(self) -> bool {
        self.grids || self.views
    }

    /// Returns the outputs that are still wanted after a later judgement: an output that was accurate enough once is not computed again.
    pub fn still(self, later: Self) -> Self {
        Self { grids: self.grids && later.grids, views: self.views && later.views }
    }
}

/// Achieved relative errors at the requested confidence; `None` if the job has no such output, or if its error is unknown: before the
/// second pass, for a formula, or where many passes have brought no light.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Accuracy {
    /// Relative error of the worst grid.
    pub grids: Option<f64>,
    /// Degrees of freedom of the worst grid's standard errors ([`GridEstimate::degrees_of_freedom`]).
    pub degrees_of_grids: Option<f64>,
    /// Relative error of the worst view.
    pub views: Option<f64>,
}

/// Number of passes below which no output is judged: that of outputs with many values.
pub const LEAST_PASSES: u64 = 5;

/// Number of values from which on an output has many: their errors are certain after few passes.
const MANY_VALUES: usize = 1000;

/// Number of passes below which no output with fewer values is judged, and about which passes are sized to reach the requested accuracy.
pub const USUAL_PASSES: u64 = 8;

/// Number of values times passes at which the root mean square of their standard errors is certain to about 13 %: for 32 passes of a single
/// value.
const VALUES_TIMES_PASSES: u64 = 64;

/// Number of passes from which on even a single value is judged.
const ENOUGH_PASSES: u64 = 32;

/// Number of passes after which the job no longer waits for light in a dark grid: a value of zero never reaches a relative error.
const PASSES_WITHOUT_LIGHT: u64 = 64;

/// Returns the number of passes below which the accuracy of an output of `values` sensors or blocks is too uncertain to stop by: 5 from
/// 1000 values on, 8 from eight on, 16 from four on, 32 for a single one. Measured at 8, 16 and 32 passes, the relative error of the
/// estimated error is 27, 18, 13 % for one value, 17, 12, 8 % for four, and 7, 4, 3 % for 81.
///
/// ```
/// use skyduct_physics::estimate::stopping::least_passes;
///
/// assert_eq!([1, 2, 4, 8, 81, 2400].map(least_passes), [32, 32, 16, 8, 8, 5]);
/// ```
pub fn least_passes(values: usize) -> u64 {
    if values >= MANY_VALUES {
        return LEAST_PASSES;
    }
    VALUES_TIMES_PASSES.div_ceil(values.max(1) as u64).clamp(USUAL_PASSES, ENOUGH_PASSES)
}

/// Returns the number of passes below which the error of some grids is not trusted; `None` without grids.
pub fn least_passes_of_grids(grids: &[Grid]) -> Option<u64> {
    grids.iter().map(|grid| least_passes(grid.valued())).max()
}

/// Returns the number of passes below which the error of some views is not trusted; `None` without views.
pub fn least_passes_of_views(views: &[View]) -> Option<u64> {
    views.iter().map(|view| least_passes(block_count(view.size_px))).max()
}

/// True if a job that may end early checks after this number of passes whether it is accurate enough: after 5, and then after each increase
/// by an eighth, or one, so that it never computes much more than needed.
///
/// ```
/// use skyduct_physics::estimate::stopping::is_judged;
///
/// let judged = (0..40).filter(|passes| is_judged(*passes)).collect::<Vec<u64>>();
/// assert_eq!(judged, [5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16, 18, 20, 22, 24, 27, 30, 33, 37]);
/// ```
pub fn is_judged(passes: u64) -> bool {
    next_judgement(passes) == passes
}

/// Returns the smallest number of passes, `passes` or more, after which a job checks its accuracy.
///
/// ```
/// use skyduct_physics::estimate::stopping::next_judgement;
///
/// assert_eq!([1, 8, 9, 28].map(next_judgement), [5, 8, 9, 30]);
/// ```
pub fn next_judgement(passes: u64) -> u64 {
    let mut judged = LEAST_PASSES;
    while judged < passes {
        judged += (judged / 8).max(1);
    }
    judged
}

/// Reason why a job continues after a pass that was not its last.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaitingFor {
    /// An output has too few passes for its error to be trusted ([`least_passes`]); no error is above its limit.
    LeastPasses,
    /// The grids are less accurate than requested, and farther from their limit than the views.
    RelativeError,
    /// The views are less accurate than requested, and farther from their limit than the grids.
    ViewRelativeError,
    /// All limits hold; the job ends at its next check ([`is_judged`]) if they still do.
    NextJudgement,
}

impl StopRule {
    /// Returns the relative standard error for which methods size the passes of these outputs.
    pub fn target(&self, grids: &[Grid], views: &[View]) -> f64 {
        self.target_of(self.relative_error, grids, views)
    }

    /// Returns the target of passes as [`Self::target`] does, for another relative error: this over the normal quantile is reached by about
    /// eight passes; outputs of few values have more passes in any case ([`least_passes`]), each of them as much smaller.
    pub fn target_of(&self, relative_error: f64, grids: &[Grid], views: &[View]) -> f64 {
        let least = least_passes_of_grids(grids).max(least_passes_of_views(views)).unwrap_or(USUAL_PASSES);
        let fewer = least.max(USUAL_PASSES) as f64 / USUAL_PASSES as f64;
        relative_error / two_sided_normal_quantile(self.confidence) * fewer.sqrt()
    }

    /// Returns the root mean square over sensors of t se / max(E, 0.01 mean E), for the worst grid and the worst view; t is Student's
    /// quantile for the degrees of freedom of the standard errors, and that of the normal distribution for a solution.
    pub fn accuracy(&self, estimate: &Estimate) -> Accuracy {
        let t = |passes: u64, degrees: f64| match passes {
            0 | 1 => two_sided_normal_quantile(self.confidence),
            _ => two_sided_student_quantile(self.confidence, degrees),
        };
        // a single pass has no error, a single solution has one
        let known = |error: &f64| estimate.passes >= 2 || error.is_finite();
        let passes = estimate.passes_of_grids();
        let lit = estimate.grids.iter().filter(|grid| !found_nothing(grid, passes));
        let of_grids = lit.map(|grid| (grid_error(grid), grid.degrees_of_freedom())).filter(|(error, _)| known(error));
        let of_grids = of_grids.map(|(error, degrees)| (t(passes, degrees) * error, degrees));
        let worst = of_grids.max_by(|one, other| one.0.total_cmp(&other.0));
        let passes = estimate.passes_of_views();
        let of_views = estimate.views.iter().map(film_error).filter(known);
        Accuracy {
            grids: worst.map(|(error, _)| error),
            degrees_of_grids: worst.map(|(_, degrees)| degrees).filter(|degrees| *degrees > 0.0),
            views: of_views.map(|error| t(passes, passes as f64 - 1.0) * error).reduce(f64::max),
        }
    }

    /// Returns the outputs that are less accurate than requested, or whose accuracy is too uncertain after so few passes.
    pub fn wanted(&self, estimate: &Estimate) -> Wanted {
        self.wanted_at(estimate, self.accuracy(estimate))
    }

    /// Returns what [`Self::wanted`] does, for an estimate whose accuracy is already computed.
    fn wanted_at(&self, estimate: &Estimate, accuracy: Accuracy) -> Wanted {
        let wanted = |least: Option<u64>, passes: u64, error: Option<f64>, limit: f64| {
            least.is_some_and(|least| passes < least || error.is_some_and(|error| error > limit))
        };
        let of_grids = estimate.grids.iter().map(least_passes_of).max();
        let of_views = estimate.views.iter().map(|view| least_passes(view.blocks.len())).max();
        Wanted {
            grids: wanted(of_grids, estimate.passes_of_grids(), accuracy.grids, self.relative_error),
            views: wanted(of_views, estimate.passes_of_views(), accuracy.views, self.view_relative_error),
        }
    }

    /// Returns the reason why a job continues after the passes of an estimate of this accuracy; `None` if the job ends by this rule. If
    /// both grids and views are less accurate than requested, the output that is farther from its limit counts.
    pub fn waiting_for(&self, estimate: &Estimate, accuracy: Accuracy) -> Option<WaitingFor> {
        let excess = |error: Option<f64>, limit: f64| error.map_or(0.0, |error| error / limit);
        let grids = excess(accuracy.grids, self.relative_error);
        let views = excess(accuracy.views, self.view_relative_error);
        if grids.max(views) > 1.0 {
            Some(if grids >= views { WaitingFor::RelativeError } else { WaitingFor::ViewRelativeError })
        } else if self.wanted_at(estimate, accuracy).any() {
            Some(WaitingFor::LeastPasses)
        } else {
            (!is_judged(estimate.passes)).then_some(WaitingFor::NextJudgement)
        }
    }

    /// True if every output is as accurate as requested.
    pub fn accurate_enough(&self, estimate: &Estimate) -> bool {
        !self.wanted(estimate).any()
    }
}

/// Returns the number of the first grid that is still dark after all passes that a job waits for light; `None` if there is none.
pub fn grid_without_light(estimate: &Estimate) -> Option<usize> {
    let passes = estimate.passes_of_grids();
    estimate.grids.iter().position(|grid| found_nothing(grid, passes))
}

/// Returns the number of passes below which a grid is not judged; it is larger for a dark grid, because passes that find no light agree to
/// the last digit, whatever light they miss.
fn least_passes_of(grid: &GridEstimate) -> u64 {
    if grid.is_dark() { PASSES_WITHOUT_LIGHT } else { least_passes(grid.valued().count()) }
}

fn found_nothing(grid: &GridEstimate, passes: u64) -> bool {
    passes >= PASSES_WITHOUT_LIGHT && !grid.numerical && grid.is_dark()
}

/// Returns the relative standard error of a grid as in [`Accuracy`]: root mean square over the sensors; that of its judged companion, if
/// it has one, where this is larger.
pub fn grid_error(grid: &GridEstimate) -> f64 {
    let sensors = grid.valued().map(|sensor| (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor)));
    let of_companion = grid.companions.first().filter(|_| grid.judges_companion).map_or(0.0, grid_error);
    relative_error(sensors.collect()).max(of_companion)
}

fn film_error(film: &FilmEstimate) -> f64 {
    let blocks = 0..film.blocks.len();
    relative_error(blocks.map(|block| (film.blocks[block].mean, film.block_standard_error_cd_m2(block))).collect())
}

/// Returns the root mean square of se / max(value, 0.01 mean); zero if nothing is lit.
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
    use crate::integrator::PhotonCount;
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
    fn a_job_waits_for_its_passes_its_errors_and_its_next_look() {
        let waits = |sensors: &[(f64, f64)], passes: u64| {
            let estimate = estimate(sensors, passes);
            rule().waiting_for(&estimate, rule().accuracy(&estimate))
        };
        let (good, bad) = ([(1.0, 1e-4); 8], [(1.0, 0.1); 8]);
        assert_eq!([1, 2, 7].map(|passes| waits(&good, passes)), [Some(WaitingFor::LeastPasses); 3]);
        assert_eq!([2, 8, 9].map(|passes| waits(&bad, passes)), [Some(WaitingFor::RelativeError); 3]);
        let after = [16, 17, 18].map(|passes| waits(&good, passes));
        assert_eq!(after, [None, Some(WaitingFor::NextJudgement), None]);
        // if both are above, the one that is farther from its limit
        let few = estimate(&good, 8);
        let waits = |grids, views| {
            rule().waiting_for(&few, Accuracy { grids: Some(grids), views: Some(views), ..Accuracy::default() })
        };
        assert_eq!(waits(0.04, 0.07), Some(WaitingFor::RelativeError));
        assert_eq!(waits(0.03, 0.10), Some(WaitingFor::ViewRelativeError));
        assert_eq!(waits(0.02, 0.06), Some(WaitingFor::ViewRelativeError));
    }

    /// Passes that found no photon may have missed some: the error is never small enough, and the job does not wait for it for ever.
    #[test]
    fn a_grid_without_light_is_given_up() {
        let of = |passes: u64| {
            let mut dark = estimate(&[(0.0, 0.0), (0.0, 0.0)], passes);
            dark.grids[0].photons = vec![PhotonCount { found: 0.0, one_lux: passes as f64, brightest_lux: 0.0 }; 2];
            dark.grids[0].mean.count = passes as f64;
            dark
        };
        assert_eq!(rule().wanted(&of(PASSES_WITHOUT_LIGHT - 1)), Wanted { grids: true, views: false });
        assert_eq!(grid_without_light(&of(PASSES_WITHOUT_LIGHT - 1)), None);
        let enough = of(PASSES_WITHOUT_LIGHT);
        assert!(rule().accurate_enough(&enough) && rule().accuracy(&enough).grids.is_none());
        assert_eq!(grid_without_light(&enough), Some(0));
        // beside a grid with light that is less accurate than asked
        let mut both = of(PASSES_WITHOUT_LIGHT);
        both.grids.extend(estimate(&[(1.0, 0.1); 8], PASSES_WITHOUT_LIGHT).grids);
        assert!(rule().wanted(&both).grids);
    }

    #[test]
    fn nothing_lit_is_accurate_and_few_passes_are_not() {
        assert!(rule().accurate_enough(&estimate(&[(0.0, 0.0), (0.0, 0.0)], ENOUGH_PASSES)));
        assert!(!rule().accurate_enough(&estimate(&[(1.0, 0.0)], ENOUGH_PASSES - 1)));
        assert_eq!(rule().accuracy(&estimate(&[(1.0, 0.0)], 1)).grids, None);
    }
}

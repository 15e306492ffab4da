//! Forecasts from the passes so far: when each output is as accurate as requested, and what the job waits for.
//!
//! Errors fall by the law of `statistics/power_law.rs`, here against the number of passes; seconds of a pass are those of the last half of
//! the passes, since passes get faster when an output that is as accurate as requested is not computed any further. A few passes are
//! extrapolated with an exponent of about -1/2, and more of them with their own. A forecast costs the same after any number of passes.
//! Events, `convergence.json`, its figure and the web page all show these forecasts.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::engine::convergence::ACCURACIES;
use crate::engine::prepare::RenderJob;
use crate::engine::progress::PassReport;
use crate::estimate::StopRule;
use crate::estimate::stopping::{self, LEAST_PASSES, next_judgement};
use crate::figure::convergence::{Course, CoursePoint};
use crate::statistics::interval::{student_quantile_near, two_sided_normal_quantile, two_sided_student_quantile};
use crate::statistics::power_law::{ErrorPoint, ErrorSteps, PowerLaw, TimePrediction, WIDEST};

/// Forecast after a pass.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(default)]
pub struct Forecast {
    /// Render seconds until the job ends: by its accuracies, as far as errors and passes continue as before, or by its limits. Null while
    /// no error is known.
    pub seconds_left: Option<f64>,
    /// Condition that the job waits for; null after its last pass.
    pub waiting_for: Option<WaitingFor>,
    /// Forecast for the grids; null without any.
    pub grids: Option<OutputForecast>,
    /// Forecast for the views; null without any.
    pub views: Option<OutputForecast>,
}

/// Forecast of the errors of grids, or of views.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OutputForecast {
    /// Exponent of the power law of the errors against the number of passes, -1/2 for independent ones; null with fewer than four passes
    /// that reported an error.
    pub exponent: Option<f64>,
    /// Render seconds until the requested accuracy is reached, with as many passes as an error takes to be trusted; 0 where it is reached;
    /// null where unknown.
    pub seconds_left: Option<f64>,
    /// Times to relative errors of 5, 2, 1, 0.5 and 0.1 percent.
    pub seconds_to: Vec<SecondsTo>,
}

/// Time at which a relative error is reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct SecondsTo {
    /// Relative error at the requested confidence.
    pub relative_error: f64,
    /// Render seconds of the whole job at which the errors reach it; null where they have reached it already, or where unknown.
    pub seconds: Option<f64>,
}

/// Confidence of intervals around exponents, times and courses.
pub const CONFIDENCE: f64 = 0.95;

/// Outputs whose errors are reported together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outputs {
    /// All grids of a job.
    Grids,
    /// All views of a job.
    Views,
}

impl Outputs {
    /// Returns the degrees of freedom of the error that a pass after the first one reports for these outputs.
    pub fn degrees_of_freedom(self, pass: &PassReport) -> f64 {
        let of_passes = pass.passes as f64 - 1.0;
        match self {
            Self::Grids => pass.degrees_of_freedom.unwrap_or(of_passes),
            Self::Views => of_passes,
        }
    }
}

/// Number of points of an extrapolated course of errors.
const COURSE_POINTS: u32 = 40;

/// Condition that a job waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum WaitingFor {
    /// No error is above its limit, but after so few passes they cannot be trusted: grids and views are judged from the 8th pass on, those
    /// of 1000 sensors or blocks from the 5th, those of few later, a single one from the 32nd.
    LeastPasses,
    /// The grids are less accurate than requested, by a larger factor than the views.
    RelativeError,
    /// The views are less accurate than requested, by a larger factor than the grids.
    ViewRelativeError,
    /// All limits hold: the job ends when they are checked next, if they still do. They are checked after 5 passes and then whenever about
    /// an eighth is added.
    NextJudgement,
}

impl From<stopping::WaitingFor> for WaitingFor {
    fn from(waiting: stopping::WaitingFor) -> Self {
        match waiting {
            stopping::WaitingFor::LeastPasses => Self::LeastPasses,
            stopping::WaitingFor::RelativeError => Self::RelativeError,
            stopping::WaitingFor::ViewRelativeError => Self::ViewRelativeError,
            stopping::WaitingFor::NextJudgement => Self::NextJudgement,
        }
    }
}

/// Passes of a job so far, as far as forecasts need them.
#[derive(Clone, Debug)]
pub struct Forecaster {
    stop: StopRule,
    /// Quantile of the normal distribution for the confidence of the errors.
    normal: f64,
    grids: Option<Output>,
    views: Option<Output>,
    /// Passes and seconds of the reported passes, which are few.
    told: Vec<(u64, f64)>,
    /// Index in `told` of the pass from which on the same outputs are computed.
    same_since: usize,
}

/// State of the grids, or of the views.
#[derive(Clone, Debug)]
struct Output {
    asked: f64,
    /// Number of passes below which their error is not trusted.
    least: u64,
    /// Error that the last pass reported.
    error: Option<f64>,
    /// Degrees of freedom of that error for each pass beyond the first.
    freedom: f64,
    /// True if they are as accurate as requested and not computed any further.
    ended: bool,
    steps: ErrorSteps,
}

impl Output {
    fn new(asked: f64, least: u64) -> Self {
        Self { asked, least, error: None, freedom: 1.0, ended: false, steps: ErrorSteps::default() }
    }
}

impl Forecaster {
    /// Makes a forecaster for a job that ends by a rule, before its first pass. `grids` and `views`: numbers of passes below which their
    /// errors are not trusted, `None` where the job has none.
    pub fn new(stop: StopRule, grids: Option<u64>, views: Option<u64>) -> Self {
        Self {
            normal: two_sided_normal_quantile(stop.confidence),
            grids: grids.map(|least| Output::new(stop.relative_error, least)),
            views: views.map(|least| Output::new(stop.view_relative_error, least)),
            stop,
            told: Vec::new(),
            same_since: 0,
        }
    }

    /// Takes a pass that was reported, without a forecast; one that does not come after those before is left out.
    pub fn take(&mut self, report: &PassReport) {
        if self.told.last().is_some_and(|(passes, _)| *passes >= report.passes) {
            return;
        }
        let passes = report.passes as f64;
        let told = [
            (Outputs::Grids, &mut self.grids, report.relative_error),
            (Outputs::Views, &mut self.views, report.view_relative_error),
        ];
        for (outputs, output, error) in told {
            let Some(output) = output else { continue };
            let degrees = outputs.degrees_of_freedom(report);
            let t = two_sided_student_quantile(self.stop.confidence, degrees);
            // a further pass leaves the error as it is to the last bit only where it is not one of this output
            let ended = error.is_some() && error == output.error;
            if ended && !output.ended {
                self.same_since = self.told.len().saturating_sub(1);
            }
            (output.ended, output.error) = (ended, error);
            if let (Some(error), false) = (error, ended) {
                output.freedom = degrees / (passes - 1.0);
                // against the number of passes: each pass is one unit of time
                output.steps.push(ErrorPoint { passes, seconds: passes, error: error / t });
            }
        }
        self.told.push((report.passes, report.seconds));
    }

    /// Takes a pass that was reported, and returns the forecast after it. `waiting_for`: the condition that the job waits for, `None` after
    /// its last pass.
    pub fn after(&mut self, report: &PassReport, waiting_for: Option<stopping::WaitingFor>) -> Forecast {
        self.take(report);
        let pace = self.seconds_per_pass();
        let of = |output: &Option<Output>| output.as_ref().map(|output| self.output(output, report, pace));
        let (grids, views) = (of(&self.grids), of(&self.views));
        let seconds_left = match waiting_for {
            Some(_) => self.seconds_left(report, pace),
            None => Some(0.0),
        };
        Forecast { seconds_left, waiting_for: waiting_for.map(WaitingFor::from), grids, views }
    }

    /// Returns the seconds of a pass: the mean of those since the half of all passes, or since an output was left out.
    fn seconds_per_pass(&self) -> f64 {
        let Some((passes, seconds)) = self.told.last() else { return 0.0 };
        let half = self.told.partition_point(|(earlier, _)| 2 * earlier <= *passes);
        let since = self.told.get(half.saturating_sub(1).max(self.same_since)).filter(|(since, _)| since < passes);
        let (since, at) = since.copied().unwrap_or((0, 0.0));
        (seconds - at).max(0.0) / (passes - since) as f64
    }

    fn of(&self, outputs: Outputs) -> Option<&Output> {
        match outputs {
            Outputs::Grids => self.grids.as_ref(),
            Outputs::Views => self.views.as_ref(),
        }
    }

    /// Returns Student's quantile of an output after a number of passes, on which it depends, but little.
    fn quantile(&self, output: &Output, passes: f64) -> f64 {
        student_quantile_near(self.normal, output.freedom * (passes.max(LEAST_PASSES as f64) - 1.0))
    }

    /// Returns the standard error that an output has once its relative error is `error`.
    fn standard_error(&self, output: &Output, error: f64, law: &PowerLaw) -> f64 {
        let again = |t: f64| self.quantile(output, law.time_of(error / t));
        error / again(again(again(self.normal)))
    }

    /// Returns the number of passes after which an output has a relative error.
    fn passes_to(&self, output: &Output, error: f64, law: &PowerLaw) -> f64 {
        law.time_of(self.standard_error(output, error, law))
    }

    /// Predicts the time at which outputs have a relative error, in render seconds of the whole job, with an interval of [`CONFIDENCE`];
    /// `None` before a pass has reported an error.
    pub fn time_to(&self, outputs: Outputs, error: f64) -> Option<TimePrediction> {
        let output = self.of(outputs)?;
        let law = output.steps.predictive_law()?;
        let TimePrediction { seconds, from, to } = law.seconds_to(self.standard_error(output, error, &law), CONFIDENCE);
        let [seconds, from, to] = [seconds, from, to].map(|passes| self.seconds_at(passes));
        Some(TimePrediction { seconds, from, to: to.min(WIDEST * seconds) }).filter(|foretold| foretold.to.is_finite())
    }

    /// Predicts the error of outputs from half of the passes on, up to `beyond` times the seconds so far; `None` before a pass has reported
    /// an error, and where passes take no time.
    pub fn course(&self, outputs: Outputs, beyond: f64) -> Option<Course> {
        let output = self.of(outputs)?;
        let law = output.steps.predictive_law()?;
        let (pace, passes) = (self.seconds_per_pass(), law.last.passes);
        let now = self.told.last().map(|(_, seconds)| *seconds).filter(|_| pace > 0.0)?;
        let begin = (now - 0.5 * passes * pace).max(0.25 * now);
        let ratio = libm::log(beyond * now / begin);
        let points = (0..=COURSE_POINTS).map(|step| {
            let seconds = begin * libm::exp(ratio * f64::from(step) / f64::from(COURSE_POINTS));
            let at = (passes + (seconds - now) / pace).max(0.5 * passes);
            let t = self.quantile(output, at);
            let [from, to] = law.band_at(at, CONFIDENCE).map(|end| t * end);
            CoursePoint { seconds, error: t * law.error_at(at), from, to }
        });
        let half_interval = two_sided_student_quantile(CONFIDENCE, law.degrees as f64) * law.standard_error;
        Some(Course { exponent: law.exponent, half_interval, points: points.collect() })
    }

    /// Returns the render seconds of the whole job after a number of passes, at least those so far.
    fn seconds_at(&self, passes: f64) -> f64 {
        let (told, seconds) = self.told.last().copied().unwrap_or_default();
        seconds + (passes - told as f64).max(0.0) * self.seconds_per_pass()
    }

    fn output(&self, output: &Output, report: &PassReport, pace: f64) -> OutputForecast {
        let law = output.steps.predictive_law();
        let left = |passes: f64| Some((passes - report.passes as f64).max(0.0) * pace).filter(|left| left.is_finite());
        let holds = |limit: f64| output.error.is_some_and(|error| error <= limit);
        let seconds_to = ACCURACIES.iter().map(|accuracy| {
            let passes = law.as_ref().filter(|_| !holds(*accuracy) && !output.ended);
            let left = passes.and_then(|law| left(self.passes_to(output, *accuracy, law)));
            SecondsTo { relative_error: *accuracy, seconds: left.map(|left| report.seconds + left) }
        });
        let asked =
            if holds(output.asked) { Some(0.0) } else { law.map(|law| self.passes_to(output, output.asked, &law)) };
        OutputForecast {
            exponent: output.steps.law().map(|law| law.exponent),
            seconds_left: match output.ended {
                true => Some(0.0),
                false => asked.and_then(|passes| left(passes.max(output.least as f64))),
            },
            seconds_to: seconds_to.collect(),
        }
    }

    /// Returns the seconds until all outputs are as accurate as requested and the job checks whether they are, or until its limits.
    fn seconds_left(&self, report: &PassReport, pace: f64) -> Option<f64> {
        let passes = report.passes;
        let mut last = passes;
        for output in [&self.grids, &self.views].into_iter().flatten().filter(|output| !output.ended) {
            let error = output.error?;
            let accurate = match output.steps.predictive_law() {
                _ if error <= output.asked => passes as f64,
                Some(law) => self.passes_to(output, output.asked, &law).ceil(),
                None => f64::INFINITY,
            };
            // as large as the limit at most, which ends the search for the next judgement
            last = last.max((accurate.min(self.stop.max_passes as f64) as u64).max(output.least));
        }
        let last = next_judgement(last).min(self.stop.max_passes);
        let by_accuracy = last.saturating_sub(passes) as f64 * pace;
        Some(by_accuracy.min(self.stop.max_seconds - report.seconds).max(0.0))
    }
}

impl RenderJob {
    /// Returns a forecaster of the job's end, to be used from the first pass on.
    pub fn forecaster(&self) -> Forecaster {
        let [grids, views] = self.least_passes();
        Forecaster::new(self.stop, grids, views)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stop() -> StopRule {
        StopRule {
            relative_error: 0.01,
            view_relative_error: 0.05,
            confidence: 0.95,
            max_passes: 1_000_000,
            max_seconds: 1e6,
        }
    }

    /// Returns the half width of the interval after some passes, for a standard error of `one` after one pass that falls with the square
    /// root of the passes.
    fn error_after(passes: u64, one: f64) -> f64 {
        let n = passes as f64;
        two_sided_student_quantile(0.95, n - 1.0) * one / n.sqrt()
    }

    /// Returns a pass at 0.1 s a pass; `one` as in [`error_after`], of the grids and of the views.
    fn pass(passes: u64, grids: Option<f64>, views: Option<f64>) -> PassReport {
        let error = |one: Option<f64>| one.filter(|_| passes > 1).map(|one| error_after(passes, one));
        PassReport {
            passes,
            seconds: 0.1 * passes as f64,
            relative_error: error(grids),
            view_relative_error: error(views),
            ..PassReport::default()
        }
    }

    /// Finds the smallest number of passes whose error is within a limit.
    fn passes_for(limit: f64, one: f64) -> u64 {
        (2..).find(|passes| error_after(*passes, one) <= limit).unwrap()
    }

    const WAITS: Option<stopping::WaitingFor> = Some(stopping::WaitingFor::RelativeError);

    #[test]
    fn two_three_and_more_passes_foretell_by_the_square_root() {
        let needed = passes_for(0.01, 0.2);
        for last in [2, 3, 4, 20, 200] {
            let mut forecaster = Forecaster::new(stop(), Some(8), None);
            let told = (1..last).map(|passes| forecaster.after(&pass(passes, Some(0.2), None), WAITS));
            let first = told.collect::<Vec<_>>().swap_remove(0);
            assert_eq!((first.seconds_left, first.grids.unwrap().seconds_left), (None, None));
            let forecast = forecaster.after(&pass(last, Some(0.2), None), WAITS);
            let grids = forecast.grids.unwrap();
            // the expansion of Student's quantile is right to 0.4 %, and half a pass is lost to rounding
            let near = |seconds: f64, passes: u64| {
                let foretold = seconds / 0.1 + last as f64;
                assert!((foretold - passes as f64).abs() <= 0.01 * passes as f64 + 1.0, "{last}: {foretold} {passes}");
            };
            near(grids.seconds_left.unwrap(), needed);
            near(forecast.seconds_left.unwrap(), next_judgement(needed));
            assert_eq!(grids.exponent.is_some(), last > 4);
            for time in grids.seconds_to {
                match time.seconds {
                    Some(seconds) => near(seconds - 0.1 * last as f64, passes_for(time.relative_error, 0.2)),
                    None => assert!(error_after(last, 0.2) <= time.relative_error),
                }
            }
        }
    }

    /// A job whose errors are small waits for the least number of passes, and the passes up to it are what is left.
    #[test]
    fn the_least_number_of_passes_is_waited_for() {
        let mut forecaster = Forecaster::new(stop(), Some(17), None);
        forecaster.take(&pass(1, Some(1e-6), None));
        let forecast = forecaster.after(&pass(2, Some(1e-6), None), Some(stopping::WaitingFor::LeastPasses));
        assert_eq!(forecast.waiting_for, Some(WaitingFor::LeastPasses));
        let grids = forecast.grids.unwrap();
        assert!((grids.seconds_left.unwrap() - 1.5).abs() < 1e-9);
        // the job looks after 16 passes, and then after 18
        assert!((forecast.seconds_left.unwrap() - 1.6).abs() < 1e-9);
        assert!(grids.seconds_to.iter().all(|time| time.seconds.is_none()));
    }

    #[test]
    fn limits_end_a_job_before_its_accuracy() {
        let end = |stop: StopRule| {
            let mut forecaster = Forecaster::new(stop, Some(8), None);
            (1..10).for_each(|passes| forecaster.take(&pass(passes, Some(0.5), None)));
            forecaster.after(&pass(10, Some(0.5), None), WAITS).seconds_left.unwrap()
        };
        assert!((end(StopRule { max_passes: 40, ..stop() }) - 3.0).abs() < 1e-9);
        assert!((end(StopRule { max_seconds: 1.5, ..stop() }) - 0.5).abs() < 1e-9);
        assert!(end(stop()) > 100.0);
        // after the last pass nothing is left
        let mut forecaster = Forecaster::new(stop(), Some(8), None);
        assert_eq!(forecaster.after(&pass(1, None, None), None).seconds_left, Some(0.0));
    }

    /// Views of 0.1 s a pass end after 10 passes; grids of 0.01 s a pass continue, and are predicted at their own pace.
    #[test]
    fn an_output_that_has_ended_is_left_out_of_the_pace() {
        let mut forecaster = Forecaster::new(stop(), Some(8), Some(8));
        let mut forecast = Forecast::default();
        for passes in 1..=14 {
            let seconds = 0.1 * passes.min(10) as f64 + 0.01 * passes as f64;
            let views = pass(passes.min(10), None, Some(0.05)).view_relative_error;
            let report = PassReport { seconds, view_relative_error: views, ..pass(passes, Some(0.2), None) };
            forecast = forecaster.after(&report, WAITS);
        }
        let needed = next_judgement(passes_for(0.01, 0.2));
        let expected = 0.01 * (needed - 14) as f64;
        assert!((forecast.seconds_left.unwrap() / expected - 1.0).abs() < 0.01, "{forecast:?} {expected}");
        let views = forecast.views.unwrap();
        assert_eq!(views.seconds_left, Some(0.0));
        assert!(views.seconds_to.iter().all(|time| time.seconds.is_none()));
        // the exponent is that of the passes that computed them
        assert!((views.exponent.unwrap() + 0.5).abs() < 1e-6, "{views:?}");
    }

    #[test]
    fn passes_that_come_twice_count_once() {
        let mut forecaster = Forecaster::new(stop(), Some(8), None);
        (1..20).for_each(|passes| forecaster.take(&pass(passes, Some(0.2), None)));
        let mut again = forecaster.clone();
        (10..20).for_each(|passes| again.take(&pass(passes, Some(0.9), None)));
        assert_eq!(again.after(&pass(20, Some(0.2), None), WAITS), forecaster.after(&pass(20, Some(0.2), None), WAITS));
    }
}

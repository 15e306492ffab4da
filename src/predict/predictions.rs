//! Predictions of the time that each method would take to each accuracy, before a job runs, from the measurements of a pilot
//! (`predict/pilot.rs`).

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use crate::document::RefusalName;
use crate::estimate::error_law::{ErrorLaw, Judged};
use crate::integrator::method::Refusal;
use crate::statistics::interval::{two_sided_normal_quantile, two_sided_student_quantile};

/// Relative errors to which times are predicted.
pub const PREDICTED_ACCURACIES: [f64; 6] = [0.1, 0.05, 0.02, 0.01, 0.005, 0.001];

/// Times that each method would take to each accuracy alone, without the additional passes for light in parts and for cross-checks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Predictions {
    /// Wall-clock seconds that the pilot took.
    pub pilot_seconds: f64,
    /// Number of threads among which the work of a job is divided; predicted seconds hold for processors that do nothing else.
    pub threads: usize,
    /// Confidence of the relative errors, and of the intervals of the seconds.
    pub confidence: f64,
    /// Predictions for the grids alone; null without any.
    pub grids: Option<OutputPredictions>,
    /// Predictions for the views alone; null without any.
    pub views: Option<OutputPredictions>,
}

/// Predictions of each method for the grids, or for the views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct OutputPredictions {
    /// Relative error that the document requests.
    pub asked_relative_error: f64,
    /// Name of the method that would reach it first; null where no time is known.
    pub cheapest: Option<String>,
    /// All methods, each with the document's settings where it names the method.
    pub methods: Vec<MethodPredictions>,
}

/// Predictions of one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct MethodPredictions {
    /// Name of the method, as in `method.kind` of a document.
    pub method: String,
    /// True if it is the method of the plan.
    pub planned: bool,
    /// Reason why the method cannot compute this output; null where it can.
    pub refusal: Option<RefusalResult>,
    /// Seconds to its first values, which have no error yet; null where unknown.
    pub seconds_to_first_number: Option<f64>,
    /// Time to the relative error that the document requests; null where the method refuses.
    pub asked: Option<PredictedTime>,
    /// Times to relative errors of 10, 5, 2, 1, 0.5 and 0.1 percent; empty where the method refuses.
    pub accuracies: Vec<PredictedTime>,
}

/// Reason why a method cannot compute an output.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct RefusalResult {
    /// Kind of the reason, for programs.
    pub code: RefusalName,
    /// Reason for people.
    pub detail: String,
}

impl From<Refusal> for RefusalResult {
    fn from(refusal: Refusal) -> Self {
        Self { code: RefusalName(refusal.code), detail: refusal.detail }
    }
}

/// Time that a method would take to an accuracy.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct PredictedTime {
    /// Relative error at the requested confidence.
    pub relative_error: f64,
    /// Render seconds of a job that requests this error, whatever its limits are, with its set-up and the least number of passes; null
    /// where unknown, or where the error is not reached.
    pub seconds: Option<f64>,
    /// Lower end of the interval of the seconds; null where they are.
    pub seconds_from: Option<f64>,
    /// Upper end of the interval of the seconds; null where they are, and where it is not certain that the error is reached at all.
    pub seconds_to: Option<f64>,
    /// Part of the seconds before the first pass begins, which the render time of a job's result does not count; null where the seconds are,
    /// and for a method without passes.
    #[serde(default)]
    pub setup_seconds: Option<f64>,
    /// Number of passes of the job; null for a method without passes, and where unknown.
    pub passes: Option<u64>,
    /// True if no other method is known to reach this error sooner.
    pub cheapest: bool,
    /// Reason why the seconds are null.
    pub reason: Option<String>,
}

impl PredictedTime {
    /// Makes an unknown time, with the reason why.
    pub fn unknown(relative_error: f64, reason: impl Into<String>) -> Self {
        Self { relative_error, reason: Some(reason.into()), ..Self::default() }
    }

    /// Makes a time with its interval.
    pub fn known(relative_error: f64, seconds: f64, from: f64, to: Option<f64>, passes: Option<u64>) -> Self {
        let (seconds, seconds_from) = (Some(seconds), Some(from));
        Self { relative_error, seconds, seconds_from, seconds_to: to, passes, ..Self::default() }
    }

    /// Returns the part of the seconds that passes take, 0..1, as the render time of a result counts it; `None` where no seconds are known.
    pub fn part_of_passes(&self) -> Option<f64> {
        let (seconds, setup) = (self.seconds?, self.setup_seconds.unwrap_or_default());
        Some(if seconds > 0.0 { (seconds - setup) / seconds } else { 1.0 })
    }
}

impl OutputPredictions {
    /// Returns the times of the planned method, in the order of [`PREDICTED_ACCURACIES`], and last that to the requested error.
    pub fn of_plan(&self) -> impl Iterator<Item = &PredictedTime> {
        self.methods.iter().filter(|row| row.planned).flat_map(|row| row.accuracies.iter().chain(&row.asked))
    }

    /// Makes the table of some methods, and marks the cheapest one to each accuracy.
    pub fn new(asked_relative_error: f64, mut methods: Vec<MethodPredictions>) -> Self {
        for index in 0..PREDICTED_ACCURACIES.len() {
            mark_cheapest(methods.iter_mut().filter_map(|row| row.accuracies.get_mut(index)).collect());
        }
        mark_cheapest(methods.iter_mut().filter_map(|row| row.asked.as_mut()).collect());
        let is_cheapest = |row: &&MethodPredictions| row.asked.as_ref().is_some_and(|asked| asked.cheapest);
        let cheapest = methods.iter().find(is_cheapest).map(|row| row.method.clone());
        Self { asked_relative_error, cheapest, methods }
    }
}

fn mark_cheapest(times: Vec<&mut PredictedTime>) {
    let known = times.into_iter().filter(|time| time.seconds.is_some());
    if let Some(least) = known.min_by(|a, b| a.seconds.unwrap_or_default().total_cmp(&b.seconds.unwrap_or_default())) {
        least.cheapest = true;
    }
}

/// Measurements of a method by a pilot.
#[derive(Clone, Debug)]
pub struct Measured {
    /// Seconds until the first pass begins.
    pub setup_seconds: f64,
    /// Seconds of a pass of the job.
    pub seconds_per_pass: f64,
    /// Standard deviation of the logarithm of `seconds_per_pass`.
    pub cost_deviation: f64,
    /// Error law of each grid, or of each view; the worst counts.
    pub laws: Vec<ErrorLaw>,
    /// Number of passes from which the laws were derived.
    pub passes: usize,
}

impl Measured {
    /// Returns the seconds until the first pass has ended.
    pub fn seconds_to_first_number(&self) -> f64 {
        self.setup_seconds + self.seconds_per_pass
    }

    /// Predicts the time of a job that requests a relative error.
    pub fn time_to(&self, relative_error: f64, judged: Judged) -> PredictedTime {
        let passes = |deviations: f64| -> Option<u64> {
            let each = self.laws.iter().map(|law| law.shifted(deviations).passes_to(relative_error, judged));
            each.collect::<Option<Vec<_>>>()?.into_iter().max()
        };
        let Some(expected) = passes(0.0) else {
            return PredictedTime::unknown(
                relative_error,
                "not reached within a billion passes: the bias of its kernels or fixed points may be larger than this \
                 error",
            );
        };
        let deviations = two_sided_student_quantile(judged.confidence, (self.passes - 1) as f64);
        let factor = libm::exp(two_sided_normal_quantile(judged.confidence) * self.cost_deviation);
        let seconds = |passes: u64| self.setup_seconds + passes as f64 * self.seconds_per_pass;
        let from = passes(-deviations).unwrap_or(expected).min(expected);
        let to = passes(deviations).map(|most| seconds(most.max(expected)) * factor);
        let time = PredictedTime::known(relative_error, seconds(expected), seconds(from) / factor, to, Some(expected));
        PredictedTime { setup_seconds: Some(self.setup_seconds), ..time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const JUDGED: Judged = Judged { confidence: 0.95, least_passes: 8 };

    #[test]
    fn times_hold_the_set_up_and_an_interval() {
        let law = ErrorLaw { noise: 0.01, noise_deviation: 0.2, ..ErrorLaw::default() };
        let measured =
            Measured { setup_seconds: 1.0, seconds_per_pass: 0.5, cost_deviation: 0.1, laws: vec![law], passes: 6 };
        let time = measured.time_to(0.01, JUDGED);
        let passes = law.passes_to(0.01, JUDGED).unwrap();
        assert_eq!((time.seconds, time.passes), (Some(1.0 + 0.5 * passes as f64), Some(passes)));
        assert_eq!(time.part_of_passes(), Some(0.5 * passes as f64 / (1.0 + 0.5 * passes as f64)));
        assert!(time.seconds_from < time.seconds && time.seconds_to > time.seconds);
        assert_eq!(measured.seconds_to_first_number(), 1.5);
        // the worst grid counts
        let worse = ErrorLaw { noise: 0.04, ..law };
        let both = Measured { laws: vec![law, worse], ..measured };
        assert_eq!(both.time_to(0.01, JUDGED).passes, worse.passes_to(0.01, JUDGED));
        let never = Measured { laws: vec![ErrorLaw { fixed: 1.0, ..law }], ..both }.time_to(0.01, JUDGED);
        assert!(never.seconds.is_none() && never.reason.is_some() && never.part_of_passes().is_none());
    }

    #[test]
    fn one_method_is_the_cheapest_to_an_accuracy() {
        let row = |method: &str, asked: Option<f64>| MethodPredictions {
            method: method.to_owned(),
            planned: false,
            refusal: None,
            seconds_to_first_number: None,
            asked: Some(match asked {
                Some(seconds) => PredictedTime::known(0.02, seconds, seconds, None, None),
                None => PredictedTime::unknown(0.02, "no time"),
            }),
            accuracies: Vec::new(),
        };
        let table = OutputPredictions::new(0.02, vec![row("a", None), row("b", Some(3.0)), row("c", Some(2.0))]);
        assert_eq!(table.cheapest.as_deref(), Some("c"));
        assert_eq!(OutputPredictions::new(0.02, vec![row("a", None)]).cheapest, None);
    }
}

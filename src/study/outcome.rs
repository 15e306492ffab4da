//! Outcome of a study: its runs, and their statistics by method and error.

use serde::{Deserialize, Serialize};
use utoipa::ToSchema;

use super::compare::Deviation;
use super::part::StudyPart;
use super::request::RunKey;
use crate::engine::progress::{Progress, StoppedBy};

/// A run of a study.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct Run {
    /// Requested method.
    pub method: String,
    /// Methods that computed the run, which differ from the requested one if that is `auto`.
    pub computed_by: String,
    /// Requested relative error at the job's confidence.
    #[serde(rename = "asked_relative_error")]
    pub asked: f64,
    /// Number of the seed, from 0.
    pub seed: u64,
    /// Seconds from the document to the first pass.
    pub set_up_seconds: f64,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Processor seconds of rendering in all threads; elapsed seconds where the operating system does not report them.
    pub cpu_seconds: f64,
    /// Number of passes.
    pub passes: u64,
    /// Relative error that the job reports, at its confidence; null if it has no estimate of it.
    #[serde(rename = "reported_relative_error")]
    pub reported: Option<f64>,
    /// Mean square of the relative deviations from the reference, including the reference's variance.
    pub squared_error: f64,
    /// Fraction of the sensors whose interval contains the reference; null if the run has no errors.
    pub covered: Option<f64>,
    /// Reason why the run ended.
    pub stopped_by: StoppedBy,
    /// True if the run reached the requested accuracy, according to the error that it reports.
    pub met: bool,
}

/// End of a job that was not cancelled.
#[derive(Clone, Copy, Debug)]
pub struct Ended {
    /// True if the job has results.
    pub succeeded: bool,
    /// Passes done, and their cost and accuracy.
    pub progress: Progress,
    /// Reason why the job ended; `None` where its passes failed.
    pub stopped_by: Option<StoppedBy>,
}

impl Run {
    /// Returns a run that has ended with values, from its deviation from the reference; `None` if the job is no run.
    pub fn new(part: &StudyPart, ended: &Ended, deviation: Deviation) -> Option<Self> {
        let (RunKey { method, relative_error, seed }, stopped_by) = (part.key.run.clone()?, ended.stopped_by?);
        let Progress { seconds, passes, relative_error: reported, cpu_seconds, .. } = ended.progress;
        Some(Self {
            method,
            computed_by: part.computed_by.clone(),
            asked: relative_error,
            seed,
            set_up_seconds: part.set_up_seconds,
            seconds,
            cpu_seconds: cpu_seconds.unwrap_or(seconds),
            passes,
            reported,
            squared_error: deviation.squared_error,
            covered: deviation.covered,
            stopped_by,
            met: stopped_by.is_as_asked() && reported.is_some(),
        })
    }
}

/// A method that cannot compute the job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct Refused {
    /// Name of the method.
    pub method: String,
    /// Reason for the refusal, as a sentence.
    pub reason: String,
}

/// Median and quartiles over several runs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, ToSchema)]
pub struct Quartiles {
    /// Lower quartile: a quarter of the runs have less.
    pub lower: f64,
    /// Median: half of the runs have less.
    pub median: f64,
    /// Upper quartile: a quarter of the runs have more.
    pub upper: f64,
}

/// All runs of one method at one requested error.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub struct Cell {
    /// Name of the method.
    pub method: String,
    /// Requested relative error at the job's confidence.
    #[serde(rename = "asked_relative_error")]
    pub asked: f64,
    /// Processor seconds of the runs.
    pub cpu_seconds: Quartiles,
    /// Seconds of the runs, set-up included.
    pub seconds: Quartiles,
    /// Median of the relative errors that the runs report, at the job's confidence; null if none does.
    #[serde(rename = "reported_relative_error")]
    pub reported: Option<f64>,
    /// Root mean square of the relative deviations of all runs from the reference, with the reference's own variance subtracted.
    #[serde(rename = "actual_relative_error")]
    pub actual: f64,
    /// Fraction of the sensors of all runs whose interval contains the reference; null if no errors are available.
    pub covered: Option<f64>,
    /// True if all runs reached the requested accuracy, according to the errors that they report.
    pub met: bool,
    /// True if the runs are of a formula, which gives the same result at any requested error and no estimate of its own error.
    pub formula: bool,
    /// True if no other method that reached the error took fewer processor seconds.
    pub cheapest: bool,
}

/// Job that a study's runs are compared with.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderedReference {
    /// Methods that computed it.
    pub method: String,
    /// Seconds of rendering it.
    pub seconds: f64,
}

/// Outcome of a study.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Study {
    /// Job that rendered the reference; `None` if its values were given.
    pub reference: Option<RenderedReference>,
    /// Mean of the reference's squared relative standard errors; `None` if none are available.
    pub reference_variance: Option<f64>,
    /// Confidence of relative errors and intervals.
    pub confidence: f64,
    /// All runs, in the order in which they were rendered.
    pub runs: Vec<Run>,
    /// Methods that cannot compute the job.
    pub refused: Vec<Refused>,
}

impl Study {
    /// Returns the runs grouped by method and error, in the order of each group's first run.
    pub fn cells(&self) -> Vec<Cell> {
        let mut keys: Vec<(&str, f64)> = Vec::new();
        for run in &self.runs {
            if !keys.iter().any(|(method, asked)| *method == run.method && *asked == run.asked) {
                keys.push((&run.method, run.asked));
            }
        }
        let mut cells: Vec<Cell> = keys.into_iter().map(|(method, asked)| self.cell(method, asked)).collect();
        for index in 0..cells.len() {
            let of_error = cells.iter().filter(|cell| cell.asked == cells[index].asked && cell.met);
            let least = of_error.map(|cell| cell.cpu_seconds.median).fold(f64::INFINITY, f64::min);
            cells[index].cheapest = cells[index].met && cells[index].cpu_seconds.median <= least;
        }
        cells
    }

    /// Returns the root mean square of the reference's relative standard errors; `None` if none are available.
    pub fn reference_error(&self) -> Option<f64> {
        self.reference_variance.map(f64::sqrt)
    }

    fn cell(&self, method: &str, asked: f64) -> Cell {
        let runs: Vec<&Run> = self.runs.iter().filter(|run| run.method == method && run.asked == asked).collect();
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let squared = mean(runs.iter().map(|run| run.squared_error).collect());
        let reported: Vec<f64> = runs.iter().filter_map(|run| run.reported).collect();
        let covered: Vec<f64> = runs.iter().filter_map(|run| run.covered).collect();
        Cell {
            method: method.to_owned(),
            asked,
            cpu_seconds: Quartiles::of(runs.iter().map(|run| run.cpu_seconds)),
            seconds: Quartiles::of(runs.iter().map(|run| run.set_up_seconds + run.seconds)),
            reported: (!reported.is_empty()).then(|| Quartiles::of(reported).median),
            actual: (squared - self.reference_variance.unwrap_or(0.0)).max(0.0).sqrt(),
            covered: (!covered.is_empty()).then(|| mean(covered)),
            met: runs.iter().all(|run| run.met),
            formula: runs.iter().all(|run| run.stopped_by == StoppedBy::Exact && run.reported.is_none()),
            cheapest: false,
        }
    }
}

impl Quartiles {
    /// Returns the quartiles of some values, interpolated linearly between the two nearest; zeros for none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let Some(last) = sorted.len().checked_sub(1) else { return Self::default() };
        let quantile = |share: f64| {
            let place = share * last as f64;
            let (low, high) = (sorted[place as usize], sorted[(place as usize + 1).min(last)]);
            low + place.fract() * (high - low)
        };
        Self { lower: quantile(0.25), median: quantile(0.5), upper: quantile(0.75) }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    pub fn run(method: &str, asked: f64, cpu_seconds: f64, error: f64) -> Run {
        Run {
            method: method.to_owned(),
            computed_by: method.to_owned(),
            asked,
            seed: 0,
            set_up_seconds: 0.5,
            seconds: cpu_seconds,
            cpu_seconds,
            passes: 8,
            reported: Some(asked),
            squared_error: error * error,
            covered: Some(0.95),
            stopped_by: StoppedBy::RelativeError,
            met: true,
        }
    }

    #[test]
    fn runs_of_a_method_to_an_error_are_put_together() {
        let mut late = run("b", 0.01, 1.0, 0.003);
        late.met = false;
        let runs = vec![run("a", 0.01, 4.0, 0.004), run("b", 0.01, 2.0, 0.005), run("a", 0.01, 6.0, 0.006), late];
        let study = Study { runs, reference_variance: Some(1e-6), ..Study::default() };
        let cells = study.cells();
        assert_eq!(cells.len(), 2);
        assert_eq!((cells[0].method.as_str(), cells[0].cpu_seconds.median, cells[0].seconds.median), ("a", 5.0, 5.5));
        // (16 + 36) / 2 - 1 = 25
        assert!((cells[0].actual - 0.005).abs() < 1e-15);
        // b was faster, but not always there
        assert!(cells[0].cheapest && !cells[1].cheapest && !cells[1].met);
    }

    #[test]
    fn quartiles_lie_between_values() {
        assert_eq!(Quartiles::of([5.0, 1.0, 3.0, 2.0, 4.0]), Quartiles { lower: 2.0, median: 3.0, upper: 4.0 });
        assert_eq!(Quartiles::of([7.0]), Quartiles { lower: 7.0, median: 7.0, upper: 7.0 });
        assert_eq!(Quartiles::of([]), Quartiles::default());
    }
}

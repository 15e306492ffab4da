//! What the passes of a job tell about its errors, as JSON, CSV and a figure: how they fall, and what an accuracy costs.

use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

use super::chunk::RenderError;
use super::convergence::ACCURACIES;
use super::predictions::{OutputPredictions, PredictedTime, Predictions};
use super::progress::PassReport;
use super::results::failed;
use super::subject::Subject;
use crate::figure::convergence::{ErrorSeries, Foretold, Known, TimeTo};
use crate::figure::ticks::{duration, significant};
use crate::figure::{self, Drawing, FigureFormat, Heading};
use crate::statistics::interval::two_sided_student_quantile;
use crate::statistics::power_law::{ErrorPoint, PowerLaw};

/// Confidence of intervals around exponents and times.
const CONFIDENCE: f64 = 0.95;

/// How the errors of a job's outputs fall with time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ErrorHistory {
    /// Relative error at which the job is to end.
    pub asked_relative_error: f64,
    /// The law that the errors follow; null with fewer than four passes that told one.
    pub fit: Option<ErrorFit>,
    /// Seconds to relative errors of 5, 2, 1, 0.5 and 0.1 percent.
    pub times: Vec<TimeToAccuracy>,
    /// What was foretold of the method of the plan before the job ran, as if it were to compute these outputs alone: times to relative
    /// errors of 10, 5, 2, 1, 0.5 and 0.1 percent, and last to the one asked for. Empty where nobody asked for it.
    #[serde(default)]
    pub foretold: Vec<PredictedTime>,
}

/// The law `error ~ seconds^exponent`, fitted with regard to what successive errors have in common.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ErrorFit {
    /// Exponent of the relative standard error: -1/2 of independent passes.
    pub exponent: f64,
    /// Standard error of the exponent.
    pub standard_error: f64,
    /// Degrees of freedom of the standard error, for Student's quantiles.
    pub degrees_of_freedom: usize,
}

/// When a relative error is reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TimeToAccuracy {
    /// The relative error, at the asked confidence.
    pub relative_error: f64,
    /// How the time is known.
    pub known: TimeKnown,
    /// Render seconds of the whole job; null where nobody knows.
    pub seconds: Option<f64>,
    /// Lower end of the interval that has the time with a confidence of 95 %, as far as the errors go on as they did; null
    /// unless extrapolated.
    pub from_seconds: Option<f64>,
    /// Upper end of the interval; null unless extrapolated, and where it has none.
    pub to_seconds: Option<f64>,
}

/// How the time to an accuracy is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TimeKnown {
    /// A pass had this error, or less.
    Met,
    /// The law that the errors follow has it then.
    Extrapolated,
    /// No pass had it, and there is no law that foretells it.
    Unknown,
}

/// Grids or views.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Outputs {
    Grids,
    Views,
}

impl Outputs {
    fn error(self, pass: &PassReport) -> Option<f64> {
        match self {
            Self::Grids => pass.relative_error,
            Self::Views => pass.view_relative_error,
        }
    }

    fn foretold(self, predictions: &Predictions) -> Option<&OutputPredictions> {
        match self {
            Self::Grids => predictions.grids.as_ref(),
            Self::Views => predictions.views.as_ref(),
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Grids => "grids",
            Self::Views => "views",
        }
    }
}

/// How the errors of the grids fall; `None` of a job without any, or where no pass has told an error.
pub fn grids_history(subject: &Subject, passes: &[PassReport]) -> Option<ErrorHistory> {
    history(subject, Outputs::Grids, passes).map(|(history, _)| history)
}

/// How the errors of the views fall; `None` of a job without any, or where no pass has told an error.
pub fn views_history(subject: &Subject, passes: &[PassReport]) -> Option<ErrorHistory> {
    history(subject, Outputs::Views, passes).map(|(history, _)| history)
}

fn history(subject: &Subject, outputs: Outputs, passes: &[PassReport]) -> Option<(ErrorHistory, Option<PowerLaw>)> {
    let stop = subject.document.as_ref()?.stop_rule();
    let asked_relative_error = match outputs {
        Outputs::Grids => stop.relative_error,
        Outputs::Views => stop.view_relative_error,
    };
    let last = passes.iter().rev().find(|pass| outputs.error(pass).is_some())?;
    // told errors are half widths of intervals, whose quantile falls with the passes, too
    let points = computed(outputs, passes).map(|pass| {
        let quantile = two_sided_student_quantile(stop.confidence, pass.passes as f64 - 1.0);
        let error = outputs.error(pass).unwrap_or_default() / quantile;
        ErrorPoint { passes: pass.passes as f64, seconds: pass.seconds, error }
    });
    let mut law = PowerLaw::fit(&points.collect::<Vec<_>>());
    if let (Some(law), Some(error)) = (&mut law, outputs.error(last)) {
        law.last.error = error;
    }
    let fit = law.map(|law| ErrorFit {
        exponent: law.exponent,
        standard_error: law.standard_error,
        degrees_of_freedom: law.degrees,
    });
    let times = ACCURACIES.iter().map(|accuracy| time_to(*accuracy, outputs, passes, law.as_ref())).collect();
    let foretold = subject.predictions.as_ref().and_then(|predictions| outputs.foretold(predictions));
    let foretold = foretold.map_or_else(Vec::new, |table| table.of_plan().cloned().collect());
    Some((ErrorHistory { asked_relative_error, fit, times, foretold }, law))
}

/// The passes that told an error of these outputs and computed them: a further pass leaves it as it is to the last bit only where it is
/// not one of them, because they were as accurate as asked.
fn computed(outputs: Outputs, passes: &[PassReport]) -> impl Iterator<Item = &PassReport> {
    let mut last = None;
    passes.iter().filter(move |pass| {
        let error = outputs.error(pass);
        let is_new = error.is_some() && error != last;
        last = error;
        is_new
    })
}

/// The first pass from which on every one has the accuracy tells when it was met: a lucky one before it does not.
fn time_to(accuracy: f64, outputs: Outputs, passes: &[PassReport], law: Option<&PowerLaw>) -> TimeToAccuracy {
    let told = passes.iter().filter_map(|pass| Some((pass.seconds, outputs.error(pass)?)));
    let mut met = None;
    for (seconds, error) in told {
        if error > accuracy {
            met = None;
        } else if met.is_none() {
            met = Some(seconds);
        }
    }
    let unknown = TimeToAccuracy {
        relative_error: accuracy,
        known: TimeKnown::Unknown,
        seconds: None,
        from_seconds: None,
        to_seconds: None,
    };
    if met.is_some() {
        return TimeToAccuracy { known: TimeKnown::Met, seconds: met, ..unknown };
    }
    let Some(foretold) = law.and_then(|law| law.seconds_to(accuracy, CONFIDENCE)) else { return unknown };
    let finite = |seconds: f64| Some(seconds).filter(|seconds| seconds.is_finite());
    TimeToAccuracy {
        known: TimeKnown::Extrapolated,
        seconds: Some(foretold.seconds),
        from_seconds: finite(foretold.from),
        to_seconds: finite(foretold.to),
        ..unknown
    }
}

/// Names of the files that have a job's convergence: a table in two formats, and a figure.
pub fn convergence_names(figures: impl Iterator<Item = FigureFormat>) -> impl Iterator<Item = String> {
    let tables = [CSV, JSON].into_iter().map(str::to_owned);
    tables.chain(figures.map(figure_name))
}

const CSV: &str = "convergence.csv";
const JSON: &str = "convergence.json";

fn figure_name(format: FigureFormat) -> String {
    format!("convergence.{}", format.suffix())
}

/// The files of [`convergence_names`], each with its name.
pub fn convergence_files(
    subject: &Subject,
    passes: &[PassReport],
    figures: impl Iterator<Item = FigureFormat>,
) -> Result<Vec<(String, Vec<u8>)>, RenderError> {
    let table = json!({
        "grids": grids_history(subject, passes), "views": views_history(subject, passes),
        "passes": passes, "next_after": null,
    });
    let drawing = convergence_figure(subject, passes);
    let figures = figures.map(|format| {
        let name = figure_name(format);
        let bytes = format.write(&drawing).map_err(|error| failed(&name, error))?;
        Ok((name, bytes))
    });
    let tables = [(CSV, convergence_csv(passes)), (JSON, table.to_string())];
    tables.into_iter().map(|(name, text)| Ok((name.to_owned(), text.into_bytes()))).chain(figures).collect()
}

/// Every pass of a job as CSV, one line each; an error that is not known yet is left empty.
pub fn convergence_csv(passes: &[PassReport]) -> String {
    let mut text = "passes,seconds,photons,rays,relative_error,view_relative_error,mean_lux,cpu_seconds\n".to_owned();
    let field = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    for pass in passes {
        let PassReport { passes, seconds, photons, rays, .. } = *pass;
        let others = [pass.relative_error, pass.view_relative_error, pass.mean_lux, pass.cpu_seconds].map(field);
        text += &format!("{passes},{seconds},{photons},{rays},{}\n", others.join(","));
    }
    text
}

/// The relative errors of a job against its seconds, as a figure.
pub fn convergence_figure(subject: &Subject, passes: &[PassReport]) -> Drawing {
    let series = [Outputs::Grids, Outputs::Views].into_iter().filter_map(|outputs| {
        let (history, law) = history(subject, outputs, passes)?;
        let points = passes.iter().filter_map(|pass| Some((pass.seconds, outputs.error(pass)?)));
        let times = history.times.iter().map(|time| TimeTo {
            error: time.relative_error,
            seconds: time.seconds,
            known: if time.known == TimeKnown::Met { Known::Met } else { Known::Extrapolated },
        });
        let foretold = history.foretold.iter().filter_map(|time| {
            let (seconds, from) = (time.seconds?, time.seconds_from?);
            Some(Foretold { error: time.relative_error, seconds, from, to: time.seconds_to })
        });
        Some(ErrorSeries {
            name: outputs.name(),
            points: points.collect(),
            law,
            asked: Some(history.asked_relative_error),
            times: times.collect(),
            foretold: foretold.collect(),
        })
    });
    figure::convergence::convergence(&heading(subject, passes), &series.collect::<Vec<_>>())
}

fn heading(subject: &Subject, passes: &[PassReport]) -> Heading {
    let so_far = passes.last().map(|last| {
        let noun = if last.passes == 1 { "pass" } else { "passes" };
        format!("after {} {noun} and {}", last.passes, duration(last.seconds, 3))
    });
    let of = |outputs: Outputs, method: Option<&str>| {
        let error = passes.iter().rev().find_map(|pass| outputs.error(pass));
        let error = error.map_or_else(String::new, |error| format!(": ±{} %", significant(100.0 * error, 2)));
        method.map(|method| format!("{} by {method}{error}", outputs.name()))
    };
    let methods = [of(Outputs::Grids, subject.grids_method()), of(Outputs::Views, subject.views_method()), so_far];
    let methods: Vec<String> = methods.into_iter().flatten().collect();
    Heading {
        title: format!("Convergence of {}", subject.name()),
        lines: vec![subject.circumstances(), methods.join(" · ")],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::subject::tests::document;

    fn subject() -> Subject {
        let subject = Subject::new(&document(), &json!(null));
        assert!(subject.document.is_some());
        subject
    }

    fn pass(passes: u64, relative_error: Option<f64>) -> PassReport {
        let seconds = 0.1 * passes as f64;
        PassReport { passes, seconds, relative_error, ..PassReport::default() }
    }

    /// Standard errors that fall by the square root, as half widths of intervals.
    fn halving(passes: u64) -> PassReport {
        let n = passes as f64;
        pass(passes, Some(0.05 / n.sqrt() * two_sided_student_quantile(0.95, n - 1.0)))
    }

    #[test]
    fn one_or_two_passes_foretell_nothing() {
        assert_eq!(grids_history(&subject(), &[pass(1, None)]), None);
        let two = grids_history(&subject(), &[pass(1, None), pass(2, Some(0.03))]).unwrap();
        assert_eq!((two.asked_relative_error, two.fit), (0.01, None));
        let known: Vec<_> = two.times.iter().map(|time| (time.known, time.seconds)).collect();
        assert_eq!(known[0], (TimeKnown::Met, Some(0.2)));
        assert_eq!(known[1..], [(TimeKnown::Unknown, None); 4]);
        assert_eq!(views_history(&subject(), &[pass(1, None), pass(2, Some(0.03))]), None);
    }

    #[test]
    fn many_passes_tell_the_exponent_and_the_time_left() {
        let passes: Vec<_> = (2..=100).map(halving).collect();
        let history = grids_history(&subject(), &passes).unwrap();
        let fit = history.fit.unwrap();
        assert!((fit.exponent + 0.5).abs() < 1e-9 && fit.degrees_of_freedom == 97, "{fit:?}");
        let [.., hundredth, half, tenth] = history.times[..] else { panic!() };
        assert_eq!(hundredth.known, TimeKnown::Met);
        assert_eq!([half.known, tenth.known], [TimeKnown::Extrapolated; 2]);
        // 25 times the accuracy of 0.5 % is 25 times the work
        assert!((tenth.seconds.unwrap() / half.seconds.unwrap() / 25.0 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn an_accuracy_counts_as_met_only_where_it_stays_met() {
        let errors = [0.06, 0.04, 0.055, 0.045, 0.03];
        let passes: Vec<_> = (2..).zip(errors).map(|(number, error)| pass(number, Some(error))).collect();
        let history = grids_history(&subject(), &passes).unwrap();
        assert_eq!((history.times[0].known, history.times[0].seconds), (TimeKnown::Met, Some(0.5)));
    }

    /// Grids that are accurate enough after 20 passes and not computed any further have the law of these passes.
    #[test]
    fn passes_of_other_outputs_leave_the_law_as_it_is() {
        let until = |last: u64| -> Vec<PassReport> {
            (2..=last)
                .map(|passes| PassReport {
                    relative_error: halving(passes.min(20)).relative_error,
                    ..pass(passes, None)
                })
                .collect()
        };
        let [ended, later] = [20, 60].map(|last| grids_history(&subject(), &until(last)).unwrap().fit);
        assert_eq!(ended, later);
    }

    #[test]
    fn the_figure_says_of_which_job_it_is() {
        let drawing = convergence_figure(&subject(), &(2..=20).map(halving).collect::<Vec<_>>());
        let texts: Vec<&str> = drawing.texts().collect();
        assert_eq!(texts[0], "Convergence of bath");
        assert!(texts.contains(&"after 20 passes and 2.00 s"), "{texts:?}");
    }
}

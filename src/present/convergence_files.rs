//! Convergence of a job as JSON, CSV and a figure: how its errors fall with time, and how long an accuracy takes.

use bytes::Bytes;
use serde::{Deserialize, Serialize};
use serde_json::json;
use utoipa::ToSchema;

use super::reader::failed;
use super::subject::Subject;
use crate::engine::convergence::ACCURACIES;
use crate::engine::passes::RenderError;
use crate::engine::progress::PassReport;
use crate::figure::convergence::{ErrorSeries, Foretold, Known, TimeTo};
use crate::figure::ticks::{duration, short, significant};
use crate::figure::{self, Drawing, FigureFormat, Heading};
use crate::predict::forecast::{CONFIDENCE, Forecaster, Outputs};
use crate::predict::predictions::{OutputPredictions, PredictedTime, Predictions};
use crate::statistics::interval::two_sided_student_quantile;
use crate::statistics::power_law::{ErrorPoint, PowerLaw};

/// Factor beyond the seconds of a job up to which its errors are extrapolated in the figure.
const FORETOLD: f64 = 8.0;

/// Errors of a job's grids or views as they fall with time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ErrorHistory {
    /// Relative error at which the job is to end.
    pub asked_relative_error: f64,
    /// Power law of the errors; null with fewer than four passes that reported one.
    pub fit: Option<ErrorFit>,
    /// Render seconds to relative errors of 5, 2, 1, 0.5 and 0.1 percent. Those to come are extrapolated from the last pass: with an
    /// exponent of about -1/2 while passes are few, with that of `fit` when they are many.
    pub times: Vec<TimeToAccuracy>,
    /// Times that were predicted for the planned method before the job ran, as if it were to compute these outputs alone: to relative
    /// errors of 10, 5, 2, 1, 0.5 and 0.1 percent, and last to the requested one. Empty where no prediction was requested.
    #[serde(default, alias = "foretold")]
    pub predicted_times: Vec<PredictedTime>,
}

/// Power law `error ~ seconds^exponent`, fitted with regard to the correlation of successive errors.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct ErrorFit {
    /// Exponent of the relative standard error: -1/2 for independent passes.
    pub exponent: f64,
    /// Standard error of the exponent.
    pub standard_error: f64,
    /// Degrees of freedom of the standard error, for Student's quantiles.
    pub degrees_of_freedom: usize,
    /// Student's quantile for these degrees of freedom: the 95 % interval of the exponent reaches this many standard errors to either side.
    pub coverage_factor: f64,
}

/// Time at which a relative error is reached.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
pub struct TimeToAccuracy {
    /// Relative error at the requested confidence.
    pub relative_error: f64,
    /// Origin of the time: measured, extrapolated, or unknown.
    pub known: TimeKnown,
    /// Render seconds of the whole job; null where unknown.
    pub seconds: Option<f64>,
    /// Lower end of the 95 % interval of the time, provided that the errors fall on as they did; null unless extrapolated.
    pub from_seconds: Option<f64>,
    /// Upper end of the 95 % interval of the time; null unless extrapolated.
    pub to_seconds: Option<f64>,
}

/// Origin of the time to an accuracy.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum TimeKnown {
    /// Measured: all passes from this time on had this error, or less.
    Met,
    /// Extrapolated from the errors so far: at most ten times the time that errors would take which fall with the square root of time.
    Extrapolated,
    /// Unknown: no pass had this error, and it cannot be extrapolated.
    Unknown,
}

impl Outputs {
    fn error(self, pass: &PassReport) -> Option<f64> {
        match self {
            Self::Grids => pass.relative_error,
            Self::Views => pass.view_relative_error,
        }
    }

    fn predicted(self, predictions: &Predictions) -> Option<&OutputPredictions> {
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

/// Returns how the errors of the grids and of the views fall; `None` without such outputs, or where no pass has reported an error.
pub fn histories(subject: &Subject, passes: &[PassReport]) -> [Option<ErrorHistory>; 2] {
    [Outputs::Grids, Outputs::Views].map(|outputs| history(subject, outputs, passes).map(|(history, _)| history))
}

fn history(subject: &Subject, outputs: Outputs, passes: &[PassReport]) -> Option<(ErrorHistory, Forecaster)> {
    let stop = subject.document.as_ref()?.stop_rule();
    let asked_relative_error = match outputs {
        Outputs::Grids => stop.relative_error,
        Outputs::Views => stop.view_relative_error,
    };
    let last = computed(outputs, passes).last()?.passes;
    // reported errors are half widths of intervals, whose quantile falls with the passes, too
    let points = computed(outputs, passes).map(|pass| {
        let quantile = two_sided_student_quantile(stop.confidence, outputs.degrees_of_freedom(pass));
        let error = outputs.error(pass).unwrap_or_default() / quantile;
        ErrorPoint { passes: pass.passes as f64, seconds: pass.seconds, error }
    });
    let fit = PowerLaw::fit(&points.collect::<Vec<_>>()).map(|law| ErrorFit {
        exponent: law.exponent,
        standard_error: law.standard_error,
        degrees_of_freedom: law.degrees,
        coverage_factor: two_sided_student_quantile(CONFIDENCE, law.degrees as f64),
    });
    let mut forecaster = Forecaster::new(stop, Some(0), Some(0));
    passes.iter().filter(|pass| pass.passes <= last).for_each(|pass| forecaster.take(pass));
    let times = ACCURACIES.iter().map(|accuracy| time_to(*accuracy, outputs, passes, &forecaster)).collect();
    let predicted = subject.predictions.as_ref().and_then(|predictions| outputs.predicted(predictions));
    let predicted_times = predicted.map_or_else(Vec::new, |table| table.of_plan().cloned().collect());
    Some((ErrorHistory { asked_relative_error, fit, times, predicted_times }, forecaster))
}

/// Selects the passes that computed these outputs and reported their error: where a further pass leaves the error as it is to the last bit,
/// it did not compute them, because they were as accurate as requested.
fn computed(outputs: Outputs, passes: &[PassReport]) -> impl Iterator<Item = &PassReport> {
    let mut last = None;
    passes.iter().filter(move |pass| {
        let error = outputs.error(pass);
        let is_new = error.is_some() && error != last;
        last = error;
        is_new
    })
}

/// Returns the time to an accuracy: that of the first pass from which on every one has it (a lucky one before does not count), or else an
/// extrapolated one.
fn time_to(accuracy: f64, outputs: Outputs, passes: &[PassReport], forecaster: &Forecaster) -> TimeToAccuracy {
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
    let Some(foretold) = forecaster.time_to(outputs, accuracy) else { return unknown };
    TimeToAccuracy {
        known: TimeKnown::Extrapolated,
        seconds: Some(foretold.seconds),
        from_seconds: Some(foretold.from),
        to_seconds: Some(foretold.to),
        ..unknown
    }
}

/// Returns the names of a job's convergence files: a table in two formats, and a figure.
pub fn convergence_names(figures: impl Iterator<Item = FigureFormat>) -> impl Iterator<Item = String> {
    let tables = [CSV, JSON].into_iter().map(str::to_owned);
    tables.chain(figures.map(figure_name))
}

const CSV: &str = "convergence.csv";
const JSON: &str = "convergence.json";

fn figure_name(format: FigureFormat) -> String {
    format!("convergence.{}", format.suffix())
}

/// Makes the files of [`convergence_names`], each with its name.
pub fn convergence_files(
    subject: &Subject,
    passes: &[PassReport],
    figures: impl Iterator<Item = FigureFormat>,
) -> Result<Vec<(String, Bytes)>, RenderError> {
    let [grids, views] = histories(subject, passes);
    let table = json!({ "grids": grids, "views": views, "passes": passes, "next_after": null });
    let drawing = convergence_figure(subject, passes);
    let figures = figures.map(|format| {
        let name = figure_name(format);
        let bytes = format.write(&drawing).map_err(|error| failed(&name, error))?;
        Ok((name, bytes.into()))
    });
    let tables = [(CSV, convergence_csv(passes)), (JSON, table.to_string())];
    tables.into_iter().map(|(name, text)| Ok((name.to_owned(), text.into()))).chain(figures).collect()
}

/// Writes the passes of a job as CSV, one line each; an error that is not known yet is left empty.
pub fn convergence_csv(passes: &[PassReport]) -> String {
    let mut text =
        "passes,seconds,photons,rays,relative_error,view_relative_error,mean_lux,cpu_seconds,degrees_of_freedom\n"
            .to_owned();
    let field = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
    for pass in passes {
        let PassReport { passes, seconds, photons, rays, .. } = *pass;
        let others =
            [pass.relative_error, pass.view_relative_error, pass.mean_lux, pass.cpu_seconds, pass.degrees_of_freedom];
        let others = others.map(field);
        text += &format!("{passes},{seconds},{photons},{rays},{}\n", others.join(","));
    }
    text
}

/// Draws the relative errors of a job against its render seconds.
pub fn convergence_figure(subject: &Subject, passes: &[PassReport]) -> Drawing {
    let series = [Outputs::Grids, Outputs::Views].into_iter().filter_map(|outputs| {
        let (history, forecaster) = history(subject, outputs, passes)?;
        let points = passes.iter().filter_map(|pass| Some((pass.seconds, outputs.error(pass)?)));
        let times = history.times.iter().map(|time| TimeTo {
            error: time.relative_error,
            seconds: time.seconds,
            known: if time.known == TimeKnown::Met { Known::Met } else { Known::Extrapolated },
        });
        let foretold = history.predicted_times.iter().filter_map(|time| {
            let (seconds, from, part) = (time.seconds?, time.seconds_from?, time.part_of_passes()?);
            let to = time.seconds_to.map(|to| part * to);
            Some(Foretold { error: time.relative_error, seconds: part * seconds, from: part * from, to })
        });
        Some(ErrorSeries {
            name: outputs.name(),
            points: points.collect(),
            course: forecaster.course(outputs, FORETOLD),
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
    let confidence = subject.document.as_ref().map_or(0.95, |document| document.stop.confidence);
    let of = |outputs: Outputs, method: Option<&String>| {
        let error = passes.iter().rev().find_map(|pass| outputs.error(pass));
        let error = error.map_or_else(String::new, |error| {
            let (error, confidence) = (significant(100.0 * error, 2), short((1e5 * confidence).round() / 1e3));
            format!(": ±{error} % (confidence {confidence} %)")
        });
        method.map(|method| format!("{} by {method}{error}", outputs.name()))
    };
    let methods =
        [of(Outputs::Grids, subject.grids_method.as_ref()), of(Outputs::Views, subject.views_method.as_ref()), so_far];
    let methods: Vec<String> = methods.into_iter().flatten().collect();
    subject.heading(format!("Convergence of {}", subject.name()), vec![subject.circumstances(), methods.join(" · ")])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::present::subject::tests::document;

    fn subject() -> Subject {
        let subject = Subject::new(&document(), &json!(null));
        assert!(subject.document.is_some());
        subject
    }

    fn grids_history(subject: &Subject, passes: &[PassReport]) -> Option<ErrorHistory> {
        let [grids, _] = histories(subject, passes);
        grids
    }

    fn pass(passes: u64, relative_error: Option<f64>) -> PassReport {
        let seconds = 0.1 * passes as f64;
        PassReport { passes, seconds, relative_error, ..PassReport::default() }
    }

    /// Returns a pass whose standard error falls with the square root of the passes, as the half width of an interval.
    fn halving(passes: u64) -> PassReport {
        let n = passes as f64;
        pass(passes, Some(0.05 / n.sqrt() * two_sided_student_quantile(0.95, n - 1.0)))
    }

    #[test]
    fn one_pass_foretells_nothing_and_two_the_square_root() {
        assert_eq!(grids_history(&subject(), &[pass(1, None)]), None);
        let two = grids_history(&subject(), &[pass(1, None), pass(2, Some(0.03))]).unwrap();
        assert_eq!((two.asked_relative_error, two.fit), (0.01, None));
        assert_eq!((two.times[0].known, two.times[0].seconds), (TimeKnown::Met, Some(0.2)));
        assert!(two.times[1..].iter().all(|time| time.known == TimeKnown::Extrapolated));
        assert_eq!(histories(&subject(), &[pass(1, None), pass(2, Some(0.03))])[1], None);
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
        // five times the accuracy of 0.5 % is 25 times the work, but for Student's quantile
        assert!((tenth.seconds.unwrap() / half.seconds.unwrap() / 25.0 - 1.0).abs() < 0.03);
    }

    /// Errors of 2 to 15 passes of 30 seeds, each made by a few sensors that share their noise: their fitted slopes would predict anything.
    /// The reported times lie within a factor of ten of the square root, and are those that the event of the last pass has.
    #[test]
    fn few_passes_foretell_by_the_square_root_whatever_the_seed() {
        let mut state = 7u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((state >> 33) as f64 + 0.5) / (1u64 << 31) as f64
        };
        let mut steepest_fit = f64::NEG_INFINITY;
        for seed in 0..30u64 {
            let (mut sum, mut squares) = (0.0, 0.0);
            let mut passes = vec![pass(1, None)];
            for number in 1..=8 + seed % 8 {
                let value = (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos();
                (sum, squares) = (sum + value, squares + value * value);
                let n = number as f64;
                if number > 1 {
                    let error = 0.03 * ((squares - sum * sum / n) / (n * (n - 1.0))).sqrt();
                    passes.push(pass(number, Some(error * two_sided_student_quantile(0.95, n - 1.0))));
                }
            }
            let history = grids_history(&subject(), &passes).unwrap();
            steepest_fit = steepest_fit.max(history.fit.unwrap().exponent);
            let last = passes.last().unwrap();
            let by_the_root = |error: f64| last.seconds * (last.relative_error.unwrap() / error).powi(2);
            for time in history.times.iter().filter(|time| time.known != TimeKnown::Met) {
                let seconds = time.seconds.unwrap();
                let share = seconds / by_the_root(time.relative_error);
                assert!((0.1..=10.0).contains(&share), "seed {seed}: {time:?} is {share} times that of the root");
                let [from, to] = [time.from_seconds.unwrap(), time.to_seconds.unwrap()];
                assert!(from <= seconds && to >= seconds && to <= 1e3 * seconds, "seed {seed}: {time:?}");
            }
            let mut forecaster = Forecaster::new(subject().document.unwrap().stop_rule(), Some(8), None);
            let (last, before) = passes.split_last().unwrap();
            before.iter().for_each(|pass| forecaster.take(pass));
            let event = forecaster.after(last, None).grids.unwrap().seconds_to;
            for (told, time) in event.iter().zip(&history.times).filter(|(_, time)| time.known != TimeKnown::Met) {
                assert_eq!((told.relative_error, told.seconds), (time.relative_error, time.seconds));
            }
        }
        assert!(steepest_fit > -0.2, "no seed is one that a fit alone would be misled by: {steepest_fit}");
    }

    #[test]
    fn an_accuracy_counts_as_met_only_where_it_stays_met() {
        let errors = [0.06, 0.04, 0.055, 0.045, 0.03];
        let passes: Vec<_> = (2..).zip(errors).map(|(number, error)| pass(number, Some(error))).collect();
        let history = grids_history(&subject(), &passes).unwrap();
        assert_eq!((history.times[0].known, history.times[0].seconds), (TimeKnown::Met, Some(0.5)));
    }

    /// Grids that are accurate enough after 20 passes, and not computed any further, keep the power law of these passes.
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

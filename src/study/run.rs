//! Rendering of a study's jobs one after the other in this process.

use std::time::Instant;

use super::compare::Values;
use super::outcome::{Refused, RenderedReference, Run, RunCost, Study};
use super::request::{RunKey, StudyRequest};
use crate::document::{DocumentErrors, JobDocument, MeshSource};
use crate::engine::cancel::Stop;
use crate::engine::passes::{RenderError, Rendered};
use crate::figure::ticks::{duration, significant};
use crate::present::prepared::{Prepared, prepare_document};

/// Reason why a study cannot be completed.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The job, or the numbers of the study, are invalid.
    #[error(transparent)]
    Document(#[from] DocumentErrors),
    /// A run failed to render.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// The study was cancelled.
    #[error("cancelled after {done} of {of} runs")]
    Cancelled {
        /// Number of finished runs, the reference included.
        done: usize,
        /// Number of all runs of the study.
        of: usize,
    },
    /// The reference has no values.
    #[error("the reference by {method} has no values after {seconds} s: allow more seconds, or choose another method")]
    NoReference {
        /// Method of the reference.
        method: String,
        /// Seconds of rendering that the reference was allowed.
        seconds: f64,
    },
}

/// Progress of a study: the next run, and the number of finished ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Step<'a> {
    /// Number of finished runs, the reference included.
    pub done: usize,
    /// Number of all runs, the reference included.
    pub of: usize,
    /// Description of the next run.
    pub next: String,
    /// Estimated seconds that the remaining runs take; `None` before the first run has ended.
    pub seconds_left: Option<f64>,
    /// Outcome of the runs so far; `None` until the reference is available.
    pub so_far: Option<&'a Study>,
}

/// Runs a study; calls `heard` before each of its runs, and at the end.
pub fn run(
    request: &StudyRequest,
    meshes: &dyn MeshSource,
    stop: &Stop,
    heard: &mut dyn FnMut(&Step<'_>),
) -> Result<Study, StudyError> {
    request.check()?;
    let prepare = |document: &serde_json::Value| -> Result<Prepared, DocumentErrors> {
        prepare_document(&JobDocument::parse(document.to_string().as_bytes())?, meshes)
    };
    let known = request.reference.known();
    let reference = if known.is_none() { Some(prepare(&request.reference())?) } else { None };
    let Judged { able, refused } = able(request, prepare)?;
    let methods: Vec<String> = able.iter().map(|(method, _)| method.clone()).collect();
    let confidence = able.first().map(|(_, prepared)| prepared.stop.confidence);
    drop(able);
    let keys: Vec<RunKey> = request.runs(&methods).collect();
    let of = usize::from(reference.is_some()) + keys.len();
    let (truth, told) = match (known, &reference) {
        (Some(known), _) => (known, None),
        (None, Some(reference)) => {
            let (method, seconds) = (reference.method_names(), reference.stop.max_seconds);
            let next = format!("reference by {method}, at most {}", duration(seconds, 2));
            heard(&Step { done: 0, of, next, seconds_left: None, so_far: None });
            let rendered = rendered(reference, stop)?;
            if stop.reason().is_some() {
                return Err(StudyError::Cancelled { done: 0, of });
            }
            let Some((truth, found)) = rendered else { return Err(StudyError::NoReference { method, seconds }) };
            (truth, Some(RenderedReference { method, seconds: found.spent.seconds }))
        }
        (None, None) => (Values::default(), None),
    };
    let mut study = Study {
        reference: told,
        reference_variance: truth.relative_variance(),
        confidence: reference.as_ref().map(|reference| reference.stop.confidence).or(confidence).unwrap_or_default(),
        runs: Vec::new(),
        refused,
    };
    let before = of - keys.len();
    for (number, key) in keys.iter().enumerate() {
        let done = before + number;
        let next = format!("{} to {} %", key.method, significant(100.0 * key.relative_error, 2));
        let seconds_left = seconds_left(&study.runs, &keys[number..], request.seconds);
        heard(&Step { done, of, next, seconds_left, so_far: Some(&study) });
        if stop.reason().is_some() {
            return Err(StudyError::Cancelled { done, of });
        }
        let start = Instant::now();
        let prepared = prepare(&request.run(key))?;
        let set_up_seconds = start.elapsed().as_secs_f64();
        let rendered = rendered(&prepared, stop)?;
        if stop.reason().is_some() {
            return Err(StudyError::Cancelled { done, of });
        }
        if let Some((values, found)) = rendered {
            let accuracy = prepared.accuracy(&found.estimate);
            let cost = RunCost {
                computed_by: prepared.method_names(),
                set_up_seconds,
                seconds: found.spent.seconds,
                cpu_seconds: found.spent.cpu(),
                passes: found.estimate.passes,
                told: accuracy.grids.filter(|error| error.is_finite()),
                stopped_by: found.stopped_by,
            };
            let deviation = values.deviation(&truth, prepared.stop.confidence);
            study.runs.push(Run::new(key.clone(), cost, deviation));
        }
    }
    heard(&Step { done: of, of, next: "done".to_owned(), seconds_left: Some(0.0), so_far: Some(&study) });
    Ok(study)
}

/// Estimates the seconds that the runs to come take, `most` at most for each, from the runs that have ended: the mean of those of
/// the same method and error; or else of the same method, scaled by the squared ratio of the errors; or else of all.
fn seconds_left(ended: &[Run], to_come: &[RunKey], most: f64) -> Option<f64> {
    let seconds = |run: &Run| run.set_up_seconds + run.seconds;
    let mean = |of: &dyn Fn(&Run) -> Option<f64>| {
        let each: Vec<f64> = ended.iter().filter_map(of).collect();
        (!each.is_empty()).then(|| each.iter().sum::<f64>() / each.len() as f64)
    };
    let of_one = |key: &RunKey| {
        let alike = mean(&|run| (run.method == key.method && run.asked == key.relative_error).then(|| seconds(run)));
        let of_method =
            || mean(&|run| (run.method == key.method).then(|| seconds(run) * (run.asked / key.relative_error).powi(2)));
        alike.or_else(of_method).or_else(|| mean(&|run| Some(seconds(run)))).map(|seconds| seconds.min(most))
    };
    to_come.iter().map(of_one).sum()
}

/// Methods of a study: those that can compute its job, each with the prepared job, and those that refuse it.
pub struct Judged<T> {
    /// Methods that can compute the job, in the order of the request, each with the prepared job.
    pub able: Vec<(String, T)>,
    /// Methods that refuse the job.
    pub refused: Vec<Refused>,
}

/// Prepares the job at the first error by each method of a study, and separates the methods that can compute it from those that
/// refuse it.
///
/// A fault that does not concern the method is an error, with a pointer into the job.
pub fn able<T>(
    request: &StudyRequest,
    prepare: impl Fn(&serde_json::Value) -> Result<T, DocumentErrors>,
) -> Result<Judged<T>, DocumentErrors> {
    let (mut able, mut refused) = (Vec::new(), Vec::new());
    for method in &request.methods {
        let first = RunKey { method: method.clone(), relative_error: request.relative_errors[0], seed: 0 };
        match prepare(&request.run(&first)) {
            Ok(prepared) => able.push((method.clone(), prepared)),
            Err(errors) => {
                let reason = of_method_alone(errors)?;
                refused.push(Refused { method: method.clone(), reason });
            }
        }
    }
    Ok(Judged { able, refused })
}

/// Returns the reason why a method refuses a job; an error if any fault does not concern the method.
pub fn of_method_alone(errors: DocumentErrors) -> Result<String, DocumentErrors> {
    match errors.0.iter().all(|error| error.pointer.starts_with("/method")) {
        true => Ok(errors.0.into_iter().map(|error| error.detail).collect::<Vec<_>>().join("; ")),
        false => Err(errors),
    }
}

/// Renders a job to its end and returns its values; `None` if it ended before its first pass.
fn rendered(prepared: &Prepared, stop: &Stop) -> Result<Option<(Values, Rendered)>, StudyError> {
    // the seconds of a run end the run, not the study
    let of_run = Stop::default();
    let rendered = prepared.render(&of_run, &mut |_, _| {
        if let Some(reason) = stop.reason() {
            of_run.raise(reason);
        }
    })?;
    Ok((rendered.estimate.passes > 0).then(|| (Values::of_estimate(&rendered.estimate), rendered)))
}

#[cfg(test)]
mod tests {
    use super::super::outcome::tests::run;
    use super::*;

    #[test]
    fn what_is_left_is_foretold_by_what_has_ended() {
        let key = |method: &str, relative_error: f64| RunKey { method: method.to_owned(), relative_error, seed: 1 };
        let to_come = [key("a", 0.05), key("a", 0.01), key("b", 0.05), key("a", 0.005)];
        assert_eq!(seconds_left(&[], &to_come, 60.0), None);
        // half a second of each is for the set-up
        let ended = [run("a", 0.05, 1.5, 0.05), run("a", 0.05, 3.5, 0.05), run("a", 0.02, 9.5, 0.02)];
        // as long as the first two; 25 and 4 times as long; as all on average; and the largest number of seconds allowed
        let of_second = (25.0 * 2.0 + 25.0 * 4.0 + 4.0 * 10.0) / 3.0;
        let left = seconds_left(&ended, &to_come, 100.0).unwrap();
        assert!((left - (3.0 + of_second + 16.0 / 3.0 + 100.0)).abs() < 1e-9, "{left}");
        assert_eq!(seconds_left(&ended, &[], 100.0), Some(0.0));
    }
}

//! The jobs of a study, rendered one after the other in this process.

use std::time::Instant;

use super::compare::Values;
use super::outcome::{Refused, RenderedReference, Run, RunCost, Study};
use super::request::{RunKey, StudyRequest};
use crate::document::{DocumentErrors, JobDocument, MeshSource};
use crate::job::cancel::Stop;
use crate::job::chunk::{RenderError, Rendered};
use crate::job::prepare::{Prepared, prepare_document};

/// A study that cannot be done.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The job, or the numbers of the study.
    #[error(transparent)]
    Document(#[from] DocumentErrors),
    /// A run failed.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// Somebody ended it.
    #[error("the study was cancelled after {0} of its runs")]
    Cancelled(usize),
    /// There is nothing to compare with.
    #[error("the reference by {method} has no values after {seconds} s: allow more seconds, or another method")]
    NoReference {
        /// Method of the reference.
        method: String,
        /// Seconds that it was allowed.
        seconds: f64,
    },
}

/// How far a study is: what comes next, and how much of it is done, in runs.
#[derive(Clone, Debug, PartialEq)]
pub struct Step {
    /// Runs that are done.
    pub done: usize,
    /// All runs, the reference among them.
    pub of: usize,
    /// What is next.
    pub next: String,
}

/// Runs a study; `heard` is told before each of its runs.
pub fn run(
    request: &StudyRequest,
    meshes: &dyn MeshSource,
    stop: &Stop,
    heard: &mut dyn FnMut(&Step),
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
    let of = usize::from(reference.is_some()) + request.runs(&methods).count();
    let mut done = 0;
    let mut next = |done: usize, next: String| heard(&Step { done, of, next });
    let (truth, told) = match (known, &reference) {
        (Some(known), _) => (known, None),
        (None, Some(reference)) => {
            next(done, format!("reference by {}", reference.method_names()));
            let rendered = rendered(reference, stop)?;
            if stop.reason().is_some() {
                return Err(StudyError::Cancelled(done));
            }
            done += 1;
            let method = reference.method_names();
            let Some((truth, found)) = rendered else {
                return Err(StudyError::NoReference { method, seconds: reference.stop.max_seconds });
            };
            (truth, Some(RenderedReference { method, seconds: found.spent.seconds }))
        }
        (None, None) => (Values::default(), None),
    };
    let mut runs = Vec::new();
    for key in request.runs(&methods) {
        if stop.reason().is_some() {
            return Err(StudyError::Cancelled(done));
        }
        next(done, format!("{} to {} %", key.method, 100.0 * key.relative_error));
        let start = Instant::now();
        let prepared = prepare(&request.run(&key))?;
        let set_up_seconds = start.elapsed().as_secs_f64();
        if let Some((values, found)) = rendered(&prepared, stop)? {
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
            runs.push(Run::new(key, cost, &values, &truth, prepared.stop.confidence));
        }
        done += 1;
    }
    next(done, "done".to_owned());
    Ok(Study {
        reference: told,
        reference_variance: truth.relative_variance(),
        confidence: reference.map(|reference| reference.stop.confidence).or(confidence).unwrap_or_default(),
        runs,
        refused,
    })
}

/// The methods of a study: those that can compute its job, each with what was prepared of it, and the others.
pub struct Judged<T> {
    /// Methods in the order of the request.
    pub able: Vec<(String, T)>,
    /// Methods that refuse the job.
    pub refused: Vec<Refused>,
}

/// The methods of a study that can compute its job, each with its job to the first error, and those that cannot.
///
/// What is wrong with anything but the method is an error, with a pointer into the job.
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

/// The reason why a method refuses a job; what does not concern the method is an error still.
pub fn of_method_alone(errors: DocumentErrors) -> Result<String, DocumentErrors> {
    match errors.0.iter().all(|error| error.pointer.starts_with("/method")) {
        true => Ok(errors.0.into_iter().map(|error| error.detail).collect::<Vec<_>>().join("; ")),
        false => Err(errors),
    }
}

/// A job that is rendered to its end, with its values; `None` where it ended before its first pass.
fn rendered(prepared: &Prepared, stop: &Stop) -> Result<Option<(Values, Rendered)>, StudyError> {
    // its seconds end a run, and not the study
    let of_run = Stop::default();
    let rendered = prepared.render(&of_run, &mut |_, _| {
        if let Some(reason) = stop.reason() {
            of_run.raise(reason);
        }
    })?;
    Ok((rendered.estimate.passes > 0).then(|| (Values::of_estimate(&rendered.estimate), rendered)))
}

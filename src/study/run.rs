//! The jobs of a study, rendered one after the other in this process.

use std::time::Instant;

use super::outcome::{Refused, Run, Study};
use super::request::StudyRequest;
use crate::document::{DocumentErrors, JobDocument, MeshSource};
use crate::estimate::stopping::LEAST_SHARE_OF_MEAN;
use crate::estimate::{Estimate, GridEstimate};
use crate::job::cancel::Stop;
use crate::job::chunk::RenderError;
use crate::job::prepare::{Prepared, prepare_document};
use crate::job::progress::StoppedBy;
use crate::statistics::interval::two_sided_student_quantile;

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

/// Values with their standard errors, all grids in a row.
struct Values {
    lux: Vec<f64>,
    errors: Vec<f64>,
    /// Sensors of each grid.
    grids: Vec<usize>,
    passes: u64,
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
    let reference = prepare(&request.reference())?;
    let (mut able, mut refused) = (Vec::new(), Vec::new());
    for method in &request.methods {
        match prepare(&request.run(method, request.relative_errors[0], 0)) {
            Ok(_) => able.push(method),
            // only what concerns the method is its own fault
            Err(errors) if errors.0.iter().all(|error| error.pointer.starts_with("/method")) => {
                let reason = errors.0.into_iter().map(|error| error.detail).collect::<Vec<_>>().join("; ");
                refused.push(Refused { method: method.clone(), reason });
            }
            Err(errors) => return Err(errors.into()),
        }
    }
    let of = 1 + able.len() * request.relative_errors.len() * request.seeds as usize;
    let mut done = 0;
    let mut next = |done: usize, next: String| heard(&Step { done, of, next });
    next(done, format!("reference by {}", reference.method_names()));
    let truth = rendered(&reference, stop)?;
    if stop.reason().is_some() {
        return Err(StudyError::Cancelled(done));
    }
    let (truth, reference_run) = truth.ok_or_else(|| StudyError::NoReference {
        method: reference.method_names(),
        seconds: reference.stop.max_seconds,
    })?;
    done += 1;
    let mut runs = Vec::new();
    // all methods by turns, so that what else the machine does meets them alike
    for seed in 0..request.seeds {
        for error in &request.relative_errors {
            for method in &able {
                if stop.reason().is_some() {
                    return Err(StudyError::Cancelled(done));
                }
                next(done, format!("{method} to {} %", 100.0 * error));
                let start = Instant::now();
                let prepared = prepare(&request.run(method, *error, seed))?;
                let set_up_seconds = start.elapsed().as_secs_f64();
                if let Some((values, (estimate, spent, stopped_by))) = rendered(&prepared, stop)? {
                    let accuracy = prepared.accuracy(&estimate);
                    runs.push(Run {
                        method: (*method).clone(),
                        computed_by: prepared.method_names(),
                        asked: *error,
                        seed,
                        set_up_seconds,
                        seconds: spent.seconds,
                        cpu_seconds: spent.cpu_seconds.unwrap_or(spent.seconds),
                        passes: estimate.passes,
                        told: accuracy.grids.filter(|error| error.is_finite()),
                        squared_error: squared_error(&values, &truth),
                        covered: covered(&values, &truth, prepared.stop.confidence),
                        met: matches!(stopped_by, StoppedBy::RelativeError | StoppedBy::Exact),
                    });
                }
                done += 1;
            }
        }
    }
    next(done, "done".to_owned());
    let (_, spent, _) = &reference_run;
    Ok(Study {
        reference_method: reference.method_names(),
        reference_seconds: spent.seconds,
        reference_variance: relative_variance(&truth),
        confidence: reference.stop.confidence,
        runs,
        refused,
    })
}

type Rendered = (Estimate, crate::job::spent::Spent, StoppedBy);

/// The values of a job that is rendered to its end; `None` where it ended before its first pass.
fn rendered(prepared: &Prepared, stop: &Stop) -> Result<Option<(Values, Rendered)>, StudyError> {
    // its seconds end a run, and not the study
    let of_run = Stop::default();
    let rendered = prepared.render(&of_run, &mut |_, _| {
        if let Some(reason) = stop.reason() {
            of_run.raise(reason);
        }
    })?;
    if rendered.estimate.passes == 0 {
        return Ok(None);
    }
    let grids = &rendered.estimate.grids;
    let each = |of: fn(&GridEstimate, usize) -> f64| -> Vec<f64> {
        grids.iter().flat_map(|grid| (0..grid.sensors.len()).map(move |sensor| of(grid, sensor))).collect()
    };
    let values = Values {
        lux: each(GridEstimate::illuminance_lux),
        errors: each(GridEstimate::standard_error_lux),
        grids: grids.iter().map(|grid| grid.sensors.len()).collect(),
        passes: rendered.estimate.passes_of_grids(),
    };
    Ok(Some((values, (rendered.estimate, rendered.spent, rendered.stopped_by))))
}

/// What the errors of each sensor are relative to: its true value, or a hundredth of its grid's mean where that is more.
fn scales(truth: &Values) -> Vec<f64> {
    let mut rest = truth.lux.as_slice();
    let mut scales = Vec::with_capacity(rest.len());
    for sensors in &truth.grids {
        let (grid, others) = rest.split_at(*sensors);
        let mean = grid.iter().sum::<f64>() / grid.len() as f64;
        scales.extend(grid.iter().map(|lux| lux.max(LEAST_SHARE_OF_MEAN * mean)));
        rest = others;
    }
    scales
}

/// Mean square of the relative deviations from the reference.
fn squared_error(values: &Values, truth: &Values) -> f64 {
    let deviations = values.lux.iter().zip(&truth.lux).zip(scales(truth)).filter(|(_, scale)| *scale > 0.0);
    mean(deviations.map(|((value, truth), scale)| ((value - truth) / scale).powi(2)))
}

/// Mean of the squared relative standard errors of the reference: what it adds to squared errors.
fn relative_variance(truth: &Values) -> f64 {
    let known = truth.errors.iter().zip(scales(truth)).filter(|(error, scale)| error.is_finite() && *scale > 0.0);
    mean(known.map(|(error, scale)| (error / scale).powi(2)))
}

/// Share of the sensors whose interval, the reference's error in it, holds the reference; `None` where nothing tells errors.
fn covered(values: &Values, truth: &Values, confidence: f64) -> Option<f64> {
    let quantile = two_sided_student_quantile(confidence, values.passes.max(2) as f64 - 1.0);
    let sensors = values.lux.iter().zip(&values.errors).zip(truth.lux.iter().zip(&truth.errors));
    let told = sensors.filter(|((_, error), _)| error.is_finite());
    let holds = |((value, error), (truth, truth_error)): ((&f64, &f64), (&f64, &f64))| {
        let error = libm::hypot(*error, if truth_error.is_finite() { *truth_error } else { 0.0 });
        // closed forms of both agree to rounding
        f64::from((value - truth).abs() <= quantile * error + 1e-9 * truth.abs())
    };
    let held: Vec<f64> = told.map(holds).collect();
    (!held.is_empty()).then(|| mean(held.into_iter()))
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0_f64);
    for value in values {
        sum += value;
        count += 1.0;
    }
    sum / count.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values(lux: &[f64], error: f64) -> Values {
        Values { lux: lux.to_vec(), errors: vec![error; lux.len()], grids: vec![lux.len()], passes: 1_000_000 }
    }

    /// One percent off at 100 lx, two at 50 lx; a dark sensor is judged against a hundredth of the mean.
    #[test]
    fn errors_are_relative_to_the_reference() {
        let truth = values(&[100.0, 50.0], 0.5);
        assert!((squared_error(&values(&[101.0, 49.0], 0.0), &truth) - 0.5 * (1e-4 + 4e-4)).abs() < 1e-15);
        assert!((relative_variance(&truth) - 0.5 * (2.5e-5 + 1e-4)).abs() < 1e-15);
        let dark = values(&[200.0, 0.0], 0.0);
        assert!((squared_error(&values(&[200.0, 0.01], 0.0), &dark) - 0.5 * 1e-4).abs() < 1e-15);
        assert_eq!(squared_error(&values(&[0.0], 0.0), &values(&[0.0], 0.0)), 0.0);
    }

    #[test]
    fn intervals_hold_the_reference_or_not() {
        let truth = values(&[10.0, 10.0, 10.0, 10.0], 0.0);
        // 1.96 standard errors
        assert_eq!(covered(&values(&[10.19, 9.81, 10.21, 9.9], 0.1), &truth, 0.95), Some(0.75));
        assert_eq!(covered(&values(&[10.19; 4], f64::INFINITY), &truth, 0.95), None);
        assert_eq!(covered(&values(&[10.0; 4], 0.0), &truth, 0.95), Some(1.0));
    }
}

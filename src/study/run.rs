//! Studies whose jobs are rendered one after the other in this process.

use std::time::Instant;

use serde_json::Value;

use super::compare::Values;
use super::outcome::{Ended, Run, Study};
use super::outcomes::{Found, JobOutcome, Outcomes};
use super::part::{JobKey, StudyPart};
use super::picture_request::{PictureKey, PictureRequest};
use super::pictures::{Film, PICTURES_JSON, Sheets};
use super::request::{RunKey, StudyRequest};
use super::runner::{self, Runner, StudyPlan};
use crate::document::{DocumentErrors, FileSource, JobDocument};
use crate::engine::cancel::Stop;
use crate::engine::passes::{RenderError, Rendered};
use crate::engine::progress::Progress;
use crate::figure::ticks::{duration, significant};
use crate::output::OutputError;
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

/// Progress of a study: the next job, and the number of finished ones.
#[derive(Clone, Debug)]
pub struct Step<'a> {
    /// Number of finished jobs, the reference included.
    pub done: usize,
    /// Number of all jobs, the reference included.
    pub of: usize,
    /// Description of the next job.
    pub next: String,
    /// Remaining time; `None` before there is an estimate.
    pub left: Option<Left>,
    /// Outcomes of the jobs so far.
    pub so_far: &'a Outcomes,
}

/// Remaining time in seconds: an estimate or an upper bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Left {
    /// Estimate from the runs that have ended.
    About(f64),
    /// Sum of the largest times that the jobs may take.
    AtMost(f64),
}

/// Pictures of a study of views.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// Outcomes of the jobs.
    pub outcomes: Outcomes,
    sheets: Sheets,
}

/// Runs a study of grids; calls `heard` before each of its runs, and at the end.
pub fn run(
    request: &StudyRequest,
    meshes: &dyn FileSource,
    stop: &Stop,
    heard: &mut dyn FnMut(&Step<'_>),
) -> Result<Study, StudyError> {
    request.check()?;
    let mut here = InProcess::new(meshes, stop, heard);
    here.outcomes.truth = request.reference.known();
    runner::run(Some(request), None, &mut here)?;
    here.tell("done".to_owned(), Some(Left::About(0.0)));
    Ok(here.outcomes.study().unwrap_or_default())
}

/// Renders the pictures of a study of views; calls `heard` before each of its jobs, and at the end.
pub fn run_pictures(
    request: &PictureRequest,
    meshes: &dyn FileSource,
    stop: &Stop,
    heard: &mut dyn FnMut(&Step<'_>),
) -> Result<Pictures, StudyError> {
    let mut errors = Vec::new();
    request.wanted.check(&request.job, "", &mut errors);
    if !errors.is_empty() {
        return Err(DocumentErrors(errors).into());
    }
    let mut here = InProcess { views: Some(request), ..InProcess::new(meshes, stop, heard) };
    runner::run(None, Some(request), &mut here)?;
    here.tell("done".to_owned(), Some(Left::AtMost(0.0)));
    Ok(Pictures { outcomes: here.outcomes, sheets: here.sheets })
}

impl Pictures {
    /// Returns all files, as names and contents: for each view a sheet of pictures of equal time and one of crops at several
    /// accuracies, and the times and errors of all pictures.
    pub fn files(self, request: &PictureRequest) -> Result<Vec<(String, Vec<u8>)>, OutputError> {
        let mut files = self.sheets.files(request)?;
        files.extend(self.outcomes.pictures_json(request).map(|json| (PICTURES_JSON.to_owned(), json)));
        Ok(files)
    }
}

/// Runner that renders the jobs of a study one after the other, and compares them at once.
struct InProcess<'a> {
    meshes: &'a dyn FileSource,
    stop: &'a Stop,
    heard: &'a mut dyn FnMut(&Step<'_>),
    /// Request of the pictures, if the study is one of views.
    views: Option<&'a PictureRequest>,
    /// Keys of all jobs.
    keys: Vec<JobKey>,
    outcomes: Outcomes,
    sheets: Sheets,
}

impl Runner for InProcess<'_> {
    type Error = StudyError;

    fn prepare(&self, document: &Value) -> Result<Prepared, DocumentErrors> {
        prepare_document(&JobDocument::from_files(document.clone(), self.meshes)?, self.meshes)
    }

    fn in_request(&self, errors: DocumentErrors, _: Option<&JobKey>) -> DocumentErrors {
        errors
    }

    fn begin(&mut self, plan: &StudyPlan<'_>) -> Result<(), StudyError> {
        self.keys = plan.keys();
        self.outcomes.refused.clone_from(&plan.refused);
        Ok(())
    }

    fn run(&mut self, plan: &StudyPlan<'_>, key: JobKey) -> Result<(), StudyError> {
        let start = Instant::now();
        let prepared = self.prepare(&plan.document(&key))?;
        let set_up_seconds = start.elapsed().as_secs_f64();
        self.tell(words(&key, &prepared), self.left(plan));
        self.go_on()?;
        let found = rendered(&prepared, self.stop)?;
        self.go_on()?;
        let (estimate, accuracy) = (&found.estimate, prepared.accuracy(&found.estimate));
        let (method, seconds, succeeded) = (prepared.method_names(), prepared.stop.max_seconds, estimate.passes > 0);
        if !succeeded && (key.is_reference() || key.picture == Some(PictureKey::Reference)) {
            return Err(StudyError::NoReference { method, seconds });
        }
        let progress = Progress {
            passes: estimate.passes,
            seconds: found.spent.seconds,
            cpu_seconds: Some(found.spent.cpu()),
            relative_error: accuracy.grids.filter(|error| error.is_finite()),
            view_relative_error: accuracy.views.filter(|error| error.is_finite()),
            ..Progress::default()
        };
        let part = StudyPart { key, computed_by: method, set_up_seconds };
        let ended = Ended { succeeded, progress, stopped_by: Some(found.stopped_by) };
        self.outcomes.confidence = prepared.stop.confidence;
        let found = match self.views {
            Some(request) => {
                let films = estimate.views.iter().filter(|_| succeeded).map(Film::of_estimate).collect();
                Found::Pictures(self.sheets.push(request, (&part, &ended), films).map_err(not_drawn)?)
            }
            None => self.outcomes.compare(&part.key, succeeded.then(|| Values::of_estimate(estimate))),
        };
        self.outcomes.jobs.push(JobOutcome { part, ended: Some(ended), found: Some(found) });
        Ok(())
    }
}

impl<'a> InProcess<'a> {
    fn new(meshes: &'a dyn FileSource, stop: &'a Stop, heard: &'a mut dyn FnMut(&Step<'_>)) -> Self {
        let (outcomes, sheets) = (Outcomes::default(), Sheets::default());
        Self { meshes, stop, heard, views: None, keys: Vec::new(), outcomes, sheets }
    }

    fn tell(&mut self, next: String, left: Option<Left>) {
        let (done, of) = (self.outcomes.jobs.len(), self.keys.len());
        (self.heard)(&Step { done, of, next, left, so_far: &self.outcomes });
    }

    fn go_on(&self) -> Result<(), StudyError> {
        let (done, of) = (self.outcomes.jobs.len(), self.keys.len());
        if self.stop.reason().is_some() { Err(StudyError::Cancelled { done, of }) } else { Ok(()) }
    }

    /// Estimates the time that the jobs to come take; `None` before the first run.
    fn left(&self, plan: &StudyPlan<'_>) -> Option<Left> {
        let keys = &self.keys[self.outcomes.jobs.len()..];
        if self.views.is_some() {
            return Some(Left::AtMost(keys.iter().map(|key| plan.most_seconds(key)).sum()));
        }
        let most = keys.first().map_or(0.0, |key| plan.most_seconds(key));
        let to_come = keys.iter().filter_map(|key| key.run.as_ref());
        Some(Left::About(seconds_left(&self.outcomes.study()?.runs, to_come, most)?))
    }
}

/// Describes a job that comes next.
fn words(key: &JobKey, prepared: &Prepared) -> String {
    let (computed_by, seconds) = (prepared.method_names(), duration(prepared.stop.max_seconds, 2));
    let to = |error: f64| format!("to {} %", significant(100.0 * error, 2));
    match (&key.run, &key.picture) {
        (Some(run), _) => format!("{} {}", run.method, to(run.relative_error)),
        (None, Some(PictureKey::Accuracy { relative_error })) => format!("{computed_by} {}", to(*relative_error)),
        (None, Some(PictureKey::EqualTime { .. })) => format!("{computed_by} for {seconds}"),
        (None, Some(PictureKey::Reference) | None) => format!("reference by {computed_by}, at most {seconds}"),
    }
}

/// Estimates the seconds that the runs to come take, `most` at most for each, from the runs that have ended: the mean of those of
/// the same method and error; or else of the same method, scaled by the squared ratio of the errors; or else of all.
fn seconds_left<'a>(ended: &[Run], to_come: impl Iterator<Item = &'a RunKey>, most: f64) -> Option<f64> {
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
    to_come.map(of_one).sum()
}

/// Renders a job to its end.
fn rendered(prepared: &Prepared, stop: &Stop) -> Result<Rendered, RenderError> {
    // the seconds of a job end the job, not the study
    let of_job = Stop::default();
    prepared.render(&of_job, &mut |_, _| {
        if let Some(reason) = stop.reason() {
            of_job.raise(reason);
        }
    })
}

fn not_drawn(error: OutputError) -> RenderError {
    RenderError::Output { file: "pictures".to_owned(), reason: error.to_string() }
}

#[cfg(test)]
mod tests {
    use super::super::outcome::tests::run;
    use super::*;

    #[test]
    fn what_is_left_is_foretold_by_what_has_ended() {
        let key = |method: &str, relative_error: f64| RunKey { method: method.to_owned(), relative_error, seed: 1 };
        let to_come = [key("a", 0.05), key("a", 0.01), key("b", 0.05), key("a", 0.005)];
        assert_eq!(seconds_left(&[], to_come.iter(), 60.0), None);
        // half a second of each is for the set-up
        let ended = [run("a", 0.05, 1.5, 0.05), run("a", 0.05, 3.5, 0.05), run("a", 0.02, 9.5, 0.02)];
        // as long as the first two; 25 and 4 times as long; as all on average; and the largest number of seconds allowed
        let of_second = (25.0 * 2.0 + 25.0 * 4.0 + 4.0 * 10.0) / 3.0;
        let left = seconds_left(&ended, to_come.iter(), 100.0).unwrap();
        assert!((left - (3.0 + of_second + 16.0 / 3.0 + 100.0)).abs() < 1e-9, "{left}");
        assert_eq!(seconds_left(&ended, [].iter(), 100.0), Some(0.0));
    }
}

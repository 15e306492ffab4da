//! Jobs of a study that have ended, compared with their references.

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::compare::{Deviation, Values};
use super::outcome::{Ended, Refused, RenderedReference, Run, Study};
use super::part::{JobKey, StudyPart};
use super::picture_request::{PictureKey, PictureRequest};
use super::pictures::Picture;

/// Comparison of a job that has ended with its reference, as it is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// Mean of the squared relative standard errors of the reference.
    Reference(Option<f64>),
    /// Deviation of a run from the reference.
    Run(Deviation),
    /// Actual relative error of each view of a job of pictures; null where no pass ended in time.
    Pictures(Vec<Option<f64>>),
    /// No result: no pass ended in time, or the files of the job are gone.
    Nothing,
}

/// Job of a study with its results so far.
#[derive(Clone, Debug)]
pub struct JobOutcome {
    /// Purpose of the job.
    pub part: StudyPart,
    /// End of the job; `None` before it, and for one that was cancelled or deleted.
    pub ended: Option<Ended>,
    /// Comparison with the reference; `None` before it was made.
    pub found: Option<Found>,
}

/// Jobs of a study with their results so far.
#[derive(Clone, Debug, Default)]
pub struct Outcomes {
    /// Jobs in their order.
    pub jobs: Vec<JobOutcome>,
    /// Methods that cannot compute the job.
    pub refused: Vec<Refused>,
    /// Confidence of errors and intervals.
    pub confidence: f64,
    /// Values of the reference of the runs, given or of its job; `None` as long as they are not known.
    pub truth: Option<Values>,
}

impl JobOutcome {
    /// Returns the end of a job that has results.
    pub fn succeeded(&self) -> Option<&Ended> {
        self.ended.as_ref().filter(|ended| ended.succeeded)
    }

    /// Returns the end of a job of pictures. One whose time limit came before its first pass has failed, but keeps its place among
    /// them.
    pub fn shown(&self) -> Option<&Ended> {
        self.ended.as_ref().filter(|ended| ended.succeeded || ended.progress.passes == 0)
    }
}

impl Outcomes {
    /// Compares the values of a run with the reference, which comes first; `None` for values means that the job has none.
    pub fn compare(&mut self, key: &JobKey, values: Option<Values>) -> Found {
        match (values, &self.truth) {
            (Some(values), _) if key.is_reference() => {
                let variance = values.relative_variance();
                self.truth = Some(values);
                Found::Reference(variance)
            }
            (Some(values), Some(truth)) => Found::Run(values.deviation(truth, self.confidence)),
            _ => Found::Nothing,
        }
    }

    /// Returns the indexes of the jobs whose values are needed to compare the runs that are not compared yet, the reference first;
    /// none if there is no reference to compare with (yet).
    pub fn missing(&self) -> Vec<usize> {
        let is_missing = |job: &JobOutcome| job.found.is_none() && job.succeeded().is_some();
        let runs = (0..self.jobs.len()).filter(|index| {
            let job = &self.jobs[*index];
            job.part.key.run.is_some() && is_missing(job)
        });
        let Some(reference) = self.jobs.iter().position(|job| job.part.key.is_reference()) else {
            return runs.collect();
        };
        let job = &self.jobs[reference];
        if job.succeeded().is_none() || job.found == Some(Found::Nothing) {
            return Vec::new();
        }
        let runs: Vec<usize> = runs.collect();
        let is_needed = job.found.is_none() || !runs.is_empty();
        is_needed.then_some(reference).into_iter().chain(runs).collect()
    }

    /// Returns the outcome of the runs that have ended; `None` as long as the reference has no values.
    pub fn study(&self) -> Option<Study> {
        let (reference, reference_variance) = match self.jobs.iter().find(|job| job.part.key.is_reference()) {
            None => (None, self.truth.as_ref()?.relative_variance()),
            Some(job) => {
                let (ended, Some(Found::Reference(variance))) = (job.succeeded()?, &job.found) else { return None };
                let method = job.part.computed_by.clone();
                (Some(RenderedReference { method, seconds: ended.progress.seconds }), *variance)
            }
        };
        let runs = self.jobs.iter().filter_map(|job| match &job.found {
            Some(Found::Run(deviation)) => Run::new(&job.part, job.succeeded()?, *deviation),
            _ => None,
        });
        let (runs, confidence, refused) = (runs.collect(), self.confidence, self.refused.clone());
        Some(Study { reference, reference_variance, confidence, runs, refused })
    }

    /// Returns the entries of all pictures that have ended and are compared.
    pub fn pictures(&self, request: &PictureRequest) -> Vec<Picture> {
        let mut pictures = Vec::new();
        for job in &self.jobs {
            let (Some(Found::Pictures(errors)), Some(ended)) = (&job.found, job.shown()) else { continue };
            let views = errors.iter().enumerate();
            pictures
                .extend(views.filter_map(|(view, error)| Picture::new(&job.part, ended, request.view(view), *error)));
        }
        pictures
    }

    /// Returns the times and errors of all pictures as JSON; `None` as long as their reference has no pictures.
    pub fn pictures_json(&self, request: &PictureRequest) -> Option<Vec<u8>> {
        let (reference, ended) = self.picture_reference()?;
        let reference = json!({ "method": reference.computed_by, "seconds": ended.progress.seconds });
        let told = json!({
            "request": request, "reference": reference, "pictures": self.pictures(request), "refused": self.refused,
        });
        Some(format!("{told}\n").into_bytes())
    }

    /// Returns the job that pictures are compared with, once it has some.
    pub fn picture_reference(&self) -> Option<(&StudyPart, &Ended)> {
        let reference = self.jobs.iter().find(|job| job.part.key.picture == Some(PictureKey::Reference))?;
        Some((&reference.part, reference.shown().filter(|ended| ended.progress.passes > 0)?))
    }
}

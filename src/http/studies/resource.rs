//! Studies as they are answered.

use std::collections::BTreeMap;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use super::part::StudyPart;
use crate::job::progress::StoppedBy;
use crate::job::store::*;
use crate::study::StudyRequest;
use crate::study::files::StudyReport;
use crate::study::outcome::Refused;
use crate::study::picture_request::{PictureKey, PicturesWanted};
use crate::study::pictures::{PICTURES_JSON, accuracies, equal_time};

/// A study: what was asked for, how far it is, what came out so far.
#[derive(Serialize, ToSchema)]
pub struct StudyResource {
    #[serde(flatten)]
    pub summary: StudySummary,
    /// The request as understood, all defaults filled in.
    pub request: StudyRequest,
    /// Methods that cannot compute the job.
    pub refused: Vec<Refused>,
    /// Its jobs in the order in which they were queued, the reference first.
    pub jobs: Vec<StudyJob>,
    /// What the runs that are done say; null until the reference is done, or where it gave no values.
    pub results: Option<StudyReport>,
}

/// A study in a list.
#[derive(Serialize, ToSchema)]
pub struct StudySummary {
    pub id: Uuid,
    /// Name of its job.
    pub name: Option<String>,
    pub status: StudyStatus,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    /// Number of its jobs, the reference among them.
    pub runs: usize,
    /// Number of its jobs that have ended.
    pub runs_done: usize,
    pub links: StudyLinks,
}

/// State of a study, which is that of its jobs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyStatus {
    /// No job of it has begun.
    Queued,
    /// Some of its jobs have begun, and not all have ended.
    Running,
    /// All of its jobs have ended, and there are results.
    Finished,
    /// The reference gave no values, or no run did.
    Failed,
    /// Some of its jobs were cancelled or deleted, and the others have ended.
    Cancelled,
}

/// A job of a study.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub struct StudyJob {
    pub id: Uuid,
    pub part: StudyJobPart,
    /// The method that was asked for; null of references, and of a picture at an accuracy, which is by the job's own.
    pub method: Option<String>,
    /// The methods that compute it.
    pub computed_by: String,
    /// Relative error that was asked for, at the job's confidence; null of references and of a picture of equal time.
    #[serde(rename = "asked_relative_error")]
    pub asked: Option<f64>,
    /// Seconds of rendering that a picture of equal time was given; null of all others.
    pub asked_seconds: Option<f64>,
    /// Number of its seed, from 0; null of all but runs.
    pub seed: Option<u64>,
    /// State of the job; null where it was deleted.
    pub status: Option<JobStatus>,
    /// What ended it.
    pub stopped_by: Option<StoppedBy>,
    /// Path of the job.
    pub link: String,
}

/// What a job of a study is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyJobPart {
    /// All runs are compared with it.
    Reference,
    /// One method to one error with one seed.
    Run,
    /// All pictures are compared with it.
    PictureReference,
    /// Views by one method after a time, or at an accuracy.
    Picture,
}

/// Paths of what belongs to a study.
#[derive(Serialize, ToSchema)]
pub struct StudyLinks {
    #[serde(rename = "self")]
    pub this: String,
    /// Stream of its events.
    pub events: String,
    /// The runs put together, a line for each method and error.
    pub csv: String,
    /// Actual error against processor seconds, both logarithmic.
    pub svg: String,
    /// The same figure in pixels.
    pub png: String,
    /// The same figure for print.
    pub pdf: String,
    /// The study's pictures; absent where none are asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<PictureLinks>,
    pub cancel: String,
}

/// Paths of the pictures of a study.
#[derive(Serialize, ToSchema)]
pub struct PictureLinks {
    /// Times and errors of all pictures.
    pub json: String,
    /// Pictures of each view by its name.
    pub views: BTreeMap<String, ViewPictureLinks>,
}

/// Paths of the pictures of one view; absent where none of their kind are asked for.
#[derive(Serialize, ToSchema)]
pub struct ViewPictureLinks {
    /// By each method after the same time, the reference last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equal_time_png: Option<String>,
    /// Crops at each accuracy, the reference last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracies_png: Option<String>,
}

/// What a request says of its pictures.
#[derive(Deserialize)]
struct RequestOfPictures {
    pictures: Option<PicturesWanted>,
    job: JobOfPictures,
}

#[derive(Deserialize)]
struct JobOfPictures {
    #[serde(default)]
    views: Vec<NamedView>,
}

#[derive(Deserialize)]
struct NamedView {
    name: String,
}

impl PictureLinks {
    fn of(study: &StoredStudy, this: &str) -> Option<Self> {
        // the rest of the request is long
        let request: RequestOfPictures = serde_json::from_str(&study.request).ok()?;
        let (wanted, views) = (request.pictures?, request.job.views);
        let names = views.iter().map(|view| view.name.as_str());
        let path = |of: &[f64], file: String| (!of.is_empty()).then(|| format!("{this}/files/{file}"));
        let links = |name: &str| ViewPictureLinks {
            equal_time_png: path(&wanted.seconds, equal_time(name)),
            accuracies_png: path(&wanted.relative_errors, accuracies(name)),
        };
        let views = names.map(|name| (name.to_owned(), links(name))).collect();
        Some(Self { json: format!("{this}/files/{PICTURES_JSON}"), views })
    }
}

impl StudySummary {
    /// A study with its jobs as they are.
    pub fn new(study: &StoredStudy, jobs: &[StudyJob]) -> Self {
        let this = format!("/v1/studies/{}", study.id);
        let [csv, svg, png, pdf] = ["csv", "svg", "png", "pdf"].map(|suffix| format!("{this}/files/study.{suffix}"));
        Self {
            id: study.id,
            name: study.name.clone(),
            status: StudyStatus::of(jobs),
            created_at: Timestamp::from_millisecond(study.created_at).ok(),
            runs: jobs.len(),
            runs_done: jobs.iter().filter(|job| job.has_ended()).count(),
            links: StudyLinks {
                csv,
                svg,
                png,
                pdf,
                pictures: PictureLinks::of(study, &this),
                cancel: format!("{this}/cancel"),
                events: format!("{this}/events"),
                this,
            },
        }
    }
}

impl StudyJob {
    /// A job with this part in a study; `head` is `None` where it was deleted.
    pub fn new(id: Uuid, part: &StudyPart, head: Option<&JobHead>) -> Self {
        let kind = match (&part.run, &part.picture) {
            (Some(_), _) => StudyJobPart::Run,
            (None, None) => StudyJobPart::Reference,
            (None, Some(PictureKey::Reference)) => StudyJobPart::PictureReference,
            (None, Some(_)) => StudyJobPart::Picture,
        };
        let (method, asked_seconds, asked_of_picture) = match &part.picture {
            Some(PictureKey::EqualTime { method, seconds }) => (Some(method), Some(*seconds), None),
            Some(PictureKey::Accuracy { relative_error }) => (None, None, Some(*relative_error)),
            Some(PictureKey::Reference) | None => (None, None, None),
        };
        Self {
            id,
            part: kind,
            method: part.run.as_ref().map(|run| &run.method).or(method).cloned(),
            computed_by: part.computed_by.clone(),
            asked: part.run.as_ref().map(|run| run.relative_error).or(asked_of_picture),
            asked_seconds,
            seed: part.run.as_ref().map(|run| run.seed),
            status: head.map(|head| head.status),
            stopped_by: head.and_then(|head| head.stopped_by),
            link: format!("/v1/jobs/{id}"),
        }
    }

    fn has_ended(&self) -> bool {
        self.status.is_none_or(JobStatus::is_final)
    }
}

impl StudyStatus {
    /// The name in JSON, and of the event that ends the study's stream.
    pub fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Finished => "finished",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    /// True once all of its jobs have ended.
    pub fn is_final(self) -> bool {
        !matches!(self, Self::Queued | Self::Running)
    }

    /// State of a study by its jobs.
    pub fn of(jobs: &[StudyJob]) -> Self {
        let any = |part: StudyJobPart, status: Option<JobStatus>| {
            jobs.iter().any(|job| job.part == part && job.status == status)
        };
        let (succeeded, failed) = (Some(JobStatus::Succeeded), Some(JobStatus::Failed));
        if jobs.iter().all(|job| job.status == Some(JobStatus::Queued)) {
            Self::Queued
        } else if !jobs.iter().all(StudyJob::has_ended) {
            Self::Running
        } else if jobs.iter().any(|job| matches!(job.status, None | Some(JobStatus::Cancelled))) {
            Self::Cancelled
        } else if any(StudyJobPart::Reference, failed) || !any(StudyJobPart::Run, succeeded) {
            Self::Failed
        } else {
            Self::Finished
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_study_is_what_its_jobs_are() {
        use JobStatus::{Cancelled, Failed, Queued, Running, Succeeded};
        let job = |part: StudyJobPart, status: Option<JobStatus>| StudyJob {
            id: Uuid::nil(),
            part,
            method: None,
            computed_by: String::new(),
            asked: None,
            asked_seconds: None,
            seed: None,
            status,
            stopped_by: None,
            link: String::new(),
        };
        let status = |reference: JobStatus, runs: [Option<JobStatus>; 2]| {
            let runs = runs.map(|status| job(StudyJobPart::Run, status));
            let [first, second] = runs;
            StudyStatus::of(&[job(StudyJobPart::Reference, Some(reference)), first, second])
        };
        for (reference, runs, expected) in [
            (Queued, [Some(Queued), Some(Queued)], StudyStatus::Queued),
            (Running, [Some(Queued), Some(Queued)], StudyStatus::Running),
            (Succeeded, [Some(Queued), Some(Queued)], StudyStatus::Running),
            (Succeeded, [Some(Cancelled), Some(Running)], StudyStatus::Running),
            (Succeeded, [Some(Cancelled), Some(Succeeded)], StudyStatus::Cancelled),
            (Succeeded, [None, Some(Succeeded)], StudyStatus::Cancelled),
            (Succeeded, [Some(Failed), Some(Succeeded)], StudyStatus::Finished),
            (Succeeded, [Some(Failed), Some(Failed)], StudyStatus::Failed),
            (Failed, [Some(Succeeded), Some(Succeeded)], StudyStatus::Failed),
            (Succeeded, [Some(Succeeded), Some(Succeeded)], StudyStatus::Finished),
        ] {
            assert_eq!(status(reference, runs), expected, "{reference:?} {runs:?}");
        }
        // values that were given need no job
        assert_eq!(StudyStatus::of(&[job(StudyJobPart::Run, Some(Succeeded))]), StudyStatus::Finished);
    }
}

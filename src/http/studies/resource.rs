//! Studies in the form of JSON answers.

use std::collections::BTreeMap;

use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use utoipa::ToSchema;
use uuid::Uuid;

use crate::engine::progress::StoppedBy;
use crate::http::job_sets::set_events::SetStatus;
use crate::queue::store::*;
use crate::study::StudyRequest;
use crate::study::files::StudyReport;
use crate::study::outcome::Refused;
use crate::study::part::StudyPart;
use crate::study::picture_request::{PictureKey, PicturesWanted};
use crate::study::pictures::{PICTURES_JSON, accuracies, equal_time};

/// Study with its request, its jobs, and its results so far.
#[derive(Serialize, ToSchema)]
pub struct StudyResource {
    #[serde(flatten)]
    pub summary: StudySummary,
    /// The request as understood, all defaults filled in.
    pub request: StudyRequest,
    /// Methods that cannot compute the job, with reasons.
    pub refused: Vec<Refused>,
    /// Jobs of the study in the order in which they were queued, the reference first.
    pub jobs: Vec<StudyJob>,
    /// Results of the runs that are done; null until the reference is done, or if it gave no values.
    pub results: Option<StudyReport>,
}

/// A study in a list.
#[derive(Serialize, ToSchema)]
pub struct StudySummary {
    pub id: Uuid,
    /// Name of the study's job.
    pub name: Option<String>,
    pub status: StudyStatus,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    /// Number of the study's jobs, the reference included.
    pub runs: usize,
    /// Number of the study's jobs that have ended.
    pub runs_done: usize,
    pub links: StudyLinks,
}

/// State of a study, which follows from the states of its jobs.
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
    /// Requested method; null for references, and for a picture at an accuracy, which the job's own method makes.
    pub method: Option<String>,
    /// Names of the methods that compute the job.
    pub computed_by: String,
    /// Requested relative error at the job's confidence; null for references and for a picture of equal time.
    #[serde(rename = "asked_relative_error")]
    pub asked: Option<f64>,
    /// Requested rendering time in seconds of a picture of equal time; null for all others.
    pub asked_seconds: Option<f64>,
    /// Number of the run's seed, from 0; null for jobs that are no runs.
    pub seed: Option<u64>,
    /// State of the job; null where it was deleted.
    pub status: Option<JobStatus>,
    /// Reason why the job ended.
    pub stopped_by: Option<StoppedBy>,
    /// Path of the job.
    pub link: String,
}

/// Purpose of a job in a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum StudyJobPart {
    /// Reference with which all runs are compared.
    Reference,
    /// Run of one method to one error with one seed.
    Run,
    /// Reference with which all pictures are compared.
    PictureReference,
    /// Pictures of the views by one method after a time, or at an accuracy.
    Picture,
}

/// Paths of the resources that belong to a study.
#[derive(Serialize, ToSchema)]
pub struct StudyLinks {
    #[serde(rename = "self")]
    pub this: String,
    /// Path of the stream of the study's events.
    pub events: String,
    /// Path of the table of the runs, with a line for each method and error.
    pub csv: String,
    /// Path of the figure of actual error against processor seconds, both logarithmic, as SVG.
    pub svg: String,
    /// Path of the figure of actual error against processor seconds in pixels.
    pub png: String,
    /// Path of the figure of actual error against processor seconds for print.
    pub pdf: String,
    /// Paths of the study's pictures; absent if none are requested.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pictures: Option<PictureLinks>,
    pub cancel: String,
}

/// Paths of the pictures of a study.
#[derive(Serialize, ToSchema)]
pub struct PictureLinks {
    /// Path of the times and errors of all pictures.
    pub json: String,
    /// Paths of the pictures of each view, by the view's name.
    pub views: BTreeMap<String, ViewPictureLinks>,
}

/// Paths of the pictures of one view, each absent if none of its kind are requested.
#[derive(Serialize, ToSchema)]
pub struct ViewPictureLinks {
    /// Path of the pictures by each method after the same time, the reference last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub equal_time_png: Option<String>,
    /// Path of the crops at each accuracy, the reference last.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracies_png: Option<String>,
}

/// Fields of a study's record that concern its pictures.
#[derive(Deserialize)]
struct RecordOfPictures {
    request: RequestOfPictures,
}

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
    fn of(study: &JobSet, this: &str) -> Option<Self> {
        // the rest of the request is long
        let RecordOfPictures { request } = serde_json::from_str(&study.about).ok()?;
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
    /// Summarises a study from the present state of its jobs.
    pub fn new(study: &JobSet, jobs: &[StudyJob]) -> Self {
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
    /// Describes a job with this part in a study; `head` is `None` if the job was deleted.
    pub fn new(id: Uuid, part: &StudyPart, head: Option<&JobHead>) -> Self {
        let key = &part.key;
        let kind = match (&key.run, &key.picture) {
            (Some(_), _) => StudyJobPart::Run,
            (None, None) => StudyJobPart::Reference,
            (None, Some(PictureKey::Reference)) => StudyJobPart::PictureReference,
            (None, Some(_)) => StudyJobPart::Picture,
        };
        let (method, asked_seconds, asked_of_picture) = match &key.picture {
            Some(PictureKey::EqualTime { method, seconds }) => (Some(method), Some(*seconds), None),
            Some(PictureKey::Accuracy { relative_error }) => (None, None, Some(*relative_error)),
            Some(PictureKey::Reference) | None => (None, None, None),
        };
        Self {
            id,
            part: kind,
            method: key.run.as_ref().map(|run| &run.method).or(method).cloned(),
            computed_by: part.computed_by.clone(),
            asked: key.run.as_ref().map(|run| run.relative_error).or(asked_of_picture),
            asked_seconds,
            seed: key.run.as_ref().map(|run| run.seed),
            status: head.map(|head| head.status),
            stopped_by: head.and_then(|head| head.stopped_by),
            link: format!("/v1/jobs/{id}"),
        }
    }

    fn has_ended(&self) -> bool {
        self.status.is_none_or(JobStatus::is_final)
    }
}

impl SetStatus for StudyStatus {
    const QUEUED: Self = Self::Queued;
    const RUNNING: Self = Self::Running;

    fn name(self) -> &'static str {
        match self {
            Self::Queued => "queued",
            Self::Running => "running",
            Self::Finished => "finished",
            Self::Failed => "failed",
            Self::Cancelled => "cancelled",
        }
    }

    fn is_final(self) -> bool {
        !matches!(self, Self::Queued | Self::Running)
    }
}

impl StudyStatus {
    /// Derives the state of a study from its jobs.
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

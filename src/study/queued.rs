//! Studies whose jobs are queued together.

use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::outcome::Refused;
use super::part::{JobKey, StudyPart};
use super::picture_request::PictureKey;
use super::request::StudyRequest;
use super::runner::{self, Runner, StudyPlan};
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, JobDocument};
use crate::present::prepared::{Prepared, prepare_document};
use crate::queue::owner::Owner;
use crate::queue::store::{NewJobSet, NewMember, NewMembers, SetBounds, SetKind};
use crate::queue::uploaded_files::UploadedFiles;

/// Fraction of the memory limit of a job that may be used to put pictures together: both may be in memory at the same time.
const SHARE_OF_PICTURES: f64 = 0.25;

/// Data that a study keeps beside its jobs.
#[derive(Serialize, Deserialize)]
pub struct StudyRecord {
    /// Request with all defaults filled in.
    pub request: StudyRequest,
    /// Methods that refuse the job, with their reasons.
    pub refused: Vec<Refused>,
    /// Confidence of its errors and intervals.
    pub confidence: f64,
}

/// Runner that collects the jobs of a study, to be queued together.
struct Queued<'a> {
    request: &'a StudyRequest,
    meshes: &'a UploadedFiles,
    bounds: &'a SetBounds,
    refused: Vec<Refused>,
    confidence: f64,
    members: NewMembers,
    /// Parts of the members in the study.
    parts: Vec<StudyPart>,
}

/// Prepares a study with all of its jobs, within these bounds. The owner, the client and the key of the study are left empty.
pub fn new_study(
    request: StudyRequest,
    meshes: &UploadedFiles,
    bounds: &SetBounds,
) -> Result<NewJobSet, DocumentErrors> {
    let (refused, members, parts) = (Vec::new(), NewMembers::default(), Vec::new());
    let mut queued = Queued { request: &request, meshes, bounds, refused, confidence: 0.0, members, parts };
    runner::run(Some(&request), request.pictures(bounds.most_seconds).as_ref(), &mut queued)?;
    let Queued { refused, confidence, members: mut jobs, parts, .. } = queued;
    jobs.list.iter_mut().zip(&parts).for_each(|(job, part)| job.part = to_value(part));
    Ok(NewJobSet {
        owner: Owner::default(),
        kind: SetKind::Study,
        name: request.job["name"].as_str().map(str::to_owned),
        about: to_value(&StudyRecord { request, refused, confidence }).to_string(),
        idempotency_key: None,
        body_hash: String::new(),
        client: String::new(),
        uploads: meshes.loaded(),
        jobs,
    })
}

impl Runner for Queued<'_> {
    type Error = DocumentErrors;

    fn prepare(&self, document: &Value) -> Result<Prepared, DocumentErrors> {
        let prepared = prepare_document(&JobDocument::from_files(document.clone(), self.meshes)?, self.meshes)?;
        prepared.check_memory(self.bounds.memory_bytes)?;
        Ok(prepared)
    }

    fn in_request(&self, DocumentErrors(errors): DocumentErrors, key: Option<&JobKey>) -> DocumentErrors {
        let is_reference = key.is_some_and(|key| key.is_reference() || key.picture == Some(PictureKey::Reference));
        let moved = errors.into_iter().map(|error| {
            let of_method = error.pointer.strip_prefix("/method").filter(|_| is_reference);
            let of_method = of_method.map(|rest| format!("/reference/method{rest}"));
            let pointer = of_method.unwrap_or_else(|| format!("/job{}", error.pointer));
            FieldError { pointer, ..error }
        });
        DocumentErrors(moved.collect())
    }

    fn begin(&mut self, plan: &StudyPlan<'_>) -> Result<(), DocumentErrors> {
        self.refused.clone_from(&plan.refused);
        if plan.methods.is_empty() {
            // those of the views come after those of the grids
            return Err(none_able(self.request, &plan.refused[..self.request.methods.len()]));
        }
        check_number(self.request, plan, self.bounds.most.of_set())?;
        let bytes = plan.most_bytes_of_pictures();
        let most = self.bounds.memory_bytes as f64 * SHARE_OF_PICTURES;
        if bytes > most {
            let detail = format!(
                "comparing the pictures of a view would take about {:.2} GB of memory, but this service allows {:.2} \
                 GB: request fewer seconds or methods, or smaller views",
                bytes / 1e9,
                most / 1e9
            );
            return Err(FieldError::new("/pictures/seconds", detail).coded(FieldErrorCode::TooMany).into());
        }
        Ok(())
    }

    fn run(&mut self, plan: &StudyPlan<'_>, key: JobKey) -> Result<(), DocumentErrors> {
        // seeds change neither plan nor costs: each method is prepared once for each error
        let alike = key.run.as_ref().and_then(|run| {
            let is_alike = |part: &StudyPart| {
                let other = part.key.run.as_ref();
                other.is_some_and(|other| other.method == run.method && other.relative_error == run.relative_error)
            };
            let place = self.parts.iter().position(is_alike)?;
            Some((self.members.list.get(place)?.with_seed(self.request.seed(run)), self.parts[place].clone()))
        });
        let (member, part) = match alike {
            Some(alike) => alike,
            None => self.member(&plan.document(&key)).map_err(|errors| self.in_request(errors, Some(&key)))?,
        };
        self.members.push(member, "/seeds")?;
        self.parts.push(StudyPart { key, ..part });
        Ok(())
    }
}

impl Queued<'_> {
    /// Prepares a job from its document, without the fields that it shares with the jobs before. Each of a study is rendered, because
    /// its times are compared.
    fn member(&mut self, document: &Value) -> Result<(NewMember, StudyPart), DocumentErrors> {
        let start = Instant::now();
        let prepared = self.prepare(document)?;
        let set_up_seconds = start.elapsed().as_secs_f64();
        self.confidence = prepared.stop.confidence;
        let part = StudyPart { key: JobKey::default(), computed_by: prepared.method_names(), set_up_seconds };
        Ok((self.members.divide(document, &prepared), part))
    }
}

/// Refuses a study of more than `most` jobs before they are prepared.
fn check_number(request: &StudyRequest, plan: &StudyPlan<'_>, most: usize) -> Result<(), DocumentErrors> {
    let [reference, runs, pictures] = plan.numbers();
    if runs.saturating_add(reference + pictures) <= most {
        return Ok(());
    }
    let detail = format!(
        "a study may have at most {most} jobs on this service, but {} suitable methods, {} errors and {} seeds make {runs}, and \
         its pictures {pictures} more",
        plan.methods.len(),
        request.relative_errors.len(),
        request.seeds,
    );
    Err(FieldError::new("/seeds", detail).coded(FieldErrorCode::TooMany).into())
}

/// Returns an error for each method: the reason why it cannot compute the job.
fn none_able(request: &StudyRequest, refused: &[Refused]) -> DocumentErrors {
    let place = |method: &str| request.methods.iter().position(|name| name == method).unwrap_or_default();
    let error = |refused: &Refused| {
        FieldError::new(
            format!("/methods/{}", place(&refused.method)),
            format!("{}: {}", refused.method, refused.reason),
        )
        .coded(FieldErrorCode::MethodRefuses)
    };
    DocumentErrors(refused.iter().map(error).collect())
}

/// Converts a value to JSON; our own types always serialise.
fn to_value(value: &impl serde::Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

//! Studies whose jobs are queued together.

use std::time::Instant;

use serde_json::{Map, Value};

use super::outcome::Refused;
use super::part::{JobKey, StudyPart};
use super::picture_request::PictureKey;
use super::request::StudyRequest;
use super::runner::{self, Runner, StudyPlan};
use crate::document::result::PlanResult;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, JobDocument};
use crate::present::prepared::{Prepared, prepare_document};
use crate::queue::meshes::UploadedMeshes;
use crate::queue::owner::Owner;
use crate::queue::shared_fields::SharedFields;
use crate::queue::store::{NewStudy, NewStudyJob};

/// Largest number of jobs of one study.
const MOST_JOBS: usize = 200;
/// Largest number of bytes that the jobs of one study have in their rows and first events beside the fields that they share.
const MOST_BYTES: usize = 16 << 20;
/// Fraction of the memory limit of a job that may be used to put pictures together: both may be in memory at the same time.
const SHARE_OF_PICTURES: f64 = 0.25;

/// Runner that collects the jobs of a study, to be queued together.
struct Queued<'a> {
    request: &'a StudyRequest,
    meshes: &'a UploadedMeshes,
    memory_bytes: u64,
    refused: Vec<Refused>,
    confidence: f64,
    gathered: Gathered,
}

/// Job of a study that can be queued.
#[derive(Clone)]
struct Ready {
    job: NewStudyJob,
    part: StudyPart,
    /// Bytes that the job's row takes, and its events.
    bytes: usize,
}

/// Jobs of a study that can be queued, and the fields that they share.
#[derive(Default)]
struct Gathered {
    submitted: SharedFields,
    document: SharedFields,
    plan: SharedFields,
    jobs: Vec<Ready>,
    bytes: usize,
}

/// Prepares a study with all of its jobs, none of which may take more than `memory_bytes` or `most_seconds` of rendering. The client
/// and the key of the study are left empty.
pub fn new_study(
    request: &StudyRequest,
    meshes: &UploadedMeshes,
    memory_bytes: u64,
    most_seconds: f64,
) -> Result<NewStudy, DocumentErrors> {
    let (refused, gathered) = (Vec::new(), Gathered::default());
    let mut queued = Queued { request, meshes, memory_bytes, refused, confidence: 0.0, gathered };
    runner::run(Some(request), request.pictures(most_seconds).as_ref(), &mut queued)?;
    let Queued { refused, confidence, gathered: Gathered { submitted, document, plan, jobs, .. }, .. } = queued;
    let with_part = |ready: Ready| NewStudyJob { part: to_value(&ready.part), ..ready.job };
    Ok(NewStudy {
        owner: Owner::default(),
        name: request.job["name"].as_str().map(str::to_owned),
        request: to_value(request).to_string(),
        refused: to_value(&refused),
        confidence,
        idempotency_key: None,
        body_hash: String::new(),
        client: String::new(),
        uploads: meshes.loaded(),
        submitted,
        document,
        plan,
        jobs: jobs.into_iter().map(with_part).collect(),
    })
}

impl Runner for Queued<'_> {
    type Error = DocumentErrors;

    fn prepare(&self, document: &Value) -> Result<Prepared, DocumentErrors> {
        let prepared = prepare_document(&JobDocument::from_files(document.clone(), self.meshes)?, self.meshes)?;
        prepared.check_memory(self.memory_bytes)?;
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
        check_number(self.request, plan)?;
        let bytes = plan.most_bytes_of_pictures();
        let most = self.memory_bytes as f64 * SHARE_OF_PICTURES;
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
            let is_alike = |ready: &&Ready| {
                let other = ready.part.key.run.as_ref();
                other.is_some_and(|other| other.method == run.method && other.relative_error == run.relative_error)
            };
            Some(self.gathered.jobs.iter().find(is_alike)?.with_seed(self.request.seed(run)))
        });
        let ready = match alike {
            Some(ready) => ready,
            None => self.ready(&plan.document(&key)).map_err(|errors| self.in_request(errors, Some(&key)))?,
        };
        self.gathered.push(Ready { part: StudyPart { key, ..ready.part }, ..ready })
    }
}

impl Queued<'_> {
    /// Prepares a job from its document, without the fields that it shares with the jobs before.
    fn ready(&mut self, document: &Value) -> Result<Ready, DocumentErrors> {
        let start = Instant::now();
        let prepared = self.prepare(document)?;
        let set_up_seconds = start.elapsed().as_secs_f64();
        self.confidence = prepared.stop.confidence;
        let part = StudyPart { key: JobKey::default(), computed_by: prepared.method_names(), set_up_seconds };
        let Gathered { submitted, document: documents, plan, .. } = &mut self.gathered;
        let job = NewStudyJob {
            part: Value::Null,
            submitted: submitted.divide(fields(document)),
            document: documents.divide(fields(&prepared.document)),
            plan: plan.divide(fields(&to_value(&PlanResult::from(&prepared.plan)))),
            known: prepared.known(),
            warnings: prepared.warnings.clone(),
            first_chunk: prepared.passes_after(0),
        };
        let columns = [to_value(&job.submitted), to_value(&job.document), to_value(&job.plan)];
        // the last two are in an event, too
        let beside = [to_value(&job.known), to_value(&job.warnings)];
        let bytes = columns.iter().chain(&beside).chain(&beside).map(|value| value.to_string().len()).sum();
        Ok(Ready { job, part, bytes })
    }
}

impl Gathered {
    /// Adds a job; refuses it if all jobs together would be too long.
    fn push(&mut self, ready: Ready) -> Result<(), DocumentErrors> {
        self.bytes += ready.bytes;
        if self.bytes > MOST_BYTES {
            let detail = format!(
                "the documents of a study's jobs, without their common fields, may take {} MB in all, but those of {} \
                 jobs take more: request fewer methods, errors or seeds, or a shorter job",
                MOST_BYTES >> 20,
                self.jobs.len() + 1
            );
            return Err(FieldError::new("/seeds", detail).coded(FieldErrorCode::TooMany).into());
        }
        self.jobs.push(ready);
        Ok(())
    }
}

impl Ready {
    /// Returns the job with another seed.
    fn with_seed(&self, seed: u64) -> Self {
        let mut ready = self.clone();
        ready.job.submitted.set("seed", seed.into());
        ready.job.document.set("seed", seed.into());
        ready
    }
}

/// Refuses a study of too many jobs before they are prepared.
fn check_number(request: &StudyRequest, plan: &StudyPlan<'_>) -> Result<(), DocumentErrors> {
    let [reference, runs, pictures] = plan.numbers();
    if runs.saturating_add(reference + pictures) <= MOST_JOBS {
        return Ok(());
    }
    let detail = format!(
        "a study may have at most {MOST_JOBS} jobs, but {} suitable methods, {} errors and {} seeds make {runs}, and \
         its pictures {pictures} more",
        plan.methods.len(),
        request.relative_errors.len(),
        request.seeds,
    );
    Err(FieldError::new("/seeds", detail).coded(FieldErrorCode::TooMany).into())
}

/// Returns the fields of a document or a plan.
fn fields(document: &Value) -> Map<String, Value> {
    document.as_object().cloned().unwrap_or_default()
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::provenance::Provenance;
    use crate::document::result::{ExternalIlluminance, Known};

    /// Jobs are gathered up to a number of bytes that they do not share, whatever makes them long.
    #[test]
    fn what_jobs_do_not_share_is_bounded() {
        let part = StudyPart { key: JobKey::default(), computed_by: String::new(), set_up_seconds: 0.0 };
        let mut gathered = Gathered::default();
        let provenance =
            Provenance { zenith: None, sun: None, refraction: None, interreflection: true, guides: Vec::new() };
        let mut own = || gathered.plan.divide(Map::new());
        let job = NewStudyJob {
            part: Value::Null,
            submitted: own(),
            document: own(),
            plan: own(),
            known: Known::new(provenance, ExternalIlluminance { sky: 0.0, sun: 0.0 }),
            warnings: Vec::new(),
            first_chunk: 0..1,
        };
        let ready = || Ready { job: job.clone(), part: part.clone(), bytes: MOST_BYTES / 4 };
        for _ in 0..4 {
            gathered.push(ready()).unwrap();
        }
        let DocumentErrors(errors) = gathered.push(ready()).unwrap_err();
        assert_eq!((errors[0].pointer.as_str(), errors[0].code), ("/seeds", FieldErrorCode::TooMany));
        assert!(errors[0].detail.contains("16 MB in all, but those of 5 jobs"), "{}", errors[0].detail);
    }
}

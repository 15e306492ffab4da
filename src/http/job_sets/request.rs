//! Request for a set of jobs: its documents, each prepared as if it were posted alone.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use crate::document::errors::Checks;
use crate::document::limits::{JOB_NAME, JOBS_OF_SET};
use crate::document::read::shape;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, FileSource, JobDocument};
use crate::present::prepared::prepare_document;
use crate::queue::computation::computation;
use crate::queue::owner::Owner;
use crate::queue::store::{MostWaiting, NewJobSet, NewMember, NewMembers, SetBounds, SetKind};
use crate::queue::uploaded_files::UploadedFiles;

/// Jobs to be queued together.
#[derive(Debug, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct JobSetRequest {
    /// Name of the set, free text.
    #[serde(default)]
    pub name: Option<String>,
    /// Documents of the jobs, not more than a client may have waiting here.
    #[schema(value_type = Vec<JobDocument>)]
    pub jobs: Vec<Value>,
}

impl JobSetRequest {
    /// Reads a request; errors report every fault beside those of its documents.
    pub fn from_value(value: Value, most: MostWaiting) -> Result<Self, DocumentErrors> {
        let mut checks = Checks::default();
        let request = shape::read::<Self>(value, &mut checks).map(|(request, _)| request);
        if let Some(request) = &request {
            let name = request.name.as_ref().map_or(0, |name| name.chars().count());
            if name > *JOB_NAME.end() {
                checks.refuse("/name", format!("must have at most {} characters", JOB_NAME.end()));
            }
            let (jobs, least, most) = (request.jobs.len(), *JOBS_OF_SET.start(), most.of_set());
            if !(least..=most).contains(&jobs) {
                let detail = format!("must have {least} to {most} jobs on this service, but has {jobs}");
                let code = if jobs < least { FieldErrorCode::OutOfRange } else { FieldErrorCode::TooMany };
                checks.errors.push(FieldError::new("/jobs", detail).coded(code));
            }
        }
        match request.filter(|_| checks.errors.is_empty()) {
            Some(request) => Ok(request),
            None => Err(DocumentErrors(checks.errors)),
        }
    }

    /// Prepares the set with all of its jobs. Errors have pointers into the request. The owner, the client and the key of the set are
    /// left empty.
    pub fn prepared(self, meshes: &UploadedFiles, bounds: &SetBounds) -> Result<NewJobSet, DocumentErrors> {
        let (mut jobs, mut errors) = (NewMembers::default(), Vec::new());
        for (index, document) in self.jobs.iter().enumerate() {
            match member(&mut jobs, document, meshes, bounds) {
                Ok(member) if errors.is_empty() => jobs.push(member, "/jobs")?,
                Ok(_) => {}
                Err(DocumentErrors(of_job)) => errors.extend(
                    of_job
                        .into_iter()
                        .map(|error| FieldError { pointer: format!("/jobs/{index}{}", error.pointer), ..error }),
                ),
            }
            if meshes.is_cancelled() {
                break;
            }
        }
        if !errors.is_empty() {
            return Err(DocumentErrors(errors));
        }
        Ok(NewJobSet {
            owner: Owner::default(),
            kind: SetKind::Jobs,
            name: self.name,
            about: "{}".to_owned(),
            idempotency_key: None,
            body_hash: String::new(),
            client: String::new(),
            uploads: meshes.loaded(),
            jobs,
        })
    }
}

/// Prepares a job of a set from its document, as a post of the job alone does.
fn member(
    jobs: &mut NewMembers,
    document: &Value,
    meshes: &UploadedFiles,
    bounds: &SetBounds,
) -> Result<NewMember, DocumentErrors> {
    let prepared = prepare_document(&JobDocument::from_files(document.clone(), meshes)?, meshes)?;
    prepared.check_memory(bounds.memory_bytes)?;
    prepared.check_seconds(bounds.most_seconds)?;
    Ok(NewMember { computation: computation(&prepared.document), ..jobs.divide(document, &prepared) })
}

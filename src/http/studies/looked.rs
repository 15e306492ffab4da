//! Stored study with the present state of its jobs.

use std::collections::HashMap;

use serde::de::DeserializeOwned;
use serde_json::Value;
use uuid::Uuid;

use super::part::StudyPart;
use super::resource::StudyJob;
use crate::http::Service;
use crate::http::problem::Problem;
use crate::http::results::internal;
use crate::queue::store::*;
use crate::study::StudyRequest;

/// Stored study with the present state of its jobs.
pub struct Looked<'a> {
    pub study: &'a StoredStudy,
    pub request: StudyRequest,
    /// Ids of the jobs in order, each with the job's part in the study.
    pub parts: Vec<(Uuid, StudyPart)>,
    /// Heads of the jobs that were not deleted, by id.
    pub heads: HashMap<Uuid, JobHead>,
}

impl<'a> Looked<'a> {
    /// Combines a study with the heads of its jobs.
    pub fn new(study: &'a StoredStudy, heads: HashMap<Uuid, JobHead>) -> Result<Self, Problem> {
        let request = serde_json::from_str(&study.request);
        let request = request.map_err(|error| internal("reading a study failed", &error))?;
        Ok(Self { study, request, parts: parts(study)?, heads })
    }

    /// Returns the job with which the runs are compared; `None` if the request has given the values.
    pub fn reference(&self) -> Option<(Uuid, &StudyPart)> {
        let reference = self.parts.iter().find(|(_, part)| part.run.is_none() && part.picture.is_none());
        reference.map(|(id, part)| (*id, part))
    }

    /// Returns the job if it has succeeded.
    pub fn succeeded(&self, id: Uuid) -> Option<&JobHead> {
        self.heads.get(&id).filter(|head| head.status == JobStatus::Succeeded)
    }

    /// Lists the jobs in the form of JSON answers.
    pub fn jobs(&self) -> Vec<StudyJob> {
        self.parts.iter().map(|(id, part)| StudyJob::new(*id, part, self.heads.get(id))).collect()
    }
}

/// Reads the heads of the study's jobs that were not deleted.
pub async fn heads(app: &Service, study: Uuid) -> Result<HashMap<Uuid, JobHead>, Problem> {
    let heads = app.store.jobs_of_study(study).await?;
    Ok(heads.into_iter().map(|head| (head.id, head)).collect())
}

/// Lists the ids of the study's jobs, each with the job's part in the study.
pub fn parts(study: &StoredStudy) -> Result<Vec<(Uuid, StudyPart)>, Problem> {
    study.jobs.iter().map(|member| Ok((member.job, read(&member.part)?))).collect()
}

/// Reads a value from JSON that this service has stored itself.
pub fn read<T: DeserializeOwned>(stored: &Value) -> Result<T, Problem> {
    T::deserialize(stored).map_err(|error| internal("reading a study failed", &error))
}

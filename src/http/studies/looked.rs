//! A stored study with its jobs, as they are now.

use std::collections::HashMap;

use serde::de::DeserializeOwned;
use serde_json::Value;
use uuid::Uuid;

use super::part::StudyPart;
use super::resource::StudyJob;
use crate::http::Service;
use crate::http::problem::Problem;
use crate::http::results::internal;
use crate::job::store::*;
use crate::study::StudyRequest;

/// A stored study with its jobs as they are now.
pub struct Looked<'a> {
    pub study: &'a StoredStudy,
    pub request: StudyRequest,
    /// Jobs by their ids, in order, each with the part that it has.
    pub parts: Vec<(Uuid, StudyPart)>,
    /// Those that were not deleted.
    pub heads: HashMap<Uuid, JobHead>,
}

impl<'a> Looked<'a> {
    /// A study with heads that were read of its jobs.
    pub fn new(study: &'a StoredStudy, heads: HashMap<Uuid, JobHead>) -> Result<Self, Problem> {
        let request = serde_json::from_str(&study.request);
        let request = request.map_err(|error| internal("reading a study failed", &error))?;
        Ok(Self { study, request, parts: parts(study)?, heads })
    }

    /// The job that the runs are compared with; `None` where its values were given.
    pub fn reference(&self) -> Option<(Uuid, &StudyPart)> {
        let reference = self.parts.iter().find(|(_, part)| part.run.is_none() && part.picture.is_none());
        reference.map(|(id, part)| (*id, part))
    }

    /// The job if it has results.
    pub fn succeeded(&self, id: Uuid) -> Option<&JobHead> {
        self.heads.get(&id).filter(|head| head.status == JobStatus::Succeeded)
    }

    /// The jobs as they are answered.
    pub fn jobs(&self) -> Vec<StudyJob> {
        self.parts.iter().map(|(id, part)| StudyJob::new(*id, part, self.heads.get(id))).collect()
    }
}

/// The study's jobs that were not deleted.
pub async fn heads(app: &Service, study: Uuid) -> Result<HashMap<Uuid, JobHead>, Problem> {
    let heads = app.store.jobs_of_study(study).await?;
    Ok(heads.into_iter().map(|head| (head.id, head)).collect())
}

/// The study's jobs by their ids, each with the part that it has.
pub fn parts(study: &StoredStudy) -> Result<Vec<(Uuid, StudyPart)>, Problem> {
    study.jobs.iter().map(|member| Ok((member.job, read(&member.part)?))).collect()
}

/// What this service has stored itself.
pub fn read<T: DeserializeOwned>(stored: &Value) -> Result<T, Problem> {
    T::deserialize(stored).map_err(|error| internal("reading a study failed", &error))
}

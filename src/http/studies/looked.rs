//! Stored study with the present state of its jobs.

use std::collections::HashMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::Value;
use uuid::Uuid;

use super::resource::{StudyJob, StudySummary};
use crate::http::Service;
use crate::http::job_sets::any_kind::{heads_of, set_of};
use crate::http::problem::Problem;
use crate::queue::store::*;
use crate::study::outcome::Ended;
use crate::study::outcomes::{Found, JobOutcome, Outcomes};
use crate::study::part::StudyPart;
use crate::study::queued::StudyRecord;

/// Stored study with the present state of its jobs.
pub struct Looked {
    pub study: JobSet,
    /// Ids of the jobs in order, each with the job's part in the study.
    pub parts: Vec<(Uuid, StudyPart)>,
    /// Heads of the jobs that were not deleted, by id.
    pub heads: HashMap<Uuid, JobHead>,
}

impl Looked {
    /// Reads the study of an id with its jobs.
    pub async fn at(app: &Service, id: Uuid) -> Result<Self, Problem> {
        Self::new(app, set_of(app, SetKind::Study, id).await?).await
    }

    /// Reads the jobs of a stored study.
    pub async fn new(app: &Service, study: JobSet) -> Result<Self, Problem> {
        let heads = heads_of(app, study.id).await?;
        Ok(Self { parts: parts(&study)?, study, heads })
    }

    /// Reads the request of the study, and what follows from it.
    pub fn record(&self) -> Result<StudyRecord, Problem> {
        serde_json::from_str(&self.study.about).map_err(|error| Problem::failed("reading a study failed", &error))
    }

    /// Lists the jobs in the form of JSON answers.
    pub fn jobs(&self) -> Vec<StudyJob> {
        self.parts.iter().map(|(id, part)| StudyJob::new(*id, part, self.heads.get(id))).collect()
    }

    /// Summarises the study in the form of JSON answers.
    pub fn summary(&self) -> StudySummary {
        StudySummary::new(&self.study, &self.jobs())
    }

    /// Collects the jobs with the results that are stored for the study, and the values of the reference if they are given.
    pub fn outcomes(&self, record: &StudyRecord) -> Outcomes {
        let jobs = self.parts.iter().zip(&self.study.members).map(|((id, part), member)| JobOutcome {
            part: part.clone(),
            ended: self.heads.get(id).and_then(ended),
            // results in the form of another version are computed again
            found: member.found.as_ref().and_then(|found| Found::deserialize(found).ok()),
        });
        let (truth, confidence) = (record.request.reference.known(), record.confidence);
        Outcomes { jobs: jobs.collect(), refused: record.refused.clone(), confidence, truth }
    }
}

fn ended(head: &JobHead) -> Option<Ended> {
    let succeeded = match head.status {
        JobStatus::Succeeded => true,
        JobStatus::Failed => false,
        JobStatus::Queued | JobStatus::Running | JobStatus::Cancelled => return None,
    };
    Some(Ended { succeeded, progress: head.progress, stopped_by: head.stopped_by })
}

/// Lists the ids of the study's jobs, each with the job's part in the study.
pub fn parts(study: &JobSet) -> Result<Vec<(Uuid, StudyPart)>, Problem> {
    study.members.iter().map(|member| Ok((member.job, read(&member.part)?))).collect()
}

/// Reads a value from JSON that this service has stored itself.
fn read<T: DeserializeOwned>(stored: &Value) -> Result<T, Problem> {
    T::deserialize(stored).map_err(|error| Problem::failed("reading a study failed", &error))
}

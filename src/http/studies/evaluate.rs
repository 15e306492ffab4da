//! What a study has found so far, from the results of its jobs that have ended.

use std::collections::HashMap;

use serde::de::DeserializeOwned;
use serde_json::Value;
use uuid::Uuid;

use super::part::StudyPart;
use super::resource::{StudyJob, StudyJobPart, StudyResource, StudySummary};
use crate::document::result::GridResult;
use crate::http::Service;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::http::results::internal;
use crate::job::store::*;
use crate::study::compare::Values;
use crate::study::outcome::{RenderedReference, Run, RunCost};
use crate::study::{Study, StudyRequest};

/// A study with its jobs as they are now.
pub struct Evaluated {
    pub request: StudyRequest,
    pub jobs: Vec<StudyJob>,
    /// `None` until the reference is known.
    pub found: Option<Study>,
}

/// A stored study as it is answered.
pub async fn study_resource(app: &Service, study: StoredStudy) -> Result<StudyResource, Problem> {
    let Evaluated { request, jobs, found } = evaluate(app, &study).await?;
    Ok(StudyResource {
        summary: StudySummary::new(&study, &jobs),
        request,
        refused: read(&study.refused)?,
        jobs,
        results: found.map(|found| found.report()),
    })
}

/// A stored study as lists have it.
pub async fn study_summary(app: &Service, study: StoredStudy) -> Result<StudySummary, Problem> {
    let heads = heads(app, study.id).await?;
    let jobs = parts(&study)?.into_iter().map(|(id, part)| study_job(id, &part, heads.get(&id)));
    Ok(StudySummary::new(&study, &jobs.collect::<Vec<_>>()))
}

/// Compares the values of all runs that have succeeded with the reference.
pub async fn evaluate(app: &Service, study: &StoredStudy) -> Result<Evaluated, Problem> {
    let request: StudyRequest = read(&study.request)?;
    let heads = heads(app, study.id).await?;
    let parts = parts(study)?;
    let jobs = parts.iter().map(|(id, part)| study_job(*id, part, heads.get(id))).collect();
    let mut found = request.reference.known().map(|known| (known, None, Vec::new()));
    // the reference is the first of them
    for (id, part) in parts {
        let Some(head) = heads.get(&id).filter(|head| head.status == JobStatus::Succeeded) else { continue };
        if part.run.is_none() {
            if let Some(values) = values(app, &request, head).await? {
                let reference = RenderedReference { method: part.computed_by, seconds: head.progress.seconds };
                found = Some((values, Some(reference), Vec::new()));
            }
            continue;
        }
        let Some((truth, _, runs)) = &mut found else { break };
        if let Some(values) = values(app, &request, head).await? {
            runs.extend(run(part, head, &values, truth, study.confidence));
        }
    }
    let refused = read(&study.refused)?;
    let found = found.map(|(truth, reference, runs)| Study {
        reference,
        reference_variance: truth.relative_variance(),
        confidence: study.confidence,
        runs,
        refused,
    });
    Ok(Evaluated { request, jobs, found })
}

fn run(part: StudyPart, head: &JobHead, values: &Values, truth: &Values, confidence: f64) -> Option<Run> {
    let cost = RunCost {
        computed_by: part.computed_by,
        set_up_seconds: part.set_up_seconds,
        seconds: head.progress.seconds,
        cpu_seconds: head.progress.cpu_seconds.unwrap_or(head.progress.seconds),
        passes: head.progress.passes,
        told: head.progress.relative_error,
        stopped_by: head.stopped_by?,
    };
    Some(Run::new(part.run?, cost, values, truth, confidence))
}

/// The values of a job that has succeeded; `None` where its files are gone with it.
async fn values(app: &Service, request: &StudyRequest, head: &JobHead) -> Result<Option<Values>, Problem> {
    let mut files = Vec::new();
    for name in request.job["grids"].as_array().into_iter().flatten().filter_map(|grid| grid["name"].as_str()) {
        let Some(file) = app.store.artifact(head.id, &format!("grids/{name}.json")).await? else { return Ok(None) };
        files.push(app.artifacts.read_checked(&file.key, &file.hash).await?);
    }
    let passes = head.progress.passes;
    let read = off_thread(permit(&app.permits.reading).await?, move |_| {
        let grids = files.iter().map(|json| serde_json::from_slice(json)).collect::<Result<Vec<GridResult>, _>>()?;
        Ok::<_, serde_json::Error>(Values::of_results(&grids, passes))
    });
    read.await?.map(Some).map_err(|error| internal("reading a grid failed", &error))
}

async fn heads(app: &Service, study: Uuid) -> Result<HashMap<Uuid, JobHead>, Problem> {
    let heads = app.store.jobs_of_study(study).await?;
    Ok(heads.into_iter().map(|head| (head.id, head)).collect())
}

fn parts(study: &StoredStudy) -> Result<Vec<(Uuid, StudyPart)>, Problem> {
    study.parts.iter().map(|(id, part)| Ok((*id, read(part)?))).collect()
}

fn study_job(id: Uuid, part: &StudyPart, head: Option<&JobHead>) -> StudyJob {
    StudyJob {
        id,
        part: if part.run.is_some() { StudyJobPart::Run } else { StudyJobPart::Reference },
        method: part.run.as_ref().map(|run| run.method.clone()),
        computed_by: part.computed_by.clone(),
        asked: part.run.as_ref().map(|run| run.relative_error),
        seed: part.run.as_ref().map(|run| run.seed),
        status: head.map(|head| head.status),
        stopped_by: head.and_then(|head| head.stopped_by),
        link: format!("/v1/jobs/{id}"),
    }
}

/// What this service has stored itself.
fn read<T: DeserializeOwned>(stored: &Value) -> Result<T, Problem> {
    T::deserialize(stored).map_err(|error| internal("reading a study failed", &error))
}

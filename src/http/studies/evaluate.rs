//! What a study has found so far, from the results of its jobs that have ended.

use std::collections::HashMap;

use serde::de::DeserializeOwned;
use serde_json::Value;
use uuid::Uuid;

use super::part::StudyPart;
use super::resource::{StudyJob, StudyResource, StudySummary};
use crate::document::result::GridResult;
use crate::http::Service;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::http::results::internal;
use crate::job::progress::Progress;
use crate::job::store::*;
use crate::output::{OutputError, exr};
use crate::study::compare::Values;
use crate::study::outcome::{RenderedReference, Run, RunCost};
use crate::study::picture_request::{PictureKey, PictureRequest};
use crate::study::pictures::{Film, Pictures, Shown};
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
    let jobs = parts(&study)?.into_iter().map(|(id, part)| StudyJob::new(id, &part, heads.get(&id)));
    Ok(StudySummary::new(&study, &jobs.collect::<Vec<_>>()))
}

/// Compares the values of all runs that have succeeded with the reference.
pub async fn evaluate(app: &Service, study: &StoredStudy) -> Result<Evaluated, Problem> {
    let request: StudyRequest = read(&study.request)?;
    let heads = heads(app, study.id).await?;
    let parts = parts(study)?;
    let jobs = parts.iter().map(|(id, part)| StudyJob::new(*id, part, heads.get(id))).collect();
    let mut found = request.reference.known().map(|known| (known, None, Vec::new()));
    // the reference is the first of them
    for (id, part) in parts.into_iter().filter(|(_, part)| part.picture.is_none()) {
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

/// The pictures of a study, as far as their jobs have ended, and the request that they follow; `None` until their reference
/// has, and of a study without.
pub async fn pictures(app: &Service, study: &StoredStudy) -> Result<Option<(PictureRequest, Pictures)>, Problem> {
    let request: StudyRequest = read(&study.request)?;
    let Some(request) = request.pictures(app.limits.max_seconds) else { return Ok(None) };
    let heads = heads(app, study.id).await?;
    let mut found: Option<Pictures> = None;
    // their reference is the first of them
    for (id, part) in parts(study)? {
        let Some(key) = &part.picture else { continue };
        // one whose seconds ended before its first pass has failed: black, in its place
        let has_ended = |head: &&JobHead| match head.status {
            JobStatus::Succeeded => true,
            JobStatus::Failed => head.progress.passes == 0,
            JobStatus::Queued | JobStatus::Running | JobStatus::Cancelled => false,
        };
        let Some(head) = heads.get(&id).filter(has_ended) else { continue };
        let shown = shown(app, &request, part.computed_by.clone(), head, study.confidence).await?;
        match &mut found {
            Some(pictures) => pictures.push(key, shown),
            None if *key == PictureKey::Reference => {
                found = Pictures::compared_with(&request, shown, read(&study.refused)?);
            }
            None => break,
        }
    }
    Ok(found.map(|pictures| (request, pictures)))
}

/// What a job of pictures that has succeeded shows, from its EXR files.
async fn shown(
    app: &Service,
    request: &PictureRequest,
    computed_by: String,
    head: &JobHead,
    confidence: f64,
) -> Result<Shown, Problem> {
    let mut files = Vec::new();
    let views = request.job["views"].as_array().map_or(0, Vec::len);
    for view in 0..views {
        let name = format!("views/{}.exr", request.view(view));
        // without a pass there is none
        let Some(file) = app.store.artifact(head.id, &name).await? else { break };
        files.push(app.artifacts.read_artifact(&file).await?);
    }
    let Progress { seconds, passes, view_relative_error: told, .. } = head.progress;
    let is_whole = files.len() == views;
    let read = off_thread(permit(&app.permits.reading).await?, move |_| {
        let film = |bytes: &bytes::Bytes| Ok(Film::of_image(exr::decode(bytes)?.image(), told, confidence, passes));
        files.iter().map(film).collect::<Result<Vec<Film>, OutputError>>()
    });
    let films = read.await?.map_err(|error| internal("reading a view failed", &error))?;
    Ok(Shown { computed_by, seconds, passes, told, films: is_whole.then_some(films) })
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
        files.push(app.artifacts.read_artifact(&file).await?);
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

/// The study's jobs by their ids, each with the part that it has.
pub(super) fn parts(study: &StoredStudy) -> Result<Vec<(Uuid, StudyPart)>, Problem> {
    study.parts.iter().map(|(id, part)| Ok((*id, read(part)?))).collect()
}

/// What this service has stored itself.
fn read<T: DeserializeOwned>(stored: &Value) -> Result<T, Problem> {
    T::deserialize(stored).map_err(|error| internal("reading a study failed", &error))
}

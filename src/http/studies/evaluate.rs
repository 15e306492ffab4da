//! Evaluation of a study so far, from the results of its jobs that have ended: a few numbers, computed once after the end of each job
//! and stored beside it.

use uuid::Uuid;

use super::looked::Looked;
use super::resource::StudyResource;
use crate::document::result::GridResult;
use crate::http::Service;
use crate::http::jobs::resource::names;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::queue::store::*;
use crate::study::compare::Values;
use crate::study::outcomes::Found;
use crate::study::queued::StudyRecord;
use crate::study::{Study, StudyRequest};

/// Number of jobs whose evaluated results are stored together; a request that ends early leaves the rest to the next one.
const STORED_TOGETHER: usize = 16;

/// Builds the answer for a stored study.
pub async fn study_resource(app: &Service, mut looked: Looked) -> Result<StudyResource, Problem> {
    let record = looked.record()?;
    let results = evaluate(app, &mut looked, &record).await?.map(|found| found.report());
    let StudyRecord { request, refused, .. } = record;
    Ok(StudyResource { summary: looked.summary(), request, refused, jobs: looked.jobs(), results })
}

/// Evaluates the runs that have succeeded; `None` as long as the reference has no values. One request at a time compares those that
/// are not compared yet; the next one reads what it has stored.
pub async fn evaluate(app: &Service, looked: &mut Looked, record: &StudyRecord) -> Result<Option<Study>, Problem> {
    let outcomes = looked.outcomes(record);
    if outcomes.missing().is_empty() {
        return Ok(outcomes.study());
    }
    let _turn = app.study_files.evaluating.lock().await;
    // deleted meanwhile
    let Some(study) = app.store.job_set(looked.study.id).await? else { return Ok(outcomes.study()) };
    looked.study = study;
    let mut outcomes = looked.outcomes(record);
    for indexes in outcomes.missing().chunks(STORED_TOGETHER) {
        let mut new = Vec::new();
        for index in indexes {
            let (id, part) = &looked.parts[*index];
            let Some(head) = looked.heads.get(id) else { continue };
            let values = values(app, &record.request, head).await?;
            let found = outcomes.compare(&part.key, values);
            if outcomes.jobs[*index].found.replace(found.clone()).as_ref() != Some(&found) {
                new.push((*id, found));
            }
            if outcomes.truth.is_none() {
                keep(app, looked.study.id, &new).await;
                return Ok(None);
            }
        }
        keep(app, looked.study.id, &new).await;
    }
    Ok(outcomes.study())
}

/// Stores evaluated results; if that fails, they are computed again later.
pub async fn keep(app: &Service, study: Uuid, found: &[(Uuid, Found)]) {
    // our own types always serialise
    let json = |(id, found): &(Uuid, Found)| (*id, serde_json::to_value(found).unwrap_or_default());
    if let Err(error) = app.store.keep_found(study, &found.iter().map(json).collect::<Vec<_>>()).await {
        tracing::warn!(%error, %study, "the errors computed for a study cannot be stored");
    }
}

/// Reads the values of a job that has succeeded; `None` if its files are gone.
async fn values(app: &Service, request: &StudyRequest, head: &JobHead) -> Result<Option<Values>, Problem> {
    let mut files = Vec::new();
    for name in names(&request.job, "grids") {
        let Some(file) = app.store.artifact(head.id, &format!("grids/{name}.json")).await? else { return Ok(None) };
        files.push(app.artifacts.read_artifact(&file).await?);
    }
    let passes = head.progress.passes;
    let read = off_thread(permit(&app.permits.reading).await?, move |_| {
        let grids = files.iter().map(|json| serde_json::from_slice(json)).collect::<Result<Vec<GridResult>, _>>()?;
        Ok::<_, serde_json::Error>(Values::of_results(&grids, passes))
    });
    read.await?.map(Some).map_err(|error| Problem::failed("reading a grid failed", &error))
}

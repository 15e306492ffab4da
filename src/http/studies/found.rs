//! Evaluated results of a study's jobs: a few numbers, computed once after the end of each job and stored beside it.

use std::collections::HashMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use uuid::Uuid;

use super::looked::Looked;
use crate::document::result::GridResult;
use crate::http::Service;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::http::results::internal;
use crate::queue::store::*;
use crate::study::compare::{Deviation, Values};

/// Evaluated result of a job, as it is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// Mean of the squared relative standard errors of the reference.
    Reference(Option<f64>),
    /// Deviation of a run from the reference.
    Run(Deviation),
    /// Actual relative error of each view of a job of pictures; null where no pass ended in time.
    Pictures(Vec<Option<f64>>),
    /// No result: the files of the job are gone.
    Nothing,
}

/// Number of jobs whose evaluated results are stored together; a request that ends early leaves the rest to the next one.
const STORED_TOGETHER: usize = 16;

/// Returns the evaluated results that are stored for the jobs of a study.
pub fn stored(study: &StoredStudy) -> HashMap<Uuid, Found> {
    let of_job = |member: &StudyMember| {
        // results in the form of another version are computed again
        Some((member.job, Found::deserialize(member.found.as_ref()?).ok()?))
    };
    study.jobs.iter().filter_map(of_job).collect()
}

/// Returns the evaluated results of the reference and of all runs that have succeeded, and computes those that are not stored yet.
/// One request at a time computes them; the next one reads the stored ones.
pub async fn of_runs(app: &Service, looked: &Looked<'_>) -> Result<HashMap<Uuid, Found>, Problem> {
    let mut found = stored(looked.study);
    if missing(looked, &found).is_empty() {
        return Ok(found);
    }
    let _turn = app.study_files.evaluating.lock().await;
    match app.store.study(looked.study.id).await? {
        Some(study) => found = stored(&study),
        // deleted meanwhile
        None => return Ok(found),
    }
    let missing = missing(looked, &found);
    if missing.is_empty() {
        return Ok(found);
    }
    let Some(truth) = truth(app, looked, &mut found).await? else { return Ok(found) };
    let runs: Vec<&JobHead> = missing.into_iter().filter(|head| !found.contains_key(&head.id)).collect();
    for heads in runs.chunks(STORED_TOGETHER) {
        let mut new = Vec::new();
        for head in heads {
            let of_job = match values(app, looked, head).await? {
                Some(values) => Found::Run(values.deviation(&truth, looked.study.confidence)),
                None => Found::Nothing,
            };
            new.push((head.id, of_job));
        }
        keep(app, looked.study.id, &new).await;
        found.extend(new);
    }
    Ok(found)
}

/// Lists the reference and runs that have succeeded but are not evaluated yet; none if there is no reference to compare with (yet).
fn missing<'a>(looked: &'a Looked<'a>, found: &HashMap<Uuid, Found>) -> Vec<&'a JobHead> {
    let has_values = |id: Uuid| looked.succeeded(id).is_some() && found.get(&id) != Some(&Found::Nothing);
    if looked.reference().is_some_and(|(id, _)| !has_values(id)) {
        return Vec::new();
    }
    let jobs = looked.parts.iter().filter(|(id, part)| part.picture.is_none() && !found.contains_key(id));
    jobs.filter_map(|(id, _)| looked.succeeded(*id)).collect()
}

/// Reads the values of the reference, and stores its evaluated result; `None` if its files are gone.
async fn truth(
    app: &Service,
    looked: &Looked<'_>,
    found: &mut HashMap<Uuid, Found>,
) -> Result<Option<Values>, Problem> {
    let Some((id, _)) = looked.reference() else { return Ok(looked.request.reference.known()) };
    let Some(head) = looked.succeeded(id) else { return Ok(None) };
    let values = values(app, looked, head).await?;
    let of_reference = values.as_ref().map_or(Found::Nothing, |values| Found::Reference(values.relative_variance()));
    if found.insert(id, of_reference.clone()).as_ref() != Some(&of_reference) {
        keep(app, looked.study.id, &[(id, of_reference)]).await;
    }
    Ok(values)
}

/// Stores evaluated results; if that fails, they are computed again later.
pub async fn keep(app: &Service, study: Uuid, found: &[(Uuid, Found)]) {
    // our own types always serialise
    let json = |(id, found): &(Uuid, Found)| (*id, serde_json::to_value(found).unwrap_or_default());
    let found: Vec<(Uuid, Value)> = found.iter().map(json).collect();
    if let Err(error) = app.store.keep_found(study, &found).await {
        tracing::warn!(%error, %study, "the errors computed for a study cannot be stored");
    }
}

/// Reads the values of a job that has succeeded; `None` if its files are gone.
async fn values(app: &Service, looked: &Looked<'_>, head: &JobHead) -> Result<Option<Values>, Problem> {
    let mut files = Vec::new();
    for name in looked.request.job["grids"].as_array().into_iter().flatten().filter_map(|grid| grid["name"].as_str()) {
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

//! What the results of a study's jobs are to it: a few numbers, found once after the end of each job and kept beside it.

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
use crate::job::store::*;
use crate::study::compare::{Deviation, Values};

/// What was found of a job, as it is stored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// Of the reference: mean of its squared relative standard errors.
    Reference(Option<f64>),
    /// Of a run: how far it is from the reference.
    Run(Deviation),
    /// Of pictures: actual relative error of each view; null where no pass ended in time.
    Pictures(Vec<Option<f64>>),
    /// Its files are gone.
    Nothing,
}

/// Jobs after which what was found is stored; a request that ends early leaves the rest to the next one.
const STORED_TOGETHER: usize = 16;

/// What was stored of the jobs of a study.
pub fn stored(study: &StoredStudy) -> HashMap<Uuid, Found> {
    let of_job = |member: &StudyMember| {
        // what another version stored is found again
        Some((member.job, Found::deserialize(member.found.as_ref()?).ok()?))
    };
    study.jobs.iter().filter_map(of_job).collect()
}

/// What was found of the reference and of all runs that have succeeded; what was not before is found now. One request at a time finds
/// anything, and what it stores the next one reads.
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

/// The reference and runs that have succeeded and of which nothing was found so far; none where there is nothing to compare with (yet).
fn missing<'a>(looked: &'a Looked<'a>, found: &HashMap<Uuid, Found>) -> Vec<&'a JobHead> {
    let has_values = |id: Uuid| looked.succeeded(id).is_some() && found.get(&id) != Some(&Found::Nothing);
    if looked.reference().is_some_and(|(id, _)| !has_values(id)) {
        return Vec::new();
    }
    let jobs = looked.parts.iter().filter(|(id, part)| part.picture.is_none() && !found.contains_key(id));
    jobs.filter_map(|(id, _)| looked.succeeded(*id)).collect()
}

/// The values of the reference, and what was found of it; `None` where its files are gone.
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

/// Stores what was found; where that fails, it is found again.
pub async fn keep(app: &Service, study: Uuid, found: &[(Uuid, Found)]) {
    // our own types always serialise
    let json = |(id, found): &(Uuid, Found)| (*id, serde_json::to_value(found).unwrap_or_default());
    let found: Vec<(Uuid, Value)> = found.iter().map(json).collect();
    if let Err(error) = app.store.keep_found(study, &found).await {
        tracing::warn!(%error, %study, "what was found of a study cannot be stored");
    }
}

/// The values of a job that has succeeded; `None` where its files are gone with it.
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

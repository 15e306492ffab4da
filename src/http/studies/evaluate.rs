//! Evaluation of a study so far, from the results of its jobs that have ended.

use std::collections::HashMap;

use uuid::Uuid;

use super::found::{self, Found};
use super::looked::{Looked, heads, parts, read};
use super::part::StudyPart;
use super::resource::{StudyJob, StudyResource, StudySummary};
use crate::http::Service;
use crate::http::problem::Problem;
use crate::queue::store::*;
use crate::study::Study;
use crate::study::compare::Deviation;
use crate::study::outcome::{RenderedReference, Run, RunCost};

/// Builds the answer for a stored study.
pub async fn study_resource(
    app: &Service,
    study: &StoredStudy,
    heads: HashMap<Uuid, JobHead>,
) -> Result<StudyResource, Problem> {
    let looked = Looked::new(study, heads)?;
    let found = evaluate(app, &looked).await?;
    let jobs = looked.jobs();
    Ok(StudyResource {
        summary: StudySummary::new(study, &jobs),
        request: looked.request,
        refused: read(&study.refused)?,
        jobs,
        results: found.map(|found| found.report()),
    })
}

/// Builds the entry of a stored study in a list.
pub async fn study_summary(app: &Service, study: StoredStudy) -> Result<StudySummary, Problem> {
    let heads = heads(app, study.id).await?;
    let jobs = parts(&study)?.into_iter().map(|(id, part)| StudyJob::new(id, &part, heads.get(&id)));
    Ok(StudySummary::new(&study, &jobs.collect::<Vec<_>>()))
}

/// Evaluates the runs that have succeeded; `None` as long as the reference has no values.
pub async fn evaluate(app: &Service, looked: &Looked<'_>) -> Result<Option<Study>, Problem> {
    let found = found::of_runs(app, looked).await?;
    let (reference, reference_variance) = match looked.reference() {
        None => (None, looked.request.reference.known().and_then(|known| known.relative_variance())),
        Some((id, part)) => {
            let (Some(head), Some(Found::Reference(variance))) = (looked.succeeded(id), found.get(&id)) else {
                return Ok(None);
            };
            (Some(RenderedReference { method: part.computed_by.clone(), seconds: head.progress.seconds }), *variance)
        }
    };
    let runs = looked.parts.iter().filter_map(|(id, part)| match found.get(id)? {
        Found::Run(deviation) => run(part, looked.succeeded(*id)?, *deviation),
        _ => None,
    });
    let (runs, confidence) = (runs.collect(), looked.study.confidence);
    Ok(Some(Study { reference, reference_variance, confidence, runs, refused: read(&looked.study.refused)? }))
}

fn run(part: &StudyPart, head: &JobHead, deviation: Deviation) -> Option<Run> {
    let cost = RunCost {
        computed_by: part.computed_by.clone(),
        set_up_seconds: part.set_up_seconds,
        seconds: head.progress.seconds,
        cpu_seconds: head.progress.cpu_seconds.unwrap_or(head.progress.seconds),
        passes: head.progress.passes,
        told: head.progress.relative_error,
        stopped_by: head.stopped_by?,
    };
    Some(Run::new(part.run.clone()?, cost, deviation))
}

//! Results of a job: reports on tubes, and files of any kind; for a running job, the results so far.

use std::time::Duration;

use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use bytes::Bytes;
use serde::Deserialize;
use uuid::Uuid;

use crate::document::result::TubeResult;
use crate::document::result::tube_report::TubeReport;
use crate::engine::checkpoint;
use crate::http::content::Binary;
use crate::http::formats::{self, Format};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem};
use crate::http::{App, Service, content};
use crate::present::prepared::prepare;
use crate::present::results;
use crate::present::results::ResultFile;
use crate::queue::live::{LiveJob, MadeFile};

/// Longest time that a reader of a running job waits for the end of a pass.
const WAIT_FOR_PASS: Duration = Duration::from_secs(20);

const TUBE_FORMATS: [Format; 4] = [Format::Json, Format::Svg, Format::Png, Format::Pdf];

/// Converts the problem of status 404 to `None`.
pub(super) fn found(answer: Result<Response, Problem>) -> Result<Option<Response>, Problem> {
    match answer {
        Err(problem) if problem.status == StatusCode::NOT_FOUND.as_u16() => Ok(None),
        answer => answer.map(Some),
    }
}

/// Returns the report on a tube.
#[utoipa::path(get, path = "/v1/jobs/{id}/tubes/{file}", operation_id = "get_tube", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "The tube's number in the document, from 0; a \
                                                                       suffix `.json`, `.svg`, `.png` or `.pdf` \
                                                                       selects the format")),
    responses(
        (status = 200, description = "Fluxes, efficiencies and the transmission of beams; as SVG, PNG and PDF the transmission against the sun's altitude",
            content((TubeReport = "application/json"), (String = "image/svg+xml"), (inline(Binary) = "image/png"), (inline(Binary) = "application/pdf"))),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "A parameter is not valid", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job or tube, or the first pass has not finished yet",
            body = Problem, content_type = "application/problem+json")))]
pub async fn tube(app: App, Path((id, file)): Path<(Uuid, String)>, headers: HeaderMap) -> Result<Response, Problem> {
    let by_suffix = formats::by_suffix(&file, &TUBE_FORMATS);
    let (tube, format) = by_suffix.unwrap_or_else(|| (&file, formats::accepted(&headers, &TUBE_FORMATS)));
    let answer = result_file(&app, id, &headers, format!("tubes/{tube}.{}", format.suffix())).await?;
    let answer = formats::named(answer, &format!("tube-{tube}.{}", format.suffix()));
    Ok(if by_suffix.is_some() { answer } else { formats::vary_by_accept(answer) })
}

/// Answers with the stored file of a finished job, or for a running one with the file as it would be now.
pub(super) async fn result_file(
    app: &Service,
    id: Uuid,
    headers: &HeaderMap,
    name: String,
) -> Result<Response, Problem> {
    if let Some(artifact) = app.store.artifact(id, &name).await? {
        return content::stored(headers, &app.artifacts, &artifact).await;
    }
    if app.store.job_head(id).await?.is_none() {
        return Err(Problem::no_such_job());
    }
    if let Some(file) = made_again(app, id, &name).await? {
        return content::made(headers, file.bytes, file.media_type);
    }
    let Some(file) = file_so_far(app, id, &name).await? else {
        // it may have finished between the first look and now
        if let Some(file) = made_again(app, id, &name).await? {
            return content::made(headers, file.bytes, file.media_type);
        }
        let artifact = app.store.artifact(id, &name).await?;
        let artifact = artifact
            .ok_or_else(|| Problem::not_found("the job has no such output, or has not finished its first pass yet"))?;
        return content::stored(headers, &app.artifacts, &artifact).await;
    };
    content::made(headers, file.bytes, file.media_type)
}

/// Makes a file of a finished job that is not stored, from those that are.
async fn made_again(app: &Service, id: Uuid, name: &str) -> Result<Option<ResultFile>, Problem> {
    if name.starts_with("tubes/") {
        return report_on_tube(app, id, name).await;
    }
    let Some(grid) = name.strip_suffix(".csv").filter(|grid| grid.starts_with("grids/")) else { return Ok(None) };
    let Some(kept) = app.store.artifact(id, &format!("{grid}.json")).await? else { return Ok(None) };
    let permit = permit(&app.permits.reading).await?;
    let json = app.artifacts.read_artifact(&kept).await?;
    let name = name.to_owned();
    let made = off_thread(permit, move |_| results::grid_csv_of(&name, &json)).await?;
    made.map(Some).map_err(|error| internal("writing a grid failed", &error))
}

/// Makes the report on a tube of a finished job again, from its document and the fluxes in its summary, with the same bytes as
/// before a restart. `None` if the job has not ended, or has computed nothing.
async fn report_on_tube(app: &Service, id: Uuid, name: &str) -> Result<Option<ResultFile>, Problem> {
    let Some(job) = app.store.job(id).await? else { return Err(Problem::no_such_job()) };
    let Some(summary) = job.summary.filter(|known| job.head.status.is_final() && known["tubes"].is_array()) else {
        return Ok(None);
    };
    let source = app.store.job_source(id).await?.ok_or_else(Problem::no_such_job)?;
    let tubes: Vec<TubeResult> = Vec::deserialize(&summary["tubes"])
        .map_err(|error| internal("reading the fluxes of a finished job failed", &error))?;
    let (meshes, runtime, name) = (app.meshes.clone(), tokio::runtime::Handle::current(), name.to_owned());
    let made = off_thread(permit(&app.permits.reading).await?, move |cancel| {
        let meshes = meshes.for_document(runtime, cancel);
        let prepared = prepare(source.submitted.as_bytes(), &meshes).map_err(|errors| errors.to_string())?;
        prepared.tube_file_of(&name, &tubes).map_err(|error| error.to_string())
    });
    made.await?.map_err(|error| internal("reporting on a tube failed", &error))
}

pub(super) fn internal(what: &str, error: &dyn std::fmt::Display) -> Problem {
    tracing::error!(%error, what);
    Problem::internal()
}

/// Makes one file as it would be now: from the last pass for which a reader has waited, from the pass that runs now, or from the
/// stored checkpoint. Readers of the same pass share it.
///
/// A permit bounds how many estimates are held and files made at the same time; it is not held while waiting for a pass.
pub(super) async fn file_so_far(app: &Service, id: Uuid, name: &str) -> Result<Option<MadeFile>, Problem> {
    let newest = async |live: &LiveJob| {
        let estimate = tokio::time::timeout(WAIT_FOR_PASS, live.newest_estimate()).await.ok().flatten();
        estimate.filter(|estimate| estimate.passes > 0)
    };
    if let Some(live) = app.live.get(id) {
        drop(newest(&live).await);
        let permit = permit(&app.permits.reading).await?;
        if let Some(estimate) = newest(&live).await {
            if let Some(made) = live.made(&estimate, name) {
                return Ok(Some(made));
            }
            let (prepared, shown, of_name) = (live.prepared.clone(), estimate.clone(), name.to_owned());
            let made = off_thread(permit, move |_| prepared.result_file(&of_name, &shown)).await?;
            let file = made_file(made.map_err(|error| internal("writing a result failed", &error))?)?;
            live.keep(&estimate, name, file.clone());
            return Ok(Some(file));
        }
    }
    let source = app.store.job_source(id).await?.ok_or_else(Problem::no_such_job)?;
    let Some(state) = source.state else { return Ok(None) };
    let permit = permit(&app.permits.reading).await?;
    let bytes = app.artifacts.read_checked(&state.key, &state.hash).await?;
    let (meshes, runtime, name) = (app.meshes.clone(), tokio::runtime::Handle::current(), name.to_owned());
    let made = off_thread(permit, move |cancel| {
        let meshes = meshes.for_document(runtime, cancel);
        let prepared = prepare(source.submitted.as_bytes(), &meshes).map_err(|errors| errors.to_string())?;
        let estimate = checkpoint::decode(prepared.empty_estimate(), &bytes)?;
        prepared.result_file(&name, &estimate).map_err(|error| error.to_string())
    })
    .await?;
    made_file(made.map_err(|error| internal("reading a checkpoint failed", &error))?).map(Some)
}

/// Reads a file of a job: the stored one, or the file as it would be now; `None` if there is none (yet).
pub(super) async fn file_now(app: &Service, id: Uuid, name: &str) -> Result<Option<Bytes>, Problem> {
    let kept = async || -> Result<Option<Bytes>, Problem> {
        match app.store.artifact(id, name).await? {
            Some(kept) => Ok(Some(app.artifacts.read_artifact(&kept).await?)),
            None => Ok(None),
        }
    };
    if let Some(bytes) = kept().await? {
        return Ok(Some(bytes));
    }
    match file_so_far(app, id, name).await {
        Ok(Some(file)) => Ok(Some(file.bytes)),
        // it may have finished between the first look and now
        Ok(None) => kept().await,
        Err(problem) if problem.status == StatusCode::NOT_FOUND.as_u16() => Ok(None),
        Err(problem) => Err(problem),
    }
}

fn made_file(file: Option<ResultFile>) -> Result<MadeFile, Problem> {
    let file = file.ok_or_else(|| Problem::not_found("the job has no such output"))?;
    Ok(MadeFile { media_type: file.media_type, bytes: file.bytes.into() })
}

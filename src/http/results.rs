//! Results of a job: reports on tubes, and files of any kind; for a running job, the results so far.

use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;

use axum::http::HeaderMap;
use axum::response::Response;
use bytes::Bytes;
use serde::Deserialize;
use tokio::time::Instant;
use uuid::Uuid;

use crate::document::result::TubeResult;
use crate::document::result::tube_report::TubeReport;
use crate::engine::checkpoint;
use crate::engine::passes::RenderError;
use crate::http::content::Binary;
use crate::http::formats::{self, Format};
use crate::http::jobs::resource::names;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem};
use crate::http::turns::{Line, Turn};
use crate::http::{App, Service, content};
use crate::output::OutputError;
use crate::present::outputs::{Annual, Output, moments_outputs};
use crate::present::prepared::prepare;
use crate::present::reader::{Kept, ResultReader};
use crate::present::subject::Subject;
use crate::queue::files::FileError;
use crate::queue::live::{LiveEstimate, LiveJob};
use crate::queue::store::{Job, JobSource, StateFile};

/// Longest time that a reader of a running job waits for the end of a pass.
const WAIT_FOR_PASS: Duration = Duration::from_secs(20);

/// Longest part of that time for which the reader has a turn, which others wait for: short passes end one after the other meanwhile.
const WAIT_IN_TURN: Duration = Duration::from_millis(100);

const TUBE_FORMATS: [Format; 4] = [Format::Json, Format::Svg, Format::Png, Format::Pdf];

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
        (status = 416, description = "The range is not in the file"),
        (status = 422, description = "A parameter is not valid"),
        (status = 404, description = "No such job or tube, or the first pass has not finished yet")))]
pub async fn tube(app: App, Path((id, file)): Path<(Uuid, String)>, headers: HeaderMap) -> Result<Response, Problem> {
    let by_suffix = formats::by_suffix(&file, &TUBE_FORMATS);
    let (tube, format) = by_suffix.unwrap_or_else(|| (&file, formats::accepted(&headers, &TUBE_FORMATS)));
    // a number may be written in several ways, a name not
    let number = tube.parse().ok().filter(|number: &usize| number.to_string() == tube).ok_or_else(no_such_output)?;
    let answer = result_file(&app, id, &headers, Output::Tube(number, format)).await?;
    let answer = formats::named(answer, &format!("tube-{tube}.{}", format.suffix()));
    Ok(if by_suffix.is_some() { answer } else { formats::vary_by_accept(answer) })
}

/// Answers with a file of a job: the stored one, or else the one that is made of its results so far, once for all readers of a pass.
pub(super) async fn result_file(
    app: &Service,
    id: Uuid,
    headers: &HeaderMap,
    output: Output,
) -> Result<Response, Problem> {
    if let Some(artifact) = app.store.artifact(id, &output.file()).await? {
        return content::stored(headers, &app.artifacts, &artifact).await;
    }
    let kept = match &output {
        Output::Grid(name, _) => vec![Output::Grid(name.clone(), Format::Json)],
        Output::Annual(..) => kept_of_year(&grid_names(app, id).await?),
        Output::Surfaces(_) => vec![Output::Surfaces(Format::Json)],
        other => vec![other.clone()],
    };
    let missing = if let Output::Surfaces(_) = output { no_surfaces } else { no_such_output };
    let made = read(app, id, kept, move |results, _| results.file(&output)?.ok_or_else(missing)).await?;
    content::made(headers, made.bytes, made.media_type)
}

/// Lists the kept files of which a year with these grids is made.
pub(super) fn kept_of_year(grids: &[String]) -> Vec<Output> {
    let of_grids = grids.iter().map(|name| Output::Grid(name.clone(), Format::Json));
    of_grids.chain(moments_outputs(grids.iter().map(String::as_str))).collect()
}

/// Returns the names of the grids of a job.
pub(super) async fn grid_names(app: &Service, id: Uuid) -> Result<Vec<String>, Problem> {
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    Ok(names(&job.document, "grids").map(str::to_owned).collect())
}

/// Runs `work`, which may take some time, with the results of a job and its row, of one moment: the results after the last pass for which
/// a reader has waited, or after the pass that runs now; those of the stored checkpoint; or, once the job has ended, those in its files,
/// of which `kept` are read.
///
/// A turn bounds how many estimates are held and files made at the same time.
pub(super) async fn read<T: Send + 'static>(
    app: &Service,
    id: Uuid,
    kept: Vec<Output>,
    work: impl FnOnce(&dyn ResultReader, Job) -> Result<T, Problem> + Send + 'static,
) -> Result<T, Problem> {
    // only jobs of the owner are read
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    // in this order, a job that goes on or ends meanwhile is found in its next state
    if let Some(live) = app.live.get(id)
        && let Some((turn, newest)) = newest_in_turn(&live, &app.permits.reading).await?
    {
        return off_thread(turn, move |_| work(&newest.results(), job)).await?;
    }
    let turn = permit(&app.permits.reading).await?;
    let (submitted, state) = stored(app, id).await?;
    let (uploads, years, runtime) = (app.uploads.clone(), app.years.clone(), tokio::runtime::Handle::current());
    if let Some(bytes) = state {
        let made = off_thread(turn, move |cancel| {
            let prepared = prepare(submitted.as_bytes(), &uploads.for_document(runtime, cancel));
            let prepared = prepared.map_err(|errors| Problem::failed("reading a job failed", &errors))?;
            let estimate = checkpoint::decode(prepared.empty_estimate(), &bytes);
            let estimate = estimate.map_err(|error| Problem::failed("reading a checkpoint failed", &error))?;
            work(&prepared.results(&estimate), job)
        });
        return made.await?;
    }
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    let key = id.to_string();
    let year = years.kept(&key).and_then(Result::ok).flatten();
    let is_needed = |output: &&Output| year.is_none() || !matches!(output, Output::Annual(Annual::Moments(_), _));
    let mut files = HashMap::new();
    // its files come with its end
    for name in kept.iter().filter(|_| job.head.status.is_final()).filter(is_needed).map(Output::file) {
        if let Some(artifact) = app.store.artifact(id, &name).await? {
            files.insert(name, app.artifacts.read_artifact(&artifact).await?);
        }
    }
    let subject = subject_with_meshes(app, &job).await?;
    let made = off_thread(turn, move |cancel| {
        let tubes = job.summary.as_ref().map(|known| Vec::<TubeResult>::deserialize(&known["tubes"]));
        let prepare = move || prepare(submitted.as_bytes(), &uploads.for_document(runtime.clone(), cancel.clone()));
        let results = Kept {
            subject: subject.into(),
            files,
            tubes: tubes.and_then(Result::ok).unwrap_or_default(),
            prepare: Box::new(prepare),
            year,
            years: Some((years, key)),
        };
        work(&results, job)
    });
    made.await?
}

/// Waits for a turn in `line` and the newest estimate of a running job; `None` if that takes too long, or the job ends before. The end of a
/// long pass is waited for without a turn.
async fn newest_in_turn(live: &LiveJob, line: &Arc<Line>) -> Result<Option<(Turn, Arc<LiveEstimate>)>, Problem> {
    let last = Instant::now() + WAIT_FOR_PASS;
    while newest(live, last).await.is_some() {
        let turn = permit(line).await?;
        // a pass that has ended meanwhile took the copy with it
        if let Some(newest) = newest(live, Instant::now() + WAIT_IN_TURN).await {
            return Ok(Some((turn, newest)));
        }
    }
    Ok(None)
}

/// Waits for the estimate after the last pass or the one that runs now; `None` if that takes too long, or the job ends before.
async fn newest(live: &LiveJob, last: Instant) -> Option<Arc<LiveEstimate>> {
    let newest = tokio::time::timeout_at(last, live.newest_estimate()).await.ok().flatten();
    newest.filter(|newest| newest.estimate.passes > 0)
}

/// Reads the document of a job and its checkpoint, if it has one. Where a newer checkpoint or the files of the job have taken the place of
/// one meanwhile, these are found instead.
async fn stored(app: &Service, id: Uuid) -> Result<(String, Option<Bytes>), Problem> {
    let mut missing = None;
    loop {
        let JobSource { submitted, state, .. } = app.store.job_source(id).await?.ok_or_else(Problem::no_such_job)?;
        let Some(StateFile { key, hash }) = state else { return Ok((submitted, None)) };
        match app.artifacts.read_checked(&key, &hash).await {
            Err(FileError::NotFound(_)) if missing.as_ref() != Some(&key) => missing = Some(key),
            read => return Ok((submitted, Some(read?))),
        }
    }
}

/// Returns the description of a job that its figures print.
pub(super) fn subject(job: &Job) -> Subject {
    Subject::new(&job.document, &job.plan).foretold(job.predictions.clone())
}

/// Returns the description of a job with the triangles of its meshes, which it has once it has ended.
pub(super) async fn subject_with_meshes(app: &Service, job: &Job) -> Result<Subject, Problem> {
    let subject = subject(job);
    let Some(artifact) = app.store.artifact(job.head.id, &Output::Meshes.file()).await? else { return Ok(subject) };
    let bytes = app.artifacts.read_artifact(&artifact).await?;
    let meshes = serde_json::from_slice(&bytes).map_err(|error| Problem::failed("reading meshes failed", &error))?;
    Ok(subject.with_meshes(Some(meshes)))
}

pub(super) fn no_such_output() -> Problem {
    Problem::not_found("the job has no such output, or has not finished its first pass yet")
}

fn no_surfaces() -> Problem {
    Problem::not_found(
        "the job has no light on surfaces: its document has no `\"surfaces\": true`, or its first pass has not finished yet",
    )
}

impl From<RenderError> for Problem {
    fn from(error: RenderError) -> Self {
        Problem::failed("making a file of a job failed", &error)
    }
}

impl From<OutputError> for Problem {
    fn from(error: OutputError) -> Self {
        Problem::failed("drawing failed", &error)
    }
}

#[cfg(test)]
mod tests {
    use futures::FutureExt;

    use super::*;
    use crate::document::NoFiles;
    use crate::present::subject::tests::document;
    use crate::queue::live::LiveJobs;

    /// A reader whose estimate was dropped while it waited for its turn gives the turn back, and waits without one.
    #[tokio::test]
    async fn a_long_pass_is_waited_for_without_a_turn() {
        let prepared = prepare(document().to_string().as_bytes(), &NoFiles).unwrap();
        let live = LiveJobs::default().start(Uuid::nil(), prepared.into());
        let mut estimate = live.prepared.empty_estimate();
        estimate.passes = 1;
        let line = Line::new(1);
        let other = permit(&line).await.unwrap();
        let mut reader = Box::pin(newest_in_turn(&live, &line));
        assert!((&mut reader).now_or_never().is_none(), "no pass has ended");
        live.publish(&estimate);
        assert!((&mut reader).now_or_never().is_none(), "it is the turn of the other");
        live.publish(&estimate);
        drop(other);
        let other = tokio::select! {
            _ = &mut reader => unreachable!("no reader waited for the pass that has ended"),
            turn = async { permit(&line).await.unwrap() } => turn,
        };
        drop(other);
        live.publish(&estimate);
        assert!(reader.await.unwrap().is_some());
    }
}

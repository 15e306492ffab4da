//! What a job computed: grids, views, reports on tubes. Of a running job, what there is so far.

use std::time::Duration;

use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use serde::Deserialize;
use utoipa::openapi::schema::{Object, ObjectBuilder, Type};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::document::result::tube_report::TubeReport;
use crate::document::result::{GridResult, TubeResult};
use crate::http::content::Binary;
use crate::http::formats::{self, Format};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::http::{App, Service, content};
use crate::job::checkpoint;
use crate::job::convergence::PREVIEW_PASSES;
use crate::job::live::{LiveJob, MadeFile};
use crate::job::prepare::prepare;
use crate::job::results;
use crate::job::results::ResultFile;

/// Time that a reader of a running job waits for its pass to end.
const WAIT_FOR_PASS: Duration = Duration::from_secs(20);

#[derive(Clone, Copy, PartialEq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GridFormat {
    Json,
    Csv,
    /// False colours with a scale.
    Png,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct GridQuery {
    /// Instead of the header `Accept`.
    #[param(inline)]
    format: Option<GridFormat>,
}

#[derive(Clone, Copy, Default, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum PictureStyle {
    #[default]
    Tone,
    FalseColour,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct PictureQuery {
    /// Style of a PNG: tone-mapped (the default), or luminance in false colours with a scale.
    #[param(inline)]
    style: Option<PictureStyle>,
    /// Pass after which a progress image was kept; of a tone-mapped PNG only.
    #[param(schema_with = kept_passes)]
    pass: Option<u64>,
}

fn kept_passes() -> Object {
    ObjectBuilder::new().schema_type(Type::Integer).enum_values(Some(PREVIEW_PASSES)).build()
}

impl From<GridFormat> for Format {
    fn from(format: GridFormat) -> Self {
        match format {
            GridFormat::Json => Self::Json,
            GridFormat::Csv => Self::Csv,
            GridFormat::Png => Self::Png,
        }
    }
}

const GRID_FORMATS: [Format; 3] = [Format::Json, Format::Csv, Format::Png];
const TUBE_FORMATS: [Format; 2] = [Format::Json, Format::Svg];
const VIEW_FORMATS: [Format; 2] = [Format::Png, Format::Exr];

/// A grid.
#[utoipa::path(get, path = "/v1/jobs/{id}/grids/{name}", operation_id = "get_grid", tag = "results",
    params(("id" = Uuid, Path), ("name" = String, Path, description = "The grid's name; with `.json`, `.csv` or `.png` a file"), GridQuery),
    responses(
        (status = 200, description = "Illuminance and its standard error; as PNG in false colours",
            content((GridResult = "application/json"), (String = "text/csv"), (inline(Binary) = "image/png"))),
        (status = 206, description = "The range of it that was asked for"),
        (status = 304, description = "It is what If-None-Match names"),
        (status = 416, description = "The range is not in the file", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "A parameter is not valid", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job or grid, or no pass is done yet", body = Problem, content_type = "application/problem+json")))]
pub async fn grid(
    app: App,
    Path((id, name)): Path<(Uuid, String)>,
    Query(query): Query<GridQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    if query.format.is_none()
        && formats::by_suffix(&name, &GRID_FORMATS).is_some()
        && let Some(file) = found(result_file(&app, id, &headers, format!("grids/{name}")).await)?
    {
        return Ok(formats::named(file, &name));
    }
    // no such file: a grid may be called `a.csv` itself
    let format = query.format.map_or_else(|| formats::accepted(&headers, &GRID_FORMATS), Format::from);
    let file = format!("{name}.{}", format.suffix());
    let answer = result_file(&app, id, &headers, format!("grids/{file}")).await?;
    Ok(formats::vary_by_accept(formats::named(answer, &file)))
}

/// `None` where the answer is that there is nothing.
fn found(answer: Result<Response, Problem>) -> Result<Option<Response>, Problem> {
    match answer {
        Err(problem) if problem.status == StatusCode::NOT_FOUND.as_u16() => Ok(None),
        answer => answer.map(Some),
    }
}

/// A picture of a view.
#[utoipa::path(get, path = "/v1/jobs/{id}/views/{file}", operation_id = "get_view", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "The view's name; with `.exr` or `.png` a file"), PictureQuery),
    responses(
        (status = 200, description = "OpenEXR with float layers, or PNG", content((inline(Binary) = "image/x-exr"), (inline(Binary) = "image/png"))),
        (status = 206, description = "The range of it that was asked for"),
        (status = 304, description = "It is what If-None-Match names"),
        (status = 416, description = "The range is not in the file", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "A parameter is not valid, or these do not go together", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job or view, or no pass is done yet", body = Problem, content_type = "application/problem+json")))]
pub async fn view(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    Query(query): Query<PictureQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let by_suffix = formats::by_suffix(&file, &VIEW_FORMATS);
    let (name, format) = by_suffix.unwrap_or_else(|| (&file, formats::accepted(&headers, &VIEW_FORMATS)));
    let answer = match (format, query.style, query.pass) {
        (Format::Png, None | Some(PictureStyle::Tone), Some(pass)) => {
            if !PREVIEW_PASSES.contains(&pass) {
                let detail = format!("progress images are kept after passes {PREVIEW_PASSES:?}, but it is {pass}");
                return Err(Problem::invalid_parameter("pass", detail));
            }
            let kept = app.store.artifact(id, &format!("views/{name}.pass{pass}.png")).await?;
            let kept = kept.ok_or_else(|| Problem::not_found("there is no such progress image"))?;
            content::stored(&headers, &app.artifacts, &kept).await
        }
        (Format::Png, Some(PictureStyle::FalseColour), None) => {
            result_file(&app, id, &headers, format!("views/{name}.false_colour.png")).await
        }
        (_, style, None) if format == Format::Png || style.is_none() => {
            result_file(&app, id, &headers, format!("views/{name}.{}", format.suffix())).await
        }
        (_, _, pass) => {
            let parameter = if pass.is_some() { "pass" } else { "style" };
            Err(Problem::invalid_parameter(parameter, "style is of .png, and pass of .png with the style tone"))
        }
    };
    let answer = formats::named(answer?, &format!("{name}.{}", format.suffix()));
    Ok(if by_suffix.is_some() { answer } else { formats::vary_by_accept(answer) })
}

/// The report on a tube.
#[utoipa::path(get, path = "/v1/jobs/{id}/tubes/{file}", operation_id = "get_tube", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "The tube's number in the document, from 0; with `.json` or `.svg` a file")),
    responses(
        (status = 200, description = "Fluxes, efficiencies and the transmission of beams; as SVG the transmission against the sun's altitude",
            content((TubeReport = "application/json"), (String = "image/svg+xml"))),
        (status = 206, description = "The range of it that was asked for"),
        (status = 304, description = "It is what If-None-Match names"),
        (status = 416, description = "The range is not in the file", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "A parameter is not valid", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job or tube, or no pass is done yet", body = Problem, content_type = "application/problem+json")))]
pub async fn tube(app: App, Path((id, file)): Path<(Uuid, String)>, headers: HeaderMap) -> Result<Response, Problem> {
    let by_suffix = formats::by_suffix(&file, &TUBE_FORMATS);
    let (tube, format) = by_suffix.unwrap_or_else(|| (&file, formats::accepted(&headers, &TUBE_FORMATS)));
    let answer = result_file(&app, id, &headers, format!("tubes/{tube}.{}", format.suffix())).await?;
    let answer = formats::named(answer, &format!("tube-{tube}.{}", format.suffix()));
    Ok(if by_suffix.is_some() { answer } else { formats::vary_by_accept(answer) })
}

/// The stored file of a finished job, or the file as it would be now of a running one.
async fn result_file(app: &Service, id: Uuid, headers: &HeaderMap, name: String) -> Result<Response, Problem> {
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
        let artifact =
            artifact.ok_or_else(|| Problem::not_found("the job has no such output, or no pass is done yet"))?;
        return content::stored(headers, &app.artifacts, &artifact).await;
    };
    content::made(headers, file.bytes, file.media_type)
}

/// A file of a finished job that is not kept, from what is.
async fn made_again(app: &Service, id: Uuid, name: &str) -> Result<Option<ResultFile>, Problem> {
    if name.starts_with("tubes/") {
        return report_on_tube(app, id, name).await;
    }
    let (grid, format) = match name.rsplit_once('.') {
        Some((grid, "csv")) => (grid, results::GridFormat::Csv),
        Some((grid, "png")) => (grid, results::GridFormat::Png),
        _ => return Ok(None),
    };
    if !grid.starts_with("grids/") {
        return Ok(None);
    }
    let Some(kept) = app.store.artifact(id, &format!("{grid}.json")).await? else { return Ok(None) };
    let permit = permit(&app.permits.reading).await?;
    let json = app.artifacts.read_checked(&kept.key, &kept.hash).await?;
    let name = name.to_owned();
    let made = off_thread(permit, move |_| results::grid_file_of(&name, format, &json)).await?;
    made.map(Some).map_err(|error| internal("writing a grid failed", &error))
}

/// The report on a tube of a finished job, made again from its document and the fluxes in its summary: the same bytes as
/// before a restart. `None` where the job goes on, or has computed nothing.
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

/// The one file as it would be now: of the last pass that somebody waited for, or the one that runs now, or of what is
/// stored. Readers of the same pass share it.
///
/// A permit bounds how many estimates are held and files made at the same time; it is not held while a pass is waited for.
async fn file_so_far(app: &Service, id: Uuid, name: &str) -> Result<Option<MadeFile>, Problem> {
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
    made_file(made.map_err(|error| internal("reading a state failed", &error))?).map(Some)
}

fn made_file(file: Option<ResultFile>) -> Result<MadeFile, Problem> {
    let file = file.ok_or_else(|| Problem::not_found("the job has no such output"))?;
    Ok(MadeFile { media_type: file.media_type, bytes: file.bytes.into() })
}

//! Year of a job: its summary, its tables, and its figures.

use std::sync::Arc;

use axum::extract::{FromRequest, Request};
use axum::http::{HeaderMap, header};
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use crate::document::annual::hours::HourListDocument;
use crate::document::limits::HOURS_BYTES;
use crate::document::result::annual::PointsYearResult;
use crate::document::result::weather_files::AnnualResult;
use crate::figure::paint::Scale;
use crate::http::content::{self, Binary};
use crate::http::formats::{self, Format};
use crate::http::jobs::posted::Body;
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::http::results::{grid_names, kept_of_year, no_such_output, read, result_file};
use crate::http::target_query::{TargetQuery, check};
use crate::http::{App, Service, Shared};
use crate::present::annual::HoursError;
use crate::present::outputs::{Annual, Output, STATIC_APERTURES, annual_outputs, moments_outputs};
use crate::present::target::WantedTarget;

/// Returns the year of a job: light of the tubes, metrics of the grids, and verdicts.
///
/// A running job has the year of its passes so far.
#[utoipa::path(get, path = "/v1/jobs/{id}/annual", operation_id = "get_annual", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "Metrics with intervals, and verdicts", body = AnnualResult),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 404, description = "No such job, the job has no `annual`, or the first pass has not finished yet")))]
pub async fn annual(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    result_file(&app, id, &headers, Output::Annual(Annual::Summary, Format::Json)).await
}

/// Returns a file of a year of a job.
#[utoipa::path(get, path = "/v1/jobs/{id}/annual/{file}", operation_id = "get_annual_file", tag = "results",
    params(TargetQuery, ("id" = Uuid, Path), ("file" = String, Path,
        description = "One of the names in the job's `links.annual`: `hours.csv`, `fluxes.svg`, and for each grid \
                       `points.NAME.json`, `.csv`, `.npy` and `.ill`, `autonomy.NAME.svg`, `useful.NAME.svg` and `by_hour.NAME.svg`; \
                       figures also as `.png` and `.pdf`; `lighting.csv` with `dimming`")),
    responses(
        (status = 422, description = "A parameter is not valid"),
        (status = 200, description = "The file",
            content((PointsYearResult = "application/json"), (String = "text/csv"), (String = "text/plain"),
                (inline(Binary) = "application/octet-stream"), (String = "image/svg+xml"), (inline(Binary) = "image/png"),
                (inline(Binary) = "application/pdf"))),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 404, description = "No such job or file, the job has no `annual`, or the first pass has not finished yet")))]
pub async fn file(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    Query(query): Query<TargetQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    match query.wanted()? {
        Some(wanted) => autonomy_of(&app, id, &file, wanted, &headers).await,
        None => in_folder(&app, id, "annual", &file, &headers).await,
    }
}

/// Returns a file of a year for the post-processing of Honeybee.
#[utoipa::path(get, path = "/v1/jobs/{id}/annual/honeybee/{file}", operation_id = "get_annual_honeybee", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "`grids_info.json`, `study_info.json` or `sun-up-hours.txt`")),
    responses(
        (status = 200, description = "The file", content((serde_json::Value = "application/json"), (String = "text/plain"))),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 404, description = "No such job or file, the job has no `annual`, or the first pass has not finished yet")))]
pub async fn honeybee(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    in_folder(&app, id, "annual/honeybee", &file, &headers).await
}

/// Returns the illuminances of a grid in the records with light for the post-processing of Honeybee.
#[utoipa::path(get, path = "/v1/jobs/{id}/annual/honeybee/__static_apertures__/default/total/{file}",
    operation_id = "get_annual_honeybee_grid", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "Name of the grid and `.npy`")),
    responses(
        (status = 200, description = "Array of NumPy: float32, sensors x records, in lux",
            content((inline(Binary) = "application/octet-stream"))),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file"),
        (status = 404, description = "No such job or grid, the job has no `annual`, or the first pass has not finished yet")))]
pub async fn honeybee_grid(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let folder = format!("annual/honeybee/{STATIC_APERTURES}/default/total");
    in_folder(&app, id, &folder, &file, &headers).await
}

/// Body with hours, which may be longer than documents of jobs.
pub struct HourList(Body);

impl FromRequest<Arc<Shared>> for HourList {
    type Rejection = Problem;

    async fn from_request(request: Request, app: &Arc<Shared>) -> Result<Self, Problem> {
        let most = HOURS_BYTES.max(app.limits.document_bytes);
        Body::within(request, app, most).await.map(Self)
    }
}

/// Computes the illuminances of the sensors of a grid at any hours, by the responses of the room that its year is made of.
///
/// Nothing is traced in the room again: a list of thousands of hours takes a fraction of a second. The sky of each hour is that of Perez; the
/// sun is over the place of the weather file. Closures must be Lambertian. `other_daylight` does not count.
#[utoipa::path(post, path = "/v1/jobs/{id}/annual/hours/{grid}", operation_id = "compute_annual_hours", tag = "results",
    params(("id" = Uuid, Path), ("grid" = String, Path, description = "Name of the grid")),
    request_body(content = HourListDocument, description = "The hours", content_type = "application/json", example = json!({
        "hours": [
            { "time": "2026-06-21T12:00:00+02:00", "direct_normal_irradiance_w_m2": 700, "diffuse_horizontal_irradiance_w_m2": 130 },
            { "time": "2026-12-21T12:00:00+01:00", "direct_normal_irradiance_w_m2": 0, "diffuse_horizontal_irradiance_w_m2": 60 }
        ]
    })),
    responses(
        (status = 200, description = "Array of NumPy: float32, sensors x hours, in lux; 0 while the sun is down",
            content((inline(Binary) = "application/octet-stream"))),
        (status = 400, description = "The body is not JSON"),
        (status = 404, description = "No such job or grid, the job has no `annual`, or the first pass has not finished yet"),
        (status = 409, description = "The closures of the job let light pass with its direction"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not application/json"),
        (status = 422, description = "The hours are not valid; see `errors`")))]
pub async fn hours(
    app: App,
    Path((id, grid)): Path<(Uuid, String)>,
    HourList(body): HourList,
) -> Result<Response, Problem> {
    let turn = permit(&app.permits.fluxes).await?;
    let posted = body.read(&turn).await?;
    let hours = off_thread(turn.clone(), move |_| HourListDocument::from_value(posted.value)).await??;
    let kept = kept_of_year(&grid_names(&app, id).await?);
    let made = read(&app, id, kept, move |results, _| {
        let year = results.year()?.ok_or_else(no_such_output)?;
        year.at_hours(&grid, &hours).map_err(|error| match error {
            HoursError::NoSuchGrid => no_such_output(),
            HoursError::NoResponses => Problem::conflict(
                "the closures of the job let light pass with its direction, so that its room has no responses: only the hours of its weather \
                 files are known",
            ),
            HoursError::Hours(errors) => errors.into(),
        })
    });
    let array = made.await?;
    Ok(([(header::CONTENT_TYPE, Format::Npy.media_type())], array).into_response())
}

/// Draws the daylight autonomy of a grid for the target of a reader, which no other file of a year depends on.
async fn autonomy_of(
    app: &Service,
    id: Uuid,
    file: &str,
    wanted: WantedTarget,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    let grids = grid_names(app, id).await?;
    let output = in_year(&grids, &format!("annual/{file}"))?;
    let Output::Annual(Annual::Autonomy(name), format) = output else {
        return Err(Problem::invalid_parameter("target_lux", "is allowed only for the figures `autonomy.NAME`"));
    };
    check(wanted, &job.document)?;
    let format = format.of_figure(Scale::Single).ok_or_else(no_such_output)?;
    let drawn = read(app, id, kept_of_year(&grids), move |results, _| {
        let year = results.year()?.ok_or_else(no_such_output)?;
        let drawing = year.autonomy_figure(results.subject(), &name, Some(wanted)).ok_or_else(no_such_output)??;
        Ok(format.write(&drawing)?)
    });
    Ok(formats::named(content::made(headers, drawn.await?, format.media_type())?, file))
}

async fn in_folder(
    app: &Service,
    id: Uuid,
    folder: &str,
    file: &str,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let grids = grid_names(app, id).await?;
    let output = in_year(&grids, &format!("{folder}/{file}"))?;
    Ok(formats::named(result_file(app, id, headers, output).await?, file))
}

/// Returns the file of a year with grids of these names that has a path; a file that the year does not have is not made.
fn in_year(grids: &[String], path: &str) -> Result<Output, Problem> {
    let names = || grids.iter().map(String::as_str);
    let mut outputs = annual_outputs(names(), true).into_iter().chain(moments_outputs(names()));
    outputs.find(|output| output.file() == path).ok_or_else(no_such_output)
}

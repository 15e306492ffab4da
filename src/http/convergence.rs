//! Convergence of a job, its errors over time: as JSON, as a table, and as a figure.

use axum::http::HeaderMap;
use axum::response::Response;
use bytes::Bytes;
use serde::{Deserialize, Serialize};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::engine::progress::PassReport;
use crate::figure::FigureFormat;
use crate::figure::paint::Scale;
use crate::http::content::Binary;
use crate::http::formats::{self, Format, scale};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::http::query_faults::up_to;
use crate::http::results::subject;
use crate::http::{App, Service, content};
use crate::present::convergence_files::{self, ErrorHistory};
use crate::queue::store::Job;

/// Default number of rows of the convergence table in one answer.
const DEFAULT_ROWS: u32 = 1000;
const MOST_ROWS: u32 = 10_000;
/// Largest number of points of a convergence figure, and of the fit.
const MOST_POINTS: u32 = 2000;

/// Representations of the convergence.
const FORMATS: [Format; 5] = [Format::Json, Format::Csv, Format::Svg, Format::Png, Format::Pdf];

// what stands in `///` here would be repeated in the description of the parameter
#[expect(dead_code, reason = "stands for a schema")]
#[derive(ToSchema)]
#[schema(rename_all = "snake_case")]
enum ConvergenceFormat {
    Json,
    Csv,
    Svg,
    Png,
    Pdf,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct ConvergenceQuery {
    /// Representation of the answer, instead of the header `Accept`.
    #[param(inline, value_type = Option<ConvergenceFormat>)]
    format: Option<Format>,
    /// Largest number of rows of the answer; 1000 when absent. Figures show all passes.
    #[param(minimum = 1, maximum = 10000)]
    #[serde(default, deserialize_with = "up_to::<_, MOST_ROWS>")]
    limit: Option<u32>,
    /// Number of the pass after which the rows begin; 0 when absent. Figures show all passes.
    #[param(minimum = 0, maximum = 18_446_744_073_709_551_615u64)]
    after: Option<u64>,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct DensityQuery {
    /// Pixels of a PNG per unit of its figure; 1 when absent.
    #[param(minimum = 1, maximum = 2)]
    density: Option<u8>,
}

impl DensityQuery {
    /// Returns the requested density.
    pub fn density(&self) -> Result<Scale, Problem> {
        scale(self.density)
    }
}

/// Passes of a job in order, and the course of its errors. There are passes 1 to 64, then those nearest to powers of 2^(1/8), and
/// the last pass of a job that ended.
#[derive(Serialize, ToSchema)]
pub struct Convergence {
    pub job: Uuid,
    /// Course of the errors of the grids over all passes; null without grids, and before a pass has estimated an error.
    pub grids: Option<ErrorHistory>,
    /// Course of the errors of the views over all passes; null without views, and before a pass has estimated an error.
    pub views: Option<ErrorHistory>,
    pub passes: Vec<PassReport>,
    /// Value of `after` for the next page; null when this is the last one.
    pub next_after: Option<u64>,
}

/// Returns the passes with their time, photons, rays and errors, and the law that the errors follow.
///
/// The rows are the first 64 passes, then ever fewer, about 9 % apart; `passes` of each row is the number of passes done.
#[utoipa::path(get, path = "/v1/jobs/{id}/convergence", operation_id = "get_convergence", tag = "results",
    params(("id" = Uuid, Path), ConvergenceQuery),
    responses(
        (status = 200, description = "The passes so far", content((Convergence = "application/json"), (String = "text/csv"),
            (String = "image/svg+xml"), (inline(Binary) = "image/png"), (inline(Binary) = "application/pdf"))),
        (status = 422, description = "A parameter is not valid"),
        (status = 404, description = "No such job")))]
pub async fn convergence(
    app: App,
    Path(id): Path<Uuid>,
    Query(query): Query<ConvergenceQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let format = query.format.unwrap_or_else(|| formats::accepted(&headers, &FORMATS));
    let limit = query.limit.unwrap_or(DEFAULT_ROWS);
    let rows = Rows { after: query.after.unwrap_or(0), limit };
    Ok(formats::vary_by_accept(file(&app, id, &headers, format, rows).await?))
}

/// Returns the passes as a file: `convergence.json`.
#[utoipa::path(get, path = "/v1/jobs/{id}/convergence.json", operation_id = "get_convergence_json", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The passes so far", body = Convergence),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 404, description = "No such job")))]
pub async fn convergence_json(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    file(&app, id, &headers, Format::Json, ROWS_OF_FILES).await
}

/// Returns the passes as a table: `convergence.csv`.
#[utoipa::path(get, path = "/v1/jobs/{id}/convergence.csv", operation_id = "get_convergence_csv", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The passes so far", body = String, content_type = "text/csv"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 404, description = "No such job")))]
pub async fn convergence_csv(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    file(&app, id, &headers, Format::Csv, ROWS_OF_FILES).await
}

/// Draws relative error against render seconds, both logarithmic, with the law that it follows: `convergence.svg`.
#[utoipa::path(get, path = "/v1/jobs/{id}/convergence.svg", operation_id = "get_convergence_svg", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The figure", body = String, content_type = "image/svg+xml"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 404, description = "No such job")))]
pub async fn convergence_svg(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    figure(&app, id, &headers, FigureFormat::Svg).await
}

/// Draws the figure of `convergence.svg` in pixels.
#[utoipa::path(get, path = "/v1/jobs/{id}/convergence.png", operation_id = "get_convergence_png", tag = "results",
    params(("id" = Uuid, Path), DensityQuery),
    responses(
        (status = 200, description = "The figure", body = inline(Binary), content_type = "image/png"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 422, description = "A parameter is not valid"),
        (status = 404, description = "No such job")))]
pub async fn convergence_png(
    app: App,
    Path(id): Path<Uuid>,
    Query(query): Query<DensityQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    figure(&app, id, &headers, FigureFormat::Png(query.density()?)).await
}

/// Draws the figure of `convergence.svg` for print.
#[utoipa::path(get, path = "/v1/jobs/{id}/convergence.pdf", operation_id = "get_convergence_pdf", tag = "results", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The figure", body = inline(Binary), content_type = "application/pdf"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 404, description = "No such job")))]
pub async fn convergence_pdf(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    figure(&app, id, &headers, FigureFormat::Pdf).await
}

/// Page of the convergence table.
struct Rows {
    after: u64,
    limit: u32,
}

/// Rows of the table in a file: the first [`MOST_ROWS`].
const ROWS_OF_FILES: Rows = Rows { after: 0, limit: MOST_ROWS };

async fn file(app: &Service, id: Uuid, headers: &HeaderMap, format: Format, rows: Rows) -> Result<Response, Problem> {
    if let Some(format) = format.of_figure(Scale::Single) {
        return figure(app, id, headers, format).await;
    }
    let (job, outline) = told(app, id).await?;
    // one more tells whether there is a next page
    let mut passes = app.store.convergence(id, rows.after, rows.limit + 1).await?;
    let more = passes.len() > rows.limit as usize;
    passes.truncate(rows.limit as usize);
    let next_after = passes.last().filter(|_| more).map(|pass| pass.passes);
    if format == Format::Csv {
        let table = convergence_files::convergence_csv(&passes);
        return named(headers, table, "text/csv; charset=utf-8", "csv");
    }
    let subject = subject(&job);
    let [grids, views] = convergence_files::histories(&subject, &outline);
    let bytes = serde_json::to_vec(&Convergence { job: id, grids, views, passes, next_after })
        .map_err(|error| Problem::failed("writing the convergence table failed", &error))?;
    named(headers, bytes, "application/json", "json")
}

async fn figure(app: &Service, id: Uuid, headers: &HeaderMap, format: FigureFormat) -> Result<Response, Problem> {
    let (job, outline) = told(app, id).await?;
    let drawn = off_thread(permit(&app.permits.reading).await?, move |_| {
        format.write(&convergence_files::convergence_figure(&subject(&job), &outline))
    });
    named(headers, drawn.await??, format.media_type(), format.suffix())
}

/// Reads a job, and as many of its passes as a figure can show.
async fn told(app: &Service, id: Uuid) -> Result<(Job, Vec<PassReport>), Problem> {
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    let outline = app.store.convergence_outline(id, MOST_POINTS).await?;
    Ok((job, outline))
}

fn named(
    headers: &HeaderMap,
    bytes: impl Into<Bytes>,
    media_type: &'static str,
    suffix: &'static str,
) -> Result<Response, Problem> {
    Ok(formats::named(content::made(headers, bytes, media_type)?, &format!("convergence.{suffix}")))
}

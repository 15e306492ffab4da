//! Figures of a job besides those of its outputs: its sky, sections through its room, and the fluxes of its tubes in lumens.

use axum::http::HeaderMap;
use axum::response::Response;
use serde_json::Value;
use uuid::Uuid;

use crate::figure::FigureFormat;
use crate::http::content::{self, Binary};
use crate::http::convergence::DensityQuery;
use crate::http::formats::{self, Format};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::http::report::sheet;
use crate::http::results::subject_with_meshes;
use crate::http::{App, Service};
use crate::present::report::OVERVIEW;
use crate::present::site_figure::{SiteFigure, site_figure};

/// Representations of a figure.
const FORMATS: [Format; 3] = [Format::Svg, Format::Png, Format::Pdf];

/// Draws the sky with the sun's path of the day, a section through room, roof and tubes, the flux of a tube and where it goes, or
/// plan, section and picture side by side.
#[utoipa::path(get, path = "/v1/jobs/{id}/figures/{file}", operation_id = "get_figure", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "`sky`, `section_x`, `section_y`, `overview`, \
                                                                       or `lumens_` and the number of a tube; a \
                                                                       suffix `.svg`, `.png` or `.pdf` selects the \
                                                                       format"), DensityQuery),
    responses(
        (status = 200, description = "The figure", content((String = "image/svg+xml"), (inline(Binary) = "image/png"), (inline(Binary) = "application/pdf"))),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 422, description = "A parameter is not valid"),
        (status = 404, description = "No such job or figure, or no data for it (yet)")))]
pub async fn figure(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    Query(query): Query<DensityQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let by_suffix = formats::by_suffix(&file, &FORMATS);
    let (name, format) = by_suffix.unwrap_or_else(|| (&file, formats::accepted(&headers, &FORMATS)));
    let format = format.of_figure(query.density()?).unwrap_or(FigureFormat::Svg);
    let drawn = match name {
        OVERVIEW => sheet(&app, id, None, move |sheet| format.write(&sheet.overview())).await?,
        name => of_site(&app, id, name, format).await?,
    };
    let answer = content::made(&headers, drawn, format.media_type())?;
    let answer = formats::named(answer, &format!("{name}.{}", format.suffix()));
    Ok(if by_suffix.is_some() { answer } else { formats::vary_by_accept(answer) })
}

async fn of_site(app: &Service, id: Uuid, name: &str, format: FigureFormat) -> Result<Vec<u8>, Problem> {
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    let figure = SiteFigure::of_name(name).ok_or_else(|| Problem::not_found("there is no such figure"))?;
    let subject = subject_with_meshes(app, &job).await?;
    let drawn = off_thread(permit(&app.permits.reading).await?, move |_| {
        let drawing = site_figure(figure, &subject, job.summary.as_ref().unwrap_or(&Value::Null));
        let drawing = drawing.ok_or_else(|| Problem::not_found("the job has no data for this figure (yet)"))?;
        Ok(format.write(&drawing)?)
    });
    drawn.await?
}

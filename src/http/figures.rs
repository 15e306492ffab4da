//! Figures of a job beside those of its outputs: its sky, sections through its room, and the lumens of its tubes.

use axum::http::HeaderMap;
use axum::response::Response;
use serde_json::Value;
use uuid::Uuid;

use crate::figure::paint;
use crate::figure::svg::svg;
use crate::http::App;
use crate::http::content::{self, Binary};
use crate::http::convergence::DensityQuery;
use crate::http::formats::{self, Format};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::http::results::internal;
use crate::job::site_figure::{SiteFacts, SiteFigure, site_figure};
use crate::job::subject::Subject;

/// Representations of a figure.
const FORMATS: [Format; 2] = [Format::Svg, Format::Png];

/// The sky with the sun's path of the day, a section through room, roof and tubes, or where the light of a tube goes.
#[utoipa::path(get, path = "/v1/jobs/{id}/figures/{file}", operation_id = "get_figure", tag = "results",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "`sky`, `section_x`, `section_y`, or `lumens_` and the number of a tube; with `.svg` or `.png` a file"), DensityQuery),
    responses(
        (status = 200, description = "The figure", content((String = "image/svg+xml"), (inline(Binary) = "image/png"))),
        (status = 304, description = "It is what If-None-Match names"),
        (status = 422, description = "A parameter is not valid", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job or figure, or what it shows is not known (yet)", body = Problem, content_type = "application/problem+json")))]
pub async fn figure(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    Query(query): Query<DensityQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    let by_suffix = formats::by_suffix(&file, &FORMATS);
    let (name, format) = by_suffix.unwrap_or_else(|| (&file, formats::accepted(&headers, &FORMATS)));
    let density = query.density()?;
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    let found = SiteFigure::of_name(name).ok_or_else(|| Problem::not_found("there is no such figure"))?;
    let drawn = off_thread(permit(&app.permits.reading).await?, move |_| {
        let subject = Subject::new(&job.document, &job.plan);
        let facts = SiteFacts::of(job.summary.as_ref().unwrap_or(&Value::Null));
        let drawing = site_figure(found, &subject, &facts);
        let drawing = drawing.ok_or_else(|| Problem::not_found("the job does not know what the figure shows"))?;
        let written = match format {
            Format::Png => paint::png(&drawing, density),
            _ => svg(&drawing).map(String::into_bytes),
        };
        written.map_err(|error| internal("drawing failed", &error))
    });
    let media_type = if format == Format::Png { "image/png" } else { "image/svg+xml" };
    let answer = content::made(&headers, drawn.await??, media_type)?;
    let answer = formats::named(answer, &format!("{name}.{}", format.suffix()));
    Ok(if by_suffix.is_some() { answer } else { formats::vary_by_accept(answer) })
}

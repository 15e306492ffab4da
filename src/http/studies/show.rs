//! Reading of studies, one or many, and of their files.

use axum::Json;
use axum::http::HeaderMap;
use axum::response::{IntoResponse, Response};
use serde::Serialize;
use utoipa::ToSchema;
use uuid::Uuid;

use super::evaluate::{evaluate, study_resource};
use super::looked::Looked;
use super::made::{tagged, unchanged};
use super::pictures;
use super::resource::{StudyResource, StudySummary};
use crate::figure::FigureFormat;
use crate::http::App;
use crate::http::content::{self, Binary};
use crate::http::convergence::DensityQuery;
use crate::http::formats::{self, Format};
use crate::http::job_sets::any_kind::{PageQuery, page};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::queue::store::SetKind;

/// Formats of the files of a study's results.
const FORMATS: [Format; 4] = [Format::Csv, Format::Svg, Format::Png, Format::Pdf];

/// A page of studies, newest first.
#[derive(Serialize, ToSchema)]
pub struct StudyPage {
    pub studies: Vec<StudySummary>,
    /// Value of `cursor` for the next page; null on the last one.
    pub next_cursor: Option<Uuid>,
}

/// Lists studies, newest first.
#[utoipa::path(get, path = "/v1/studies", operation_id = "list_studies", tag = "studies", params(PageQuery),
    responses(
        (status = 200, description = "A page of studies", body = StudyPage),
        (status = 422, description = "A parameter is not valid; see `errors`")))]
pub async fn list(app: App, Query(query): Query<PageQuery>) -> Result<Json<StudyPage>, Problem> {
    let (sets, next_cursor) = page(&app, SetKind::Study, query).await?;
    let mut studies = Vec::with_capacity(sets.len());
    for study in sets {
        studies.push(Looked::new(&app, study).await?.summary());
    }
    Ok(Json(StudyPage { studies, next_cursor }))
}

/// Returns the study, with the results of its jobs that have ended.
#[utoipa::path(get, path = "/v1/studies/{id}", operation_id = "get_study", tag = "studies", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The study", body = StudyResource),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 404, description = "No such study")))]
pub async fn get(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    let looked = Looked::at(&app, id).await?;
    // weak, for the answer may be compressed on its way
    let etag = format!("W/\"{}\"", app.study_files.tag(&looked.study, &looked.heads, "study"));
    if let Some(unchanged) = unchanged(&headers, &etag) {
        return Ok(unchanged);
    }
    Ok(tagged(Json(study_resource(&app, looked).await?).into_response(), &etag))
}

/// Returns the results so far as a table, as a figure (actual error against processor seconds by method), and as pictures of views.
#[utoipa::path(get, path = "/v1/studies/{id}/files/{file}", operation_id = "get_study_file", tag = "studies",
    params(("id" = Uuid, Path), ("file" = String, Path, description = "`study.csv`, `study.svg`, `study.png` or \
                                                                       `study.pdf`; for a study with pictures also \
                                                                       `pictures.json` and, for each view, \
                                                                       `NAME.equal_time.png` and `NAME.accuracies.png`"), DensityQuery),
    responses(
        (status = 200, description = "The file", content((String = "text/csv"), (Object = "application/json"), (String = "image/svg+xml"), (inline(Binary) = "image/png"), (inline(Binary) = "application/pdf"))),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 422, description = "A parameter is not valid"),
        (status = 404, description = "No such study or file, or its reference has not been computed (yet)")))]
pub async fn file(
    app: App,
    Path((id, file)): Path<(Uuid, String)>,
    Query(query): Query<DensityQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    if pictures::is_name(&file) {
        return pictures::answer(&app, Looked::at(&app, id).await?, &file, &headers).await;
    }
    let format = formats::by_suffix(&file, &FORMATS).filter(|(name, _)| *name == "study").map(|(_, format)| format);
    let format = format.ok_or_else(|| {
        Problem::not_found("there is no such file: a study has study.csv, study.svg, study.png and study.pdf")
    })?;
    let of_figure = format.of_figure(query.density()?);
    let mut looked = Looked::at(&app, id).await?;
    let tag = app.study_files.tag(&looked.study, &looked.heads, &format!("{file} {of_figure:?}"));
    if let Some(unchanged) = unchanged(&headers, &format!("\"{tag}\"")) {
        return Ok(unchanged);
    }
    let record = looked.record()?;
    let found = evaluate(&app, &mut looked, &record).await?;
    let found = found.ok_or_else(|| Problem::not_found("the reference of the study has not been computed (yet)"))?;
    let made = off_thread(permit(&app.permits.reading).await?, move |_| match of_figure {
        Some(figure) => figure.write(&found.figure(looked.study.name.as_deref())),
        None => Ok(found.csv().into_bytes()),
    });
    let bytes = made.await?.map_err(|error| Problem::failed("drawing failed", &error))?;
    let media_type = of_figure.map_or("text/csv; charset=utf-8", FigureFormat::media_type);
    Ok(formats::named(content::made_as(&headers, &tag, bytes, media_type)?, &file))
}

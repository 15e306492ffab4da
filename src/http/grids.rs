//! Grids of a job: as JSON, as a table, and as figures over the plan of the room.

use axum::http::{HeaderMap, StatusCode};
use axum::response::Response;
use bytes::Bytes;
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::document::result::GridResult;
use crate::figure::paint::Scale;
use crate::figure::plan_map::Numbers;
use crate::http::content::{self, Binary};
use crate::http::formats::{self, Format};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::http::results::{file_now, found, internal, result_file};
use crate::http::{App, Service};
use crate::present::grid_figure::{GridWishes, Quantity, difference_figure, grid_figure};
use crate::present::subject::Subject;

/// Representations of a grid.
const FORMATS: [Format; 5] = [Format::Json, Format::Csv, Format::Png, Format::Svg, Format::Pdf];

#[derive(Clone, Copy, PartialEq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GridFormat {
    Json,
    Csv,
    /// Map over the plan of the room with colours and lines of equal value, in pixels.
    Png,
    /// Map over the plan of the room with colours and lines of equal value, as vector graphics.
    Svg,
    /// Map over the plan of the room with colours and lines of equal value, for print.
    Pdf,
}

impl From<GridFormat> for Format {
    fn from(format: GridFormat) -> Self {
        match format {
            GridFormat::Json => Self::Json,
            GridFormat::Csv => Self::Csv,
            GridFormat::Png => Self::Png,
            GridFormat::Svg => Self::Svg,
            GridFormat::Pdf => Self::Pdf,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum GridQuantity {
    /// Illuminance in lux.
    Illuminance,
    /// Percent of the unobstructed horizontal illuminance: under an overcast sky the daylight factor.
    Ratio,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct GridQuery {
    /// Representation of the answer, instead of the header `Accept`.
    #[param(inline)]
    format: Option<GridFormat>,
    /// Quantity that a figure shows; illuminance when absent.
    #[param(inline)]
    quantity: Option<GridQuantity>,
    /// Value at the end of a figure's scale, so that several figures have the same scale; the greatest value of the grid when
    /// absent.
    #[param(exclusive_minimum = 0)]
    max: Option<f64>,
    /// True to print the values of cells into a figure, where there is room; false when absent.
    numbers: Option<bool>,
    /// Job whose grid of this name is subtracted in a figure.
    minus: Option<Uuid>,
    /// Pixels of a PNG per unit of the figure; 1 when absent.
    #[param(minimum = 1, maximum = 2)]
    density: Option<u8>,
}

impl GridQuery {
    /// Returns the options of a figure.
    fn wishes(&self) -> Result<GridWishes, Problem> {
        if let Some(max) = self.max.filter(|max| !(max.is_finite() && *max > 0.0)) {
            return Err(Problem::invalid_parameter("max", format!("must be above 0, but is {max}")));
        }
        Ok(GridWishes {
            quantity: if self.quantity == Some(GridQuantity::Ratio) { Quantity::Ratio } else { Quantity::Illuminance },
            scale_end: self.max,
            numbers: if self.numbers == Some(true) { Numbers::Shown } else { Numbers::Hidden },
        })
    }

    fn scale(&self) -> Result<Scale, Problem> {
        match self.density {
            None | Some(1) => Ok(Scale::Single),
            Some(2) => Ok(Scale::Double),
            Some(other) => Err(Problem::invalid_parameter("density", format!("must be 1 or 2, but is {other}"))),
        }
    }

    /// Refuses the options of figures for JSON and CSV.
    fn check_of_table(&self) -> Result<(), Problem> {
        let given = [
            ("quantity", self.quantity.is_some()),
            ("max", self.max.is_some()),
            ("numbers", self.numbers.is_some()),
            ("minus", self.minus.is_some()),
            ("density", self.density.is_some()),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((name, _)) => Err(Problem::invalid_parameter(name, "is allowed only with .png, .svg and .pdf")),
            None => Ok(()),
        }
    }
}

/// Returns a grid.
#[utoipa::path(get, path = "/v1/jobs/{id}/grids/{name}", operation_id = "get_grid", tag = "results",
    params(("id" = Uuid, Path), ("name" = String, Path, description = "The grid's name; a suffix `.json`, `.csv`, \
                                                                       `.png`, `.svg` or `.pdf` selects the format"), GridQuery),
    responses(
        (status = 200, description = "Illuminance and its standard error; as PNG, SVG and PDF a map over the plan of the room, with lines of equal value",
            content((GridResult = "application/json"), (String = "text/csv"), (inline(Binary) = "image/png"), (String = "image/svg+xml"), (inline(Binary) = "application/pdf"))),
        (status = 206, description = "The requested range of bytes"),
        (status = 304, description = "Not modified: the ETag in If-None-Match is still current"),
        (status = 416, description = "The range is not in the file", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "A parameter is not valid", body = Problem, content_type = "application/problem+json"),
        (status = 404, description = "No such job or grid, or its first pass has not finished yet",
            body = Problem, content_type = "application/problem+json")))]
pub async fn grid(
    app: App,
    Path((id, name)): Path<(Uuid, String)>,
    Query(query): Query<GridQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    if query.format.is_none()
        && let Some((grid, format)) = formats::by_suffix(&name, &FORMATS)
        && let Some(file) = found(represented(&app, id, &headers, grid, format, &query).await)?
    {
        return Ok(formats::named(file, &name));
    }
    // no such file: a grid may be called `a.csv` itself
    let format = query.format.map_or_else(|| formats::accepted(&headers, &FORMATS), Format::from);
    let answer = represented(&app, id, &headers, &name, format, &query).await?;
    Ok(formats::vary_by_accept(formats::named(answer, &format!("{name}.{}", format.suffix()))))
}

async fn represented(
    app: &Service,
    id: Uuid,
    headers: &HeaderMap,
    name: &str,
    format: Format,
    query: &GridQuery,
) -> Result<Response, Problem> {
    let Some(figure) = format.of_figure(query.scale()?) else {
        query.check_of_table()?;
        return result_file(app, id, headers, format!("grids/{name}.{}", format.suffix())).await;
    };
    let wishes = query.wishes()?;
    let (subject, json) = grid_of(app, id, name).await?;
    let other = match query.minus {
        Some(other) => Some(grid_of(app, other, name).await.map_err(|problem| of_minus(problem, other))?),
        None => None,
    };
    let drawn = off_thread(permit(&app.permits.reading).await?, move |_| {
        let read = |json: &[u8]| serde_json::from_slice::<GridResult>(json);
        let read = |json: &[u8]| read(json).map_err(|error| internal("reading a grid failed", &error));
        let grid = read(&json)?;
        let drawing = match other {
            Some((other, less)) => {
                let less = read(&less)?;
                if less.cells != grid.cells {
                    let detail = format!(
                        "must be a job whose grid has the same cells, but that grid has {:?}, and this one {:?}",
                        less.cells, grid.cells
                    );
                    return Err(Problem::invalid_parameter("minus", detail));
                }
                difference_figure(&subject, &grid, (&other, &less), wishes)
            }
            None => grid_figure(&subject, &grid, wishes),
        };
        let written = drawing.and_then(|drawing| figure.write(&drawing));
        written.map_err(|error| internal("drawing a grid failed", &error))
    });
    content::made(headers, drawn.await??, figure.media_type())
}

/// Reads the subject of a job and the JSON of its grid: the stored file, or the grid as it is so far.
async fn grid_of(app: &Service, id: Uuid, name: &str) -> Result<(Subject, Bytes), Problem> {
    let job = app.store.job(id).await?.ok_or_else(Problem::no_such_job)?;
    let json = file_now(app, id, &format!("grids/{name}.json")).await?;
    let json =
        json.ok_or_else(|| Problem::not_found("the job has no such output, or has not finished its first pass yet"))?;
    Ok((Subject::new(&job.document, &job.plan), json))
}

/// Converts the problem that the other job has no such grid to a fault of the parameter `minus`.
fn of_minus(problem: Problem, other: Uuid) -> Problem {
    if problem.status == StatusCode::NOT_FOUND.as_u16() {
        return Problem::invalid_parameter(
            "minus",
            format!("the job {other} has no grid of this name, or has not finished its first pass yet"),
        );
    }
    problem
}

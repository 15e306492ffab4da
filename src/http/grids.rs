//! Grids of a job: as JSON, as a table, and as figures over the plan of the room.

use std::sync::Arc;

use axum::http::HeaderMap;
use axum::response::Response;
use serde::Deserialize;
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::document::result::GridResult;
use crate::figure::paint::Scale;
use crate::figure::plan_map::Numbers;
use crate::http::content::{self, Binary};
use crate::http::formats::{self, Format, scale};
use crate::http::problem::{Path, Problem, Query};
use crate::http::query_faults::check_positive;
use crate::http::results::{no_such_output, read, result_file};
use crate::http::{App, Service};
use crate::output::csv::with_decimal_commas;
use crate::present::grid_figure::{GridWishes, Quantity, difference_figure, grid_figure};
use crate::present::outputs::Output;
use crate::present::subject::Subject;

/// Representations of a grid.
const FORMATS: [Format; 5] = [Format::Json, Format::Csv, Format::Png, Format::Svg, Format::Pdf];

// what stands in `///` here would be repeated in the description of the parameter
#[expect(dead_code, reason = "stands for a schema")]
#[derive(ToSchema)]
#[schema(rename_all = "snake_case")]
enum GridFormat {
    Json,
    Csv,
    Png,
    Svg,
    Pdf,
}

// what stands in `///` here would be repeated in the description of the parameter
#[derive(Clone, Copy, PartialEq, Eq, Deserialize, ToSchema)]
#[serde(rename_all = "snake_case")]
enum DecimalSign {
    Point,
    Comma,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct GridQuery {
    /// Representation of the answer, instead of the header `Accept`.
    #[param(inline, value_type = Option<GridFormat>)]
    format: Option<Format>,
    /// Quantity that a figure shows; illuminance when absent.
    #[param(inline)]
    quantity: Option<Quantity>,
    /// Value at the end of a figure's scale, so that several figures have the same scale; the greatest value of the grid when
    /// absent.
    #[param(exclusive_minimum = 0)]
    max: Option<f64>,
    /// True to print the values of cells into a figure, where there is room; false when absent.
    numbers: Option<bool>,
    /// Job whose grid of this name is subtracted in a figure.
    minus: Option<Uuid>,
    /// Decimal sign of CSV, `point` when absent; with `comma`, semicolons separate the columns, as spreadsheets expect where numbers are written
    /// so.
    #[param(inline)]
    decimal: Option<DecimalSign>,
    /// Pixels of a PNG per unit of the figure; 1 when absent.
    #[param(minimum = 1, maximum = 2)]
    density: Option<u8>,
}

impl GridQuery {
    /// Returns the options of a figure.
    fn wishes(&self) -> Result<GridWishes, Problem> {
        check_positive("max", self.max)?;
        Ok(GridWishes {
            quantity: self.quantity.unwrap_or(Quantity::Illuminance),
            scale_end: self.max,
            numbers: if self.numbers == Some(true) { Numbers::Shown } else { Numbers::Hidden },
        })
    }

    /// Refuses the options of figures for JSON and CSV, and those of CSV for all else.
    fn check(&self, format: Format) -> Result<(), Problem> {
        if self.decimal.is_some() && format != Format::Csv {
            return Err(Problem::invalid_parameter("decimal", "is allowed only with .csv"));
        }
        if format.of_figure(Scale::Single).is_some() {
            return Ok(());
        }
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
        (status = 416, description = "The range is not in the file"),
        (status = 422, description = "A parameter is not valid"),
        (status = 404, description = "No such job or grid, or its first pass has not finished yet")))]
pub async fn grid(
    app: App,
    Path((id, name)): Path<(Uuid, String)>,
    Query(query): Query<GridQuery>,
    headers: HeaderMap,
) -> Result<Response, Problem> {
    if query.format.is_none()
        && let Some((grid, format)) = formats::by_suffix(&name, &FORMATS)
    {
        match represented(&app, id, &headers, grid, format, &query).await {
            // no such file: a grid may be called `a.csv` itself
            Err(problem) if problem.is_not_found() => (),
            answer => return Ok(formats::named(answer?, &name)),
        }
    }
    let format = query.format.unwrap_or_else(|| formats::accepted(&headers, &FORMATS));
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
    query.check(format)?;
    let kept = vec![Output::Grid(name.to_owned(), Format::Json)];
    let Some(figure) = format.of_figure(scale(query.density)?) else {
        let output = Output::Grid(name.to_owned(), format);
        if query.decimal != Some(DecimalSign::Comma) {
            return result_file(app, id, headers, output).await;
        }
        let table = read(app, id, kept, move |results, _| {
            let table = results.file(&output)?.ok_or_else(no_such_output)?;
            Ok(with_decimal_commas(&String::from_utf8_lossy(&table.bytes)).into_bytes())
        });
        return content::made(headers, table.await?, Format::Csv.media_type());
    };
    let (wishes, name) = (query.wishes()?, name.to_owned());
    let less = match query.minus {
        Some(other) => Some(less(app, other, name.clone(), kept.clone()).await?),
        None => None,
    };
    let drawn = read(app, id, kept, move |results, _| {
        let (subject, grid) = (results.subject(), results.grid(&name)?.ok_or_else(no_such_output)?);
        let drawing = match less {
            Some((_, less)) if less.cells != grid.cells => {
                let detail = format!(
                    "must be a job whose grid has the same cells, but that grid has {:?}, and this one {:?}",
                    less.cells, grid.cells
                );
                return Err(Problem::invalid_parameter("minus", detail));
            }
            Some((other, less)) => difference_figure(subject, &grid, (&other, &less), wishes)?,
            None => grid_figure(subject, &grid, wishes)?,
        };
        Ok(figure.write(&drawing)?)
    });
    content::made(headers, drawn.await?, figure.media_type())
}

/// Reads the grid that is subtracted, and the description of its job; that there is none is a fault of the parameter `minus`.
async fn less(
    app: &Service,
    other: Uuid,
    name: String,
    kept: Vec<Output>,
) -> Result<(Arc<Subject>, GridResult), Problem> {
    let read = read(app, other, kept, move |results, _| {
        Ok((results.subject().clone(), results.grid(&name)?.ok_or_else(no_such_output)?))
    });
    read.await.map_err(|problem| match problem.is_not_found() {
        true => Problem::invalid_parameter(
            "minus",
            format!("the job {other} has no grid of this name, or has not finished its first pass yet"),
        ),
        false => problem,
    })
}

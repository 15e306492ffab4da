//! Results of a job as typed tables and pictures, and the files that are written from them.

mod estimated;
mod kept;
mod kept_moments;

use std::sync::Arc;

use bytes::Bytes;

pub use self::estimated::{Estimated, MadeFiles, made_files};
pub use self::kept::{Kept, MadeYears, made_years};
use self::kept_moments::moments_npy;
use super::annual::JobYear;
use super::grid_figure::{GridWishes, grid_figure};
use super::outputs::{Annual, Format, Honeybee, Output};
use super::scene_model::scene_glb;
use super::subject::Subject;
use super::tube_figure::tube_figure;
use super::view_figure::{ViewWishes, false_colour_figure};
use crate::annual::metrics::Value;
use crate::document::result::tube_report::TubeReport;
use crate::document::result::{GridResult, SurfacesResult};
use crate::engine::passes::RenderError;
use crate::figure::paint::Scale;
use crate::figure::{Drawing, FigureFormat};
use crate::output::exr::{self, ViewImage};
use crate::output::{OutputError, Raster, csv, png};

/// File of the results.
#[derive(Clone)]
pub struct ResultFile {
    /// Name, e.g. `grids/workplane.json`.
    pub name: String,
    /// Media type without parameters.
    pub media_type: &'static str,
    /// Content.
    pub bytes: Bytes,
}

/// Result of a job, or `None` where the job has no such output, or has not computed it yet.
pub type Found<T> = Result<Option<T>, RenderError>;

/// Results of one job. They come from an estimate or from the files that a job keeps, with equal numbers.
pub trait ResultReader {
    /// Returns the description of the job that figures print.
    fn subject(&self) -> &Arc<Subject>;

    /// Returns the grid with this name.
    fn grid(&self, name: &str) -> Found<GridResult>;

    /// Returns the view with this name; its mask of sources may be empty.
    fn view(&self, name: &str) -> Found<ViewImage>;

    /// Returns the view with this name and its mask of sources, which takes some time to find.
    fn view_with_sources(&self, name: &str) -> Found<ViewImage>;

    /// Returns the tone-mapped picture of the view with this name.
    fn picture(&self, name: &str) -> Found<Raster>;

    /// Returns the report on a tube.
    fn tube(&self, number: usize) -> Found<TubeReport>;

    /// Returns the year of a job that has one.
    fn year(&self) -> Found<Arc<JobYear>>;

    /// Returns the values of a grid at all moments of a year that is computed moment by moment.
    fn moments(&self, name: &str) -> Found<Vec<Value>>;

    /// Returns the light on the faces of the room.
    fn surfaces(&self) -> Found<SurfacesResult>;

    /// Makes a file; its figures are drawn without options.
    fn file(&self, output: &Output) -> Found<ResultFile> {
        written(self, output)
    }
}

/// Writes a file from the results that a reader gives.
fn written(reader: &(impl ResultReader + ?Sized), output: &Output) -> Found<ResultFile> {
    let name = output.file();
    let failed = |error: OutputError| failed(&name, error);
    let drawn = |format: FigureFormat, drawing: Result<Drawing, OutputError>| {
        drawing.and_then(|drawing| format.write(&drawing)).map_err(failed)
    };
    let bytes = match (output, output.figure()) {
        (Output::Grid(grid, Format::Json), _) => reader.grid(grid)?.map(|grid| json(&name, &grid)),
        (Output::Grid(grid, Format::Csv), _) => reader.grid(grid)?.map(|grid| Ok(grid_csv(&grid))),
        (Output::Grid(grid, _), Some(figure)) => {
            let draw = |grid| drawn(figure, grid_figure(reader.subject(), &grid, GridWishes::default()));
            reader.grid(grid)?.map(draw)
        }
        (Output::View(view, Format::Exr), _) => {
            reader.view_with_sources(view)?.map(|image| exr::encode(&image).map_err(failed))
        }
        (Output::View(view, Format::Png), _) => {
            reader.picture(view)?.map(|picture| png::encode(&picture).map_err(failed))
        }
        (Output::FalseColours(view, _), Some(figure)) => reader.view_with_sources(view)?.map(|image| {
            let seen = image.smoothed().seen();
            drawn(figure, false_colour_figure(reader.subject(), view, &seen, ViewWishes::default()))
        }),
        (Output::Tube(tube, Format::Json), _) => reader.tube(*tube)?.map(|report| json(&name, &report)),
        (Output::Tube(tube, _), Some(figure)) => {
            reader.tube(*tube)?.map(|report| drawn(figure, Ok(tube_figure(reader.subject(), &report))))
        }
        (Output::Annual(Annual::Moments(grid), Format::Npy), _) => {
            reader.moments(grid)?.map(|values| Ok(moments_npy(&values)))
        }
        (Output::Annual(part, format), _) => match reader.year()? {
            Some(year) => of_year(&year, (&name, part, *format), reader.subject())?,
            None => None,
        },
        (Output::Surfaces(Format::Json), _) => reader.surfaces()?.map(|surfaces| json(&name, &surfaces)),
        (Output::Surfaces(Format::Glb), _) => {
            reader.surfaces()?.map(|surfaces| Ok(scene_glb(reader.subject(), &surfaces)))
        }
        // a line for each of thousands of numbers would be most of the file
        (Output::Meshes, _) => {
            let written = |meshes| serde_json::to_vec(meshes).map_err(|error| self::failed(&name, error));
            reader.subject().meshes.as_ref().map(written)
        }
        _ => None,
    };
    let file = |bytes: Vec<u8>| ResultFile {
        media_type: output.format().media_type(),
        bytes: bytes.into(),
        name: output.file(),
    };
    Ok(bytes.transpose()?.map(file))
}

/// Writes a part of a year; `None` if it has no such part, or not in this format.
fn of_year(
    year: &JobYear,
    (name, part, format): (&str, &Annual, Format),
    subject: &Subject,
) -> Found<Result<Vec<u8>, RenderError>> {
    let drawing = match part {
        Annual::Fluxes => Some(year.fluxes_figure(subject)),
        Annual::Autonomy(grid) => year.autonomy_figure(subject, grid, None),
        Annual::Useful(grid) => year.useful_figure(subject, grid),
        Annual::ByHour(grid) => year.hours_figure(subject, grid),
        Annual::Summary
        | Annual::Hours
        | Annual::Points(_)
        | Annual::Moments(_)
        | Annual::Lighting
        | Annual::Honeybee(_) => None,
    };
    Ok(match (part, format) {
        (Annual::Summary, Format::Json) => Some(json(name, &year.summary())),
        (Annual::Hours, Format::Csv) => Some(Ok(year.hours_csv().into_bytes())),
        (Annual::Lighting, Format::Csv) => year.lighting_csv().map(|text| Ok(text.into_bytes())),
        (Annual::Honeybee(Honeybee::Grids), Format::Json) => Some(json(name, &year.honeybee_grids())),
        (Annual::Honeybee(Honeybee::Study), Format::Json) => Some(json(name, &year.honeybee_study())),
        (Annual::Honeybee(Honeybee::SunUpHours), Format::Txt) => Some(Ok(year.honeybee_hours().into_bytes())),
        (Annual::Honeybee(Honeybee::Points(grid)), Format::Npy) => year.honeybee_lux(grid).map(Ok),
        (Annual::Points(grid), Format::Json) => year.points(grid).map(|points| json(name, &points)),
        (Annual::Points(grid), Format::Csv) => year.points(grid).map(|points| Ok(points.csv().into_bytes())),
        (Annual::Points(grid), Format::Npy) => year.npy(grid).map(Ok),
        (Annual::Points(grid), Format::Ill) => year.ill(grid).map(|text| Ok(text.into_bytes())),
        _ => drawing.zip(format.of_figure(Scale::Single)).map(|(drawing, figure)| {
            drawing.and_then(|drawing| figure.write(&drawing)).map_err(|error| failed(name, error))
        }),
    })
}

fn json(name: &str, result: &impl serde::Serialize) -> Result<Vec<u8>, RenderError> {
    serde_json::to_vec_pretty(result).map_err(|error| failed(name, error))
}

fn grid_csv(result: &GridResult) -> Vec<u8> {
    let errors = result.standard_error_lux.iter().flatten();
    let errors: Vec<f64> = errors.map(|error| error.unwrap_or(f64::INFINITY)).collect();
    let values = result.illuminance_lux.iter().flatten();
    let values: Vec<f64> = values.map(|lux| lux.unwrap_or(f64::NAN)).collect();
    let sensors = match &result.points_m {
        Some(points) => csv::Sensors::Points(points),
        None => csv::Sensors::Level { x_m: &result.x_m, y_m: &result.y_m, z_m: result.height_m },
    };
    let areas: Vec<f64> = match (&result.area_m2, result.cell_area_m2) {
        (Some(cut), _) => cut.iter().flatten().copied().collect(),
        (None, Some(whole)) => vec![whole; values.len()],
        (None, None) => Vec::new(),
    };
    csv::grid(sensors, &areas, &values, &errors).into_bytes()
}

pub(super) fn failed(file: &str, reason: impl ToString) -> RenderError {
    RenderError::Output { file: file.into(), reason: reason.to_string() }
}

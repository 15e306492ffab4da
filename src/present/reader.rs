//! Results of a job as typed tables and pictures, and the files that are written from them.

use std::collections::HashMap;
use std::sync::Arc;

use bytes::Bytes;

use super::annual::JobYear;
use super::cache::Cache;
use super::grid_figure::{GridWishes, grid_figure};
use super::outputs::{Annual, Format, Honeybee, Output, annual_outputs, moments_outputs, result_outputs};
use super::scene_model::scene_glb;
use super::subject::Subject;
use super::tube_figure::tube_figure;
use super::view_figure::{ViewWishes, false_colour_figure};
use crate::VERSION;
use crate::annual::metrics::Value;
use crate::document::DocumentErrors;
use crate::document::outputs::SURFACES;
use crate::document::result::tube_report::TubeReport;
use crate::document::result::{GridResult, SurfacesResult, TubeResult};
use crate::engine::passes::RenderError;
use crate::engine::prepare::RenderJob;
use crate::estimate::{Estimate, FilmEstimate};
use crate::figure::paint::Scale;
use crate::figure::{Drawing, FigureFormat};
use crate::output::exr::{self, ViewImage};
use crate::output::{OutputError, Raster, csv, npy, png};
use crate::plan::EffectKind;
use crate::present::prepared::Prepared;
use crate::scene::surface_patches::surface_patches;
use crate::scene::{Grid, View};
use crate::statistics::Moments;

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
        Annual::Autonomy(grid) => year.autonomy_figure(subject, grid),
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

/// Files that were made of an estimate, by name, for several readers.
pub type MadeFiles = Cache<String, Found<ResultFile>>;

/// Largest number of bytes of the made files of one estimate that are kept.
const MOST_BYTES: usize = 64 << 20;
/// Bytes that a shorter file counts as, or one that is not there: this bounds the number of files.
const LEAST_BYTES: usize = 256 << 10;

/// Returns a cache of the files of one estimate.
pub fn made_files() -> MadeFiles {
    MadeFiles::new(MOST_BYTES, |made| match made {
        Ok(Some(file)) => file.bytes.len().max(LEAST_BYTES),
        _ => LEAST_BYTES,
    })
}

/// Years of jobs that have ended, by the key of [`Kept::years`], for the next files of these jobs.
pub type MadeYears = Cache<String, Found<Arc<JobYear>>>;

/// Largest number of bytes of the years of ended jobs that are kept.
const MOST_BYTES_OF_YEARS: usize = 128 << 20;

/// Returns a cache of the years of ended jobs.
pub fn made_years() -> MadeYears {
    MadeYears::new(MOST_BYTES_OF_YEARS, |made| match made {
        Ok(Some(year)) => year.bytes(),
        _ => 0,
    })
}

/// Results of a prepared job from an estimate of its passes.
#[derive(Clone, Copy)]
pub struct Estimated<'a> {
    /// Prepared job.
    pub prepared: &'a Prepared,
    /// Estimate of all passes so far.
    pub estimate: &'a Estimate,
    /// Files that were made of the estimate before; `None` where no file is asked for twice.
    pub made: Option<&'a MadeFiles>,
}

impl Estimated<'_> {
    /// Makes the files that a job keeps when it has finished: those that cannot be made again. Tables and figures of its grids are made
    /// from the kept files, and reports on its tubes from the document, by [`Kept`], unless it uses uploaded meshes, which can be deleted.
    pub fn kept_files(&self) -> Result<Vec<ResultFile>, RenderError> {
        let has_meshes = self.prepared.subject().meshes.is_some();
        self.files(|output| match output {
            Output::Grid(_, format) => *format == Format::Json,
            Output::View(..) => true,
            Output::FalseColours(..) => false,
            Output::Tube(..) => has_meshes,
            // the rest of a year is made from these again
            Output::Annual(part, _) => matches!(part, Annual::Summary | Annual::Moments(_)),
            Output::Surfaces(format) => *format == Format::Json,
            Output::Meshes => true,
        })
    }

    /// Makes the files of the results that `selected` selects, in the order of [`Prepared::outputs`].
    pub fn files(&self, selected: impl Fn(&Output) -> bool) -> Result<Vec<ResultFile>, RenderError> {
        let outputs = self.prepared.outputs().into_iter().filter(selected);
        outputs.filter_map(|output| self.file(&output).transpose()).collect()
    }

    /// Returns the image of a view without its mask of sources, in the numbers of its EXR file, so that pictures of it can be made again
    /// from this file.
    fn view_image(&self, film: &FilmEstimate) -> ViewImage {
        let short = |value: f64| f64::from(value as f32);
        let (name, provenance) = (self.prepared.name.as_deref(), serde_json::json!(self.prepared.provenance));
        ViewImage {
            size_px: film.size_px,
            channels: film.channels,
            values: film.mean.iter().copied().map(short).collect(),
            standard_error: (0..film.m2.len()).map(|pixel| short(film.standard_error_cd_m2(pixel))).collect(),
            samples: film.passes,
            sources: Vec::new(),
            comments: format!("skyduct {VERSION}: {}; {provenance}", name.unwrap_or("unnamed job")),
        }
    }

    /// Finds a view of the scene with its estimate.
    fn view_of(&self, name: &str) -> Option<(&View, &FilmEstimate)> {
        self.prepared.scene.views.iter().zip(&self.estimate.views).find(|(view, _)| view.name == name)
    }
}

impl ResultReader for Estimated<'_> {
    fn subject(&self) -> &Arc<Subject> {
        self.prepared.subject()
    }

    fn grid(&self, name: &str) -> Found<GridResult> {
        let RenderJob { scene, plan, components, .. } = &**self.prepared;
        let found = scene.grids.iter().zip(&self.estimate.grids).find(|(grid, _)| grid.name == name);
        let electric = plan.effects.is_on(EffectKind::Luminaires);
        Ok(found.map(|(grid, estimate)| {
            GridResult::new(grid, estimate, scene.daylight.as_ref(), electric, components, scene.tubes.len())
        }))
    }

    fn view(&self, name: &str) -> Found<ViewImage> {
        Ok(self.view_of(name).map(|(_, film)| self.view_image(film)))
    }

    fn view_with_sources(&self, name: &str) -> Found<ViewImage> {
        let with_sources =
            |(view, film)| ViewImage { sources: self.prepared.sources_seen(view), ..self.view_image(film) };
        Ok(self.view_of(name).map(with_sources))
    }

    fn picture(&self, name: &str) -> Found<Raster> {
        let Some(view) = self.view(name)? else { return Ok(None) };
        png::tone_mapped(view.smoothed().image()).map(Some).map_err(|error| failed(name, error))
    }

    fn tube(&self, number: usize) -> Found<TubeReport> {
        let (Some(tube), Some(estimate)) = (self.prepared.scene.tubes.get(number), self.estimate.tubes.get(number))
        else {
            return Ok(None);
        };
        let numerical = self.estimate.grids.iter().any(|grid| grid.numerical);
        let flux = TubeResult::new(estimate, tube.opening_radius, self.prepared.scene.daylight.as_ref(), numerical);
        Ok(Some(self.prepared.tube_report(number, flux)))
    }

    fn year(&self) -> Found<Arc<JobYear>> {
        if self.estimate.passes == 0 {
            return Ok(None);
        }
        self.prepared.year(self.estimate.passes, || {
            let of_grid = |name: &str| Ok(self.grid(name)?.map(|grid| (grid, self.moments(name))));
            let grids = self.prepared.scene.grids.iter().filter_map(|grid| of_grid(&grid.name).transpose());
            grids.map(|grid| grid.and_then(|(grid, moments)| Ok((grid, moments?.unwrap_or_default())))).collect()
        })
    }

    fn moments(&self, name: &str) -> Found<Vec<Value>> {
        let found = self.prepared.scene.grids.iter().zip(&self.estimate.grids).find(|(grid, _)| grid.name == name);
        let value = |moments: &Moments| {
            let error = moments.standard_error();
            // nothing is known of the error of one pass
            Value { value: moments.mean, standard_error: if error.is_finite() { error } else { moments.mean.abs() } }
        };
        let moments = found.map(|(_, estimate)| &estimate.moments).filter(|moments| !moments.is_empty());
        Ok(moments.map(|moments| moments.iter().map(value).collect()))
    }

    fn surfaces(&self) -> Found<SurfacesResult> {
        let scene = &self.prepared.scene;
        let found = scene.grids.iter().zip(&self.estimate.grids).find(|(grid, _)| grid.name == SURFACES);
        let enclosure = &scene.room.enclosure;
        Ok(found.map(|(_, estimate)| SurfacesResult::new(enclosure, &surface_patches(enclosure), estimate)))
    }

    fn file(&self, output: &Output) -> Found<ResultFile> {
        self.made.map_or_else(|| written(self, output), |made| made.get(output.file(), || written(self, output)))
    }
}

/// Results of a job that has ended, from the files that are kept of it. Of a job that has not begun there are none.
pub struct Kept {
    /// Description of the job.
    pub subject: Arc<Subject>,
    /// Kept files by name, as far as they were read.
    pub files: HashMap<String, Bytes>,
    /// Fluxes of the tubes, from the job's summary.
    pub tubes: Vec<TubeResult>,
    /// Prepares the job anew, for reports on its tubes.
    pub prepare: Box<dyn Fn() -> Result<Prepared, DocumentErrors> + Send>,
    /// Years of jobs that have ended, with the key of this job; `None` where no second file is asked for.
    pub years: Option<(Arc<MadeYears>, String)>,
}

impl Kept {
    fn read<T>(&self, output: Output, read: impl FnOnce(&[u8]) -> Result<T, String>) -> Found<T> {
        let name = output.file();
        self.files.get(&name).map(|bytes| read(bytes)).transpose().map_err(|error| failed(&name, error))
    }

    fn computed_year(&self) -> Found<Arc<JobYear>> {
        let document = self.subject.document.as_ref().filter(|document| document.annual.is_some());
        let Some(document) = document else { return Ok(None) };
        let grids = document.grids.iter().map(|grid| self.grid(&grid.name)).collect::<Result<Vec<_>, _>>()?;
        if grids.iter().any(Option::is_none) {
            return Ok(None);
        }
        let prepared = (self.prepare)().map_err(|errors| failed("annual", errors))?;
        prepared.year(0, || {
            let with_moments = |grid: GridResult| Ok((self.moments(&grid.name)?.unwrap_or_default(), grid));
            let grids = grids.into_iter().flatten().map(with_moments);
            grids.map(|found| found.map(|(moments, grid)| (grid, moments))).collect()
        })
    }
}

impl ResultReader for Kept {
    fn subject(&self) -> &Arc<Subject> {
        &self.subject
    }

    fn grid(&self, name: &str) -> Found<GridResult> {
        let read = |bytes: &[u8]| serde_json::from_slice(bytes).map_err(|error| error.to_string());
        self.read(Output::Grid(name.to_owned(), Format::Json), read)
    }

    fn surfaces(&self) -> Found<SurfacesResult> {
        let read = |bytes: &[u8]| serde_json::from_slice(bytes).map_err(|error| error.to_string());
        self.read(Output::Surfaces(Format::Json), read)
    }

    fn view(&self, name: &str) -> Found<ViewImage> {
        let read = |bytes: &[u8]| exr::decode(bytes).map_err(|error| error.to_string());
        self.read(Output::View(name.to_owned(), Format::Exr), read)
    }

    fn view_with_sources(&self, name: &str) -> Found<ViewImage> {
        self.view(name)
    }

    fn picture(&self, name: &str) -> Found<Raster> {
        let read = |bytes: &[u8]| png::decode(bytes).map_err(|error| error.to_string());
        self.read(Output::View(name.to_owned(), Format::Png), read)
    }

    fn tube(&self, number: usize) -> Found<TubeReport> {
        let Some(flux) = self.tubes.get(number) else { return Ok(None) };
        let prepared = (self.prepare)().map_err(|errors| failed(&format!("tubes/{number}"), errors))?;
        Ok(Some(prepared.tube_report(number, *flux)))
    }

    fn year(&self) -> Found<Arc<JobYear>> {
        let Some((years, key)) = &self.years else { return self.computed_year() };
        let year = years.get(key.clone(), || self.computed_year());
        if !matches!(year, Ok(Some(_))) {
            years.forget(key);
        }
        year
    }

    fn moments(&self, name: &str) -> Found<Vec<Value>> {
        self.read(Output::Annual(Annual::Moments(name.to_owned()), Format::Npy), moments_of_npy)
    }
}

impl Prepared {
    /// Returns the results of an estimate of this job.
    pub fn results<'a>(&'a self, estimate: &'a Estimate) -> Estimated<'a> {
        Estimated { prepared: self, estimate, made: None }
    }

    /// Lists the files of the results: grids as JSON, CSV and figures, views as EXR, PNG and figures in false colours, tubes as JSON and
    /// figures.
    pub fn outputs(&self) -> Vec<Output> {
        let of_document = |grid: &&Grid| grid.name != SURFACES;
        let grids = self.scene.grids.iter().filter(of_document).map(|grid| grid.name.as_str());
        let surfaces = self.scene.grids.iter().any(|grid| grid.name == SURFACES);
        let views = self.scene.views.iter().map(|view| view.name.as_str());
        let mut outputs = result_outputs(grids.clone(), views, self.scene.tubes.len(), surfaces);
        outputs.extend(self.subject().meshes.as_ref().map(|_| Output::Meshes));
        if let Some(annual) = &self.annual {
            outputs.extend(annual_outputs(grids.clone(), annual.document.dimming.is_some()));
            outputs.extend(moments_outputs(grids).filter(|_| annual.at_moments));
        }
        outputs
    }

    /// Makes tone-mapped progress images of all views: (view name, PNG bytes).
    pub fn preview_images(&self, estimate: &Estimate) -> Vec<(String, Vec<u8>)> {
        let picture = |name: &String| {
            let picture = self.results(estimate).picture(name).ok()??;
            Some((name.clone(), png::encode(&picture).ok()?))
        };
        self.scene.views.iter().filter_map(|view| picture(&view.name)).collect()
    }
}

/// Writes the values of a grid at all moments, and then their standard errors, sensor by sensor.
fn moments_npy(values: &[Value]) -> Vec<u8> {
    let of = |of: fn(&Value) -> f64| values.iter().map(move |value| of(value) as f32);
    npy::encode([2, values.len()], of(|value| value.value).chain(of(|value| value.standard_error)))
}

/// Reads what [`moments_npy`] wrote.
fn moments_of_npy(bytes: &[u8]) -> Result<Vec<Value>, String> {
    let numbers = npy::read(bytes).map_err(|error| error.to_string())?.values;
    let (values, errors) = numbers.split_at(numbers.len() / 2);
    let value = |(value, error): (&f32, &f32)| Value { value: f64::from(*value), standard_error: f64::from(*error) };
    Ok(values.iter().zip(errors).map(value).collect())
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
    let areas: Vec<f64> = result.area_m2.iter().flatten().flatten().copied().collect();
    csv::grid(sensors, &areas, &values, &errors).into_bytes()
}

pub(super) fn failed(file: &str, reason: impl ToString) -> RenderError {
    RenderError::Output { file: file.into(), reason: reason.to_string() }
}

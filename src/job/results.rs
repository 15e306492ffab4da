//! What a job gives: summaries as JSON, grids and views as files.

use serde_json::Value;

use super::chunk::RenderError;
use super::prepare::Prepared;
use crate::document::errors::{Warning, WarningCode};
use crate::document::result::{
    AccuracyResult, EnergyResult, ExternalIlluminance, GridInShort, GridResult, GridStatistics, JobResults, Known,
    PlanResult, TimingResult, TubeResult, ViewInShort,
};
use crate::estimate::{Estimate, FilmEstimate, GridEstimate};
use crate::output::{Image, OutputError, csv, exr, false_colour, png};
use crate::plan::EffectKind;
use crate::scene::{Daylight, TubeShape};

/// Share of the rays that may leave tubes through gaps in their meshes without a warning: rounding loses fewer.
const MOST_LOST: f64 = 1e-6;

/// A file of the results, e.g. `grids/workplane.json`.
pub struct ResultFile {
    pub name: String,
    pub media_type: &'static str,
    pub bytes: Vec<u8>,
}

/// A file of the results: of which grid, view or tube, and how it is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Output {
    Grid(usize, GridFormat),
    View(usize, ViewFormat),
    Tube(usize, TubeFormat),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridFormat {
    Json,
    Csv,
    /// False colours with a scale.
    Png,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewFormat {
    Exr,
    Tone,
    FalseColour,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TubeFormat {
    Json,
    /// Transmission against the sun's altitude.
    Svg,
}

/// The files of a job's results, each with its name: of its grids and views, by their names, and of `tubes` tubes. What the
/// service answers, `render` writes and `submit` fetches.
pub fn result_outputs<'a>(
    grids: impl IntoIterator<Item = &'a str>,
    views: impl IntoIterator<Item = &'a str>,
    tubes: usize,
) -> Vec<(String, Output)> {
    let grids = grids.into_iter().enumerate().flat_map(|(index, name)| {
        let formats = [("json", GridFormat::Json), ("csv", GridFormat::Csv), ("png", GridFormat::Png)];
        formats.map(|(suffix, format)| (format!("grids/{name}.{suffix}"), Output::Grid(index, format)))
    });
    let views = views.into_iter().enumerate().flat_map(|(index, name)| {
        let formats =
            [("exr", ViewFormat::Exr), ("png", ViewFormat::Tone), ("false_colour.png", ViewFormat::FalseColour)];
        formats.map(|(suffix, format)| (format!("views/{name}.{suffix}"), Output::View(index, format)))
    });
    let tubes = (0..tubes).flat_map(|index| {
        let formats = [("json", TubeFormat::Json), ("svg", TubeFormat::Svg)];
        formats.map(|(suffix, format)| (format!("tubes/{index}.{suffix}"), Output::Tube(index, format)))
    });
    grids.chain(views).chain(tubes).collect()
}

impl Prepared {
    /// `plan` of results and of `POST /v1/plan`.
    pub fn plan_json(&self) -> Value {
        to_value(&PlanResult::from(&self.plan))
    }

    /// What is known of the results when a job is planned, under the names that it has in the summary.
    pub fn known(&self) -> Known {
        let daylight = self.scene.daylight.as_ref();
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        Known::new(self.provenance.clone(), ExternalIlluminance { sky, sun })
    }

    /// Summary for the job resource and `result.json`; merged into the job's JSON object.
    pub fn summary(&self, merged: &Estimate, seconds: f64) -> JobResults {
        let daylight = self.scene.daylight.as_ref();
        let electric = self.plan.effects.is_on(EffectKind::Luminaires);
        let grids = self.scene.grids.iter().zip(&merged.grids).map(|(grid, estimate)| {
            let statistics = GridStatistics::new(estimate, daylight, electric);
            let mean_standard_error_lux = statistics.mean_lux_standard_error;
            GridInShort { name: grid.name.clone(), statistics, mean_standard_error_lux }
        });
        let tubes = self.scene.tubes.iter().zip(&merged.tubes);
        let tubes = tubes.map(|(tube, estimate)| TubeResult::new(estimate, tube.opening_radius, daylight));
        let views = self.scene.views.iter();
        let views = views.map(|view| ViewInShort { name: view.name.clone(), size_px: view.size_px });
        let Known { provenance, switches, external_horizontal_illuminance_lux } = self.known();
        JobResults {
            accuracy: Some(AccuracyResult::new(self.accuracy(merged), self.stop.confidence)),
            timing: Some(TimingResult::new(merged, seconds)),
            provenance: Some(provenance),
            switches: Some(switches),
            external_horizontal_illuminance_lux: Some(external_horizontal_illuminance_lux),
            grids: Some(grids.collect()),
            views: Some(views.collect()),
            tubes: Some(tubes.collect()),
            energy: self.knows_energy().then(|| EnergyResult::new(&merged.ledger, merged.passes)),
            render_warnings: Some(self.render_warnings(merged)),
        }
    }

    /// What came up while an estimate was made.
    pub fn render_warnings(&self, merged: &Estimate) -> Vec<Warning> {
        let Estimate { rays, lost_rays, ledger, passes, .. } = merged;
        if *lost_rays as f64 <= MOST_LOST * *rays as f64 {
            return Vec::new();
        }
        let flux = match self.knows_energy() {
            true => format!(", with {} lm", ledger.lost / *passes as f64),
            false => String::new(),
        };
        let detail = format!(
            "{lost_rays} of {rays} rays{flux} left a tube elsewhere than through its opening or collector: its mesh has gaps \
             between pipe, collector and ceiling; close them, or weld its vertices"
        );
        vec![Warning { code: WarningCode::LostRays, detail }]
    }

    /// [`Self::summary`] as a JSON object.
    pub fn summary_json(&self, merged: &Estimate, seconds: f64) -> Value {
        to_value(&self.summary(merged, seconds))
    }

    /// True if the method that keeps the books (that of the grids, or else of the views) follows light from its sources
    /// to its end.
    fn knows_energy(&self) -> bool {
        let methods = &self.plan.methods;
        self.is_dark()
            || methods
                .grids
                .as_ref()
                .or(methods.views.as_ref())
                .is_none_or(|choice| choice.method.described().knows().energy)
    }

    /// The names of all files of the results: grids as JSON, CSV and PNG, views as EXR, PNG and false-colour PNG, tubes as
    /// JSON and SVG.
    pub fn result_names(&self) -> Vec<String> {
        self.outputs().into_iter().map(|(name, _)| name).collect()
    }

    /// All files of the results, in the order of [`Self::result_names`].
    pub fn result_files(&self, merged: &Estimate) -> Result<Vec<ResultFile>, RenderError> {
        self.outputs().into_iter().map(|(name, output)| self.make(name, output, merged)).collect()
    }

    /// The files that a job keeps when it has finished: those that cannot be made again. Tables and pictures of its grids
    /// are made from what is kept of them, by [`grid_file_of`], and reports on its tubes from the document, by
    /// [`Self::tube_file_of`], unless it uses uploaded meshes, which can be deleted.
    pub fn kept_files(&self, merged: &Estimate) -> Result<Vec<ResultFile>, RenderError> {
        let kept = |output: &Output| match output {
            Output::Grid(_, format) => *format == GridFormat::Json,
            Output::View(..) => true,
            Output::Tube(..) => self.has_meshes(),
        };
        let kept = self.outputs().into_iter().filter(|(_, output)| kept(output));
        kept.map(|(name, output)| self.make(name, output, merged)).collect()
    }

    fn has_meshes(&self) -> bool {
        let mut tubes = self.scene.tubes.iter();
        !self.scene.room.meshes.is_empty() || tubes.any(|tube| matches!(tube.shape, TubeShape::Mesh(_)))
    }

    /// The file of this name when it is the report on a tube; `tubes`: the fluxes from the job's summary.
    pub fn tube_file_of(&self, name: &str, tubes: &[TubeResult]) -> Result<Option<ResultFile>, RenderError> {
        let found = self.outputs().into_iter().find_map(|(candidate, output)| match output {
            Output::Tube(tube, format) if candidate == name => Some((tube, format)),
            _ => None,
        });
        let Some((tube, format)) = found else { return Ok(None) };
        let Some(flux) = tubes.get(tube) else { return Ok(None) };
        let (media_type, bytes) = self.tube_file(name, tube, format, *flux)?;
        Ok(Some(ResultFile { name: name.to_owned(), media_type, bytes }))
    }

    /// The one file of this name, made alone; `None` when the job has no such file.
    pub fn result_file(&self, name: &str, merged: &Estimate) -> Result<Option<ResultFile>, RenderError> {
        let found = self.outputs().into_iter().find(|(candidate, _)| candidate == name);
        found.map(|(name, output)| self.make(name, output, merged)).transpose()
    }

    fn outputs(&self) -> Vec<(String, Output)> {
        let grids = self.scene.grids.iter().map(|grid| grid.name.as_str());
        let views = self.scene.views.iter().map(|view| view.name.as_str());
        result_outputs(grids, views, self.scene.tubes.len())
    }

    fn make(&self, name: String, output: Output, merged: &Estimate) -> Result<ResultFile, RenderError> {
        let (media_type, bytes) = match output {
            Output::Grid(grid, format) => self.grid_file(&name, grid, format, &merged.grids[grid])?,
            Output::View(view, format) => self.view_file(&name, format, &merged.views[view])?,
            Output::Tube(tube, format) => {
                let radius = self.scene.tubes[tube].opening_radius;
                let flux = TubeResult::new(&merged.tubes[tube], radius, self.scene.daylight.as_ref());
                self.tube_file(&name, tube, format, flux)?
            }
        };
        Ok(ResultFile { name, media_type, bytes })
    }

    fn grid_file(
        &self,
        name: &str,
        grid: usize,
        format: GridFormat,
        estimate: &GridEstimate,
    ) -> Result<(&'static str, Vec<u8>), RenderError> {
        let electric = self.plan.effects.is_on(EffectKind::Luminaires);
        let result = GridResult::new(&self.scene.grids[grid], estimate, self.scene.daylight.as_ref(), electric);
        written_grid(name, format, &result)
    }

    fn view_file(
        &self,
        name: &str,
        format: ViewFormat,
        film: &FilmEstimate,
    ) -> Result<(&'static str, Vec<u8>), RenderError> {
        let (media_type, picture) = match format {
            ViewFormat::Exr => {
                let errors: Vec<f64> = (0..film.m2.len()).map(|pixel| film.standard_error_cd_m2(pixel)).collect();
                ("image/x-exr", exr::encode(image(film), &errors, film.passes, &self.exr_comments()))
            }
            ViewFormat::Tone => ("image/png", tone_mapped(film)),
            ViewFormat::FalseColour => {
                ("image/png", false_colour::luminance(image(film)).and_then(|raster| png::encode(&raster)))
            }
        };
        Ok((media_type, picture.map_err(|error| failed(name, error))?))
    }

    /// Tone-mapped progress images of all views: (view name, PNG bytes).
    pub fn preview_images(&self, merged: &Estimate) -> Vec<(String, Vec<u8>)> {
        let views = self.scene.views.iter().zip(&merged.views);
        views.filter_map(|(view, film)| Some((view.name.clone(), tone_mapped(film).ok()?))).collect()
    }

    fn exr_comments(&self) -> String {
        let name = self.name.as_deref().unwrap_or("unnamed job");
        format!("skyduct {}: {name}; {}", env!("CARGO_PKG_VERSION"), to_value(&self.provenance))
    }
}

/// The table or picture of a grid called `name`, from the JSON that is kept of it: the same bytes as at first.
pub fn grid_file_of(name: &str, format: GridFormat, json: &[u8]) -> Result<ResultFile, RenderError> {
    let result: GridResult = serde_json::from_slice(json).map_err(|error| failed(name, error))?;
    let (media_type, bytes) = written_grid(name, format, &result)?;
    Ok(ResultFile { name: name.to_owned(), media_type, bytes })
}

fn written_grid(name: &str, format: GridFormat, result: &GridResult) -> Result<(&'static str, Vec<u8>), RenderError> {
    Ok(match format {
        GridFormat::Json => {
            ("application/json", serde_json::to_vec_pretty(result).map_err(|error| failed(name, error))?)
        }
        GridFormat::Csv => {
            let errors = result.standard_error_lux.iter().flatten();
            let errors: Vec<f64> = errors.map(|error| error.unwrap_or(f64::INFINITY)).collect();
            let values = result.illuminance_lux.concat();
            ("text/csv", csv::grid(&result.x_m, &result.y_m, result.height_m, &values, &errors).into_bytes())
        }
        GridFormat::Png => {
            let map = false_colour::illuminance(result.cells, &result.illuminance_lux.concat());
            let map = map.and_then(|raster| png::encode(&raster));
            ("image/png", map.map_err(|error| failed(name, error))?)
        }
    })
}

fn image(film: &FilmEstimate) -> Image<'_> {
    Image { size_px: film.size_px, channels: film.channels, values: &film.mean }
}

fn tone_mapped(film: &FilmEstimate) -> Result<Vec<u8>, OutputError> {
    png::encode(&png::tone_mapped(image(film))?)
}

pub(super) fn failed(file: &str, reason: impl ToString) -> RenderError {
    RenderError::Output { file: file.into(), reason: reason.to_string() }
}

/// Our own result types always serialise: their keys are strings and their numbers finite or null.
fn to_value(result: &impl serde::Serialize) -> Value {
    serde_json::to_value(result).unwrap_or(Value::Null)
}

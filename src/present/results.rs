//! Results of a job: summaries as JSON, grids and views as files.

use serde_json::Value;

use super::grid_figure::{GridWishes, grid_figure};
use super::subject::Subject;
use super::view_figure::{ViewWishes, false_colour_figure};
use crate::VERSION;
use crate::document::canonical::canonical_hash;
use crate::document::errors::{Warning, WarningCode};
use crate::document::result::{
    AccuracyResult, CrossCheckResult, EnergyResult, ExternalIlluminance, GridInShort, GridResult, GridStatistics,
    JobResults, Known, PlanResult, TimingResult, TubeResult, ViewInShort,
};
use crate::engine::passes::RenderError;
use crate::engine::progress::StoppedBy;
use crate::engine::spent::Spent;
use crate::estimate::stopping::{grid_error, grid_without_light};
use crate::estimate::{Discrepancy, Estimate, FilmEstimate, GridEstimate};
use crate::figure::FigureFormat;
use crate::output::seen::SeenView;
use crate::output::smooth::smoothed;
use crate::output::{Image, OutputError, Raster, csv, exr, png};
use crate::plan::EffectKind;
use crate::present::prepared::Prepared;
use crate::scene::{Daylight, TubeShape};

/// Fraction of the rays that may leave tubes through gaps in their meshes without a warning: rounding loses fewer.
const MOST_LOST: f64 = 1e-6;

/// File of the results, e.g. `grids/workplane.json`.
pub struct ResultFile {
    pub name: String,
    pub media_type: &'static str,
    pub bytes: Vec<u8>,
}

/// Outputs of a job that a report shows.
#[derive(Clone, Debug, Default)]
pub struct FirstOutputs {
    /// First grid.
    pub grid: Option<GridResult>,
    /// First view: its name, and its tone-mapped picture.
    pub view: Option<(String, Raster)>,
}

/// Kind of a file of the results: the grid, view or tube that it shows, and its format.
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
    /// Map over the plan of the room.
    Figure(FigureFormat),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ViewFormat {
    Exr,
    Tone,
    FalseColour(FigureFormat),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TubeFormat {
    Json,
    /// Transmission against the sun's altitude.
    Figure(FigureFormat),
}

/// Returns the name of the file that shows a view after some of its passes.
pub fn progress_image(view: &str, passes: u64) -> String {
    // a folder of its own: a view may be called `a.pass16`
    format!("progress/{view}.pass{passes}.png")
}

/// Lists the files of a job's results, each with its name: of its grids and views, by their names, and of `tubes` tubes. The service serves
/// these files, `render` writes them and `submit` fetches them.
pub fn result_outputs<'a>(
    grids: impl IntoIterator<Item = &'a str>,
    views: impl IntoIterator<Item = &'a str>,
    tubes: usize,
) -> Vec<(String, Output)> {
    let grids = grids.into_iter().enumerate().flat_map(|(index, name)| {
        let figures = FigureFormat::ALL.map(|format| (format.suffix(), GridFormat::Figure(format)));
        let formats = [("json", GridFormat::Json), ("csv", GridFormat::Csv)].into_iter().chain(figures);
        formats.map(move |(suffix, format)| (format!("grids/{name}.{suffix}"), Output::Grid(index, format)))
    });
    let views = views.into_iter().enumerate().flat_map(|(index, name)| {
        // a folder of its own: a view may be called `a.false_colour`
        let figures = FigureFormat::ALL
            .map(|format| (format!("false_colours/{name}.{}", format.suffix()), ViewFormat::FalseColour(format)));
        let pictures =
            [(format!("views/{name}.exr"), ViewFormat::Exr), (format!("views/{name}.png"), ViewFormat::Tone)];
        pictures.into_iter().chain(figures).map(move |(file, format)| (file, Output::View(index, format)))
    });
    let tubes = (0..tubes).flat_map(|index| {
        let figures = FigureFormat::ALL.map(|format| (format.suffix(), TubeFormat::Figure(format)));
        let formats = [("json", TubeFormat::Json)].into_iter().chain(figures);
        formats.map(move |(suffix, format)| (format!("tubes/{index}.{suffix}"), Output::Tube(index, format)))
    });
    grids.chain(views).chain(tubes).collect()
}

impl Prepared {
    /// Returns the field `plan` of results and of `POST /v1/plan`.
    pub fn plan_json(&self) -> Value {
        to_value(&PlanResult::from(&self.plan))
    }

    /// Returns the results that are known when a job is planned, under their names in the summary.
    pub fn known(&self) -> Known {
        let daylight = self.scene.daylight.as_ref();
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        Known::new(self.provenance.clone(), ExternalIlluminance { sky, sun })
    }

    /// Makes the summary for the job resource and for `result.json` of a job that `stopped_by` ended; it is merged into the job's JSON
    /// object.
    pub fn summary(&self, merged: &Estimate, spent: Spent, stopped_by: StoppedBy) -> JobResults {
        let daylight = self.scene.daylight.as_ref();
        let electric = self.plan.effects.is_on(EffectKind::Luminaires);
        let grids = self.scene.grids.iter().zip(&merged.grids).map(|(grid, estimate)| {
            let statistics = GridStatistics::new(estimate, daylight, electric);
            let mean_standard_error_lux = statistics.mean_lux_standard_error;
            GridInShort { name: grid.name.clone(), statistics, mean_standard_error_lux }
        });
        let tubes = self.scene.tubes.iter().zip(&merged.tubes);
        let numerical = merged.grids.iter().any(|grid| grid.numerical);
        let tubes = tubes.map(|(tube, estimate)| TubeResult::new(estimate, tube.opening_radius, daylight, numerical));
        let views = self.scene.views.iter();
        let views = views.map(|view| ViewInShort { name: view.name.clone(), size_px: view.size_px });
        let Known { provenance, switches, external_horizontal_illuminance_lux } = self.known();
        JobResults {
            accuracy: Some(self.accuracy_result(merged, stopped_by)),
            engine: Some(format!("skyduct {VERSION}")),
            document_hash: canonical_hash(&self.document).ok(),
            timing: Some(TimingResult::new(merged, spent.seconds, spent.cpu_seconds)),
            provenance: Some(provenance),
            switches: Some(switches),
            external_horizontal_illuminance_lux: Some(external_horizontal_illuminance_lux),
            grids: Some(grids.collect()),
            views: Some(views.collect()),
            tubes: Some(tubes.collect()),
            cross_check: self.cross_check(merged),
            energy: self.knows_energy().then(|| EnergyResult::new(&merged.ledger, merged.passes_of_ledger())),
            computed_by: None,
            render_warnings: Some(self.render_warnings(merged)),
        }
    }

    /// Returns the errors of a job that was ended by `stopped_by`, and the reasons why its grids and its views ended.
    fn accuracy_result(&self, merged: &Estimate, stopped_by: StoppedBy) -> AccuracyResult {
        // an output with fewer passes than the job was as accurate as requested before
        let of = |passes: u64| if passes < merged.passes { StoppedBy::RelativeError } else { stopped_by };
        let grids = (!merged.grids.is_empty()).then(|| of(merged.passes_of_grids()).name().to_owned());
        let views = (!merged.views.is_empty()).then(|| of(merged.passes_of_views()).name().to_owned());
        AccuracyResult::new(self.accuracy(merged), merged, self.stop.confidence, [grids, views])
    }

    /// Compares the grids with those of the second method, if there is one and it has found anything.
    fn cross_check(&self, merged: &Estimate) -> Option<CrossCheckResult> {
        let check = self.plan.methods.check.as_ref()?;
        let discrepancy = Discrepancy::of(&merged.grids, |grid| grid.beside.last())?;
        let errors = merged.grids.iter().filter_map(|grid| grid.beside.last()).map(grid_error);
        let error = errors.reduce(f64::max).filter(|error| error.is_finite());
        Some(CrossCheckResult::new(check.method.name(), &check.reason, &discrepancy, error))
    }

    /// Returns the warnings that came up while an estimate was made.
    pub fn render_warnings(&self, merged: &Estimate) -> Vec<Warning> {
        let disagree = self.cross_check(merged).filter(|check| !check.agrees);
        let disagree = disagree.map(|check| Warning { code: WarningCode::MethodsDisagree, detail: check.verdict });
        self.lost_rays(merged).into_iter().chain(disagree).chain(self.no_light(merged)).collect()
    }

    /// Warns of the first grid that no light has reached in many passes, in a scene that has light.
    fn no_light(&self, merged: &Estimate) -> Option<Warning> {
        let grid = grid_without_light(merged).filter(|_| !self.is_dark())?;
        let (estimate, passes) = (&merged.grids[grid], merged.passes_of_grids());
        let most = estimate.valued().map(|sensor| estimate.standard_error_lux(sensor)).fold(0.0, f64::max);
        let bound =
            if most > 0.0 { format!("; one more photon would add at most {most:.2e} lx") } else { String::new() };
        let detail = format!(
            "{passes} passes brought no light to any sensor of the grid {:?}{bound}: either no light can reach it \
             (something blocks it, or nothing reflects), or so rarely that this method does not find it; the job did \
             not wait for its relative error",
            self.scene.grids[grid].name
        );
        Some(Warning { code: WarningCode::NoLight, detail })
    }

    /// Warns of rays that left tubes through gaps, if they are more than rounding loses.
    fn lost_rays(&self, merged: &Estimate) -> Option<Warning> {
        let Estimate { rays, lost_rays, ledger, .. } = merged;
        let passes = merged.passes_of_ledger();
        if *lost_rays as f64 <= MOST_LOST * *rays as f64 {
            return None;
        }
        let flux = match self.knows_energy() {
            true => format!(", carrying {} lm", ledger.lost / passes as f64),
            false => String::new(),
        };
        let detail = format!(
            "{lost_rays} of {rays} rays{flux} left a tube through gaps in its mesh instead of its opening or \
             collector: close the gaps between pipe, collector and ceiling, or weld the vertices"
        );
        Some(Warning { code: WarningCode::LostRays, detail })
    }

    /// Returns [`Self::summary`] as a JSON object.
    pub fn summary_json(&self, merged: &Estimate, spent: Spent, stopped_by: StoppedBy) -> Value {
        to_value(&self.summary(merged, spent, stopped_by))
    }

    /// True if the method that keeps the energy balance (that of the grids, or else of the views) follows light from its sources to its
    /// end.
    fn knows_energy(&self) -> bool {
        let methods = &self.plan.methods;
        self.is_dark()
            || methods
                .grids
                .as_ref()
                .or(methods.views.as_ref())
                .is_none_or(|choice| choice.method.described().knows().energy)
    }

    /// Lists the names of all files of the results: grids as JSON, CSV and figures, views as EXR, PNG and figures in false colours, tubes
    /// as JSON and figures.
    pub fn result_names(&self) -> Vec<String> {
        self.outputs().into_iter().map(|(name, _)| name).collect()
    }

    /// Makes all files of the results, in the order of [`Self::result_names`].
    pub fn result_files(&self, merged: &Estimate) -> Result<Vec<ResultFile>, RenderError> {
        self.outputs().into_iter().map(|(name, output)| self.make(name, output, merged)).collect()
    }

    /// Makes the files that a job keeps when it has finished: those that cannot be made again. Tables and figures of its grids are made
    /// from the kept files, by [`grid_csv_of`] and [`grid_figure`], and reports on its tubes from the document, by [`Self::tube_file_of`],
    /// unless it uses uploaded meshes, which can be deleted.
    pub fn kept_files(&self, merged: &Estimate) -> Result<Vec<ResultFile>, RenderError> {
        let kept = |output: &Output| match output {
            Output::Grid(_, format) => *format == GridFormat::Json,
            Output::View(_, format) => !matches!(format, ViewFormat::FalseColour(_)),
            Output::Tube(..) => self.has_meshes(),
        };
        let kept = self.outputs().into_iter().filter(|(_, output)| kept(output));
        kept.map(|(name, output)| self.make(name, output, merged)).collect()
    }

    fn has_meshes(&self) -> bool {
        let mut tubes = self.scene.tubes.iter();
        !self.scene.room.meshes.is_empty() || tubes.any(|tube| matches!(tube.shape, TubeShape::Mesh(_)))
    }

    /// Makes the file of this name if it is a report on a tube; `tubes`: the fluxes from the job's summary.
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

    /// Makes only the file of this name; `None` when the job has no such file.
    pub fn result_file(&self, name: &str, merged: &Estimate) -> Result<Option<ResultFile>, RenderError> {
        let found = self.outputs().into_iter().find(|(candidate, _)| candidate == name);
        found.map(|(name, output)| self.make(name, output, merged)).transpose()
    }

    /// Lists all files of the results with their names.
    pub(super) fn outputs(&self) -> Vec<(String, Output)> {
        let grids = self.scene.grids.iter().map(|grid| grid.name.as_str());
        let views = self.scene.views.iter().map(|view| view.name.as_str());
        result_outputs(grids, views, self.scene.tubes.len())
    }

    /// Makes one of the files of [`Self::outputs`].
    pub(super) fn make(&self, name: String, output: Output, merged: &Estimate) -> Result<ResultFile, RenderError> {
        let (media_type, bytes) = match output {
            Output::Grid(grid, format) => self.grid_file(&name, grid, format, &merged.grids[grid])?,
            Output::View(view, format) => self.view_file(&name, view, format, &merged.views[view])?,
            Output::Tube(tube, format) => {
                let radius = self.scene.tubes[tube].opening_radius;
                let numerical = merged.grids.iter().any(|grid| grid.numerical);
                let flux = TubeResult::new(&merged.tubes[tube], radius, self.scene.daylight.as_ref(), numerical);
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
        let result = self.grid_result(grid, estimate);
        let (media_type, bytes) = match format {
            GridFormat::Json => {
                ("application/json", serde_json::to_vec_pretty(&result).map_err(|error| failed(name, error))?)
            }
            GridFormat::Csv => ("text/csv", grid_csv(&result)),
            GridFormat::Figure(format) => {
                let drawing = grid_figure(self.subject(), &result, GridWishes::default());
                let written = drawing.and_then(|drawing| format.write(&drawing));
                (format.media_type(), written.map_err(|error| failed(name, error))?)
            }
        };
        Ok((media_type, bytes))
    }

    fn grid_result(&self, grid: usize, estimate: &GridEstimate) -> GridResult {
        let electric = self.plan.effects.is_on(EffectKind::Luminaires);
        let (grid, daylight) = (&self.scene.grids[grid], self.scene.daylight.as_ref());
        GridResult::new(grid, estimate, daylight, electric, &self.components, self.scene.tubes.len())
    }

    /// Returns the first grid and the first view, as a report shows them.
    pub fn first_outputs(&self, merged: &Estimate) -> Result<FirstOutputs, OutputError> {
        let view = match (self.scene.views.first(), merged.views.first()) {
            (Some(view), Some(film)) => Some((view.name.clone(), tone_mapped(film)?)),
            _ => None,
        };
        Ok(FirstOutputs { grid: merged.grids.first().map(|estimate| self.grid_result(0, estimate)), view })
    }

    /// Returns the description of the job that figures print.
    pub fn subject(&self) -> &Subject {
        self.subject.get_or_init(|| Subject::new(&self.document, &self.plan_json()).foretold(self.predictions.clone()))
    }

    fn view_file(
        &self,
        name: &str,
        view: usize,
        format: ViewFormat,
        film: &FilmEstimate,
    ) -> Result<(&'static str, Vec<u8>), RenderError> {
        let (media_type, picture) = match format {
            ViewFormat::Exr => {
                let errors: Vec<f64> = (0..film.m2.len()).map(|pixel| film.standard_error_cd_m2(pixel)).collect();
                let sources = self.sources_seen(&self.scene.views[view]);
                let layers = exr::Layers { standard_error: &errors, samples: film.passes, sources: &sources };
                ("image/x-exr", exr::encode(image(film), layers, &self.exr_comments()))
            }
            ViewFormat::Tone => ("image/png", tone_mapped(film).and_then(|picture| png::encode(&picture))),
            ViewFormat::FalseColour(format) => {
                let view = &self.scene.views[view];
                let luminances = Image { values: &shown(film), ..image(film) }.luminances();
                let seen = SeenView { size_px: film.size_px, luminances, sources: self.sources_seen(view) };
                let drawing = false_colour_figure(self.subject(), &view.name, &seen, ViewWishes::default());
                (format.media_type(), drawing.and_then(|drawing| format.write(&drawing)))
            }
        };
        Ok((media_type, picture.map_err(|error| failed(name, error))?))
    }

    /// Makes tone-mapped progress images of all views: (view name, PNG bytes).
    pub fn preview_images(&self, merged: &Estimate) -> Vec<(String, Vec<u8>)> {
        let views = self.scene.views.iter().zip(&merged.views);
        views
            .filter_map(|(view, film)| Some((view.name.clone(), png::encode(&tone_mapped(film).ok()?).ok()?)))
            .collect()
    }

    fn exr_comments(&self) -> String {
        let name = self.name.as_deref().unwrap_or("unnamed job");
        format!("skyduct {VERSION}: {name}; {}", to_value(&self.provenance))
    }
}

/// Makes the table of a grid called `name` from the JSON that is kept of it: the same bytes as at first.
pub fn grid_csv_of(name: &str, json: &[u8]) -> Result<ResultFile, RenderError> {
    let result: GridResult = serde_json::from_slice(json).map_err(|error| failed(name, error))?;
    Ok(ResultFile { name: name.to_owned(), media_type: "text/csv", bytes: grid_csv(&result) })
}

fn grid_csv(result: &GridResult) -> Vec<u8> {
    let errors = result.standard_error_lux.iter().flatten();
    let errors: Vec<f64> = errors.map(|error| error.unwrap_or(f64::INFINITY)).collect();
    let values = result.illuminance_lux.iter().flatten();
    let values: Vec<f64> = values.map(|lux| lux.unwrap_or(f64::NAN)).collect();
    csv::grid(&result.x_m, &result.y_m, result.height_m, &values, &errors).into_bytes()
}

fn image(film: &FilmEstimate) -> Image<'_> {
    Image { size_px: film.size_px, channels: film.channels, values: &film.mean }
}

/// Returns the values of a picture of a view, smoothed within their errors: by the numbers of the EXR file, from which pictures are made
/// again.
fn shown(film: &FilmEstimate) -> Vec<f64> {
    let short = |value: f64| f64::from(value as f32);
    let values: Vec<f64> = film.mean.iter().copied().map(short).collect();
    let errors: Vec<f64> = (0..film.m2.len()).map(|pixel| short(film.standard_error_cd_m2(pixel))).collect();
    smoothed(Image { values: &values, ..image(film) }, &errors)
}

fn tone_mapped(film: &FilmEstimate) -> Result<Raster, OutputError> {
    png::tone_mapped(Image { values: &shown(film), ..image(film) })
}

pub(super) fn failed(file: &str, reason: impl ToString) -> RenderError {
    RenderError::Output { file: file.into(), reason: reason.to_string() }
}

/// Converts a result to JSON. The types of this program always serialise: their keys are strings and their numbers finite or null.
fn to_value(result: &impl serde::Serialize) -> Value {
    serde_json::to_value(result).unwrap_or(Value::Null)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    #[test]
    fn no_two_outputs_have_one_file() {
        let views = ["a", "a.false_colour", "a.pass16", "a.png", "false_colours"];
        let outputs = result_outputs(["a", "a.json", "a.png"], views, 2);
        let mut files: Vec<String> = outputs.into_iter().map(|(file, _)| file).collect();
        files.extend(views.iter().flat_map(|view| [1, 16].map(|passes| progress_image(view, passes))));
        let distinct: BTreeSet<&String> = files.iter().collect();
        assert_eq!(distinct.len(), files.len(), "{files:?}");
        // a file is no folder of another one
        for file in &files {
            assert!(!files.iter().any(|other| other.starts_with(&format!("{file}/"))), "{file}");
        }
    }
}

//! What a job gives: summaries as JSON, grids and views as files.

use serde_json::{Map, Value, json};

use super::run::{Prepared, RenderError, ResultFile};
use crate::document::result::{
    AccuracyResult, EnergyResult, GridResult, GridStatistics, PlanResult, TimingResult, TubeResult,
};
use crate::estimate::{Estimate, FilmEstimate};
use crate::output::{Image, OutputError, csv, exr, false_colour, png};
use crate::plan::EffectKind;
use crate::scene::Daylight;

impl Prepared {
    /// `plan` of results and of `POST /v1/plan`.
    pub fn plan_json(&self) -> Value {
        to_value(&PlanResult::from(&self.plan))
    }

    /// Summary for the job resource and `result.json`: `accuracy`, `timing`, `tubes`, `energy`, `switches`, `grids`
    /// (statistics) and `views`; merged into the job's JSON object.
    pub fn summary_json(&self, merged: &Estimate, seconds: f64) -> Value {
        let daylight = self.scene.daylight.as_ref();
        let (sky, sun) = daylight.map_or((0.0, 0.0), Daylight::horizontal_illuminance_lux);
        let grids = self.scene.grids.iter().zip(&merged.grids).map(|(grid, estimate)| {
            let values: Vec<f64> = estimate.sensors.iter().map(|sensor| sensor.mean).collect();
            let mean_error = Some(estimate.mean.standard_error()).filter(|error| error.is_finite());
            let mut summary = Map::new();
            summary.insert("name".into(), json!(grid.name));
            summary.insert("statistics".into(), to_value(&GridStatistics::new(&values)));
            summary.insert("mean_standard_error_lux".into(), json!(mean_error));
            Value::Object(summary)
        });
        let tubes = self.scene.tubes.iter().zip(&merged.tubes).map(|(tube, estimate)| {
            to_value(&TubeResult::new(estimate, tube.opening_radius, self.scene.daylight.as_ref()))
        });
        let views = self.scene.views.iter().map(|view| json!({ "name": view.name, "size_px": view.size_px }));
        json!({
            "accuracy": to_value(&AccuracyResult::new(self.accuracy(merged), self.stop.confidence)),
            "timing": to_value(&TimingResult::new(merged, seconds)),
            "switches": to_value(&self.provenance),
            "external_horizontal_illuminance_lux": { "sky": sky, "sun": sun },
            "grids": grids.collect::<Vec<_>>(),
            "views": views.collect::<Vec<_>>(),
            "tubes": tubes.collect::<Vec<_>>(),
            "energy": to_value(&self.knows_energy().then(|| EnergyResult::new(&merged.ledger, merged.passes))),
        })
    }

    /// Whether the method that keeps the books, that of the grids or else of the views, follows light from its sources to its end.
    fn knows_energy(&self) -> bool {
        let methods = &self.plan.methods;
        self.is_dark()
            || methods.grids.as_ref().or(methods.views.as_ref()).is_none_or(|choice| choice.method.knows_energy())
    }

    /// Grids as JSON, CSV and PNG, views as EXR, PNG and false-colour PNG, tubes as JSON and SVG.
    pub fn result_files(&self, merged: &Estimate) -> Result<Vec<ResultFile>, RenderError> {
        let mut files = Vec::new();
        for (grid, estimate) in self.scene.grids.iter().zip(&merged.grids) {
            let name = format!("grids/{}", grid.name);
            let electric = self.plan.effects.is_on(EffectKind::Luminaires);
            let result = GridResult::new(grid, estimate, self.scene.daylight.as_ref(), electric);
            let bytes = serde_json::to_vec_pretty(&result).map_err(|error| failed(&name, error))?;
            files.push(ResultFile { name: format!("{name}.json"), media_type: "application/json", bytes });
            let sensors = 0..estimate.sensors.len();
            let values: Vec<f64> = sensors.clone().map(|sensor| estimate.illuminance_lux(sensor)).collect();
            let errors: Vec<f64> = sensors.map(|sensor| estimate.standard_error_lux(sensor)).collect();
            let table = csv::grid(&grid.x_m, &grid.y_m, grid.height_m, &values, &errors);
            files.push(ResultFile { name: format!("{name}.csv"), media_type: "text/csv", bytes: table.into_bytes() });
            let map = false_colour::illuminance(grid.cells, &values).and_then(|raster| png::encode(&raster));
            files.push(picture(format!("{name}.png"), "image/png", map)?);
        }
        for (view, film) in self.scene.views.iter().zip(&merged.views) {
            let name = format!("views/{}", view.name);
            let errors: Vec<f64> = (0..film.m2.len()).map(|pixel| film.standard_error_cd_m2(pixel)).collect();
            let comments = self.exr_comments();
            let exr = exr::encode(image(film), &errors, film.passes, &comments);
            files.push(picture(format!("{name}.exr"), "image/x-exr", exr)?);
            files.push(picture(format!("{name}.png"), "image/png", tone_mapped(film))?);
            let false_colour = false_colour::luminance(image(film)).and_then(|raster| png::encode(&raster));
            files.push(picture(format!("{name}.false_colour.png"), "image/png", false_colour)?);
        }
        files.extend(self.tube_files(merged)?);
        Ok(files)
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

fn image(film: &FilmEstimate) -> Image<'_> {
    Image { size_px: film.size_px, channels: film.channels, values: &film.mean }
}

fn tone_mapped(film: &FilmEstimate) -> Result<Vec<u8>, OutputError> {
    png::encode(&png::tone_mapped(image(film))?)
}

fn picture(
    name: String,
    media_type: &'static str,
    bytes: Result<Vec<u8>, OutputError>,
) -> Result<ResultFile, RenderError> {
    let bytes = bytes.map_err(|error| failed(&name, error))?;
    Ok(ResultFile { name, media_type, bytes })
}

fn failed(file: &str, reason: impl ToString) -> RenderError {
    RenderError::Output { file: file.into(), reason: reason.to_string() }
}

/// Our own result types always serialise: their keys are strings and their numbers finite or null.
fn to_value(result: &impl serde::Serialize) -> Value {
    serde_json::to_value(result).unwrap_or(Value::Null)
}

//! Results of a job from an estimate of its passes.

use std::sync::Arc;

use super::{Found, ResultFile, ResultReader, failed, written};
use crate::VERSION;
use crate::annual::metrics::Value;
use crate::document::outputs::SURFACES;
use crate::document::result::tube_report::TubeReport;
use crate::document::result::{GridResult, SurfacesResult, TubeResult};
use crate::engine::passes::RenderError;
use crate::engine::prepare::RenderJob;
use crate::estimate::{Estimate, FilmEstimate};
use crate::output::exr::ViewImage;
use crate::output::{Raster, png};
use crate::plan::EffectKind;
use crate::present::annual::JobYear;
use crate::present::cache::Cache;
use crate::present::outputs::{Annual, Format, Output, annual_outputs, moments_outputs, result_outputs};
use crate::present::prepared::Prepared;
use crate::present::subject::Subject;
use crate::scene::surface_patches::surface_patches;
use crate::scene::{Grid, View};
use crate::statistics::Moments;

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
    /// from the kept files, and reports on its tubes from the document, by [`Kept`](super::Kept), unless it uses uploaded meshes, which can be deleted.
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

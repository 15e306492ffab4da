//! Views of the report: the surfaces that their pixels see, and films recorded while they are rendered.

use std::f64::consts::PI;
use std::path::Path;

use serde_json::Value;

use super::case::Case;
use super::scenes;
use super::settings::Settings;
use crate::page::ReportError;
use crate::run::{compile, render_all};
use skyduct::estimate::{Estimate, FilmEstimate};
use skyduct::integrator::backward::room_entry::enter_room;
use skyduct::integrator::photon_map::surfaces::Surfaces;
use skyduct::output::{Image, OutputError, Raster, png};
use skyduct::present::prepared::Prepared;
use skyduct::statistics::Moments;
use skyduct::traceable::{Place, RoomHit, SurfaceId, TraceableScene};

/// Surfaces that the centres of a view's pixels see.
pub struct Sight {
    traceable: TraceableScene,
    pub size_px: [usize; 2],
    hits: Vec<Option<RoomHit>>,
}

impl Sight {
    /// Finds the surfaces that the first view of a document sees.
    pub fn of(document: &Value) -> Result<Self, ReportError> {
        let (scene, traceable) = compile(document, Path::new(""))?;
        let view = scene.views.first().ok_or_else(|| ReportError::Case("a document without a view".to_owned()))?;
        let [width, height] = view.size_px;
        let hits = (0..width * height)
            .map(|pixel| {
                let direction = view.ray_direction((pixel % width) as f64 + 0.5, (pixel / width) as f64 + 0.5);
                Some(traceable.intersect(enter_room(&traceable, view.eye, direction)?, direction, None))
            })
            .collect();
        Ok(Self { traceable, size_px: [width, height], hits })
    }

    pub fn hit(&self, pixel: usize) -> Option<&RoomHit> {
        self.hits[pixel].as_ref()
    }

    /// True if a pixel looks into the scene.
    pub fn inside(&self, pixel: usize) -> bool {
        self.hits[pixel].is_some()
    }

    /// True if a pixel and its eight neighbours see surfaces of the room and its objects: no luminaire, opening or outside.
    pub fn off_sources(&self, pixel: usize) -> bool {
        self.around(pixel).all(|pixel| self.surface(pixel).is_some())
    }

    /// True if a pixel and its eight neighbours see the same surface.
    pub fn on_one_surface(&self, pixel: usize) -> bool {
        let own = self.surface(pixel);
        own.is_some() && self.around(pixel).all(|pixel| self.surface(pixel) == own)
    }

    /// Computes, for each pixel, the fraction of a disc around the point it sees that lies on the surface there; 1 for pixels
    /// without a surface.
    pub fn disc_shares(&self, radius: f64) -> Vec<f64> {
        let domains = Surfaces::new(&self.traceable).faces;
        let share = |pixel: usize| {
            let (surface, hit) = (self.surface(pixel)?, self.hit(pixel)?);
            Some(domains.get(surface.index())?.area(hit.position, radius) / (PI * radius * radius))
        };
        (0..self.hits.len()).map(|pixel| share(pixel).unwrap_or(1.0)).collect()
    }

    fn surface(&self, pixel: usize) -> Option<SurfaceId> {
        match self.hit(pixel)?.place {
            Place::Surface(surface) => Some(surface).filter(|surface| self.traceable.luminaire(*surface).is_none()),
            Place::Opening(_) => None,
        }
    }

    fn around(&self, pixel: usize) -> impl Iterator<Item = usize> + use<> {
        let [width, height] = self.size_px;
        let (x, y) = (pixel % width, pixel / width);
        let rows = y.saturating_sub(1)..(y + 2).min(height);
        let columns = x.saturating_sub(1)..(x + 2).min(width);
        rows.flat_map(move |row| columns.clone().map(move |column| row * width + column))
    }
}

/// Film with its earlier states, and the mean luminance of some zones of it.
pub struct Recording {
    pub film: FilmEstimate,
    /// Earlier states: number of passes, and the mean of every channel.
    pub earlier: Vec<(u64, Vec<f64>)>,
    /// Moments of the luminance of each zone in cd/m2, one replicate per pass.
    pub zones: Vec<Moments>,
    pub estimate: Estimate,
}

/// Renders the first view of a job; `at`: numbers of passes after which the film is kept, `zones`: pixels of each zone.
pub fn record(prepared: &Prepared, at: &[u64], zones: &[Vec<usize>]) -> Result<Recording, ReportError> {
    let mut earlier = Vec::new();
    let mut moments = vec![Moments::default(); zones.len()];
    let mut sums = vec![0.0; zones.len()];
    let mut estimate = render_all(prepared, |merged| {
        let Some(film) = merged.views.first() else { return };
        if at.contains(&merged.passes) {
            earlier.push((merged.passes, film.mean.clone()));
        }
        for ((pixels, moments), before) in zones.iter().zip(&mut moments).zip(&mut sums) {
            let mean = pixels.iter().map(|pixel| film.luminance_cd_m2(*pixel)).sum::<f64>() / pixels.len() as f64;
            let sum = mean * film.passes;
            moments.push(sum - *before);
            *before = sum;
        }
    })?;
    let film = estimate.views.pop().ok_or_else(|| ReportError::Case("a job without a view".to_owned()))?;
    Ok(Recording { film, earlier, zones: moments, estimate })
}

/// Names of the [`contenders`].
pub const PPM_THESIS: &str = "PPM, thesis' settings";
pub const SPPM_THESIS: &str = "SPPM, thesis' settings";
pub const PPM_OWN: &str = "PPM, own settings";
pub const SPPM_OWN: &str = "SPPM, own settings";

/// Returns cases of PPM and SPPM with the thesis' and with own settings.
pub fn contenders(document: &Value, settings: &Settings) -> [Case; 4] {
    let case = |name: &str, method: Value| Case::new(name, document.clone(), method);
    [
        case(PPM_THESIS, scenes::thesis_method("ppm", settings)),
        case(SPPM_THESIS, scenes::thesis_method("sppm", settings)),
        case(PPM_OWN, scenes::own_method("ppm", settings)),
        case(SPPM_OWN, scenes::own_method("sppm", settings)),
    ]
}

/// Returns the radius in m of the first pass of a method's document, in a room of this shortest edge.
pub fn first_radius_m(method: &Value, shortest_edge_m: f64) -> f64 {
    let own = skyduct::integrator::photon_map::progressive::DEFAULT_RADIUS_SHARE * shortest_edge_m;
    method["initial_radius_m"].as_f64().unwrap_or(own)
}

pub fn image(film: &FilmEstimate) -> Image<'_> {
    Image { size_px: film.size_px, channels: film.channels, values: &film.mean }
}

/// Tone-maps these values by the adaptation of the eye to `film`, twice as large.
pub fn tone_mapped_like(film: &FilmEstimate, values: &[f64]) -> Result<Raster, OutputError> {
    Ok(png::ToneMapping::of(image(film))?.apply(Image { values, ..image(film) })?.enlarged(2))
}

//! Pictures of a job's views, by several methods after the same time and by one method at several accuracies, made from the
//! images of their jobs.

use serde::Serialize;

use super::compare::Values;
use super::outcome::Ended;
use super::part::{JobKey, StudyPart};
use super::picture_request::{PictureKey, PictureRequest};
use crate::engine::progress::Progress;
use crate::estimate::FilmEstimate;
use crate::estimate::film::block_means;
use crate::figure::montage::montage;
use crate::figure::ticks::{duration, significant};
use crate::output::png::{self, ToneMapping};
use crate::output::{Image, OutputError, Raster};
use crate::statistics::interval::two_sided_student_quantile;

/// Longest side of a crop in pixels of its view.
const CROP_PX: usize = 96;

/// Smallest width in pixels that crops are enlarged to.
const LEAST_WIDTH_PX: usize = 192;

/// Image of one view by a finished job, with the luminances of its blocks.
#[derive(Clone, Debug)]
pub struct Film {
    size_px: [usize; 2],
    channels: usize,
    values: Vec<f64>,
    /// Luminances of the blocks of 8 x 8 pixels in cd/m2.
    blocks: Values,
}

impl Film {
    /// Returns the film of an estimate of at least one pass.
    pub fn of_estimate(film: &FilmEstimate) -> Self {
        let blocks = Values::of_view(film);
        Self { size_px: film.size_px, channels: film.channels, values: film.mean.clone(), blocks }
    }

    /// Returns the film of an image. `told` is the relative error of the blocks that the job reports at `confidence` after
    /// `passes`; every block gets this relative error.
    pub fn of_image(image: Image<'_>, told: Option<f64>, confidence: f64, passes: u64) -> Self {
        let lux: Vec<f64> = block_means(image.size_px, &image.luminances());
        let degrees_of_freedom = passes.max(2) as f64 - 1.0;
        let quantile = two_sided_student_quantile(confidence, degrees_of_freedom);
        let error = |luminance: &f64| told.map_or(f64::INFINITY, |told| luminance * told / quantile);
        let errors = lux.iter().map(error).collect();
        let blocks = Values { grids: vec![lux.len()], lux, errors, degrees_of_freedom };
        Self { size_px: image.size_px, channels: image.channels, values: image.values.to_vec(), blocks }
    }

    fn image(&self) -> Image<'_> {
        Image { size_px: self.size_px, channels: self.channels, values: &self.values }
    }

    /// Returns the root mean square of the relative deviations of the blocks from the truth, with the truth's own variance
    /// subtracted.
    fn error(&self, truth: &Self) -> f64 {
        let squared = self.blocks.squared_error(&truth.blocks);
        (squared - truth.blocks.relative_variance().unwrap_or(0.0)).max(0.0).sqrt()
    }
}

/// A picture of one view.
#[derive(Clone, Debug, Serialize)]
pub struct Picture {
    /// Name of the view.
    pub view: String,
    /// Method of the picture: the requested one, or at an accuracy the one that computed it.
    pub method: String,
    /// Requested seconds of rendering; null for a picture at an accuracy.
    pub asked_seconds: Option<f64>,
    /// Requested relative error; null for a picture of equal time.
    pub asked_relative_error: Option<f64>,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Number of passes.
    pub passes: u64,
    /// Relative error that the job reports, at its confidence; null if it has no estimate of it.
    pub reported_relative_error: Option<f64>,
    /// Root mean square of the relative deviations of the blocks of 8 x 8 pixels from the reference, with the reference's own
    /// variance subtracted; null if no pass ended in time.
    pub actual_relative_error: Option<f64>,
}

/// Kind of a sheet: the pictures of a view that it shows side by side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetKind {
    /// Pictures of equal time, with a row for each time and a column for each method.
    EqualTime,
    /// Crops of the pictures at several accuracies.
    Accuracies,
}

impl SheetKind {
    /// True if the sheet shows the pictures of the job.
    pub fn has(self, key: &JobKey) -> bool {
        match key.picture {
            Some(PictureKey::Reference) | None => false,
            Some(PictureKey::EqualTime { .. }) => self == Self::EqualTime,
            Some(PictureKey::Accuracy { .. }) => self == Self::Accuracies,
        }
    }
}

/// Pictures of one view side by side, the reference last. Only the pixels that are shown are kept, three bytes each.
#[derive(Clone, Debug)]
pub struct Sheet {
    kind: SheetKind,
    tiles: Vec<(String, Raster)>,
}

impl Sheet {
    /// Returns a sheet without pictures.
    pub fn new(kind: SheetKind) -> Self {
        Self { kind, tiles: Vec::new() }
    }

    /// Adds a picture with the tone mapping of the reference; it is black if no pass ended in time.
    pub fn push(&mut self, picture: &Picture, film: Option<&Film>, reference: &Reference) -> Result<(), OutputError> {
        let [width, height] = reference.film.size_px;
        let raster = match film {
            Some(film) => reference.tones.apply(film.image())?,
            None => Raster::filled(width, height, [0; 3]),
        };
        self.tiles.push((picture.title(), self.shown(raster)));
        Ok(())
    }

    /// Returns the sheet as a PNG file; `times` is the number of its rows of equal time. `None` without pictures.
    pub fn png(mut self, reference: &Reference, times: usize) -> Result<Option<Vec<u8>>, OutputError> {
        if self.tiles.is_empty() {
            return Ok(None);
        }
        let columns = match self.kind {
            SheetKind::EqualTime => self.tiles.len().div_ceil(times.max(1)),
            SheetKind::Accuracies => self.tiles.len() + 1,
        };
        let raster = self.shown(reference.tones.apply(reference.film.image())?);
        self.tiles.push((format!("reference: {}", reference.method), raster));
        let sheet = montage(&self.tiles, columns)?;
        drop(self.tiles);
        Ok(Some(png::encode(&sheet)?))
    }

    fn shown(&self, picture: Raster) -> Raster {
        match self.kind {
            SheetKind::EqualTime => picture,
            SheetKind::Accuracies => crop(&picture),
        }
    }

    /// Returns the number of bytes that the pictures take.
    #[cfg(test)]
    fn bytes(&self) -> usize {
        self.tiles.iter().map(|(_, raster)| raster.pixels.len()).sum()
    }
}

/// Reference that the pictures of a view are compared with.
#[derive(Clone, Debug)]
pub struct Reference {
    method: String,
    film: Film,
    tones: ToneMapping,
}

impl Reference {
    /// Returns the reference of a view, which `method` has computed.
    pub fn new(method: String, film: Film) -> Result<Self, OutputError> {
        let tones = ToneMapping::of(film.image())?;
        Ok(Self { method, film, tones })
    }

    /// Returns the root mean square of the relative deviations of a picture's blocks, with the reference's own variance
    /// subtracted.
    pub fn error(&self, film: &Film) -> f64 {
        film.error(&self.film)
    }
}

/// Sheets of all views of a study, to which pictures are added one after the other, those of the reference first.
#[derive(Clone, Debug, Default)]
pub struct Sheets {
    /// Views by name, each with its reference and its sheets of both kinds.
    views: Vec<(String, Reference, [Sheet; 2])>,
}

impl Sheets {
    /// Adds the pictures of every view by a job that has ended, and returns their errors; `films` is empty if no pass ended in time.
    pub fn push(
        &mut self,
        request: &PictureRequest,
        (part, ended): (&StudyPart, &Ended),
        films: Vec<Film>,
    ) -> Result<Vec<Option<f64>>, OutputError> {
        if part.key.picture == Some(PictureKey::Reference) {
            for (index, film) in films.into_iter().enumerate() {
                let reference = Reference::new(part.computed_by.clone(), film)?;
                let sheets = [SheetKind::EqualTime, SheetKind::Accuracies].map(Sheet::new);
                self.views.push((request.view(index), reference, sheets));
            }
            return Ok(Vec::new());
        }
        let (mut films, mut errors) = (films.into_iter(), Vec::new());
        for (view, reference, sheets) in &mut self.views {
            let film = films.next();
            let error = film.as_ref().map(|film| reference.error(film));
            let Some(picture) = Picture::new(part, ended, view.clone(), error) else { continue };
            for sheet in sheets.iter_mut().filter(|sheet| sheet.kind.has(&part.key)) {
                sheet.push(&picture, film.as_ref(), reference)?;
            }
            errors.push(error);
        }
        Ok(errors)
    }

    /// Returns the files of all sheets that have pictures, as names and contents.
    pub fn files(self, request: &PictureRequest) -> Result<Vec<(String, Vec<u8>)>, OutputError> {
        let mut files = Vec::new();
        for (view, reference, sheets) in self.views {
            for (sheet, name) in sheets.into_iter().zip([equal_time(&view), accuracies(&view)]) {
                files.extend(sheet.png(&reference, request.wanted.seconds.len())?.map(|bytes| (name, bytes)));
            }
        }
        Ok(files)
    }
}

/// Name of the file with the times and errors of all pictures.
pub const PICTURES_JSON: &str = "pictures.json";

/// Returns the name of the file with a view's pictures of equal time.
pub fn equal_time(view: &str) -> String {
    format!("{view}.equal_time.png")
}

/// Returns the name of the file with a view's pictures at several accuracies.
pub fn accuracies(view: &str) -> String {
    format!("{view}.accuracies.png")
}

impl Picture {
    /// Returns the entry for the picture of a view by a job that has ended, with its actual error; `None` for the reference.
    pub fn new(part: &StudyPart, ended: &Ended, view: String, error: Option<f64>) -> Option<Self> {
        let (method, asked_seconds, asked_relative_error) = match part.key.picture.clone()? {
            PictureKey::Reference => return None,
            PictureKey::EqualTime { method, seconds } => (method, Some(seconds), None),
            PictureKey::Accuracy { relative_error } => (part.computed_by.clone(), None, Some(relative_error)),
        };
        let Progress { seconds, passes, view_relative_error: reported_relative_error, .. } = ended.progress;
        Some(Self {
            view,
            method,
            asked_seconds,
            asked_relative_error,
            seconds,
            passes,
            reported_relative_error,
            actual_relative_error: error,
        })
    }

    /// Returns the picture's title: method, requested error if any, time and actual error.
    pub fn title(&self) -> String {
        let percent = |share: f64| format!("{} %", significant(100.0 * share, 2));
        let error = self.actual_relative_error.map_or("no pass finished in time".to_owned(), percent);
        let asked = self.asked_relative_error.map_or(String::new(), |asked| format!("{} asked, ", percent(asked)));
        format!("{}: {asked}{}, {error}", self.method, duration(self.seconds, 2))
    }
}

/// Returns the middle of a picture, enlarged.
fn crop(picture: &Raster) -> Raster {
    let (width, height) = (picture.width.min(CROP_PX), picture.height.min(CROP_PX));
    let (left, top) = ((picture.width - width) / 2, (picture.height - height) / 2);
    let mut part = Raster::filled(width, height, [0; 3]);
    for y in 0..height {
        for x in 0..width {
            part.set(x, y, picture.get(left + x, top + y));
        }
    }
    part.enlarged(LEAST_WIDTH_PX.div_ceil(width.max(1)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crops_are_of_the_middle() {
        let mut picture = Raster::filled(100, 8, [0; 3]);
        picture.set(2, 0, [9; 3]);
        let part = crop(&picture);
        assert_eq!((part.width, part.height), (2 * CROP_PX, 16));
        assert_eq!([part.get(0, 0), part.get(1, 1), part.get(2, 0)], [[9; 3], [9; 3], [0; 3]]);
    }

    /// Adds pictures one after the other; their films are not kept.
    #[test]
    fn sheets_keep_three_bytes_of_a_pixel() {
        let film = || {
            let values = vec![1.0; 3 * 128 * 64];
            Film::of_image(Image { size_px: [128, 64], channels: 3, values: &values }, None, 0.95, 8)
        };
        let reference = Reference::new("path_tracing".to_owned(), film()).unwrap();
        let progress = Progress { seconds: 1.0, passes: 8, ..Progress::default() };
        let ended = Ended { succeeded: true, progress, stopped_by: None };
        let parts = [
            PictureKey::EqualTime { method: "auto".to_owned(), seconds: 1.0 },
            PictureKey::Accuracy { relative_error: 0.1 },
        ]
        .map(|key| StudyPart {
            key: JobKey::picture(key),
            computed_by: "sppm".to_owned(),
            set_up_seconds: 0.0,
        });
        for (kind, pixels) in [(SheetKind::EqualTime, 128 * 64), (SheetKind::Accuracies, 192 * 128)] {
            let mut sheet = Sheet::new(kind);
            let part = parts.iter().find(|part| kind.has(&part.key)).unwrap();
            for number in 1..4 {
                let picture = Picture::new(part, &ended, "v".to_owned(), Some(reference.error(&film()))).unwrap();
                sheet.push(&picture, (number > 1).then(film).as_ref(), &reference).unwrap();
                assert_eq!(sheet.bytes(), number * 3 * pixels);
            }
            assert!(sheet.png(&reference, 1).unwrap().unwrap().starts_with(b"\x89PNG"));
            assert!(Sheet::new(kind).png(&reference, 1).unwrap().is_none());
        }
    }

    /// Compares the blocks of an image with those of an estimate; the error of each is that of the job.
    #[test]
    fn errors_of_images_are_those_of_their_blocks() {
        let image = |values: &[f64]| {
            Film::of_image(Image { size_px: [16, 8], channels: 1, values }, Some(0.02), 0.95, 1_000_000)
        };
        let pixels = |left: f64, right: f64| -> Vec<f64> {
            (0..128).map(|pixel| if pixel % 16 < 8 { left } else { right }).collect()
        };
        let truth = image(&pixels(1.0, 4.0));
        assert_eq!(truth.blocks.lux, [1.0, 4.0]);
        let sigma = 0.02 / 1.959_964;
        assert!((truth.blocks.errors[1] - 4.0 * sigma).abs() < 1e-6);
        let off = image(&pixels(1.1, 3.6)).error(&truth);
        assert!((off * off - (0.01 - sigma * sigma)).abs() < 1e-9, "{off}");
        assert_eq!(truth.error(&truth), 0.0);
    }
}

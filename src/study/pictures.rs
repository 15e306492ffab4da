//! Pictures of a job's views: by several methods after the same time, and by one method at several accuracies; what comes out of
//! the images of their jobs.

use serde::Serialize;
use serde_json::json;

use super::compare::Values;
use super::outcome::Refused;
use super::picture_request::{PictureKey, PictureRequest};
use crate::estimate::FilmEstimate;
use crate::estimate::film::block_means;
use crate::figure::montage::montage;
use crate::figure::ticks::{duration, significant};
use crate::output::png::{self, ToneMapping};
use crate::output::{Image, OutputError, Raster};
use crate::statistics::interval::two_sided_student_quantile;

/// Side of a crop in pixels of its view, at most.
const CROP_PX: usize = 96;

/// Width that crops are enlarged to at least.
const LEAST_WIDTH_PX: usize = 192;

/// What an ended job has of one view.
#[derive(Clone, Debug)]
pub struct Film {
    size_px: [usize; 2],
    channels: usize,
    values: Vec<f64>,
    /// Luminances of blocks of 8 x 8 pixels.
    blocks: Values,
}

impl Film {
    /// Of an estimate of at least one pass.
    pub fn of_estimate(film: &FilmEstimate) -> Self {
        let blocks = Values::of_view(film);
        Self { size_px: film.size_px, channels: film.channels, values: film.mean.clone(), blocks }
    }

    /// Of an image, where the job tells a relative error of its blocks at a confidence after so many passes: each has its share.
    pub fn of_image(image: Image<'_>, told: Option<f64>, confidence: f64, passes: u64) -> Self {
        let lux: Vec<f64> = block_means(image.size_px, &image.luminances());
        let quantile = two_sided_student_quantile(confidence, passes.max(2) as f64 - 1.0);
        let error = |luminance: &f64| told.map_or(f64::INFINITY, |told| luminance * told / quantile);
        let errors = lux.iter().map(error).collect();
        let blocks = Values { grids: vec![lux.len()], lux, errors, passes };
        Self { size_px: image.size_px, channels: image.channels, values: image.values.to_vec(), blocks }
    }

    fn image(&self) -> Image<'_> {
        Image { size_px: self.size_px, channels: self.channels, values: &self.values }
    }

    /// Root mean square of the relative deviations of its blocks from the truth, without what the truth's own error adds.
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
    /// The method that was asked for; of an accuracy the one that computed it.
    pub method: String,
    /// Seconds that it was given; null of a picture of an accuracy.
    pub asked_seconds: Option<f64>,
    /// Relative error that was asked for; null of a picture of equal time.
    pub asked_relative_error: Option<f64>,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Number of passes.
    pub passes: u64,
    /// Relative error that the job tells of itself, at its confidence; null where it knows none.
    pub told_relative_error: Option<f64>,
    /// Root mean square of the relative deviations of blocks of 8 x 8 pixels from the reference, without what its own error adds;
    /// null where no pass ended in time.
    pub actual_relative_error: Option<f64>,
    #[serde(skip)]
    film: Option<Film>,
}

/// A job of pictures that has ended.
#[derive(Clone, Debug)]
pub struct Shown {
    /// The methods that computed it.
    pub computed_by: String,
    /// Seconds of rendering.
    pub seconds: f64,
    /// Number of passes.
    pub passes: u64,
    /// Relative error of the blocks that it tells of itself.
    pub told: Option<f64>,
    /// Its views in the order of the document; `None` before the first pass.
    pub films: Option<Vec<Film>>,
}

/// All pictures, and what they are compared with.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// The methods that computed the reference.
    pub reference_method: String,
    /// Seconds that the reference was rendered.
    pub reference_seconds: f64,
    /// Pictures in the order in which they were made.
    pub pictures: Vec<Picture>,
    /// Methods that cannot show the views.
    pub refused: Vec<Refused>,
    references: Vec<(String, Film)>,
}

impl Pictures {
    /// Nothing but the reference, `None` where it has no pass.
    pub fn compared_with(request: &PictureRequest, reference: Shown, refused: Vec<Refused>) -> Option<Self> {
        let films = reference.films?.into_iter().enumerate();
        Some(Self {
            reference_method: reference.computed_by,
            reference_seconds: reference.seconds,
            pictures: Vec::new(),
            refused,
            references: films.map(|(view, film)| (request.view(view), film)).collect(),
        })
    }

    /// Adds what a job shows of every view.
    pub fn push(&mut self, key: &PictureKey, shown: Shown) {
        let (method, asked_seconds, asked_relative_error) = match key {
            PictureKey::Reference => return,
            PictureKey::EqualTime { method, seconds } => (method, Some(*seconds), None),
            PictureKey::Accuracy { relative_error } => (&shown.computed_by, None, Some(*relative_error)),
        };
        let mut films = shown.films.map(Vec::into_iter);
        for (view, truth) in &self.references {
            let film = films.as_mut().and_then(Iterator::next);
            self.pictures.push(Picture {
                view: view.clone(),
                method: method.clone(),
                asked_seconds,
                asked_relative_error,
                seconds: shown.seconds,
                passes: shown.passes,
                told_relative_error: shown.told,
                actual_relative_error: film.as_ref().map(|film| film.error(truth)),
                film,
            });
        }
    }

    /// Each view's pictures of equal time, a row for each time and a column for each method, the reference last; crops of its
    /// pictures of an accuracy; and the numbers of all as JSON. Names and contents.
    pub fn files(&self, request: &PictureRequest) -> Result<Vec<(String, Vec<u8>)>, OutputError> {
        let mut files = Vec::new();
        for (view, truth) in &self.references {
            let tones = ToneMapping::of(truth.image())?;
            let of_view = || self.pictures.iter().filter(|picture| picture.view == *view);
            let reference = |raster: Raster| (format!("reference: {}", self.reference_method), raster);
            let mut strip = Vec::new();
            for picture in of_view().filter(|picture| picture.asked_seconds.is_some()) {
                strip.push((picture.title(), picture.raster(&tones, truth)?));
            }
            if !strip.is_empty() {
                let columns = strip.len().div_ceil(request.wanted.seconds.len().max(1));
                strip.push(reference(tones.apply(truth.image())?));
                files.push((equal_time(view), png::encode(&montage(&strip, columns)?)?));
            }
            let mut crops = Vec::new();
            for picture in of_view().filter(|picture| picture.asked_relative_error.is_some()) {
                crops.push((picture.title(), crop(&picture.raster(&tones, truth)?)));
            }
            if !crops.is_empty() {
                crops.push(reference(crop(&tones.apply(truth.image())?)));
                files.push((accuracies(view), png::encode(&montage(&crops, crops.len())?)?));
            }
        }
        let told = json!({
            "request": request, "reference": { "method": self.reference_method, "seconds": self.reference_seconds },
            "pictures": self.pictures, "refused": self.refused,
        });
        files.push((PICTURES_JSON.to_owned(), format!("{told}\n").into_bytes()));
        Ok(files)
    }
}

/// File of the numbers of all pictures.
pub const PICTURES_JSON: &str = "pictures.json";

/// File of a view's pictures of equal time.
pub fn equal_time(view: &str) -> String {
    format!("{view}.equal_time.png")
}

/// File of a view's pictures of an accuracy.
pub fn accuracies(view: &str) -> String {
    format!("{view}.accuracies.png")
}

impl Picture {
    /// What it is, in a line.
    pub fn title(&self) -> String {
        let percent = |share: f64| format!("{} %", significant(100.0 * share, 2));
        let error = self.actual_relative_error.map_or("no pass in time".to_owned(), percent);
        let asked = self.asked_relative_error.map_or(String::new(), |asked| format!("{} asked, ", percent(asked)));
        format!("{}: {asked}{}, {error}", self.method, duration(self.seconds, 2))
    }

    /// As it is shown beside the reference: black where no pass ended in time.
    fn raster(&self, tones: &ToneMapping, truth: &Film) -> Result<Raster, OutputError> {
        match &self.film {
            Some(film) => tones.apply(film.image()),
            None => Ok(Raster::filled(truth.size_px[0], truth.size_px[1], [0; 3])),
        }
    }
}

/// The middle of a picture, enlarged.
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

    /// An image tells its blocks as an estimate does, and an error for each that is the job's.
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

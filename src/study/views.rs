//! Pictures of a job's views: by several methods after the same time, and by one method at several accuracies.

use serde::Serialize;
use serde_json::{Value, json};

use super::compare::Values;
use super::request::method_of;
use super::run::StudyError;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, JobDocument, MeshSource};
use crate::estimate::FilmEstimate;
use crate::figure::montage::montage;
use crate::figure::ticks::{duration, significant};
use crate::job::cancel::Stop;
use crate::job::chunk::Rendered;
use crate::job::prepare::{Prepared, prepare_document};
use crate::output::png::{self, ToneMapping};
use crate::output::{Image, OutputError, Raster};

/// Side of a crop in pixels of its view, at most.
const CROP_PX: usize = 96;

/// Width that crops are enlarged to at least.
const LEAST_WIDTH_PX: usize = 192;

/// The reference may take so many times as long as the longest picture.
const LONGER: f64 = 10.0;

/// What pictures are made of the views of a job; its grids are left out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PictureRequest {
    /// The job document.
    pub job: Value,
    /// Methods by name, for pictures of equal time.
    pub methods: Vec<String>,
    /// Seconds of rendering after which each method shows a picture.
    pub seconds: Vec<f64>,
    /// Relative errors of the blocks of 8 x 8 pixels at which the job's own method shows a picture.
    pub relative_errors: Vec<f64>,
    /// Seconds after which a picture of an accuracy is shown as it is.
    pub most_seconds: f64,
    /// Method of the reference.
    pub reference: String,
}

/// A picture of one view.
#[derive(Clone, Debug, Serialize)]
pub struct Picture {
    /// Name of the view.
    pub view: String,
    /// The method that was asked for.
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
    film: Option<FilmEstimate>,
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
    /// Methods that cannot show the views, with the reason.
    pub refused: Vec<(String, String)>,
    references: Vec<(String, FilmEstimate)>,
}

/// Renders all pictures; `heard` is told what comes next, and how many are done of how many.
pub fn run(
    request: &PictureRequest,
    meshes: &dyn MeshSource,
    stop: &Stop,
    heard: &mut dyn FnMut(usize, usize, &str),
) -> Result<Pictures, StudyError> {
    request.check()?;
    let prepare = |document: Value| -> Result<Prepared, DocumentErrors> {
        prepare_document(&JobDocument::from_value(document)?, meshes)
    };
    let longest = request.seconds.iter().copied().fold(request.most_seconds, f64::max);
    let least = request.relative_errors.iter().copied().reduce(f64::min).unwrap_or(0.04);
    let reference =
        prepare(request.document(method_of(&request.job, &request.reference), 0.25 * least, LONGER * longest, 0))?;
    let mut wanted: Vec<(&str, Option<f64>, Option<f64>)> = Vec::new();
    let mut refused = Vec::new();
    for method in &request.methods {
        match prepare(request.document(method_of(&request.job, method), 0.5, 1.0, 1)) {
            Ok(_) => wanted.extend(request.seconds.iter().map(|seconds| (method.as_str(), Some(*seconds), None))),
            Err(errors) if errors.0.iter().all(|error| error.pointer.starts_with("/method")) => {
                refused.push((method.clone(), errors.to_string()));
            }
            Err(errors) => return Err(errors.into()),
        }
    }
    // rows of equal time
    wanted.sort_by(|a, b| a.1.unwrap_or(0.0).total_cmp(&b.1.unwrap_or(0.0)));
    wanted.extend(request.relative_errors.iter().map(|error| ("", None, Some(*error))));
    heard(0, wanted.len() + 1, "the reference");
    let truth = rendered(&reference, stop)?;
    if truth.estimate.passes == 0 {
        let seconds = reference.stop.max_seconds;
        return Err(StudyError::NoReference { method: reference.method_names(), seconds });
    }
    let mut pictures = Vec::new();
    for (done, (method, seconds, error)) in wanted.iter().enumerate() {
        if stop.reason().is_some() {
            return Err(StudyError::Cancelled(done));
        }
        let own = &request.job["method"];
        let of_method = if method.is_empty() { own.clone() } else { method_of(&request.job, method) };
        let document = request.document(of_method, error.unwrap_or(1e-9), seconds.unwrap_or(request.most_seconds), 1);
        let prepared = prepare(document)?;
        let name = if method.is_empty() { prepared.method_names() } else { (*method).to_owned() };
        heard(done + 1, wanted.len() + 1, &name);
        let found = rendered(&prepared, stop)?;
        let told = prepared.accuracy(&found.estimate).views.filter(|error| error.is_finite());
        for (view, (film, truth)) in found.estimate.views.into_iter().zip(&truth.estimate.views).enumerate() {
            let known = (found.estimate.passes > 0).then_some(film);
            pictures.push(Picture {
                view: request.view(view),
                method: name.clone(),
                asked_seconds: *seconds,
                asked_relative_error: *error,
                seconds: found.spent.seconds,
                passes: found.estimate.passes,
                told_relative_error: told,
                actual_relative_error: known.as_ref().map(|film| actual(film, truth)),
                film: known,
            });
        }
    }
    let views = truth.estimate.views.into_iter().enumerate();
    Ok(Pictures {
        reference_method: reference.method_names(),
        reference_seconds: truth.spent.seconds,
        pictures,
        refused,
        references: views.map(|(view, film)| (request.view(view), film)).collect(),
    })
}

fn actual(film: &FilmEstimate, truth: &FilmEstimate) -> f64 {
    let truth = Values::of_view(truth);
    (Values::of_view(film).squared_error(&truth) - truth.relative_variance().unwrap_or(0.0)).max(0.0).sqrt()
}

fn rendered(prepared: &Prepared, stop: &Stop) -> Result<Rendered, StudyError> {
    // its seconds end a picture, and not the study
    let of_picture = Stop::default();
    Ok(prepared.render(&of_picture, &mut |_, _| {
        if let Some(reason) = stop.reason() {
            of_picture.raise(reason);
        }
    })?)
}

impl PictureRequest {
    fn check(&self) -> Result<(), DocumentErrors> {
        let mut errors = Vec::new();
        if self.job["views"].as_array().is_none_or(Vec::is_empty) {
            errors.push(FieldError::new("/views", "pictures are made of views, and the job has none"));
        }
        let numbers =
            [("/seconds_each", &self.seconds, f64::INFINITY), ("/relative_errors", &self.relative_errors, 1.0)];
        for (pointer, values, most) in numbers {
            for (index, value) in values.iter().enumerate().filter(|(_, value)| !(**value > 0.0 && **value < most)) {
                let detail = format!("must be > 0 and < {most}, but is {value}");
                errors.push(FieldError::new(format!("{pointer}/{index}"), detail).coded(FieldErrorCode::OutOfRange));
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(DocumentErrors(errors)) }
    }

    fn document(&self, method: Value, relative_error: f64, seconds: f64, seed: u64) -> Value {
        let mut document = self.job.clone();
        let confidence = document["stop"]["confidence"].take();
        let seed = document["seed"].as_u64().unwrap_or(0).wrapping_add(seed);
        if let Some(fields) = document.as_object_mut() {
            fields.remove("grids");
            fields.insert("method".to_owned(), if method.is_null() { json!("auto") } else { method });
            fields.insert("seed".to_owned(), json!(seed));
            let mut stop =
                json!({ "view_relative_error": relative_error, "max_seconds": seconds, "max_passes": 1_000_000 });
            if !confidence.is_null() {
                stop["confidence"] = confidence;
            }
            fields.insert("stop".to_owned(), stop);
        }
        document
    }

    fn view(&self, index: usize) -> String {
        self.job["views"][index]["name"].as_str().unwrap_or_default().to_owned()
    }
}

impl Pictures {
    /// Each view's pictures of equal time, a row for each time and a column for each method, the reference last; crops of its
    /// pictures of an accuracy; and the numbers of all as JSON. Names and contents.
    pub fn files(&self, request: &PictureRequest) -> Result<Vec<(String, Vec<u8>)>, OutputError> {
        let methods = request.methods.len() - self.refused.len();
        let mut files = Vec::new();
        for (view, truth) in &self.references {
            let tones = ToneMapping::of(image(truth))?;
            let of_view = || self.pictures.iter().filter(|picture| picture.view == *view);
            let reference = |raster: Raster| (format!("reference: {}", self.reference_method), raster);
            let mut strip = Vec::new();
            for picture in of_view().filter(|picture| picture.asked_seconds.is_some()) {
                strip.push((picture.title(), picture.raster(&tones, truth)?));
            }
            if !strip.is_empty() {
                strip.push(reference(tones.apply(image(truth))?));
                files.push((format!("views/{view}.equal_time.png"), png::encode(&montage(&strip, methods)?)?));
            }
            let mut crops = Vec::new();
            for picture in of_view().filter(|picture| picture.asked_relative_error.is_some()) {
                crops.push((picture.title(), crop(&picture.raster(&tones, truth)?)));
            }
            if !crops.is_empty() {
                crops.push(reference(crop(&tones.apply(image(truth))?)));
                files.push((format!("views/{view}.accuracies.png"), png::encode(&montage(&crops, crops.len())?)?));
            }
        }
        let refused: Vec<Value> =
            self.refused.iter().map(|(method, reason)| json!({ "method": method, "reason": reason })).collect();
        let told = json!({
            "request": request, "reference": { "method": self.reference_method, "seconds": self.reference_seconds },
            "pictures": self.pictures, "refused": refused,
        });
        files.push(("pictures.json".to_owned(), format!("{told}\n").into_bytes()));
        Ok(files)
    }
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
    fn raster(&self, tones: &ToneMapping, truth: &FilmEstimate) -> Result<Raster, OutputError> {
        match &self.film {
            Some(film) => tones.apply(image(film)),
            None => Ok(Raster::filled(truth.size_px[0], truth.size_px[1], [0; 3])),
        }
    }
}

fn image(film: &FilmEstimate) -> Image<'_> {
    Image { size_px: film.size_px, channels: film.channels, values: &film.mean }
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
}

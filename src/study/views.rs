//! Rendering of pictures of a job's views one after the other in this process.

use serde_json::Value;

use super::outcome::Refused;
use super::picture_request::{PictureKey, PictureRequest};
use super::pictures::{Film, Pictures, Shown};
use super::run::{StudyError, of_method_alone};
use crate::document::{DocumentErrors, JobDocument, MeshSource};
use crate::engine::cancel::Stop;
use crate::engine::passes::RenderError;
use crate::figure::ticks::{duration, significant};
use crate::output::OutputError;
use crate::present::prepared::{Prepared, prepare_document};

/// Progress of the pictures: the next job, and the number of finished ones.
pub struct PicturesStep<'a> {
    /// Number of finished jobs, the reference included.
    pub done: usize,
    /// Number of all jobs.
    pub of: usize,
    /// Description of the next job.
    pub next: String,
    /// Largest number of seconds that the remaining jobs may take.
    pub most_seconds_left: f64,
    /// All pictures so far; `None` until the reference is available.
    pub so_far: Option<&'a Pictures>,
}

/// Renders all pictures; calls `heard` before each job, and at the end.
pub fn run(
    request: &PictureRequest,
    meshes: &dyn MeshSource,
    stop: &Stop,
    heard: &mut dyn FnMut(&PicturesStep<'_>),
) -> Result<Pictures, StudyError> {
    let mut errors = Vec::new();
    request.wanted.check(&request.job, "", &mut errors);
    if !errors.is_empty() {
        return Err(DocumentErrors(errors).into());
    }
    let prepare = |document: Value| -> Result<Prepared, DocumentErrors> {
        prepare_document(&JobDocument::from_value(document)?, meshes)
    };
    let (able, refused) = able(request, |document| prepare(document).map(drop))?;
    let keys = request.keys(&able);
    let of = keys.len();
    let most_seconds_left = |done: usize| keys[done..].iter().map(|key| request.most_seconds_of(key)).sum();
    let reference = prepare(request.document(&PictureKey::Reference))?;
    let (method, seconds) = (reference.method_names(), reference.stop.max_seconds);
    let next = format!("reference by {method}, at most {}", duration(seconds, 2));
    heard(&PicturesStep { done: 0, of, next, most_seconds_left: most_seconds_left(0), so_far: None });
    let truth = shown(&reference, stop)?;
    if stop.reason().is_some() {
        return Err(StudyError::Cancelled { done: 0, of });
    }
    if truth.1.is_empty() {
        return Err(StudyError::NoReference { method, seconds });
    }
    let mut pictures = Pictures::compared_with(request, truth, refused).map_err(not_drawn)?;
    for (done, key) in keys.iter().enumerate().skip(1) {
        let prepared = prepare(request.document(key))?;
        let asked = match key {
            PictureKey::Accuracy { relative_error } => format!("to {} %", significant(100.0 * relative_error, 2)),
            _ => format!("for {}", duration(prepared.stop.max_seconds, 2)),
        };
        let (next, so_far) = (format!("{} {asked}", prepared.method_names()), Some(&pictures));
        heard(&PicturesStep { done, of, next, most_seconds_left: most_seconds_left(done), so_far });
        let shown = shown(&prepared, stop)?;
        if stop.reason().is_some() {
            return Err(StudyError::Cancelled { done, of });
        }
        pictures.push(key, shown).map_err(not_drawn)?;
    }
    heard(&PicturesStep { done: of, of, next: "done".to_owned(), most_seconds_left: 0.0, so_far: Some(&pictures) });
    Ok(pictures)
}

/// Separates the methods that can render the views from those that refuse them, with their reasons. A fault that does not concern
/// the method is an error, with a pointer into the job.
pub fn able(
    request: &PictureRequest,
    prepare: impl Fn(Value) -> Result<(), DocumentErrors>,
) -> Result<(Vec<String>, Vec<Refused>), DocumentErrors> {
    let (mut able, mut refused) = (Vec::new(), Vec::new());
    for method in request.methods.iter().filter(|_| !request.wanted.seconds.is_empty()) {
        match prepare(request.trial(method)) {
            Ok(()) => able.push(method.clone()),
            Err(errors) => {
                let reason = of_method_alone(errors)?;
                refused.push(Refused { method: method.clone(), reason });
            }
        }
    }
    Ok((able, refused))
}

fn not_drawn(error: OutputError) -> RenderError {
    RenderError::Output { file: "pictures".to_owned(), reason: error.to_string() }
}

/// Renders a job to its end and returns its views, none if it ended before the first pass.
fn shown(prepared: &Prepared, stop: &Stop) -> Result<(Shown, Vec<Film>), StudyError> {
    // the seconds of a picture end the picture, not the study
    let of_picture = Stop::default();
    let found = prepared.render(&of_picture, &mut |_, _| {
        if let Some(reason) = stop.reason() {
            of_picture.raise(reason);
        }
    })?;
    let shown = Shown {
        computed_by: prepared.method_names(),
        seconds: found.spent.seconds,
        passes: found.estimate.passes,
        told: prepared.accuracy(&found.estimate).views.filter(|error| error.is_finite()),
    };
    let films = found.estimate.views.iter().filter(|_| found.estimate.passes > 0);
    Ok((shown, films.map(Film::of_estimate).collect()))
}

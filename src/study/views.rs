//! Pictures of a job's views, rendered one after the other in this process.

use serde_json::Value;

use super::outcome::Refused;
use super::picture_request::{PictureKey, PictureRequest};
use super::pictures::{Film, Pictures, Shown};
use super::run::{StudyError, of_method_alone};
use crate::document::{DocumentErrors, JobDocument, MeshSource};
use crate::job::cancel::Stop;
use crate::job::prepare::{Prepared, prepare_document};

/// Renders all pictures; `heard` is told what comes next, and how many are done of how many.
pub fn run(
    request: &PictureRequest,
    meshes: &dyn MeshSource,
    stop: &Stop,
    heard: &mut dyn FnMut(usize, usize, &str),
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
    let reference = prepare(request.document(&PictureKey::Reference))?;
    heard(0, keys.len(), "the reference");
    let truth = shown(&reference, stop)?;
    let (method, seconds) = (reference.method_names(), reference.stop.max_seconds);
    let mut pictures =
        Pictures::compared_with(request, truth, refused).ok_or(StudyError::NoReference { method, seconds })?;
    for (done, key) in keys.iter().enumerate().skip(1) {
        if stop.reason().is_some() {
            return Err(StudyError::Cancelled(done));
        }
        let prepared = prepare(request.document(key))?;
        heard(done, keys.len(), &prepared.method_names());
        pictures.push(key, shown(&prepared, stop)?);
    }
    Ok(pictures)
}

/// The methods that can show the views, and the others with their reasons. What is wrong with anything but the method is an error,
/// with a pointer into the job.
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

fn shown(prepared: &Prepared, stop: &Stop) -> Result<Shown, StudyError> {
    // its seconds end a picture, and not the study
    let of_picture = Stop::default();
    let found = prepared.render(&of_picture, &mut |_, _| {
        if let Some(reason) = stop.reason() {
            of_picture.raise(reason);
        }
    })?;
    let films = || found.estimate.views.iter().map(Film::of_estimate).collect();
    Ok(Shown {
        computed_by: prepared.method_names(),
        seconds: found.spent.seconds,
        passes: found.estimate.passes,
        told: prepared.accuracy(&found.estimate).views.filter(|error| error.is_finite()),
        films: (found.estimate.passes > 0).then(films),
    })
}

//! Pictures of a study, from its jobs that have ended.
//!
//! Films are large: a file is made from one picture after the other, of which only the parts that it shows are kept, and one file
//! is made at a time.

use std::sync::Arc;

use axum::http::HeaderMap;
use axum::response::Response;
use tokio::runtime::Handle;
use uuid::Uuid;

use super::evaluate::keep;
use super::looked::Looked;
use super::made::unchanged;
use crate::engine::progress::Progress;
use crate::http::problem::Problem;
use crate::http::{Service, content, formats};
use crate::output::{OutputError, exr};
use crate::study::outcome::Ended;
use crate::study::outcomes::{Found, JobOutcome, Outcomes};
use crate::study::picture_request::{PictureKey, PictureRequest};
use crate::study::pictures::{Film, PICTURES_JSON, Picture, Reference, Sheet, SheetKind, accuracies, equal_time};

/// File of a study's pictures.
#[derive(Clone, Copy)]
enum PictureFile {
    Numbers,
    /// Pictures of the view with this index, side by side.
    Sheet(SheetKind, usize),
}

/// True if a file of this name shows pictures of a study, or their numbers.
pub fn is_name(file: &str) -> bool {
    file == PICTURES_JSON || file.ends_with(&equal_time("")) || file.ends_with(&accuracies(""))
}

/// Answers a request with these headers with the file of this name of a study.
pub async fn answer(app: &Arc<Service>, looked: Looked, file: &str, headers: &HeaderMap) -> Result<Response, Problem> {
    let tag = app.study_files.tag(&looked.study, &looked.heads, file);
    if let Some(unchanged) = unchanged(headers, &format!("\"{tag}\"")) {
        return Ok(unchanged);
    }
    let maker = Maker::new(app, looked)?;
    let of_file = maker.file(file).ok_or_else(|| Problem::not_found("the study has no pictures of this name"))?;
    let bytes = app.study_files.get_or_make(tag.clone(), move || maker.make(of_file)).await?;
    let media_type = if file == PICTURES_JSON { "application/json" } else { "image/png" };
    Ok(formats::named(content::made_as(headers, &tag, bytes, media_type)?, file))
}

/// Maker of picture files, which works off the async threads.
struct Maker {
    app: Arc<Service>,
    runtime: Handle,
    study: Uuid,
    request: PictureRequest,
    /// Jobs of pictures by id, the reference first.
    ids: Vec<Uuid>,
    outcomes: Outcomes,
}

impl Maker {
    fn new(app: &Arc<Service>, looked: Looked) -> Result<Self, Problem> {
        let record = looked.record()?;
        let none = || Problem::not_found("the study has no pictures");
        let pictures = record.request.pictures(app.limits.max_seconds).ok_or_else(none)?;
        let mut outcomes = looked.outcomes(&record);
        let ids = looked.parts.iter().filter(|(_, part)| part.key.picture.is_some()).map(|(id, _)| *id).collect();
        outcomes.jobs.retain(|job| job.part.key.picture.is_some());
        let (app, runtime, study) = (app.clone(), Handle::current(), looked.study.id);
        Ok(Self { app, runtime, study, request: pictures, ids, outcomes })
    }

    /// Finds the file of a name; `None` if the request has no such view.
    fn file(&self, name: &str) -> Option<PictureFile> {
        if name == PICTURES_JSON {
            return Some(PictureFile::Numbers);
        }
        let kinds = [(SheetKind::EqualTime, equal_time("")), (SheetKind::Accuracies, accuracies(""))];
        let (kind, view) = kinds.iter().find_map(|(kind, suffix)| Some((*kind, name.strip_suffix(suffix)?)))?;
        let view = (0..self.views()).find(|index| self.request.view(*index) == view)?;
        Some(PictureFile::Sheet(kind, view))
    }

    fn views(&self) -> usize {
        self.request.job["views"].as_array().map_or(0, Vec::len)
    }

    fn make(mut self, file: PictureFile) -> Result<Vec<u8>, Problem> {
        match file {
            PictureFile::Numbers => self.numbers(),
            PictureFile::Sheet(kind, view) => self.sheet(kind, view),
        }
    }

    /// Draws the pictures of a view side by side.
    fn sheet(&self, kind: SheetKind, view: usize) -> Result<Vec<u8>, Problem> {
        let reference = self.reference(view)?;
        let mut sheet = Sheet::new(kind);
        for (id, job, ended) in self.ended().filter(|(_, job, _)| kind.has(&job.part.key)) {
            let film = self.film(id, ended, view)?;
            let error = film.as_ref().map(|film| reference.error(film));
            let picture = Picture::new(&job.part, ended, self.request.view(view), error);
            let pushed = picture.map(|picture| sheet.push(&picture, film.as_ref(), &reference));
            pushed.transpose().map_err(not_drawn)?;
        }
        let made = sheet.png(&reference, self.request.wanted.seconds.len()).map_err(not_drawn)?;
        made.ok_or_else(|| Problem::not_found("the study has no finished pictures of this kind (yet)"))
    }

    /// Writes times and errors of all pictures; errors that are not stored yet are computed now, and stored.
    fn numbers(&mut self) -> Result<Vec<u8>, Problem> {
        self.outcomes.picture_reference().ok_or_else(no_reference)?;
        let is_new = |job: &JobOutcome| {
            job.part.key.picture != Some(PictureKey::Reference) && !matches!(job.found, Some(Found::Pictures(_)))
        };
        let mut new: Vec<(Uuid, Ended, Vec<Option<f64>>)> =
            self.ended().filter(|(_, job, _)| is_new(job)).map(|(id, _, ended)| (id, *ended, Vec::new())).collect();
        for view in 0..if new.is_empty() { 0 } else { self.views() } {
            let reference = self.reference(view)?;
            for (id, ended, errors) in &mut new {
                errors.push(self.film(*id, ended, view)?.map(|film| reference.error(&film)));
            }
        }
        let new: Vec<_> = new.into_iter().map(|(id, _, errors)| (id, Found::Pictures(errors))).collect();
        if !new.is_empty() {
            self.runtime.block_on(keep(&self.app, self.study, &new));
        }
        for (id, found) in new {
            let job =
                self.ids.iter().position(|other| *other == id).and_then(|index| self.outcomes.jobs.get_mut(index));
            job.into_iter().for_each(|job| job.found = Some(found.clone()));
        }
        self.outcomes.pictures_json(&self.request).ok_or_else(no_reference)
    }

    /// Lists the jobs that have ended.
    fn ended(&self) -> impl Iterator<Item = (Uuid, &JobOutcome, &Ended)> {
        self.ids.iter().zip(&self.outcomes.jobs).filter_map(|(id, job)| Some((*id, job, job.shown()?)))
    }

    /// Reads a view of the reference.
    fn reference(&self, view: usize) -> Result<Reference, Problem> {
        let (part, ended) = self.outcomes.picture_reference().ok_or_else(no_reference)?;
        // the reference is the first job of pictures
        let id = self.ids.first().copied().unwrap_or_default();
        let film = self.film(id, ended, view)?.ok_or_else(no_reference)?;
        Reference::new(part.computed_by.clone(), film).map_err(not_drawn)
    }

    /// Reads the film of a view of a job; `None` before the job's first pass.
    fn film(&self, job: Uuid, ended: &Ended, view: usize) -> Result<Option<Film>, Problem> {
        let name = format!("views/{}.exr", self.request.view(view));
        let Some(file) = self.runtime.block_on(self.app.store.artifact(job, &name))? else { return Ok(None) };
        let bytes = self.runtime.block_on(self.app.artifacts.read_artifact(&file))?;
        let Progress { passes, view_relative_error: told, .. } = ended.progress;
        let decoded = exr::decode(&bytes).map_err(|error| Problem::failed("reading a view failed", &error))?;
        Ok(Some(Film::of_image(decoded.image(), told, self.outcomes.confidence, passes)))
    }
}

fn no_reference() -> Problem {
    Problem::not_found("the reference of the pictures has not been computed (yet)")
}

fn not_drawn(error: OutputError) -> Problem {
    Problem::failed("drawing failed", &error)
}

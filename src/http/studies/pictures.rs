//! Pictures of a study, from its jobs that have ended.
//!
//! Films are large: a file is made from one picture after the other, of which only the parts that it shows are kept, and one file
//! is made at a time.

use std::collections::HashMap;
use std::sync::Arc;

use axum::http::HeaderMap;
use axum::response::Response;
use tokio::runtime::Handle;
use uuid::Uuid;

use super::found::{self, Found};
use super::looked::{heads, parts, read};
use super::made::unchanged;
use super::part::StudyPart;
use crate::engine::progress::Progress;
use crate::http::problem::Problem;
use crate::http::results::internal;
use crate::http::{Service, content, formats};
use crate::output::{OutputError, exr};
use crate::queue::store::*;
use crate::study::StudyRequest;
use crate::study::outcome::Refused;
use crate::study::picture_request::{PictureKey, PictureRequest};
use crate::study::pictures::{
    Film, PICTURES_JSON, Picture, Reference, Sheet, SheetKind, Shown, accuracies, equal_time, numbers,
};

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
pub async fn answer(
    app: &Arc<Service>,
    study: StoredStudy,
    file: &str,
    headers: &HeaderMap,
) -> Result<Response, Problem> {
    let heads = heads(app, study.id).await?;
    let tag = app.study_files.tag(&study, &heads, file);
    if let Some(unchanged) = unchanged(headers, &format!("\"{tag}\"")) {
        return Ok(unchanged);
    }
    let maker = Maker::new(app, study, heads)?;
    let of_file = maker.file(file).ok_or_else(|| Problem::not_found("the study has no pictures of this name"))?;
    let bytes = app.study_files.get_or_make(tag.clone(), move || maker.make(of_file)).await?;
    let media_type = if file == PICTURES_JSON { "application/json" } else { "image/png" };
    Ok(formats::named(content::made_as(headers, &tag, bytes, media_type)?, file))
}

/// Maker of picture files, which works off the async threads.
struct Maker {
    app: Arc<Service>,
    runtime: Handle,
    study: StoredStudy,
    request: PictureRequest,
    refused: Vec<Refused>,
    /// Jobs of pictures, the reference first.
    jobs: Vec<(Uuid, PictureKey, StudyPart)>,
    heads: HashMap<Uuid, JobHead>,
}

impl Maker {
    fn new(app: &Arc<Service>, study: StoredStudy, heads: HashMap<Uuid, JobHead>) -> Result<Self, Problem> {
        let request: StudyRequest =
            serde_json::from_str(&study.request).map_err(|error| internal("reading a study failed", &error))?;
        let none = || Problem::not_found("the study has no pictures");
        let request = request.pictures(app.limits.max_seconds).ok_or_else(none)?;
        let of_picture = |(id, part): (Uuid, StudyPart)| Some((id, part.picture.clone()?, part));
        let jobs = parts(&study)?.into_iter().filter_map(of_picture).collect();
        let (app, refused) = (app.clone(), read(&study.refused)?);
        Ok(Self { app, runtime: Handle::current(), study, request, refused, jobs, heads })
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

    fn make(&self, file: PictureFile) -> Result<Vec<u8>, Problem> {
        match file {
            PictureFile::Numbers => self.numbers(),
            PictureFile::Sheet(kind, view) => self.sheet(kind, view),
        }
    }

    /// Draws the pictures of a view side by side.
    fn sheet(&self, kind: SheetKind, view: usize) -> Result<Vec<u8>, Problem> {
        let reference = self.reference(view)?;
        let mut sheet = Sheet::new(kind);
        for (id, key, part) in self.jobs.iter().filter(|(_, key, _)| kind.has(key)) {
            let Some(head) = self.ended(*id) else { continue };
            let film = self.film(head, view)?;
            let error = film.as_ref().map(|film| reference.error(film));
            let Some(picture) = shown(part, head).picture(key, &self.request.view(view), error) else { continue };
            sheet.push(&picture, film.as_ref(), &reference).map_err(not_drawn)?;
        }
        let made = sheet.png(&reference, self.request.wanted.seconds.len()).map_err(not_drawn)?;
        made.ok_or_else(|| Problem::not_found("the study has no finished pictures of this kind (yet)"))
    }

    /// Writes times and errors of all pictures; errors that are not stored yet are computed now, and stored.
    fn numbers(&self) -> Result<Vec<u8>, Problem> {
        let (reference, part) = self.ended_reference()?;
        let stored = found::stored(&self.study);
        let mut errors: HashMap<Uuid, Vec<Option<f64>>> = HashMap::new();
        let mut new = Vec::new();
        for head in self.jobs.iter().filter_map(|(id, ..)| self.ended(*id)) {
            match stored.get(&head.id) {
                Some(Found::Pictures(of_job)) => drop(errors.insert(head.id, of_job.clone())),
                _ if head.id != reference.id => new.push(head),
                _ => {}
            }
        }
        for view in (0..self.views()).filter(|_| !new.is_empty()) {
            let reference = self.reference(view)?;
            for head in &new {
                let error = self.film(head, view)?.map(|film| reference.error(&film));
                errors.entry(head.id).or_default().push(error);
            }
        }
        let of_new = |head: &&JobHead| Some((head.id, Found::Pictures(errors.get(&head.id)?.clone())));
        let new: Vec<(Uuid, Found)> = new.iter().filter_map(of_new).collect();
        if !new.is_empty() {
            self.runtime.block_on(found::keep(&self.app, self.study.id, &new));
        }
        let mut pictures: Vec<Picture> = Vec::new();
        for (id, key, part) in &self.jobs {
            let (Some(head), Some(errors)) = (self.ended(*id), errors.get(id)) else { continue };
            let shown = shown(part, head);
            let each = errors.iter().enumerate();
            pictures.extend(each.filter_map(|(view, error)| shown.picture(key, &self.request.view(view), *error)));
        }
        Ok(numbers(&self.request, &shown(part, reference), &pictures, &self.refused))
    }

    /// Returns a job of pictures that has ended. One whose time limit came before its first pass has failed, but keeps its place
    /// among them.
    fn ended(&self, id: Uuid) -> Option<&JobHead> {
        self.heads.get(&id).filter(|head| match head.status {
            JobStatus::Succeeded => true,
            JobStatus::Failed => head.progress.passes == 0,
            JobStatus::Queued | JobStatus::Running | JobStatus::Cancelled => false,
        })
    }

    fn ended_reference(&self) -> Result<(&JobHead, &StudyPart), Problem> {
        let reference = self.jobs.iter().find(|(_, key, _)| *key == PictureKey::Reference);
        let reference = reference.and_then(|(id, _, part)| Some((self.ended(*id)?, part)));
        reference.filter(|(head, _)| head.progress.passes > 0).ok_or_else(no_reference)
    }

    /// Reads a view of the reference.
    fn reference(&self, view: usize) -> Result<Reference, Problem> {
        let (head, part) = self.ended_reference()?;
        let film = self.film(head, view)?.ok_or_else(no_reference)?;
        Reference::new(part.computed_by.clone(), film).map_err(not_drawn)
    }

    /// Reads the film of a view of a job; `None` before the job's first pass.
    fn film(&self, head: &JobHead, view: usize) -> Result<Option<Film>, Problem> {
        let name = format!("views/{}.exr", self.request.view(view));
        let Some(file) = self.runtime.block_on(self.app.store.artifact(head.id, &name))? else { return Ok(None) };
        let bytes = self.runtime.block_on(self.app.artifacts.read_artifact(&file))?;
        let Progress { passes, view_relative_error: told, .. } = head.progress;
        let decoded = exr::decode(&bytes).map_err(|error| internal("reading a view failed", &error))?;
        Ok(Some(Film::of_image(decoded.image(), told, self.study.confidence, passes)))
    }
}

fn shown(part: &StudyPart, head: &JobHead) -> Shown {
    let Progress { seconds, passes, view_relative_error: told, .. } = head.progress;
    Shown { computed_by: part.computed_by.clone(), seconds, passes, told }
}

fn no_reference() -> Problem {
    Problem::not_found("the reference of the pictures has not been computed (yet)")
}

fn not_drawn(error: OutputError) -> Problem {
    internal("drawing failed", &error)
}

//! Queueing of a study: a job for its reference, and one for each method, error and seed.

use std::time::Instant;

use axum::Json;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde_json::{Map, Value};

use super::evaluate::study_resource;
use super::looked::heads;
use super::part::StudyPart;
use super::resource::StudyResource;
use crate::document::result::PlanResult;
use crate::document::{DocumentErrors, FieldError, FieldErrorCode, JobDocument};
use crate::http::client::Client;
use crate::http::jobs::posted::Body;
use crate::http::jobs::submit::{
    POLL_SECONDS, client_full, idempotency_key, key_reused, mesh_gone, queue_full, replayed,
};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::http::turns::Turn;
use crate::http::{App, Service};
use crate::present::prepared::{Prepared, prepare_document};
use crate::queue::meshes::UploadedMeshes;
use crate::queue::shared_fields::SharedFields;
use crate::queue::store::*;
use crate::study::StudyRequest;
use crate::study::outcome::Refused;
use crate::study::picture_request::PictureKey;
use crate::study::request::RunKey;
use crate::study::run::{Judged, able};
use crate::study::views;

/// Largest number of jobs of one study.
const MOST_JOBS: usize = 200;
/// Largest number of bytes that the jobs of one study have in their rows and first events beside the fields that they share.
const MOST_BYTES: usize = 16 << 20;
/// Fraction of the memory limit of a job that may be used to put pictures together: both may be in memory at the same time.
const SHARE_OF_PICTURES: f64 = 0.25;

/// Queues a study: the cost of accuracy by several methods on one job.
///
/// Its jobs are jobs like all others: a reference, and one for each method, relative error and seed; with `pictures` another
/// reference, and one for each method and time and for each accuracy; at most 200 in all. They take turns with the jobs that have
/// begun, so that new jobs need not wait for a study. `Idempotency-Key` makes a repeated post answer with the first study; a job
/// may have the same key.
#[utoipa::path(post, path = "/v1/studies", operation_id = "create_study", tag = "studies",
    params(("Idempotency-Key" = Option<String>, Header, description = "Unique to this study: 1 to 255 printable ASCII characters",
        min_length = 1, max_length = 255, pattern = "^[ -~]+$")),
    request_body(content = StudyRequest, description = "The job, and the methods, errors and seeds with which to \
                                                        compute it", content_type = "application/json",
        example = json!({
            "job": {
                "room": { "size_m": [4, 3, 2.5] },
                "tubes": [{ "centre_m": [2, 1.5], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
                            "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.7 } }],
                "sky": { "cie_type": 1, "sun_position": { "altitude_deg": 40, "azimuth_deg": 180 } },
                "grids": [{ "name": "desk", "height_m": 0.75, "cells": [8, 6] }]
            },
            "methods": ["auto", "path_tracing"], "relative_errors": [0.05, 0.02], "seeds": 3
        })),
    responses(
        (status = 202, description = "Queued; the body is the study", body = StudyResource,
            headers(("Location" = String, description = "Path of the study"),
                ("Retry-After" = u32, description = "Seconds to wait before asking for it"),
                ("Idempotency-Replayed" = bool, description = "`true` if the study is that of an earlier post with \
                                                               this key; otherwise absent"))),
        (status = 400, description = "The body is not JSON", body = Problem, content_type = "application/problem+json"),
        (status = 413, description = "The body is too long", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "The content type is not application/json", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "The request is not valid, or the key was used with another one",
            body = Problem, content_type = "application/problem+json"),
        (status = 429, description = "The jobs of the study would exceed the client's limit of waiting jobs",
            body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The queue has no room for all jobs of the study",
            body = Problem, content_type = "application/problem+json")))]
pub async fn create(app: App, client: Client, headers: HeaderMap, body: Body) -> Result<Response, Problem> {
    let other = "another study";
    let idempotency_key = idempotency_key(&headers)?;
    let turn = permit(&app.permits.studies).await?;
    let posted = body.read(&turn).await?;
    if app.shutdown.is_cancelled() {
        return Err(Problem::unavailable("the service is shutting down"));
    }
    // a repeated post is answered even when its meshes were deleted meanwhile
    if let Some(key) = &idempotency_key
        && let Some(study) = app.store.study_of_key(key).await?
    {
        return if study.body_hash == posted.hash {
            accepted(&app, study).await.map(replayed)
        } else {
            Err(key_reused(other))
        };
    }
    let new = prepared(&app, turn, posted.value).await?;
    let new = NewStudy { idempotency_key, body_hash: posted.hash, client: client.to_string(), ..new };
    match app.store.submit_study(new, app.limits.most_waiting()).await? {
        StudySubmission::New(study) => {
            tracing::info!(study = %study.id, jobs = study.jobs.len(), "study queued");
            metrics::counter!("skyduct_jobs_submitted_total").increment(study.jobs.len() as u64);
            accepted(&app, study).await
        }
        StudySubmission::Repeated(study) => accepted(&app, study).await.map(replayed),
        StudySubmission::KeyReused => Err(key_reused(other)),
        StudySubmission::QueueFull => Err(queue_full(&app)),
        StudySubmission::ClientFull => Err(client_full(&app)),
        StudySubmission::MeshGone(mesh) => Err(mesh_gone(&mesh)),
    }
}

async fn accepted(app: &Service, study: StoredStudy) -> Result<Response, Problem> {
    let location = format!("/v1/studies/{}", study.id);
    let heads = heads(app, study.id).await?;
    let headers = [(header::LOCATION, location), (header::RETRY_AFTER, POLL_SECONDS.to_string())];
    Ok((StatusCode::ACCEPTED, headers, Json(study_resource(app, &study, heads).await?)).into_response())
}

/// Prepares a study with all of its jobs, off the async threads.
async fn prepared(app: &Service, turn: Turn, request: Value) -> Result<NewStudy, Problem> {
    let (meshes, runtime) = (app.meshes.clone(), tokio::runtime::Handle::current());
    let (memory_bytes, most_seconds) = (app.limits.memory_limit_bytes(), app.limits.max_seconds);
    let prepared = off_thread(turn, move |cancel| {
        let request = StudyRequest::from_value(request)?.within(most_seconds)?;
        let workshop = Workshop { meshes: meshes.for_document(runtime, cancel), memory_bytes, most_seconds };
        workshop.study(&request)
    });
    prepared.await?.map_err(Problem::from)
}

/// Meshes and limits with which a study's jobs are prepared.
struct Workshop {
    meshes: UploadedMeshes,
    memory_bytes: u64,
    most_seconds: f64,
}

/// Job of a study that can be queued.
#[derive(Clone)]
struct Ready {
    job: NewStudyJob,
    part: StudyPart,
    /// Bytes that the job's row takes, and its events.
    bytes: usize,
}

/// Jobs of a study that can be queued, and the fields that they share.
#[derive(Default)]
struct Gathered {
    submitted: SharedFields,
    document: SharedFields,
    plan: SharedFields,
    jobs: Vec<Ready>,
    bytes: usize,
}

impl Workshop {
    fn study(&self, request: &StudyRequest) -> Result<NewStudy, DocumentErrors> {
        let Judged { able, mut refused } = able(request, |document| Ok(self.prepared(document)?.stop.confidence))
            .map_err(|errors| in_request(errors, None))?;
        let Some((_, confidence)) = able.first() else { return Err(none_able(request, &refused)) };
        let confidence = *confidence;
        let methods: Vec<String> = able.into_iter().map(|(method, _)| method).collect();
        let of_pictures = self.pictures(request, &methods, &mut refused)?;
        check_number(request, &methods, of_pictures.len())?;
        let mut gathered = Gathered::default();
        if request.reference.grids.is_none() {
            let ready = self.ready(&mut gathered, &request.reference());
            gathered.push(ready.map_err(|errors| in_request(errors, Some("/reference/method")))?)?;
        }
        // seeds change neither plan nor costs: each method is prepared once for each error
        let mut of_first_seed: Vec<(RunKey, Ready)> = Vec::new();
        for key in request.runs(&methods) {
            let is_alike = |(first, _): &&(RunKey, Ready)| {
                first.method == key.method && first.relative_error == key.relative_error
            };
            let ready = match of_first_seed.iter().find(is_alike) {
                Some((_, first)) => first.with_seed(request.seed(&key)),
                None => {
                    let document = request.run(&key);
                    let first = self.ready(&mut gathered, &document).map_err(|errors| in_request(errors, None))?;
                    of_first_seed.push((key.clone(), first.clone()));
                    first
                }
            };
            gathered.push(Ready { part: StudyPart { run: Some(key), ..ready.part.clone() }, ..ready })?;
        }
        for (key, document) in of_pictures {
            let of_reference = (key == PictureKey::Reference).then_some("/reference/method");
            let ready = self.ready(&mut gathered, &document).map_err(|errors| in_request(errors, of_reference))?;
            gathered.push(Ready { part: StudyPart { picture: Some(key), ..ready.part.clone() }, ..ready })?;
        }
        let Gathered { submitted, document, plan, jobs, .. } = gathered;
        let with_part = |ready: Ready| NewStudyJob { part: to_value(&ready.part), ..ready.job };
        Ok(NewStudy {
            name: request.job["name"].as_str().map(str::to_owned),
            request: to_value(request).to_string(),
            refused: to_value(&refused),
            confidence,
            idempotency_key: None,
            body_hash: String::new(),
            client: String::new(),
            meshes: self.meshes.loaded(),
            submitted,
            document,
            plan,
            jobs: jobs.into_iter().map(with_part).collect(),
        })
    }

    /// Lists the jobs of the study's pictures with their documents; methods that cannot show the views are added to `refused`.
    fn pictures(
        &self,
        request: &StudyRequest,
        methods: &[String],
        refused: &mut Vec<Refused>,
    ) -> Result<Vec<(PictureKey, Value)>, DocumentErrors> {
        let Some(pictures) = request.pictures(self.most_seconds) else { return Ok(Vec::new()) };
        let (able, unable) = views::able(&pictures, |document| self.prepared(&document).map(drop))
            .map_err(|errors| in_request(errors, None))?;
        let of_views = |Refused { method, reason }| Refused { method, reason: format!("for the views: {reason}") };
        refused.extend(unable.into_iter().map(of_views));
        let keys = pictures.keys(&able);
        check_number(request, methods, keys.len())?;
        let bytes = pictures.most_bytes(&keys);
        let most = self.memory_bytes as f64 * SHARE_OF_PICTURES;
        if bytes > most {
            let detail = format!(
                "comparing the pictures of a view would take about {:.2} GB of memory, but this service allows {:.2} \
                 GB: request fewer seconds or methods, or smaller views",
                bytes / 1e9,
                most / 1e9
            );
            return Err(FieldError::new("/pictures/seconds", detail).coded(FieldErrorCode::TooMany).into());
        }
        Ok(keys.into_iter().map(|key| (key.clone(), pictures.document(&key))).collect())
    }

    fn prepared(&self, document: &Value) -> Result<Prepared, DocumentErrors> {
        let prepared = prepare_document(&JobDocument::from_value(document.clone())?, &self.meshes)?;
        prepared.check_memory(self.memory_bytes)?;
        Ok(prepared)
    }

    /// Prepares a job from its document, without the fields that it shares with the jobs before.
    fn ready(&self, gathered: &mut Gathered, document: &Value) -> Result<Ready, DocumentErrors> {
        let start = Instant::now();
        let prepared = self.prepared(document)?;
        let set_up_seconds = start.elapsed().as_secs_f64();
        let part = StudyPart { run: None, picture: None, computed_by: prepared.method_names(), set_up_seconds };
        let job = NewStudyJob {
            part: Value::Null,
            submitted: gathered.submitted.divide(fields(document)),
            document: gathered.document.divide(fields(&prepared.document)),
            plan: gathered.plan.divide(fields(&to_value(&PlanResult::from(&prepared.plan)))),
            known: prepared.known(),
            warnings: prepared.warnings.clone(),
            first_chunk: prepared.passes_after(0),
        };
        let columns = [to_value(&job.submitted), to_value(&job.document), to_value(&job.plan)];
        // the last two are in an event, too
        let beside = [to_value(&job.known), to_value(&job.warnings)];
        let bytes = columns.iter().chain(&beside).chain(&beside).map(|value| value.to_string().len()).sum();
        Ok(Ready { job, part, bytes })
    }
}

impl Gathered {
    /// Adds a job; refuses it if all jobs together would be too long.
    fn push(&mut self, ready: Ready) -> Result<(), DocumentErrors> {
        self.bytes += ready.bytes;
        if self.bytes > MOST_BYTES {
            let detail = format!(
                "the documents of a study's jobs, without their common fields, may take {} MB in all, but those of {} \
                 jobs take more: request fewer methods, errors or seeds, or a shorter job",
                MOST_BYTES >> 20,
                self.jobs.len() + 1
            );
            return Err(FieldError::new("/seeds", detail).coded(FieldErrorCode::TooMany).into());
        }
        self.jobs.push(ready);
        Ok(())
    }
}

impl Ready {
    /// Returns the job with another seed.
    fn with_seed(&self, seed: u64) -> Self {
        let mut ready = self.clone();
        ready.job.submitted.set("seed", seed.into());
        ready.job.document.set("seed", seed.into());
        ready
    }
}

/// Refuses a study of too many jobs before they are prepared.
fn check_number(request: &StudyRequest, methods: &[String], pictures: usize) -> Result<(), DocumentErrors> {
    let runs = request.runs(methods).count();
    if runs + usize::from(request.reference.grids.is_none()) + pictures <= MOST_JOBS {
        return Ok(());
    }
    let detail = format!(
        "a study may have at most {MOST_JOBS} jobs, but {} suitable methods, {} errors and {} seeds make {runs}, and \
         its pictures {pictures} more",
        methods.len(),
        request.relative_errors.len(),
        request.seeds,
    );
    Err(FieldError::new("/seeds", detail).coded(FieldErrorCode::TooMany).into())
}

/// Returns the fields of a document or a plan.
fn fields(document: &Value) -> Map<String, Value> {
    document.as_object().cloned().unwrap_or_default()
}

/// Converts pointers of a job's errors to pointers into the request; `method` is the pointer at which the request names the job's
/// method.
fn in_request(DocumentErrors(errors): DocumentErrors, method: Option<&str>) -> DocumentErrors {
    let moved = errors.into_iter().map(|error| {
        let of_method = method.and_then(|method| Some(format!("{method}{}", error.pointer.strip_prefix("/method")?)));
        let pointer = of_method.unwrap_or_else(|| format!("/job{}", error.pointer));
        FieldError { pointer, ..error }
    });
    DocumentErrors(moved.collect())
}

/// Returns an error for each method: the reason why it cannot compute the job.
fn none_able(request: &StudyRequest, refused: &[Refused]) -> DocumentErrors {
    let place = |method: &str| request.methods.iter().position(|name| name == method).unwrap_or_default();
    let error = |refused: &Refused| {
        FieldError::new(
            format!("/methods/{}", place(&refused.method)),
            format!("{}: {}", refused.method, refused.reason),
        )
        .coded(FieldErrorCode::MethodRefuses)
    };
    DocumentErrors(refused.iter().map(error).collect())
}

/// Converts a value to JSON; our own types always serialise.
fn to_value(value: &impl serde::Serialize) -> Value {
    serde_json::to_value(value).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::provenance::Provenance;
    use crate::document::result::{ExternalIlluminance, Known};

    /// Jobs are gathered up to a number of bytes that they do not share, whatever makes them long.
    #[test]
    fn what_jobs_do_not_share_is_bounded() {
        let part = StudyPart { run: None, picture: None, computed_by: String::new(), set_up_seconds: 0.0 };
        let mut gathered = Gathered::default();
        let provenance =
            Provenance { zenith: None, sun: None, refraction: None, interreflection: true, guides: Vec::new() };
        let mut own = || gathered.plan.divide(Map::new());
        let job = NewStudyJob {
            part: Value::Null,
            submitted: own(),
            document: own(),
            plan: own(),
            known: Known::new(provenance, ExternalIlluminance { sky: 0.0, sun: 0.0 }),
            warnings: Vec::new(),
            first_chunk: 0..1,
        };
        let ready = || Ready { job: job.clone(), part: part.clone(), bytes: MOST_BYTES / 4 };
        for _ in 0..4 {
            gathered.push(ready()).unwrap();
        }
        let DocumentErrors(errors) = gathered.push(ready()).unwrap_err();
        assert_eq!((errors[0].pointer.as_str(), errors[0].code), ("/seeds", FieldErrorCode::TooMany));
        assert!(errors[0].detail.contains("16 MB in all, but those of 5 jobs"), "{}", errors[0].detail);
    }
}

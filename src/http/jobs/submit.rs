//! Queueing of a job.

use std::sync::Arc;
use std::sync::atomic::Ordering;

use axum::Json;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use uuid::Uuid;

use super::plan::PredictQuery;
use super::posted::{Body, PreparedPost, prepare};
use super::resource::JobResource;
use super::waited::{FinishedJob, Waiting};
use crate::document::JobDocument;
use crate::document::result::PlanResult;
use crate::http::client::Client;
use crate::http::limits::permit;
use crate::http::outlive::HungUp;
use crate::http::places::{Whose, count_refusal};
use crate::http::problem::{Problem, Query};
use crate::http::problem_kind::ProblemKind;
use crate::http::{App, Service, prefer};
use crate::present::prepared::Prepared;
use crate::queue::owner::Owner;
use crate::queue::store::*;
use crate::queue::to_its_end::to_its_end;

/// Largest number of characters of an `Idempotency-Key`.
const MAX_KEY_LENGTH: usize = 255;
/// Owner of an `Idempotency-Key` that was used before, in words for clients.
const OTHER: &str = "a job with another document";
/// Pause in seconds between two looks at a job that a client is asked to make.
pub(in crate::http) const POLL_SECONDS: u32 = 1;

/// Queues a job.
///
/// `Idempotency-Key` makes a repeated post answer with the first job, marked by `Idempotency-Replayed`. With `Prefer: wait=N` (RFC
/// 7240) a job that ends within N seconds is answered with its state at its end and its grids; a longer one with 202 and its
/// progress after N seconds. N counts up to 60, or to 2 s less than a request may take here (`request_seconds` of the
/// configuration). Predictions by `predict` are kept with the job, and drawn in its convergence.
#[utoipa::path(post, path = "/v1/jobs", operation_id = "create_job", tag = "jobs",
    params(PredictQuery, ("Idempotency-Key" = Option<String>, Header, description = "Unique to this job: 1 to 255 printable ASCII characters",
        min_length = 1, max_length = 255, pattern = "^[ -~]+$"),
        ("Prefer" = Option<String>, Header, description = "`wait=N`: wait up to N seconds for the job's end", example = "wait=20")),
    request_body(content = JobDocument, description = "The job document", content_type = "application/json"),
    responses(
        (status = 200, description = "The job ended within the time of `Prefer: wait`; the body is the job with its \
                                      grids", body = FinishedJob,
            headers(("Location" = String, description = "Path of the job"),
                ("Preference-Applied" = String, description = "`wait=N`: the longest time in seconds that was waited"),
                ("Idempotency-Replayed" = bool, description = "`true` if the job is that of an earlier post with this \
                                                               key; otherwise absent"))),
        (status = 202, description = "Queued; the body is the job", body = JobResource,
            headers(("Location" = String, description = "Path of the job"),
                ("Retry-After" = u32, description = "Seconds to wait before asking for it"),
                ("Idempotency-Replayed" = bool, description = "`true` if the job is that of an earlier post with this \
                                                               key; otherwise absent"))),
        (status = 400, description = "The body is not JSON"),
        (status = 409, description = "The job was deleted while the request waited for its end"),
        (status = 413, description = "The body is too long"),
        (status = 415, description = "The content type is not application/json"),
        (status = 422, description = "The document is not valid, or the key was used with another document"),
        (status = 429, description = "This client has reached its limit of waiting jobs"),
        (status = 503, description = "The queue is full")))]
pub async fn create(
    app: App,
    Query(query): Query<PredictQuery>,
    client: Client,
    hung_up: HungUp,
    headers: HeaderMap,
    body: Body,
) -> Result<Response, Problem> {
    let idempotency_key = idempotency_key(&headers)?;
    let waiting = Waiting::new(&app, client, hung_up, prefer::wait(&headers));
    let turn = permit(&app.permits.jobs).await?;
    let posted = body.read(&turn).await?;
    if app.shutdown.is_cancelled() {
        return Err(Problem::unavailable("the service is shutting down"));
    }
    // a repeated post is answered even when its meshes were deleted meanwhile
    if let Some(key) = &idempotency_key
        && let Some(job) = app.store.job_of_key(key).await?
    {
        return if job.body_hash == posted.hash {
            drop(turn);
            answer(&app, job, waiting).await.map(replayed)
        } else {
            Err(refused(&app, NotQueued::KeyReused, OTHER))
        };
    }
    // preparing costs much and this check little, but not nothing: it pays when the last job found no place
    let (client, most) = (client.to_string(), app.limits.most_waiting());
    if app.queue_was_full.load(Ordering::Relaxed) {
        if app.store.unfinished_of(&client).await? > most.of_client {
            return Err(refused(&app, NotQueued::ClientFull, OTHER));
        }
        if app.store.unfinished().await? > most.jobs {
            return Err(refused(&app, NotQueued::QueueFull, OTHER));
        }
    }
    let PreparedPost { prepared, meshes, computation } = prepare(&app, &turn, posted.value).await?;
    let new = new_job(&prepared, &app.owner, posted.text, meshes, client);
    let predictions = query.predictions(&app.permits.pilots_of_jobs, &prepared).await?;
    drop(turn);
    let new = NewJob { idempotency_key, body_hash: posted.hash, computation, predictions, ..new };
    let submission = queue(&app, new, prepared).await?;
    drop(posted.held);
    match submission {
        Submission::New(job) => {
            // where the answer comes with the job's end, the wait for the disk at that end is enough
            if waiting.is_none() {
                app.store.sync(job.head.id).await?;
            }
            answer(&app, job, waiting).await
        }
        Submission::Repeated(job) => answer(&app, job, waiting).await.map(replayed),
        Submission::Refused(reason) => Err(refused(&app, reason, OTHER)),
    }
}

/// Queues a job, and hands its prepared form to the worker.
async fn queue(app: &App, new: NewJob, prepared: Arc<Prepared>) -> Result<Submission<Job>, Problem> {
    let (service, id, most) = (app.0.clone(), new.id, app.limits.most_waiting());
    // a request that takes too long leaves no form of a job that is not queued
    let submission = to_its_end(async move {
        // before it is queued: it may begin at once
        service.live.hand_over(id, prepared);
        let submission = service.store.submit(new, most).await;
        if !matches!(submission, Ok(Submission::New(_))) {
            service.live.forget(id);
        }
        submission
    });
    let submission = submission.await?;
    let full = matches!(submission, Submission::Refused(NotQueued::QueueFull | NotQueued::ClientFull));
    app.queue_was_full.store(full, Ordering::Relaxed);
    if let Submission::New(job) = &submission {
        tracing::debug!(job = %job.head.id, "job queued");
        metrics::counter!("skyduct_jobs_submitted_total").increment(1);
    }
    Ok(submission)
}

/// Creates the job to be queued from its prepared form, with neither key nor hashes; `text` is its document.
fn new_job(prepared: &Prepared, owner: &Owner, text: String, meshes: Vec<String>, client: String) -> NewJob {
    NewJob {
        id: Uuid::now_v7(),
        owner: owner.clone(),
        name: prepared.name.clone(),
        submitted: text,
        document: prepared.document.clone(),
        plan: PlanResult::from(&prepared.plan),
        known: prepared.known(),
        predictions: None,
        warnings: prepared.warnings.clone(),
        idempotency_key: None,
        body_hash: String::new(),
        computation: None,
        uploads: meshes,
        client,
    }
}

/// Answers with the job as it is at its end if that comes in time, else as it is now. Either is durable: the store gives nothing out
/// before.
async fn answer(app: &Service, mut job: Job, waiting: Option<Waiting<'_>>) -> Result<Response, Problem> {
    if let Some(waiting) = waiting {
        if let Some(finished) = waiting.answer(&job.head).await? {
            return Ok(finished);
        }
        // others had time to delete it
        let deleted = || Problem::conflict("the job was deleted while the request waited for its end");
        job = app.store.job(job.head.id).await?.ok_or_else(deleted)?;
    }
    Ok(accepted(job))
}

fn accepted(job: Job) -> Response {
    let location = format!("/v1/jobs/{}", job.head.id);
    let headers = [(header::LOCATION, location), (header::RETRY_AFTER, POLL_SECONDS.to_string())];
    (StatusCode::ACCEPTED, headers, Json(JobResource::new(job))).into_response()
}

/// Returns the problem that a job or set is not queued; `other` is what its key belongs to, in words for clients.
pub(in crate::http) fn refused(app: &Service, reason: NotQueued, other: &str) -> Problem {
    let (waiting, of_client) = (app.limits.queued_jobs, app.limits.queued_jobs_per_client);
    match reason {
        NotQueued::KeyReused => {
            Problem::new(ProblemKind::KeyReused, format!("the Idempotency-Key belongs to {other}; use a new key"))
        }
        NotQueued::QueueFull => {
            count_refusal("queued_jobs", Whose::Service);
            let detail = format!("the queue is full with {waiting} waiting jobs; try again later");
            Problem::new(ProblemKind::QueueFull, detail).retry_after(30)
        }
        NotQueued::ClientFull => {
            let setting = "queued_jobs_per_client";
            count_refusal(setting, Whose::Client);
            let detail =
                format!("this client has reached its limit of {of_client} waiting jobs ({setting}); try again later");
            Problem::new(ProblemKind::TooMany, detail).retry_after(30)
        }
        NotQueued::UploadGone(id) => {
            Problem::new(ProblemKind::InvalidDocument, format!("the uploaded file {id} was deleted; upload it again"))
        }
    }
}

/// Marks an answer about the job or set of an earlier post with the same key.
pub(in crate::http) fn replayed(mut answer: Response) -> Response {
    answer.headers_mut().insert("idempotency-replayed", HeaderValue::from_static("true"));
    answer
}

pub(in crate::http) fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, Problem> {
    let Some(value) = headers.get("idempotency-key") else { return Ok(None) };
    let key = value.to_str().unwrap_or_default();
    let printable = key.bytes().all(|byte| (0x20..0x7f).contains(&byte));
    if key.is_empty() || key.len() > MAX_KEY_LENGTH || !printable {
        return Err(Problem::bad_request(format!(
            "Idempotency-Key must be 1 to {MAX_KEY_LENGTH} printable ASCII characters"
        )));
    }
    Ok(Some(key.to_owned()))
}

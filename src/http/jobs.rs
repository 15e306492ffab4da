//! Jobs: posted, planned, listed, looked at, cancelled, deleted.

use std::collections::BTreeMap;
use std::sync::Arc;

use axum::Json;
use axum::extract::rejection::BytesRejection;
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use bytes::Bytes;
use jiff::Timestamp;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use utoipa::{IntoParams, ToSchema};
use uuid::Uuid;

use crate::document::result::{JobResults, Known, PlanResult};
use crate::document::{DocumentErrors, FieldError, JobDocument, Warning, read};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::{Path, Problem, Query};
use crate::http::problem_kind::ProblemKind;
use crate::http::{App, Service, content};
use crate::job::prepare::{self, Prepared};
use crate::job::progress::{Progress, StoppedBy};
use crate::job::store::*;

const DEFAULT_PAGE: u32 = 50;
const MAX_PAGE: u32 = 500;
/// Longest `Idempotency-Key`.
const MAX_KEY_LENGTH: usize = 255;
/// Pause in seconds that a polling client is asked for.
const POLL_SECONDS: u32 = 1;

/// A job: what was asked for, how far it is, what came out.
#[derive(Serialize, ToSchema)]
pub struct JobResource {
    #[serde(flatten)]
    pub summary: JobSummary,
    /// The document as understood, all defaults filled in.
    #[schema(value_type = JobDocument)]
    pub document: Value,
    /// What is simulated and what is not, and why.
    #[schema(value_type = PlanResult)]
    pub plan: Value,
    pub warnings: Vec<Warning>,
    /// Why the job failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub problem: Option<JobProblem>,
    /// The provenance and the outdoor illuminance from the beginning; the rest of a job that has finished with at least one
    /// pass.
    #[serde(flatten)]
    #[schema(value_type = JobResults)]
    pub results: Map<String, Value>,
}

/// A job in a list.
#[derive(Serialize, ToSchema)]
pub struct JobSummary {
    pub id: Uuid,
    pub name: Option<String>,
    pub status: JobStatus,
    /// The job was asked to stop and will, within a pass.
    pub cancel_requested: bool,
    #[schema(value_type = String, format = DateTime)]
    pub created_at: Option<Timestamp>,
    #[schema(value_type = Option<String>, format = DateTime)]
    pub started_at: Option<Timestamp>,
    #[schema(value_type = Option<String>, format = DateTime)]
    pub finished_at: Option<Timestamp>,
    pub progress: Progress,
    /// Why a finished job ended.
    pub stopped_by: Option<StoppedBy>,
    pub links: Links,
}

/// Paths of what belongs to a job.
#[derive(Serialize, ToSchema)]
pub struct Links {
    #[serde(rename = "self")]
    pub this: String,
    pub events: String,
    pub convergence: String,
    pub convergence_csv: String,
    pub convergence_svg: String,
    pub cancel: String,
    /// Paths of the grids by name (JSON, or what `Accept` or `?format=` asks for). Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grids: Option<BTreeMap<String, String>>,
    /// Paths of the grids' files by name. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grid_files: Option<BTreeMap<String, GridLinks>>,
    /// Paths of the views by name. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub views: Option<BTreeMap<String, ViewLinks>>,
    /// Reports on the tubes, in the order of the document. Not in lists.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tubes: Option<Vec<TubeLinks>>,
}

#[derive(Serialize, ToSchema)]
pub struct GridLinks {
    pub json: String,
    pub csv: String,
    /// False colours with a scale.
    pub png: String,
}

#[derive(Serialize, ToSchema)]
pub struct TubeLinks {
    pub json: String,
    pub svg: String,
}

#[derive(Serialize, ToSchema)]
pub struct ViewLinks {
    pub exr: String,
    pub png: String,
    pub false_colour_png: String,
}

/// A page of jobs, newest first.
#[derive(Serialize, ToSchema)]
pub struct JobPage {
    pub jobs: Vec<JobSummary>,
    /// `cursor` of the next page; null on the last one.
    pub next_cursor: Option<Uuid>,
}

/// What a document would do.
#[derive(Serialize, ToSchema)]
pub struct PlanResource {
    /// The document as understood, all defaults filled in.
    #[schema(value_type = JobDocument)]
    pub document: Value,
    /// What would be simulated and what would not, and why.
    pub plan: PlanResult,
    pub warnings: Vec<Warning>,
    #[serde(flatten)]
    pub known: Known,
}

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct ListQuery {
    /// Only jobs with this status.
    #[param(inline)]
    status: Option<JobStatus>,
    /// Jobs on a page; 50 when absent.
    #[param(minimum = 1, maximum = 500)]
    limit: Option<u32>,
    /// `next_cursor` of the page before.
    cursor: Option<Uuid>,
}

impl JobSummary {
    fn new(head: &JobHead) -> Self {
        let this = format!("/v1/jobs/{}", head.id);
        Self {
            id: head.id,
            name: head.name.clone(),
            status: head.status,
            cancel_requested: head.cancel_requested,
            created_at: timestamp(head.created_at),
            started_at: head.started_at.and_then(timestamp),
            finished_at: head.finished_at.and_then(timestamp),
            progress: head.progress,
            stopped_by: head.stopped_by,
            links: Links {
                events: format!("{this}/events"),
                convergence: format!("{this}/convergence"),
                convergence_csv: format!("{this}/convergence.csv"),
                convergence_svg: format!("{this}/convergence.svg"),
                cancel: format!("{this}/cancel"),
                this,
                grids: None,
                grid_files: None,
                views: None,
                tubes: None,
            },
        }
    }
}

impl JobResource {
    fn new(job: Job) -> Self {
        let mut summary = JobSummary::new(&job.head);
        let this = &summary.links.this;
        let grids = names(&job.document, "grids").map(|name| (name.to_owned(), format!("{this}/grids/{name}")));
        let grid_files = names(&job.document, "grids").map(|name| {
            let [json, csv, png] = ["json", "csv", "png"].map(|suffix| format!("{this}/grids/{name}.{suffix}"));
            (name.to_owned(), GridLinks { json, csv, png })
        });
        let views = names(&job.document, "views").map(|name| {
            let links = ViewLinks {
                exr: format!("{this}/views/{name}.exr"),
                png: format!("{this}/views/{name}.png"),
                false_colour_png: format!("{this}/views/{name}.png?style=false_colour"),
            };
            (name.to_owned(), links)
        });
        let (grids, grid_files, views) = (grids.collect(), grid_files.collect(), views.collect());
        let count = job.document["tubes"].as_array().map_or(0, Vec::len);
        let tubes = (0..count).map(|tube| TubeLinks {
            json: format!("{this}/tubes/{tube}.json"),
            svg: format!("{this}/tubes/{tube}.svg"),
        });
        let tubes = tubes.collect();
        summary.links.grids = Some(grids);
        summary.links.grid_files = Some(grid_files);
        summary.links.views = Some(views);
        summary.links.tubes = Some(tubes);
        let results = match job.summary {
            Some(Value::Object(results)) => results,
            _ => Map::new(),
        };
        Self { summary, document: job.document, plan: job.plan, warnings: job.warnings, problem: job.problem, results }
    }
}

fn names<'a>(document: &'a Value, outputs: &str) -> impl Iterator<Item = &'a str> {
    document[outputs].as_array().into_iter().flatten().filter_map(|output| output["name"].as_str())
}

fn timestamp(milliseconds: i64) -> Option<Timestamp> {
    Timestamp::from_millisecond(milliseconds).ok()
}

/// Queues a job.
///
/// `Idempotency-Key` makes a repeated post answer with the first job.
#[utoipa::path(post, path = "/v1/jobs", operation_id = "create_job", tag = "jobs",
    params(("Idempotency-Key" = Option<String>, Header, description = "Unique to this job: 1 to 255 printable ASCII characters",
        min_length = 1, max_length = 255, pattern = "^[ -~]+$")),
    request_body(content = JobDocument, description = "The job document", content_type = "application/json"),
    responses(
        (status = 202, description = "Queued; the body is the job", body = JobResource,
            headers(("Location" = String, description = "Path of the job"), ("Retry-After" = u32, description = "Seconds to wait before a look at it"))),
        (status = 400, description = "Not JSON", body = Problem, content_type = "application/problem+json"),
        (status = 413, description = "Too long", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "Not application/json", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "Not a valid document, or the key was used for another one", body = Problem, content_type = "application/problem+json"),
        (status = 503, description = "The queue is full", body = Problem, content_type = "application/problem+json")))]
pub async fn create(app: App, headers: HeaderMap, body: Result<Bytes, BytesRejection>) -> Result<Response, Problem> {
    let idempotency_key = idempotency_key(&headers)?;
    let posted = Posted::read(&headers, body)?;
    if app.shutdown.is_cancelled() {
        return Err(Problem::unavailable("the service is shutting down"));
    }
    // a repeated post is answered even when its meshes were deleted meanwhile
    if let Some(key) = &idempotency_key
        && let Some(job) = app.store.job_of_key(key).await?
    {
        return if job.body_hash == posted.hash { Ok(accepted(job)) } else { Err(key_reused()) };
    }
    // preparing costs more than a look
    if app.store.unfinished().await? > app.limits.queued_jobs {
        return Err(queue_full(&app));
    }
    let (prepared, meshes) = prepare(&app, posted.text.clone()).await?;
    let prepared = Arc::new(prepared);
    let first_chunk = prepared.chunk(0).ok_or_else(Problem::internal)?;
    let new = NewJob {
        name: prepared.name.clone(),
        submitted: posted.text,
        document: prepared.document.clone(),
        plan: prepared.plan_json(),
        known: prepared.known_json(),
        warnings: prepared.warnings.clone(),
        idempotency_key,
        body_hash: posted.hash,
        meshes,
        first_chunk,
    };
    match app.store.submit(new, app.limits.queued_jobs).await? {
        Submission::New(job) => {
            app.live.hand_over(job.head.id, prepared);
            tracing::debug!(job = %job.head.id, "job queued");
            metrics::counter!("skyduct_jobs_submitted_total").increment(1);
            Ok(accepted(job))
        }
        Submission::Repeated(job) => Ok(accepted(job)),
        Submission::KeyReused => Err(key_reused()),
        Submission::QueueFull => Err(queue_full(&app)),
        Submission::MeshGone(mesh) => {
            Err(Problem::new(ProblemKind::InvalidDocument, format!("the mesh {mesh} was deleted")))
        }
    }
}

fn accepted(job: Job) -> Response {
    let location = format!("/v1/jobs/{}", job.head.id);
    let headers = [(header::LOCATION, location), (header::RETRY_AFTER, POLL_SECONDS.to_string())];
    (StatusCode::ACCEPTED, headers, Json(JobResource::new(job))).into_response()
}

fn queue_full(app: &Service) -> Problem {
    Problem::new(ProblemKind::QueueFull, format!("{} jobs are waiting; try again later", app.limits.queued_jobs))
        .retry_after(30)
}

fn key_reused() -> Problem {
    Problem::new(ProblemKind::KeyReused, "it belongs to a job with another document; take a new key")
}

fn idempotency_key(headers: &HeaderMap) -> Result<Option<String>, Problem> {
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

/// A posted document: text that is JSON, and the hash of its canonical form.
struct Posted {
    text: String,
    hash: String,
}

impl Posted {
    fn read(headers: &HeaderMap, body: Result<Bytes, BytesRejection>) -> Result<Self, Problem> {
        let content_type = headers.get(header::CONTENT_TYPE).and_then(|value| value.to_str().ok()).unwrap_or("");
        let media_type = content_type.split(';').next().unwrap_or("").trim().to_ascii_lowercase();
        if media_type != "application/json" {
            return Err(Problem::unsupported_media_type("a job document is sent as application/json"));
        }
        let text = String::from_utf8(body?.into())
            .map_err(|error| not_json(format!("not UTF-8 after byte {}", error.utf8_error().valid_up_to())))?;
        if text.starts_with('\u{feff}') {
            return Err(not_json("it begins with a byte order mark (U+FEFF): save it as UTF-8 without one".into()));
        }
        // a field that is given twice is refused before a key can compare its last value
        let value = read::json::value(text.as_bytes()).map_err(|error| match error.pointer.as_str() {
            "" => not_json(error.detail),
            _ => DocumentErrors(vec![error]).into(),
        })?;
        let mut hasher = blake3::Hasher::new();
        hash_canonical(&value, &mut hasher);
        Ok(Self { text, hash: hasher.finalize().to_hex().to_string() })
    }
}

fn not_json(detail: String) -> Problem {
    Problem::new(ProblemKind::NotJson, detail)
}

/// Equal for bodies that differ only in white space and in the order of fields.
fn hash_canonical(value: &Value, hasher: &mut blake3::Hasher) {
    match value {
        Value::Object(fields) => {
            hasher.update(format!("object {}\n", fields.len()).as_bytes());
            let mut sorted: Vec<_> = fields.iter().collect();
            sorted.sort_by_key(|(name, _)| *name);
            for (name, value) in sorted {
                hasher.update(format!("{}\n{name}", name.len()).as_bytes());
                hash_canonical(value, hasher);
            }
        }
        Value::Array(values) => {
            hasher.update(format!("array {}\n", values.len()).as_bytes());
            values.iter().for_each(|value| hash_canonical(value, hasher));
        }
        leaf => {
            hasher.update(format!("{leaf}\n").as_bytes());
        }
    }
}

/// Off the async threads: meshes can be large. Answers the uploaded meshes that the document uses, too.
async fn prepare(app: &Service, document: String) -> Result<(Prepared, Vec<String>), Problem> {
    let (meshes, runtime) = (app.meshes.clone(), tokio::runtime::Handle::current());
    let memory_limit = app.limits.memory_limit_bytes();
    let prepared = off_thread(permit(&app.permits.preparing).await?, move |cancel| {
        let meshes = meshes.for_document(runtime, cancel);
        let prepared = prepare::prepare(document.as_bytes(), &meshes)?;
        prepared.check_memory(memory_limit)?;
        Ok::<_, DocumentErrors>((prepared, meshes.loaded()))
    });
    let (prepared, meshes) = prepared.await??;
    let (asked, most) = (prepared.stop.max_seconds, app.limits.max_seconds);
    if asked > most {
        return Err(DocumentErrors(vec![FieldError {
            pointer: "/stop/max_seconds".into(),
            detail: format!("must be <= {most} on this service, but is {asked}"),
        }])
        .into());
    }
    Ok((prepared, meshes))
}

/// What a document would simulate and what not, and why; queues nothing.
#[utoipa::path(post, path = "/v1/plan", operation_id = "plan_job", tag = "jobs",
    request_body(content = JobDocument, description = "The job document", content_type = "application/json"),
    responses(
        (status = 200, description = "The plan", body = PlanResource),
        (status = 400, description = "Not JSON", body = Problem, content_type = "application/problem+json"),
        (status = 413, description = "Too long", body = Problem, content_type = "application/problem+json"),
        (status = 415, description = "Not application/json", body = Problem, content_type = "application/problem+json"),
        (status = 422, description = "Not a valid document", body = Problem, content_type = "application/problem+json")))]
pub async fn plan(
    app: App,
    headers: HeaderMap,
    body: Result<Bytes, BytesRejection>,
) -> Result<Json<PlanResource>, Problem> {
    let posted = Posted::read(&headers, body)?;
    let (prepared, _) = prepare(&app, posted.text).await?;
    let (plan, known) = (PlanResult::from(&prepared.plan), prepared.known());
    Ok(Json(PlanResource { document: prepared.document, plan, warnings: prepared.warnings, known }))
}

/// Jobs, newest first.
#[utoipa::path(get, path = "/v1/jobs", operation_id = "list_jobs", tag = "jobs", params(ListQuery),
    responses(
        (status = 200, description = "A page of jobs", body = JobPage),
        (status = 422, description = "A parameter is not valid; `errors` name it", body = Problem, content_type = "application/problem+json")))]
pub async fn list(app: App, Query(query): Query<ListQuery>) -> Result<Json<JobPage>, Problem> {
    let limit = query.limit.unwrap_or(DEFAULT_PAGE);
    if !(1..=MAX_PAGE).contains(&limit) {
        return Err(Problem::invalid_parameter("limit", format!("must be 1 to {MAX_PAGE}, but is {limit}")));
    }
    // one more tells whether there is a next page
    let filter = JobFilter { status: query.status, before: query.cursor, limit: limit + 1 };
    let mut heads = app.store.jobs(filter).await?;
    let more = heads.len() > limit as usize;
    heads.truncate(limit as usize);
    let next_cursor = heads.last().filter(|_| more).map(|head| head.id);
    Ok(Json(JobPage { jobs: heads.iter().map(JobSummary::new).collect(), next_cursor }))
}

/// The job.
#[utoipa::path(get, path = "/v1/jobs/{id}", operation_id = "get_job", tag = "jobs", params(("id" = Uuid, Path)),
    responses(
        (status = 200, description = "The job", body = JobResource),
        (status = 304, description = "Nothing happened since the tag in If-None-Match"),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json")))]
pub async fn get(app: App, Path(id): Path<Uuid>, headers: HeaderMap) -> Result<Response, Problem> {
    let job = app.store.job(id).await?.ok_or_else(no_such_job)?;
    let tag =
        format!("W/\"{}-{}-{}\"", job.head.last_seq, job.head.progress.passes, u8::from(job.head.cancel_requested));
    let fresh = content::none_match(&headers, &tag);
    let tag = HeaderValue::try_from(tag).map_err(|_| Problem::internal())?;
    let headers = [(header::ETAG, tag), (header::CACHE_CONTROL, HeaderValue::from_static("no-cache"))];
    Ok(if fresh {
        (StatusCode::NOT_MODIFIED, headers).into_response()
    } else {
        (headers, Json(JobResource::new(job))).into_response()
    })
}

pub fn no_such_job() -> Problem {
    Problem::not_found("there is no such job")
}

/// Stops the job within one pass; what was computed stays readable.
#[utoipa::path(post, path = "/v1/jobs/{id}/cancel", operation_id = "cancel_job", tag = "jobs", params(("id" = Uuid, Path)),
    responses(
        (status = 202, description = "The job stops, or was cancelled before; the body is the job", body = JobResource),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json"),
        (status = 409, description = "The job has finished", body = Problem, content_type = "application/problem+json")))]
pub async fn cancel(app: App, Path(id): Path<Uuid>) -> Result<Response, Problem> {
    match app.store.cancel(id).await? {
        CancelOutcome::NotFound => Err(no_such_job()),
        CancelOutcome::Finished(status) => Err(Problem::conflict(format!("the job has {}", status.name()))),
        CancelOutcome::Accepted => {
            tracing::info!(job = %id, "job cancelled");
            let job = app.store.job(id).await?.ok_or_else(no_such_job)?;
            Ok((StatusCode::ACCEPTED, Json(JobResource::new(job))).into_response())
        }
    }
}

/// Deletes the job and its artifacts; a running one stops.
#[utoipa::path(delete, path = "/v1/jobs/{id}", operation_id = "delete_job", tag = "jobs", params(("id" = Uuid, Path)),
    responses(
        (status = 204, description = "It is gone"),
        (status = 404, description = "No such job", body = Problem, content_type = "application/problem+json")))]
pub async fn delete(app: App, Path(id): Path<Uuid>) -> Result<StatusCode, Problem> {
    if !app.store.delete(id).await? {
        return Err(no_such_job());
    }
    if let Err(error) = app.artifacts.delete_job(id).await {
        // nothing points to them any more: the next start sweeps them
        tracing::warn!(%error, job = %id, "deleting files failed");
    }
    Ok(StatusCode::NO_CONTENT)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(text: &str) -> String {
        let mut hasher = blake3::Hasher::new();
        hash_canonical(&read::json::value(text.as_bytes()).unwrap(), &mut hasher);
        hasher.finalize().to_hex().to_string()
    }

    #[test]
    fn the_canonical_hash_sees_content_only() {
        let same =
            [r#"{"a":1,"b":[1,2.5,"x"]}"#, " { \"b\" : [1, 2.5, \"x\"],\n\"a\":1}", r#"{"a":1.0,"b":[1e0,2.50,"x"]}"#];
        assert!(same.iter().all(|text| hash(text) == hash(same[0])));
        let different = [
            r#"{"a":1,"b":[1,2.5]}"#,
            r#"{"a":1,"b":["1",2.5,"x"]}"#,
            r#"{"a":1,"b":[[1],2.5,"x"]}"#,
            r#"{"a":{"b":[1,2.5,"x"]}}"#,
            r#"[]"#,
            r#"{}"#,
            r#"null"#,
            r#""null""#,
        ];
        let mut hashes: Vec<String> = different.iter().chain(&same[..1]).map(|text| hash(text)).collect();
        hashes.sort();
        hashes.dedup();
        assert_eq!(hashes.len(), different.len() + 1);
    }
}

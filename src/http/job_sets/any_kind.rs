//! Requests that are alike for sets of every kind: each route finds the sets of its own kind only.

use std::collections::HashMap;

use axum::Json;
use axum::http::{HeaderMap, StatusCode, header};
use axum::response::{IntoResponse, Response};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use tokio::runtime::Handle;
use utoipa::IntoParams;
use uuid::Uuid;

use crate::document::DocumentErrors;
use crate::http::Service;
use crate::http::client::Client;
use crate::http::jobs::posted::{Body, Posted};
use crate::http::jobs::submit::{POLL_SECONDS, idempotency_key, refused, replayed};
use crate::http::limits::{off_thread, permit};
use crate::http::problem::Problem;
use crate::http::query_faults::up_to;
use crate::queue::store::*;
use crate::queue::uploaded_files::UploadedFiles;

const DEFAULT_PAGE: u32 = 20;
const MAX_PAGE: u32 = 100;

#[derive(Deserialize, IntoParams)]
#[into_params(parameter_in = Query)]
#[serde(deny_unknown_fields)]
pub struct PageQuery {
    /// Largest number of entries on a page; 20 when absent.
    #[param(minimum = 1, maximum = 100)]
    #[serde(default, deserialize_with = "up_to::<_, MAX_PAGE>")]
    limit: Option<u32>,
    /// Value of `next_cursor` of the page before.
    cursor: Option<Uuid>,
}

/// Reads the set of an id; a set of another kind is not found.
pub async fn set_of(app: &Service, kind: SetKind, id: Uuid) -> Result<JobSet, Problem> {
    let set = app.store.job_set(id).await?.filter(|set| set.kind == kind);
    set.ok_or_else(|| Problem::not_found(format!("there is no such {}", kind.noun())))
}

/// Reads the heads of a set's jobs that were not deleted, by id.
pub async fn heads_of(app: &Service, set: Uuid) -> Result<HashMap<Uuid, JobHead>, Problem> {
    Ok(app.store.jobs_of_set(set).await?.into_iter().map(|head| (head.id, head)).collect())
}

/// Reads a page of sets of a kind, newest first, with the cursor of the next page; `None` on the last one.
pub async fn page(app: &Service, kind: SetKind, query: PageQuery) -> Result<(Vec<JobSet>, Option<Uuid>), Problem> {
    let limit = query.limit.unwrap_or(DEFAULT_PAGE);
    // one more tells whether there is a next page
    let mut ids = app.store.job_sets(kind, query.cursor, limit + 1).await?;
    let more = ids.len() > limit as usize;
    ids.truncate(limit as usize);
    let next_cursor = ids.last().copied().filter(|_| more);
    let mut sets = Vec::with_capacity(ids.len());
    for id in ids {
        sets.extend(app.store.job_set(id).await?);
    }
    Ok((sets, next_cursor))
}

/// Queues the set that a request with this body asks for, with all of its jobs. `prepare` makes it of the request, with the uploaded
/// files, off the async threads; its owner, client and key are set here. Returns the set, and true if it is that of an earlier post.
pub async fn post(
    app: &Service,
    kind: SetKind,
    (client, headers, body): (Client, &HeaderMap, Body),
    prepare: impl FnOnce(Value, &UploadedFiles, &SetBounds) -> Result<NewJobSet, DocumentErrors> + Send + 'static,
) -> Result<(JobSet, bool), Problem> {
    let idempotency_key = idempotency_key(headers)?;
    let turn = permit(&app.permits.sets).await?;
    let Posted { value, hash: body_hash, held, .. } = body.read(&turn).await?;
    if app.shutdown.is_cancelled() {
        return Err(Problem::unavailable("the service is shutting down"));
    }
    // a repeated post is answered even when its files were deleted meanwhile
    if let Some(key) = &idempotency_key
        && let Some(set) = app.store.set_of_key(kind, key).await?
    {
        return if set.body_hash == body_hash {
            Ok((set, true))
        } else {
            Err(not_queued(app, kind, NotQueued::KeyReused))
        };
    }
    let (uploads, runtime) = (app.uploads.clone(), Handle::current());
    let bounds = SetBounds {
        most: app.limits.most_waiting(),
        memory_bytes: app.limits.memory_limit_bytes(),
        most_seconds: app.limits.max_seconds,
    };
    let prepared = off_thread(turn, move |cancel| {
        let files = uploads.for_document(runtime, cancel);
        prepare(value, &files, &bounds)
    });
    let new = prepared.await??;
    let (owner, client) = (app.owner.clone(), client.to_string());
    let queued = queue(app, NewJobSet { owner, idempotency_key, body_hash, client, ..new }).await;
    drop(held);
    queued
}

/// Queues a set. Returns it, and true if it is that of an earlier post.
async fn queue(app: &Service, new: NewJobSet) -> Result<(JobSet, bool), Problem> {
    let kind = new.kind;
    match app.store.submit_set(new, app.limits.most_waiting()).await? {
        Submission::New(set) => {
            tracing::info!(set = %set.id, kind = kind.name(), jobs = set.members.len(), "set of jobs queued");
            metrics::counter!("skyduct_jobs_submitted_total").increment(set.members.len() as u64);
            Ok((set, false))
        }
        Submission::Repeated(set) => Ok((set, true)),
        Submission::Refused(reason) => Err(not_queued(app, kind, reason)),
    }
}

fn not_queued(app: &Service, kind: SetKind, reason: NotQueued) -> Problem {
    refused(app, reason, &format!("another {}", kind.noun()))
}

/// Cancels all jobs of a set that have not ended, and returns the set; a problem where all have ended.
pub async fn cancel(app: &Service, kind: SetKind, id: Uuid) -> Result<JobSet, Problem> {
    let set = set_of(app, kind, id).await?;
    let cancelled = app.store.cancel_set(id).await?;
    if cancelled.is_empty() {
        return Err(Problem::conflict(format!("all jobs of the {} have ended", kind.noun())));
    }
    cancelled.into_iter().for_each(|job| app.live.forget(job));
    tracing::info!(set = %id, kind = kind.name(), "set of jobs cancelled");
    Ok(set)
}

/// Deletes a set with all of its jobs; running ones stop.
pub async fn delete(app: &Service, kind: SetKind, id: Uuid) -> Result<StatusCode, Problem> {
    set_of(app, kind, id).await?;
    app.deletion().set(id).await?;
    Ok(StatusCode::NO_CONTENT)
}

/// Answers that a set at this path is queued, or was by an earlier post.
pub fn accepted(path: String, is_replayed: bool, body: &impl Serialize) -> Response {
    let headers = [(header::LOCATION, path), (header::RETRY_AFTER, POLL_SECONDS.to_string())];
    let answer = (StatusCode::ACCEPTED, headers, Json(body)).into_response();
    if is_replayed { replayed(answer) } else { answer }
}

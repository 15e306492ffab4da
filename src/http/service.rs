//! State that all handlers share, and what the owner of a request sees of it.

use std::convert::Infallible;
use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::extract::FromRequestParts;
use axum::http::request::Parts;
use metrics_exporter_prometheus::PrometheusHandle;
use tokio_util::sync::CancellationToken;

use crate::http::access::Access;
use crate::http::event_schemas::JobEvents;
use crate::http::job_sets::resource::JobsView;
use crate::http::job_sets::set_events::SetEvents;
use crate::http::limits::{Limits, Permits};
use crate::http::readiness::Readiness;
use crate::http::studies::made::StudyFiles;
use crate::http::studies::view::StudyView;
use crate::http::watched::Watched;
use crate::present::reader::MadeYears;
use crate::queue::artifacts::Artifacts;
use crate::queue::deletion::Deletion;
use crate::queue::live::LiveJobs;
use crate::queue::owner::Owner;
use crate::queue::store::Store;
use crate::queue::uploads::Uploads;

/// State that all requests share.
pub struct Shared {
    /// Store with the jobs, sets and uploads of all owners.
    pub all: Arc<dyn Store>,
    /// Uploaded files of all owners.
    pub all_uploads: Uploads,
    pub artifacts: Artifacts,
    pub live: Arc<LiveJobs>,
    pub limits: Limits,
    pub access: Access,
    pub metrics: PrometheusHandle,
    /// Signal that ends event streams and makes the service not ready.
    pub shutdown: CancellationToken,
    pub permits: Permits,
    pub watched: Watched<JobEvents>,
    pub watched_sets: Watched<SetEvents<JobsView>>,
    pub watched_studies: Watched<SetEvents<StudyView>>,
    pub study_files: StudyFiles,
    /// Years of jobs that have ended, for their next files.
    pub years: Arc<MadeYears>,
    /// True if the last posted job found no place in the queue.
    pub queue_was_full: AtomicBool,
    /// Result of the last check that the service can write.
    pub readiness: Readiness,
}

/// Service as the owner of a request has it: nothing of other owners is found in its store and its uploads.
pub struct Service {
    pub owner: Owner,
    pub store: Arc<dyn Store>,
    pub uploads: Uploads,
    shared: Arc<Shared>,
}

impl Service {
    fn of(owner: Owner, shared: Arc<Shared>) -> Self {
        let store = shared.all.of(owner.clone());
        Self { owner, uploads: shared.all_uploads.seen_by(store.clone()), store, shared }
    }

    /// Deletion from all places where a job is kept.
    pub fn deletion(&self) -> Deletion {
        Deletion { store: self.store.clone(), artifacts: self.artifacts.clone(), live: self.live.clone() }
    }
}

impl Deref for Service {
    type Target = Shared;

    fn deref(&self) -> &Shared {
        &self.shared
    }
}

/// Service in the form in which a handler receives it. Requests have no keys yet: all are of the default owner.
pub struct App(pub Arc<Service>);

impl FromRequestParts<Arc<Shared>> for App {
    type Rejection = Infallible;

    async fn from_request_parts(_: &mut Parts, shared: &Arc<Shared>) -> Result<Self, Infallible> {
        Ok(Self(Arc::new(Service::of(Owner::default(), shared.clone()))))
    }
}

impl Deref for App {
    type Target = Arc<Service>;

    fn deref(&self) -> &Arc<Service> {
        &self.0
    }
}

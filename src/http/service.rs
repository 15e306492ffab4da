//! State that all handlers share.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use axum::extract::State;
use metrics_exporter_prometheus::PrometheusHandle;
use tokio_util::sync::CancellationToken;

use crate::http::access::Access;
use crate::http::event_schemas::JobEvents;
use crate::http::limits::{Limits, Permits};
use crate::http::readiness::Readiness;
use crate::http::studies::made::StudyFiles;
use crate::http::studies::watched::StudyEvents;
use crate::http::watched::Watched;
use crate::queue::artifacts::Artifacts;
use crate::queue::deletion::Deletion;
use crate::queue::live::LiveJobs;
use crate::queue::meshes::Meshes;
use crate::queue::store::Store;

/// State that any handler may need.
pub struct Service {
    pub store: Arc<dyn Store>,
    pub artifacts: Artifacts,
    pub meshes: Meshes,
    pub live: Arc<LiveJobs>,
    pub limits: Limits,
    pub access: Access,
    pub metrics: PrometheusHandle,
    /// Signal that ends event streams and makes the service not ready.
    pub shutdown: CancellationToken,
    pub permits: Permits,
    pub watched: Watched<JobEvents>,
    pub watched_studies: Watched<StudyEvents>,
    pub study_files: StudyFiles,
    /// True if the last posted job found no place in the queue.
    pub queue_was_full: AtomicBool,
    /// Result of the last check that the service can write.
    pub readiness: Readiness,
}

impl Service {
    /// Deletion from all places where a job is kept.
    pub fn deletion(&self) -> Deletion<'_> {
        Deletion { store: self.store.as_ref(), artifacts: &self.artifacts, live: &self.live }
    }
}

/// Shared state in the form in which a handler receives it.
pub type App = State<Arc<Service>>;

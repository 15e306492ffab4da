//! The HTTP interface: what a request means, and how answers look.

pub mod access;
pub mod content;
pub mod cors;
pub mod event_schemas;
pub mod events;
pub mod formats;
pub mod health;
pub mod jobs;
pub mod limits;
pub mod meshes;
pub mod openapi;
pub mod outlive;
pub mod problem;
pub mod problem_kind;
pub mod results;
pub mod router;
pub mod server;
pub mod skies;
pub mod tubes;
pub mod watched;

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio_util::sync::CancellationToken;

use crate::job::artifacts::Artifacts;
use crate::job::live::LiveJobs;
use crate::job::meshes::Meshes;
use crate::job::store::Store;

pub use access::Access;
pub use limits::{Limits, Permits};
pub use router::router;
pub use watched::WatchedJobs;

/// State that every handler may need.
pub struct Service {
    pub store: Arc<dyn Store>,
    pub artifacts: Artifacts,
    pub meshes: Meshes,
    pub live: Arc<LiveJobs>,
    pub limits: Limits,
    pub access: Access,
    pub metrics: PrometheusHandle,
    /// Ends event streams and makes the service not ready.
    pub shutdown: CancellationToken,
    pub permits: Permits,
    pub watched: WatchedJobs,
    /// The last look at whether the service can write.
    pub readiness: health::Readiness,
}

pub type App = axum::extract::State<Arc<Service>>;

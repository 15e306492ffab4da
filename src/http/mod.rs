//! The HTTP interface: what a request means, and how answers look.

pub mod content;
pub mod event_schemas;
pub mod events;
pub mod health;
pub mod jobs;
pub mod limits;
pub mod meshes;
pub mod openapi;
pub mod problem;
pub mod results;
pub mod router;
pub mod server;
pub mod skies;
pub mod tubes;

use std::sync::Arc;

use metrics_exporter_prometheus::PrometheusHandle;
use tokio::sync::Semaphore;
use tokio_util::sync::CancellationToken;

use crate::job::artifacts::Artifacts;
use crate::job::live::LiveJobs;
use crate::job::store::Store;

pub use limits::Limits;
pub use router::router;

/// What every handler may need.
pub struct Service {
    pub store: Arc<dyn Store>,
    pub artifacts: Artifacts,
    pub live: Arc<LiveJobs>,
    pub limits: Limits,
    pub metrics: PrometheusHandle,
    /// Ends event streams and makes the service not ready.
    pub shutdown: CancellationToken,
    /// Documents that are prepared at the same time: each can hold meshes.
    pub preparing: Semaphore,
}

pub type App = axum::extract::State<Arc<Service>>;

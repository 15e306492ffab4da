//! The HTTP interface: what a request means, and how answers look.

pub mod access;
pub mod content;
pub mod cors;
pub mod description;
pub mod docs;
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
pub mod problem_page;
mod reader;
pub mod readiness;
pub mod results;
pub mod router;
pub mod server;
pub mod service;
pub mod skies;
pub mod tubes;
pub mod watched;

pub use access::Access;
pub use limits::{Limits, Permits};
pub use readiness::Readiness;
pub use router::router;
pub use service::{App, Service};
pub use watched::WatchedJobs;

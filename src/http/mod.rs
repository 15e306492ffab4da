//! The HTTP interface: what a request means, and how answers look.

mod access;
mod content;
mod convergence;
pub(crate) mod cors;
mod description;
mod docs;
mod event_schemas;
mod events;
mod formats;
mod health;
mod jobs;
pub mod last_event_id;
mod limits;
mod meshes;
pub mod openapi;
mod outlive;
mod page;
mod prefer;
mod problem;
pub mod problem_kind;
mod problem_page;
mod reader;
mod readiness;
mod results;
mod router;
pub(crate) mod server;
mod service;
mod skies;
mod tubes;
mod watched;

pub(crate) use access::Access;
pub(crate) use limits::{Limits, Permits};
pub(crate) use readiness::Readiness;
pub(crate) use router::router;
pub(crate) use service::{App, Service};
pub(crate) use watched::WatchedJobs;

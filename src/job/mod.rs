//! Jobs: the pass loop, chunks of passes, progress, checkpoints, and the trait that the store implements.

pub(crate) mod artifacts;
pub mod cancel;
pub mod checkpoint;
pub mod chunk;
pub mod convergence;
pub mod convergence_files;
mod engine;
pub mod events;
pub(crate) mod grid_figure;
pub(crate) mod live;
pub(crate) mod memory;
pub(crate) mod meshes;
pub(crate) mod ownership;
pub mod prepare;
pub mod progress;
mod ranges;
pub mod records;
pub(crate) mod results;
pub(crate) mod site_figure;
pub mod store;
pub(crate) mod subject;
mod tube_figure;
pub(crate) mod tube_flux;
mod tube_report;
pub(crate) mod view_figure;
pub(crate) mod worker;

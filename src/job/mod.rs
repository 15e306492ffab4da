//! Jobs: the pass loop, chunks of passes, progress, checkpoints, and the trait that the store implements.

pub mod artifacts;
pub mod cancel;
pub mod checkpoint;
pub mod chunk;
pub mod convergence;
mod engine;
pub mod live;
pub mod memory;
pub mod meshes;
pub mod ownership;
pub mod prepare;
pub mod progress;
mod ranges;
pub mod results;
pub mod store;
mod tube_report;
pub mod worker;

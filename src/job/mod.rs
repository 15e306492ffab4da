//! Jobs: the pass loop, chunks of passes, progress, checkpoints, and the trait that the store implements.

pub mod artifacts;
pub mod cancel;
pub mod checkpoint;
pub mod convergence;
pub mod live;
pub mod memory;
pub mod meshes;
pub mod ownership;
pub mod results;
pub mod run;
pub mod store;
mod tube_report;
pub mod worker;

//! Jobs: the pass loop, chunks of passes, progress, checkpoints, and the trait that the store implements.

pub mod run;
pub mod store;

//! Rendering of a job: its preparation, its passes in order, those that are computed ahead, and checkpoints.

pub mod ahead;
pub(crate) mod annual;
pub mod cancel;
pub mod checkpoint;
pub mod convergence;
pub(crate) mod integrators;
pub(crate) mod memory;
pub mod passes;
pub mod prepare;
pub mod progress;
pub mod spent;

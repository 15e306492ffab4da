//! Jobs: posted, planned, listed, shown, cancelled, deleted.

pub mod change;
pub mod plan;
pub mod posted;
pub mod resource;
pub mod show;
pub mod submit;
mod waited;

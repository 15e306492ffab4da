//! Sets of jobs: posted, read, followed, cancelled and deleted together.

pub mod any_kind;
pub mod change;
pub mod events;
pub mod followed;
pub mod request;
pub mod resource;
pub mod set_events;
pub mod show;
pub mod submit;

//! Studies: posted, listed, looked at, followed, cancelled, deleted. Their jobs are jobs like all others.

pub mod change;
mod evaluate;
pub mod events;
mod part;
mod reader;
pub mod resource;
pub mod show;
pub mod submit;
pub mod watched;

//! Studies: posted, listed, looked at, cancelled, deleted. Their jobs are jobs like all others.

pub mod change;
mod evaluate;
mod part;
pub mod resource;
pub mod show;
pub mod submit;

//! Studies: posted, listed, shown, followed, cancelled, deleted. Their jobs are jobs like all others.

pub mod change;
mod evaluate;
pub mod events;
mod looked;
pub mod made;
mod pictures;
pub mod resource;
pub mod show;
pub mod submit;
pub mod view;

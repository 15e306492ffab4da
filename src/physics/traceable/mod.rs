//! The scene as the integrators trace it: guides built, surfaces numbered, boxes in their own frames.

mod block;
mod box_bounds;
mod box_object;
pub mod enclosure;
pub mod luminaire;
mod mesh_bounds;
pub mod mesh_objects;
mod mirror_path;
mod mirrors;
pub mod obstacles;
mod occupied;
mod openings;
mod rays;
mod scene;
pub mod solids;
mod source;
mod surface_id;
mod surface_point;
#[cfg(test)]
pub(crate) mod test_rooms;
mod tube;
mod visibility;

pub use box_object::TraceableBox;
pub use mirror_path::MirrorPath;
pub use mirrors::Mirrors;
pub use occupied::{OccupiedParts, solids_around};
pub use openings::{Openings, opening_weight};
pub use rays::{Place, RoomHit};
pub use scene::{Follow, TraceableScene};
pub use source::Source;
pub use surface_id::{Numbering, RoomObject, Side, SurfaceId};
pub use surface_point::SurfacePoint;
pub use tube::{TraceableTube, TubeError, cylinder_guide};

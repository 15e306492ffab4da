//! Geometry: closed forms, skew rays in cylinders, triangles, the BVH, OBJ files.

pub mod bvh;
pub mod coincident;
mod collapse;
mod convex;
pub mod covered;
pub mod cylinder;
pub mod disc;
pub mod encoding;
pub mod facets;
pub mod lambert;
pub(crate) mod lanes;
pub mod merging;
pub mod obj;
pub mod opening_frame;
pub mod placement;
pub mod planar;
pub mod polygon;
pub mod rectangle;
pub mod repeats;
pub mod section;
pub mod sheets;
mod statements;
pub(crate) mod tree_ray;
pub mod triangle;
mod triangle_mesh;
pub mod turn;
pub mod welded;
mod wide_tree;

pub use opening_frame::OpeningFrame;
pub use triangle_mesh::{Dropped, TriangleMesh};

//! Geometry: closed forms, skew rays in cylinders, triangles, the BVH, OBJ files.

pub mod bvh;
mod collapse;
pub mod covered;
pub mod cylinder;
pub mod disc;
pub mod encoding;
pub mod facets;
pub mod lambert;
pub(crate) mod lanes;
pub(crate) mod numbers;
pub mod obj;
pub mod polygon;
pub mod rectangle;
pub mod section;
mod statements;
pub(crate) mod tree_ray;
pub mod triangle;
mod triangle_mesh;
pub mod turn;
pub mod welded;
mod wide_tree;

pub use triangle_mesh::{Dropped, TriangleMesh};

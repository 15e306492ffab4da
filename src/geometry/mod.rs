//! Geometry: closed forms, skew rays in cylinders, triangles, the BVH, OBJ files.

pub mod bvh;
pub mod cylinder;
pub mod disc;
pub mod lambert;
pub mod obj;
pub mod polygon;
pub mod triangle;

pub use obj::TriangleMesh;

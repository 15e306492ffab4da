//! Geometry: closed forms, skew rays in cylinders, triangles, the BVH, OBJ files.

pub mod cylinder;
pub mod disc;
pub mod obj;
pub mod polygon;

pub use obj::TriangleMesh;

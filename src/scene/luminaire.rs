//! Electric light.

use glam::DVec3;

/// A thin black rectangle that emits Lambertian light on the side of `edge_u` x `edge_v`; the other side is dark.
///
/// It occludes and absorbs what meets it from either side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Luminaire {
    pub corner: DVec3,
    pub edge_u: DVec3,
    /// At a right angle to `edge_u`.
    pub edge_v: DVec3,
    /// Linear Rec.709 in cd/m2, equal in all three for a photopic scene.
    pub luminance: [f64; 3],
}

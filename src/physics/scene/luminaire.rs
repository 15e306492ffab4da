//! Electric luminaires.

use glam::DVec3;

/// A thin black rectangle that emits Lambertian light on the side of `edge_u` x `edge_v`; the other side is dark.
///
/// The rectangle occludes, and absorbs light that meets it from either side.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Luminaire {
    /// Corner from which both edges start, in m.
    pub corner: DVec3,
    /// First edge in m.
    pub edge_u: DVec3,
    /// Second edge, at a right angle to `edge_u`.
    pub edge_v: DVec3,
    /// Luminance of the emitting side in cd/m2, linear Rec.709; equal in all three channels for a photopic scene.
    pub luminance: [f64; 3],
}

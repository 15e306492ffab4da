//! What every finite scattering distribution answers.

use glam::DVec3;

/// A bidirectional scattering distribution that is finite in every direction, at a surface or a diffuser.
pub trait FiniteBsdf: std::fmt::Debug + Sync {
    /// BSDF times |cosine| of `outward`, per sr and channel (linear Rec.709).
    ///
    /// `incident` is the direction of travel of the light that arrives, `outward` that of the light that leaves, `normal`
    /// points to the side on which it leaves; all unit vectors. Zero where `outward` is on the other side.
    fn bsdf_cosine(&self, normal: DVec3, incident: DVec3, outward: DVec3) -> [f64; 3];
}

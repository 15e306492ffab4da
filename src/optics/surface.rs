//! Room surfaces.

/// A diffuse (Lambertian) surface; `reflectance` is linear Rec.709 in 0..1, equal in all three for a photopic scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    pub reflectance: [f64; 3],
}

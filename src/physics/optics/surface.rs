//! Room surfaces.

/// A surface that reflects diffusely (Lambertian) and, beside that, about the mirror direction.
///
/// Reflectances are linear Rec.709 in 0..1, equal in all three channels for a photopic scene; their sum is < 1 in each.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Diffuse reflectance.
    pub reflectance: [f64; 3],
    /// Mirror or lobe; `None` where all reflection is diffuse.
    pub specular: Option<Specular>,
}

impl Surface {
    /// Builds a Lambertian surface.
    pub fn diffuse(reflectance: [f64; 3]) -> Self {
        Self { reflectance, specular: None }
    }

    /// Returns diffuse and specular reflectance together, per channel.
    pub fn albedo(&self) -> [f64; 3] {
        let specular = self.specular.map_or([0.0; 3], |specular| specular.reflectance);
        std::array::from_fn(|channel| self.reflectance[channel] + specular[channel])
    }
}

/// Reflection about the mirror direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specular {
    /// Directional-hemispherical reflectance, the same at every angle.
    pub reflectance: [f64; 3],
    /// Roughness: 0 is an ideal mirror; from [`LEAST_ROUGHNESS`](super::glossy::LEAST_ROUGHNESS) to 1, a lobe of alpha = roughness^2.
    pub roughness: f64,
}

//! Collectors: covers of the upper end of a tube.

/// The cover of a tube's upper end.
///
/// Coefficients are linear Rec.709 (one number three times in a photopic scene), each in 0..=1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Collector {
    /// No cover: light enters unchanged.
    Open,
    /// A flat pane across the end of the tube; direction unchanged.
    Flat {
        /// Fraction that passes, at every angle.
        transmittance: [f64; 3],
    },
    /// A thin hemisphere over the end of the tube; direction unchanged.
    ///
    /// Rays are not bent, so a dome concentric with the aperture gathers exactly the light that a flat pane would: each
    /// ray that reaches the aperture from outside crosses the shell once.
    Dome {
        /// Fraction that passes, at every angle.
        transmittance: [f64; 3],
    },
    /// A hemispherical shell, concentric with the end of the tube, whose inner radius is the tube's; light is traced
    /// through it (see [`crate::guide::dome`]).
    DielectricDome {
        /// Refractive index of the shell, at least 1.
        refractive_index: f64,
        /// Thickness of the shell in m, > 0.
        thickness_m: f64,
        /// Napierian absorption coefficient per m: after a path of s metres the fraction exp(-absorption s) is left.
        absorption_per_m: f64,
    },
}

impl Collector {
    /// True if the collector reflects light that comes up the tube down again.
    pub fn reflects(&self) -> bool {
        matches!(*self, Self::DielectricDome { refractive_index, .. } if refractive_index != 1.0)
    }

    /// Returns the fraction of the light that passes from outside to the aperture, per channel; 1 for a shell that is traced.
    pub fn transmittance(&self) -> [f64; 3] {
        match *self {
            Self::Open | Self::DielectricDome { .. } => [1.0; 3],
            Self::Flat { transmittance } | Self::Dome { transmittance } => transmittance,
        }
    }
}

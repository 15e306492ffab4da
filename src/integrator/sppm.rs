//! Stochastic progressive photon mapping with a fixed radius schedule.

/// Settings of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Photons emitted per pass, all tubes and sources together; 64..=16_777_216.
    pub photons_per_pass: u64,
    /// Gather radius of the first pass in metres; `None`: a twentieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// The squared radius shrinks by (i + alpha) / (i + 1) from pass i to i + 1; 0 < alpha < 1.
    pub alpha: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: 65_536, initial_radius_m: None, alpha: 2.0 / 3.0 }
    }
}

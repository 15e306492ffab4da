//! Settings of the two-stage method.

/// Settings of the two-stage method.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of photons from sky and sun per pass, all tubes together; 64..=16_777_216; `None`: by the requested accuracy, or with views
    /// by their pixels, 8192 to 65 536.
    pub photons_per_pass: Option<u64>,
    /// Number of backward paths per sensor and pass; 1..=65_536; `None`: by the requested accuracy.
    pub samples_per_sensor: Option<u32>,
    /// Number of backward paths per pixel and pass; 1..=4_096.
    pub samples_per_pixel: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: None, samples_per_sensor: None, samples_per_pixel: 8 }
    }
}

//! Light tracing.

/// Settings of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Photons emitted per pass, all tubes and sources together; 64..=16_777_216.
    pub photons_per_pass: u64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: 16_384 }
    }
}

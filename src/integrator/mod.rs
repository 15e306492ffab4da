//! Integrators: one pass, its settings, its state.

pub mod light_tracing;
pub mod sppm;

/// The methods that compute passes, with their settings: the registry.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    LightTracing(light_tracing::Settings),
    Sppm(sppm::Settings),
}

impl Method {
    /// The name in documents and results.
    pub fn name(&self) -> &'static str {
        match self {
            Self::LightTracing(_) => "light_tracing",
            Self::Sppm(_) => "sppm",
        }
    }
}

//! The methods that there are, with their settings.

use super::{bidirectional, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage};
use crate::analytic::jenkins;

/// The methods that compute passes, or the result at once, with their settings: the registry.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    LightTracing(light_tracing::Settings),
    Ppm(ppm::Settings),
    Sppm(sppm::Settings),
    PathTracing(path_tracing::Settings),
    Bidirectional(bidirectional::Settings),
    PhotonMapping(photon_mapping::Settings),
    TwoStage(two_stage::Settings),
    /// The method of HOLIGILM: solved in one computation, without passes.
    Holigilm,
    /// The formula of Jenkins, Muneer and Kubie: solved in one computation, without passes.
    Jenkins(jenkins::Settings),
}

impl Method {
    /// The name in documents and results.
    pub fn name(&self) -> &'static str {
        match self {
            Self::LightTracing(_) => "light_tracing",
            Self::Ppm(_) => "ppm",
            Self::Sppm(_) => "sppm",
            Self::PathTracing(_) => "path_tracing",
            Self::Bidirectional(_) => "bidirectional_path_tracing",
            Self::PhotonMapping(_) => "photon_mapping",
            Self::TwoStage(_) => "two_stage",
            Self::Holigilm => "holigilm",
            Self::Jenkins(_) => "jenkins",
        }
    }

    /// True if light is followed from its sources to its end, so that the balance of energy is known.
    pub fn knows_energy(&self) -> bool {
        !matches!(self, Self::PathTracing(_) | Self::TwoStage(_))
    }

    /// True if one computation gives the result, without passes.
    pub fn is_deterministic(&self) -> bool {
        matches!(self, Self::Holigilm | Self::Jenkins(_))
    }
}

//! The methods that there are, with their settings: one line each in the list and in the match.
//!
//! What they can do is asked of their settings; nobody else matches on the set of methods.

use super::method::Described;
use super::{bidirectional, holigilm, jenkins, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage};

/// A method with its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// Photons, connected to sensors.
    LightTracing(light_tracing::Settings),
    /// Progressive photon mapping with points that stay.
    Ppm(ppm::Settings),
    /// Progressive photon mapping with points that are new in every pass.
    Sppm(sppm::Settings),
    /// Paths from sensors and the eye.
    PathTracing(path_tracing::Settings),
    /// Paths from both sides.
    Bidirectional(bidirectional::Settings),
    /// Photon maps of one radius, with final gathering.
    PhotonMapping(photon_mapping::Settings),
    /// Photons to the diffusers, paths from there on.
    TwoStage(two_stage::Settings),
    /// The solver after HOLIGILM.
    Holigilm(holigilm::Settings),
    /// The formula of Jenkins, Muneer and Kubie.
    Jenkins(jenkins::Settings),
}

impl Method {
    /// What the rest of the program has to know of the method.
    pub fn described(&self) -> &dyn Described {
        match self {
            Self::LightTracing(settings) => settings,
            Self::Ppm(settings) => settings,
            Self::Sppm(settings) => settings,
            Self::PathTracing(settings) => settings,
            Self::Bidirectional(settings) => settings,
            Self::PhotonMapping(settings) => settings,
            Self::TwoStage(settings) => settings,
            Self::Holigilm(settings) => settings,
            Self::Jenkins(settings) => settings,
        }
    }

    /// Name of the method in documents and results.
    pub fn name(&self) -> &'static str {
        self.described().name()
    }
}

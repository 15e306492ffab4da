//! List of all methods with their settings: one line each in the enumeration and in the match.
//!
//! Their capabilities are read from their settings; no other code matches on the set of methods.

use super::method::Described;
use super::{bidirectional, holigilm, jenkins, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage};

/// Method with its settings.
#[derive(Clone, Debug, PartialEq)]
pub enum Method {
    /// Photons that are connected to sensors.
    LightTracing(light_tracing::Settings),
    /// Progressive photon mapping with points that stay.
    Ppm(ppm::Settings),
    /// Progressive photon mapping with points that are new in every pass.
    Sppm(sppm::Settings),
    /// Paths from sensors and the eye.
    PathTracing(path_tracing::Settings),
    /// Bidirectional paths, from the light and from the eye or the sensors.
    Bidirectional(bidirectional::Settings),
    /// Photon maps of one radius, with final gathering.
    PhotonMapping(photon_mapping::Settings),
    /// Photons down to the diffusers, paths through the room.
    TwoStage(two_stage::Settings),
    /// Solver after HOLIGILM.
    Holigilm(holigilm::Settings),
    /// Formula of Jenkins, Muneer and Kubie.
    Jenkins(jenkins::Settings),
}

impl Method {
    /// Returns the settings behind the interface that the rest of the program uses.
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

    /// Returns the name of the method in documents and results.
    pub fn name(&self) -> &'static str {
        self.described().name()
    }
}

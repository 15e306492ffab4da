//! Integrators: one pass, its settings, its state.
//!
//! A pass is a pure function of (scene, settings, seed, pass number): it can be computed anywhere, in any order, and has
//! the same bits on any number of threads. Passes are independent replicates; `estimate` adds them up. With statistics per
//! point (`photon_map::progressive`) a pass depends on what those before it have left, too, and the order is theirs.

pub mod backward;
pub mod bidirectional;
pub mod deterministic;
pub mod light_tracing;
pub mod path_tracing;
pub mod photon;
pub mod photon_map;
pub mod photon_mapping;
pub mod ppm;
pub mod sppm;
pub mod two_stage;

use std::sync::atomic::AtomicBool;

use photon::path::Account;
use photon_map::progressive::Carried;

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
    /// At once.
    Holigilm,
    /// At once.
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

    /// Whether light is followed from its sources to its end, so that the balance of energy is known.
    pub fn knows_energy(&self) -> bool {
        !matches!(self, Self::PathTracing(_) | Self::TwoStage(_))
    }

    /// Whether one computation gives the result, without passes.
    pub fn is_deterministic(&self) -> bool {
        matches!(self, Self::Holigilm | Self::Jenkins(_))
    }
}

/// One pass of one method.
pub trait Integrator: Send + Sync {
    /// Computes pass `pass` (0, 1, ...) on the current rayon pool, with statistics per point as if none had been before;
    /// `None` when `cancel` was raised meanwhile.
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass>;

    /// What there is before the first pass, in the shape of one: what it starts from, and zeros where points tell their
    /// sampling error; the rest is empty.
    fn start(&self) -> Pass {
        Pass::default()
    }

    /// Computes pass `pass` after those that left `before`, nothing before the first.
    fn pass_after(&self, pass: u64, _before: &Carried, cancel: &AtomicBool) -> Option<Pass> {
        self.pass(pass, cancel)
    }
}

/// What one pass gives: a replicate of every output.
#[derive(Clone, Debug, Default)]
pub struct Pass {
    pub grids: Vec<GridPass>,
    pub views: Vec<ViewPass>,
    pub account: Account,
    pub photons: u64,
    /// For the next pass; empty where passes are independent.
    pub carried: Carried,
}

/// Illuminance in lux per sensor.
#[derive(Clone, Debug, Default)]
pub struct GridPass {
    pub illuminance: Vec<f64>,
    /// Estimated bias per sensor; empty when the method has none.
    pub bias: Vec<f64>,
    /// Where points are the same in every pass: contrasts among those of each sensor, equally many for each, whose squares
    /// add up to the variance of their choice; else empty.
    pub contrasts: Vec<f64>,
}

/// Luminance in cd/m2 per pixel, top row first.
#[derive(Clone, Debug, Default)]
pub struct ViewPass {
    /// Channels interleaved.
    pub luminance: Vec<f64>,
    /// Estimated bias of the luminance Y per pixel; empty when the method has none.
    pub bias: Vec<f64>,
    /// As [`GridPass::contrasts`], of the luminance Y of pixels.
    pub contrasts: Vec<f64>,
}

//! Photons on the floor of the room, direct light included, as in the thesis' photon map.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;
use serde_json::Value;

use crate::page::ReportError;
use crate::run::compile;
use skyduct::integrator::photon::emission::Emission;
use skyduct::integrator::photon::energy_balance::PhotonTotals;
use skyduct::integrator::photon::events::{Flight, Origin, Scattering, Visitor};
use skyduct::integrator::photon::path::trace;
use skyduct::integrator::photon_map::grid::Photon;
use skyduct::optics::Spectrum;
use skyduct::sampling::{Key, PathSamples, Stream};
use skyduct::scene::Face;
use skyduct::traceable::{SurfaceId, TraceableScene};

/// Number of photons that one task traces: fixed, so that their order is the same on any number of threads.
const CHUNK: u64 = 1024;

const FLOOR: SurfaceId = SurfaceId::of_face(Face::Floor);

/// Room whose photons on the floor are collected.
pub struct FloorPhotons {
    pub traceable: TraceableScene,
    emission: Emission,
    key: Key,
}

impl FloorPhotons {
    pub fn new(document: &Value, photons_per_pass: u64, seed: u64) -> Result<Self, ReportError> {
        let (_, traceable) = compile(document, Path::new(""))?;
        Ok(Self { emission: Emission::new(&traceable, photons_per_pass), key: Key::new(seed), traceable })
    }

    /// Traces a pass and returns the photons that arrive on the floor; the flux of a pass is that of the scene.
    pub fn pass(&self, number: u64) -> Vec<Photon<1>> {
        let (photons, key) = (self.emission.photons(), self.key.stream(Stream::Pass, number));
        let chunks: Vec<Vec<Photon<1>>> = (0..photons.div_ceil(CHUNK))
            .into_par_iter()
            .map(|chunk| {
                let mut floor = Floor(Vec::new());
                let mut totals = PhotonTotals::new(self.traceable.tubes.len());
                for number in chunk * CHUNK..((chunk + 1) * CHUNK).min(photons) {
                    let (photon, mut samples) = self.emission.photon(&self.traceable, key, number);
                    if let Some(photon) = photon {
                        trace::<1>(&self.traceable, &photon, &mut samples, &mut floor, &mut totals);
                    }
                }
                floor.0
            })
            .collect();
        chunks.into_iter().flatten().collect()
    }
}

struct Floor(Vec<Photon<1>>);

impl Visitor<1> for Floor {
    fn scattered(&mut self, _: &Scattering<'_, 1>, _: &mut PathSamples) {}

    fn emitted(&mut self, _: &Scattering<'_, 1>, _: &mut PathSamples) {}

    fn flew(&mut self, _: &Flight<1>) {}

    fn arrived(&mut self, surface: SurfaceId, position: DVec3, flux: Spectrum<1>, _: Origin) {
        if surface == FLOOR {
            self.0.push(Photon { position, on: surface, flux });
        }
    }
}

//! Light tracing where closures are Lambertian in part: their Lambertian light is collected, not followed, and the rest is traced as usual.

use std::ops::Range;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use crate::integrator::GridPass;
use crate::integrator::light_tracing::{LightTracing, SensorTally};
use crate::integrator::method::Task;
use crate::integrator::photon::chunks::{self, Chunks, fold_chunks};
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::integrator::photon::events::{Flight, Origin, Scattering, Visitor};
use crate::integrator::photon::path::trace_directional;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Stream};
use crate::scene::Grid;
use crate::traceable::SurfaceId;

/// Light of sky and sun of a scene whose closures are Lambertian in part.
#[derive(Debug)]
pub struct DirectionalPart<const C: usize>(LightTracing<C>);

/// Photon that leaves a closure as from a Lambertian surface: its place in m, and its flux in lm.
pub type LambertianExit<const C: usize> = (DVec3, Spectrum<C>);

/// Light of one pass.
#[derive(Debug)]
pub struct DirectionalPass<const C: usize> {
    /// Lambertian light that leaves each closure, by tubes.
    pub lambertian: Vec<Vec<LambertianExit<C>>>,
    /// Values that all other light adds to the grids.
    pub grids: Vec<GridPass>,
    /// Fluxes of the tubes, and the energy balance of all light except the Lambertian light in the room.
    pub totals: PhotonTotals,
}

impl<const C: usize> DirectionalPart<C> {
    /// Divides the photons of a pass for a relative standard error among sky and sun of the tubes; equal seeds give equal bits.
    pub fn new(task: &Task, grids: &[Grid], photons: (u64, f64), seed: u64) -> Self {
        // here a Lambertian closure sends no light straight to sensors, except light of the room that has come back to it
        let straight = task.traceable.tubes.iter().any(|tube| tube.diffuser.measured().is_some());
        Self(LightTracing::directional(task, grids, photons, straight, seed))
    }

    /// Returns zeros for the contrasts of each grid.
    pub fn no_contrasts(&self) -> Vec<Vec<f64>> {
        self.0.no_contrasts()
    }

    /// Returns the number of photons per pass.
    pub fn photons(&self) -> u64 {
        self.0.emission.photons()
    }

    /// Computes one pass with this key, that of a two-stage method; `None` when cancelled.
    pub fn pass(&self, key: Key, cancel: &AtomicBool) -> Option<DirectionalPass<C>> {
        let Self(method) = self;
        let mut lux = vec![0.0; method.sensor_count()];
        let mut connected = vec![0; method.planes()];
        let mut totals = PhotonTotals::new(method.scene.tubes.len());
        let mut lambertian = vec![Vec::new(); method.scene.tubes.len()];
        let chunk = |numbers: Range<u64>| self.photons_of(key, numbers);
        let chunk_bytes = 8 * lux.len() as u64;
        let folded = fold_chunks(
            Chunks::of_long_paths(self.photons()),
            chunk_bytes,
            cancel,
            chunk,
            |sums: DirectionalSums<C>| {
                lux.iter_mut().zip(&sums.lux).for_each(|(sum, value)| *sum += value);
                connected.iter_mut().zip(&sums.connected).for_each(|(sum, number)| *sum += number);
                totals.add(&sums.totals);
                lambertian
                    .iter_mut()
                    .zip(sums.lambertian)
                    .for_each(|(all, of_chunk): (&mut Vec<_>, _)| all.extend(of_chunk));
            },
        )?;
        totals.not_finite = folded.not_finite;
        let flux = totals.tubes.iter().map(|tube| tube.into_room - tube.evenly).sum::<f64>();
        let counts = method.counts(&lux, &connected, flux.max(0.0));
        let stream = |sensor: u64| key.stream(Stream::UnscatteredTwoStage, sensor);
        totals.rays += method.add_unscattered(stream, cancel, &mut lux)?;
        Some(DirectionalPass { lambertian, grids: method.by_grids(&lux, &counts), totals })
    }

    /// Traces the photons of a pass with these numbers.
    fn photons_of(&self, pass: Key, numbers: Range<u64>) -> DirectionalSums<C> {
        let Self(method) = self;
        let lambertian = vec![Vec::new(); method.scene.tubes.len()];
        let mut listener = Listener { tally: method.tally(), lambertian };
        let mut totals = PhotonTotals::new(method.scene.tubes.len());
        for number in numbers {
            let (photon, mut samples) = method.emission.photon(&method.scene, pass, number);
            if let Some(photon) = photon {
                listener.tally.begin(&photon);
                trace_directional::<C>(&method.scene, &photon, &mut samples, &mut listener, &mut totals);
            }
        }
        DirectionalSums {
            lux: listener.tally.lux,
            connected: listener.tally.connected,
            lambertian: listener.lambertian,
            totals,
        }
    }
}

/// Sums over some photons of a pass.
struct DirectionalSums<const C: usize> {
    /// Illuminance of all sensors in lx.
    lux: Vec<f64>,
    /// Number of photons that were connected to all sensors of a plane, for each plane.
    connected: Vec<u64>,
    lambertian: Vec<Vec<LambertianExit<C>>>,
    totals: PhotonTotals,
}

impl<const C: usize> chunks::Tally for DirectionalSums<C> {
    fn is_finite(&self) -> bool {
        let is_finite = |(position, flux): &LambertianExit<C>| position.is_finite() && flux.is_finite();
        let lambertian = self.lambertian.iter().flatten().all(is_finite);
        lambertian && self.lux.iter().all(|lux| lux.is_finite()) && self.totals.is_finite()
    }
}

/// Visitor that collects the Lambertian light of closures, and passes all other events to the tally.
struct Listener<'a, const C: usize> {
    tally: SensorTally<'a>,
    lambertian: Vec<Vec<LambertianExit<C>>>,
}

impl<const C: usize> Visitor<C> for Listener<'_, C> {
    fn scattered(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples) {
        self.tally.scattered(scattering, samples);
    }

    fn emitted(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples) {
        self.tally.emitted(scattering, samples);
    }

    fn flew(&mut self, flight: &Flight<C>) {
        self.tally.flew(flight);
    }

    fn lambertian_exit(&mut self, tube: usize, position: DVec3, flux: Spectrum<C>) {
        self.lambertian[tube].push((position, flux));
    }

    fn arrived(&mut self, _: SurfaceId, _: DVec3, _: Spectrum<C>, _: Origin) {}
}

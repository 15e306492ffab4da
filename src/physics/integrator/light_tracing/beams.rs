//! Direct light that cells receive through clear closures: rays down the tubes, which are followed only up to their first flight in the
//! room.

use std::ops::Range;
use std::sync::atomic::AtomicBool;

use crate::guide::RayCount;
use crate::integrator::photon::chunks::{self, Chunks, fold_chunks};
use crate::integrator::photon::connect::SensorPlane;
use crate::integrator::photon::descent::{Entering, descend};
use crate::integrator::photon::emission::{Emission, EmittedPhoton, Start};
use crate::integrator::photon::energy_balance::EnergyBalance;
use crate::sampling::Key;
use crate::traceable::TraceableScene;

/// Number of rays through clear closures for each photon. Cells count only their first flight: each takes a third of the time of a photon
/// of the thesis room, and much less of that where photons are connected to many sensors.
pub const BEAMS_PER_PHOTON: u64 = 16;

/// Illuminance of cells by some rays through clear closures.
struct BeamSums {
    /// Illuminance per sensor in lx.
    lux: Vec<f64>,
    rays: RayCount,
}

impl chunks::Tally for BeamSums {
    fn is_finite(&self) -> bool {
        self.lux.iter().all(|sum| sum.is_finite())
    }
}

/// Adds the direct light that cells receive through clear closures, by rays down the tubes; returns the number of rays, or `None` when
/// cancelled.
pub fn add_beams<const C: usize>(
    (scene, sensors): (&TraceableScene, &[SensorPlane]),
    beams: &Emission,
    key: Key,
    cancel: &AtomicBool,
    lux: &mut [f64],
) -> Option<RayCount> {
    let chunk = |numbers: Range<u64>| {
        let mut sums = BeamSums { lux: vec![0.0; lux.len()], rays: RayCount::default() };
        sums.rays = add_some_beams::<C>((scene, sensors), (beams, numbers), key, &mut sums.lux);
        sums
    };
    let mut rays = RayCount::default();
    let chunks = Chunks::of_short_paths(beams.photons());
    let mut sums = vec![0.0; lux.len()];
    fold_chunks(chunks, 8 * lux.len() as u64, cancel, chunk, |of_chunk: BeamSums| {
        sums.iter_mut().zip(&of_chunk.lux).for_each(|(sum, value)| *sum += value);
        rays += of_chunk.rays;
    })?;
    lux.iter_mut().zip(&sums).for_each(|(lux, sum)| *lux += sum);
    Some(rays)
}

/// Adds the direct light that cells receive through clear closures by the rays with these numbers, one after the other, to the illuminance
/// of all sensors in lx; returns the number of rays.
pub fn add_some_beams<const C: usize>(
    (scene, sensors): (&TraceableScene, &[SensorPlane]),
    (beams, numbers): (&Emission, Range<u64>),
    key: Key,
    lux: &mut [f64],
) -> RayCount {
    let (mut rays, mut energy) = (RayCount::default(), EnergyBalance::default());
    let mut through = Vec::new();
    for number in numbers {
        let (Some(photon), mut samples) = beams.photon(scene, key, number) else { continue };
        let Start::Tube(tube) = photon.start else { continue };
        let EmittedPhoton { position, direction, flux, .. } = photon;
        let counts = (&mut rays, &mut energy);
        let entering = Entering { position, direction, flux };
        descend::<C>(scene, &scene.tubes[tube], entering, &mut samples, counts, |exit| {
            let passed = exit.closure.unscattered::<C>().map(|fraction| exit.flux * fraction);
            through.extend(passed.map(|flux| (exit.position, -exit.from, flux.luminance())));
        });
        for (from, direction, flux) in through.drain(..) {
            let to = scene.intersect(from, direction, None).position;
            rays += 1;
            for plane in sensors.iter().filter(|plane| plane.average) {
                let crossing = plane.crossing(from, to, scene.contact());
                if let Some(index) = crossing.and_then(|place| plane.grid.cell_at(place.truncate())) {
                    lux[plane.first + index] += flux / plane.grid.cell_area_m2();
                }
            }
        }
    }
    rays
}

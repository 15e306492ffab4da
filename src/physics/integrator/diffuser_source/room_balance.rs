//! Energy balance of the room for methods that follow no photons there, estimated by a few photons.

use glam::DVec3;

use super::cells::Emitted;
use crate::geometry::OpeningFrame;
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::integrator::photon::events::Silent;
use crate::integrator::photon::path::{balance_in_room, trace};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Stream, warp};
use crate::traceable::TraceableScene;

/// Number of photons of the first stage for each one that is followed in the room, and the fewest that are.
const PHOTONS_PER_FOLLOWED: usize = 64;
const FEWEST: usize = 4;

/// Photon that passes a clear zone into the room.
#[derive(Clone, Copy, Debug)]
pub struct Unscattered<const C: usize> {
    /// Position in m.
    pub position: DVec3,
    /// Unit vector of travel.
    pub direction: DVec3,
    /// Flux in lm.
    pub flux: Spectrum<C>,
}

/// Adds the flux that leaves the closures into the room, by Lambertian light of each tube and unscattered, and that of luminaires, to the
/// energy balance, where it is absorbed.
///
/// Photons are chosen in proportion to their fluxes by even steps through all of them, and each represents an equal part of the whole: the
/// balance closes, and its entries are unbiased.
pub fn add_room_balance<const C: usize>(
    scene: &TraceableScene,
    (emitted, unscattered): (&[Vec<Emitted<C>>], &[Unscattered<C>]),
    pass: Key,
    totals: &mut PhotonTotals,
) {
    let evenly = emitted.iter().enumerate().flat_map(|(tube, photons)| {
        photons.iter().map(move |photon| (photon.flux, Leaving::Evenly(&scene.tubes[tube].frame, photon)))
    });
    let all: Vec<_> =
        evenly.chain(unscattered.iter().map(|photon| (photon.flux, Leaving::Unscattered(photon)))).collect();
    let total: f64 = all.iter().map(|(flux, _)| flux.luminance()).sum();
    if total > 0.0 {
        let followed = (all.len() / PHOTONS_PER_FOLLOWED).max(FEWEST);
        let stream = pass.stream(Stream::RoomBalance, 0);
        let step = total / followed as f64;
        let mut next = step * PathSamples::new(pass.stream(Stream::RoomBalance, 1), 0).random.uniform();
        let (mut passed, mut number) = (0.0, 0);
        for (flux, leaving) in all {
            passed += flux.luminance();
            while next < passed && number < followed {
                let mut samples = PathSamples::new(stream, number as u64);
                let ray = leaving.ray(&mut samples);
                balance_in_room(scene, ray, flux * (step / flux.luminance()), &mut samples, totals);
                next += step;
                number += 1;
            }
        }
        // rounding may leave out the last one
        totals.energy.cut += step * (followed - number) as f64;
    }
    let emission = Emission::of_luminaires(scene, FEWEST as u64);
    for number in 0..emission.photons() {
        let (photon, mut samples) = emission.photon(scene, pass.stream(Stream::RoomBalance, 2), number);
        if let Some(photon) = photon {
            trace::<C>(scene, &photon, &mut samples, &mut Silent, totals);
        }
    }
}

/// Light that leaves a closure.
enum Leaving<'a, const C: usize> {
    Evenly(&'a OpeningFrame, &'a Emitted<C>),
    Unscattered(&'a Unscattered<C>),
}

impl<const C: usize> Leaving<'_, C> {
    /// Returns the start of the light in the room in m, and its direction.
    fn ray(&self, samples: &mut PathSamples) -> (DVec3, DVec3) {
        match self {
            Self::Evenly(frame, photon) => {
                let down = frame.direction_in_room(-warp::cosine_hemisphere(samples.pair()));
                (photon.in_room(frame), down)
            }
            Self::Unscattered(photon) => (photon.position, photon.direction),
        }
    }
}

//! Energy balance of the room for methods that follow no photons there, estimated by a few photons.

use super::cells::Emitted;
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::integrator::photon::path::{Silent, balance_in_room, trace};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Stream, warp};
use crate::traceable::TraceableScene;

/// Number of photons of the first stage for each one that is followed in the room, and the fewest that are.
const PHOTONS_PER_FOLLOWED: usize = 64;
const FEWEST: usize = 4;

/// Adds the flux that leaves the closures into the room, and that of luminaires, to the energy balance, where it is absorbed.
///
/// Photons are chosen in proportion to their fluxes by even steps through all of them, and each represents an equal part of the whole: the
/// balance closes, and its entries are unbiased.
pub fn add_room_balance<const C: usize>(
    scene: &TraceableScene,
    emitted: &[Vec<Emitted<C>>],
    pass: Key,
    totals: &mut PhotonTotals,
) {
    let all =
        || emitted.iter().enumerate().flat_map(|(tube, photons)| photons.iter().map(move |photon| (tube, photon)));
    let total: f64 = all().map(|(_, photon)| photon.flux.luminance()).sum();
    if total > 0.0 {
        let followed = (all().count() / PHOTONS_PER_FOLLOWED).max(FEWEST);
        let stream = pass.stream(Stream::RoomBalance, 0);
        let step = total / followed as f64;
        let mut next = step * PathSamples::new(pass.stream(Stream::RoomBalance, 1), 0).random.uniform();
        let (mut passed, mut number) = (0.0, 0);
        for (tube, photon) in all() {
            passed += photon.flux.luminance();
            while next < passed && number < followed {
                let mut samples = PathSamples::new(stream, number as u64);
                let frame = &scene.tubes[tube].frame;
                let down = frame.direction_in_room(-warp::cosine_hemisphere(samples.pair()));
                let position = photon.in_room(frame);
                let flux: Spectrum<C> = photon.flux * (step / photon.flux.luminance());
                balance_in_room(scene, (position, down), flux, &mut samples, totals);
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

//! Flux that a tube sends into a room, by patches of its opening: the first of two stages alone.
//!
//! Photons of sky or sun go down the tube in passes of low-discrepancy points; every pass is one replicate of all fluxes. Closures of every
//! kind are possible: light that passes a clear one counts where it leaves. The Lambertian part is also reported separately.

use std::sync::atomic::AtomicBool;

use glam::DVec2;

use super::cells::Emitted;
use super::closure_source::is_lambertian;
use super::light::{EmittedPart, EmittedSums, emitted};
use super::patches::{CELLS, cell, middle};
use crate::integrator::photon::emission::Emission;
use crate::sampling::{Key, Stream};
use crate::scene::OpeningShape;
use crate::statistics::Moments;
use crate::statistics::interval::two_sided_student_quantile;
use crate::traceable::TraceableScene;

/// Number of photons of a pass.
const PHOTONS: u64 = 1024;

/// Fewest and most passes.
const LEAST_PASSES: u64 = 8;
const MOST_PASSES: u64 = 512;

/// Confidence of the requested error.
const CONFIDENCE: f64 = 0.95;

/// Fluxes of one tube in lm, each with as many replicates as passes.
#[derive(Clone, Debug)]
pub struct PatchedFlux {
    /// Flux that arrives at the collector.
    pub at_collector: Moments,
    /// Flux that arrives at the closure's top.
    pub at_diffuser: Moments,
    /// Flux that leaves the closure downward.
    pub into_room: Moments,
    /// Parts of `into_room` by patches of the opening, in the order of [`patches`].
    pub patches: Vec<Moments>,
    /// Part of `into_room` that leaves as from a Lambertian surface.
    pub evenly: Moments,
    /// Parts of `evenly` by patches of the opening.
    pub patches_evenly: Vec<Moments>,
}

/// Returns the middles of the patches of an opening, in m from its centre, toward east and north of an unturned room, and the area of each
/// in m2. The patches, all of equal area, are six sectors of each of four rings, or four rows of six parts of a square.
pub fn patches(opening: &OpeningShape) -> (Vec<DVec2>, f64) {
    ((0..CELLS).map(|number| middle(opening, number)).collect(), opening.area_m2() / CELLS as f64)
}

/// Reason why there are no fluxes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoFlux {
    /// The computation was cancelled.
    Cancelled,
    /// A photon gave an infinite value or one that is not a number: a fault of the program.
    NotFinite {
        /// Number of the pass, from 0.
        pass: u64,
        /// Number of the photon in it, from 0.
        photon: u64,
    },
}

/// Computes the fluxes through the first tube of a scene, of all daylight that the scene has, until the flux into the room has a relative
/// error of `relative_error` or less with a confidence of 95 %, or 512 passes are done. Equal keys give equal bits.
pub fn patched_flux(
    scene: &TraceableScene,
    key: Key,
    relative_error: f64,
    cancel: &AtomicBool,
) -> Result<PatchedFlux, NoFlux> {
    let none = Moments::default();
    let mut sum = PatchedFlux {
        at_collector: none,
        at_diffuser: none,
        into_room: none,
        patches: vec![none; CELLS],
        evenly: none,
        patches_evenly: vec![none; CELLS],
    };
    let Some(tube) = scene.tubes.first() else { return Ok(sum) };
    let emission = Emission::of_daylight(scene, PHOTONS);
    for pass in 0..MOST_PASSES {
        let key = key.stream(Stream::Pass, pass);
        let traced = |part: EmittedPart| emitted::<3>(scene, &emission, key, part, cancel).ok_or(NoFlux::Cancelled);
        let EmittedSums { photons, totals, .. } = traced(EmittedPart::All)?;
        if let Some(photon) = totals.not_finite {
            return Err(NoFlux::NotFinite { pass, photon });
        }
        let by_patches = |photons: &[Vec<Emitted<3>>]| {
            let mut patches = [0.0; CELLS];
            for photon in photons.iter().take(1).flatten() {
                let away = photon.position - tube.frame.origin.truncate();
                patches[cell(&tube.opening, away)] += photon.flux.luminance();
            }
            patches
        };
        let patches = by_patches(&photons);
        // the same photons are traced once more
        let evenly = if is_lambertian(tube) { patches } else { by_patches(&traced(EmittedPart::Evenly)?.photons) };
        sum.patches.iter_mut().zip(patches).for_each(|(moments, flux)| moments.push(flux));
        sum.patches_evenly.iter_mut().zip(evenly).for_each(|(moments, flux)| moments.push(flux));
        let [fluxes, ..] = &totals.tubes[..] else { return Ok(sum) };
        sum.at_collector.push(fluxes.at_collector);
        sum.at_diffuser.push(fluxes.at_diffuser);
        sum.into_room.push(fluxes.into_room);
        sum.evenly.push(fluxes.evenly);
        if pass + 1 >= LEAST_PASSES {
            let quantile = two_sided_student_quantile(CONFIDENCE, pass as f64);
            if quantile * sum.into_room.standard_error() <= relative_error * sum.into_room.mean {
                break;
            }
        }
    }
    Ok(sum)
}

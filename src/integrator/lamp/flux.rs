//! The flux that a tube sends into a room, by patches of its opening: the first of two stages alone.
//!
//! Photons of sky or sun go down the tube in passes of even points; every pass is one replicate of all fluxes. Any closure will
//! do: what passes a clear one counts where it leaves.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec2;

use super::cells::{CELLS, cell, middle};
use crate::guide::RayCount;
use crate::integrator::photon::descent::{Entering, Exit, descend};
use crate::integrator::photon::emission::{Emission, Start};
use crate::sampling::{Key, Stream};
use crate::statistics::Moments;
use crate::statistics::interval::two_sided_student_quantile;
use crate::traceable::{TraceableScene, TraceableTube};

/// Photons of a pass.
const PHOTONS: u64 = 1024;

/// Passes at the least, and at the most.
const LEAST_PASSES: u64 = 8;
const MOST_PASSES: u64 = 512;

/// Confidence of the error that was asked for.
const CONFIDENCE: f64 = 0.95;

/// Fluxes of one tube in lm, each with as many replicates as passes.
#[derive(Clone, Debug)]
pub struct PatchedFlux {
    /// Arrives at the collector.
    pub at_collector: Moments,
    /// Arrives at the closure's top.
    pub at_diffuser: Moments,
    /// Leaves the closure downward.
    pub into_room: Moments,
    /// That by patches of the opening, in the order of [`patches`].
    pub patches: Vec<Moments>,
}

/// Middles of the patches of an opening of `radius` m, in m from its centre, toward east and north of an unturned room, and the
/// area of each in m2. The patches are six sectors of each of four rings, all of equal area.
pub fn patches(radius: f64) -> (Vec<DVec2>, f64) {
    ((0..CELLS).map(|number| middle(number) * radius).collect(), PI * radius * radius / CELLS as f64)
}

/// Fluxes through the first tube of a scene, of all daylight that the scene has, until the flux into the room has a relative
/// error of `relative_error` or less with a confidence of 95 %, or 512 passes are done; `None` when cancelled. Equal keys give
/// equal bits.
pub fn patched_flux(scene: &TraceableScene, key: Key, relative_error: f64, cancel: &AtomicBool) -> Option<PatchedFlux> {
    let none = Moments::default();
    let mut sum = PatchedFlux { at_collector: none, at_diffuser: none, into_room: none, patches: vec![none; CELLS] };
    let Some(tube) = scene.tubes.first() else { return Some(sum) };
    let emission = Emission::of_daylight(scene, PHOTONS);
    for pass in 0..MOST_PASSES {
        if cancel.load(Ordering::Relaxed) {
            return None;
        }
        sum.push(&Replicate::trace(scene, tube, &emission, key.stream(Stream::Pass, pass)));
        if pass + 1 >= LEAST_PASSES {
            let quantile = two_sided_student_quantile(CONFIDENCE, pass as f64);
            if quantile * sum.into_room.standard_error() <= relative_error * sum.into_room.mean {
                break;
            }
        }
    }
    Some(sum)
}

impl PatchedFlux {
    fn push(&mut self, pass: &Replicate) {
        self.at_collector.push(pass.at_collector);
        self.at_diffuser.push(pass.at_diffuser);
        self.into_room.push(pass.patches.iter().sum());
        self.patches.iter_mut().zip(pass.patches).for_each(|(moments, flux)| moments.push(flux));
    }
}

/// Luminous fluxes of one pass in lm.
#[derive(Default)]
struct Replicate {
    at_collector: f64,
    at_diffuser: f64,
    patches: [f64; CELLS],
}

impl Replicate {
    fn trace(scene: &TraceableScene, tube: &TraceableTube, emission: &Emission, pass: Key) -> Self {
        let mut sum = Self::default();
        let mut rays = RayCount::default();
        for number in 0..emission.photons() {
            let (Some(photon), mut samples) = emission.photon(scene, pass, number) else { continue };
            if photon.start != Start::Tube(0) {
                continue;
            }
            let entering = Entering { position: photon.position, direction: photon.direction, flux: photon.flux };
            let at = |exit: &Exit<'_, 3>| {
                let away = (exit.position - tube.origin).truncate();
                sum.patches[cell(away, tube.opening_radius)] += exit.into_room().luminance();
            };
            let [entered, arrived] = descend::<3>(scene, tube, entering, &mut samples, &mut rays, at);
            sum.at_collector += entered.luminance();
            sum.at_diffuser += arrived.luminance();
        }
        sum
    }
}

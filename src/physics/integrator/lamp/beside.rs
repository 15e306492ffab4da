//! Tubes as Lambertian secondary sources, and the light that enters the room beside theirs, where closures are Lambertian in part.
//!
//! Light is linear. The Lambertian part of the light leaving a closure is all of it for a Lambertian closure, the light leaving the
//! Lambertian zone of a mixed one, and for a measured table the largest Lambertian sheet that it holds at each angle of incidence. The
//! rest, which passes unscattered or which a table scatters beside its sheet, is followed by light tracing ([`light_tracing`]); both come
//! from the same photons down the tubes.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::cells::Leaving;
use super::light::DiffuserLight;
use super::traced::BesideLamps;
use crate::integrator::GridPass;
use crate::integrator::light_tracing;
use crate::integrator::method::{Load, Refusal, RefusalCode, Task};
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::chunks::sums_at_once;
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon::ledger::Account;
use crate::sampling::Key;
use crate::scene::Grid;
use crate::traceable::{TraceableScene, TraceableTube};

/// True if all light that passes the closure of a tube leaves as from a Lambertian sheet.
pub fn is_lamp(tube: &TraceableTube) -> bool {
    tube.diffuser.is_even(tube.opening_radius)
}

/// True if all light that passes the closures leaves as from Lambertian sheets.
pub fn all_lamps(tubes: &[TraceableTube]) -> bool {
    tubes.iter().all(is_lamp)
}

/// Returns the reason why paths cannot be cut at all closures, if light leaves one otherwise than from a Lambertian sheet.
pub fn refuses_all_but_lamps(tubes: &[TraceableTube]) -> Option<Refusal> {
    let cut = "it takes closures as Lambertian sources, but";
    if tubes.iter().any(|tube| tube.diffuser.specular_zone(tube.opening_radius).is_some()) {
        Some(Refusal::new(RefusalCode::ClearClosures, format!("{cut} a closure passes light unscattered")))
    } else if tubes.iter().any(|tube| tube.diffuser.measured().is_some()) {
        let detail = format!("{cut} a measured diffuser scatters light depending on its direction of incidence");
        Some(Refusal::new(RefusalCode::MeasuredDiffusers, detail))
    } else {
        None
    }
}

/// Returns the reason why no closure of a task is even partly Lambertian, or why the light beside cannot be followed; `None` otherwise.
pub fn refuses_beside(task: &Task) -> Option<Refusal> {
    let tubes = &task.traceable.tubes;
    if all_lamps(tubes) {
        return None;
    }
    if tubes.iter().all(|tube| tube.diffuser.even_zone(tube.opening_radius).is_none()) {
        return refuses_all_but_lamps(tubes);
    }
    let refusal = task.has_points().then(|| light_tracing::refuses_points(task.traceable)).flatten()?;
    Some(of_light_tracing(refusal))
}

/// Converts a refusal by light tracing into one of a method that follows some light by it.
pub fn of_light_tracing(refusal: Refusal) -> Refusal {
    let detail =
        format!("light that closures do not scatter evenly is computed by light tracing, and {}", refusal.detail);
    Refusal { detail, ..refusal }.or("`estimate` cell_average")
}

/// Number of photons of a pass where light of one tube enters beside the Lambertian part, and the power of the number of such tubes by
/// which it grows: a sensor gets light of several, whose errors are independent.
const BESIDE: PassSize = PassSize { for_one_percent: 4096.0, growth: 1.5, fewest: 512.0, most: f64::INFINITY };
const GROWTH_BY_TUBES: f64 = 0.75;

/// Returns the number of photons of a pass for a relative standard error `target` where light of some tubes enters beside the Lambertian
/// part; 0 where there is none.
pub fn photons_beside(tubes: &[TraceableTube], target: f64) -> f64 {
    let beside = tubes.iter().filter(|tube| !is_lamp(tube)).count() as f64;
    if beside > 0.0 { BESIDE.of(target, libm::pow(beside, GROWTH_BY_TUBES)) } else { 0.0 }
}

/// Returns the largest number of sensors of a trial that is limited to `places` where all closures are Lambertian. Other light is divided
/// among the sensors: with fewer of them, each would have more of it, so that all are tried.
pub fn most_places(tubes: &[TraceableTube], places: usize) -> usize {
    if all_lamps(tubes) { places } else { usize::MAX }
}

/// Returns the bytes of the sums over all sensors that chunks of the `photons` of a pass hold at the same time, where light enters beside
/// the Lambertian part.
pub fn bytes_beside(load: &Load, photons: f64) -> f64 {
    8.0 * load.sensors_beside as f64 * sums_at_once(load.sensors_beside, photons as u64) as f64
}

/// Source of the light of closures, Lambertian and other, pass by pass.
#[derive(Debug)]
pub struct Lamps<const C: usize>(By<C>);

#[derive(Debug)]
enum By<const C: usize> {
    /// Photons for scenes where all closures are Lambertian.
    Photons(Emission),
    /// Light tracing for scenes where light enters beside the Lambertian part.
    Beside(BesideLamps<C>),
}

/// Light of one pass.
#[derive(Debug)]
pub struct Lit<const C: usize> {
    /// Lambertian light of the closures.
    pub lamps: DiffuserLight<C>,
    /// Values that all other light of sky and sun adds to the grids; empty where there is no such light.
    pub beside: Vec<GridPass>,
    /// Fluxes of the tubes, and the energy balance.
    pub account: Account,
}

impl<const C: usize> Lamps<C> {
    /// Divides the photons of a pass for a relative standard error among sky and sun of the tubes; equal seeds give equal bits. `grids` are
    /// those that get light from beside the Lambertian part.
    pub fn new(scene: &Arc<TraceableScene>, grids: &[Grid], (photons, target): (u64, f64), seed: u64) -> Self {
        Self(match all_lamps(&scene.tubes) {
            true => By::Photons(Emission::of_daylight(scene, photons)),
            false => By::Beside(BesideLamps::new(scene.clone(), grids, (photons, target), seed)),
        })
    }

    /// Returns the number of photons per pass.
    pub fn photons(&self) -> u64 {
        match &self.0 {
            By::Photons(emission) => emission.photons(),
            By::Beside(beside) => beside.photons(),
        }
    }

    /// Computes the light of one pass; `None` when cancelled.
    pub fn pass(&self, scene: &TraceableScene, pass: Key, cancel: &AtomicBool) -> Option<Lit<C>> {
        match &self.0 {
            By::Photons(emission) => {
                let (lamps, account) = DiffuserLight::trace(scene, emission, pass, cancel)?;
                Some(Lit { lamps, beside: Vec::new(), account })
            }
            By::Beside(beside) => {
                let found = beside.pass(pass, cancel)?;
                let mut account = found.account;
                let leaving = |(position, flux): (glam::DVec3, _)| Leaving { position: position.truncate(), flux };
                let all = found.lamps.into_iter().map(|tube| tube.into_iter().map(leaving).collect()).collect();
                let lamps = DiffuserLight::of(scene, all, pass, &mut account);
                Some(Lit { lamps, beside: found.grids, account })
            }
        }
    }
}

/// Adds the light from beside the Lambertian part to the values of each grid.
pub fn add_beside(grids: &mut [GridPass], beside: &[GridPass]) {
    grids.iter_mut().zip(beside).for_each(|(grid, beside)| grid.add(beside));
}

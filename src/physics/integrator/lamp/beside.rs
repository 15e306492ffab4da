//! Lamps and what comes into the room beside them: closures that scatter evenly in part.
//!
//! Light is linear. What leaves a closure as from a Lambertian sheet is that of a lamp: all of a Lambertian closure, what leaves the
//! Lambertian zone of a mixed one, and of a table the largest Lambertian sheet that it holds at each angle of incidence. The rest,
//! what passes unscattered and what a table has beside its sheet, is followed by light tracing
//! ([`light_tracing`]); both come from the same photons down the tubes.

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

/// True if all tubes are lamps, with nothing beside.
pub fn all_lamps(tubes: &[TraceableTube]) -> bool {
    tubes.iter().all(is_lamp)
}

/// Reason why tubes are no lamps, if one has light beside.
pub fn refuses_all_but_lamps(tubes: &[TraceableTube]) -> Option<Refusal> {
    let cut = "the path is cut at Lambertian diffusers, but";
    if tubes.iter().any(|tube| tube.diffuser.specular_zone(tube.opening_radius).is_some()) {
        Some(Refusal::new(RefusalCode::ClearClosures, format!("{cut} a closure lets light pass unscattered")))
    } else if tubes.iter().any(|tube| tube.diffuser.measured().is_some()) {
        let detail = format!("{cut} light leaves a measured one by its direction of incidence");
        Some(Refusal::new(RefusalCode::MeasuredDiffusers, detail))
    } else {
        None
    }
}

/// Reason why the tubes of a task are not even lamps in part, or why light beside them cannot be followed, if so.
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

/// A refusal by light tracing, of what it follows here.
pub fn of_light_tracing(refusal: Refusal) -> Refusal {
    let detail = format!("what closures do not scatter evenly is followed by light tracing, and {}", refusal.detail);
    Refusal { detail, ..refusal }.or("the estimate cell_average")
}

/// Photons of a pass where light of one tube comes in beside lamps. More tubes take more by this power of their number: a sensor gets light of
/// several, whose errors have nothing in common.
const BESIDE: PassSize = PassSize { for_one_percent: 4096.0, growth: 1.5, fewest: 512.0, most: f64::INFINITY };
const GROWTH_BY_TUBES: f64 = 0.75;

/// Photons of a pass for a relative standard error `target` where light of some tubes comes in beside lamps; 0 where none does.
pub fn photons_beside(tubes: &[TraceableTube], target: f64) -> f64 {
    let beside = tubes.iter().filter(|tube| !is_lamp(tube)).count() as f64;
    if beside > 0.0 { BESIDE.of(target, libm::pow(beside, GROWTH_BY_TUBES)) } else { 0.0 }
}

/// Most sensors of a trial that looks at some `places` where all tubes are lamps: light from beside them is shared among the sensors, so
/// that fewer of them would have more of it.
pub fn most_places(tubes: &[TraceableTube], places: usize) -> usize {
    if all_lamps(tubes) { places } else { usize::MAX }
}

/// Bytes of the sums over all sensors that chunks of the `photons` of a pass hold at the same time, where light comes in beside lamps.
pub fn bytes_beside(load: &Load, photons: f64) -> f64 {
    8.0 * load.sensors_beside as f64 * sums_at_once(load.sensors_beside, photons as u64) as f64
}

/// Finds the light of lamps, and what comes in beside, pass by pass.
#[derive(Debug)]
pub struct Lamps<const C: usize>(By<C>);

#[derive(Debug)]
enum By<const C: usize> {
    /// All light is that of lamps.
    Photons(Emission),
    /// Light comes in beside them.
    Beside(BesideLamps<C>),
}

/// Light of one pass.
#[derive(Debug)]
pub struct Lit<const C: usize> {
    /// The light of the lamps.
    pub lamps: DiffuserLight<C>,
    /// What all other light of sky and sun gives to the grids; none where there is none.
    pub beside: Vec<GridPass>,
    /// The fluxes of the tubes, and all books.
    pub account: Account,
}

impl<const C: usize> Lamps<C> {
    /// Divides the photons of a pass for a relative standard error among sky and sun of the tubes; equal seeds give equal bits. `grids`: those that get light from
    /// beside the lamps.
    pub fn new(scene: &Arc<TraceableScene>, grids: &[Grid], (photons, target): (u64, f64), seed: u64) -> Self {
        Self(match all_lamps(&scene.tubes) {
            true => By::Photons(Emission::of_daylight(scene, photons)),
            false => By::Beside(BesideLamps::new(scene.clone(), grids, (photons, target), seed)),
        })
    }

    /// Photons per pass.
    pub fn photons(&self) -> u64 {
        match &self.0 {
            By::Photons(emission) => emission.photons(),
            By::Beside(beside) => beside.photons(),
        }
    }

    /// The light of one pass; `None` when cancelled.
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

/// Adds light from beside the lamps to what these give to each grid.
pub fn add_beside(grids: &mut [GridPass], beside: &[GridPass]) {
    grids.iter_mut().zip(beside).for_each(|(grid, beside)| grid.add(beside));
}

//! Tubes as Lambertian secondary sources, and the light that enters the room beside theirs, where closures are Lambertian in part.
//!
//! Light is linear. The Lambertian part of the light leaving a closure is all of it for a Lambertian closure, the light leaving the
//! Lambertian zone of a mixed one, and for a measured table the largest Lambertian sheet that it holds at each angle of incidence. The
//! rest, which passes unscattered or which a table scatters beside its sheet, is followed by light tracing ([`light_tracing`]); both come
//! from the same photons down the tubes.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::cells::Emitted;
use super::directional::{DirectionalPart, LambertianExit};
use super::light::DiffuserLight;
use crate::integrator::GridPass;
use crate::integrator::light_tracing;
use crate::integrator::method::{Load, Refusal, RefusalCode, Task};
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::chunks::concurrent_sums;
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::sampling::Key;
use crate::scene::Grid;
use crate::traceable::{TraceableScene, TraceableTube};

/// True if all light that passes the closure of a tube leaves as from a Lambertian sheet.
pub fn is_lambertian(tube: &TraceableTube) -> bool {
    tube.diffuser.measured().is_none() && tube.specular_zone().is_none()
}

/// True if all light that passes the closures leaves as from Lambertian sheets.
pub fn all_lambertian(tubes: &[TraceableTube]) -> bool {
    tubes.iter().all(is_lambertian)
}

/// Returns the reason why paths cannot be cut at all closures, if light leaves one otherwise than from a Lambertian sheet.
pub fn refuses_all_but_lambertian(tubes: &[TraceableTube]) -> Option<Refusal> {
    let cut = "it takes closures as Lambertian sources, but";
    if tubes.iter().any(|tube| tube.specular_zone().is_some()) {
        Some(Refusal::new(RefusalCode::ClearClosures, format!("{cut} a closure passes light unscattered")))
    } else if tubes.iter().any(|tube| tube.diffuser.measured().is_some()) {
        let detail = format!("{cut} a measured diffuser scatters light depending on its direction of incidence");
        Some(Refusal::new(RefusalCode::MeasuredDiffusers, detail))
    } else {
        None
    }
}

/// Returns the reason why no closure of a task is even partly Lambertian, or why directional light cannot be followed; `None` otherwise.
pub fn refuses_directional(task: &Task) -> Option<Refusal> {
    let tubes = &task.traceable.tubes;
    if all_lambertian(tubes) {
        return None;
    }
    if tubes.iter().all(|tube| tube.even_zone().is_none()) {
        return refuses_all_but_lambertian(tubes);
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

/// Number of photons of a pass with the directional light of one tube, and the power of the number of such tubes by
/// which it grows: a sensor gets light of several, whose errors are independent.
const DIRECTIONAL: PassSize = PassSize { for_one_percent: 4096.0, growth: 1.5, fewest: 512.0, most: f64::INFINITY };
const GROWTH_BY_TUBES: f64 = 0.75;

/// Returns the number of photons of a pass for a relative standard error `target` where some tubes send light beside the Lambertian
/// part; 0 where there is none.
pub fn directional_photons(tubes: &[TraceableTube], target: f64) -> f64 {
    let directional = tubes.iter().filter(|tube| !is_lambertian(tube)).count() as f64;
    if directional > 0.0 { DIRECTIONAL.of(target, libm::pow(directional, GROWTH_BY_TUBES)) } else { 0.0 }
}

/// Returns the largest number of sensors of a trial that is limited to `places` where all closures are Lambertian. Other light is divided
/// among the sensors: with fewer of them, each would have more of it, so that all are tried.
pub fn most_places(tubes: &[TraceableTube], places: usize) -> usize {
    if all_lambertian(tubes) { places } else { usize::MAX }
}

/// Returns the bytes of the sums over all sensors that chunks of the `photons` of a pass hold at the same time, where light enters beside
/// the Lambertian part.
pub fn directional_bytes(load: &Load, photons: f64) -> f64 {
    8.0 * load.directional_sensors as f64 * concurrent_sums(load.directional_sensors, photons as u64) as f64
}

/// Source of the light of closures, Lambertian and other, pass by pass.
#[derive(Debug)]
pub struct ClosureSource<const C: usize>(Mode<C>);

#[derive(Debug)]
enum Mode<const C: usize> {
    /// Photons for scenes where all closures are Lambertian.
    Lambertian(Emission),
    /// Light tracing for scenes where light enters beside the Lambertian part.
    Directional(DirectionalPart<C>),
}

/// Light of one pass.
#[derive(Debug)]
pub struct ClosureLight<const C: usize> {
    /// Lambertian light of the closures.
    pub lambertian: DiffuserLight<C>,
    /// Values that all other light of sky and sun adds to the grids; empty where there is no such light.
    pub directional: Vec<GridPass>,
    /// Fluxes of the tubes, and the energy balance.
    pub totals: PhotonTotals,
}

impl<const C: usize> ClosureSource<C> {
    /// Divides the photons of a pass for a relative standard error among sky and sun of the tubes; equal seeds give equal bits. `grids` are
    /// those that get light from beside the Lambertian part.
    pub fn new(scene: &Arc<TraceableScene>, grids: &[Grid], (photons, target): (u64, f64), seed: u64) -> Self {
        Self(match all_lambertian(&scene.tubes) {
            true => Mode::Lambertian(Emission::of_daylight(scene, photons)),
            false => Mode::Directional(DirectionalPart::new(scene.clone(), grids, (photons, target), seed)),
        })
    }

    /// Returns the number of photons per pass.
    pub fn photons(&self) -> u64 {
        match &self.0 {
            Mode::Lambertian(emission) => emission.photons(),
            Mode::Directional(directional) => directional.photons(),
        }
    }

    /// Computes the light of one pass; `None` when cancelled.
    pub fn pass(&self, scene: &TraceableScene, pass: Key, cancel: &AtomicBool) -> Option<ClosureLight<C>> {
        match &self.0 {
            Mode::Lambertian(emission) => {
                let (lambertian, totals) = DiffuserLight::trace(scene, emission, pass, cancel)?;
                Some(ClosureLight { lambertian, directional: Vec::new(), totals })
            }
            Mode::Directional(directional) => {
                let found = directional.pass(pass, cancel)?;
                let mut totals = found.totals;
                let by_tubes = found.lambertian.into_iter().zip(&scene.tubes);
                let of_tube = |(exits, tube): (Vec<LambertianExit<C>>, &TraceableTube)| {
                    exits.into_iter().map(|(position, flux)| Emitted::new(position, flux, &tube.frame)).collect()
                };
                let all = by_tubes.map(of_tube).collect();
                let lambertian = DiffuserLight::of(scene, all, pass, &mut totals);
                Some(ClosureLight { lambertian, directional: found.grids, totals })
            }
        }
    }
}

/// Adds the light from beside the Lambertian part to the values of each grid.
pub fn add_directional(grids: &mut [GridPass], directional: &[GridPass]) {
    grids.iter_mut().zip(directional).for_each(|(grid, directional)| grid.add(directional));
}

//! Tubes as Lambertian secondary sources, and the light that enters the room beside theirs, where closures are Lambertian in part.
//!
//! Light is linear. The Lambertian part of the light leaving a closure is all of it for a Lambertian closure, the light leaving the
//! Lambertian zone of a mixed one, and for a measured table the largest Lambertian sheet that it holds at each angle of incidence. The
//! rest passes unscattered, or a table scatters it beside its sheet. It is followed by light tracing ([`light_tracing`]), by the same
//! photons down the tubes; for sensors that do not look up, vertices of paths are connected to the clear zones instead, and only what comes
//! straight to the sensors is added here ([`Beside`]).

use std::sync::atomic::AtomicBool;

use super::cells::Emitted;
use super::directional::{DirectionalPart, LambertianExit};
use super::light::DiffuserLight;
use super::room_balance::add_room_balance;
use crate::integrator::GridPass;
use crate::integrator::backward::clear_zones::clear_zones_are_connected;
use crate::integrator::light_tracing::{self, LightTracing};
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
const DIRECTIONAL: PassSize = PassSize { for_one_percent: 2048.0, growth: 1.5, fewest: 512.0, most: f64::INFINITY };
const GROWTH_BY_TUBES: f64 = 0.75;

/// Returns the number of photons of a pass for a relative standard error `target` where some tubes send light beside the Lambertian
/// part that is traced, or rays straight to cells; 0 where there is none.
pub fn directional_photons(tubes: &[TraceableTube], target: f64) -> f64 {
    let directional = tubes.iter().filter(|tube| !is_lambertian(tube)).count() as f64;
    if directional > 0.0 { DIRECTIONAL.of(target, libm::pow(directional, GROWTH_BY_TUBES)) } else { 0.0 }
}

/// Estimator of the light beside that of Lambertian closures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Beside {
    /// There is no such light.
    Nothing,
    /// Photons are traced through the room, and connected to the sensors.
    Traced,
    /// Vertices of paths are connected to clear zones.
    Connected,
}

impl Beside {
    /// Chooses the estimator for a task: a photon serves all sensors at once that look up, but no others.
    pub fn of(task: &Task) -> Self {
        let scene = task.traceable;
        let is_connected = || task.views.is_empty() && task.has_placed_sensors() && clear_zones_are_connected(scene);
        match all_lambertian(&scene.tubes) {
            true => Self::Nothing,
            false if is_connected() => Self::Connected,
            false => Self::Traced,
        }
    }

    /// Returns the largest number of sensors of a trial that is limited to `places` where no photons are traced. Traced light is divided
    /// among the sensors: with fewer of them, each would have more of it, so that all are tried.
    pub fn most_places(self, places: usize) -> usize {
        if self == Self::Traced { usize::MAX } else { places }
    }
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
    /// Photons down the tubes alone; the method computes what comes straight through clear zones to the sensors.
    Connected(Emission, Option<LightTracing<C>>),
    /// Light tracing where other light enters beside the Lambertian part.
    Traced(DirectionalPart<C>),
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
    pub fn new((task, beside): (&Task, Beside), grids: &[Grid], (photons, target): (u64, f64), seed: u64) -> Self {
        let scene = task.traceable;
        let emission = || Emission::of_daylight(scene, photons);
        Self(match beside {
            Beside::Nothing => Mode::Connected(emission(), None),
            Beside::Traced => Mode::Traced(DirectionalPart::new(task, grids, (photons, target), seed)),
            Beside::Connected => {
                let rays = directional_photons(&scene.tubes, target) as u64;
                let straight = LightTracing::directional(task, grids, (rays, target), false, seed);
                Mode::Connected(emission(), Some(straight))
            }
        })
    }

    /// Returns zeros for the contrasts of the light beside the Lambertian part, by grid; nothing without such light.
    pub fn no_contrasts(&self) -> Vec<Vec<f64>> {
        match &self.0 {
            Mode::Connected(_, straight) => straight.as_ref().map_or_else(Vec::new, LightTracing::no_contrasts),
            Mode::Traced(directional) => directional.no_contrasts(),
        }
    }

    /// Returns the number of photons per pass.
    pub fn photons(&self) -> u64 {
        match &self.0 {
            Mode::Connected(emission, _) => emission.photons(),
            Mode::Traced(directional) => directional.photons(),
        }
    }

    /// Computes the light of one pass; `None` when cancelled.
    pub fn pass(&self, scene: &TraceableScene, pass: Key, cancel: &AtomicBool) -> Option<ClosureLight<C>> {
        match &self.0 {
            Mode::Connected(emission, straight) => {
                let (lambertian, mut totals) = DiffuserLight::trace(scene, emission, pass, cancel)?;
                let Some(straight) = straight else {
                    return Some(ClosureLight { lambertian, directional: Vec::new(), totals });
                };
                let (directional, rays) = straight.unscattered_alone(pass, cancel)?;
                totals.rays += rays;
                Some(ClosureLight { lambertian: lambertian.with_clear_zones(), directional, totals })
            }
            Mode::Traced(directional) => {
                let found = directional.pass(pass, cancel)?;
                let mut totals = found.totals;
                let by_tubes = found.lambertian.into_iter().zip(&scene.tubes);
                let of_tube = |(exits, tube): (Vec<LambertianExit<C>>, &TraceableTube)| {
                    exits.into_iter().map(|(position, flux)| Emitted::new(position, flux, &tube.frame)).collect()
                };
                let all: Vec<_> = by_tubes.map(of_tube).collect();
                add_room_balance(scene, (&all, &[]), pass, &mut totals);
                let lambertian = DiffuserLight::of(scene, all, pass);
                Some(ClosureLight { lambertian, directional: found.grids, totals })
            }
        }
    }
}

/// Adds the light from beside the Lambertian part to the values of each grid.
pub fn add_directional(grids: &mut [GridPass], directional: &[GridPass]) {
    grids.iter_mut().zip(directional).for_each(|(grid, directional)| grid.add(directional));
}

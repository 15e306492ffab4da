//! Paths of light down a tube to its closure: the first of the two stages in which light enters a room.

use glam::DVec3;

use super::energy_balance::EnergyBalance;
use crate::guide::RayCount;
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Closure, Scatter, SheetSide, Spectrum, Travel};
use crate::sampling::{PathSamples, warp};
use crate::sky::Sun;
use crate::sky::sun::HALF_ANGLE;
use crate::traceable::{TraceableScene, TraceableTube};

/// Light that arrives at a closure, from above.
#[derive(Clone, Copy, Debug)]
pub struct Exit<'a, const C: usize> {
    /// Point in the plane of the opening, in m.
    pub position: DVec3,
    /// Closure at this point.
    pub closure: Closure<'a>,
    /// Unit vector toward the point where the light comes from.
    pub from: DVec3,
    /// Flux that arrives, in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize> Exit<'_, C> {
    /// Returns the intensity in lm/sr into the room along the unit vector `toward`.
    pub fn intensity(&self, toward: DVec3) -> Spectrum<C> {
        if self.closure.up(toward) >= 0.0 {
            return Spectrum::ZERO;
        }
        self.flux * self.closure.value(Travel::WithLight, self.from, toward)
    }

    /// Returns the part of the flux into the room that leaves with a Lambertian distribution, in lm.
    pub fn evenly(&self) -> Spectrum<C> {
        self.flux * self.closure.even_fraction(self.from)
    }

    /// Returns the flux that leaves into the room, in lm.
    pub fn into_room(&self) -> Spectrum<C> {
        self.flux * self.closure.albedo(self.from, SheetSide::Other)
    }
}

/// Light that enters a collector.
#[derive(Clone, Copy, Debug)]
pub struct Entering {
    /// Entry point in the tube's frame, in m.
    pub position: DVec3,
    /// Unit vector of travel.
    pub direction: DVec3,
    /// Flux in lm.
    pub flux: f64,
}

/// Fluxes of light that was followed down a tube.
#[derive(Clone, Copy, Debug)]
pub struct Descent<const C: usize> {
    /// Flux that entered the tube, in lm.
    pub entered: Spectrum<C>,
    /// Flux at its first arrival at the closure, in lm.
    pub arrived: Spectrum<C>,
}

/// Follows light down to the closure, and again each time the tube returns it there. Calls `at` for every arrival, adds the rays to the ray
/// count, and adds to the energy balance all flux but that which leaves into the room. Light that passes a clear closure ends there.
pub fn descend<'a, const C: usize>(
    scene: &TraceableScene,
    tube: &'a TraceableTube,
    entering: Entering,
    samples: &mut PathSamples,
    (rays, energy): (&mut RayCount, &mut EnergyBalance),
    mut at: impl FnMut(&Exit<'a, C>),
) -> Descent<C> {
    let mut transit = tube.down(entering.position, entering.direction, &mut samples.random);
    let entered = if transit.entered { Spectrum([entering.flux; C]) } else { Spectrum::ZERO };
    let (mut flux, mut arrived) = (entered, Spectrum::ZERO);
    energy.emitted += entered.luminance();
    let returns = scene.guide_return && tube.guide.returns_light();
    for event in 0..MAX_EVENTS {
        *rays += transit.ray_count();
        let before = flux;
        flux *= transit.weight();
        if !energy.add_transit(&transit, before, flux) || flux.max() <= 0.0 {
            return Descent { entered, arrived };
        }
        if event == 0 {
            arrived = flux;
        }
        let position = tube.frame.onto(tube.frame.origin + transit.position);
        let closure = tube.closure_at(position);
        let from = -transit.direction;
        let exit = Exit { position, closure, from, flux };
        at(&exit);
        let through = exit.into_room();
        if closure.unscattered::<C>().is_some() {
            energy.diffuser += flux.luminance() - through.luminance();
            return Descent { entered, arrived };
        }
        let back = flux * closure.albedo(from, SheetSide::Same);
        energy.diffuser += flux.luminance() - through.luminance() - back.luminance();
        if !returns {
            energy.guide_top += back.luminance();
            return Descent { entered, arrived };
        }
        let survival = (back.max() / flux.max()).min(1.0);
        if samples.random.uniform() >= survival {
            energy.cut += back.luminance();
            return Descent { entered, arrived };
        }
        let sample = Scatter::<C>::sample(&closure, Travel::WithLight, from, SheetSide::Same, samples);
        let Some(scattered) = sample else {
            energy.cut += back.luminance();
            return Descent { entered, arrived };
        };
        flux = back * (1.0 / survival);
        energy.cut += back.luminance() - flux.luminance();
        transit = tube.up(position, scattered.toward, &mut samples.random);
    }
    energy.cut += flux.luminance();
    Descent { entered, arrived }
}

/// Samples a ray of the sun from the collector down, and calls `at` for every point where it arrives at a closure that scatters.
pub fn sun_exits<'a, const C: usize>(
    scene: &TraceableScene,
    tube: &'a TraceableTube,
    sun: &Sun,
    samples: &mut PathSamples,
    rays: &mut RayCount,
    mut at: impl FnMut(&Exit<'a, C>),
) {
    let at = |exit: &Exit<'a, C>| {
        if exit.closure.unscattered::<C>().is_none() {
            at(exit);
        }
    };
    let toward = warp::around(sun.direction, warp::cone(samples.pair(), HALF_ANGLE));
    let Some(entry) = tube.guide.entry(samples.pair(), -toward).filter(|_| toward.z > 0.0) else { return };
    let flux = sun.luminance_cd_m2() * Sun::solid_angle_sr() * entry.projected_area_m2;
    descend(
        scene,
        tube,
        Entering { position: entry.position, direction: -toward, flux },
        samples,
        (rays, &mut EnergyBalance::default()),
        at,
    );
}

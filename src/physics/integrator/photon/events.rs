//! Events on the path of a photon through the room, and the listener to them, which each method defines.

use glam::DVec3;

use crate::optics::{Scatter, Scatterer, Spectrum, Travel};
use crate::sampling::PathSamples;
use crate::traceable::SurfaceId;

/// A point where light is scattered into the room.
#[derive(Clone, Copy, Debug)]
pub struct Scattering<'a, const C: usize> {
    /// The point in the room's frame, in m.
    pub position: DVec3,
    /// Unit normal toward the side on which the light leaves.
    pub normal: DVec3,
    /// Lambertian flux that leaves, in lm: an intensity of `outgoing` cos / pi.
    pub outgoing: Spectrum<C>,
    /// Light that leaves in addition to the Lambertian flux, with a finite but not Lambertian distribution.
    pub lobe: Option<Lobe<'a, C>>,
    /// Surface that scatters; `None` at a diffuser.
    pub surface: Option<SurfaceId>,
    /// Number of the tube whose diffuser scatters; `None` at a surface.
    pub diffuser: Option<usize>,
}

/// Light that leaves a vertex with a finite, non-Lambertian distribution.
#[derive(Clone, Copy, Debug)]
pub struct Lobe<'a, const C: usize> {
    /// Closure or surface lobe that scatters the light.
    pub scatterer: Scatterer<'a>,
    /// Unit direction of travel of the light that arrives.
    pub incident: DVec3,
    /// Flux that arrives, in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize> Lobe<'_, C> {
    /// Returns the intensity in lm/sr (flux times BSDF times |cosine|) along the unit vector `outward`.
    #[inline]
    pub fn intensity(&self, outward: DVec3) -> Spectrum<C> {
        self.flux * self.scatterer.value(Travel::WithLight, -self.incident, outward)
    }
}

/// Straight flight of light through the room.
#[derive(Clone, Copy, Debug)]
pub struct Flight<const C: usize> {
    /// Point where the flight starts, in m.
    pub from: DVec3,
    /// Point where the flight ends, in m.
    pub to: DVec3,
    /// Flux along the flight, in lm.
    pub flux: Spectrum<C>,
    /// Kind of place where the flight starts.
    pub origin: Origin,
}

/// Kind of place where a flight starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A diffuser that scattered the light: its direct light has a better estimator than this photon.
    Diffuser,
    /// A surface of the room that scattered the light diffusely.
    Surface(SurfaceId),
    /// A surface of the room that reflected the light about its mirror direction, ideally or in a lobe: cell averages count all of it as it
    /// crosses their plane, because no connection counts it.
    Lobe(SurfaceId),
    /// An opening that the light passed unscattered.
    Specular,
    /// A luminaire: its direct light has a better estimator than this photon.
    Luminaire(SurfaceId),
}

/// Listener to the events of a photon's path.
pub trait Visitor<const C: usize> {
    /// Fraction of the flux with which the photon entered the room above which reflections are not decided by Russian roulette but scale
    /// the flux: this gives many faint photons instead of few bright ones.
    const CERTAIN_ABOVE: f64 = f64::INFINITY;

    /// Handles light scattered at a surface or a closure, before the photon samples its next direction.
    fn scattered(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples);
    /// Handles light that leaves a luminaire, which is treated like a scattering surface.
    fn emitted(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples);
    /// Handles light that has crossed the room from one point to another, with nothing between.
    fn flew(&mut self, flight: &Flight<C>);
    /// Handles `flux` lm of light that leave the closure of a tube at `_position` with a Lambertian distribution. The photon does not carry
    /// this part any further: the closure counts as a secondary source. Only [`trace_directional`](super::path::trace_directional) calls it.
    fn lambertian_exit(&mut self, _tube: usize, _position: DVec3, _flux: Spectrum<C>) {}
    /// Handles light that arrives at a room surface, before its reflectance is applied.
    fn arrived(&mut self, surface: SurfaceId, position: DVec3, flux: Spectrum<C>, origin: Origin);
}

/// A visitor that ignores all events, where only the energy balance is needed.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl<const C: usize> Visitor<C> for Silent {
    fn scattered(&mut self, _: &Scattering<'_, C>, _: &mut PathSamples) {}
    fn emitted(&mut self, _: &Scattering<'_, C>, _: &mut PathSamples) {}
    fn flew(&mut self, _: &Flight<C>) {}
    fn arrived(&mut self, _: SurfaceId, _: DVec3, _: Spectrum<C>, _: Origin) {}
}

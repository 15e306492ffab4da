//! Interface of everything that scatters light at a vertex of a path: surfaces, lobes, closures and sensors.
//!
//! Directions are unit vectors away from the point: `from` to where the path comes from, `toward` to where it continues. Integrators use
//! values, densities, samples and albedos, and do not depend on what it is that scatters.

use glam::DVec3;

use super::Spectrum;
use crate::sampling::PathSamples;

/// Direction in which a path runs. A measured table need not be reciprocal, so its value depends on which of the two directions is that
/// of the light (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Travel {
    /// Path from a source: light comes from `from`.
    WithLight,
    /// Path from a sensor or an eye: light comes from `toward`.
    AgainstLight,
}

/// Side of a sheet on which a path continues.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetSide {
    /// Side from which the path comes: it is reflected.
    Same,
    /// Opposite side: the path is transmitted.
    Other,
}

/// Kinds of scattering.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Scattering in all directions of a side: by a Lambertian surface, or by a table.
    Diffuse,
    /// Scattering into a lobe about the mirror direction.
    Glossy,
    /// Reflection into the mirror direction alone.
    Mirror,
    /// Unscattered transmission.
    Through,
}

/// A sampled direction in which a path continues.
#[derive(Clone, Copy, Debug)]
pub struct Scattered<const C: usize> {
    /// Unit vector away from the point.
    pub toward: DVec3,
    /// Kind of scattering by which `toward` was chosen.
    pub kind: Kind,
    /// Density per sr with which any of the finite kinds chooses `toward`; for a mirror or unscattered transmission, which have none, the
    /// probability of the choice.
    pub pdf: f64,
    /// Value of all finite kinds over `pdf`: the weight of a path that counts them together.
    pub weight: Spectrum<C>,
}

/// A scatterer above one side of a surface with this unit normal.
#[derive(Debug)]
pub struct Oriented<'a, T> {
    /// Optics of the scatterer.
    pub optics: &'a T,
    /// Unit normal of the surface.
    pub normal: DVec3,
}

impl<T> Clone for Oriented<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Oriented<'_, T> {}

/// A distribution that scatters light at a point.
pub trait Scatter<const C: usize> {
    /// Returns the BSDF times |cosine| of `toward`, per sr, of the finite kinds: mirrors and unscattered transmission have no value.
    fn value(&self, travel: Travel, from: DVec3, toward: DVec3) -> Spectrum<C>;

    /// Returns the density per sr with which [`Self::sample`] chooses `toward` by a finite kind, given its side.
    fn pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> f64;

    /// Returns value and density together.
    fn value_and_pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> (Spectrum<C>, f64) {
        (self.value(travel, from, toward), self.pdf(travel, from, toward))
    }

    /// Samples a direction on one side in which the path continues; `None` where nothing is scattered to that side.
    fn sample(&self, travel: Travel, from: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>>;

    /// Returns the fraction of the light from `from` that leaves on one side, all kinds together, in 0..=1.
    fn albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C>;

    /// Estimates [`Self::albedo`] for a path against the light: > 0 wherever the path can find light.
    fn likely_albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        self.albedo(from, side)
    }
}

/// Turns the direction `local`, around +z, to a side of a sheet in a plane z = const, seen from `from`.
pub(super) fn toward_side(local: DVec3, from: DVec3, side: SheetSide) -> DVec3 {
    let up = (from.z > 0.0) == (side == SheetSide::Same);
    if up { local } else { DVec3::new(local.x, -local.y, -local.z) }
}

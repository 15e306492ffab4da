//! What scatters light at a point, as a path sees it: one interface for surfaces, lobes, closures and sensors.
//!
//! Directions are unit vectors away from the point: `from` where the path comes from, `toward` where it goes on. Integrators
//! ask for values, densities, samples and albedos, and never what it is that scatters.

use glam::DVec3;

use super::Spectrum;
use crate::sampling::PathSamples;

/// Direction in which a path runs. A measured table need not be reciprocal, so it must know which of the two directions is
/// that of the light (Veach 1997, section 5.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Travel {
    /// From a source: light comes from `from`.
    WithLight,
    /// From a sensor or an eye: light comes from `toward`.
    AgainstLight,
}

/// Side of a sheet on which a path goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SheetSide {
    /// That from which it comes: it is reflected.
    Same,
    /// The other one: it is transmitted.
    Other,
}

/// Ways in which light is scattered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// In all directions of a side: by a Lambertian surface, or by a table.
    Diffuse,
    /// Into a lobe about the mirror direction.
    Glossy,
    /// Into the mirror direction alone.
    Mirror,
    /// Straight on.
    Through,
}

/// The direction in which a path goes on.
#[derive(Clone, Copy, Debug)]
pub struct Scattered<const C: usize> {
    /// Unit vector away from the point.
    pub toward: DVec3,
    /// The way in which `toward` was chosen.
    pub kind: Kind,
    /// Density per sr with which any of the finite kinds chooses `toward`; of a mirror or of light that goes straight on, which
    /// have none, the probability of the choice.
    pub pdf: f64,
    /// Value of all finite kinds over `pdf`: what a path carries on that counts them together.
    pub weight: Spectrum<C>,
}

/// Something that scatters above one side of a surface with this unit normal.
#[derive(Debug)]
pub struct Oriented<'a, T> {
    /// What scatters.
    pub optics: &'a T,
    /// Unit vector.
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
    /// BSDF times |cosine| of `toward`, per sr, of the finite kinds: mirrors and what goes straight on have no value.
    fn value(&self, travel: Travel, from: DVec3, toward: DVec3) -> Spectrum<C>;

    /// Density per sr with which [`Self::sample`] chooses `toward` by a finite kind, given its side.
    fn pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> f64;

    /// Value and density together.
    fn value_and_pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> (Spectrum<C>, f64) {
        (self.value(travel, from, toward), self.pdf(travel, from, toward))
    }

    /// A direction on one side in which the path goes on; `None` where nothing is scattered to that side.
    fn sample(&self, travel: Travel, from: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>>;

    /// Share of the light from `from` that leaves on one side, all kinds together, in 0..=1.
    fn albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C>;

    /// What a path against the light may expect of [`Self::albedo`], > 0 wherever it can find light.
    fn likely_albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        self.albedo(from, side)
    }
}

/// A direction around +z on a side of a sheet in a plane z = const, seen from `from`.
pub(super) fn toward_side(local: DVec3, from: DVec3, side: SheetSide) -> DVec3 {
    let up = (from.z > 0.0) == (side == SheetSide::Same);
    if up { local } else { DVec3::new(local.x, -local.y, -local.z) }
}

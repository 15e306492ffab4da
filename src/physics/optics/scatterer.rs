//! Scatterers that can stand at a vertex of a path.

use std::f64::consts::PI;

use glam::DVec3;

use super::scatter::{Kind, Oriented, Scatter, Scattered, SheetSide, Travel};
use super::{Closure, Glossy, Spectrum, SurfaceOptics};
use crate::sampling::{PathSamples, warp};

/// One of the kinds of scatterers at a vertex.
#[derive(Clone, Copy, Debug)]
pub enum Scatterer<'a> {
    /// A sensor of illuminance.
    Sensor(CosineSensor),
    /// A surface of the room.
    Surface(Oriented<'a, SurfaceOptics>),
    /// A lobe of reflectance 1.
    Lobe(Oriented<'a, Glossy>),
    /// The closure of a tube's lower end.
    Closure(Closure<'a>),
}

/// A sensor of illuminance. Its value is the cosine, so that the radiance of paths times this value adds up to illuminance.
#[derive(Clone, Copy, Debug)]
pub struct CosineSensor {
    /// Unit normal, to the side that light falls on.
    pub normal: DVec3,
}

impl Scatterer<'_> {
    /// Returns pi times the BSDF of a scatterer that is Lambertian and has no other finite part on this side, so that light from extended
    /// sources has closed forms; `None` for others.
    pub fn lambertian<const C: usize>(&self, side: SheetSide) -> Option<Spectrum<C>> {
        match self {
            Self::Sensor(_) => Some(Spectrum([PI; C])),
            Self::Surface(surface) => surface.optics.lobe().is_none().then(|| surface.optics.diffuse()),
            Self::Lobe(_) => None,
            Self::Closure(closure) => closure.lambertian(side),
        }
    }

    /// True for a sensor.
    pub fn is_sensor(&self) -> bool {
        matches!(self, Self::Sensor(_))
    }

    /// True if the scatterer is a mirror alone: no ray that is aimed has a response.
    pub fn is_mirror(&self) -> bool {
        matches!(self, Self::Surface(surface) if !surface.optics.is_finite())
    }

    /// True if the scatterer has a lobe so narrow that connections meet it rarely.
    pub fn has_narrow_lobe(&self) -> bool {
        match self {
            Self::Surface(surface) => surface.optics.has_narrow_lobe(),
            Self::Sensor(_) | Self::Lobe(_) | Self::Closure(_) => false,
        }
    }
}

impl<const C: usize> Scatter<C> for Scatterer<'_> {
    #[inline]
    fn value(&self, travel: Travel, from: DVec3, toward: DVec3) -> Spectrum<C> {
        match self {
            Self::Sensor(sensor) => sensor.value(travel, from, toward),
            Self::Surface(surface) => surface.value(travel, from, toward),
            Self::Lobe(lobe) => lobe.value(travel, from, toward),
            Self::Closure(closure) => closure.value(travel, from, toward),
        }
    }

    #[inline]
    fn pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> f64 {
        match self {
            Self::Sensor(sensor) => Scatter::<C>::pdf(sensor, travel, from, toward),
            Self::Surface(surface) => Scatter::<C>::pdf(surface, travel, from, toward),
            Self::Lobe(lobe) => Scatter::<C>::pdf(lobe, travel, from, toward),
            Self::Closure(closure) => Scatter::<C>::pdf(closure, travel, from, toward),
        }
    }

    #[inline]
    fn value_and_pdf(&self, travel: Travel, from: DVec3, toward: DVec3) -> (Spectrum<C>, f64) {
        match self {
            Self::Sensor(sensor) => sensor.value_and_pdf(travel, from, toward),
            Self::Surface(surface) => surface.value_and_pdf(travel, from, toward),
            Self::Lobe(lobe) => lobe.value_and_pdf(travel, from, toward),
            Self::Closure(closure) => closure.value_and_pdf(travel, from, toward),
        }
    }

    #[inline]
    fn sample(&self, travel: Travel, from: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>> {
        match self {
            Self::Sensor(sensor) => sensor.sample(travel, from, side, samples),
            Self::Surface(surface) => surface.sample(travel, from, side, samples),
            Self::Lobe(lobe) => lobe.sample(travel, from, side, samples),
            Self::Closure(closure) => closure.sample(travel, from, side, samples),
        }
    }

    fn albedo(&self, from: DVec3, side: SheetSide) -> Spectrum<C> {
        match self {
            Self::Sensor(sensor) => sensor.albedo(from, side),
            Self::Surface(surface) => surface.albedo(from, side),
            Self::Lobe(lobe) => lobe.albedo(from, side),
            Self::Closure(closure) => closure.albedo(from, side),
        }
    }
}

impl<const C: usize> Scatter<C> for CosineSensor {
    fn value(&self, _: Travel, _: DVec3, toward: DVec3) -> Spectrum<C> {
        Spectrum([toward.dot(self.normal).max(0.0); C])
    }

    fn pdf(&self, _: Travel, _: DVec3, toward: DVec3) -> f64 {
        toward.dot(self.normal).max(0.0) / PI
    }

    fn sample(&self, _: Travel, _: DVec3, side: SheetSide, samples: &mut PathSamples) -> Option<Scattered<C>> {
        let local = warp::cosine_hemisphere(samples.pair());
        if side == SheetSide::Other || local.z <= 0.0 {
            return None;
        }
        let weight = Spectrum([PI; C]);
        Some(Scattered { toward: warp::around(self.normal, local), kind: Kind::Diffuse, pdf: local.z / PI, weight })
    }

    fn albedo(&self, _: DVec3, side: SheetSide) -> Spectrum<C> {
        if side == SheetSide::Same { Spectrum([PI; C]) } else { Spectrum::ZERO }
    }
}

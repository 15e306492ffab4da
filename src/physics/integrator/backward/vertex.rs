//! Vertices of paths that are followed backward.

use glam::DVec3;

use crate::optics::scatterer;
use crate::optics::{Closure, Oriented, Scatter, Scatterer, SheetSide, Spectrum, SurfaceOptics, Travel};
use crate::scene::Sensor;
use crate::traceable::{RoomHit, SurfaceId};

/// A point that scatters light toward the eye, or a sensor.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<'a, const C: usize> {
    pub position: DVec3,
    /// Unit normal toward the room.
    pub normal: DVec3,
    pub surface: Option<SurfaceId>,
    /// Unit vector toward the eye; at a closure it may be above, in the tube.
    pub eye: DVec3,
    /// What the path carries that arrives.
    pub weight: Spectrum<C>,
    pub scatterer: Scatterer<'a>,
}

impl<'a, const C: usize> Vertex<'a, C> {
    /// A sensor.
    pub fn sensor(Sensor { position, normal }: Sensor) -> Self {
        let scatterer = Scatterer::Sensor(scatterer::Sensor { normal });
        Self { position, normal, surface: None, eye: normal, weight: Spectrum::ONE, scatterer }
    }

    /// A surface of the room.
    pub fn surface(
        hit: &RoomHit,
        surface: SurfaceId,
        optics: &'a SurfaceOptics,
        eye: DVec3,
        weight: Spectrum<C>,
    ) -> Self {
        let RoomHit { position, normal, .. } = *hit;
        let scatterer = Scatterer::Surface(Oriented { optics, normal });
        Self { position, normal, surface: Some(surface), eye, weight, scatterer }
    }

    /// The lower side of a tube's closure.
    pub fn closure(position: DVec3, closure: Closure<'a>, eye: DVec3, weight: Spectrum<C>) -> Self {
        let scatterer = Scatterer::Closure(closure);
        Self { position, normal: DVec3::NEG_Z, surface: None, eye, weight, scatterer }
    }

    /// The side of the room, seen from the eye.
    pub fn side(&self) -> SheetSide {
        if self.eye.dot(self.normal) < 0.0 { SheetSide::Other } else { SheetSide::Same }
    }

    pub fn is_sensor(&self) -> bool {
        self.scatterer.is_sensor()
    }

    /// The path's weight times BSDF times cosine per sr for light from `toward`, and the density of the ray that goes on.
    #[inline]
    pub fn response(&self, toward: DVec3) -> (Spectrum<C>, f64) {
        if toward.dot(self.normal) <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let (value, pdf): (Spectrum<C>, f64) = self.scatterer.value_and_pdf(Travel::AgainstLight, self.eye, toward);
        (self.weight * value, pdf)
    }

    /// Density per sr with which light from `toward` goes on to the eye; 0 where no photon does.
    pub fn back(&self, toward: DVec3) -> f64 {
        match self.surface {
            Some(_) => Scatter::<C>::pdf(&self.scatterer, Travel::WithLight, toward, self.eye),
            None => 0.0,
        }
    }

    /// The path's weight times pi times BSDF, if it is Lambertian: light from extended sources then has closed forms.
    pub fn lambertian(&self) -> Option<Spectrum<C>> {
        self.scatterer.lambertian(self.side()).map(|albedo| self.weight * albedo)
    }

    /// True if the vertex has a lobe that connections rarely meet.
    pub fn is_narrow(&self) -> bool {
        self.scatterer.has_narrow_lobe()
    }
}

//! Vertices of paths that are followed backward.

use glam::DVec3;

use crate::optics::scatterer;
use crate::optics::{Closure, Oriented, Scatter, Scatterer, SheetSide, Spectrum, SurfaceOptics, Travel};
use crate::scene::Sensor;
use crate::traceable::{RoomHit, SurfaceId};

/// Vertex of a backward path: a point that scatters light toward the eye, or a sensor.
#[derive(Clone, Copy, Debug)]
pub struct Vertex<'a, const C: usize> {
    pub position: DVec3,
    /// Unit normal toward the room.
    pub normal: DVec3,
    pub surface: Option<SurfaceId>,
    /// Unit vector toward the eye; at a closure it may be above, in the tube.
    pub eye: DVec3,
    /// Weight (throughput) of the path that arrives.
    pub weight: Spectrum<C>,
    pub scatterer: Scatterer<'a>,
}

impl<'a, const C: usize> Vertex<'a, C> {
    /// Makes the vertex of a sensor.
    pub fn sensor(Sensor { position, normal }: Sensor) -> Self {
        let scatterer = Scatterer::Sensor(scatterer::CosineSensor { normal });
        Self { position, normal, surface: None, eye: normal, weight: Spectrum::ONE, scatterer }
    }

    /// Makes a vertex on a surface of the room.
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

    /// Makes a vertex on the lower side of a tube's closure, whose unit normal into the room is given.
    pub fn closure((position, normal): (DVec3, DVec3), closure: Closure<'a>, eye: DVec3, weight: Spectrum<C>) -> Self {
        let scatterer = Scatterer::Closure(closure);
        Self { position, normal, surface: None, eye, weight, scatterer }
    }

    /// Returns the side of the surface that faces the room, relative to the eye's side.
    pub fn side(&self) -> SheetSide {
        if self.eye.dot(self.normal) < 0.0 { SheetSide::Other } else { SheetSide::Same }
    }

    pub fn is_sensor(&self) -> bool {
        self.scatterer.is_sensor()
    }

    /// Returns the path's weight times BSDF times cosine per sr for light from `toward`, and the density per sr with which the scattered
    /// ray would take this direction.
    #[inline]
    pub fn response(&self, toward: DVec3) -> (Spectrum<C>, f64) {
        if toward.dot(self.normal) <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let (value, pdf): (Spectrum<C>, f64) = self.scatterer.value_and_pdf(Travel::AgainstLight, self.eye, toward);
        (self.weight * value, pdf)
    }

    /// Returns the density per sr with which a photon from `toward` is scattered toward the eye; 0 where photons are not scattered.
    pub fn back(&self, toward: DVec3) -> f64 {
        match self.surface {
            Some(_) => Scatter::<C>::pdf(&self.scatterer, Travel::WithLight, toward, self.eye),
            None => 0.0,
        }
    }

    /// Returns the path's weight times pi times BSDF, if this is Lambertian: light from extended sources then has closed forms.
    pub fn lambertian(&self) -> Option<Spectrum<C>> {
        self.scatterer.lambertian(self.side()).map(|albedo| self.weight * albedo)
    }

    /// True if the vertex has a lobe that connections rarely meet.
    pub fn is_narrow(&self) -> bool {
        self.scatterer.has_narrow_lobe()
    }
}

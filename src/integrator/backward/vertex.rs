//! Vertices of paths that are followed backward, and the rays that go on from them.

use std::f64::consts::PI;

use glam::DVec3;

use crate::optics::{Glossy, MeasuredDiffuser, Spectrum};
use crate::traceable::luminaire::TraceableLuminaire;
use crate::traceable::{NARROW_ROUGHNESS, SurfaceId, SurfaceOptics, TraceableScene};

/// A point that scatters light toward the eye with a finite distribution, or a sensor.
pub struct Vertex<'a, const C: usize> {
    pub position: DVec3,
    pub normal: DVec3,
    pub surface: Option<SurfaceId>,
    /// Unit vector toward the eye.
    pub eye: DVec3,
    /// The path's weight times the diffuse reflectance; for a sensor pi.
    pub diffuse: Spectrum<C>,
    /// The path's weight times its reflectance.
    pub lobe: Option<(&'a Glossy, Spectrum<C>)>,
    /// The probability with which the ray that goes on is one of the diffuse part.
    pub diffuse_share: f64,
    /// The lower side of a measured diffuser: pi times its distribution stands for the diffuse reflectance.
    pub table: Option<(&'a MeasuredDiffuser, Scatter)>,
}

/// Side of a closure, seen from the light, on which the eye is, and the cosine of the eye's direction.
#[derive(Clone, Copy)]
pub struct Scatter {
    pub transmitted: bool,
    pub eye_cosine: f64,
}

impl<const C: usize> Vertex<'_, C> {
    /// The path's weight times BSDF times cosine per sr for light from `toward`, and the density of the ray that goes on.
    #[inline]
    pub fn response(&self, toward: DVec3) -> (Spectrum<C>, f64) {
        let cosine = toward.dot(self.normal);
        if cosine <= 0.0 {
            return (Spectrum::ZERO, 0.0);
        }
        let scatters = self.table.map_or(1.0 / PI, |(table, Scatter { transmitted, eye_cosine })| {
            table.per_sr(transmitted, cosine, eye_cosine)
        });
        let mut response = self.diffuse * (scatters * cosine);
        let mut density = self.diffuse_share * cosine / PI;
        if let Some((lobe, weight)) = &self.lobe {
            let per_sr = lobe.density(self.normal, self.eye, toward);
            response += *weight * per_sr;
            density += (1.0 - self.diffuse_share) * per_sr;
        }
        (response, density)
    }

    /// True if light straight from luminaires has a closed form.
    pub(super) fn lambert(&self, scene: &TraceableScene) -> bool {
        !scene.luminaires_obstructed && self.lobe.is_none() && self.table.is_none()
    }

    /// True if the vertex has a lobe that connections rarely meet.
    pub fn is_narrow(&self) -> bool {
        self.lobe.is_some_and(|(lobe, _)| lobe.roughness() < NARROW_ROUGHNESS)
    }

    /// Describes this vertex to a ray that leaves it in a direction of `density`.
    pub(super) fn last(&self, scene: &TraceableScene, density: f64) -> Last {
        Last { position: self.position, density, lambert: self.lambert(scene), narrow: self.is_narrow() }
    }
}

/// The vertex that a ray comes from, where it is connected.
#[derive(Clone, Copy)]
pub struct Last {
    pub position: DVec3,
    /// Density of the ray's direction, per sr.
    pub density: f64,
    /// Light straight from luminaires is counted there in closed form.
    lambert: bool,
    /// The vertex has a lobe that connections rarely meet.
    pub narrow: bool,
}

/// A ray on its way through the room.
#[derive(Clone, Copy)]
pub struct Ray<const C: usize> {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    pub(super) from: Option<SurfaceId>,
    pub(super) weight: Spectrum<C>,
    /// `None`: no vertex counted what the ray finds.
    pub last: Option<Last>,
    /// True for a ray straight from the eye.
    pub from_eye: bool,
}

pub(super) fn lobe<const C: usize>(optics: &SurfaceOptics, weight: Spectrum<C>) -> Option<(&Glossy, Spectrum<C>)> {
    let specular = optics.specular.as_ref()?;
    Some((specular.lobe.as_deref()?, weight * Spectrum::from_rgb(specular.reflectance)))
}

/// The probability with which a surface sends a path on diffusely.
pub fn diffuse_share(optics: &SurfaceOptics) -> f64 {
    let brightest = |rgb: [f64; 3]| rgb.into_iter().fold(0.0, f64::max);
    let diffuse = brightest(optics.reflectance);
    match &optics.specular {
        Some(specular) if brightest(specular.reflectance) > 0.0 => {
            diffuse / (diffuse + brightest(specular.reflectance))
        }
        _ => 1.0,
    }
}

/// Density per sr of connecting to an even point of a luminaire along `way`; zero from behind it.
pub(super) fn luminaire_density(luminaire: &TraceableLuminaire, way: DVec3) -> f64 {
    let leaving = -way.dot(luminaire.normal);
    let distance_squared = way.length_squared();
    if leaving > 0.0 { distance_squared * distance_squared.sqrt() / (leaving * luminaire.area_m2) } else { 0.0 }
}

/// The share of a luminaire's light that a ray counts which finds it.
pub(super) fn luminaire_share(last: Last, luminaire: &TraceableLuminaire, position: DVec3) -> f64 {
    if last.lambert {
        return 0.0;
    }
    share(last.density, luminaire_density(luminaire, position - last.position))
}

/// The share of light that is counted where it was found with `density`, and not with `other`: the power heuristic.
pub fn share(density: f64, other: f64) -> f64 {
    if other == 0.0 { 1.0 } else { 1.0 / (1.0 + (other / density).powi(2)) }
}

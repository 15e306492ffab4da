//! Light subpaths: vertices of photons where light is scattered, with the flux that leaves them.

use std::f64::consts::PI;

use glam::DVec3;

use super::weight::{Edge, MisWeight};
use crate::integrator::photon::emission::{EmittedPhoton, Start};
use crate::integrator::photon::events::{Flight, Origin, Scattering, Visitor};
use crate::optics::{Oriented, Scatter, Scatterer, Spectrum, SurfaceOptics, Travel};
use crate::sampling::PathSamples;
use crate::traceable::{SurfaceId, TraceableScene};

/// Point where light leaves a source or a surface of the room.
#[derive(Clone, Copy, Debug)]
pub struct LightVertex<const C: usize> {
    pub position: DVec3,
    /// Unit normal toward the side on which the light leaves.
    pub normal: DVec3,
    /// Unit direction of travel of the light that arrives.
    incident: DVec3,
    pub surface: Option<SurfaceId>,
    /// Number of the tube at whose diffuser this is.
    diffuser: Option<usize>,
    /// True if the path starts here: at a diffuser or a luminaire.
    source: bool,
    /// Lambertian flux that leaves, in lm.
    outgoing: Spectrum<C>,
    /// Flux that leaves in a lobe, or at a measured diffuser the flux that arrives, in lm.
    lobe: Spectrum<C>,
    pub weight: MisWeight,
}

impl<const C: usize> LightVertex<C> {
    /// True if no eye path can find this vertex' light: connections to near sensors would have an infinite variance.
    pub fn alone(&self) -> bool {
        self.weight.cut == 0.0 && self.weight.behind == 0.0
    }

    /// Returns the intensity in lm/sr along the unit vector `outward`.
    pub fn intensity(&self, scene: &TraceableScene, outward: DVec3) -> Spectrum<C> {
        let cosine = outward.dot(self.normal);
        if cosine <= 0.0 {
            return Spectrum::ZERO;
        }
        let lambertian = self.outgoing * (cosine / PI);
        match self.scatterer(scene) {
            Some(scatterer) if self.lobe.max() > 0.0 => {
                lambertian + self.lobe * scatterer.value(Travel::WithLight, -self.incident, outward)
            }
            _ => lambertian,
        }
    }

    /// Returns the density per sr with which a photon leaves along `outward`.
    pub fn forward(&self, scene: &TraceableScene, outward: DVec3) -> f64 {
        match self.reflects(scene) {
            Some(surface) => Scatter::<C>::pdf(&surface, Travel::WithLight, -self.incident, outward),
            None => outward.dot(self.normal).max(0.0) / PI,
        }
    }

    /// Returns the density per sr with which an eye path that arrives against `outward` is scattered to the vertex before.
    pub fn back(&self, scene: &TraceableScene, outward: DVec3) -> f64 {
        let surface = self.reflects(scene);
        surface.map_or(0.0, |surface| Scatter::<C>::pdf(&surface, Travel::AgainstLight, outward, -self.incident))
    }

    /// Returns the surface that reflected the light; `None` where it comes from a source.
    fn reflects<'a>(&self, scene: &'a TraceableScene) -> Option<Oriented<'a, SurfaceOptics>> {
        let optics = self.surface.filter(|_| !self.source).and_then(|surface| scene.optics(surface))?;
        Some(Oriented { optics, normal: self.normal })
    }

    /// Returns the lobe or measured table that scatters light beside the Lambertian flux.
    fn scatterer<'a>(&self, scene: &'a TraceableScene) -> Option<Scatterer<'a>> {
        if let Some(tube) = self.diffuser {
            let closure = scene.tubes[tube].closure_at(self.position);
            return closure.table().map(|_| Scatterer::Closure(closure));
        }
        let lobe = scene.optics(self.surface?)?.lobe()?;
        Some(Scatterer::Lobe(Oriented { optics: lobe, normal: self.normal }))
    }
}

/// Subpaths of photons. One ends where it meets an opening from below: eye paths continue there, so that no path through an opening is cut
/// before it.
#[derive(Debug)]
pub struct LightPaths<const C: usize> {
    pub vertices: Vec<LightVertex<C>>,
    /// Number of the first vertex of every photon, and the end.
    pub starts: Vec<u32>,
}

impl<const C: usize> LightPaths<C> {
    pub fn new() -> Self {
        Self { vertices: Vec::new(), starts: vec![0] }
    }

    pub fn append(&mut self, other: &Self) {
        let first = self.vertices.len() as u32;
        self.vertices.extend_from_slice(&other.vertices);
        self.starts.extend(other.starts[1..].iter().map(|start| first + start));
    }

    /// Returns the vertices of photon `number`.
    pub fn of(&self, number: usize) -> &[LightVertex<C>] {
        &self.vertices[self.starts[number] as usize..self.starts[number + 1] as usize]
    }
}

/// Visitor that records the vertices of photons as they are traced.
pub struct Recorder<'a, const C: usize> {
    pub scene: &'a TraceableScene,
    pub paths: LightPaths<C>,
    /// Flights from a clear closure to the first surface.
    pub unscattered: Vec<Flight<C>>,
    /// Flights from vertices that no eye path can find.
    pub alone: Vec<Flight<C>>,
    /// Flights from mirrors that show a source, with the density of the photon's start where eye paths can find the source, else 0.
    pub mirrored: Vec<(Flight<C>, f64)>,
    /// Number of the tube by which the present photon comes; `None` for photons of luminaires.
    tube: Option<usize>,
    /// Density per m2 of the present photon's start, taken as uniform, and 1 if an eye path can find its source, else 0.
    start: f64,
    found: f64,
    edge: Edge,
    /// True if the edge starts at the source.
    from_source: bool,
    incident: DVec3,
    flights: u32,
    ended: bool,
}

impl<'a, const C: usize> Recorder<'a, C> {
    pub fn new(scene: &'a TraceableScene) -> Self {
        Self {
            scene,
            paths: LightPaths::new(),
            unscattered: Vec::new(),
            alone: Vec::new(),
            mirrored: Vec::new(),
            tube: None,
            start: 1.0,
            found: 0.0,
            edge: Edge::uncut(),
            from_source: true,
            incident: DVec3::ZERO,
            flights: 0,
            ended: false,
        }
    }

    /// Prepares for a photon; `start` is the density per m2 of its exit from an opening, or on a luminaire.
    pub fn begin(&mut self, photon: &EmittedPhoton, start: f64) {
        (self.start, self.found) = (start, if photon.sun { 0.0 } else { 1.0 });
        (self.flights, self.ended) = (0, false);
        self.tube = match photon.start {
            Start::Tube(tube) => Some(tube),
            Start::Luminaire(_) => None,
        };
    }

    /// Ends the subpath of a photon that was traced, or that found no light at its start; returns its vertices.
    pub fn end(&mut self) -> &[LightVertex<C>] {
        let first = self.paths.starts.last().map_or(0, |start| *start as usize);
        self.paths.starts.push(self.paths.vertices.len() as u32);
        &self.paths.vertices[first..]
    }

    fn source(&mut self, scattering: &Scattering<'_, C>) {
        self.push(scattering, true, MisWeight::start(self.start, self.found));
    }

    fn push(&mut self, scattering: &Scattering<'_, C>, source: bool, weight: MisWeight) {
        let Scattering { position, normal, outgoing, lobe, surface, diffuser } = *scattering;
        self.paths.vertices.push(LightVertex {
            position,
            normal,
            incident: lobe.map_or(self.incident, |lobe| lobe.incident),
            surface,
            diffuser,
            source,
            outgoing,
            lobe: lobe.map_or(Spectrum::ZERO, |lobe| lobe.flux),
            weight,
        });
    }
}

impl<const C: usize> Visitor<C> for Recorder<'_, C> {
    fn scattered(&mut self, scattering: &Scattering<'_, C>, _: &mut PathSamples) {
        if self.ended {
            return;
        }
        if scattering.diffuser.is_none() {
            let weight = self.edge.arrive(-self.incident.dot(scattering.normal));
            self.push(scattering, false, weight);
        } else if self.flights == 0 {
            self.source(scattering);
        } else {
            self.ended = true;
        }
    }

    fn emitted(&mut self, scattering: &Scattering<'_, C>, _: &mut PathSamples) {
        self.source(scattering);
    }

    fn flew(&mut self, flight: &Flight<C>) {
        let from_opening = matches!(flight.origin, Origin::Specular | Origin::Diffuser);
        let segment = flight.to - flight.from;
        let length = segment.length();
        // light that leaves an opening a second time has met it from below
        self.ended |= (from_opening && self.flights > 0) || length == 0.0;
        if self.ended {
            return;
        }
        let direction = segment / length;
        let mirror = |surface: SurfaceId| self.scene.optics(surface).is_some_and(SurfaceOptics::is_mirror);
        match flight.origin {
            Origin::Specular => {
                self.unscattered.push(*flight);
                let cosine = self.tube.map_or(direction.z, |tube| self.scene.tubes[tube].frame.up(direction)).abs();
                let start = MisWeight::start(self.start, self.found);
                self.edge = Edge::outgoing(&start, cosine / PI, cosine, 0.0, 0.0);
                self.from_source = true;
            }
            Origin::Lobe(surface) if mirror(surface) => {
                self.edge.turn();
                if self.from_source {
                    self.mirrored.push((*flight, self.found * self.start));
                }
            }
            Origin::Diffuser | Origin::Luminaire(_) | Origin::Surface(_) | Origin::Lobe(_) => {
                if let Some(vertex) = self.paths.vertices.last() {
                    let cosine = direction.dot(vertex.normal);
                    let density = vertex.forward(self.scene, direction);
                    let back = vertex.back(self.scene, direction);
                    self.edge = Edge::outgoing(&vertex.weight, density, cosine, back, 1.0);
                    self.from_source = vertex.source;
                    if vertex.alone() {
                        self.alone.push(*flight);
                    }
                }
            }
        }
        self.edge.extend(length);
        self.incident = direction;
        self.flights += 1;
    }

    fn arrived(&mut self, _: SurfaceId, _: DVec3, _: Spectrum<C>, _: Origin) {}
}

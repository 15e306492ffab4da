//! Photons that a pass stores while they are traced.

use glam::{DVec2, DVec3};

use super::grid::{LiesOn, Photon};
use crate::integrator::photon::emission::{EmittedPhoton, Start};
use crate::integrator::photon::events::{Flight, Origin, Scattering, Visitor};
use crate::optics::{Spectrum, SurfaceOptics};
use crate::sampling::PathSamples;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::{SurfaceId, TraceableScene, TraceableTube};

/// Selection of the photons that final gathering counts on planes.
#[derive(Debug)]
pub struct Caustics {
    /// Light that point sensors follow backward, so that no photons of it count for them, by tube.
    pub backward: Vec<FollowedBackward>,
}

/// Light from outside that passes a clear closure unscattered and that point sensors follow backward completely, so that photons must not
/// count it.
#[derive(Clone, Copy, Debug)]
pub struct FollowedBackward {
    pub sky: bool,
    pub sun: bool,
}

/// Tube whose diffuser a photon lies at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tube(pub u32);

impl LiesOn for Tube {
    fn number(self) -> u32 {
        self.0
    }
}

/// Kind of a photon's path so far.
#[derive(Clone, Copy, Debug, PartialEq)]
enum History {
    /// Photon that has not been in the room yet, nor met a diffuser; `sun` is the tube it comes through if it comes from the sun.
    New { sun: Option<usize> },
    /// Photon from the sun that came through the clear closure of a tube, and has met only mirrors and lobes since.
    Sunbeam(Sunbeam),
    /// Photon that no surface has scattered diffusely since it left a luminaire, a diffuser or a clear closure.
    Caustic,
    /// Photon that a surface has scattered diffusely since then.
    Diffuse,
}

/// Sunlight that has not been scattered diffusely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sunbeam {
    /// Tube through which it entered the room.
    pub tube: usize,
    /// Unit vector of travel.
    pub direction: DVec3,
}

impl History {
    /// Returns the history during a flight; `self` is the history before it.
    fn after<const C: usize>(self, flight: &Flight<C>) -> Self {
        match (flight.origin, self) {
            (Origin::Surface(_), _) | (Origin::Lobe(_), Self::Diffuse) => Self::Diffuse,
            (Origin::Specular, Self::New { sun: Some(tube) })
            | (Origin::Lobe(_) | Origin::Specular, Self::Sunbeam(Sunbeam { tube, .. })) => {
                Self::Sunbeam(Sunbeam { tube, direction: (flight.to - flight.from).normalize_or_zero() })
            }
            _ => Self::Caustic,
        }
    }
}

/// True if light comes directly from a diffuser or a luminaire: this light is computed without density estimation.
fn is_direct(origin: Origin) -> bool {
    matches!(origin, Origin::Diffuser | Origin::Luminaire(_))
}

/// Photons stored in one pass.
pub struct PhotonStore<'a, const C: usize> {
    scene: &'a TraceableScene,
    /// Height in m of each grid's plane, and true if its sensors are points.
    levels: Vec<(f64, bool)>,
    /// Height in m above a plane at which a flight counts as crossing it.
    contact: f64,
    keeps_surfaces: bool,
    set_apart: Option<&'a Caustics>,
    /// History of the present photon.
    history: History,
    pub surfaces: Vec<Photon<C>>,
    pub caustics: Vec<Photon<C>>,
    pub planes: Vec<Vec<Photon<C, ()>>>,
    pub exits: Vec<Vec<Photon<C, Tube>>>,
    pub incidents: Vec<Vec<DVec3>>,
    /// Sunbeams that arrive at glossy surfaces.
    pub beams: Vec<(Photon<C>, Sunbeam)>,
}

impl<'a, const C: usize> PhotonStore<'a, C> {
    pub fn new(
        scene: &'a TraceableScene,
        grids: &[Grid],
        keeps_surfaces: bool,
        set_apart: Option<&'a Caustics>,
    ) -> Self {
        Self {
            scene,
            levels: grids.iter().map(|grid| (grid.height_m, grid.estimate == EstimateKind::Point)).collect(),
            contact: scene.contact(),
            keeps_surfaces,
            set_apart,
            history: History::New { sun: None },
            surfaces: Vec::new(),
            caustics: Vec::new(),
            planes: vec![Vec::new(); grids.len()],
            exits: vec![Vec::new(); scene.tubes.len()],
            incidents: vec![Vec::new(); scene.tubes.len()],
            beams: Vec::new(),
        }
    }

    /// Starts a new photon's history.
    pub fn begin(&mut self, photon: &EmittedPhoton) {
        let tube = match photon.start {
            Start::Tube(tube) if photon.sun => Some(tube),
            Start::Tube(_) | Start::Luminaire(_) => None,
        };
        self.history = History::New { sun: tube };
    }

    /// True if position and flux of every photon are finite.
    pub fn is_finite(&self) -> bool {
        self.surfaces.iter().chain(&self.caustics).all(Photon::is_finite)
            && self.planes.iter().flatten().all(Photon::is_finite)
            && self.exits.iter().flatten().all(Photon::is_finite)
            && self.beams.iter().all(|(photon, _)| photon.is_finite())
    }

    /// Adds the photons of `other` after those stored here.
    pub fn append(&mut self, mut other: Self) {
        self.surfaces.append(&mut other.surfaces);
        self.caustics.append(&mut other.caustics);
        self.beams.append(&mut other.beams);
        for (all, part) in self.planes.iter_mut().zip(&mut other.planes) {
            all.append(part);
        }
        for (all, part) in self.exits.iter_mut().zip(&mut other.exits) {
            all.append(part);
        }
        for (all, part) in self.incidents.iter_mut().zip(&mut other.incidents) {
            all.append(part);
        }
    }
}

impl<const C: usize> Visitor<C> for PhotonStore<'_, C> {
    fn scattered(&mut self, scattering: &Scattering<'_, C>, _: &mut PathSamples) {
        if let Some(tube) = scattering.diffuser {
            self.history = History::Caustic;
            // of a lobe the arriving flux is stored, with its direction
            let flux = scattering.lobe.map_or(scattering.outgoing, |lobe| lobe.flux);
            self.incidents[tube].extend(scattering.lobe.map(|lobe| lobe.incident));
            let photon = Photon { position: scattering.position, on: Tube(tube as u32), flux };
            self.exits[tube].push(photon);
        }
    }

    fn emitted(&mut self, _: &Scattering<C>, _: &mut PathSamples) {}

    fn flew(&mut self, flight: &Flight<C>) {
        let sun_alone = match self.history {
            History::New { sun } => Some(sun.is_some()),
            _ => None,
        };
        self.history = self.history.after(flight);
        if is_direct(flight.origin) || (self.set_apart.is_some() && self.history == History::Diffuse) {
            return;
        }
        let backward = sun_alone.zip(self.set_apart).is_some_and(|(sun, caustics)| {
            let of_tube = caustics.at(self.scene, flight);
            of_tube.is_some_and(|backward| if sun { backward.sun } else { backward.sky })
        });
        for ((height, points), photons) in self.levels.iter().zip(&mut self.planes) {
            let level = height + self.contact;
            if flight.from.z > level && flight.to.z <= level && !(backward && *points) {
                let fraction = (flight.from.z - height) / (flight.from.z - flight.to.z);
                let crossing: DVec2 = flight.from.truncate().lerp(flight.to.truncate(), fraction);
                photons.push(Photon { position: crossing.extend(*height), on: (), flux: flight.flux });
            }
        }
    }

    fn arrived(&mut self, surface: SurfaceId, position: DVec3, flux: Spectrum<C>, origin: Origin) {
        if let History::Sunbeam(beam) = self.history
            && self.keeps_surfaces
            && self.scene.optics(surface).is_some_and(|optics| optics.lobe().is_some())
        {
            self.beams.push((Photon { position, on: surface, flux }, beam));
        }
        let gathers = || self.scene.optics(surface).is_some_and(SurfaceOptics::gathers);
        if self.keeps_surfaces && !is_direct(origin) && gathers() {
            self.surfaces.push(Photon { position, on: surface, flux });
            if self.set_apart.is_some() && self.history != History::Diffuse {
                self.caustics.push(Photon { position, on: surface, flux });
            }
        }
    }
}

impl Caustics {
    /// Returns the light that is followed backward at the tube through whose clear closure a flight comes.
    fn at<const C: usize>(&self, scene: &TraceableScene, flight: &Flight<C>) -> Option<FollowedBackward> {
        let apart = |tube: &TraceableTube| tube.distance_to_opening(flight.from);
        let tubes = scene.tubes.iter().map(apart).zip(&self.backward).filter(|_| flight.origin == Origin::Specular);
        tubes.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, backward)| *backward)
    }
}

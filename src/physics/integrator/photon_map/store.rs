//! The photons that a pass keeps, as they are traced.

use glam::{DVec2, DVec3};

use super::grid::{LiesOn, Photon};
use crate::integrator::photon::emission::{EmittedPhoton, Start};
use crate::integrator::photon::path::{Flight, Origin, Scattering, Visitor};
use crate::optics::{Spectrum, SurfaceOptics};
use crate::sampling::PathSamples;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::{SurfaceId, TraceableScene, TraceableTube};

/// Which photons final gathering counts on planes.
#[derive(Debug)]
pub struct Caustics {
    /// Light that sensors of points follow backward, and count no photons of, by tube.
    pub backward: Vec<FollowedBackward>,
}

/// Light from outside straight through a clear closure that point sensors follow backward completely, so that photons
/// must not count it.
#[derive(Clone, Copy, Debug)]
pub struct FollowedBackward {
    pub sky: bool,
    pub sun: bool,
}

/// The tube at whose diffuser a photon lies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tube(pub u32);

impl LiesOn for Tube {
    fn number(self) -> u32 {
        self.0
    }
}

/// What has happened to a photon so far.
#[derive(Clone, Copy, Debug, PartialEq)]
enum History {
    /// It was not in the room yet, nor met a diffuser; the tube by which it comes from the sun, if it does.
    New { sun: Option<usize> },
    /// It comes from the sun through the clear closure of a tube, and met nothing but mirrors and lobes since.
    Sunbeam(Sunbeam),
    /// No surface has scattered it diffusely since it left a luminaire, a diffuser or a clear closure.
    Caustic,
    /// A surface has scattered it diffusely since then.
    Diffuse,
}

/// Sunlight that nothing has scattered diffusely.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sunbeam {
    /// The tube by which it came in.
    pub tube: usize,
    /// Unit vector of travel.
    pub direction: DVec3,
}

impl History {
    /// The history during a flight, with this one before it.
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

/// True if light comes straight from where it is computed without density estimation.
fn is_direct(origin: Origin) -> bool {
    matches!(origin, Origin::Diffuser | Origin::Luminaire(_))
}

/// Photons that one pass keeps.
pub struct PhotonStore<'a, const C: usize> {
    scene: &'a TraceableScene,
    /// Height of each plane, and whether its sensors are points.
    levels: Vec<(f64, bool)>,
    /// Height above a plane at which it counts as reached.
    contact: f64,
    keeps_surfaces: bool,
    set_apart: Option<&'a Caustics>,
    /// The present photon's.
    history: History,
    pub surfaces: Vec<Photon<C>>,
    pub caustics: Vec<Photon<C>>,
    pub planes: Vec<Vec<Photon<C, ()>>>,
    pub exits: Vec<Vec<Photon<C, Tube>>>,
    pub incidents: Vec<Vec<DVec3>>,
    /// Sunbeams at glossy surfaces.
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

    /// Begins a photon.
    pub fn begin(&mut self, photon: &EmittedPhoton) {
        let tube = match photon.start {
            Start::Tube(tube) if photon.sun => Some(tube),
            Start::Tube(_) | Start::Luminaire(_) => None,
        };
        self.history = History::New { sun: tube };
    }

    /// True if place and flux of every photon are finite.
    pub fn is_finite(&self) -> bool {
        self.surfaces.iter().chain(&self.caustics).all(Photon::is_finite)
            && self.planes.iter().flatten().all(Photon::is_finite)
            && self.exits.iter().flatten().all(Photon::is_finite)
            && self.beams.iter().all(|(photon, _)| photon.is_finite())
    }

    /// Adds the photons of `other` after the own ones.
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
            // of a lobe what arrives counts, with its direction
            let flux = scattering.lobe.map_or(scattering.leaving, |lobe| lobe.flux);
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
                let share = (flight.from.z - height) / (flight.from.z - flight.to.z);
                let crossing: DVec2 = flight.from.truncate().lerp(flight.to.truncate(), share);
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
    /// Light that is followed backward of the tube whose clear closure a flight comes through.
    fn at<const C: usize>(&self, scene: &TraceableScene, flight: &Flight<C>) -> Option<FollowedBackward> {
        let apart = |tube: &TraceableTube| (flight.from - tube.origin).truncate().length() / tube.opening_radius;
        let tubes = scene.tubes.iter().map(apart).zip(&self.backward).filter(|_| flight.origin == Origin::Specular);
        tubes.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, backward)| *backward)
    }
}

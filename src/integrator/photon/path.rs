//! One photon's way from a collector through guide and diffuser into the room, or from a luminaire, and on until it is
//! absorbed.

use glam::DVec3;

use super::emission::{EmittedPhoton, Start};
use super::ledger::{Account, Ledger};
use crate::guide::{End, Transit};
use crate::integrator::roulette::{MAX_EVENTS, survival};
use crate::optics::{Closure, FiniteBsdf, Spectrum};
use crate::sampling::{PathSamples, warp};
use crate::traceable::{Place, RoomHit, SpecularOptics, SurfaceId, TraceableScene};

/// A point where light is scattered into the room.
#[derive(Clone, Copy, Debug)]
pub struct Scattering<'a, const C: usize> {
    /// The point in the room's frame, in m.
    pub position: DVec3,
    /// Unit normal toward the side on which the light leaves.
    pub normal: DVec3,
    /// Lambertian flux that leaves, in lm: an intensity of leaving cos / pi.
    pub leaving: Spectrum<C>,
    /// Light that leaves beside the Lambertian flux, finite in every direction but not Lambertian.
    pub lobe: Option<Lobe<'a, C>>,
    /// The surface; `None` at a diffuser.
    pub surface: Option<SurfaceId>,
    /// The tube at whose diffuser this happens.
    pub diffuser: Option<usize>,
}

/// Light that leaves a vertex with a finite, non-Lambertian distribution.
#[derive(Clone, Copy, Debug)]
pub struct Lobe<'a, const C: usize> {
    /// What sends the light on.
    pub scatterer: &'a dyn FiniteBsdf,
    /// Unit normal toward the side on which the light leaves.
    pub normal: DVec3,
    /// Unit direction of travel of the light that arrives.
    pub incident: DVec3,
    /// Flux that arrives, in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize> Lobe<'_, C> {
    /// Intensity in lm/sr (flux times BSDF times |cosine|) along the unit vector `outward`.
    #[inline]
    pub fn intensity(&self, outward: DVec3) -> Spectrum<C> {
        self.flux * Spectrum::from_rgb(self.scatterer.bsdf_cosine(self.normal, self.incident, outward))
    }
}

/// Light on a straight line through the room.
#[derive(Clone, Copy, Debug)]
pub struct Flight<const C: usize> {
    /// Point where the flight starts, in m.
    pub from: DVec3,
    /// Point where the flight ends, in m.
    pub to: DVec3,
    /// Flux on the way, in lm.
    pub flux: Spectrum<C>,
    /// What happened to the light last.
    pub origin: Origin,
}

/// Place where a flight starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A diffuser that scattered the light: its direct part has a better estimator than this photon.
    Diffuser,
    /// A surface of the room that scattered the light diffusely.
    Surface(SurfaceId),
    /// A surface of the room that reflected the light about its mirror direction, ideally or in a lobe: cell averages
    /// count all of it where it crosses, as it is not connected to them.
    Lobe(SurfaceId),
    /// An opening that the light passed unscattered.
    Specular,
    /// A luminaire: its direct part has a better estimator than this photon.
    Luminaire(SurfaceId),
}

/// Listener to the events of a photon's path.
pub trait Visitor<const C: usize> {
    /// Light is scattered at a surface or a closure, before the photon chooses how it goes on.
    fn scattered(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples);
    /// Light leaves a luminaire, as if scattered by it.
    fn emitted(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples);
    /// Light has crossed the room from one point to another, with nothing between.
    fn flew(&mut self, flight: &Flight<C>);
    /// Light arrives at a room surface, before its reflectance is applied.
    fn arrived(&mut self, surface: SurfaceId, position: DVec3, flux: Spectrum<C>, origin: Origin);
}

/// State of light after it has met a closure.
enum Step<const C: usize> {
    /// Into the room: position, direction, flux, what it left.
    Room(DVec3, DVec3, Spectrum<C>, Origin),
    /// Up into the guide of a tube: position in the ceiling plane, direction, flux.
    Guide(usize, DVec3, DVec3, Spectrum<C>),
    Ended,
}

/// Follows one photon to its end.
pub fn trace<const C: usize>(
    scene: &TraceableScene,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) {
    let (mut step, first) = match photon.start {
        Start::Tube(tube) => through_tube(scene, tube, photon, samples, visitor, account),
        Start::Luminaire(luminaire) => from_luminaire(scene, luminaire, photon, samples, visitor, account),
    };
    let mut events = 0;
    loop {
        events += 1;
        step = match step {
            Step::Ended => return,
            Step::Room(position, direction, flux, origin) => {
                if events > MAX_EVENTS {
                    account.ledger.cut += flux.luminance();
                    return;
                }
                cross_room(scene, position, direction, flux, origin, first, samples, visitor, account)
            }
            Step::Guide(index, position, direction, flux) => {
                if !scene.guide_return || !scene.tubes[index].guide.returns_light() {
                    account.ledger.guide_top += flux.luminance();
                    return;
                }
                let tube = &scene.tubes[index];
                let transit: Transit<C> = tube.guide.up(position - tube.origin, direction, &mut samples.random);
                account.rays += u64::from(transit.rays);
                match settle(&transit, flux, tube.origin, &mut account.ledger) {
                    None => return,
                    Some((position, direction, flux)) => {
                        meet_closure(scene, index, position, direction, flux, samples, visitor, account)
                    }
                }
            }
        };
    }
}

/// Light on its way to the collector of `index`; where it is then, and its first flux.
fn through_tube<const C: usize>(
    scene: &TraceableScene,
    index: usize,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) -> (Step<C>, f64) {
    let tube = &scene.tubes[index];
    let transit: Transit<C> = tube.guide.down(photon.position, photon.direction, &mut samples.random);
    account.rays += u64::from(transit.rays);
    let flux = Spectrum([photon.flux; C]);
    let first = flux.max();
    if !transit.entered {
        return (Step::Ended, first);
    }
    account.ledger.emitted += flux.luminance();
    account.tubes[index].at_collector += flux.luminance();
    let Some((position, direction, flux)) = settle(&transit, flux, tube.origin, &mut account.ledger) else {
        return (Step::Ended, first);
    };
    account.tubes[index].at_diffuser += flux.luminance();
    (meet_closure(scene, index, position, direction, flux, samples, visitor, account), first)
}

/// Light leaves luminaire `index`; where it is then, and its first flux.
fn from_luminaire<const C: usize>(
    scene: &TraceableScene,
    index: usize,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) -> (Step<C>, f64) {
    let luminaire = &scene.luminaires[index];
    let flux = Spectrum::from_rgb(luminaire.luminance) * photon.flux;
    account.ledger.luminaires += flux.luminance();
    let EmittedPhoton { position, direction, .. } = *photon;
    let (normal, surface) = (luminaire.normal, luminaire.surface);
    visitor.emitted(
        &Scattering { position, normal, leaving: flux, lobe: None, surface: Some(surface), diffuser: None },
        samples,
    );
    (Step::Room(position, direction, flux, Origin::Luminaire(surface)), flux.max())
}

/// Books what a guide took, and returns what arrives in the opening: position in the room, direction, flux.
fn settle<const C: usize>(
    transit: &Transit<C>,
    flux: Spectrum<C>,
    origin: DVec3,
    ledger: &mut Ledger,
) -> Option<(DVec3, DVec3, Spectrum<C>)> {
    let collected = flux * transit.collector;
    let arriving = collected * transit.mirrors;
    ledger.collector += flux.luminance() - collected.luminance();
    ledger.guide += collected.luminance() - arriving.luminance();
    match transit.end {
        End::Opening => {
            let mut position = origin + transit.position;
            position.z = origin.z;
            Some((position, transit.direction, arriving))
        }
        End::Top => {
            ledger.guide_top += arriving.luminance();
            None
        }
        End::Lost => {
            ledger.guide += arriving.luminance();
            None
        }
        End::Cut => {
            ledger.cut += arriving.luminance();
            None
        }
    }
}

/// Light meets the closure of tube `index`, from above or below.
#[allow(clippy::too_many_arguments)]
fn meet_closure<const C: usize>(
    scene: &TraceableScene,
    index: usize,
    position: DVec3,
    direction: DVec3,
    flux: Spectrum<C>,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) -> Step<C> {
    let from_above = direction.z < 0.0;
    let tube = &scene.tubes[index];
    let cosine = direction.z.abs();
    let (through, back, table) = match tube.closure_at(position) {
        Closure::Specular { transmittance } => {
            let passing = flux * Spectrum::from_rgb(transmittance);
            account.ledger.diffuser += flux.luminance() - passing.luminance();
            if passing.max() <= 0.0 {
                return Step::Ended;
            }
            if !from_above {
                return Step::Guide(index, position, direction, passing);
            }
            account.tubes[index].into_room += passing.luminance();
            return Step::Room(position, direction, passing, Origin::Specular);
        }
        Closure::Measured(table) => {
            let [through, back] = table.shares(cosine);
            (flux * through, flux * back, Some(table))
        }
        Closure::Lambertian { transmittance, reflectance } => {
            (flux * Spectrum::from_rgb(transmittance), flux * Spectrum::from_rgb(reflectance), None)
        }
    };
    account.ledger.diffuser += flux.luminance() - through.luminance() - back.luminance();
    let (down, up) = if from_above { (through, back) } else { (back, through) };
    if from_above {
        account.tubes[index].into_room += through.luminance();
    }
    if down.max() > 0.0 {
        let scattering = Scattering {
            position,
            normal: DVec3::NEG_Z,
            leaving: if table.is_none() { down } else { Spectrum::ZERO },
            lobe: table.map(|table| Lobe { scatterer: table, normal: DVec3::NEG_Z, incident: direction, flux }),
            surface: None,
            diffuser: Some(index),
        };
        visitor.scattered(&scattering, samples);
    }
    // what goes up a guide that returns nothing needs no path
    let follows_up = scene.guide_return && tube.guide.returns_light();
    let up = if follows_up {
        up
    } else {
        account.ledger.guide_top += up.luminance();
        Spectrum::ZERO
    };
    let both = up.max() + down.max();
    if both <= 0.0 {
        return Step::Ended;
    }
    // one of the two goes on, chosen by its flux
    let up_share = up.max() / both;
    let goes_up = up_share > 0.0 && samples.random.uniform() < up_share;
    let onward = if goes_up { up * (1.0 / up_share) } else { down * (1.0 / (1.0 - up_share)) };
    account.ledger.cut += down.luminance() + up.luminance() - onward.luminance();
    let local = match table {
        Some(table) => table.sample(goes_up != from_above, cosine, samples.pair()),
        None => warp::cosine_hemisphere(samples.pair()),
    };
    if goes_up {
        Step::Guide(index, position, local, onward)
    } else {
        Step::Room(position, DVec3::new(local.x, -local.y, -local.z), onward, Origin::Diffuser)
    }
}

/// One flight through the room and what happens at its end.
#[allow(clippy::too_many_arguments)]
fn cross_room<const C: usize>(
    scene: &TraceableScene,
    position: DVec3,
    direction: DVec3,
    flux: Spectrum<C>,
    origin: Origin,
    first: f64,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) -> Step<C> {
    let from = match origin {
        Origin::Surface(surface) | Origin::Lobe(surface) | Origin::Luminaire(surface) => Some(surface),
        Origin::Diffuser | Origin::Specular => None,
    };
    let hit = scene.intersect(position, direction, from);
    account.rays += 1;
    visitor.flew(&Flight { from: position, to: hit.position, flux, origin });
    let surface = match hit.place {
        Place::Opening(index) => {
            return meet_closure(scene, index, hit.position, direction, flux, samples, visitor, account);
        }
        Place::Surface(surface) => surface,
    };
    let Some(optics) = scene.optics(surface) else {
        account.ledger.open_surfaces += flux.luminance();
        return Step::Ended;
    };
    visitor.arrived(surface, hit.position, flux, origin);
    let leaving = flux * Spectrum::from_rgb(optics.reflectance);
    if let Some(specular) = &optics.specular
        && scene.interreflection
    {
        let arrival = Arrival { surface, hit, direction, flux, first };
        return reflect(specular, &arrival, leaving, samples, visitor, account);
    }
    if !scene.interreflection || leaving.max() <= 0.0 {
        account.ledger.room += flux.luminance();
        return Step::Ended;
    }
    let scattering = Scattering {
        position: hit.position,
        normal: hit.normal,
        leaving,
        lobe: None,
        surface: Some(surface),
        diffuser: None,
    };
    visitor.scattered(&scattering, samples);
    // roulette keeps the flux of a survivor; colours change its balance, so the ledger books both
    let survival = survival(leaving.max(), flux.max(), first);
    if samples.random.uniform() >= survival {
        account.ledger.room += flux.luminance();
        return Step::Ended;
    }
    let onward = leaving * (1.0 / survival);
    account.ledger.room += flux.luminance() - onward.luminance();
    let local = warp::cosine_hemisphere(samples.pair());
    Step::Room(hit.position, warp::around(hit.normal, local), onward, Origin::Surface(surface))
}

/// Light that arrives at a surface.
struct Arrival<const C: usize> {
    surface: SurfaceId,
    hit: RoomHit,
    direction: DVec3,
    flux: Spectrum<C>,
    /// Flux of the photon at its start.
    first: f64,
}

/// Reflects light at a surface with a specular part; `diffuse` is the flux that it reflects diffusely.
#[inline(never)]
fn reflect<const C: usize>(
    specular: &SpecularOptics,
    arrival: &Arrival<C>,
    diffuse: Spectrum<C>,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) -> Step<C> {
    let Arrival { surface, hit: RoomHit { position, normal, .. }, direction, flux, first } = *arrival;
    let reflected = flux * Spectrum::from_rgb(specular.reflectance);
    let leaving = diffuse + reflected;
    if leaving.max() <= 0.0 {
        account.ledger.room += flux.luminance();
        return Step::Ended;
    }
    let lobe =
        specular.lobe.as_deref().map(|scatterer| Lobe { scatterer, normal, incident: direction, flux: reflected });
    if lobe.is_some() || diffuse.max() > 0.0 {
        visitor.scattered(
            &Scattering { position, normal, leaving: diffuse, lobe, surface: Some(surface), diffuser: None },
            samples,
        );
    }
    let survival = survival(leaving.max(), flux.max(), first);
    if samples.random.uniform() >= survival {
        account.ledger.room += flux.luminance();
        return Step::Ended;
    }
    account.ledger.room += flux.luminance() - leaving.luminance() / survival;
    // one of the two parts, by flux
    let diffuse_share = diffuse.max() / (diffuse.max() + reflected.max());
    let (onward, toward, origin) = if samples.random.uniform() < diffuse_share {
        let toward = warp::around(normal, warp::cosine_hemisphere(samples.pair()));
        (diffuse * (1.0 / (diffuse_share * survival)), toward, Origin::Surface(surface))
    } else {
        let toward = specular.reflect(normal, -direction, samples.pair(), &mut samples.random);
        (reflected * (1.0 / ((1.0 - diffuse_share) * survival)), toward, Origin::Lobe(surface))
    };
    account.ledger.cut += leaving.luminance() / survival - onward.luminance();
    Step::Room(position, toward, onward, origin)
}

//! One photon's way from a collector through guide and diffuser into the room, or from a luminaire, and on until it is
//! absorbed.

use std::f64::consts::PI;

use glam::DVec3;

use super::emission::{EmittedPhoton, Start};
use super::ledger::{Account, EnergyLedger};
use crate::guide::Transit;
use crate::integrator::roulette::{MAX_EVENTS, survival};
use crate::optics::{Kind, Oriented, Scatter, Scatterer, SheetSide, Spectrum, SurfaceOptics, Travel};
use crate::sampling::PathSamples;
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableScene};

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
    pub scatterer: Scatterer<'a>,
    /// Unit direction of travel of the light that arrives.
    pub incident: DVec3,
    /// Flux that arrives, in lm.
    pub flux: Spectrum<C>,
}

impl<const C: usize> Lobe<'_, C> {
    /// Intensity in lm/sr (flux times BSDF times |cosine|) along the unit vector `outward`.
    #[inline]
    pub fn intensity(&self, outward: DVec3) -> Spectrum<C> {
        self.flux * self.scatterer.value(Travel::WithLight, -self.incident, outward)
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
    /// Share of the flux that first comes into the room above which light is reflected for certain, by less flux, not by
    /// roulette: many faint photons for few bright ones.
    const CERTAIN_ABOVE: f64 = f64::INFINITY;

    /// Light is scattered at a surface or a closure, before the photon chooses how it goes on.
    fn scattered(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples);
    /// Light leaves a luminaire, as if scattered by it.
    fn emitted(&mut self, scattering: &Scattering<'_, C>, samples: &mut PathSamples);
    /// Light has crossed the room from one point to another, with nothing between.
    fn flew(&mut self, flight: &Flight<C>);
    /// Light leaves the closure of a tube as from a Lambertian surface, `flux` of it in lm; it is followed no further here, but as that of
    /// a lamp. Only [`trace_beside_lamps`] tells of it.
    fn left_lamp(&mut self, _tube: usize, _position: DVec3, _flux: Spectrum<C>) {}
    /// Light arrives at a room surface, before its reflectance is applied.
    fn arrived(&mut self, surface: SurfaceId, position: DVec3, flux: Spectrum<C>, origin: Origin);
}

/// Follows one photon to its end.
pub fn trace<const C: usize>(
    scene: &TraceableScene,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) {
    Tracer { scene, samples, visitor, account, first: 0.0, into_room: 0.0, in_room: false, lamps: false }.trace(photon);
}

/// Follows one photon to its end, but for the part of its light that a closure sends evenly into the room: the listener hears of that
/// alone, and books it.
pub fn trace_beside_lamps<const C: usize>(
    scene: &TraceableScene,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    account: &mut Account,
) {
    Tracer { scene, samples, visitor, account, first: 0.0, into_room: 0.0, in_room: false, lamps: true }.trace(photon);
}

/// Books where light ends that a diffuser sends from `position` along the unit vector `direction` into the room, `flux` of it in lm.
pub fn book_in_room<const C: usize>(
    scene: &TraceableScene,
    (position, direction): (DVec3, DVec3),
    flux: Spectrum<C>,
    samples: &mut PathSamples,
    account: &mut Account,
) {
    let (first, visitor) = (flux.max(), &mut Silent);
    let mut tracer = Tracer { scene, samples, visitor, account, first, into_room: first, in_room: true, lamps: false };
    tracer.go_on(Step::Room(Beam { position, direction, flux }, Origin::Diffuser));
}

/// State of light after it has met something.
enum Step<const C: usize> {
    /// Into the room.
    Room(Beam<C>, Origin),
    /// Up into the guide of a tube, from the ceiling plane.
    Guide(usize, Beam<C>),
    Ended,
}

/// Light on its way.
#[derive(Clone, Copy)]
struct Beam<const C: usize> {
    position: DVec3,
    /// Unit vector.
    direction: DVec3,
    /// In lm.
    flux: Spectrum<C>,
}

/// One photon with all that it writes to.
struct Tracer<'a, V> {
    scene: &'a TraceableScene,
    samples: &'a mut PathSamples,
    visitor: &'a mut V,
    account: &'a mut Account,
    /// Largest channel of its first flux.
    first: f64,
    /// Largest channel of the flux that it first brought into the room.
    into_room: f64,
    /// True once the light has been in the room: what comes back through a closure then is no flux of its tube.
    in_room: bool,
    /// True if what a closure sends evenly into the room is followed elsewhere.
    lamps: bool,
}

impl<V> Tracer<'_, V> {
    fn trace<const C: usize>(&mut self, photon: &EmittedPhoton)
    where
        V: Visitor<C>,
    {
        let step = match photon.start {
            Start::Tube(tube) => self.through_tube(tube, photon),
            Start::Luminaire(luminaire) => self.leave_luminaire(luminaire, photon),
        };
        self.go_on(step);
    }

    /// Follows light to its end.
    fn go_on<const C: usize>(&mut self, mut step: Step<C>)
    where
        V: Visitor<C>,
    {
        let mut events = 0;
        loop {
            events += 1;
            step = match step {
                Step::Ended => return,
                Step::Room(beam, origin) => {
                    if !self.in_room {
                        (self.in_room, self.into_room) = (true, beam.flux.max());
                    }
                    if events > MAX_EVENTS {
                        self.account.ledger.cut += beam.flux.luminance();
                        return;
                    }
                    self.cross_room(beam, origin)
                }
                Step::Guide(index, beam) => self.back_up(index, beam),
            };
        }
    }

    /// Light on its way to the collector of a tube.
    fn through_tube<const C: usize>(&mut self, index: usize, photon: &EmittedPhoton) -> Step<C>
    where
        V: Visitor<C>,
    {
        let tube = &self.scene.tubes[index];
        let transit: Transit<C> = tube.guide.down(photon.position, photon.direction, &mut self.samples.random);
        self.account.rays += transit.ray_count();
        let flux = Spectrum([photon.flux; C]);
        self.first = flux.max();
        if !transit.entered {
            return Step::Ended;
        }
        self.account.ledger.emitted += flux.luminance();
        self.account.tubes[index].at_collector += flux.luminance();
        let Some(beam) = settle(&transit, flux, tube.origin, &mut self.account.ledger) else { return Step::Ended };
        self.account.tubes[index].at_diffuser += beam.flux.luminance();
        self.meet_closure(index, beam)
    }

    /// Light leaves a luminaire.
    fn leave_luminaire<const C: usize>(&mut self, index: usize, photon: &EmittedPhoton) -> Step<C>
    where
        V: Visitor<C>,
    {
        let luminaire = &self.scene.luminaires[index];
        let flux = Spectrum::from_rgb(luminaire.luminance) * photon.flux;
        self.first = flux.max();
        self.account.ledger.luminaires += flux.luminance();
        let EmittedPhoton { position, direction, .. } = *photon;
        let (normal, surface) = (luminaire.normal, luminaire.surface);
        self.visitor.emitted(
            &Scattering { position, normal, leaving: flux, lobe: None, surface: Some(surface), diffuser: None },
            self.samples,
        );
        Step::Room(Beam { position, direction, flux }, Origin::Luminaire(surface))
    }

    /// Light goes up a guide from its lower end.
    fn back_up<const C: usize>(&mut self, index: usize, beam: Beam<C>) -> Step<C>
    where
        V: Visitor<C>,
    {
        let tube = &self.scene.tubes[index];
        if !self.scene.guide_return || !tube.guide.returns_light() {
            self.account.ledger.guide_top += beam.flux.luminance();
            return Step::Ended;
        }
        let transit: Transit<C> = tube.guide.up(beam.position - tube.origin, beam.direction, &mut self.samples.random);
        self.account.rays += transit.ray_count();
        match settle(&transit, beam.flux, tube.origin, &mut self.account.ledger) {
            None => Step::Ended,
            Some(beam) => self.meet_closure(index, beam),
        }
    }

    /// Light meets the closure of a tube, from above or below.
    fn meet_closure<const C: usize>(&mut self, index: usize, beam: Beam<C>) -> Step<C>
    where
        V: Visitor<C>,
    {
        let Beam { position, direction, flux } = beam;
        let from_above = direction.z < 0.0;
        let tube = &self.scene.tubes[index];
        let closure = tube.closure_at(position);
        let (ledger, fluxes) = (&mut self.account.ledger, &mut self.account.tubes[index]);
        if let Some(transmittance) = closure.unscattered() {
            let passing = flux * transmittance;
            ledger.diffuser += flux.luminance() - passing.luminance();
            if passing.max() <= 0.0 {
                return Step::Ended;
            }
            let beam = Beam { flux: passing, ..beam };
            if !from_above {
                return Step::Guide(index, beam);
            }
            if !self.in_room {
                fluxes.into_room += passing.luminance();
            }
            return Step::Room(beam, Origin::Specular);
        }
        let [through, back]: [Spectrum<C>; 2] =
            [SheetSide::Other, SheetSide::Same].map(|side| flux * closure.albedo(-direction, side));
        ledger.diffuser += flux.luminance() - through.luminance() - back.luminance();
        let (down, up) = if from_above { (through, back) } else { (back, through) };
        // what a lamp sends, and what is left
        let (mut lamp, mut rest) = (Spectrum::ZERO, down);
        if from_above && !self.in_room {
            let evenly = flux * closure.even_share(-direction);
            fluxes.into_room += through.luminance();
            fluxes.evenly += evenly.luminance();
            if self.lamps {
                self.visitor.left_lamp(index, position, evenly);
                lamp = evenly;
                rest = if closure.table().is_some() { down + evenly * -1.0 } else { Spectrum::ZERO };
            }
        }
        let down = rest;
        if down.max() > 0.0 {
            // of a table the flux that arrives counts, with its direction
            let lobe =
                closure.table().map(|_| Lobe { scatterer: Scatterer::Closure(closure), incident: direction, flux });
            let leaving = if lobe.is_none() { down } else { lamp * -1.0 };
            let normal = DVec3::NEG_Z;
            self.visitor.scattered(
                &Scattering { position, normal, leaving, lobe, surface: None, diffuser: Some(index) },
                self.samples,
            );
        }
        // what goes up a guide that returns nothing needs no path
        let up = if self.scene.guide_return && tube.guide.returns_light() {
            up
        } else {
            ledger.guide_top += up.luminance();
            Spectrum::ZERO
        };
        let both = up.max() + down.max();
        if both <= 0.0 {
            return Step::Ended;
        }
        // one of the two goes on, chosen by its flux
        let up_share = up.max() / both;
        let goes_up = up_share > 0.0 && self.samples.random.uniform() < up_share;
        // the directions of all that goes down, of which the rest is a share
        let onward = if goes_up { up * (1.0 / up_share) } else { (down + lamp) * (1.0 / (1.0 - up_share)) };
        ledger.cut += down.luminance() + up.luminance() - onward.luminance();
        let side = if goes_up == from_above { SheetSide::Same } else { SheetSide::Other };
        let Some(scattered) = Scatter::<C>::sample(&closure, Travel::WithLight, -direction, side, self.samples) else {
            ledger.cut += onward.luminance();
            return Step::Ended;
        };
        let mut beam = Beam { position, direction: scattered.toward, flux: onward };
        if !goes_up && lamp.max() > 0.0 {
            let all: Spectrum<C> = closure.value(Travel::WithLight, -direction, scattered.toward);
            let evenly: Spectrum<C> = closure.even_share(-direction);
            let share = 1.0 - evenly.max() * (scattered.toward.z.abs() / PI) / all.max();
            beam.flux = onward * share.max(0.0);
            ledger.cut += onward.luminance() - beam.flux.luminance();
        }
        if goes_up { Step::Guide(index, beam) } else { Step::Room(beam, Origin::Diffuser) }
    }

    /// One flight through the room and what happens at its end.
    fn cross_room<const C: usize>(&mut self, beam: Beam<C>, origin: Origin) -> Step<C>
    where
        V: Visitor<C>,
    {
        let Beam { position, direction, flux } = beam;
        let from = match origin {
            Origin::Surface(surface) | Origin::Lobe(surface) | Origin::Luminaire(surface) => Some(surface),
            Origin::Diffuser | Origin::Specular => None,
        };
        let hit = self.scene.intersect(position, direction, from);
        self.account.rays += 1;
        self.visitor.flew(&Flight { from: position, to: hit.position, flux, origin });
        let surface = match hit.place {
            Place::Opening(index) => return self.meet_closure(index, Beam { position: hit.position, ..beam }),
            Place::Surface(surface) => surface,
        };
        let Some(optics) = self.scene.optics(surface) else {
            self.account.ledger.open_surfaces += flux.luminance();
            return Step::Ended;
        };
        self.visitor.arrived(surface, hit.position, flux, origin);
        if !self.scene.interreflection {
            self.account.ledger.room += flux.luminance();
            return Step::Ended;
        }
        self.reflect(surface, optics, &hit, Beam { position: hit.position, ..beam })
    }

    /// Reflects light that arrives at a surface.
    fn reflect<const C: usize>(
        &mut self,
        surface: SurfaceId,
        optics: &SurfaceOptics,
        hit: &RoomHit,
        beam: Beam<C>,
    ) -> Step<C>
    where
        V: Visitor<C>,
    {
        let Beam { position, direction, flux } = beam;
        let (normal, ledger) = (hit.normal, &mut self.account.ledger);
        let diffuse = flux * optics.diffuse();
        let leaving = diffuse + flux * optics.specular();
        if leaving.max() <= 0.0 {
            ledger.room += flux.luminance();
            return Step::Ended;
        }
        let lobe = optics.lobe().map(|lobe| Lobe {
            scatterer: Scatterer::Lobe(Oriented { optics: lobe, normal }),
            incident: direction,
            flux: flux * optics.specular(),
        });
        if lobe.is_some() || diffuse.max() > 0.0 {
            self.visitor.scattered(
                &Scattering { position, normal, leaving: diffuse, lobe, surface: Some(surface), diffuser: None },
                self.samples,
            );
        }
        // roulette keeps the flux of a survivor; colours change its balance, so the ledger books both
        let is_certain = leaving.max() >= V::CERTAIN_ABOVE * self.into_room;
        let survival = if is_certain { 1.0 } else { survival(leaving.max(), flux.max(), self.first) };
        if !is_certain && self.samples.random.uniform() >= survival {
            ledger.room += flux.luminance();
            return Step::Ended;
        }
        let expected = leaving * (1.0 / survival);
        ledger.room += flux.luminance() - expected.luminance();
        let sample = Oriented { optics, normal }.sample_apart(-direction, self.samples);
        let Some((toward, kind, weight)) = sample else {
            ledger.cut += expected.luminance();
            return Step::Ended;
        };
        // what is diffuse and what is not is counted apart
        let onward = flux * weight * (1.0 / survival);
        ledger.cut += expected.luminance() - onward.luminance();
        let origin = match kind {
            Kind::Diffuse | Kind::Through => Origin::Surface(surface),
            Kind::Glossy | Kind::Mirror => Origin::Lobe(surface),
        };
        Step::Room(Beam { position, direction: toward, flux: onward }, origin)
    }
}

/// Books what a guide took, and returns what arrives in the opening.
fn settle<const C: usize>(
    transit: &Transit<C>,
    flux: Spectrum<C>,
    origin: DVec3,
    ledger: &mut EnergyLedger,
) -> Option<Beam<C>> {
    let arriving = flux * transit.collector * transit.mirrors;
    ledger.book_transit(transit, flux, arriving).then(|| {
        let mut position = origin + transit.position;
        position.z = origin.z;
        Beam { position, direction: transit.direction, flux: arriving }
    })
}

/// A listener that hears of nothing: for the books alone.
#[derive(Clone, Copy, Debug)]
pub struct Silent;

impl<const C: usize> Visitor<C> for Silent {
    fn scattered(&mut self, _: &Scattering<'_, C>, _: &mut PathSamples) {}
    fn emitted(&mut self, _: &Scattering<'_, C>, _: &mut PathSamples) {}
    fn flew(&mut self, _: &Flight<C>) {}
    fn arrived(&mut self, _: SurfaceId, _: DVec3, _: Spectrum<C>, _: Origin) {}
}

//! Path of one photon from a collector through guide and closure into the room, or from a luminaire, until it is absorbed.

use std::f64::consts::PI;

use glam::DVec3;

use super::emission::{EmittedPhoton, Start};
use super::energy_balance::{EnergyBalance, PhotonTotals};
use super::events::{Flight, Lobe, Origin, Scattering, Silent, Visitor};
use crate::geometry::OpeningFrame;
use crate::guide::Transit;
use crate::integrator::roulette::{MAX_EVENTS, survival};
use crate::optics::{Kind, Oriented, Scatter, Scatterer, SheetSide, Spectrum, SurfaceOptics, Travel};
use crate::sampling::PathSamples;
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableScene};

/// Follows one photon to its end.
pub fn trace<const C: usize>(
    scene: &TraceableScene,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    totals: &mut PhotonTotals,
) {
    Tracer { scene, samples, visitor, totals, first: 0.0, into_room: 0.0, in_room: false, split: false }.trace(photon);
}

/// Follows one photon to its end, without the part of its light that leaves a closure with a Lambertian distribution: that part is passed
/// to [`Visitor::lambertian_exit`], and the visitor must add its flux to the energy balance.
pub fn trace_directional<const C: usize>(
    scene: &TraceableScene,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    visitor: &mut impl Visitor<C>,
    totals: &mut PhotonTotals,
) {
    Tracer { scene, samples, visitor, totals, first: 0.0, into_room: 0.0, in_room: false, split: true }.trace(photon);
}

/// Follows light of `flux` lm that a diffuser sends from `position` along the unit vector `direction` into the room, and adds the places
/// where it ends to the energy balance.
pub fn balance_in_room<const C: usize>(
    scene: &TraceableScene,
    (position, direction): (DVec3, DVec3),
    flux: Spectrum<C>,
    samples: &mut PathSamples,
    totals: &mut PhotonTotals,
) {
    let (first, visitor) = (flux.max(), &mut Silent);
    let mut tracer = Tracer { scene, samples, visitor, totals, first, into_room: first, in_room: true, split: false };
    tracer.go_on(Step::Room(Beam { position, direction, flux }, Origin::Diffuser));
}

/// State of light after it has met something.
enum Step<const C: usize> {
    /// Light that travels in the room.
    Room(Beam<C>, Origin),
    /// Light that travels up into the guide of a tube, from its opening.
    Guide(usize, Beam<C>),
    Ended,
}

/// Light at a point of its path.
#[derive(Clone, Copy)]
struct Beam<const C: usize> {
    position: DVec3,
    /// Unit vector of travel.
    direction: DVec3,
    /// Flux in lm.
    flux: Spectrum<C>,
}

/// One photon's path, with references to all that it writes to.
struct Tracer<'a, V> {
    scene: &'a TraceableScene,
    samples: &'a mut PathSamples,
    visitor: &'a mut V,
    totals: &'a mut PhotonTotals,
    /// Largest channel of the photon's first flux, in lm.
    first: f64,
    /// Largest channel of the flux with which the photon entered the room, in lm.
    into_room: f64,
    /// True once the light has entered the room: if it passes a closure again, it no longer counts as flux of that tube.
    in_room: bool,
    /// True if the Lambertian part of what a closure sends into the room is handed over and not followed here.
    split: bool,
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

    /// Follows light step by step to its end.
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
                        self.totals.energy.cut += beam.flux.luminance();
                        return;
                    }
                    self.cross_room(beam, origin)
                }
                Step::Guide(index, beam) => self.back_up(index, beam),
            };
        }
    }

    /// Follows light from outside down a tube to its closure.
    fn through_tube<const C: usize>(&mut self, index: usize, photon: &EmittedPhoton) -> Step<C>
    where
        V: Visitor<C>,
    {
        let tube = &self.scene.tubes[index];
        let transit: Transit<C> = tube.down(photon.position, photon.direction, &mut self.samples.random);
        self.totals.rays += transit.ray_count();
        let flux = Spectrum([photon.flux; C]);
        self.first = flux.max();
        if !transit.entered {
            return Step::Ended;
        }
        self.totals.energy.emitted += flux.luminance();
        self.totals.tubes[index].at_collector += flux.luminance();
        let Some(beam) = settle(&transit, flux, &tube.frame, &mut self.totals.energy) else { return Step::Ended };
        self.totals.tubes[index].at_diffuser += beam.flux.luminance();
        self.meet_closure(index, beam)
    }

    /// Starts light at a luminaire.
    fn leave_luminaire<const C: usize>(&mut self, index: usize, photon: &EmittedPhoton) -> Step<C>
    where
        V: Visitor<C>,
    {
        let luminaire = &self.scene.luminaires[index];
        let flux = Spectrum::from_rgb(luminaire.luminance) * photon.flux;
        self.first = flux.max();
        self.totals.energy.luminaires += flux.luminance();
        let EmittedPhoton { position, direction, .. } = *photon;
        let (normal, surface) = (luminaire.normal, luminaire.surface);
        self.visitor.emitted(
            &Scattering { position, normal, outgoing: flux, lobe: None, surface: Some(surface), diffuser: None },
            self.samples,
        );
        Step::Room(Beam { position, direction, flux }, Origin::Luminaire(surface))
    }

    /// Follows light up a guide from its lower end, and down again if it is reflected.
    fn back_up<const C: usize>(&mut self, index: usize, beam: Beam<C>) -> Step<C>
    where
        V: Visitor<C>,
    {
        let tube = &self.scene.tubes[index];
        if !self.scene.guide_return || !tube.guide.returns_light() {
            self.totals.energy.guide_top += beam.flux.luminance();
            return Step::Ended;
        }
        let transit: Transit<C> = tube.up(beam.position, beam.direction, &mut self.samples.random);
        self.totals.rays += transit.ray_count();
        match settle(&transit, beam.flux, &tube.frame, &mut self.totals.energy) {
            None => Step::Ended,
            Some(beam) => self.meet_closure(index, beam),
        }
    }

    /// Scatters light at the closure of a tube, from above or below.
    fn meet_closure<const C: usize>(&mut self, index: usize, beam: Beam<C>) -> Step<C>
    where
        V: Visitor<C>,
    {
        let Beam { position, direction, flux } = beam;
        let tube = &self.scene.tubes[index];
        let closure = tube.closure_at(position);
        let from_above = closure.up(direction) < 0.0;
        let (energy, fluxes) = (&mut self.totals.energy, &mut self.totals.tubes[index]);
        if let Some(transmittance) = closure.unscattered() {
            let passing = flux * transmittance;
            energy.diffuser += flux.luminance() - passing.luminance();
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
        energy.diffuser += flux.luminance() - through.luminance() - back.luminance();
        let (down, up) = if from_above { (through, back) } else { (back, through) };
        // the Lambertian part that is handed over, and the rest
        let (mut lambertian, mut rest) = (Spectrum::ZERO, down);
        if from_above && !self.in_room {
            let evenly = flux * closure.even_fraction(-direction);
            fluxes.into_room += through.luminance();
            fluxes.evenly += evenly.luminance();
            if self.split {
                self.visitor.lambertian_exit(index, position, evenly);
                lambertian = evenly;
                rest = if closure.table().is_some() { down + evenly * -1.0 } else { Spectrum::ZERO };
            }
        }
        let down = rest;
        if down.max() > 0.0 {
            // of a table the flux that arrives counts, with its direction
            let lobe =
                closure.table().map(|_| Lobe { scatterer: Scatterer::Closure(closure), incident: direction, flux });
            let outgoing = if lobe.is_none() { down } else { lambertian * -1.0 };
            let normal = tube.frame.normal();
            self.visitor.scattered(
                &Scattering { position, normal, outgoing, lobe, surface: None, diffuser: Some(index) },
                self.samples,
            );
        }
        // what goes up a guide that returns nothing needs no path
        let up = if self.scene.guide_return && tube.guide.returns_light() {
            up
        } else {
            energy.guide_top += up.luminance();
            Spectrum::ZERO
        };
        let both = up.max() + down.max();
        if both <= 0.0 {
            return Step::Ended;
        }
        // one of the two directions is followed, chosen by its flux
        let up_fraction = up.max() / both;
        let goes_up = up_fraction > 0.0 && self.samples.random.uniform() < up_fraction;
        // directions are sampled from all light that goes down, of which the rest is a fraction
        let onward = if goes_up { up * (1.0 / up_fraction) } else { (down + lambertian) * (1.0 / (1.0 - up_fraction)) };
        energy.cut += down.luminance() + up.luminance() - onward.luminance();
        let side = if goes_up == from_above { SheetSide::Same } else { SheetSide::Other };
        let Some(scattered) = Scatter::<C>::sample(&closure, Travel::WithLight, -direction, side, self.samples) else {
            energy.cut += onward.luminance();
            return Step::Ended;
        };
        let mut beam = Beam { position, direction: scattered.toward, flux: onward };
        if !goes_up && lambertian.max() > 0.0 {
            let all: Spectrum<C> = closure.value(Travel::WithLight, -direction, scattered.toward);
            let evenly: Spectrum<C> = closure.even_fraction(-direction);
            let fraction = 1.0 - evenly.max() * (closure.up(scattered.toward).abs() / PI) / all.max();
            beam.flux = onward * fraction.max(0.0);
            energy.cut += onward.luminance() - beam.flux.luminance();
        }
        if goes_up { Step::Guide(index, beam) } else { Step::Room(beam, Origin::Diffuser) }
    }

    /// Follows light along one flight through the room, and scatters it where it hits a surface or an opening.
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
        self.totals.rays += 1;
        self.visitor.flew(&Flight { from: position, to: hit.position, flux, origin });
        let surface = match hit.place {
            Place::Opening(index) => return self.meet_closure(index, Beam { position: hit.position, ..beam }),
            Place::Surface(surface) => surface,
        };
        let Some(optics) = self.scene.optics(surface) else {
            self.totals.energy.open_surfaces += flux.luminance();
            return Step::Ended;
        };
        self.visitor.arrived(surface, hit.position, flux, origin);
        if !self.scene.interreflection {
            self.totals.energy.room += flux.luminance();
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
        let (normal, energy) = (hit.normal, &mut self.totals.energy);
        let diffuse = flux * optics.diffuse();
        let outgoing = diffuse + flux * optics.specular();
        if outgoing.max() <= 0.0 {
            energy.room += flux.luminance();
            return Step::Ended;
        }
        let lobe = optics.lobe().map(|lobe| Lobe {
            scatterer: Scatterer::Lobe(Oriented { optics: lobe, normal }),
            incident: direction,
            flux: flux * optics.specular(),
        });
        if lobe.is_some() || diffuse.max() > 0.0 {
            self.visitor.scattered(
                &Scattering { position, normal, outgoing: diffuse, lobe, surface: Some(surface), diffuser: None },
                self.samples,
            );
        }
        // roulette keeps the flux of a survivor; colours change its balance, so the energy balance counts both
        let is_certain = outgoing.max() >= V::CERTAIN_ABOVE * self.into_room;
        let survival = if is_certain { 1.0 } else { survival(outgoing.max(), flux.max(), self.first) };
        if !is_certain && self.samples.random.uniform() >= survival {
            energy.room += flux.luminance();
            return Step::Ended;
        }
        let expected = outgoing * (1.0 / survival);
        energy.room += flux.luminance() - expected.luminance();
        let sample = Oriented { optics, normal }.sample_apart(-direction, self.samples);
        let Some((toward, kind, weight)) = sample else {
            energy.cut += expected.luminance();
            return Step::Ended;
        };
        // the diffuse and the specular part have separate entries
        let onward = flux * weight * (1.0 / survival);
        energy.cut += expected.luminance() - onward.luminance();
        let origin = match kind {
            Kind::Diffuse | Kind::Through => Origin::Surface(surface),
            Kind::Glossy | Kind::Mirror => Origin::Lobe(surface),
        };
        Step::Room(Beam { position, direction: toward, flux: onward }, origin)
    }
}

/// Adds what a guide took to the energy balance, and returns the light that arrives in the opening, if any.
fn settle<const C: usize>(
    transit: &Transit<C>,
    flux: Spectrum<C>,
    opening: &OpeningFrame,
    energy: &mut EnergyBalance,
) -> Option<Beam<C>> {
    let arriving = flux * transit.collector * transit.mirrors;
    energy.add_transit(transit, flux, arriving).then(|| {
        let position = opening.onto(opening.origin + transit.position);
        Beam { position, direction: transit.direction, flux: arriving }
    })
}

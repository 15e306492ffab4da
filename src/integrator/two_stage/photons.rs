//! What Lambertian diffusers send into the room: stage one of two.
//!
//! Photons go from sky and sun down each guide to its closure. A Lambertian closure forgets where they came from: the
//! points where they leave, with their fluxes, are all that the room sees of the sky. What they send to a vertex is
//! divided in three:
//! * rings of equal area have their mean exitance; a ring is the difference of two discs, whose irradiance has a closed form;
//! * sectors differ from the mean of their rings, most in the sun: a few points carry these differences, which add up to
//!   nothing in each ring;
//! * one photon, chosen by its flux, stands for what both leave out of it. So the whole is unbiased, and what chance adds to
//!   it is small.
//!
//! Where something may stand between, where a vertex' own horizon cuts the disc, or where it has a lobe, it is connected to
//! photons alone. Within a radius of the disc, connections to points have no useful variance: there the path follows the
//! light itself, as path tracing does.

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};

use super::cells::{Leaving, TubeLight};
use crate::guide::{End, Transit};
use crate::integrator::backward::daylight::Followed;
use crate::integrator::backward::vertex::{Ray, Vertex};
use crate::integrator::backward::walk::{Daylight, Path};
use crate::integrator::photon::chunks::fold_chunks;
use crate::integrator::photon::emission::{Emission, EmittedPhoton, Start};
use crate::integrator::photon::ledger::Account;
use crate::integrator::roulette::MAX_EVENTS;
use crate::optics::{Closure, Spectrum};
use crate::sampling::{Key, PathRandom, PathSamples, Replicate, Stream, warp};
use crate::traceable::{TraceableScene, TraceableTube};

/// Photons that a vertex is connected to where nothing has a closed form.
const CONNECTIONS: usize = 2;

/// The light that leaves the diffusers in one pass.
#[derive(Debug)]
pub(super) struct DiffuserLight<const C: usize> {
    tubes: Vec<TubeLight<C>>,
}

impl<const C: usize> DiffuserLight<C> {
    /// The light of one pass, with the fluxes of the tubes; `None` when cancelled. All closures are Lambertian.
    pub fn trace(
        scene: &TraceableScene,
        emission: &Emission,
        pass: Key,
        cancel: &AtomicBool,
    ) -> Option<(Self, Account)> {
        let chunk = |numbers: Range<u64>| {
            let mut account = Account::new(scene.tubes.len());
            let mut leaving = vec![Vec::new(); scene.tubes.len()];
            for number in numbers {
                let (photon, mut samples) = emission.photon(scene, pass, number);
                if let Some(photon) = photon
                    && let Start::Tube(tube) = photon.start
                {
                    descend(scene, tube, &photon, &mut samples, &mut leaving[tube], &mut account);
                }
            }
            (leaving, account)
        };
        let mut account = Account::new(scene.tubes.len());
        let mut all: Vec<Vec<Leaving<C>>> = vec![Vec::new(); scene.tubes.len()];
        fold_chunks(emission.photons(), 0, cancel, chunk, |(leaving, of_chunk): (Vec<Vec<Leaving<C>>>, Account)| {
            account.add(&of_chunk);
            all.iter_mut().zip(leaving).for_each(|(all, leaving)| all.extend(leaving));
        })?;
        let light = |(index, (tube, photons)): (usize, (&TraceableTube, Vec<Leaving<C>>))| {
            TubeLight::new(tube, photons, PathRandom::new(pass.stream(Stream::DiffuserChoice, index as u64)).uniform())
        };
        let tubes = scene.tubes.iter().zip(all).enumerate().map(light).collect();
        Some((Self { tubes }, account))
    }

    pub fn tubes(&self) -> &[TubeLight<C>] {
        &self.tubes
    }

    /// True if no point within `reach` of `position`, at its height, is near a diffuser.
    pub fn is_far(&self, position: DVec3, reach: f64) -> bool {
        self.tubes.iter().all(|tube| tube.is_far(position, reach))
    }

    /// Offsets in a cell of `size` for every photon of every tube, for [`Self::at_sensor`]; the same for all cells.
    pub fn offsets(&self, size: [f64; 2], stream: Key) -> Vec<Vec<DVec2>> {
        let offset = |stream: Key, number: usize| {
            let (replicate, index) = Replicate::of(stream, number as u64);
            let [u, v, ..] = replicate.point(index, 0);
            DVec2::new((u - 0.5) * size[0], (v - 0.5) * size[1])
        };
        let of_tube = |(index, tube): (usize, &TubeLight<C>)| {
            let stream = stream.stream(Stream::CellOffsets, index as u64);
            (0..tube.photons.len()).map(|number| offset(stream, number)).collect()
        };
        self.tubes.iter().enumerate().map(of_tube).collect()
    }

    /// Illuminance in lux of a horizontal sensor that sees all diffusers: every photon is connected to it, or to the point of
    /// a cell that its offset leads to.
    pub fn at_sensor(&self, position: DVec3, offsets: Option<&[Vec<DVec2>]>) -> f64 {
        let of_tube = |(index, tube): (usize, &TubeLight<C>)| {
            let depth = tube.origin.z - position.z;
            let mut sum = 0.0;
            for (number, photon) in tube.photons.iter().enumerate() {
                let mut away = photon.position - position.truncate();
                if let Some(offsets) = offsets {
                    away -= offsets[index][number];
                }
                let distance_squared = away.length_squared() + depth * depth;
                sum += photon.flux.luminance() / (distance_squared * distance_squared);
            }
            sum * depth * depth / PI
        };
        self.tubes.iter().enumerate().map(of_tube).sum()
    }
}

/// Follows light on its way to a collector down to the closure, and on as often as the tube returns it there; adds what
/// leaves into the room.
fn descend<const C: usize>(
    scene: &TraceableScene,
    index: usize,
    photon: &EmittedPhoton,
    samples: &mut PathSamples,
    leaving: &mut Vec<Leaving<C>>,
    account: &mut Account,
) {
    let tube = &scene.tubes[index];
    let mut transit: Transit<C> = tube.guide.down(photon.position, photon.direction, &mut samples.random);
    let mut flux = if transit.entered { Spectrum([photon.flux; C]) } else { Spectrum::ZERO };
    let returns = scene.guide_return && tube.guide.returns_light();
    account.tubes[index].at_collector += flux.luminance();
    for event in 0..MAX_EVENTS {
        account.rays += u64::from(transit.rays);
        flux *= transit.weight();
        if transit.end != End::Opening || flux.max() <= 0.0 {
            return;
        }
        if event == 0 {
            account.tubes[index].at_diffuser += flux.luminance();
        }
        let mut position = tube.origin + transit.position;
        position.z = tube.origin.z;
        let Closure::Lambertian { transmittance, reflectance } = tube.closure_at(position) else { return };
        let through = flux * Spectrum::from_rgb(transmittance);
        account.tubes[index].into_room += through.luminance();
        leaving.push(Leaving { position: position.truncate(), flux: through });
        let back = flux * Spectrum::from_rgb(reflectance);
        let survival = (back.max() / flux.max()).min(1.0);
        if !returns || samples.random.uniform() >= survival {
            return;
        }
        flux = back * (1.0 / survival);
        let direction = warp::cosine_hemisphere(samples.pair());
        transit = tube.guide.up(position - tube.origin, direction, &mut samples.random);
    }
}

impl<const C: usize> Daylight<C> for DiffuserLight<C> {
    fn connect(&self, path: &mut Path, vertex: &Vertex<C>, tube: usize, sum: &mut Spectrum<C>) {
        let light = &self.tubes[tube];
        if vertex.is_narrow() || !light.is_far(vertex.position, 0.0) {
            return Followed.connect(path, vertex, tube, sum);
        }
        let height = (light.origin - vertex.position).dot(vertex.normal);
        let reach = light.radius * vertex.normal.truncate().length();
        if height + reach <= 0.0 || light.choices.is_empty() {
            return;
        }
        // a wall that the disc touches is not cut by it
        let above = height >= reach - HORIZON * light.radius;
        let clear = || path.scene.leaves_clear(vertex.position, 0.0, vertex.surface, light.origin, light.radius);
        if above && vertex.lobe.is_none() && clear() {
            let number = path.samples.random.uniform();
            *sum += vertex.diffuse * light.irradiance(vertex.position, vertex.normal, number) * (1.0 / PI);
            return;
        }
        let numbers: [f64; CONNECTIONS] = path.samples.pair();
        for number in numbers {
            let Some((photon, _)) = light.choice(number) else { continue };
            let source = photon.position.extend(light.origin.z);
            let way = source - vertex.position;
            let distance_squared = way.length_squared();
            if let Some((response, _)) = path.respond(vertex, source, None) {
                let per_area = way.z / (PI * distance_squared * distance_squared.sqrt());
                *sum += response * photon.flux * (per_area / CONNECTIONS as f64);
            }
        }
    }

    fn found_share(&self, scene: &TraceableScene, tube: usize, ray: &Ray<C>, position: DVec3) -> Option<f64> {
        match ray.last {
            Some(last) if last.narrow || !self.tubes[tube].is_far(last.position, 0.0) => {
                Followed.found_share(scene, tube, ray, position)
            }
            Some(_) => None,
            // photons are connected to the eye, but by way of mirrors to nothing
            None => (!ray.from_eye).then_some(1.0),
        }
    }
}

/// Share of the radius by which a horizon may cut a disc from rounding alone.
const HORIZON: f64 = 1e-9;

/// Daylight that is counted by other means.
pub(super) struct CountedElsewhere;

impl<const C: usize> Daylight<C> for CountedElsewhere {
    fn connect(&self, _: &mut Path, _: &Vertex<C>, _: usize, _: &mut Spectrum<C>) {}

    fn found_share(&self, _: &TraceableScene, _: usize, _: &Ray<C>, _: DVec3) -> Option<f64> {
        None
    }
}

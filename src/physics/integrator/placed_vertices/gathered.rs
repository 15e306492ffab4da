//! Rooms in which boxes stand: sensors gather light from patches of the surfaces, and vertices send the sensors the residual.

use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::by_patches::gathering::Gathering;
use super::by_patches::indirect::Indirect;
use super::by_patches::known::{self, Known, Leaving};
use super::importance::Importance;
use super::lines::Scratch;
use super::outermost::Before;
use super::panels::panels;
use super::rough_light::Light;
use super::sent::Target;
use super::targets::{Sender, Sums, Targets};
use crate::guide::RayCount;
use crate::integrator::lamp::cells::TubeLight;
use crate::integrator::lamp::light::DiffuserLight;
use crate::integrator::photon::chunks::{Chunks, Tally, fold_chunks};
use crate::integrator::photon::ledger::Account;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Replicate, Stream};
use crate::traceable::{Spread, TOGETHER, TraceableScene};

/// Rays of a look at what patches have wrong of a place. With half as many a pass takes a tenth less time and has a fifth more variance,
/// with twice as many it is the other way round (the room of the thesis with 20 boxes and a chair, to 1 %).
const LOOKS: u64 = 16;

/// Rays of a sensor, in those of one that sees no opening: for how much of its light comes by reflection. The variance of a gather falls
/// with the power 1.2 of its rays, so that by the power 2 / 2.2 of that share rays are divided best.
const POWER_OF_SHARE: f64 = 0.9;
const SHARES: [f64; 3] = [1.0, 0.5, 0.25];

/// Rays that one task traces, about.
const RAYS_OF_CHUNK: u64 = 2048;

/// Vertices that one task looks at: each takes some microseconds.
const VERTICES_OF_CHUNK: u64 = 16;

/// Sensors that gather.
#[derive(Debug)]
pub struct Gatherers<const C: usize> {
    indirect: Arc<Indirect<C>>,
    sensors: Vec<Sensor>,
    /// Rays by the share of reflected light.
    rays: [u64; SHARES.len()],
}

/// A sensor that gathers.
#[derive(Clone, Copy, Debug)]
struct Sensor {
    /// Its place in the order of the targets.
    place: usize,
    position: DVec3,
    /// Squared distance in m2 below which no vertex is connected to it.
    near_squared: f64,
    /// Which of the numbers of rays it has.
    share: usize,
}

/// What is around the sensors.
#[derive(Clone, Copy, Debug)]
pub struct Around<'a> {
    /// What is traced.
    pub scene: &'a TraceableScene,
    /// All sensors.
    pub targets: &'a Targets,
    /// Where vertices are placed; `None` where none could be seen, or are needed.
    pub importance: Option<&'a Importance>,
    /// Vertices of a pass.
    pub vertices: u64,
}

/// What some sensors gather.
#[derive(Debug)]
struct OfSensors {
    /// Illuminances in lx.
    lux: Vec<f64>,
    rays: RayCount,
}

impl Tally for OfSensors {
    fn is_finite(&self) -> bool {
        self.lux.iter().all(|lux| lux.is_finite())
    }
}

/// Even directions about an axis.
fn even_spread(stream: Key, count: u64) -> Spread {
    let (replicate, first) = Replicate::of(stream, 0);
    let points = (0..count).map(|index| replicate.point(first + index as u16, 0));
    Spread::new(points.map(|[u, v, ..]| [u, v]))
}

impl<const C: usize> Gatherers<C> {
    /// Those of the sensors that are not in boxes; `rays`: of a sensor that sees no opening.
    pub fn new(scene: &TraceableScene, targets: &Targets, buried: &[bool], rays: u64) -> Self {
        let panels = panels(scene);
        let light = Light::new(scene, &panels);
        let sensor = |(place, target): (usize, Target)| {
            let share = libm::pow(light.indirect_share(target.position), POWER_OF_SHARE);
            // the nearest by their logarithms
            let nearest = SHARES.iter().position(|of| share > of * FRAC_1_SQRT_2);
            let Target { position, near_squared } = target;
            Sensor { place, position, near_squared, share: nearest.unwrap_or(SHARES.len() - 1) }
        };
        let sensors = targets.all().enumerate().filter(|(place, _)| !buried[*place]).map(sensor).collect();
        let groups = |share: f64| ((share * rays as f64 / TOGETHER as f64) as u64).max(1);
        let rays = SHARES.map(|share| groups(share) * TOGETHER as u64);
        Self { indirect: Indirect::of(scene, &panels), sensors, rays }
    }

    /// Makes all patches black.
    #[cfg(test)]
    pub fn forget(&mut self, scene: &TraceableScene, panels: &[super::panels::Panel]) {
        self.indirect = Indirect::unknowing(scene, panels);
    }

    /// Adds to `lux`, in lx per target, what sensors gather in a pass and what vertices send them; `None` when cancelled.
    pub fn pass(
        &self,
        around: &Around<'_>,
        light: &DiffuserLight<C>,
        pass: Key,
        cancel: &AtomicBool,
        (lux, account): (&mut [f64], &mut Account),
    ) -> Option<()> {
        let Self { indirect, sensors, rays } = self;
        let spreads = pass.stream(Stream::GatherSpreads, 0);
        let lumens: Vec<Spectrum<C>> = light.tubes().iter().map(TubeLight::flux).collect();
        let leaving = |tube: &TubeLight<C>| {
            Leaving::new(tube.choices.iter().map(|(photon, _)| photon.position), rays[0] as usize)
        };
        let gathering = Gathering {
            known: Known {
                scene: around.scene,
                indirect,
                lit: indirect.lit(&lumens),
                leaving: light.tubes().iter().map(leaving).collect(),
                vectors: pulp::Arch::new(),
            },
            light,
            looks: even_spread(spreads.child(SHARES.len() as u64), LOOKS),
        };
        let spreads: [Spread; SHARES.len()] =
            std::array::from_fn(|number| even_spread(spreads.child(number as u64), rays[number]));
        let of_sensors = |numbers: Range<u64>| {
            let mut scratch = known::Scratch::default();
            let mut of_sensor = |sensor: &Sensor| {
                let key = pass.stream(Stream::GatheringTarget, sensor.place as u64);
                let Sensor { position, near_squared, share, .. } = *sensor;
                let spread = &spreads[share];
                let mut lux = gathering.at_sensor(position, spread, key, &mut scratch);
                if near_squared > 0.0 {
                    lux += gathering.missing_near(position, near_squared, spread, key, &mut scratch);
                }
                lux.luminance()
            };
            let lux = sensors[numbers.start as usize..numbers.end as usize].iter().map(&mut of_sensor).collect();
            OfSensors { lux, rays: scratch.rays }
        };
        let mut places = sensors.iter().map(|sensor| sensor.place);
        let chunks = Chunks::of_size(sensors.len() as u64, RAYS_OF_CHUNK.div_ceil(rays[0]));
        let folded = fold_chunks(chunks, 0, cancel, of_sensors, |found: OfSensors| {
            // places last: none of them is taken for a value that is not there
            found.lux.iter().zip(&mut places).for_each(|(value, place)| lux[place] += value);
            account.rays += found.rays;
        })?;
        account.not_finite = account.not_finite.or(folded.not_finite);
        let Some(importance) = around.importance else { return Some(()) };
        let of_vertices = |numbers: Range<u64>| missing(around, importance, &gathering, pass, numbers);
        let chunks = Chunks::of_size(around.vertices, VERTICES_OF_CHUNK);
        let folded = fold_chunks(chunks, 8 * lux.len() as u64, cancel, of_vertices, |sums: Sums| {
            lux.iter_mut().zip(&sums.lux).for_each(|(sum, value)| *sum += value);
            account.rays += sums.rays;
        })?;
        account.not_finite = account.not_finite.or(folded.not_finite);
        Some(())
    }
}

/// What vertices of these numbers of a pass send to the targets: what patches have wrong there.
fn missing<const C: usize>(
    around: &Around<'_>,
    importance: &Importance,
    gathering: &Gathering<'_, C>,
    pass: Key,
    numbers: Range<u64>,
) -> Sums {
    let Around { scene, targets, vertices, .. } = *around;
    let mut lux = vec![0.0; targets.count()];
    let (stream, keys) = (pass.stream(Stream::PlacedVertices, 0), pass.stream(Stream::MissingAtVertex, 0));
    let (mut scratch, mut of_gathering) = (Scratch::default(), known::Scratch::default());
    for number in numbers {
        let mut samples = PathSamples::with_pairs(stream, number, 1);
        let placed = importance.place(scene, samples.pair());
        let Some(Before { origin, direction, at_once }) = Before::of(scene, &placed) else { continue };
        let hit = at_once.map(|surface| placed.hit(surface));
        let hit = hit.unwrap_or_else(|| scene.intersect(origin, direction, None));
        let Some(spot) = gathering.spot(&hit) else { continue };
        let missing = gathering.missing(spot, keys.child(number), &mut of_gathering);
        let intensity = missing.luminance() * placed.area_m2 / (PI * vertices as f64);
        let sender = Sender { position: origin, normal: placed.normal, intensity, of_box: placed.of_box };
        targets.connect(scene, &sender, &mut scratch, &mut lux);
    }
    Sums { lux, rays: of_gathering.rays }
}

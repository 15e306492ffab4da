//! Rooms in which something stands: sensors gather what patches know. What these may have wrong is a part of the error; where that is
//! too much, vertices send the sensors what is wrong.

use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;

use super::by_patches::gathering::Gathering;
use super::by_patches::indirect::{self, Indirect};
use super::by_patches::known::{self, Known, Leaving};
use super::importance::Importance;
use super::lines::Scratch;
use super::outermost::Before;
use super::panels::{Panel, panels};
use super::rough_light::Light;
use super::sent::Target;
use super::targets::{Sender, Sums, Targets};
use crate::guide::RayCount;
use crate::integrator::lamp::cells::TubeLight;
use crate::integrator::lamp::light::DiffuserLight;
use crate::integrator::photon::chunks::{Chunks, Tally, fold_chunks};
use crate::integrator::photon::ledger::Account;
use crate::kept::Kept;
use crate::optics::Spectrum;
use crate::sampling::{Key, PathSamples, Replicate, Stream};
use crate::traceable::{Fan, Spread, TOGETHER, TraceableScene, TraceableTube};

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

/// Sensors at which it is looked how much patches may have wrong, at most, and the rays of each.
const SENSORS_LOOKED_AT: usize = 32;
const RAYS_OF_LOOK: u64 = 512;

/// Rooms with sensors for which it is kept.
const MOST_KEPT: usize = 64;

/// Share of the error that is asked for up to which patches may be wrong where nothing puts them right: so much makes a job take a third
/// longer, vertices two or three times as long.
const SHARE_OF_ERROR: f64 = 0.5;

/// Sensors that gather.
#[derive(Debug)]
pub struct Gatherers<const C: usize> {
    indirect: Arc<Indirect<C>>,
    sensors: Vec<Sensor>,
    /// Rays by the share of reflected light.
    rays: [u64; SHARES.len()],
    /// True if vertices send what patches have wrong.
    puts_right: bool,
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
    /// What patches may have wrong of them, in lx of either sign.
    doubts: Vec<f64>,
    rays: RayCount,
}

impl Tally for OfSensors {
    fn is_finite(&self) -> bool {
        self.lux.iter().chain(&self.doubts).all(|lux| lux.is_finite())
    }
}

/// True if what patches may have wrong is no more than a share of the relative standard error `target`: the root mean square over some
/// of the sensors. Openings whose light comes back from a tube are not among what patches know.
pub fn are_patches_enough<const C: usize>(scene: &TraceableScene, sensors: &[DVec3], target: f64) -> bool {
    let is_known = |tube: &TraceableTube| {
        tube.diffuser.sheet_reflectance().is_some() && !(scene.guide_return && tube.guide.returns_light())
    };
    if !scene.tubes.iter().all(is_known) {
        return false;
    }
    let panels = panels(scene);
    let indirect = Indirect::<C>::of(scene, &panels);
    // no divisor of a row's length, so that every column has its turn
    let step = sensors.len().div_ceil(SENSORS_LOOKED_AT) | 1;
    let some: Vec<DVec3> = sensors.iter().step_by(step).copied().collect();
    let mut key = indirect::key::<C>(scene, &panels);
    key.extend(some.iter().flat_map(|sensor| sensor.to_array()).map(f64::to_bits));
    static DOUBTS: Kept<Vec<u64>, f64> = Kept::new(MOST_KEPT);
    let doubt = DOUBTS.get(key, || relative_doubt(scene, &panels, &indirect, &some));
    indirect.patches.are_several() && doubt <= SHARE_OF_ERROR * target
}

/// Root mean square of what patches may have wrong for some sensors, over their light.
fn relative_doubt<const C: usize>(
    scene: &TraceableScene,
    panels: &[Panel],
    indirect: &Indirect<C>,
    sensors: &[DVec3],
) -> f64 {
    let light = Light::of_openings(scene, panels, 1.0);
    let flux = |tube: &TraceableTube| Spectrum([PI * tube.opening_radius * tube.opening_radius; C]);
    let lumens: Vec<Spectrum<C>> = scene.tubes.iter().map(flux).collect();
    let (lit, vectors) = (indirect.lit(&lumens), pulp::Arch::new());
    let known = Known { scene, indirect, lit, leaving: Vec::new(), vectors };
    let spread = even_spread(Key::new(0), RAYS_OF_LOOK);
    let mut scratch = known::Scratch::default();
    let mut squares = 0.0;
    for position in sensors {
        known.look(&Fan::turned(*position, None, DVec3::Z, [0.0; 2], &spread), &mut scratch);
        squares += (known.doubt(&scratch) / RAYS_OF_LOOK as f64 * light.need(*position)).powi(2);
    }
    (squares / sensors.len().max(1) as f64).sqrt()
}

/// Even directions about an axis.
fn even_spread(stream: Key, count: u64) -> Spread {
    let (replicate, first) = Replicate::of(stream, 0);
    let points = (0..count).map(|index| replicate.point(first + index as u16, 0));
    Spread::new(points.map(|[u, v, ..]| [u, v]))
}

impl<const C: usize> Gatherers<C> {
    /// Those of the sensors that are not in boxes; `rays`: of a sensor that sees no opening; vertices send what patches have wrong, or
    /// that is a part of the error.
    pub fn new(scene: &TraceableScene, targets: &Targets, buried: &[bool], rays: u64, puts_right: bool) -> Self {
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
        Self { indirect: Indirect::of(scene, &panels), sensors, rays, puts_right }
    }

    /// Takes from patches all that they know.
    #[cfg(test)]
    pub fn forget(&mut self, scene: &TraceableScene, panels: &[Panel]) {
        self.indirect = Indirect::unknowing(scene, panels);
    }

    /// Adds what sensors gather in a pass, and what vertices send them, in lx per target; returns what may be wrong of that, if
    /// nothing puts it right. `None` when cancelled.
    pub fn pass(
        &self,
        around: &Around<'_>,
        light: &DiffuserLight<C>,
        pass: Key,
        cancel: &AtomicBool,
        (lux, account): (&mut [f64], &mut Account),
    ) -> Option<Vec<f64>> {
        let Self { indirect, sensors, rays, puts_right } = self;
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
                let (mut lux, doubt) = gathering.at_sensor(position, spread, key, &mut scratch);
                if *puts_right && near_squared > 0.0 {
                    lux += gathering.missing_near(position, near_squared, spread, key, &mut scratch);
                }
                (lux.luminance(), doubt)
            };
            let (lux, doubts) =
                sensors[numbers.start as usize..numbers.end as usize].iter().map(&mut of_sensor).unzip();
            OfSensors { lux, doubts, rays: scratch.rays }
        };
        let mut doubts = vec![0.0; if *puts_right { 0 } else { lux.len() }];
        let mut places = sensors.iter().map(|sensor| sensor.place);
        let chunks = Chunks::of_size(sensors.len() as u64, RAYS_OF_CHUNK.div_ceil(rays[0]));
        let folded = fold_chunks(chunks, 0, cancel, of_sensors, |found: OfSensors| {
            // places last: none of them is taken for a value that is not there
            for ((value, doubt), place) in found.lux.iter().zip(&found.doubts).zip(&mut places) {
                lux[place] += value;
                if !puts_right {
                    doubts[place] = *doubt;
                }
            }
            account.rays += found.rays;
        })?;
        account.not_finite = account.not_finite.or(folded.not_finite);
        let Some(importance) = around.importance.filter(|_| *puts_right) else { return Some(doubts) };
        let of_vertices = |numbers: Range<u64>| missing(around, importance, &gathering, pass, numbers);
        let chunks = Chunks::of_size(around.vertices, VERTICES_OF_CHUNK);
        let folded = fold_chunks(chunks, 8 * lux.len() as u64, cancel, of_vertices, |sums: Sums| {
            lux.iter_mut().zip(&sums.lux).for_each(|(sum, value)| *sum += value);
            account.rays += sums.rays;
        })?;
        account.not_finite = account.not_finite.or(folded.not_finite);
        Some(doubts)
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

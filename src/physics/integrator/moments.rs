//! Light tracing at many moments, each with its own sky and sun: a year of closures that let light pass with its direction.
//!
//! **Idea.** Photons from each patch of the sky find the sensors' daylight coefficients (Tregenza and Waters 1983); their products with the
//! luminances of the patches (means over the 577 of Reinhart 2001) are the light of all skies. The sun has photons of its own at every
//! moment, from its exact place: snapped to patches it would err by several times the light of a cell (docs/physics/years.md). Light that
//! no surface has scattered is estimated as by [light tracing](super::light_tracing) itself. Moments have equally many photons, because shares of time
//! weigh them equally.
//!
//! A pass is a replicate of all moments: the sky's part has the same noise in all of them, the sun's is independent.

use std::f64::consts::PI;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

use glam::DVec3;
use rayon::prelude::*;

use crate::guide::{Guide, RayCount};
use crate::integrator::backward::unscattered::{LooksUp, toward_outside, unscattered_sun};
use crate::integrator::diffuser_source::closure_source::is_lambertian;
use crate::integrator::light_tracing::{LightTracing, add_some_beams, refuses_points};
use crate::integrator::method::{Refusal, RefusalCode, Task};
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::close_points::dishonest_points;
use crate::integrator::photon::connect::SensorPlane;
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon_map::progressive::Carried;
use crate::integrator::{GridPass, Integrator, Pass};
use crate::sampling::{Key, Stream};
use crate::scene::{Channels, Grid, Sensor};
use crate::sky::patches::SkyPatches;
use crate::sky::{Moments, OutsidePart, SkyMoment, Sun};
use crate::traceable::{TraceableScene, TraceableTube};

/// Number of values of each sensor after those of the moments.
pub const SUMMARIES: usize = 2;

/// Division of the sky's patches.
const DIVISION: u32 = 2;

/// Number of the sky's patches.
const PATCHES: usize = 577;

/// Number of coefficients of a sensor: of the patches, of what is below the horizon, and of the ground.
pub const COEFFICIENTS: usize = PATCHES + 2;

/// Parts of the outside with one coefficient each.
const UNIFORM: [OutsidePart; 2] = [OutsidePart::BelowHorizon, OutsidePart::Ground];

/// Number of photons of the sun of a moment in a pass, and of a patch of the sky.
const PHOTONS: PassSize = PassSize { for_one_percent: 64.0, growth: 1.0, fewest: 16.0, most: 512.0 };
const PATCH_PHOTONS: PassSize = PassSize { for_one_percent: 32.0, growth: 1.0, fewest: 8.0, most: 256.0 };

/// Number of the first passes that compute the moments: a year averages over them, so that it needs fewer passes than a single sky.
const PASSES: u64 = 16;

/// Number of rays straight through clear closures for each photon.
const BEAMS_PER_PHOTON: u64 = 8;

/// Illuminance in lux from which on sunlight counts as direct (annual sunlight exposure, IES LM-83-12).
pub const DIRECT_LUX: f64 = 1000.0;

/// Returns the reason why sensors cannot be computed at many moments, if there is one.
pub fn refuses(task: &Task) -> Option<Refusal> {
    if task.has_placed_sensors() {
        let detail = "a year below closures that let light pass with its direction is computed for level grids only";
        return Some(Refusal::new(RefusalCode::PlacedSensors, detail));
    }
    let scene = task.traceable;
    let is_bent_and_clear =
        scene.tubes.iter().any(|tube| !matches!(tube.guide, Guide::Straight(_)) && tube.specular_zone().is_some());
    if task.has_points() && is_bent_and_clear {
        let detail = "the sun's beam through a clear closure of a bent, leaning, domed or meshed tube has no value at points: \
                      ask for `estimate` cell_average";
        return Some(Refusal::new(RefusalCode::ClearClosuresOfBentTubes, detail));
    }
    let of_points = task.has_points().then(|| refuses_points(scene)).flatten();
    of_points.or_else(|| dishonest_points(scene, task.grids)).map(|refusal| refusal.or("`estimate` cell_average"))
}

/// Returns the number of values of a sensor: its illuminances at the moments, the sum of these times their hours in lx h, and the occupied
/// hours in which unscattered light of the sun alone gives at least [`DIRECT_LUX`], which are those of points: the few rays of a pass tell of
/// no threshold in a cell.
///
/// With several years, each has its values after those of the one before.
pub fn columns(moments: usize) -> usize {
    moments + SUMMARIES
}

/// Returns the number of values of a sensor with several years, given the moments of each.
pub fn columns_of_all(years: impl IntoIterator<Item = usize>) -> usize {
    years.into_iter().map(columns).sum()
}

/// Method of grids whose passes have the illuminances at many moments, too.
struct AtMoments<const C: usize> {
    method: Box<dyn Integrator>,
    tracing: LightTracing<C>,
    looks_up: LooksUp,
    moments: Arc<Moments>,
    patches: SkyPatches,
    /// Luminances in cd/m2 that the coefficients belong to, moment by moment; computed in the first pass.
    luminances: OnceLock<Vec<Vec<f64>>>,
    /// Numbers of photons of each moment, and of each patch.
    photons: [u64; 2],
    seed: Key,
}

/// Adds the moments of a scene, if it has any, to a method of its grids, in passes for a relative standard error `target`; equal seeds give
/// equal bits.
pub fn at_moments(method: Box<dyn Integrator>, task: &Task, seed: u64, target: f64) -> Box<dyn Integrator> {
    let Some(moments) = task.scene.moments.clone() else { return method };
    let room = (task.traceable, task.grids);
    match task.scene.channels {
        Channels::Photopic => Box::new(AtMoments::<1>::new(method, room, moments, (seed, target))),
        Channels::Rgb => Box::new(AtMoments::<3>::new(method, room, moments, (seed, target))),
    }
}

impl<const C: usize> AtMoments<C> {
    fn new(
        method: Box<dyn Integrator>,
        (scene, grids): (&Arc<TraceableScene>, &[Grid]),
        moments: Arc<Moments>,
        (seed, target): (u64, f64),
    ) -> Self {
        Self {
            method,
            tracing: LightTracing::emitting(scene.clone(), Emission::default(), grids, target, seed),
            looks_up: LooksUp::new(target),
            moments,
            patches: SkyPatches::new(DIVISION),
            luminances: OnceLock::new(),
            photons: [PHOTONS, PATCH_PHOTONS].map(|size| size.power_of_two(target)),
            seed: Key::new(seed),
        }
    }

    /// Computes a replicate of the values of all sensors, sensor by sensor, and the number of rays; `None` when cancelled.
    fn replicate(&self, pass: u64, cancel: &AtomicBool) -> Option<(Vec<Vec<f64>>, RayCount)> {
        let key = self.seed.stream(Stream::MomentPass, pass);
        let (of_sky, mut rays) = self.coefficients(key, cancel)?;
        let of_moment = |(number, moment): (usize, &SkyMoment)| {
            (!cancel.load(Ordering::Relaxed))
                .then(|| self.sunlight(key.stream(Stream::OfMoment, number as u64), moment))
        };
        let moments: Vec<&SkyMoment> = self.moments.years.iter().flatten().collect();
        let suns: Option<Vec<Light>> = moments.par_iter().copied().enumerate().map(of_moment).collect();
        let suns = suns?;
        rays += suns.iter().map(|sun| sun.rays).sum::<RayCount>();
        let luminances = self.luminances.get_or_init(|| luminances(&moments, &self.patches));
        let of_sensor = |(sensor, coefficients): (usize, &Vec<f64>)| {
            let mut values = Vec::with_capacity(columns_of_all(self.moments.years.iter().map(Vec::len)));
            let mut lit = suns.iter().zip(luminances);
            for year in self.moments.years.iter() {
                let [mut exposure, mut direct_hours] = [0.0; 2];
                for (moment, (sun, luminances)) in year.iter().zip(&mut lit) {
                    let of_sun = |lux: &[f64]| lux.get(sensor).copied().unwrap_or(0.0);
                    let direct = of_sun(&sun.unscattered);
                    let lux = dot(coefficients, luminances) + of_sun(&sun.scattered) + direct;
                    exposure += moment.hours * lux;
                    direct_hours += if direct >= DIRECT_LUX { moment.occupied_hours } else { 0.0 };
                    values.push(lux);
                }
                values.extend([exposure, direct_hours]);
            }
            values
        };
        Some((of_sky.par_iter().enumerate().map(of_sensor).collect(), rays))
    }

    /// Computes the illuminance in lx of each sensor by each patch of the sky per cd/m2, by what is below the horizon and by the ground, and
    /// the number of rays; `None` when cancelled.
    fn coefficients(&self, key: Key, cancel: &AtomicBool) -> Option<(Vec<Vec<f64>>, RayCount)> {
        let [_, photons] = self.photons;
        let (LightTracing { scene, sensors, .. }, looks_up) = (&self.tracing, self.looks_up);
        let mut rays = RayCount::default();
        let of_part = |part: OutsidePart| -> Option<Vec<Light>> {
            let of_patch = |(number, patch)| {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let key = key.stream(Stream::OfPatch, (part as usize * PATCHES + number) as u64);
                Some(self.by_photons(
                    key,
                    |photons| Emission::of_patch(scene, (patch, part), |tube| self.counts(tube), photons),
                    photons,
                ))
            };
            self.patches.all().par_iter().enumerate().map(of_patch).collect()
        };
        let mut by_patch = of_part(OutsidePart::Sky)?;
        for part in UNIFORM {
            let mut whole = Light::dark(self.tracing.sensor_count());
            if scene.tubes.iter().any(|tube| tube.surroundings.is_some()) {
                of_part(part)?.iter().for_each(|light| whole.add(light));
            }
            by_patch.push(whole);
        }
        rays += by_patch.iter().map(|light| light.rays).sum::<RayCount>();
        let of_sensor = |(plane, index): (&SensorPlane, usize)| {
            let sensor = plane.first + index;
            let value = |light: &Light| light.scattered[sensor] + light.unscattered.get(sensor).copied().unwrap_or(0.0);
            let mut coefficients: Vec<f64> = by_patch.iter().map(value).collect();
            let rays = match plane.average {
                true => RayCount::default(),
                false => {
                    let stream = key.stream(Stream::Unscattered, sensor as u64);
                    toward_outside(scene, sensor_of(plane, index), stream, looks_up, |part, per_luminance, toward| {
                        let number = match part {
                            OutsidePart::Sky => self.patches.number_at(toward),
                            OutsidePart::BelowHorizon => Some(PATCHES),
                            OutsidePart::Ground => Some(PATCHES + 1),
                        };
                        if let Some(number) = number {
                            coefficients[number] += per_luminance;
                        }
                    })
                }
            };
            (coefficients, rays)
        };
        let places: Vec<(&SensorPlane, usize)> =
            sensors.iter().flat_map(|plane| (0..plane.len()).map(move |index| (plane, index))).collect();
        let (coefficients, of_sensors): (Vec<_>, Vec<_>) = places.into_par_iter().map(of_sensor).unzip();
        rays += of_sensors.into_iter().sum::<RayCount>();
        Some((coefficients, rays))
    }

    /// True if the light of a tube counts.
    fn counts(&self, tube: &TraceableTube) -> bool {
        !(self.moments.of_directional_alone && is_lambertian(tube))
    }

    /// Computes the light of the sun of a moment.
    fn sunlight(&self, key: Key, moment: &SkyMoment) -> Light {
        let (LightTracing { scene, sensors, .. }, looks_up) = (&self.tracing, self.looks_up);
        if moment.direct_normal_lux <= 0.0 {
            return Light::default();
        }
        let sun = Sun { direction: moment.sun, normal_illuminance_lux: moment.direct_normal_lux };
        let emission = |photons| Emission::of_sun(scene, sun, |tube| self.counts(tube), photons);
        let mut light = self.by_photons(key, emission, self.photons[0]);
        for plane in sensors.iter().filter(|plane| !plane.average) {
            for index in 0..plane.len() {
                let sensor = plane.first + index;
                let stream = key.stream(Stream::Unscattered, sensor as u64);
                let (lux, rays) = unscattered_sun(scene, sensor_of(plane, index), stream, looks_up, &sun);
                light.unscattered[sensor] += lux;
                light.rays += rays;
            }
        }
        light
    }

    /// Traces `photons` of an emission to all sensors, and to cells also rays that are followed only up to their first flight in the room.
    fn by_photons(&self, key: Key, emission: impl Fn(u64) -> Emission, photons: u64) -> Light {
        let LightTracing { scene, sensors, .. } = &self.tracing;
        let of_photons = emission(photons);
        let sums = self.tracing.photons(&of_photons, key, 0..of_photons.photons());
        let mut light = Light { unscattered: vec![0.0; sums.lux.len()], scattered: sums.lux, rays: sums.totals.rays };
        let has_beams = self.tracing.beams.is_some();
        if let Some(plane) = sensors.iter().find(|plane| has_beams && plane.average) {
            let beams = emission(BEAMS_PER_PHOTON * photons);
            let (stream, numbers) = (key.stream(Stream::Unscattered, plane.first as u64), 0..beams.photons());
            let sums = &mut light.unscattered;
            light.rays += add_some_beams::<C>((scene, sensors), (&beams, numbers), stream, sums);
        }
        light
    }
}

/// Light of one sun or patch at all sensors in lx: what the room or a closure has scattered, and the rest; empty where there is none.
#[derive(Clone, Debug, Default)]
struct Light {
    scattered: Vec<f64>,
    unscattered: Vec<f64>,
    rays: RayCount,
}

impl Light {
    fn dark(sensors: usize) -> Self {
        Self { scattered: vec![0.0; sensors], unscattered: vec![0.0; sensors], rays: RayCount::default() }
    }

    fn add(&mut self, other: &Self) {
        self.scattered.iter_mut().zip(&other.scattered).for_each(|(sum, lux)| *sum += lux);
        self.unscattered.iter_mut().zip(&other.unscattered).for_each(|(sum, lux)| *sum += lux);
        self.rays += other.rays;
    }
}

fn sensor_of(plane: &SensorPlane, index: usize) -> Sensor {
    Sensor { position: DVec3::new(plane.x[index], plane.y[index], plane.height), normal: DVec3::Z }
}

/// Computes the mean luminances of all patches in cd/m2 at each moment, which give the moment's horizontal illuminance exactly, and the
/// luminances to which those below the horizon and of the ground are relative.
fn luminances(moments: &[&SkyMoment], patches: &SkyPatches) -> Vec<Vec<f64>> {
    let of_moment = |moment: &&SkyMoment| {
        let mut means: Vec<f64> = patches
            .all()
            .iter()
            .map(|patch| patch.mean(|toward| moment.distribution.relative_luminance(toward)))
            .collect();
        let relative: f64 = means.iter().zip(patches.all()).map(|(mean, patch)| mean * patch.projected_sr()).sum();
        let per_relative = if relative > 0.0 { moment.diffuse_horizontal_lux / relative } else { 0.0 };
        means.iter_mut().for_each(|mean| *mean *= per_relative);
        let of_sun = moment.direct_normal_lux * moment.sun.z.max(0.0);
        means.extend([0.0, of_sun].map(|of_sun| (moment.diffuse_horizontal_lux + of_sun) / PI));
        means
    };
    moments.par_iter().map(of_moment).collect()
}

/// Number of sums of a scalar product that are formed side by side.
const LANES: usize = 8;

/// Computes a scalar product.
fn dot(one: &[f64], other: &[f64]) -> f64 {
    let mut sums = [0.0; LANES];
    let (one, other) = (one.chunks_exact(LANES), other.chunks_exact(LANES));
    let rest: f64 = one.remainder().iter().zip(other.remainder()).map(|(a, b)| a * b).sum();
    for (one, other) in one.zip(other) {
        sums.iter_mut().zip(one.iter().zip(other)).for_each(|(sum, (a, b))| *sum += a * b);
    }
    sums.iter().sum::<f64>() + rest
}

impl<const C: usize> Integrator for AtMoments<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        self.pass_after(pass, &Carried::default(), cancel)
    }

    fn start(&self) -> Pass {
        let mut start = self.method.start();
        start.grids.resize(self.tracing.planes(), GridPass::default());
        for (grid, plane) in start.grids.iter_mut().zip(&self.tracing.sensors) {
            grid.moments = vec![0.0; plane.len() * columns_of_all(self.moments.years.iter().map(Vec::len))];
        }
        start
    }

    fn pass_after(&self, pass: u64, before: &Carried, cancel: &AtomicBool) -> Option<Pass> {
        let mut result = self.method.pass_after(pass, before, cancel)?;
        if pass >= PASSES {
            return Some(result);
        }
        let (values, rays) = self.replicate(pass, cancel)?;
        result.totals.rays += rays;
        for (grid, plane) in result.grids.iter_mut().zip(&self.tracing.sensors) {
            grid.moments = values[plane.first..plane.first + plane.len()].concat();
        }
        Some(result)
    }
}

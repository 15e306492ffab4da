//! Light tracing: photons from sky, sun and luminaires, whose vertices are connected to all sensors.
//!
//! **Idea.** A photon carries its flux from a source through tube and room. At every vertex the intensity that it sends to a sensor has a
//! closed form, so that one photon serves every sensor (of many, a random subset). Light for which connections would be rare and bright, or
//! impossible, is counted where photons cross a cell, or followed backward. Unbiased; one pass is one replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#light-tracing). A connection to a cell ends at a random point of it; *near* is
//! within half the longer edge of a cell, where connections would have an infinite variance at walls.
//!
//! | paths | points | cells |
//! | --- | --- | --- |
//! | `L .. D E`, `L .. F E` | connection | connection; near: crossing |
//! | `L .. G E` | connection | crossing |
//! | `L .. S E` | refused | crossing |
//! | `K t C E` | backward through the opening, up the guide | crossing, by rays of their own (`beams`) |
//! | `N t C E` | the arcs of the opening that show the sun, once before the passes | crossing, by rays of their own |
//! | `M E` | Lambert's closed form, or connection where something may stand between | the same at a random point |
//!
//! **Settings.** `photons_per_pass` (64 to 16 777 216; by default 128 to 8192, by the requested accuracy) trades the number of replicates
//! against the noise of each; the time to an accuracy hardly depends on it, except by the least number of passes.
//!
//! **Refuses** views, and at points: mirrors that interreflect, the sun or returned light through clear closures of tubes that are not
//! straight, and sensors nearer than 1 % of the room's shortest edge to a wall, the ceiling, an object, a luminaire without a closed form
//! or an opening (of this also within a tenth of its radius). Bad at points that see narrow lobes (roughness below 0.2): `auto` takes
//! another method there.
//!
//! **Sources.** Kajiya 1986 and Veach 1997 (chapter 8) for the integral that is sampled; Lambert 1760 for luminaires.

mod beams;
mod counting;
mod luminaires;
mod refusals;
mod settings;
mod tally;

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::guide::RayCount;
use crate::integrator::backward::sunlight::{Sunlight, sunlight};
use crate::integrator::backward::unscattered::{LooksUp, unscattered};
use crate::integrator::method::{Computation, Described, Outputs, Refusal, Retained, Task, Trial};
use crate::integrator::photon::chunks::{self, Chunks, concurrent_sums, fold_chunks};
use crate::integrator::photon::close_points::dishonest_points;
use crate::integrator::photon::connect::SensorPlane;
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::integrator::photon::path::trace;
use crate::integrator::trial::{Powers, TrialPasses};
use crate::integrator::{GridPass, Integrator, Pass, PhotonCount};
use crate::sampling::{Key, Stream};
use crate::scene::{Channels, Grid, Sensor};
use crate::traceable::{TraceableScene, TraceableTube};

pub(crate) use beams::add_some_beams;
use beams::{BEAMS_PER_PHOTON, add_beams};
use counting::Counting;
use luminaires::{add_to_cells, at_points, has_closed_form};
pub use refusals::{noisy_points, refuses_points};
use settings::MOST;
pub use settings::{Settings, photons_for};
pub(crate) use tally::SensorTally;

impl Described for Settings {
    fn name(&self) -> &'static str {
        "light_tracing"
    }

    fn outputs(&self) -> Outputs {
        Outputs { views: false, ..Outputs::ALL }
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        let unseen = || task.has_points().then(|| refuses_points(task.traceable)).flatten();
        let refusal = unseen().or_else(|| dishonest_points(task.traceable, task.grids));
        refusal.map(|refusal| refusal.or("`estimate` cell_average"))
    }

    fn retained_per_sensor(&self, grid: &Grid) -> Retained {
        Retained {
            contrasts: 1.0,
            concurrent_sums: concurrent_sums(grid.len(), self.photons_per_pass.unwrap_or(MOST as u64)) as f64,
            ..Retained::MEANS
        }
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let photons = self.photons(task, target);
        let tried = TrialPasses::fewer(photons, 1.0);
        // the light of clear closures is divided among the sensors: with fewer of them, each would have more of it
        let smaller = Trial::whole(Self { photons_per_pass: Some(tried) }, usize::MAX);
        smaller.with(TrialPasses::of_photons(tried, photons, Powers::OF_PHOTONS))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let photons = self.photons(task, target);
        match task.scene.channels {
            Channels::Photopic => Computation::passes(LightTracing::<1>::new(task, (photons, target), seed)),
            Channels::Rgb => Computation::passes(LightTracing::<3>::new(task, (photons, target), seed)),
        }
    }
}

/// Method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct LightTracing<const C: usize> {
    pub(crate) scene: Arc<TraceableScene>,
    pub(crate) emission: Emission,
    pub(crate) sensors: Vec<SensorPlane>,
    pub(crate) looks_up: LooksUp,
    seed: Key,
    /// Direct light of luminaires at the sensors of point grids, in lx; empty unless it has a closed form.
    direct: Vec<f64>,
    /// Sunlight straight through clear zones at the sensors of point grids; empty without any.
    sunlight: Vec<Sunlight>,
    counting: Counting,
    /// Rays straight through clear closures to cells; `None` without any.
    pub(crate) beams: Option<Emission>,
    /// Widest vectors of this machine; results have the same bits as without them, because no multiplication and addition are fused.
    vectors: pulp::Arch,
}

impl<const C: usize> LightTracing<C> {
    /// Builds the method: divides the photons of a pass for a relative standard error among the sources, and computes closed forms of
    /// luminaires once; equal seeds give equal bits.
    pub fn new(task: &Task, (photons, target): (u64, f64), seed: u64) -> Self {
        let emission = Emission::new(task.traceable, photons);
        let mut method = Self::emitting(task.traceable.clone(), emission, task.grids, target, seed);
        if has_closed_form(&method.scene) {
            method.direct = at_points::<C>(&method.scene, &method.sensors);
        }
        method.sunlight = method.sunlight(target, task.cancel);
        let from_diffusers = method.scene.tubes.iter().any(|tube| tube.scatters());
        let straight = from_diffusers || method.scene.luminaires_obstructed;
        method.counting = Counting::new(&method.scene, &method.sensors, straight, method.emission.photons());
        method
    }

    /// Builds the method for the light of sky and sun of a task's scene beside that of Lambertian closures; `straight` if some connections
    /// start where it enters the room.
    pub(crate) fn directional(
        task: &Task,
        grids: &[Grid],
        (photons, target): (u64, f64),
        straight: bool,
        seed: u64,
    ) -> Self {
        let emission = Emission::of_daylight(task.traceable, photons);
        let mut method = Self::emitting(task.traceable.clone(), emission, grids, target, seed);
        method.sunlight = method.sunlight(target, task.cancel);
        method.counting = Counting::new(&method.scene, &method.sensors, straight, method.emission.photons());
        method
    }

    /// Builds the method with the photons of these emitters, and nothing in closed form.
    pub(crate) fn emitting(
        scene: Arc<TraceableScene>,
        emission: Emission,
        grids: &[Grid],
        target: f64,
        seed: u64,
    ) -> Self {
        let mut first = 0;
        let sensors: Vec<SensorPlane> = grids
            .iter()
            .map(|grid| {
                let plane = SensorPlane::new(grid, first);
                first += grid.len();
                plane
            })
            .collect();
        let average = sensors.iter().any(|plane| plane.average);
        let clear = scene.tubes.iter().any(|tube| tube.specular_zone().is_some());
        let rays = BEAMS_PER_PHOTON * emission.photons();
        let beams = (average && clear).then(|| Emission::of_daylight(&scene, rays));
        Self {
            scene,
            emission,
            sensors,
            beams,
            looks_up: LooksUp::to_the_sky(target),
            seed: Key::new(seed),
            direct: Vec::new(),
            sunlight: Vec::new(),
            counting: Counting::default(),
            vectors: pulp::Arch::new(),
        }
    }

    /// Returns the photon counts of each sensor in a pass whose photons bring `flux` lm into the room.
    pub(crate) fn counts(&self, lux: &[f64], connected: &[u64], flux: f64) -> Vec<PhotonCount> {
        self.counting.photons(&self.sensors, lux, connected, flux)
    }

    pub(crate) fn sensor_count(&self) -> usize {
        self.sensors.last().map_or(0, |last| last.first + last.len())
    }

    /// Returns the number of planes of sensors, one for each grid.
    pub(crate) fn planes(&self) -> usize {
        self.sensors.len()
    }

    /// Traces the photons of an emission with these numbers.
    pub(crate) fn photons(&self, emission: &Emission, pass: Key, numbers: Range<u64>) -> SensorSums {
        let mut tally = self.tally();
        let mut totals = PhotonTotals::new(self.scene.tubes.len());
        for number in numbers {
            let (photon, mut samples) = emission.photon(&self.scene, pass, number);
            if let Some(photon) = photon {
                tally.begin(&photon);
                trace::<C>(&self.scene, &photon, &mut samples, &mut tally, &mut totals);
            }
        }
        SensorSums { lux: tally.lux, connected: tally.connected, totals }
    }

    /// Makes a tally without photons.
    pub(crate) fn tally(&self) -> SensorTally<'_> {
        SensorTally {
            scene: &self.scene,
            sensors: &self.sensors,
            vectors: self.vectors,
            tells_by_number: self.scene.specular_surfaces().next().is_none(),
            connected: vec![0; self.sensors.len()],
            counted: vec![false; self.sensors.len()],
            but_luminaires: has_closed_form(&self.scene),
            but_beams: self.beams.is_some(),
            comes_in: false,
            lux: vec![0.0; self.sensor_count()],
            diffuser_weight: 1.0,
        }
    }

    /// Computes the sunlight straight through clear zones at the sensors of point grids, with an error far below the relative standard
    /// error `target`; empty without any.
    fn sunlight(&self, target: f64, cancel: &AtomicBool) -> Vec<Sunlight> {
        let shows_sun = |tube: &TraceableTube| tube.sun.is_some() && tube.specular_zone().is_some();
        let mut all = Vec::new();
        if self.scene.tubes.iter().any(shows_sun) {
            all.resize(self.sensor_count(), Sunlight::default());
            for plane in self.sensors.iter().filter(|plane| !plane.average) {
                let sensors: Vec<Sensor> = (0..plane.len()).map(|index| plane.grid.sensor(index)).collect();
                all[plane.first..plane.first + plane.len()].copy_from_slice(&sunlight(
                    &self.scene,
                    &sensors,
                    target,
                    cancel,
                ));
            }
        }
        all
    }

    /// Computes the sky's unscattered light at sensor `index` of a point grid, in lx, and the number of rays.
    fn unscattered(&self, plane: &SensorPlane, index: usize, stream: Key) -> (f64, RayCount) {
        unscattered(&self.scene, plane.grid.sensor(index), stream, self.looks_up, |_| true)
    }
}

/// Sums over some photons of a pass.
pub(crate) struct SensorSums {
    /// Illuminance per sensor in lx.
    pub lux: Vec<f64>,
    /// Number of photons that were connected to all sensors of a plane, for each plane.
    connected: Vec<u64>,
    pub totals: PhotonTotals,
}

impl chunks::Tally for SensorSums {
    fn is_finite(&self) -> bool {
        self.lux.iter().all(|sum| sum.is_finite()) && self.totals.is_finite()
    }
}

impl<const C: usize> Integrator for LightTracing<C> {
    fn start(&self) -> Pass {
        let grid = |contrasts| GridPass { contrasts, ..GridPass::default() };
        Pass { grids: self.no_contrasts().into_iter().map(grid).collect(), ..Pass::default() }
    }

    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let photons = self.emission.photons();
        let mut lux = vec![0.0; self.sensor_count()];
        let mut connected = vec![0; self.sensors.len()];
        let mut totals = PhotonTotals::new(self.scene.tubes.len());
        let chunk_bytes = 8 * lux.len() as u64;
        let chunk = |numbers: Range<u64>| self.photons(&self.emission, key, numbers);
        let folded =
            fold_chunks(Chunks::of_long_paths(photons), chunk_bytes, cancel, chunk, |of_chunk: SensorSums| {
                lux.iter_mut().zip(&of_chunk.lux).for_each(|(sum, value)| *sum += value);
                connected.iter_mut().zip(&of_chunk.connected).for_each(|(sum, number)| *sum += number);
                totals.add(&of_chunk.totals);
            })?;
        totals.not_finite = folded.not_finite;
        let into_room = totals.tubes.iter().map(|tube| tube.into_room).sum::<f64>() + totals.energy.luminaires;
        let flux = if into_room > 0.0 { into_room } else { totals.energy.emitted };
        let counts = self.counts(&lux, &connected, flux);
        if has_closed_form(&self.scene) {
            lux.iter_mut().zip(&self.direct).for_each(|(sum, direct)| *sum += direct);
            for plane in self.sensors.iter().filter(|plane| plane.average) {
                add_to_cells::<C>(&self.scene, plane, key, &mut lux[plane.first..plane.first + plane.len()]);
            }
        }
        let stream = |sensor: u64| key.stream(Stream::Unscattered, sensor);
        totals.rays += self.add_unscattered(stream, cancel, &mut lux)?;
        Some(Pass { grids: self.by_grids(&lux, &counts), totals, photons, ..Pass::default() })
    }
}

impl<const C: usize> LightTracing<C> {
    /// Adds the light straight through clear closures, and returns the number of rays, or `None` when cancelled; `stream` returns the key
    /// of a sensor, and for all cells together that of the first.
    pub(crate) fn add_unscattered(
        &self,
        stream: impl Fn(u64) -> Key + Sync,
        cancel: &AtomicBool,
        lux: &mut [f64],
    ) -> Option<RayCount> {
        lux.iter_mut().zip(&self.sunlight).for_each(|(sum, sunlight)| *sum += sunlight.lux);
        let specular = self.scene.tubes.iter().any(|tube| tube.specular_zone().is_some());
        let mut rays = RayCount::default();
        if let (Some(beams), Some(plane)) = (&self.beams, self.sensors.iter().find(|plane| plane.average)) {
            rays += add_beams::<C>((&self.scene, &self.sensors), beams, stream(plane.first as u64), cancel, lux)?;
        }
        for plane in self.sensors.iter().filter(|plane| specular && !plane.average) {
            let of = |index: usize| self.unscattered(plane, index, stream((plane.first + index) as u64));
            let direct: Option<Vec<_>> = (0..plane.len())
                .into_par_iter()
                .map(|index| (!cancel.load(Ordering::Relaxed)).then(|| of(index)))
                .collect();
            for (index, (value, of_sensor)) in direct?.into_iter().enumerate() {
                lux[plane.first + index] += value;
                rays += of_sensor;
            }
        }
        Some(rays)
    }

    /// Computes the light of one pass that comes straight through clear closures to the sensors, and the number of rays; `None` when
    /// cancelled. The key is that of a pass of a two-stage method.
    pub(crate) fn unscattered_alone(&self, pass: Key, cancel: &AtomicBool) -> Option<(Vec<GridPass>, RayCount)> {
        let mut lux = vec![0.0; self.sensor_count()];
        let stream = |sensor: u64| pass.stream(Stream::UnscatteredTwoStage, sensor);
        let rays = self.add_unscattered(stream, cancel, &mut lux)?;
        let counts = vec![PhotonCount::default(); lux.len()];
        Some((self.by_grids(&lux, &counts), rays))
    }

    /// Divides the values and counts of all sensors into grids.
    pub(crate) fn by_grids(&self, lux: &[f64], counts: &[PhotonCount]) -> Vec<GridPass> {
        let of = |plane: &SensorPlane| {
            let sensors = plane.first..plane.first + plane.len();
            let (illuminance, photons) = (lux[sensors.clone()].to_vec(), counts[sensors].to_vec());
            GridPass {
                illuminance,
                photons,
                contrasts: self.contrasts(plane, |found| found.error),
                ..GridPass::default()
            }
        };
        self.sensors.iter().map(of).collect()
    }

    /// Returns a value of the sunlight at each sensor of a plane of points, whose zenith angles are the same in every pass; nothing
    /// without sunlight.
    fn contrasts(&self, plane: &SensorPlane, of: impl Fn(&Sunlight) -> f64) -> Vec<f64> {
        let own = if plane.average { None } else { self.sunlight.get(plane.first..plane.first + plane.len()) };
        own.unwrap_or_default().iter().map(of).collect()
    }

    /// Returns zeros for the contrasts of each grid.
    pub(crate) fn no_contrasts(&self) -> Vec<Vec<f64>> {
        self.sensors.iter().map(|plane| self.contrasts(plane, |_| 0.0)).collect()
    }
}

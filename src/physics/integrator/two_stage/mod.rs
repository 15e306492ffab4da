//! Two stages: the path is cut at Lambertian diffusers, which forget where light came from.
//!
//! **Idea.** In each pass photons first find the flux that leaves the diffusers ([`diffuser_source`](super::diffuser_source)). Then paths
//! go backward from the sensors and the eye (`backward::walk`), and every vertex counts that light in closed form, or nearly so. A coarse
//! solution of the light that surfaces reflect ([`radiosity`](super::radiosity)) is a control variate: rays count it, and some continue for
//! its residual. The stages are independent, and the second is linear in the first: every pass is unbiased, one replicate. The sensors of a
//! grid share one estimate of the residual as far as they do not differ; their possible differences are part of their errors
//! (`estimate::residual`).
//!
//! **Which paths** (docs/physics/measurement_equation.md#two-stages). A vertex V is *far* beyond one radius from a
//! disc.
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F E`, far sensors that see all discs, and the eye | every photon, connected |
//! | `(K\|N) t F V`, V the first, far, disc above the horizon, nothing between, no lobe | closed form of rings and sectors, one photon |
//! | `(K\|N) t F V`, V a later one, else the same | one photon, chosen by its flux, connected |
//! | `(K\|N) t F V`, else | two photons, connected; from within a quarter of the radius as path tracing |
//! | `(K\|N) t F V`, a lobe below a roughness of 0.2 | as path tracing |
//! | `K t F S+ (V\|E)`, `M S+ (V\|E)` by plane mirrors | connections to images |
//! | the same by other mirrors | chance |
//! | `M ..` and interreflection, light sent up and back included | as path tracing, around the coarse solution |
//! | `(K\|N) t C ..` of grids, below closures that are Lambertian in part | as light tracing ([`closure_source`](super::diffuser_source::closure_source)) |
//! | all light of points close to a surface, below such closures | as bidirectional path tracing ([`close`]) |
//!
//! **Settings.** `photons_per_pass` (64 to 16 777 216; with views 8192 by default) against `samples_per_sensor` (1 to 65 536) and
//! `samples_per_pixel` (8; 1 to 4096): noise of the first stage is common to all sensors of a pass, that of the second is each sensor's
//! own. The first two are by default chosen for the requested accuracy, photons without views, and paths by a small trial in the room, so
//! that about 8 passes reach it. Each pass estimates the daylight coefficients of a room from one replicate of its matrix
//! ([`room_matrix`](super::room_matrix)).
//!
//! **Refuses** closures without a Lambertian zone, with views all that pass light unscattered, measured diffusers, and the sun reflected by
//! lobes below a roughness of 0.2, by mirrors of meshes and by long chains of mirrors. Bad at diffusers that mirrors of meshes show (it
//! warns). The fluxes of tubes are those of the first stage; a few photons estimate the energy balance of the room.
//!
//! **Sources.** The cut is derived here (docs/physics/measurement_equation.md#two-stages); Kajiya 1986, Veach and
//! Guibas 1995.

mod close;
mod coarse;
mod sample_counts;
mod starts;
mod straight;
mod trial;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use crate::guide::RayCount;
use crate::integrator::backward;
use crate::integrator::backward::chance;
use crate::integrator::backward::pass::{Lux, Sampling, each, lifted};
use crate::integrator::backward::room_entry::exit_seen_by;
use crate::integrator::diffuser_source::closure_source::{
    ClosureLight, ClosureSource, add_directional, all_lambertian, directional_bytes, most_places, of_light_tracing,
    refuses_all_but_lambertian, refuses_directional,
};
use crate::integrator::diffuser_source::light::{DiffuserLight, SensorLit};
use crate::integrator::diffuser_source::visible_parts::reach;
use crate::integrator::method::{Caveat, Computation, Described, Load, Outputs, Refusal, Task, Trial};
use crate::integrator::photon::chunks::MOST_CHUNK;
use crate::integrator::photon::descent::Exit;
use crate::integrator::radiosity::{Exchange, Solution};
use crate::integrator::room_matrix::MatrixEstimator;
use crate::integrator::trial::{Powers, TrialPasses};
use crate::integrator::{GridPass, Integrator, Pass, PhotonCount, ViewPass};
use crate::optics::{Closure, Spectrum};
use crate::sampling::{Key, Stream};
use crate::scene::{Channels, EstimateKind, Grid, View};
use crate::traceable::TraceableScene;
use close::{CloseSensors, refuses_close};
use coarse::{PHOTONS_DOWN_EACH, TRIED_PASSES, pixels, reflected, valued};
use sample_counts::{PATHS, RelativeVariances, SampleCounts, Share, TrialValues};
use starts::starts;
use straight::{GridSensors, OpeningConnections, Straight, by_mirrors, of_luminaires};

/// Settings of the two-stage method.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of photons from sky and sun per pass, all tubes together; 64..=16_777_216; `None`: by the requested accuracy, or with views
    /// 8192.
    pub photons_per_pass: Option<u64>,
    /// Number of backward paths per sensor and pass; 1..=65_536; `None`: by the requested accuracy.
    pub samples_per_sensor: Option<u32>,
    /// Number of backward paths per pixel and pass; 1..=4_096.
    pub samples_per_pixel: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: None, samples_per_sensor: None, samples_per_pixel: 8 }
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "two_stage"
    }

    fn remark(&self) -> Option<&'static str> {
        Some("photons are traced to the diffusers, and paths backward from sensors and cameras in the room")
    }

    fn outputs(&self) -> Outputs {
        Outputs { any_sensors: true, ..Outputs::ALL }
    }

    fn computes_responses(&self) -> bool {
        true
    }

    /// Refuses closures that do not forget directions, and sunlight that paths would find only by chance, reflected by mirrors.
    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refuses_closures(task).or_else(|| chance::sun_by_other_mirrors(task.traceable))
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        let has_responses = task.grids.iter().any(|grid| grid.responses.are_reported());
        // paths from sensors to patches find mirrors by chance
        let of_responses = || has_responses.then(|| chance::mirrors(self.name(), task.traceable)).flatten();
        chance::other_mirrors(self.name(), task.traceable).or_else(of_responses)
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        // a place on the diffuser, the flux, and an offset for cells
        let photons = self.photons_per_pass.map_or(SampleCounts::most_photons(), |photons| photons as f64);
        photons * load.photon_bytes() * Load::COPIES + directional_bytes(load, photons)
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let tubes = &task.traceable.tubes;
        if task.views.is_empty() && self.samples_per_sensor.is_none() {
            let whole = Trial::whole(self.clone(), most_places(tubes, 49));
            return whole.with(TrialPasses::of_size(PATHS.of(target, 1.0), Powers::of_growth(PATHS.growth)));
        }
        // each place has the noise of its own paths, whose number does not change, and all share the noise of the photons
        let powers = Powers { work_of_place: 0.0, variance: 0.0, ..Powers::OF_PHOTONS };
        let photons =
            self.photons_per_pass.unwrap_or_else(|| SampleCounts::photons(target, tubes, !task.views.is_empty()));
        let tried = TrialPasses::fewer(photons, 0.125);
        let smaller = Self { photons_per_pass: Some(tried), ..self.clone() };
        let most_places = if task.views.is_empty() { 9 } else { 512 };
        Trial::whole(smaller, most_places).with(TrialPasses::of_photons(tried, photons, powers))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        match task.scene.channels {
            Channels::Photopic => Computation::passes(TwoStage::<1>::new(task, self, seed, target)),
            Channels::Rgb => Computation::passes(TwoStage::<3>::new(task, self, seed, target)),
        }
    }
}

/// Returns the reason why paths cannot be cut at the closures, if there is one: directional light of closures is computed for
/// level grids only, and near an opening paths would follow all light that a measured closure scatters.
fn refuses_closures(task: &Task) -> Option<Refusal> {
    let tubes = &task.traceable.tubes;
    let measured = tubes.iter().any(|tube| tube.diffuser.measured().is_some());
    let by_lambertian = measured || !task.views.is_empty() || task.has_placed_sensors();
    if by_lambertian || all_lambertian(tubes) {
        return refuses_all_but_lambertian(tubes);
    }
    refuses_directional(task).or_else(|| refuses_close(task).map(of_light_tracing))
}

/// Number of reflections of a path without Russian roulette, which would spoil the gain of low-discrepancy points.
const CERTAIN_REFLECTIONS: u32 = 3;

/// Number of pairs of Sobol coordinates of a path.
const SOBOL_PAIRS: u32 = 8;

/// Number of pairs of Sobol coordinates of a path from an eye, whose points are low-discrepancy together with those of neighbouring pixels:
/// a third pair gains nothing.
const SOBOL_PAIRS_SEEN: u32 = 2;

/// Method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct TwoStage<const C: usize> {
    scene: Arc<TraceableScene>,
    closures: ClosureSource<C>,
    grids: Vec<Grid>,
    views: Vec<View>,
    counts: SampleCounts,
    /// Share of the paths that each sensor has, grid by grid; `None` where all have equally many.
    shares: Option<Vec<Vec<Share>>>,
    connections: OpeningConnections,
    /// Coarse solution of the light that surfaces reflect; `None` where they reflect none.
    reflected: Option<Arc<Solution<C>>>,
    /// Sensors close to surfaces, which another method computes.
    close: Option<CloseSensors<C>>,
    /// Matrix of the room, where daylight coefficients are requested.
    room: Option<MatrixEstimator<C>>,
    seed: Key,
}

/// Initial length of an edge of a patch, as a fraction of the room's shortest edge, and the factor above which shorter edges are not worth
/// another solution.
const EDGE: f64 = 1.0 / 6.0;
const WORTHWHILE: f64 = 0.8;

impl<const C: usize> TwoStage<C> {
    /// Builds the method for a relative standard error `target`; equal seeds give equal bits.
    pub fn new(task: &Task, settings: &Settings, seed: u64, target: f64) -> Self {
        let scene = task.traceable;
        let starts = starts(scene, task.grids, task.views);
        let mut edge = EDGE * scene.enclosure.shortest_edge_m();
        let mut exchange = Exchange::new(scene, &starts, edge).map(Arc::new);
        let mut solution = exchange.as_ref().map(|exchange| reflected(task, exchange, seed, target));
        let mut counts = Self::counts(task, settings, solution.as_ref(), (seed, target));
        if let Some(coarse) = &exchange {
            let finer = counts.finer(coarse.rays(), (valued(task.grids), pixels(task.views)));
            if finer < WORTHWHILE {
                edge *= finer;
                exchange = Exchange::new(scene, &starts, edge).map(Arc::new);
                solution = exchange.as_ref().map(|exchange| reflected(task, exchange, seed, target));
                counts = Self::counts(task, settings, solution.as_ref(), (seed, target));
            }
        }
        let shares = Self::divided(task, settings, solution.as_ref(), (seed, target), &mut counts);
        let room = MatrixEstimator::new(scene, task.grids, settings.samples_per_sensor, (seed, target));
        let close = CloseSensors::new(scene, task.grids, seed, target);
        let made = Self::with_counts(scene, (task.grids, task.views), (counts, target), solution, seed);
        Self { room, close, shares, ..made }
    }

    /// Builds the method with given sizes, and divides the photons of a pass among sky and sun of the tubes.
    fn with_counts(
        scene: &Arc<TraceableScene>,
        (grids, views): (&[Grid], &[View]),
        (counts, target): (SampleCounts, f64),
        reflected: Option<Arc<Solution<C>>>,
        seed: u64,
    ) -> Self {
        let closures = ClosureSource::new(scene, grids, (counts.photons, target), seed);
        let seed = Key::new(seed);
        let connections = OpeningConnections::new(scene, grids, counts.per_opening, seed);
        let (grids, views) = (grids.to_vec(), views.to_vec());
        Self {
            closures,
            grids,
            views,
            counts,
            connections,
            reflected,
            close: None,
            room: None,
            shares: None,
            seed,
            scene: scene.clone(),
        }
    }

    /// Computes one pass of a grid, and the number of its rays; `None` when cancelled.
    fn grid(
        &self,
        light: &DiffuserLight<C>,
        sensors: GridSensors,
        cancel: &AtomicBool,
    ) -> Option<(GridPass, RayCount)> {
        let (scene, grid) = (&*self.scene, sensors.grid);
        let shares = self.shares.as_ref().map(|shares| &shares[sensors.number]);
        let found = each(grid.len(), cancel, |sensor| {
            if grid.is_inside(sensor) {
                return (Straight::default(), Lux::default(), RayCount::default());
            }
            let counts = shares.map_or(self.counts, |shares| self.counts.of_sensor(shares[sensor]));
            let sampling = Sampling {
                paths: counts.per_sensor,
                beyond: self.reflected.is_some().then_some(counts.beyond),
                certain: CERTAIN_REFLECTIONS,
                pairs: SOBOL_PAIRS,
            };
            let mut straight = self.connections.straight(scene, light, sensors, sensor);
            let rays_and_connections = [counts.per_sensor, counts.per_opening].map(f64::from);
            straight += of_luminaires::<C>(scene, sensors, sensor, rays_and_connections);
            straight += by_mirrors(scene, light, sensors, sensor, rays_and_connections);
            let centre = lifted(scene, grid, sensor).position;
            let lit = SensorLit { light, centre, reach: reach(grid), rays_and_connections };
            let stream = sensors.stream.stream(Stream::Sensor, sensor as u64);
            let (lux, rays) = backward::pass::sensor::<C>(scene, grid, sensor, sampling, stream, &lit);
            (straight, lux, rays)
        })?;
        let mut pass = GridPass::default();
        let mut all_rays = RayCount::default();
        for (straight, lux, rays) in found {
            pass.illuminance.push(straight.lux + lux.whole);
            pass.residual.push(lux.beyond);
            pass.gathered.push(lux.whole - lux.beyond);
            pass.photons.push(PhotonCount { brightest_lux: straight.missed, ..PhotonCount::default() });
            all_rays += straight.rays;
            all_rays += rays;
        }
        Some((pass, all_rays))
    }

    /// Adds the light of the diffusers that the eye sees directly.
    fn add_diffusers(&self, light: &DiffuserLight<C>, view: &View, luminance: &mut [f64]) {
        for tube in light.tubes() {
            let (closure, from) = (Closure::EVEN.turned(tube.frame.turn()), tube.frame.outward());
            let exits: Vec<_> = tube.photons().map(|(position, flux)| Exit { position, closure, from, flux }).collect();
            let seen = |exits: &[Exit<C>]| -> Vec<(usize, Spectrum<C>)> {
                exits.iter().filter_map(|exit| exit_seen_by(&self.scene, exit, view)).collect()
            };
            let chunks: Vec<_> = exits.par_chunks(MOST_CHUNK as usize).map(seen).collect();
            for (pixel, value) in chunks.into_iter().flatten() {
                for (channel, value) in value.0.into_iter().enumerate() {
                    luminance[pixel * C + channel] += value;
                }
            }
        }
    }

    /// Computes the light of a pass, with the coarse solution of the light that surfaces reflect of it.
    fn lit(&self, key: Key, cancel: &AtomicBool) -> Option<ClosureLight<C>> {
        let ClosureLight { lambertian, directional, totals } = self.closures.pass(&self.scene, key, cancel)?;
        let lambertian = match &self.reflected {
            Some(reflected) => lambertian.reflected_by(reflected),
            None => lambertian,
        };
        Some(ClosureLight { lambertian, directional, totals })
    }

    /// Computes all grids in one pass, and the number of rays.
    fn grids(
        &self,
        light: &DiffuserLight<C>,
        key: Key,
        pass: u64,
        cancel: &AtomicBool,
    ) -> Option<(Vec<GridPass>, RayCount)> {
        let (mut grids, mut all_rays) = (Vec::new(), RayCount::default());
        for (number, grid) in self.grids.iter().enumerate() {
            let stream = key.stream(Stream::Grid, number as u64);
            let average = grid.estimate == EstimateKind::CellAverage;
            let offsets = average.then(|| light.offsets(grid.cell_size_m, stream));
            let sensors = GridSensors { number, grid, pass, offsets: offsets.as_deref(), stream };
            let (grid, rays) = self.grid(light, sensors, cancel)?;
            all_rays += rays;
            grids.push(grid);
        }
        Some((grids, all_rays))
    }
}

impl<const C: usize> Integrator for TwoStage<C> {
    fn start(&self) -> Pass {
        let nothing = |grid: &Grid| vec![0.0; if self.reflected.is_some() { grid.len() } else { 0 }];
        let grid = |grid: &Grid| {
            let companions = vec![GridPass::default(); self.room.as_ref().map_or(0, |room| room.columns(grid))];
            GridPass { residual: nothing(grid), companions, ..GridPass::default() }
        };
        Pass { grids: self.grids.iter().map(grid).collect(), ..Pass::default() }
    }

    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let scene = &*self.scene;
        let key = self.seed.stream(Stream::Pass, pass);
        let ClosureLight { lambertian: light, directional, mut totals } = self.lit(key, cancel)?;
        let (grids, rays) = self.grids(&light, key, pass, cancel)?;
        totals.rays += rays;
        let mut result = Pass { totals, grids, photons: self.closures.photons(), ..Pass::default() };
        add_directional(&mut result.grids, &directional);
        if let Some(close) = &self.close {
            result.totals.rays += close.replace(pass, &mut result.grids, cancel)?;
        }
        if let Some(room) = &self.room {
            let replicate = room.replicate(pass, self.grids.len(), cancel)?;
            result.totals.rays += replicate.rays;
            result.grids.iter_mut().zip(replicate.grids).for_each(|(grid, responses)| grid.companions = responses);
        }
        for (number, view) in self.views.iter().enumerate() {
            let stream = key.stream(Stream::View, number as u64);
            let paths = self.counts.per_pixel;
            let sampling = Sampling { paths, beyond: None, certain: CERTAIN_REFLECTIONS, pairs: SOBOL_PAIRS_SEEN };
            let (mut luminance, rays) = backward::pass::view::<C>(scene, view, sampling, stream, &light, cancel)?;
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            self.add_diffusers(&light, view, &mut luminance);
            result.totals.rays += rays;
            let rays = vec![f64::from(self.counts.per_pixel)];
            result.views.push(ViewPass { luminance, rays, ..ViewPass::default() });
        }
        Some(result)
    }
}

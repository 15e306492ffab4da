//! Light tracing: photons from sky, sun and luminaires, whose vertices are connected to all sensors.
//!
//! **Idea.** A photon carries its flux from a source through tube and room. At every vertex the intensity that it sends
//! to a sensor is known in closed form, so that one photon serves every sensor (of many, a random subset). What a
//! connection would find rare and bright, or not at all, is counted where photons cross a cell, or followed backward.
//! Unbiased; one pass is one replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#light-tracing). Cells are connected by a random point of each;
//! *near* is within half the longer edge of a cell, where connections would have an infinite variance at walls.
//!
//! | paths | points | cells |
//! | --- | --- | --- |
//! | `L .. D E`, `L .. F E` | connection | connection; near: crossing |
//! | `L .. G E` | connection | crossing |
//! | `L .. S E` | refused | crossing |
//! | `K t C E`, `N t C E` | backward through the opening, up the guide | crossing |
//! | `M E` | Lambert's closed form, or connection where something may stand between | the same at a random point |
//!
//! **Settings.** `photons_per_pass` (64 to 16 777 216; by default 512 to 8192, by the accuracy asked for) trades the number of
//! replicates against the noise of each; the time to an accuracy hardly depends on it, but for the least number of passes.
//!
//! **Refuses** views, and at points: mirrors that interreflect, the sun or returned light through clear closures of
//! tubes that are not straight, and sensors nearer than 1 % of the room's shortest edge to a wall, the ceiling, an object
//! or a luminaire without a closed form. Bad at points that see narrow lobes (roughness below 0.2): `auto` takes another method there.
//!
//! **Sources.** Kajiya 1986 and Veach 1997 (chapter 8) for the integral that is sampled; Lambert 1760 for luminaires.

mod refusals;
mod tally;

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::guide::RayCount;
use crate::integrator::backward::unscattered::unscattered;
use crate::integrator::method::{Computation, Described, Kept, Knows, Refusal, Task, Trial, Work};
use crate::integrator::photon::chunks::{self, fold_chunks, sums_at_once};
use crate::integrator::photon::close_points::dishonest_points;
use crate::integrator::photon::connect::SensorPlane;
use crate::integrator::photon::emission::Emission;
use crate::integrator::photon::ledger::Account;
use crate::integrator::photon::path::trace;
use crate::integrator::photon_map::domain::Domain;
use crate::integrator::photon_map::maps::LEAST_KERNEL;
use crate::integrator::{GridPass, Integrator, Pass, PhotonCount};
use crate::optics::SurfaceOptics;
use crate::sampling::{Key, PathRandom, Stream, power_of_two};
use crate::scene::{Channels, Grid};
use crate::traceable::TraceableScene;
use crate::traceable::luminaire::TraceableLuminaire;

pub use refusals::{noisy_points, refuses_points};
use tally::Tally;

/// Settings of light tracing.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Photons emitted per pass, all tubes and sources together; 64..=16_777_216; `None`: by the accuracy asked for.
    pub photons_per_pass: Option<u64>,
}

/// Photons of a pass of a job that asks for a relative standard error of 1 %: some fifteen passes of them reach it in small rooms.
const PHOTONS_FOR_ONE_PERCENT: f64 = 2048.0;

/// Fewest and most photons of a pass, unless the document says how many: more would make errors no smaller for the same time.
const FEWEST: f64 = 512.0;
const MOST: f64 = 8192.0;

impl Settings {
    /// Photons of a pass for a relative standard error `target`, a power of two: Sobol points are most even then.
    fn photons(&self, target: f64) -> u64 {
        let wanted = (PHOTONS_FOR_ONE_PERCENT * 0.01 / target).clamp(FEWEST, MOST);
        self.photons_per_pass.unwrap_or_else(|| power_of_two(wanted))
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "light_tracing"
    }

    fn knows(&self) -> Knows {
        Knows { views: false, ..Knows::ALL }
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        let unseen = || task.has_points().then(|| refuses_points(task.traceable)).flatten();
        let refusal = unseen().or_else(|| dishonest_points(task.traceable, task.grids));
        refusal.map(|refusal| refusal.or("the estimate cell_average"))
    }

    fn seconds_per_pass(&self, work: &Work) -> f64 {
        let per_photon = work.seconds_per_path + work.seconds_per_connection * work.connected_sensors();
        self.photons(work.target) as f64 * per_photon
    }

    fn kept_of_sensor(&self, grid: &Grid) -> Kept {
        Kept {
            sums_at_once: sums_at_once(grid.len(), self.photons_per_pass.unwrap_or(MOST as u64)) as f64,
            ..Kept::MEANS
        }
    }

    fn trial(&self, _: &Task) -> Trial {
        // the light of clear closures is shared among the sensors: fewer of them would have more of it
        let (photons, ratio) = Trial::fewer(self.photons(0.01), 0.5);
        let smaller = Trial::whole(Self { photons_per_pass: Some(photons) }, usize::MAX).with_variance(1.0 / ratio);
        Trial { work_of_pass: ratio, work_of_place: ratio, ..smaller }
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let photons = self.photons(target);
        match task.scene.channels {
            Channels::Photopic => Computation::passes(LightTracing::<1>::new(scene, task.grids, photons, seed)),
            Channels::Rgb => Computation::passes(LightTracing::<3>::new(scene, task.grids, photons, seed)),
        }
    }
}

/// Sensors of which one thread computes Lambert's closed form at least: fewer (some tens of ns each) are not worth waking
/// another thread.
const SENSORS_AT_ONCE: usize = 64;

/// Number of photons of which one is connected to the sensors from its diffuser: direct light is smooth and needs few
/// of them, the others go on for the interreflection.
const DIFFUSER_CONNECTIONS: u64 = 4;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct LightTracing<const C: usize> {
    scene: Arc<TraceableScene>,
    emission: Emission,
    sensors: Vec<SensorPlane>,
    seed: Key,
    /// Light straight from luminaires at the sensors of point grids, in lux; empty unless it has a closed form.
    direct: Vec<f64>,
    /// True for every sensor that photons can be connected to: it is not inside an object, and light comes that anything
    /// scatters.
    reachable: Vec<bool>,
    /// The widest vectors of this machine; the same bits as without, as nothing is contracted.
    vectors: pulp::Arch,
}

impl<const C: usize> LightTracing<C> {
    /// Divides the `photons` of a pass among the sources, and computes closed forms of luminaires once; equal seeds give
    /// equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], photons: u64, seed: u64) -> Self {
        let emission = Emission::new(&scene, photons);
        let mut first = 0;
        let sensors = grids
            .iter()
            .map(|grid| {
                let plane = SensorPlane::new(grid, first);
                first += grid.len();
                plane
            })
            .collect();
        let mut method = Self {
            scene,
            emission,
            sensors,
            seed: Key::new(seed),
            direct: Vec::new(),
            reachable: Vec::new(),
            vectors: pulp::Arch::new(),
        };
        if method.lambert() {
            method.direct = method.at_points();
        }
        method.reachable = method.reachable();
        method
    }

    /// True for every sensor to which photons can be connected.
    fn reachable(&self) -> Vec<bool> {
        let scene = &*self.scene;
        let reflects = |surface: &SurfaceOptics| surface.gathers() || surface.is_specular();
        let scatters = !scene.is_dark()
            && (scene.tubes.iter().any(|tube| tube.diffuser.scatters(tube.opening_radius))
                || (scene.interreflection && scene.all_optics().any(reflects))
                || scene.luminaires_obstructed);
        if !scatters || !scene.obstructed {
            return vec![scatters; self.sensor_count()];
        }
        let mut reachable = Vec::with_capacity(self.sensor_count());
        for SensorPlane { grid, average, .. } in &self.sensors {
            let plane = Domain::horizontal_plane(scene, grid.height_m);
            let reach =
                if *average { 0.5 * libm::hypot(grid.cell_size_m[0], grid.cell_size_m[1]) } else { scene.coinciding() };
            let within = |sensor| plane.area(grid.centre(sensor), reach) > LEAST_KERNEL * PI * reach * reach;
            reachable.extend((0..grid.len()).map(within));
        }
        reachable
    }

    /// What the photons of a pass say of each sensor, from its illuminance by them alone: a pass that brings it light found one
    /// at least. One photon is taken to light a sensor as from half the room's shortest edge away.
    fn counts(&self, lux: &[f64], account: &Account) -> Vec<PhotonCount> {
        let into_room = account.tubes.iter().map(|tube| tube.into_room).sum::<f64>() + account.ledger.luminaires;
        let flux = if into_room > 0.0 { into_room } else { account.ledger.emitted };
        let distance = 0.5 * self.scene.size.min_element();
        let one_lux = flux / self.emission.photons().max(1) as f64 / (PI * distance * distance);
        let count = |(lux, reachable): (&f64, &bool)| PhotonCount {
            found: if *lux > 0.0 { 1.0 } else { 0.0 },
            one_lux: if *reachable { one_lux } else { 0.0 },
        };
        lux.iter().zip(&self.reachable).map(count).collect()
    }

    /// Light straight from luminaires at every sensor of a point grid.
    fn at_points(&self) -> Vec<f64> {
        let mut direct = vec![0.0; self.sensor_count()];
        for plane in self.sensors.iter().filter(|plane| !plane.average) {
            let of_plane = &mut direct[plane.first..plane.first + plane.len()];
            of_plane.par_iter_mut().with_min_len(SENSORS_AT_ONCE).enumerate().for_each(|(index, lux)| {
                *lux = self.luminaire_illuminance(DVec3::new(plane.x[index], plane.y[index], plane.height));
            });
        }
        direct
    }

    fn sensor_count(&self) -> usize {
        self.sensors.last().map_or(0, |last| last.first + last.len())
    }

    /// Photons of these numbers of a pass.
    fn photons(&self, pass: Key, numbers: Range<u64>) -> Sums {
        let mut tally = Tally {
            scene: &self.scene,
            sensors: &self.sensors,
            vectors: self.vectors,
            but_luminaires: self.lambert(),
            lux: vec![0.0; self.sensor_count()],
            diffuser_weight: 1.0,
        };
        let mut account = Account::new(self.scene.tubes.len());
        for number in numbers {
            let (photon, mut samples) = self.emission.photon(&self.scene, pass, number);
            if let Some(photon) = photon {
                let connected = photon.of.div_ceil(DIFFUSER_CONNECTIONS);
                tally.diffuser_weight =
                    if photon.index < connected { photon.of as f64 / connected as f64 } else { 0.0 };
                trace::<C>(&self.scene, &photon, &mut samples, &mut tally, &mut account);
            }
        }
        (tally.lux, account)
    }

    /// True if light straight from luminaires is added in closed form.
    fn lambert(&self) -> bool {
        !self.scene.luminaires.is_empty() && !self.scene.luminaires_obstructed
    }

    /// Light straight from luminaires at a random point of each cell of an average, in lux.
    fn add_to_cells(&self, plane: &SensorPlane, pass: Key, lux: &mut [f64]) {
        lux.par_iter_mut().with_min_len(SENSORS_AT_ONCE).enumerate().for_each(|(index, lux)| {
            let [u, v] = PathRandom::new(pass.stream(Stream::CellPoint, (plane.first + index) as u64)).uniform2();
            let centre = DVec3::new(plane.x[index], plane.y[index], plane.height);
            let offset = DVec3::new((u - 0.5) * plane.grid.cell_size_m[0], (v - 0.5) * plane.grid.cell_size_m[1], 0.0);
            *lux += self.luminaire_illuminance(centre + offset);
        });
    }

    /// Light straight from luminaires at a point that looks up, in lux.
    fn luminaire_illuminance(&self, sensor: DVec3) -> f64 {
        let direct = |luminaire: &TraceableLuminaire| luminaire.irradiance::<C>(sensor, DVec3::Z).luminance();
        self.scene.luminaires.iter().map(direct).sum()
    }

    /// Direct unscattered light at sensor `index` of a point grid, in lux, and the rays it took.
    fn unscattered(&self, plane: &SensorPlane, index: usize, pass: Key, rays_per_sensor: u64) -> (f64, RayCount) {
        let sensor = DVec3::new(plane.x[index], plane.y[index], plane.height);
        let stream = pass.stream(Stream::Unscattered, (plane.first + index) as u64);
        unscattered(&self.scene, sensor, stream, rays_per_sensor, |_| true)
    }
}

/// Illuminance per sensor in lux by some photons, and their account.
type Sums = (Vec<f64>, Account);

impl chunks::Tally for Sums {
    fn is_finite(&self) -> bool {
        self.0.iter().all(|lux| lux.is_finite()) && self.1.is_finite()
    }
}

impl<const C: usize> Integrator for LightTracing<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let photons = self.emission.photons();
        let mut lux = vec![0.0; self.sensor_count()];
        let mut account = Account::new(self.scene.tubes.len());
        let chunk_bytes = 8 * lux.len() as u64;
        let chunk = |numbers: Range<u64>| self.photons(key, numbers);
        let folded = fold_chunks(photons, chunk_bytes, cancel, chunk, |(chunk_lux, chunk_account): Sums| {
            lux.iter_mut().zip(&chunk_lux).for_each(|(sum, value)| *sum += value);
            account.add(&chunk_account);
        })?;
        account.not_finite = folded.not_finite;
        let counts = self.counts(&lux, &account);
        if self.lambert() {
            lux.iter_mut().zip(&self.direct).for_each(|(sum, direct)| *sum += direct);
            for plane in self.sensors.iter().filter(|plane| plane.average) {
                self.add_to_cells(plane, key, &mut lux[plane.first..plane.first + plane.len()]);
            }
        }
        let specular = self.scene.tubes.iter().any(|tube| tube.diffuser.specular_zone(tube.opening_radius).is_some());
        for plane in self.sensors.iter().filter(|plane| specular && !plane.average) {
            let per_sensor = (photons / plane.len() as u64).next_power_of_two().max(16);
            let direct: Option<Vec<_>> = (0..plane.len())
                .into_par_iter()
                .map(|index| (!cancel.load(Ordering::Relaxed)).then(|| self.unscattered(plane, index, key, per_sensor)))
                .collect();
            for (index, (value, rays)) in direct?.into_iter().enumerate() {
                lux[plane.first + index] += value;
                account.rays += rays;
            }
        }
        let grids = self
            .sensors
            .iter()
            .map(|plane| GridPass {
                illuminance: lux[plane.first..plane.first + plane.len()].to_vec(),
                photons: counts[plane.first..plane.first + plane.len()].to_vec(),
                ..GridPass::default()
            })
            .collect();
        Some(Pass { grids, account, photons, ..Pass::default() })
    }
}

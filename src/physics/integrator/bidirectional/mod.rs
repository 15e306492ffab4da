//! Bidirectional path tracing: photons from the sources and paths from sensors and the eye, connected at every pair of vertices.
//!
//! **Idea.** The photons of a pass are shared: each of their vertices is connected to every sensor (of many, to a random subset) and to the
//! eye, and every eye path to the vertices of one photon. All strategies that find a path share it by the balance heuristic (`weight`).
//! Unbiased; one pass is one replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#bidirectional-path-tracing). Photons end where they meet an opening from below;
//! eye paths continue there.
//!
//! | paths | estimator |
//! | --- | --- |
//! | with a `D`, `G` or `F` to connect at | every cut: photon to sensor or eye, photon to eye path, eye ray that meets sky or luminaire |
//! | such paths that end at the sun | photons only |
//! | `(K\|N) t C E` | points: backward; cells: crossing; an eye: chance |
//! | `N t C V E` | connection; cells within half their longer edge: crossing |
//! | `(K\|M) .. S+ E` | points, eye: chance; cells: crossing and chance, sharing |
//! | `F` from below, and light that a guide sends back | eye paths only |
//!
//! **Settings.** `photons_per_pass` (by default 256 to 16 384, by the requested accuracy, and with views the most; 64 to 1 048 576: their
//! vertices are stored) against `samples_per_sensor` (a 64th of the photons; 1 to 65 536) and `samples_per_pixel` (1; 1 to 4096): photons
//! find light behind closures, eye paths light that mirrors show.
//!
//! **Refuses** the sun in mirrors and in lobes below a roughness of 0.2, unless cells alone see a mirror; the sun
//! through clear closures of tubes that are not straight, at points or with returns; views without interreflection. Bad
//! at mirrors that show diffusers to points, and at cells between mirrors (it warns).
//!
//! **Sources.** Lafortune and Willems 1993; Veach and Guibas 1994 and 1995; Veach 1997.

mod cells;
mod eye;
mod light;
mod refusals;
mod settings;
mod weight;

use std::f64::consts::PI;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use self::cells::{is_average, near, place, stride};
use self::eye::{EyeSide, From, Starts};
use self::light::{LightPaths, LightVertex, Recorder};
use self::settings::MOST;
pub use self::settings::{PathCounts, Settings};
use super::{GridPass, Integrator, Pass, ViewPass};
use crate::guide::RayCount;
use crate::integrator::backward::chance;
use crate::integrator::backward::meeting::Walk;
use crate::integrator::backward::pass::{SOBOL_PAIRS_SEEN, beside_directions, number_in_squares, place_in_pixel};
use crate::integrator::backward::room_entry::enter_room;
use crate::integrator::backward::unscattered::{LooksUp, unscattered};
use crate::integrator::method::{Caveat, Computation, Described, Load, Refusal, Retained, Task, Trial};
use crate::integrator::photon::chunks::{Chunks, Tally, concurrent_sums, fold_chunks};
use crate::integrator::photon::emission::{Emission, EmittedPhoton, Start};
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::integrator::photon::events::Flight;
use crate::integrator::photon::path::trace;
use crate::integrator::trial::{Powers, TrialPasses};
use crate::optics::Spectrum;
use crate::sampling::{Key, PathRandom, PathSamples, Stream};
use crate::scene::{Channels, Grid, OpeningShape, Sensor, View};
use crate::traceable::TraceableScene;

impl Described for Settings {
    fn name(&self) -> &'static str {
        "bidirectional_path_tracing"
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refusals::refuses(task)
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        // cells count the light that a mirror shows them where it crosses them
        let mirrors = match (task.grids.is_empty(), task.has_points()) {
            (true, _) => chance::mirrors_in_views,
            (false, true) => chance::mirrors,
            (false, false) => chance::mirrors_at_cells,
        };
        mirrors(self.name(), task.traceable)
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        let vertex = if load.channels == 1 { size_of::<LightVertex<1>>() } else { size_of::<LightVertex<3>>() };
        self.photons_per_pass.map_or(MOST, |photons| photons as f64)
            * (1.0 + load.events)
            * vertex as f64
            * Load::COPIES
    }

    fn retained_per_sensor(&self, grid: &Grid) -> Retained {
        let photons = self.photons_per_pass.unwrap_or(MOST as u64);
        Retained { concurrent_sums: concurrent_sums(grid.len(), photons) as f64, ..Retained::MEANS }
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let counts = self.path_counts(target, !task.views.is_empty());
        let (fraction, most_places, powers) = if task.views.is_empty() {
            (0.5, 36, Powers::OF_PHOTONS)
        } else {
            // the noise is that of the eye paths, each of which is connected to one photon
            (0.0625, 1024, Powers { work_of_place: 0.0, variance: 0.0, shared_variance: 0.0, ..Powers::OF_PHOTONS })
        };
        let tried = TrialPasses::fewer(counts.photons, fraction);
        let samples = f64::from(counts.per_sensor) * tried as f64 / counts.photons as f64;
        let samples_per_sensor = Some((samples as u32).max(1));
        let smaller = Self { photons_per_pass: Some(tried), samples_per_sensor, ..self.clone() };
        Trial::whole(smaller, most_places).with(TrialPasses::of_photons(tried, counts.photons, powers))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let counts = self.path_counts(target, !task.views.is_empty());
        match task.scene.channels {
            Channels::Photopic => {
                Computation::passes(Bidirectional::<1>::new(scene, task.grids, task.views, counts, seed))
            }
            Channels::Rgb => Computation::passes(Bidirectional::<3>::new(scene, task.grids, task.views, counts, seed)),
        }
    }
}

/// Largest number of backward rays per point sensor and pass to a clear closure.
const MOST_BACKWARD_RAYS: u64 = 1024;

/// Method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct Bidirectional<const C: usize> {
    scene: Arc<TraceableScene>,
    emission: Emission,
    starts: Starts,
    grids: Vec<Grid>,
    views: Vec<View>,
    counts: PathCounts,
    seed: Key,
}

/// Light that some photons bring by connections.
struct Connected<const C: usize> {
    paths: LightPaths<C>,
    /// Illuminance in lx, per grid.
    grids: Vec<Vec<f64>>,
    /// Pixels and their luminance in cd/m2, per view.
    views: Vec<Vec<(usize, Spectrum<C>)>>,
    totals: PhotonTotals,
}

impl<const C: usize> Tally for Connected<C> {
    fn is_finite(&self) -> bool {
        self.totals.is_finite()
            && self.grids.iter().flatten().all(|lux| lux.is_finite())
            && self.views.iter().flatten().all(|(_, luminance)| luminance.is_finite())
    }
}

impl<const C: usize> Bidirectional<C> {
    /// Builds the method, and divides the photons of a pass among the sources; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], views: &[View], counts: PathCounts, seed: u64) -> Self {
        let emission = Emission::new(&scene, counts.photons);
        let sky =
            scene.tubes.iter().enumerate().map(|(number, tube)| emission.sky_fraction(number) / tube.opening.area_m2());
        let luminaires = scene.luminaires.iter().enumerate();
        let starts = Starts {
            sky: sky.collect(),
            luminaires: luminaires.map(|(number, l)| emission.luminaire_fraction(number) / l.area_m2).collect(),
        };
        let (grids, views) = (grids.to_vec(), views.to_vec());
        Self { scene, emission, starts, grids, views, counts, seed: Key::new(seed) }
    }

    /// Traces photons of these numbers, and connects them to sensors and eyes.
    fn photons(&self, key: Key, numbers: Range<u64>) -> Connected<C> {
        let mut grids: Vec<_> = self.grids.iter().map(|grid| vec![0.0; grid.len()]).collect();
        let mut views = vec![Vec::new(); self.views.len()];
        let mut totals = PhotonTotals::new(self.scene.tubes.len());
        let mut recorder = Recorder::new(&self.scene);
        for number in numbers {
            let (photon, mut samples) = self.emission.photon(&self.scene, key, number);
            if let Some(photon) = &photon {
                recorder.begin(photon, self.start_density(photon));
                trace::<C>(&self.scene, photon, &mut samples, &mut recorder, &mut totals);
            }
            let mut random = PathRandom::new(key.stream(Stream::Connections, 0).child(number));
            for vertex in recorder.end() {
                for (grid, lux) in self.grids.iter().zip(&mut grids) {
                    totals.rays += self.connect_sensors(vertex, grid, lux, &mut random);
                }
                for (view, pixels) in self.views.iter().zip(&mut views) {
                    pixels.extend(self.connect_eye(vertex, view));
                }
            }
        }
        for (grid, lux) in self.grids.iter().zip(&mut grids).filter(|(grid, _)| is_average(grid)) {
            recorder.unscattered.iter().for_each(|flight| self.cross(flight, grid, f64::INFINITY, lux));
            recorder.alone.iter().for_each(|flight| self.cross(flight, grid, near(grid), lux));
            for (flight, start) in &recorder.mirrored {
                let by_eye = if *start > 0.0 { 1.0 / (self.crossings_per_path(grid) * start) } else { 0.0 };
                let flight = Flight { flux: flight.flux * (1.0 / (1.0 + by_eye)), ..*flight };
                self.cross(&flight, grid, f64::INFINITY, lux);
            }
        }
        Connected { paths: recorder.paths, grids, views, totals }
    }

    /// Returns the density per m2 of a photon's start on its opening or luminaire, taken as uniform.
    fn start_density(&self, photon: &EmittedPhoton) -> f64 {
        let area = match photon.start {
            Start::Tube(tube) => match self.scene.tubes[tube].opening {
                OpeningShape::Disc { radius } => PI * radius.powi(2),
                square => square.area_m2(),
            },
            Start::Luminaire(luminaire) => self.scene.luminaires[luminaire].area_m2,
        };
        photon.of as f64 / (self.emission.photons() as f64 * area)
    }

    /// Adds the light that a vertex sends straight to the sensors of a grid; returns the number of rays.
    fn connect_sensors(&self, vertex: &LightVertex<C>, grid: &Grid, lux: &mut [f64], random: &mut PathRandom) -> u64 {
        let height = grid.height_m + self.scene.contact();
        if vertex.position.z <= height {
            return 0;
        }
        let stride = stride(grid);
        let first = if stride > 1 { (random.uniform() * stride as f64) as usize } else { 0 };
        let offset = if is_average(grid) { random.uniform2().map(|u| u - 0.5) } else { [0.0; 2] };
        let per_path = 1.0 / self.connections_per_path(grid);
        let mut rays = 0;
        for index in (first..grid.len()).step_by(stride) {
            let sensor = place(grid, index, offset, height);
            let to_sensor = sensor - vertex.position;
            let distance_squared = to_sensor.length_squared();
            let outward = to_sensor / distance_squared.sqrt();
            let intensity = vertex.intensity(&self.scene, outward).luminance();
            // flights count light that comes from near
            let counted = is_average(grid) && vertex.alone() && distance_squared < near(grid).powi(2);
            let is_outside = grid.is_cut(index) && self.scene.is_in_solid(sensor);
            if intensity <= 0.0 || counted || is_outside {
                continue;
            }
            rays += 1;
            if !self.scene.visible(vertex.position, vertex.surface, sensor, None) {
                continue;
            }
            let by_eye = -outward.z / PI * outward.dot(vertex.normal) / distance_squared;
            let others = per_path * vertex.weight.others(by_eye, vertex.back(&self.scene, outward));
            lux[index] += intensity * -outward.z * stride as f64 / (distance_squared * (1.0 + others));
        }
        rays
    }

    /// Returns the pixel in which the eye sees a vertex, and its luminance.
    fn connect_eye(&self, vertex: &LightVertex<C>, view: &View) -> Option<(usize, Spectrum<C>)> {
        let (pixel, solid_angle) = view.pixel_of(vertex.position)?;
        let to_vertex = vertex.position - view.eye;
        let distance_squared = to_vertex.length_squared();
        let direction = to_vertex / distance_squared.sqrt();
        let intensity = vertex.intensity(&self.scene, -direction);
        if intensity.max() <= 0.0 {
            return None;
        }
        let entry = enter_room(&self.scene, view.eye, direction)?;
        if !self.scene.visible(vertex.position, vertex.surface, entry, None) {
            return None;
        }
        let by_eye = -direction.dot(vertex.normal) / (solid_angle * distance_squared);
        let others = vertex.weight.others(by_eye, vertex.back(&self.scene, -direction)) / self.connections_per_ray();
        Some((pixel, intensity * (1.0 / (distance_squared * solid_angle * (1.0 + others)))))
    }

    /// Adds the light of a flight that crosses a cell within `within` m of its start.
    fn cross(&self, flight: &Flight<C>, grid: &Grid, within: f64, lux: &mut [f64]) {
        let level = grid.height_m + self.scene.contact();
        if flight.from.z <= level || flight.to.z > level {
            return;
        }
        let fraction = (flight.from.z - grid.height_m) / (flight.from.z - flight.to.z);
        let crossing = flight.from.lerp(flight.to, fraction);
        if (crossing - flight.from).length_squared() >= within * within {
            return;
        }
        if let Some(cell) = grid.cell_at(crossing.truncate()) {
            lux[cell] += flight.flux.luminance() / grid.cell_area_m2();
        }
    }

    /// Returns the number of connections of photons to a sensor for each of its paths.
    fn connections_per_path(&self, grid: &Grid) -> f64 {
        let connections = self.emission.photons() as f64 / stride(grid) as f64;
        connections / f64::from(self.counts.per_sensor)
    }

    /// Returns the number of photons times the area of a cell in m2 for each of its paths.
    fn crossings_per_path(&self, grid: &Grid) -> f64 {
        self.emission.photons() as f64 * grid.cell_area_m2() / f64::from(self.counts.per_sensor)
    }

    fn connections_per_ray(&self) -> f64 {
        self.emission.photons() as f64 / f64::from(self.counts.per_pixel)
    }

    /// Returns the vertices of the photon to which an eye path is connected; `choice` in 0..1 chooses it. Photons are ordered by their
    /// sources, so that even choices divide paths evenly among these.
    fn photon<'a>(&self, paths: &'a LightPaths<C>, choice: f64) -> &'a [LightVertex<C>] {
        let photons = self.emission.photons();
        paths.of(((choice * photons as f64) as u64).min(photons - 1) as usize)
    }

    /// Computes the illuminance of one sensor in lx without the photons' connections, and the number of rays.
    fn sensor(&self, grid: &Grid, index: usize, paths: &LightPaths<C>, stream: Key) -> (f64, RayCount) {
        let count = self.counts.per_sensor;
        let average = is_average(grid);
        let from = if average { From::Cell(self.crossings_per_path(grid)) } else { From::Point };
        let (photons, cut) = (self.emission.photons() as f64, self.connections_per_path(grid));
        let (mut lux, mut rays) = (0.0, RayCount::default());
        for number in 0..count {
            let mut walk = Walk::new(&self.scene, PathSamples::new(stream, u64::from(number)), 0);
            let choice = (f64::from(number) + walk.samples.random.uniform()) / f64::from(count);
            let photon = self.photon(paths, choice);
            let offset = if average { walk.samples.pair().map(|u| u - 0.5) } else { [0.0; 2] };
            let sensor = place(grid, index, offset, grid.height_m + self.scene.contact());
            if !self.scene.is_in_solid(sensor) {
                let looking_up = Sensor { position: sensor, normal: DVec3::Z };
                walk.illuminance(&EyeSide { starts: &self.starts, photon, photons, from, cut }, looking_up);
            }
            lux += walk.sum.luminance();
            rays += walk.rays;
        }
        lux /= f64::from(count);
        if !is_average(grid) {
            let per_sensor = (self.emission.photons() / grid.len() as u64).next_power_of_two();
            let backward_rays = per_sensor.clamp(16, MOST_BACKWARD_RAYS);
            let sensor = Sensor { position: place(grid, index, [0.0; 2], grid.height_m), normal: DVec3::Z };
            let (straight, backward) = unscattered(
                &self.scene,
                sensor,
                stream.stream(Stream::UnscatteredBidirectional, 0),
                LooksUp::by_rays(backward_rays),
                |_| true,
            );
            lux += straight;
            rays += backward;
        }
        (lux, rays)
    }

    /// Computes the luminance of one pixel in cd/m2 without the photons' connections, and the number of rays.
    fn pixel(&self, view: &View, pixel: usize, paths: &LightPaths<C>, stream: Key) -> (Spectrum<C>, RayCount) {
        let (column, row) = (pixel % view.size_px[0], pixel / view.size_px[0]);
        let count = u64::from(self.counts.per_pixel);
        let (photons, cut) = (self.emission.photons() as f64, self.connections_per_ray());
        let (mut luminance, mut rays) = (Spectrum::ZERO, RayCount::default());
        let first = number_in_squares([column, row]) * count;
        for number in first..first + count {
            let mut walk = Walk::new(&self.scene, PathSamples::with_pairs(stream, number, SOBOL_PAIRS_SEEN), 0);
            let [x, y] = place_in_pixel(stream, number, count, &mut walk.samples);
            let [.., choice, _] = beside_directions(stream, number);
            let photon = self.photon(paths, choice);
            let direction = view.ray_direction(column as f64 + x, row as f64 + y);
            if let Some(origin) = enter_room(&self.scene, view.eye, direction) {
                let outside = (origin - view.eye).length();
                let side = EyeSide { starts: &self.starts, photon, photons, from: From::Eye, cut };
                let trace = side.start_at_eye(outside, view.pixel_sr(direction));
                walk.luminance(&side, origin, direction, trace);
            }
            luminance += walk.sum;
            rays += walk.rays;
        }
        (luminance * (1.0 / count as f64), rays)
    }
}

impl<const C: usize> Integrator for Bidirectional<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let going_on = || !cancel.load(Ordering::Relaxed);
        let mut paths = LightPaths::new();
        let mut totals = PhotonTotals::new(self.scene.tubes.len());
        let mut grids: Vec<_> = self.grids.iter().map(|grid| vec![0.0; grid.len()]).collect();
        let mut views: Vec<_> =
            self.views.iter().map(|view| vec![0.0; C * view.size_px[0] * view.size_px[1]]).collect();
        let sensors: usize = grids.iter().map(Vec::len).sum();
        let chunk = |numbers: Range<u64>| self.photons(key, numbers);
        let folded = fold_chunks(
            Chunks::of_long_paths(self.emission.photons()),
            8 * sensors as u64,
            cancel,
            chunk,
            |chunk: Connected<C>| {
                paths.append(&chunk.paths);
                totals.add(&chunk.totals);
                for (sum, lux) in grids.iter_mut().zip(&chunk.grids) {
                    sum.iter_mut().zip(lux).for_each(|(sum, lux)| *sum += lux);
                }
                for (sum, pixels) in views.iter_mut().zip(&chunk.views) {
                    for (pixel, luminance) in pixels {
                        add(&mut sum[pixel * C..(pixel + 1) * C], luminance);
                    }
                }
            },
        )?;
        totals.not_finite = folded.not_finite;
        for (number, (grid, lux)) in self.grids.iter().zip(&mut grids).enumerate() {
            let stream = key.stream(Stream::Grid, number as u64);
            let sensor = |index: usize| {
                going_on().then(|| match grid.is_inside(index) {
                    true => Default::default(),
                    false => self.sensor(grid, index, &paths, stream.child(index as u64)),
                })
            };
            let sensors: Option<Vec<_>> = (0..grid.len()).into_par_iter().map(sensor).collect();
            for (sum, (value, rays)) in lux.iter_mut().zip(sensors?) {
                *sum += value;
                totals.rays += rays;
            }
        }
        for (number, (view, image)) in self.views.iter().zip(&mut views).enumerate() {
            let stream = key.stream(Stream::View, number as u64);
            let pixel = |index: usize| going_on().then(|| self.pixel(view, index, &paths, stream));
            let pixels: Option<Vec<_>> = (0..image.len() / C).into_par_iter().map(pixel).collect();
            for (sum, (luminance, rays)) in image.chunks_exact_mut(C).zip(pixels?) {
                add(sum, &luminance);
                totals.rays += rays;
            }
        }
        let grids = grids.into_iter().map(|illuminance| GridPass { illuminance, ..GridPass::default() }).collect();
        let rays = vec![f64::from(self.counts.per_pixel)];
        let view = |luminance| ViewPass { luminance, rays: rays.clone(), ..ViewPass::default() };
        let views = views.into_iter().map(view).collect();
        Some(Pass { grids, views, totals, photons: self.emission.photons(), ..Pass::default() })
    }
}

fn add<const C: usize>(sum: &mut [f64], value: &Spectrum<C>) {
    sum.iter_mut().zip(value.0).for_each(|(sum, value)| *sum += value);
}

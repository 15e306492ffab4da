//! Two stages: the path is cut at Lambertian diffusers, which forget where light came from.
//!
//! **Idea.** In each pass photons first find what leaves the diffusers ([`lamp`](super::lamp)). Then paths go backward from the
//! sensors and the eye (`backward::walk`), and every vertex counts that light in closed form, or nearly so.
//! The stages are independent, and what the second finds is linear in what the first gives: their product is unbiased.
//! One pass is one replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#two-stages). A vertex V is *far* beyond one radius from a
//! disc.
//!
//! | paths | estimator |
//! | --- | --- |
//! | `(K\|N) t F E`, far sensors that see all discs, and the eye | every photon, connected |
//! | `(K\|N) t F V`, V the first, far, disc above the horizon, nothing between, no lobe | rings and sectors in closed form, and one photon for what they leave out |
//! | `(K\|N) t F V`, V a later one, else the same | one photon by its flux, connected |
//! | `(K\|N) t F V`, far, else | two photons, connected |
//! | `(K\|N) t F V`, near, or a lobe below a roughness of 0.2 | as path tracing |
//! | `K t F S+ (V\|E)` | chance |
//! | `M ..` and interreflection, light sent up and back included | as path tracing |
//! | `(K\|N) t C ..` of grids, below closures that are lamps in part | as light tracing ([`lamp::beside`](super::lamp::beside)) |
//!
//! **Settings.** `photons_per_pass` (64 to 16 777 216; with views 8192 by default) against `samples_per_sensor` (1 to 65 536)
//! and `samples_per_pixel` (8; 1 to 4096): noise of the first stage is common to all sensors of a pass, that of the second
//! is each sensor's own. Without views the first two are by default chosen for the accuracy asked for, so that 8 to some tens
//! of passes reach it.
//!
//! **Refuses** closures without a Lambertian zone, with views all that pass light unscattered, measured diffusers, and the sun by
//! way of mirrors and of lobes below a roughness of 0.2. Bad at diffusers that mirrors show (it warns). The fluxes of tubes are
//! those of the first stage; a few photons tell for the books where the light of the room ends.
//!
//! **Sources.** The cut is derived here (docs/physics/measurement_equation.md#two-stages); Kajiya 1986, Veach and
//! Guibas 1995.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use crate::guide::RayCount;
use crate::integrator::backward;
use crate::integrator::backward::chance;
use crate::integrator::backward::pass::{Sampling, centre, each};
use crate::integrator::backward::room_entry::exit_seen_by;
use crate::integrator::lamp::beside::{
    Lamps, Lit, add_beside, bytes_beside, most_places, photons_beside, refuses_all_but_lamps, refuses_beside,
};
use crate::integrator::lamp::light::{DiffuserLight, SensorsLit};
use crate::integrator::lamp::sizes::photons_for;
use crate::integrator::method::{Caveat, Computation, Described, Load, Refusal, Task, Trial, Work};
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon::chunks::MOST_CHUNK;
use crate::integrator::photon::descent::Exit;
use crate::integrator::trial::{Powers, TrialPasses};
use crate::integrator::{GridPass, Integrator, Pass, ViewPass};
use crate::optics::{Closure, Spectrum};
use crate::sampling::{Key, Stream, power_of_two};
use crate::scene::{Channels, EstimateKind, Grid, View};
use crate::traceable::{TraceableScene, TraceableTube};

/// Settings of two stages.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Photons from sky and sun per pass, all tubes together; 64..=16_777_216; `None`: by the accuracy asked for, or with views 8192.
    pub photons_per_pass: Option<u64>,
    /// Backward paths per sensor and pass; 1..=65_536; `None`: by the accuracy asked for, or with views 256.
    pub samples_per_sensor: Option<u32>,
    /// Backward paths per pixel and pass; 1..=4_096.
    pub samples_per_pixel: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: None, samples_per_sensor: None, samples_per_pixel: 8 }
    }
}

/// Fewest and most photons, and most paths from a sensor, of a pass unless the document says how many; with views the most.
const FEWEST_PHOTONS: f64 = 64.0;
const MOST_PHOTONS: f64 = 8192.0;
const MOST_SAMPLES: f64 = 256.0;

/// Paths from a sensor in a pass of grids alone, unless the document says how many.
const SAMPLES: PassSize = PassSize { for_one_percent: 16.0, growth: 1.65, fewest: 1.0, most: MOST_SAMPLES };

/// Numbers of a pass.
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Photons down the tubes.
    pub photons: u64,
    /// Paths from each sensor.
    pub per_sensor: u32,
    /// Paths from each pixel.
    pub per_pixel: u32,
}

impl Settings {
    /// The numbers of a pass for a relative standard error `target` of grids, or with views.
    fn sizes(&self, target: f64, tubes: &[TraceableTube], views: bool) -> Sizes {
        let wanted = photons_for(tubes, target).max(photons_beside(tubes, target));
        let photons = if views { MOST_PHOTONS } else { wanted.clamp(FEWEST_PHOTONS, MOST_PHOTONS) };
        let samples = if views { MOST_SAMPLES as u64 } else { SAMPLES.power_of_two(target) };
        Sizes {
            photons: self.photons_per_pass.unwrap_or_else(|| power_of_two(photons)),
            per_sensor: self.samples_per_sensor.unwrap_or(samples as u32),
            per_pixel: self.samples_per_pixel,
        }
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "two_stage"
    }

    fn remark(&self) -> Option<&'static str> {
        Some("photons to the diffusers, then backward paths in the room")
    }

    /// Refuses closures that do not forget directions, and sun that only chance would find by way of mirrors.
    fn refuses(&self, task: &Task) -> Option<Refusal> {
        refuses_closures(task).or_else(|| chance::sun_by_mirrors(task.traceable))
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        chance::mirrors(self.name(), task.traceable)
    }

    fn seconds_per_pass(&self, work: &Work) -> f64 {
        let sizes = self.sizes(work.target, &[], work.pixels > 0.0);
        let sensor_paths = f64::from(sizes.per_sensor) * work.sensors;
        let eye_paths = f64::from(sizes.per_pixel) * work.pixels;
        sizes.photons as f64 * (work.seconds_per_path + 2e-9 * work.sensors)
            + (sensor_paths + eye_paths) * (1e-6 + 0.5e-6 * work.tubes)
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        // a place on the diffuser, the flux, and an offset for cells
        let photons = self.photons_per_pass.map_or(MOST_PHOTONS, |photons| photons as f64);
        photons * load.photon_bytes() * Load::COPIES + bytes_beside(load, photons)
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let sizes = self.sizes(target, &task.traceable.tubes, !task.views.is_empty());
        if task.views.is_empty() && self.samples_per_sensor.is_none() {
            let whole = Trial::whole(self.clone(), most_places(&task.traceable.tubes, 49));
            return whole.with(TrialPasses::of_size(f64::from(sizes.per_sensor), Powers::of_growth(SAMPLES.growth)));
        }
        // each place has the noise of its own paths, whose number stays, and all have that of the photons
        let powers = Powers { work_of_place: 0.0, variance: 0.0, ..Powers::OF_PHOTONS };
        let tried = TrialPasses::fewer(sizes.photons, 0.125);
        let smaller =
            Self { photons_per_pass: Some(tried), samples_per_sensor: Some(sizes.per_sensor), ..self.clone() };
        let most_places = if task.views.is_empty() { 9 } else { 512 };
        Trial::whole(smaller, most_places).with(TrialPasses::of_photons(tried, sizes.photons, powers))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let sizes = self.sizes(target, &scene.tubes, !task.views.is_empty());
        match task.scene.channels {
            Channels::Photopic => Computation::passes(TwoStage::<1>::new(scene, task.grids, task.views, sizes, seed)),
            Channels::Rgb => Computation::passes(TwoStage::<3>::new(scene, task.grids, task.views, sizes, seed)),
        }
    }
}

/// Reason why paths cannot be cut at the closures, if so: light from beside lamps is found for grids alone, and near an opening paths
/// follow all that its table scatters.
fn refuses_closures(task: &Task) -> Option<Refusal> {
    let tubes = &task.traceable.tubes;
    let measured = tubes.iter().any(|tube| tube.diffuser.measured().is_some());
    if measured || !task.views.is_empty() { refuses_all_but_lamps(tubes) } else { refuses_beside(task) }
}

/// Reflections of a path that no roulette decides: it would throw away what even points gain.
const CERTAIN_REFLECTIONS: u32 = 3;

/// Pairs of Sobol coordinates of a path.
const SOBOL_PAIRS: u32 = 8;

/// The same for paths from an eye, which share even points with those of neighbouring pixels: a third pair gains nothing.
const SOBOL_PAIRS_SEEN: u32 = 2;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct TwoStage<const C: usize> {
    scene: Arc<TraceableScene>,
    lamps: Lamps<C>,
    grids: Vec<Grid>,
    views: Vec<View>,
    sizes: Sizes,
    seed: Key,
}

impl<const C: usize> TwoStage<C> {
    /// Divides the photons of a pass among sky and sun of the tubes; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], views: &[View], sizes: Sizes, seed: u64) -> Self {
        let lamps = Lamps::new(&scene, grids, sizes.photons, seed);
        let (grids, views) = (grids.to_vec(), views.to_vec());
        Self { scene, lamps, grids, views, sizes, seed: Key::new(seed) }
    }

    /// Illuminance of a grid in lux, and the rays it took; `None` when cancelled.
    fn grid(
        &self,
        light: &DiffuserLight<C>,
        grid: &Grid,
        stream: Key,
        cancel: &AtomicBool,
    ) -> Option<(Vec<f64>, RayCount)> {
        let scene = &*self.scene;
        let sampling = sampling(self.sizes.per_sensor);
        let average = grid.estimate == EstimateKind::CellAverage;
        let offsets = average.then(|| light.offsets(grid.cell_size_m, stream));
        let reach = if average { 0.5 * libm::hypot(grid.cell_size_m[0], grid.cell_size_m[1]) } else { 0.0 };
        let sensors = each(grid.len(), cancel, |index| {
            if grid.is_inside(index) {
                return (0.0, RayCount::default());
            }
            let position = centre(scene, grid, index);
            let stream = stream.stream(Stream::Sensor, index as u64);
            let clear =
                |tube: &TraceableTube| scene.leaves_clear(position, reach, None, tube.origin, tube.opening_radius);
            if !light.is_far(position, reach) || !scene.tubes.iter().all(clear) {
                return backward::pass::sensor::<C>(scene, grid, index, sampling, stream, light);
            }
            let direct = light.at_sensor(position, offsets.as_deref());
            let (lux, rays) = backward::pass::sensor::<C>(scene, grid, index, sampling, stream, &SensorsLit(light));
            (direct + lux, rays)
        })?;
        let (illuminance, rays): (Vec<f64>, Vec<RayCount>) = sensors.into_iter().unzip();
        Some((illuminance, rays.into_iter().sum()))
    }

    /// Adds the light of the diffusers that the eye sees straight.
    fn add_diffusers(&self, light: &DiffuserLight<C>, view: &View, luminance: &mut [f64]) {
        for tube in light.tubes() {
            let exits: Vec<_> = tube
                .photons()
                .map(|(position, flux)| Exit { position, closure: Closure::EVEN, from: DVec3::Z, flux })
                .collect();
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
}

impl<const C: usize> Integrator for TwoStage<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let scene = &*self.scene;
        let Lit { lamps: light, beside, account } = self.lamps.pass(scene, key, cancel)?;
        let mut result = Pass { account, photons: self.lamps.photons(), ..Pass::default() };
        for (number, grid) in self.grids.iter().enumerate() {
            let stream = key.stream(Stream::Grid, number as u64);
            let (illuminance, rays) = self.grid(&light, grid, stream, cancel)?;
            result.account.rays += rays;
            result.grids.push(GridPass { illuminance, ..GridPass::default() });
        }
        add_beside(&mut result.grids, &beside);
        for (number, view) in self.views.iter().enumerate() {
            let stream = key.stream(Stream::View, number as u64);
            let sampling = sampling_of_pixels(self.sizes.per_pixel);
            let (mut luminance, rays) = backward::pass::view::<C>(scene, view, sampling, stream, &light, cancel)?;
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            self.add_diffusers(&light, view, &mut luminance);
            result.account.rays += rays;
            let rays = vec![f64::from(self.sizes.per_pixel)];
            result.views.push(ViewPass { luminance, rays, ..ViewPass::default() });
        }
        Some(result)
    }
}

fn sampling(paths: u32) -> Sampling {
    Sampling { paths, certain: CERTAIN_REFLECTIONS, pairs: SOBOL_PAIRS }
}

fn sampling_of_pixels(paths: u32) -> Sampling {
    Sampling { paths, certain: CERTAIN_REFLECTIONS, pairs: SOBOL_PAIRS_SEEN }
}

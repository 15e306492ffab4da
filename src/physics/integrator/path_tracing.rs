//! Path tracing: from the sensors and the eye backward to sky, sun and luminaires.
//!
//! **Idea.** A path starts at a sensor or pixel and is scattered from surface to surface. At every vertex it is connected to the openings
//! of the tubes and to the luminaires (`backward::walk`, `backward::daylight`); if the continued ray meets such a light by chance, MIS
//! combines both estimates. Unbiased; one pass is one replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#path-tracing), V: the sensor or a finite vertex `D`, `G`, `F`.
//!
//! | paths | estimator |
//! | --- | --- |
//! | `K t (C\|F) V` | connection to the opening, and chance, weighed by the power heuristic |
//! | `K t (C\|F) S+ V`, `K t (C\|F) S* E` of an eye | chance |
//! | `K .. t (C\|F) ..` after a return of the guide | chance |
//! | `N t F V`, `N t F E` of an eye | rays from the sun's disc, connected |
//! | `M V` | closed form, or connection and chance |
//! | `M S+ V`, `M S* E` of an eye | chance |
//! | `.. V V E`, `F` from below and `F t F` included | the continued ray |
//!
//! **Settings.** `samples_per_sensor` (64; 1 to 65 536) and `samples_per_pixel` (4; 1 to 4096) paths a pass trade the
//! number of replicates against the noise of each.
//!
//! **Refuses** the sun through clear closures, where only one direction in hundreds meets the disc even at its own zenith angle, and the
//! sun by way of mirrors and of lobes below a roughness of 0.2. Bad at diffusers and luminaires that a sensor sees in mirrors (it warns),
//! and at many tubes: each path is connected to all of them. Reports neither fluxes of tubes nor the energy balance.
//!
//! **Sources.** Kajiya 1986; Veach and Guibas 1995 for the weights.

use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use super::{GridPass, Integrator, Pass, ViewPass};
use crate::guide::RayCount;
use crate::integrator::backward;
use crate::integrator::backward::chance;
use crate::integrator::backward::daylight::Followed;
use crate::integrator::backward::pass::{Sampling, each};
use crate::integrator::backward::room_entry::exit_seen_by;
use crate::integrator::method::{Caveat, Computation, Described, Outputs, Refusal, Task, Trial};
use crate::integrator::photon::chunks::{Chunks, Tally, fold_chunks};
use crate::integrator::photon::descent::sun_exits;
use crate::integrator::photon::energy_balance::PhotonTotals;
use crate::optics::Spectrum;
use crate::sampling::path_samples::SOBOL_PAIRS;
use crate::sampling::{Key, PathSamples, Stream};
use crate::scene::{Channels, Grid, View};
use crate::traceable::TraceableScene;

/// Settings of path tracing.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of paths per sensor and pass; 1..=65_536.
    pub samples_per_sensor: u32,
    /// Number of paths per pixel and pass; 1..=4_096.
    pub samples_per_pixel: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self { samples_per_sensor: 64, samples_per_pixel: 4 }
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "path_tracing"
    }

    fn outputs(&self) -> Outputs {
        Outputs { energy: false, tube_fluxes: false, any_sensors: true, ..Outputs::ALL }
    }

    fn refuses(&self, task: &Task) -> Option<Refusal> {
        chance::sun(task.traceable)
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        chance::mirrors(self.name(), task.traceable)
    }

    fn trial(&self, task: &Task, _target: f64) -> Trial {
        Trial::whole(self.clone(), if task.views.is_empty() { 16 } else { 1024 })
    }

    fn build(&self, task: &Task, seed: u64, _target: f64) -> Computation {
        let scene = task.traceable.clone();
        match task.scene.channels {
            Channels::Photopic => Computation::passes(PathTracing::<1>::new(scene, task.grids, task.views, self, seed)),
            Channels::Rgb => Computation::passes(PathTracing::<3>::new(scene, task.grids, task.views, self, seed)),
        }
    }
}

/// Number of the sun's rays per tube that are connected to the eye of a view: per path of the view, and the smallest number.
const SUN_RAYS_PER_PATH: f64 = 0.0625;
const LEAST_SUN_RAYS: u64 = 1024;

/// Path tracing of one scene with `C` channels of light.
#[derive(Debug)]
pub struct PathTracing<const C: usize> {
    scene: Arc<TraceableScene>,
    grids: Vec<Grid>,
    views: Vec<View>,
    settings: Settings,
    seed: Key,
}

impl<const C: usize> PathTracing<C> {
    /// Creates the method for the outputs of a scene; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        let (grids, views) = (grids.to_vec(), views.to_vec());
        Self { scene, grids, views, settings: settings.clone(), seed: Key::new(seed) }
    }

    /// Adds sunlight that closures scatter directly to the eye; returns the number of rays, or `None` if cancelled.
    fn add_sun(&self, view: &View, stream: Key, luminance: &mut [f64], cancel: &AtomicBool) -> Option<RayCount> {
        if !self.scene.has_sun() {
            return Some(RayCount::default());
        }
        let paths = (view.size_px[0] * view.size_px[1]) as f64 * f64::from(self.settings.samples_per_pixel);
        let count = ((paths * SUN_RAYS_PER_PATH) as u64).max(LEAST_SUN_RAYS);
        let mut rays = RayCount::default();
        for (number, tube) in self.scene.tubes.iter().enumerate() {
            let Some(sun) = tube.sun.as_ref().filter(|_| tube.scatters()) else { continue };
            let stream = stream.child(number as u64);
            let chunk = |numbers: Range<u64>| {
                let (mut seen, mut rays) = (Vec::new(), RayCount::default());
                for index in numbers {
                    let mut samples = PathSamples::new(stream, index);
                    sun_exits(&self.scene, tube, sun, &mut samples, &mut rays, |exit| {
                        seen.extend(exit_seen_by(&self.scene, exit, view));
                    });
                }
                (seen, rays)
            };
            fold_chunks(Chunks::of_short_paths(count), 0, cancel, chunk, |(seen, of_chunk): SunlitPixels<C>| {
                rays += of_chunk;
                for (pixel, value) in seen {
                    for (channel, value) in value.0.into_iter().enumerate() {
                        luminance[pixel * C + channel] += value / count as f64;
                    }
                }
            })?;
        }
        Some(rays)
    }
}

/// Pixels that see some of the sun's rays, with the luminance that these add, and the number of rays traced.
type SunlitPixels<const C: usize> = (Vec<(usize, Spectrum<C>)>, RayCount);

impl<const C: usize> Tally for SunlitPixels<C> {
    fn is_finite(&self) -> bool {
        self.0.iter().all(|(_, luminance)| luminance.is_finite())
    }
}

impl<const C: usize> Integrator for PathTracing<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let scene = &*self.scene;
        let mut result = Pass::default();
        let mut rays = RayCount::default();
        for (number, grid) in self.grids.iter().enumerate() {
            let stream = key.stream(Stream::Grid, number as u64);
            let sampling = sampling(self.settings.samples_per_sensor);
            let sensors = each(grid.len(), cancel, |index| {
                backward::pass::sensor::<C>(scene, grid, index, sampling, stream.child(index as u64), &Followed)
            })?;
            rays += sensors.iter().map(|(_, rays)| *rays).sum::<RayCount>();
            let illuminance = sensors.into_iter().map(|(lux, _)| lux.whole).collect();
            result.grids.push(GridPass { illuminance, ..GridPass::default() });
        }
        for (number, view) in self.views.iter().enumerate() {
            let stream = key.stream(Stream::View, number as u64);
            let sampling = sampling(self.settings.samples_per_pixel);
            let (mut luminance, of_view) = backward::pass::view::<C>(scene, view, sampling, stream, &Followed, cancel)?;
            let stream = key.stream(Stream::SunToEye, number as u64);
            rays += of_view + self.add_sun(view, stream, &mut luminance, cancel)?;
            let rays = vec![f64::from(self.settings.samples_per_pixel)];
            result.views.push(ViewPass { luminance, rays, ..ViewPass::default() });
        }
        // nothing is emitted: neither the fluxes of tubes nor the energy balance are estimated
        result.totals = PhotonTotals { rays, ..PhotonTotals::default() };
        Some(result)
    }
}

fn sampling(paths: u32) -> Sampling {
    Sampling { paths, beyond: None, certain: 0, pairs: SOBOL_PAIRS }
}

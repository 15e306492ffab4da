//! Stochastic progressive photon mapping: photons and eye rays are new in every pass, radii shrink.
//!
//! **Idea.** Every pass traces its own photons and eye rays and gathers with a radius that shrinks from pass to pass
//! (`photon_map::progressive`): by a schedule, so that passes are independent replicates, or by statistics that the rays of a pixel, or the
//! points of a cell, share. Photons are gathered for the diffuse part of a surface only; its mirror or lobe is followed
//! (`photon_map::visible_point`). Direct light from a diffuser or luminaire is estimated by connections, not gathered
//! (`photon_map::near_light`).
//!
//! **Which paths** (docs/physics/measurement_equation.md#progressive-photon-mapping-fixed-and-stochastic):
//!
//! | paths | estimator |
//! | --- | --- |
//! | `.. F` and `M` straight to a sensor or the eye's `D` | connections to the pass' photons at the diffuser; closed form or points |
//! | all else that arrives there | gather |
//! | `.. (F\|M) S* E` of an eye | exitance gathered on the diffuser; the luminaire's luminance |
//! | `.. F G E`, `M G E` of an eye | connection to photons or points, and the reflected ray, by MIS |
//! | `N t C G E`, roughness of at least 0.15 | sunbeams gathered in the lobe |
//! | `(K\|N) t C (S\|G)* E` of an eye, else | the ray, up the guide |
//!
//! **Settings.** `photons_per_pass` (65 536; 64 to 16 777 216); `initial_radius_m` (a twentieth of the room's shortest
//! edge) and `alpha` (2/3; between 0 and 1: the squared radius shrinks by (i + alpha) / (i + 1)) trade noise against
//! bias, whose estimate is part of every error; `radius`: by schedule, or per point.
//!
//! **Refuses** nothing: it is the method that `auto` falls back on. Bad at high accuracy: half the error costs eight
//! times the passes, where an unbiased method needs four times.
//!
//! **Sources.** Hachisuka and Jensen 2009; Knaus and Zwicker 2011 for the schedule.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use super::{GridPass, Integrator, Pass, PhotonCount, ViewPass};
use crate::integrator::backward::chance;
use crate::integrator::method::{Caveat, Computation, Described, Load, Passes, Retained, Task, Trial};
use crate::integrator::photon_map::maps::{Gathered, Mapper, Maps};
use crate::integrator::photon_map::near_light::{SENSOR_CONNECTIONS, SENSOR_STRATA};
use crate::integrator::photon_map::outline::OutlinedView;
use crate::integrator::photon_map::progressive::{Carried, PointStatistics, Radii, Radius, TRIAL_RADIUS};
use crate::integrator::photon_map::surfaces::Surfaces;
use crate::integrator::photon_map::trial::of_wider_kernels;
use crate::integrator::photon_map::{memory, visible_point};
use crate::integrator::trial::TrialPasses;
use crate::sampling::{Key, PathRandom, Stream};
use crate::scene::{Channels, EstimateKind, Grid, View};
use crate::traceable::TraceableScene;

/// Settings of stochastic progressive photon mapping.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of photons emitted per pass, all tubes and sources together; 64..=16_777_216.
    pub photons_per_pass: u64,
    /// Gather radius of the first pass in metres; `None`: a twentieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// The squared radius shrinks by (i + alpha) / (i + 1) from pass i to i + 1, per point by (N + alpha M) / (N + M);
    /// 0 < alpha < 1.
    pub alpha: f64,
    /// Rule by which radii shrink.
    pub radius: Radius,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: 65_536, initial_radius_m: None, alpha: 2.0 / 3.0, radius: Radius::Schedule }
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "sppm"
    }

    fn remark(&self) -> Option<&'static str> {
        Some(self.radius.reason())
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        // grids gather on their planes, which are always clipped
        let uncut = if task.views.is_empty() { None } else { Surfaces::new(task.traceable).uncut };
        uncut.map(|uncut| uncut.caveat(self.name())).or_else(|| chance::mirrors_in_gloss(self.name(), task))
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        memory::bytes(self.photons_per_pass, if load.views > 0 { 1.0 } else { 0.0 }, load)
    }

    fn passes(&self) -> Passes {
        Passes::InOrder
    }

    fn retained_per_sensor(&self, _: &Grid) -> Retained {
        self.retained_per_pixel()
    }

    fn retained_per_pixel(&self) -> Retained {
        let radii = if self.radius == Radius::PerPoint { 1.0 } else { 0.0 };
        Retained { radii, ..Retained::MEANS }
    }

    fn trial(&self, task: &Task, _target: f64) -> Trial {
        let photons_per_pass = TrialPasses::fewer(self.photons_per_pass, 0.0625);
        let initial_radius_m =
            Some(TRIAL_RADIUS * Radii::initial_m(self.initial_radius_m, task.traceable.enclosure.extent()));
        let smaller = Self { photons_per_pass, initial_radius_m, ..self.clone() };
        let places = if task.views.is_empty() { 81 } else { 1024 };
        Trial::whole(smaller, places).with(of_wider_kernels(photons_per_pass, self.photons_per_pass, self.alpha))
    }

    fn build(&self, task: &Task, seed: u64, _target: f64) -> Computation {
        let scene = task.traceable.clone();
        match task.scene.channels {
            Channels::Photopic => Computation::passes(Sppm::<1>::new(scene, task.grids, task.views, self, seed)),
            Channels::Rgb => Computation::passes(Sppm::<3>::new(scene, task.grids, task.views, self, seed)),
        }
    }
}

/// Stochastic progressive photon mapping of one scene with `C` channels of light.
#[derive(Debug)]
pub struct Sppm<const C: usize> {
    mapper: Mapper<C>,
    views: Vec<OutlinedView>,
    radii: Radii,
    seed: Key,
}

impl<const C: usize> Sppm<C> {
    /// Divides the photons of a pass among the sources; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        Self {
            radii: Radii::new(settings.radius, settings.initial_radius_m, settings.alpha, scene.enclosure.extent()),
            views: OutlinedView::all(&scene, views),
            mapper: Mapper::new(scene, grids, !views.is_empty(), settings.photons_per_pass),
            seed: Key::new(seed),
        }
    }

    /// Computes one grid of one pass, and the states of its sensors after it; returns `None` if cancelled.
    fn grid(
        &self,
        number: usize,
        maps: &Maps<C>,
        before: &[PointStatistics],
        key: Key,
        cancel: &AtomicBool,
    ) -> Option<(GridPass, Vec<PointStatistics>)> {
        let mapper = &self.mapper;
        let grid = &mapper.grids[number];
        let stream = key.stream(Stream::GatheringGrid, number as u64);
        let values: Option<Vec<(f64, Gathered<C>, PhotonCount)>> = (0..grid.len())
            .into_par_iter()
            .map(|index| {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let mut random = PathRandom::new(stream.child(index as u64));
                let mut sensor = grid.centre(index);
                if grid.estimate == EstimateKind::CellAverage {
                    let [u, v] = random.uniform2();
                    sensor.x += (u - 0.5) * grid.cell_size_m[0];
                    sensor.y += (v - 0.5) * grid.cell_size_m[1];
                }
                if grid.is_inside(index) || mapper.scene.is_in_solid(sensor) {
                    return Some((0.0, Gathered::NOTHING, PhotonCount::default()));
                }
                let direct = mapper.diffuser_irradiance(maps, sensor, DVec3::Z, None, SENSOR_CONNECTIONS, &mut random);
                let electric = mapper.luminaire_irradiance(sensor, DVec3::Z, None, SENSOR_STRATA, &mut random);
                let radius = before.get(index).map_or(maps.radius, PointStatistics::radius_m);
                let (mut gathered, photons) = mapper.plane_irradiance(maps, radius, number, sensor);
                gathered.bias += direct.bias;
                let lux = direct.irradiance.luminance() + electric.luminance() + gathered.irradiance.luminance();
                Some((lux, gathered, photons))
            })
            .collect();
        let values = values?;
        let pass = GridPass {
            illuminance: values.iter().map(|(lux, ..)| *lux).collect(),
            bias: values.iter().map(|(_, gathered, _)| gathered.bias).collect(),
            photons: values.iter().map(|(.., photons)| *photons).collect(),
            ..GridPass::default()
        };
        let after = self.radii.after(before, values.iter().map(|(_, gathered, _)| gathered.found));
        Some((pass, after))
    }

    /// Computes one view of one pass, and the states of its pixels after it; returns `None` if cancelled.
    fn view(
        &self,
        number: usize,
        maps: &Maps<C>,
        before: &[PointStatistics],
        key: Key,
        cancel: &AtomicBool,
    ) -> Option<(ViewPass, Vec<PointStatistics>)> {
        let (mapper, view) = (&self.mapper, &self.views[number]);
        let seen = visible_point::view((mapper, maps), view, (key, number), cancel, |ray, pixel, _, samples| {
            let radius = before.get(pixel).map_or(maps.radius, PointStatistics::radius_m);
            visible_point::luminance(mapper, maps, ray, samples, |hit, surface, _, random| {
                mapper.irradiance(maps, radius, hit.position, hit.normal, surface, random)
            })
        })?;
        let after = self.radii.after(before, seen.iter().map(|pixel| pixel.found));
        Some((ViewPass { rays: view.rays(1.0), ..ViewPass::of(&seen) }, after))
    }
}

impl<const C: usize> Integrator for Sppm<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        self.pass_after(pass, &Carried::default(), cancel)
    }

    fn start(&self) -> Pass {
        let grids = self.mapper.grids.iter().map(Grid::len);
        let views = self.views.iter().map(|of| of.view.size_px[0] * of.view.size_px[1]);
        Pass { carried: self.radii.start(grids, views), ..Pass::default() }
    }

    fn pass_after(&self, pass: u64, before: &Carried, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let before = before.or(|| self.start().carried);
        let (maps, totals) = self.mapper.maps(key, self.radii.scheduled(pass), cancel)?;
        let grid = |number: usize| self.grid(number, &maps, before.grid(number), key, cancel);
        let grids: Option<Vec<_>> = (0..self.mapper.grids.len()).map(grid).collect();
        let view = |number: usize| self.view(number, &maps, before.view(number), key, cancel);
        let views: Option<Vec<_>> = (0..self.views.len()).map(view).collect();
        Some(Pass { totals, photons: self.mapper.photons(), ..Pass::carrying(grids?, views?) })
    }
}

//! Progressive photon mapping: visible points stay the same, radii shrink from pass to pass.
//!
//! **Idea.** Visible points are those of a fixed set of eye rays, one in each stratum of a pixel, and the sensors, or fixed points of each
//! cell. They are not stored: their random numbers do not depend on the pass, so that each pass finds them again. Photons and connections
//! to them are new in every pass; radii shrink as in `photon_map::progressive`. Mirrors leave the path of an eye ray fixed; a lobe, and a
//! guide where it divides light, send it in a new direction in every pass, because a few fixed directions would not give the integral.
//!
//! The mean over the fixed points converges, but it differs from that of the pixel or cell by a sampling error that no pass reduces.
//! Contrasts estimate this error: in a block of 2 x 2 strata the mean of the points on one diagonal minus that on the other is zero where
//! light varies linearly, and half of it has the variance of the block's mean, or more. Its square, averaged over passes and less the part
//! by noise, is part of the squared error (docs/physics/statistics.md#points-that-are-the-same-in-every-pass).
//!
//! **Which paths**, the same as `sppm`
//! (docs/physics/measurement_equation.md#progressive-photon-mapping-fixed-and-stochastic):
//!
//! | paths | estimator |
//! | --- | --- |
//! | `.. F` and `M` straight to a sensor or the eye's `D` | connections to the pass' photons at the diffuser; closed form or points |
//! | all else that arrives there | gather |
//! | `.. (F\|M) S* E` of an eye | exitance gathered on the diffuser; the luminaire's luminance |
//! | `G E` of an eye | connections and the reflected ray, or sunbeams gathered in the lobe |
//!
//! **Settings.** `photons_per_pass` (65 536; 64 to 16 777 216); `initial_radius_m` (a twentieth of the room's shortest
//! edge) and `alpha` (2/3; between 0 and 1) trade noise against bias; `radius` (by schedule, or per point: by the
//! photons found); `samples_per_sensor` (16; 2 to 65 536) and `samples_per_pixel` (4; 2 to 4096) fixed points, whose
//! number bounds the accuracy that can be reached.
//!
//! **Refuses** nothing. Bad where light changes abruptly within a cell or a pixel: few fixed points estimate its mean badly.
//!
//! **Sources.** Hachisuka, Ogaki and Jensen 2008; Knaus and Zwicker 2011 for the schedule.

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
use crate::integrator::photon_map::strata::Strata;
use crate::integrator::photon_map::surfaces::Surfaces;
use crate::integrator::photon_map::trial::of_wider_kernels;
use crate::integrator::photon_map::visible_point::EyeRay;
use crate::integrator::photon_map::{memory, visible_point};
use crate::integrator::trial::TrialPasses;
use crate::sampling::{Key, PathRandom, Stream};
use crate::scene::{Channels, EstimateKind, Grid, View};
use crate::traceable::TraceableScene;

/// Settings of progressive photon mapping.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Number of photons emitted per pass, all tubes and sources together; 64..=16_777_216.
    pub photons_per_pass: u64,
    /// Gather radius of the first pass in metres; `None`: a twentieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// Fraction of the photons of a pass that is kept, 0 < `alpha` < 1, as in [`super::sppm::Settings::alpha`].
    pub alpha: f64,
    /// Rule by which radii shrink.
    pub radius: Radius,
    /// Number of fixed points of each cell of cell averages, 2..=65_536.
    pub samples_per_sensor: u32,
    /// Number of fixed eye rays of each pixel, 2..=4096.
    pub samples_per_pixel: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            photons_per_pass: 65_536,
            initial_radius_m: None,
            alpha: 2.0 / 3.0,
            radius: Radius::Schedule,
            samples_per_sensor: 16,
            samples_per_pixel: 4,
        }
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "ppm"
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

    fn retained_per_sensor(&self, grid: &Grid) -> Retained {
        self.retained(if grid.estimate == EstimateKind::CellAverage { self.samples_per_sensor } else { 1 })
    }

    fn retained_per_pixel(&self) -> Retained {
        self.retained(self.samples_per_pixel)
    }

    fn trial(&self, task: &Task, _target: f64) -> Trial {
        let photons_per_pass = TrialPasses::fewer(self.photons_per_pass, 0.0625);
        let initial_radius_m =
            Some(TRIAL_RADIUS * Radii::initial_m(self.initial_radius_m, task.traceable.enclosure.extent()));
        let smaller = Self { photons_per_pass, initial_radius_m, ..self.clone() };
        let places = if task.views.is_empty() { 81 } else { 512 };
        Trial::whole(smaller, places).with(of_wider_kernels(photons_per_pass, self.photons_per_pass, self.alpha))
    }

    fn build(&self, task: &Task, seed: u64, _target: f64) -> Computation {
        let scene = task.traceable.clone();
        match task.scene.channels {
            Channels::Photopic => Computation::passes(Ppm::<1>::new(scene, task.grids, task.views, self, seed)),
            Channels::Rgb => Computation::passes(Ppm::<3>::new(scene, task.grids, task.views, self, seed)),
        }
    }
}

impl Settings {
    /// Returns the numbers that are kept for a sensor or pixel with some fixed points: a contrast for every block of at least two, and a
    /// radius for each point if radii are per point.
    fn retained(&self, points: u32) -> Retained {
        let points = f64::from(points);
        let radii = if self.radius == Radius::PerPoint { points } else { 0.0 };
        Retained { points, contrasts: 0.5 * points, radii, ..Retained::MEANS }
    }
}

/// Fewest photons at each diffuser, and fewest points per side of the square of strata on each luminaire, that each point of a sensor is
/// connected to: the points divide the connections of the sensor.
const LEAST_CONNECTIONS: usize = 16;
const LEAST_STRATA: usize = 2;

/// Progressive photon mapping of one scene with `C` channels of light.
#[derive(Debug)]
pub struct Ppm<const C: usize> {
    mapper: Mapper<C>,
    views: Vec<OutlinedView>,
    radii: Radii,
    per_cell: Strata,
    per_pixel: Strata,
    seed: Key,
}

/// Mean over the points of a sensor or a pixel.
struct Mean<const C: usize> {
    value: Gathered<C>,
    contrasts: Vec<f64>,
    /// Number of photons that each point found, scaled to its full disc.
    found: Vec<f64>,
    /// Photons of all points together.
    photons: PhotonCount,
}

impl<const C: usize> Mean<C> {
    fn new(strata: Strata, points: impl Iterator<Item = (Gathered<C>, PhotonCount)>) -> Self {
        let (points, counts): (Vec<_>, Vec<_>) = points.unzip();
        let fraction = 1.0 / points.len() as f64;
        let mut value = Gathered::NOTHING;
        for point in &points {
            value.irradiance += point.irradiance * fraction;
            value.bias += point.bias * fraction;
        }
        let mut photons = PhotonCount::default();
        counts.iter().for_each(|count| photons.add(count));
        // effect of one photon at one point on the mean over the points, averaged over them
        photons.one_lux *= fraction * fraction;
        photons.brightest_lux *= fraction * fraction;
        let luminances: Vec<f64> = points.iter().map(|point| point.irradiance.luminance()).collect();
        Self {
            value,
            contrasts: strata.contrasts(&luminances),
            found: points.iter().map(|point| point.found).collect(),
            photons,
        }
    }
}

impl<const C: usize> Ppm<C> {
    /// Divides the photons of a pass among the sources, and points into strata; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        Self {
            radii: Radii::new(settings.radius, settings.initial_radius_m, settings.alpha, scene.enclosure.extent()),
            views: OutlinedView::all(&scene, views),
            mapper: Mapper::new(scene, grids, !views.is_empty(), settings.photons_per_pass),
            per_cell: Strata::new(settings.samples_per_sensor),
            per_pixel: Strata::new(settings.samples_per_pixel),
            seed: Key::new(seed),
        }
    }

    fn strata_of(&self, grid: &Grid) -> Strata {
        match grid.estimate {
            EstimateKind::Point => Strata::ONE,
            EstimateKind::CellAverage => self.per_cell,
        }
    }

    /// Computes one grid of one pass, and the states of its points after it; returns `None` if cancelled.
    fn grid(
        &self,
        number: usize,
        maps: &Maps<C>,
        before: &[PointStatistics],
        key: Key,
        cancel: &AtomicBool,
    ) -> Option<(GridPass, Vec<PointStatistics>)> {
        let grid = &self.mapper.grids[number];
        let strata = self.strata_of(grid);
        let [fixed, key] =
            [self.seed.stream(Stream::FixedPoints, 0), key].map(|key| key.stream(Stream::GatheringGrid, number as u64));
        let sensors: Option<Vec<Mean<C>>> = (0..grid.len())
            .into_par_iter()
            .map(|index| {
                if cancel.load(Ordering::Relaxed) {
                    return None;
                }
                let centre = grid.centre(index);
                let points = index * strata.count()..(index + 1) * strata.count();
                let found = points.enumerate().map(|(stratum, point)| {
                    let mut sensor = centre;
                    if strata.count() > 1 {
                        let jitter = PathRandom::new(fixed.child(point as u64)).uniform2();
                        let [x, y] = strata.point(stratum, jitter);
                        sensor.x += (x - 0.5) * grid.cell_size_m[0];
                        sensor.y += (y - 0.5) * grid.cell_size_m[1];
                    }
                    if grid.is_inside(index) {
                        return (Gathered::NOTHING, PhotonCount::default());
                    }
                    let radius = before.get(point).map_or(maps.radius, PointStatistics::radius_m);
                    self.sensor(number, maps, sensor, radius, strata, &mut PathRandom::new(key.child(point as u64)))
                });
                Some(Mean::new(strata, found))
            })
            .collect();
        let sensors = sensors?;
        let pass = GridPass {
            illuminance: sensors.iter().map(|sensor| sensor.value.irradiance.luminance()).collect(),
            bias: sensors.iter().map(|sensor| sensor.value.bias).collect(),
            contrasts: sensors.iter().flat_map(|sensor| &sensor.contrasts).copied().collect(),
            photons: sensors.iter().map(|sensor| sensor.photons).collect(),
            ..GridPass::default()
        };
        Some((pass, self.radii.after(before, sensors.iter().flat_map(|sensor| &sensor.found).copied())))
    }

    /// Estimates the illuminance of one point of a grid.
    fn sensor(
        &self,
        number: usize,
        maps: &Maps<C>,
        sensor: DVec3,
        radius: f64,
        strata: Strata,
        random: &mut PathRandom,
    ) -> (Gathered<C>, PhotonCount) {
        if self.mapper.scene.is_in_solid(sensor) {
            return (Gathered::NOTHING, PhotonCount::default());
        }
        let connections = (SENSOR_CONNECTIONS / strata.count()).max(LEAST_CONNECTIONS);
        let luminaire_strata = (SENSOR_STRATA / strata.rows).max(LEAST_STRATA);
        let (mut gathered, photons) = self.mapper.plane_irradiance(maps, radius, number, sensor);
        let direct = self.mapper.diffuser_irradiance(maps, sensor, DVec3::Z, None, connections, random);
        gathered.add_light(&direct);
        gathered.irradiance += self.mapper.luminaire_irradiance(sensor, DVec3::Z, None, luminaire_strata, random);
        (gathered, photons)
    }

    /// Computes one view of one pass, and the states of its points after it; returns `None` if cancelled.
    fn view(
        &self,
        number: usize,
        maps: &Maps<C>,
        before: &[PointStatistics],
        key: Key,
        cancel: &AtomicBool,
    ) -> Option<(ViewPass, Vec<PointStatistics>)> {
        let (mapper, outlined, strata) = (&self.mapper, &self.views[number], self.per_pixel);
        let view = &outlined.view;
        let [fixed, _] = visible_point::streams(self.seed.stream(Stream::FixedPoints, 0), number);
        let [key, of_straight] = visible_point::streams(key, number);
        let pixels = visible_point::pixels(view, cancel, |pixel, place| {
            let rays = pixel * strata.count()..(pixel + 1) * strata.count();
            let seen = rays.enumerate().map(|(stratum, ray)| {
                let jitter = PathRandom::new(fixed.child(ray as u64)).uniform2();
                let direction = visible_point::direction(view, place, strata.point(stratum, jitter));
                let radius = before.get(ray).map_or(maps.radius, PointStatistics::radius_m);
                let samples = visible_point::independent(key.child(ray as u64));
                let ray = EyeRay { eye: view.eye, direction, straight: !outlined.is_outlined(pixel) };
                let seen = visible_point::luminance(mapper, maps, ray, samples, |hit, surface, _, random| {
                    mapper.irradiance(maps, radius, hit.position, hit.normal, surface, random)
                });
                (seen, PhotonCount::default())
            });
            let mut mean = Mean::new(strata, seen);
            if outlined.is_outlined(pixel) {
                // new in every pass, so that the spread of passes is its error, and it needs no contrast
                mean.value.add_light(&outlined.straight(mapper, maps, place, of_straight.child(pixel as u64)));
            }
            mean
        })?;
        let values: Vec<Gathered<C>> = pixels.iter().map(|pixel| pixel.value).collect();
        let contrasts = pixels.iter().flat_map(|pixel| &pixel.contrasts).copied().collect();
        let after = self.radii.after(before, pixels.iter().flat_map(|pixel| &pixel.found).copied());
        let rays = outlined.rays(strata.count() as f64);
        Some((ViewPass { contrasts, rays, ..ViewPass::of(&values) }, after))
    }
}

impl<const C: usize> Integrator for Ppm<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        self.pass_after(pass, &Carried::default(), cancel)
    }

    fn start(&self) -> Pass {
        let of_grids = || self.mapper.grids.iter().map(|grid| (grid.len(), self.strata_of(grid)));
        let of_views = || self.views.iter().map(|of| (of.view.size_px[0] * of.view.size_px[1], self.per_pixel));
        let points = |(count, strata): (usize, Strata)| count * strata.count();
        let contrasts = |(count, strata): (usize, Strata)| vec![0.0; count * strata.contrast_count()];
        Pass {
            grids: of_grids().map(|of| GridPass { contrasts: contrasts(of), ..GridPass::default() }).collect(),
            views: of_views().map(|of| ViewPass { contrasts: contrasts(of), ..ViewPass::default() }).collect(),
            carried: self.radii.start(of_grids().map(points), of_views().map(points)),
            ..Pass::default()
        }
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

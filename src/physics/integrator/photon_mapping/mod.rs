//! Photon mapping in two passes with final gathering.
//!
//! **Idea.** Photons are stored where they hit surfaces. At a receiver (a sensor, or a point with a diffuse part that an eye ray meets)
//! direct light is estimated by connections, caustics by density estimation from the photons there, and all other light by
//! cosine-distributed *gather rays*, with density estimation where they end: this averages its bias over the room. Every pass of the engine
//! traces its own photons and gathers them within one fixed radius: one pass is one replicate.
//!
//! **Which paths** (docs/physics/measurement_equation.md#photon-mapping-with-final-gathering). The event before the chain `(S|G)*` that
//! leads to the receiver determines the estimator, so that each path is counted once.
//!
//! | paths | estimator |
//! | --- | --- |
//! | `.. F E`, `M E`, wherever the light of `F` came from | connection to photons at the diffuser; closed form or points of the luminaire (`photon_map::near_light`) |
//! | `.. (F\|M) (S\|G)+ E`, `.. t C (S\|G)* E` | caustics: gathered; cells: crossing, which has no bias |
//! | `(K\|N) t C E` at points | backward instead, where that finds all of it (`followed_backward`) |
//! | `.. D (S\|G)* E` | gather rays: at every `D` that they meet, direct light as above and all other photons, gathered; nothing at openings, luminaires and open faces |
//!
//! **Settings.** `photons_per_pass` (by default 2048 to 65 536, by the accuracy asked for, and with views the most; 64 to 16 777 216).
//! `initial_radius_m` (a fortieth of the room's shortest edge) trades noise against bias, which further passes do not reduce; the bias is
//! estimated from two radii (`photon_map::maps`) and carried to the receiver with the weights of the rays, for colours by their luminance.
//! `gather_rays` (256 of a sensor, fewer where sensors are many, 16 of a point; 1 to 65 536).
//!
//! **Refuses** nothing. Bad at high accuracy: the bias of the radius stays. Openings, mirrors and lobes are treated along an eye ray as in
//! SPPM (`photon_map::visible_point`).
//!
//! **Sources.** Jensen 1996 and 2001.

mod gather;

use std::cell::Cell;
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use glam::DVec3;
use rayon::prelude::*;

use self::gather::{FinalGathering, GatherPoint};
use super::{GridPass, Integrator, Pass, PhotonCount, ViewPass};
use crate::guide::Guide;
use crate::integrator::backward::chance;
use crate::integrator::backward::unscattered::{LooksUp, unscattered};
use crate::integrator::method::{Caveat, Computation, Described, Load, Task, Trial};
use crate::integrator::pass_size::PassSize;
use crate::integrator::photon_map::maps::{Gathered, Mapper, POINT_CONNECTIONS, POINT_STRATA};
use crate::integrator::photon_map::near_light::{SENSOR_CONNECTIONS, SENSOR_STRATA};
use crate::integrator::photon_map::outline::OutlinedView;
use crate::integrator::photon_map::store::FollowedBackward;
use crate::integrator::photon_map::surfaces::Surfaces;
use crate::integrator::photon_map::{memory, visible_point};
use crate::integrator::trial::{Powers, TrialPasses};
use crate::optics::SurfaceOptics;
use crate::sampling::{Key, PathRandom, Stream};
use crate::scene::{Channels, EstimateKind, Grid, View};
use crate::traceable::{TraceableScene, TraceableTube};

/// Settings of photon mapping.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Settings {
    /// Number of photons emitted per pass, all tubes and sources together; 64..=16_777_216; `None`: by the accuracy requested.
    pub photons_per_pass: Option<u64>,
    /// Gather radius of every pass in metres; `None`: a fortieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// Number of gather rays per pass of every sensor and of every point that a pixel's ray meets, 1..=65_536; `None`: 256 per sensor, or
    /// with more than 4096 sensors so many that all together have a million, at least 16 each; 16 per point.
    pub gather_rays: Option<u32>,
}

/// Default number of photons of a pass with views, and the most for grids alone.
const MOST: f64 = 65_536.0;

/// Default number of photons of a pass of grids alone: with fewer, gather rays would find too little.
const PHOTONS: PassSize = PassSize { for_one_percent: 8192.0, growth: 1.5, fewest: 2048.0, most: MOST };

impl Settings {
    /// Returns the number of photons of a pass, for a relative standard error `target` of grids, or with views.
    fn photons(&self, target: f64, views: bool) -> u64 {
        self.photons_per_pass.unwrap_or_else(|| if views { MOST as u64 } else { PHOTONS.power_of_two(target) })
    }
}

impl Described for Settings {
    fn name(&self) -> &'static str {
        "photon_mapping"
    }

    fn remark(&self) -> Option<&'static str> {
        Some("the bias of its gather radius does not shrink with more passes; its estimate is included in every error")
    }

    fn warns(&self, task: &Task) -> Option<Caveat> {
        let uncut = Surfaces::new(task.traceable).uncut.map(|uncut| uncut.caveat(self.name()));
        uncut.or_else(|| chance::mirrors_in_gloss(self.name(), task))
    }

    fn working_bytes(&self, load: &Load) -> f64 {
        // on surfaces, and once more if it is a caustic
        memory::bytes(self.photons_per_pass.unwrap_or(MOST as u64), 2.0, load)
    }

    fn trial(&self, task: &Task, target: f64) -> Trial {
        let photons = self.photons(target, !task.views.is_empty());
        let (fraction, default, most_places) = if task.views.is_empty() {
            (0.5, sensor_rays(task.grids.iter().map(Grid::len).sum::<usize>() as f64), 6)
        } else {
            (0.0625, POINT_GATHER_RAYS, 128)
        };
        let tried = TrialPasses::fewer(photons, fraction);
        let gather_rays = Some(self.gather_rays.unwrap_or(default));
        let smaller = Self { photons_per_pass: Some(tried), gather_rays, ..self.clone() };
        let clear = |tube: &TraceableTube| tube.specular_zone().is_some();
        let clear = task.traceable.tubes.iter().any(clear);
        // noise of the photons in the room is common to all sensors; the sensors' own noise:
        let (variance, shared_variance) = match (task.views.is_empty(), task.has_points()) {
            (false, _) => (VARIANCE_OF_BLOCKS, VARIANCE_OF_BLOCKS),
            // is that of backward rays through closures and to the bright patches below them, whose number is fixed
            (true, true) if clear => (0.0, -1.0),
            // is that of the photons which cross the cell
            (true, false) if clear => (-1.0, -1.0),
            (true, _) => (VARIANCE_OF_SENSORS, -1.0),
        };
        let powers = Powers { work_of_pass: 1.0, work_of_place: 0.0, variance, shared_variance };
        Trial::whole(smaller, most_places).with(TrialPasses::of_photons(tried, photons, powers))
    }

    fn build(&self, task: &Task, seed: u64, target: f64) -> Computation {
        let scene = task.traceable.clone();
        let sized = Self { photons_per_pass: Some(self.photons(target, !task.views.is_empty())), ..self.clone() };
        match task.scene.channels {
            Channels::Photopic => {
                Computation::passes(PhotonMapping::<1>::new(scene, task.grids, task.views, &sized, seed))
            }
            Channels::Rgb => Computation::passes(PhotonMapping::<3>::new(scene, task.grids, task.views, &sized, seed)),
        }
    }
}

/// Exponent of the number of photons of a pass in the variance of a sensor's own noise, with a fixed number of gather rays, which end at
/// other photons for each sensor: between 0 and -1; -0.5 in the room of the thesis under straight and bent tubes.
const VARIANCE_OF_SENSORS: f64 = -0.5;

/// Exponent of the number of photons of a pass in the variance of a block of pixels with a fixed number of gather rays: -0.8 in the room of
/// the thesis, -0.4 under its clear closure, its bias included (4096 and 65 536 photons).
const VARIANCE_OF_BLOCKS: f64 = -0.7;

/// Default radius as a fraction of the shortest edge of the room.
const DEFAULT_RADIUS_SHARE: f64 = 0.025;

/// Default number of gather rays per pass of a sensor: the most, and the fewest where sensors are many.
pub const SENSOR_GATHER_RAYS: u32 = 256;
const LEAST_SENSOR_RAYS: u32 = 16;

/// Number of gather rays per pass of all sensors together above which the default per sensor is reduced: some two seconds, so that a job of
/// few seconds has several passes.
const RAYS_OF_ALL_SENSORS: f64 = 1_048_576.0;
/// Default number of gather rays per pass of a point that a pixel's ray meets.
pub const POINT_GATHER_RAYS: u32 = 16;

/// Number of strata per side of a cell; their points share the connections of the cell's average.
const CELL_STRATA: usize = 4;

/// Largest number of backward rays per sensor and pass to each tube.
const BACKWARD_RAYS: u64 = 1024;

/// Returns the default number of gather rays per pass and sensor.
fn sensor_rays(sensors: f64) -> u32 {
    let fraction = RAYS_OF_ALL_SENSORS / sensors.max(1.0);
    fraction.clamp(f64::from(LEAST_SENSOR_RAYS), f64::from(SENSOR_GATHER_RAYS)) as u32
}

/// Photon mapping of one scene with `C` channels of light.
#[derive(Debug)]
pub struct PhotonMapping<const C: usize> {
    mapper: Mapper<C>,
    views: Vec<OutlinedView>,
    radius: f64,
    gather_rays: Option<u32>,
    seed: Key,
}

impl<const C: usize> PhotonMapping<C> {
    /// Divides the photons of a pass among the sources; equal seeds give equal bits.
    pub fn new(scene: Arc<TraceableScene>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        let photons = settings.photons_per_pass.unwrap_or(MOST as u64);
        let radius = settings.initial_radius_m.unwrap_or(DEFAULT_RADIUS_SHARE * scene.enclosure.shortest_edge_m());
        let backward = scene.tubes.iter().map(followed_backward).collect();
        let keeps_surfaces = scene.interreflection || !views.is_empty();
        let outlined = OutlinedView::all(&scene, views);
        let mapper = Mapper::new(scene, grids, keeps_surfaces, photons).with_caustics(backward);
        Self { mapper, views: outlined, radius, gather_rays: settings.gather_rays, seed: Key::new(seed) }
    }

    /// Computes one grid of one pass; returns `None` if cancelled.
    fn grid(&self, number: usize, gathering: &FinalGathering<C>, key: Key, cancel: &AtomicBool) -> Option<GridPass> {
        let grid = &self.mapper.grids[number];
        let stream = key.stream(Stream::GatheringGrid, number as u64);
        let average = grid.estimate == EstimateKind::CellAverage;
        let values: Option<Vec<(f64, f64, PhotonCount)>> = (0..grid.len())
            .into_par_iter()
            .map(|index| {
                let sensor = KeyedSensor { grid, index, key: stream.child(index as u64) };
                let going_on = !cancel.load(Ordering::Relaxed);
                going_on.then(|| {
                    if grid.is_inside(index) {
                        return (0.0, 0.0, PhotonCount::default());
                    }
                    let (mut lux, mut bias, mut photons) = self.sensor(number, &sensor, gathering);
                    if !average && !self.covered(sensor.centre()) {
                        let (caustics, unscattered) = self.caustics(number, &sensor, gathering);
                        lux += caustics.0.irradiance.luminance() + unscattered;
                        bias += caustics.0.bias;
                        photons.found += caustics.1.found;
                        if !self.gathers_rays() {
                            photons.one_lux = caustics.1.one_lux;
                            photons.brightest_lux = caustics.1.brightest_lux;
                        }
                    }
                    (lux, bias, photons)
                })
            })
            .collect();
        let values = values?;
        let mut illuminance: Vec<f64> = values.iter().map(|(lux, ..)| *lux).collect();
        let bias = values.iter().map(|(_, bias, _)| *bias).collect();
        let mut photons: Vec<PhotonCount> = values.iter().map(|(.., photons)| *photons).collect();
        if average {
            for (position, flux) in gathering.maps.planes[number].photons() {
                if let Some(index) = grid.cell_at(position.truncate()) {
                    illuminance[index] += flux.luminance() / grid.cell_area_m2();
                    photons[index].found += 1.0;
                }
            }
        }
        Some(GridPass { illuminance, bias, photons, ..GridPass::default() })
    }

    /// True if gather rays can find photons.
    fn gathers_rays(&self) -> bool {
        let scene = &self.mapper.scene;
        scene.interreflection && scene.all_optics().any(SurfaceOptics::gathers)
    }

    /// True if a point is inside a solid.
    fn covered(&self, point: DVec3) -> bool {
        self.mapper.scene.is_in_solid(point)
    }

    /// Estimates the illuminance of a sensor in lux without caustics, and its bias; also returns the number of photons that gather rays
    /// found.
    fn sensor(
        &self,
        number: usize,
        sensor: &KeyedSensor<'_>,
        gathering: &FinalGathering<C>,
    ) -> (f64, f64, PhotonCount) {
        let scene = &*self.mapper.scene;
        let mut random = PathRandom::new(sensor.key);
        let lift = DVec3::Z * scene.contact();
        let strata = if sensor.grid.estimate == EstimateKind::CellAverage { CELL_STRATA } else { 1 };
        let fraction = 1.0 / strata as f64;
        let mut direct = Gathered::<C>::NOTHING;
        for stratum in 0..strata * strata {
            let jitter = if strata > 1 { random.uniform2() } else { [0.5; 2] };
            let place = [(stratum % strata) as f64 + jitter[0], (stratum / strata) as f64 + jitter[1]];
            let point = sensor.point(place.map(|place| place * fraction)) + lift;
            if self.covered(point) {
                continue;
            }
            let (connections, points) = (SENSOR_CONNECTIONS / (strata * strata), SENSOR_STRATA / strata);
            let maps = gathering.maps;
            let mapper = &self.mapper;
            let diffusers = mapper.diffuser_irradiance(maps, point, DVec3::Z, None, connections, &mut random);
            direct.irradiance += diffusers.irradiance * (fraction * fraction);
            direct.bias += diffusers.bias * (fraction * fraction);
            direct.irradiance +=
                mapper.luminaire_irradiance(point, DVec3::Z, None, points, &mut random) * (fraction * fraction);
        }
        let start = |place: [f64; 2]| Some(sensor.point(place) + lift).filter(|point| !self.covered(*point));
        let count = self.gather_rays.unwrap_or_else(|| {
            let sensors: usize = self.mapper.grids.iter().map(Grid::len).sum();
            sensor_rays(sensors as f64)
        });
        let receiver = GatherPoint { normal: DVec3::Z, surface: None, key: sensor.key.stream(Stream::Gather, 0) };
        let gathered = gathering.gather(&receiver, start, count);
        let reach =
            if strata > 1 { 0.5 * libm::hypot(sensor.grid.cell_size_m[0], sensor.grid.cell_size_m[1]) } else { 0.0 };
        let can_come = self.gathers_rays() && !self.mapper.is_covered(number, sensor.centre(), reach);
        // illuminance by one photon on a white surface, within the disc of one gather ray
        let kernel = PI * gathering.maps.radius * gathering.maps.radius;
        let one_lux = gathering.maps.on_surfaces_lm / (kernel * f64::from(count));
        let photons =
            PhotonCount { found: gathered.found, one_lux: if can_come { one_lux } else { 0.0 }, brightest_lux: 0.0 };
        ((direct.irradiance + gathered.irradiance).luminance(), direct.bias + gathered.bias, photons)
    }

    /// Estimates the caustics at a sensor of a grid of points: those from photons, and those followed backward, in lux.
    fn caustics(
        &self,
        number: usize,
        sensor: &KeyedSensor<'_>,
        gathering: &FinalGathering<C>,
    ) -> ((Gathered<C>, PhotonCount), f64) {
        let (scene, centre) = (&*self.mapper.scene, sensor.centre());
        let gathered = self.mapper.plane_irradiance(gathering.maps, self.radius, number, centre);
        let key = sensor.key.stream(Stream::Unscattered, 0);
        let (at, looks_up) = (sensor.grid.sensor(sensor.index), LooksUp::by_rays(BACKWARD_RAYS));
        let (unscattered, rays) = unscattered(scene, at, key, looks_up, |tube| followed_backward(tube).sky);
        gathering.count(rays);
        (gathered, unscattered)
    }

    /// Computes one view of one pass; returns `None` if cancelled.
    fn view(&self, number: usize, gathering: &FinalGathering<C>, key: Key, cancel: &AtomicBool) -> Option<ViewPass> {
        let (mapper, view) = (&self.mapper, &self.views[number]);
        let rays = f64::from(self.gather_rays.unwrap_or(POINT_GATHER_RAYS));
        let maps = gathering.maps;
        let seen = visible_point::view((mapper, maps), view, (key, number), cancel, |ray, _, key, samples| {
            let points = Cell::new(0);
            visible_point::luminance(mapper, maps, ray, samples, |hit, surface, weight, random| {
                points.set(points.get() + 1);
                // faint reflections need fewer rays
                let count = (rays * weight.max()).ceil().clamp(1.0, rays) as u32;
                let receiver = GatherPoint {
                    normal: hit.normal,
                    surface: Some(surface),
                    key: key.stream(Stream::Gather, points.get()),
                };
                let mut light = gathering.gather(&receiver, |_| Some(hit.position), count);
                light.add_light(&mapper.caustics(maps, self.radius, hit.position, surface));
                light.add_light(&gathering.direct(hit, surface, POINT_CONNECTIONS, POINT_STRATA, random));
                light
            })
        })?;
        Some(ViewPass { rays: view.rays(1.0), ..ViewPass::of(&seen) })
    }
}

impl<const C: usize> Integrator for PhotonMapping<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.stream(Stream::Pass, pass);
        let (maps, mut totals) = self.mapper.maps(key, self.radius, cancel)?;
        let gathering = FinalGathering::new(&self.mapper, &maps);
        let grids = (0..self.mapper.grids.len())
            .map(|number| self.grid(number, &gathering, key, cancel))
            .collect::<Option<_>>()?;
        let views =
            (0..self.views.len()).map(|number| self.view(number, &gathering, key, cancel)).collect::<Option<_>>()?;
        totals.rays += gathering.rays();
        Some(Pass { grids, views, totals, photons: self.mapper.photons(), ..Pass::default() })
    }
}

/// Sensor of a grid, with the key of its random numbers.
struct KeyedSensor<'a> {
    grid: &'a Grid,
    index: usize,
    key: Key,
}

impl KeyedSensor<'_> {
    fn centre(&self) -> DVec3 {
        self.grid.centre(self.index)
    }

    /// Returns the centre, or for a cell average the point of the cell at coordinates 0..1.
    fn point(&self, [x, y]: [f64; 2]) -> DVec3 {
        let mut point = self.centre();
        if self.grid.estimate == EstimateKind::CellAverage {
            point.x += (x - 0.5) * self.grid.cell_size_m[0];
            point.y += (y - 0.5) * self.grid.cell_size_m[1];
        }
        point
    }
}

/// Returns the kinds of light that backward rays find completely. The sun's beam is aimed at in straight tubes only. Through the clear part
/// of a closure that scatters in part there may also come light that was scattered above it, except in a straight tube, which returns
/// nothing.
fn followed_backward(tube: &TraceableTube) -> FollowedBackward {
    let straight = matches!(tube.guide, Guide::Straight(_));
    FollowedBackward { sky: straight || !tube.scatters(), sun: straight }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A pass with the largest number of sensors of a job does not take long, and few sensors keep all their rays.
    #[test]
    fn many_sensors_gather_fewer_rays_each() {
        assert_eq!([1.0, 81.0, 4096.0].map(sensor_rays), [SENSOR_GATHER_RAYS; 3]);
        assert_eq!([8192.0, 90_000.0, 1e9].map(sensor_rays), [128, LEAST_SENSOR_RAYS, LEAST_SENSOR_RAYS]);
    }
}

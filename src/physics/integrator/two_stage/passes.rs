//! Passes of the two-stage method: light that leaves the openings, then paths from sensors and eyes.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::prelude::*;

use super::close::CloseSensors;
use super::coarse::Coarse;
use super::sizes::Sizes;
use super::straight::{GridSensors, OpeningConnections, Straight, by_mirrors, of_luminaires};
use super::variances::Share;
use crate::guide::RayCount;
use crate::integrator::backward;
use crate::integrator::backward::pass::{Lux, SOBOL_PAIRS_SEEN, Sampling, each, lifted};
use crate::integrator::backward::room_entry::exit_seen_by;
use crate::integrator::diffuser_source::closure_source::{ClosureLight, ClosureSource, add_directional};
use crate::integrator::diffuser_source::light::{DiffuserLight, SensorLit};
use crate::integrator::diffuser_source::visible_parts::reach;
use crate::integrator::photon::chunks::MOST_CHUNK;
use crate::integrator::photon::descent::Exit;
use crate::integrator::radiosity::{ExpectedSpreads, Solution};
use crate::integrator::room_matrix::MatrixEstimator;
use crate::integrator::{GridPass, Integrator, Pass, PhotonCount, ViewPass};
use crate::optics::{Closure, Spectrum};
use crate::sampling::{Key, Stream};
use crate::scene::{EstimateKind, Grid, View};
use crate::traceable::TraceableScene;

/// Number of reflections of a path without Russian roulette, which would spoil the gain of low-discrepancy points.
const CERTAIN_REFLECTIONS: u32 = 3;

/// Number of pairs of Sobol coordinates of a path.
const SOBOL_PAIRS: u32 = 8;

/// Method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct TwoStage<const C: usize> {
    pub(super) scene: Arc<TraceableScene>,
    pub(super) closures: ClosureSource<C>,
    pub(super) grids: Vec<Grid>,
    pub(super) views: Vec<View>,
    pub(super) sizes: Sizes,
    /// Share of the paths that each sensor has, grid by grid; `None` where all have equally many.
    pub(super) shares: Option<Vec<Vec<Share>>>,
    pub(super) connections: OpeningConnections,
    /// Coarse solution of the light that surfaces reflect; `None` where they reflect none.
    pub(super) reflected: Option<Arc<Solution<C>>>,
    /// Variances by which the residuals of sensors are expected to differ, by grid; empty where they are not known.
    pub(super) spreads: Vec<ExpectedSpreads>,
    /// Sensors close to surfaces, which another method computes.
    pub(super) close: Option<CloseSensors<C>>,
    /// Matrix of the room, where daylight coefficients are requested.
    pub(super) room: Option<MatrixEstimator<C>>,
    pub(super) seed: Key,
}

impl<const C: usize> TwoStage<C> {
    /// Builds the method with given sizes and a source of the light of closures.
    pub(super) fn with_sizes(
        (scene, closures): (&Arc<TraceableScene>, ClosureSource<C>),
        (grids, views): (&[Grid], &[View]),
        sizes: Sizes,
        coarse: Option<&Coarse<C>>,
        seed: u64,
    ) -> Self {
        let seed = Key::new(seed);
        let connections = OpeningConnections::new(scene, grids, &sizes.grids, seed);
        let (grids, views) = (grids.to_vec(), views.to_vec());
        Self {
            closures,
            grids,
            views,
            sizes,
            connections,
            reflected: coarse.map(|coarse| coarse.solution.clone()),
            spreads: coarse.map_or_else(Vec::new, |coarse| coarse.spreads.clone()),
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
            let counts = self.sizes.grids[sensors.number];
            let counts = shares.map_or(counts, |shares| counts.of_sensor(shares[sensor]));
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
    pub(super) fn lit(&self, key: Key, cancel: &AtomicBool) -> Option<ClosureLight<C>> {
        let ClosureLight { lambertian, directional, totals } = self.closures.pass(&self.scene, key, cancel)?;
        let lambertian = match &self.reflected {
            Some(reflected) => lambertian.reflected_by(reflected),
            None => lambertian,
        };
        Some(ClosureLight { lambertian, directional, totals })
    }

    /// Computes all grids in one pass, and the number of rays.
    pub(super) fn grids(
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
        let mut contrasts = self.closures.no_contrasts();
        contrasts.resize(self.grids.len(), Vec::new());
        let grid = |((number, grid), contrasts): ((usize, &Grid), Vec<f64>)| {
            let companions = self.room.as_ref().map_or_else(Vec::new, |room| room.start(number, grid));
            let of_sensors = |spreads: &ExpectedSpreads| {
                let positions = (0..grid.len()).map(|sensor| lifted(&self.scene, grid, sensor).position);
                spreads.at(&positions.collect::<Vec<_>>())
            };
            let expected_spreads = self.spreads.get(number).map_or_else(Vec::new, of_sensors);
            GridPass { residual: nothing(grid), expected_spreads, companions, contrasts, ..GridPass::default() }
        };
        Pass { grids: self.grids.iter().enumerate().zip(contrasts).map(grid).collect(), ..Pass::default() }
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
            let paths = self.sizes.per_pixel;
            let sampling = Sampling { paths, beyond: None, certain: CERTAIN_REFLECTIONS, pairs: SOBOL_PAIRS_SEEN };
            let (mut luminance, rays) = backward::pass::view::<C>(scene, view, sampling, stream, &light, cancel)?;
            if cancel.load(Ordering::Relaxed) {
                return None;
            }
            self.add_diffusers(&light, view, &mut luminance);
            result.totals.rays += rays;
            let rays = vec![f64::from(self.sizes.per_pixel)];
            result.views.push(ViewPass { luminance, rays, ..ViewPass::default() });
        }
        Some(result)
    }
}

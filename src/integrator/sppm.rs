//! Stochastic progressive photon mapping with independent passes.
//!
//! Every pass traces its own photons and eye rays and gathers with a radius that depends on the pass' number alone (Knaus
//! and Zwicker 2011), so that passes are independent replicates. Light that a diffuser or a tube's scattering sends
//! straight to a point is computed from the pass' own photons at the diffuser, light straight from a luminaire in closed
//! form or from points of its area, not by density estimation (`direct_light`); kernels and their bias are those of
//! `photon_maps`.
//!
//! Photons are gathered for the diffuse part of a surface alone. The specular part, mirror or glossy lobe, is followed
//! (`eye`).

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use rayon::prelude::*;

use super::kernel::{Kernel, NO_SURFACE};
use super::photon_maps::{Mapper, Maps};
use super::{GridPass, Integrator, Pass, ViewPass, eye};
use crate::sampling::{Key, PathRandom};
use crate::scene::{EstimateKind, Grid, View};

/// Settings of the method.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Photons emitted per pass, all tubes and sources together; 64..=16_777_216.
    pub photons_per_pass: u64,
    /// Gather radius of the first pass in metres; `None`: a twentieth of the room's shortest edge.
    pub initial_radius_m: Option<f64>,
    /// The squared radius shrinks by (i + alpha) / (i + 1) from pass i to i + 1; 0 < alpha < 1.
    pub alpha: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { photons_per_pass: 65_536, initial_radius_m: None, alpha: 2.0 / 3.0 }
    }
}

/// Share of the shortest edge of the room that is the default first radius.
const DEFAULT_RADIUS_SHARE: f64 = 0.05;

/// Photons at each diffuser, and points of each luminaire in a square of strata, to which a sensor is connected.
const SENSOR_CONNECTIONS: usize = 256;
const SENSOR_STRATA: usize = 8;

/// Streams of random numbers within a pass.
const EYE_STREAM: u64 = 1 << 32;
const SENSOR_STREAM: u64 = 1 << 33;

/// The method on one scene; `C` channels of light.
#[derive(Debug)]
pub struct Sppm<const C: usize> {
    mapper: Mapper<C>,
    views: Vec<View>,
    initial_radius: f64,
    alpha: f64,
    seed: Key,
}

impl<const C: usize> Sppm<C> {
    pub fn new(kernel: Arc<Kernel>, grids: &[Grid], views: &[View], settings: &Settings, seed: u64) -> Self {
        Self {
            initial_radius: settings.initial_radius_m.unwrap_or(DEFAULT_RADIUS_SHARE * kernel.size.min_element()),
            mapper: Mapper::new(kernel, grids, !views.is_empty(), settings.photons_per_pass),
            views: views.to_vec(),
            alpha: settings.alpha,
            seed: Key::new(seed),
        }
    }

    /// Gather radius of a pass in metres: r_1 sqrt(prod_{k=1..i} (k + alpha) / (k + 1)), Knaus and Zwicker 2011.
    fn radius(&self, pass: u64) -> f64 {
        // the product is Gamma(i + 1 + alpha) / (Gamma(1 + alpha) Gamma(i + 2)) with i passes before
        let i = pass as f64;
        let ln_gamma = statrs::function::gamma::ln_gamma;
        let log = ln_gamma(i + 1.0 + self.alpha) - ln_gamma(1.0 + self.alpha) - ln_gamma(i + 2.0);
        self.initial_radius * (0.5 * log).exp()
    }

    /// One grid of one pass.
    fn grid(&self, number: usize, maps: &Maps<C>, key: Key) -> GridPass {
        let mapper = &self.mapper;
        let grid = &mapper.grids[number];
        let stream = key.child(SENSOR_STREAM + number as u64);
        let values: Vec<(f64, f64)> = (0..grid.len())
            .into_par_iter()
            .map(|index| {
                let mut random = PathRandom::new(stream.child(index as u64));
                let (i, j) = (index % grid.cells[0], index / grid.cells[0]);
                let mut sensor = DVec3::new(grid.x_m[i], grid.y_m[j], grid.height_m);
                if grid.estimate == EstimateKind::CellAverage {
                    let [u, v] = random.uniform2();
                    sensor.x += (u - 0.5) * grid.cell_size_m[0];
                    sensor.y += (v - 0.5) * grid.cell_size_m[1];
                }
                let direct =
                    mapper.diffuser_irradiance(maps, sensor, DVec3::Z, NO_SURFACE, SENSOR_CONNECTIONS, &mut random);
                let electric = mapper.luminaire_irradiance(sensor, DVec3::Z, NO_SURFACE, SENSOR_STRATA, &mut random);
                let gathered = mapper.plane_irradiance(maps, number, sensor);
                (direct.luminance() + electric.luminance() + gathered.irradiance.luminance(), gathered.bias)
            })
            .collect();
        let (illuminance, bias) = values.into_iter().unzip();
        GridPass { illuminance, bias }
    }

    /// One view of one pass.
    fn view(&self, number: usize, maps: &Maps<C>, key: Key, cancel: &AtomicBool) -> Option<ViewPass> {
        let (mapper, view) = (&self.mapper, &self.views[number]);
        eye::view(view, key.child(EYE_STREAM + number as u64), cancel, |direction, _, random| {
            eye::luminance(mapper, maps, view.eye, direction, random, |hit, surface, _, random| {
                mapper.irradiance(maps, hit.position, hit.normal, surface, random)
            })
        })
    }
}

impl<const C: usize> Integrator for Sppm<C> {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        let key = self.seed.child(pass);
        let radius = self.radius(pass);
        let (maps, account) = self.mapper.maps(key, radius, cancel)?;
        let grids = (0..self.mapper.grids.len()).map(|number| self.grid(number, &maps, key)).collect();
        let views = (0..self.views.len()).map(|number| self.view(number, &maps, key, cancel)).collect::<Option<_>>()?;
        Some(Pass { grids, views, account, photons: self.mapper.photons() })
    }
}

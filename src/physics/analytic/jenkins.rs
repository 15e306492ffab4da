//! The semi-empirical formula of Jenkins, Muneer and Kubie (2005) for the illuminance below a light pipe.
//!
//! E = c Phi cos^4(theta) / V^2 with Phi = tau_collector tau_diffuser T^(L/D) b^n E_ex pi r^2: V the height of the diffuser above the
//! plane, theta the angle from its axis, T the transmission of a piece of pipe of aspect ratio 1, b a factor for each of n bends. The
//! coefficient c = 0.494 was fitted in a room and includes its interreflection: over the whole plane the formula gives c pi = 1.552 times
//! the flux Phi, and nothing may be added. A Lambertian disc far away has 1/pi.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::atomic::AtomicBool;

use super::{GridSolution, Installation, Quantity, Solution, Solver, Tube, TubeSolution};
use crate::geometry::rectangle::parallel_factor;
use crate::guide::transmittance::{beam_transmission, sky_exitance};
use crate::optics::{Diffuser, DiffuserZone};
use crate::scene::{EstimateKind, Grid};

/// Settings of the formula of Jenkins.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Coefficient c of the formula, > 0.
    pub coefficient: f64,
    /// Transmission T of the formula, 0..=1; `None`: the exact transmission, for the daylight of the job, of a straight tube of aspect
    /// ratio 1 and the tube's reflectance.
    pub pipe_transmittance: Option<f64>,
    /// Factor b of the formula, 0..=1; needed when a tube has bends.
    pub bend_factor: Option<f64>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { coefficient: COEFFICIENT, pipe_transmittance: None, bend_factor: None }
    }
}

/// Published coefficient c of the formula.
///
/// Over the whole plane the formula returns c pi = 1.552 times the flux:
///
/// ```
/// let returned = skyduct_physics::analytic::jenkins::COEFFICIENT * std::f64::consts::PI;
/// assert!((returned - 1.552).abs() < 5e-4);
/// ```
pub const COEFFICIENT: f64 = 0.494;

/// Properties of a tube's pipe that enter the formula.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pipe {
    /// Length along the axis over diameter.
    pub aspect: f64,
    /// Number of elbows.
    pub bends: u32,
    /// Reflectance of the wall, per bounce.
    pub reflectance: f64,
    /// Factor tau_collector of the formula, 0..=1.
    pub collector_transmittance: f64,
}

/// Solver by the formula for one installation.
#[derive(Debug)]
pub struct Jenkins {
    room: Installation,
    /// Pipes, one per tube of the room.
    pipes: Vec<Pipe>,
    settings: Settings,
}

impl Jenkins {
    /// Builds the solver; `pipes`: one per tube of `room`. Without [`Settings::bend_factor`] bends cost nothing.
    pub fn new(room: Installation, pipes: Vec<Pipe>, settings: Settings) -> Self {
        Self { room, pipes, settings }
    }

    /// Computes the unobstructed horizontal illuminances in lux from the sky and from the sun.
    fn external(&self) -> (f64, f64) {
        let sky = self.room.sky.as_ref().map_or(0.0, |sky| sky.horizontal_illuminance_lux());
        (sky, self.room.sun.as_ref().map_or(0.0, |sun| sun.horizontal_illuminance_lux()))
    }

    /// Returns T for a wall reflectance: the given value, or the mean over sky and sun, weighted by their illuminances.
    fn pipe_transmittance(&self, reflectance: f64) -> f64 {
        let (sky, sun) = self.external();
        if let Some(given) = self.settings.pipe_transmittance {
            return given;
        }
        let through_sky = self.room.sky.as_ref().map_or(0.0, |sky| sky_exitance(sky, 1.0, reflectance));
        let through_sun = self.room.sun.as_ref().filter(|_| sun > 0.0).map_or(0.0, |beam| {
            let tangent = libm::tan(FRAC_PI_2 - libm::asin(beam.direction.z));
            sun * beam_transmission(1.0, tangent, reflectance)
        });
        if sky + sun > 0.0 { (through_sky + through_sun) / (sky + sun) } else { 0.0 }
    }

    fn tube(&self, tube: &Tube, pipe: &Pipe) -> TubeSolution {
        let (sky, sun) = self.external();
        let at_collector = (sky + sun) * PI * tube.radius * tube.radius;
        let bends = self.settings.bend_factor.unwrap_or(1.0).powi(pipe.bends as i32);
        let transmission = libm::pow(self.pipe_transmittance(pipe.reflectance), pipe.aspect) * bends;
        let at_diffuser = at_collector * pipe.collector_transmittance * transmission;
        let quantity = |value| Quantity { value, error: None };
        TubeSolution {
            at_collector: quantity(at_collector),
            at_diffuser: quantity(at_diffuser),
            into_room: quantity(at_diffuser * mean_transmittance(&tube.diffuser, tube.radius)),
        }
    }
}

impl Solver for Jenkins {
    fn solve(&self, _: &AtomicBool) -> Option<Solution> {
        let tubes: Vec<TubeSolution> =
            self.room.tubes.iter().zip(&self.pipes).map(|(tube, pipe)| self.tube(tube, pipe)).collect();
        let grid = |grid: &Grid| GridSolution {
            illuminance: (0..grid.len())
                .map(|sensor| {
                    let of_tube = |(tube, flux): (&Tube, &TubeSolution)| {
                        self.settings.coefficient * flux.into_room.value * shape(grid, sensor, tube)
                    };
                    self.room.tubes.iter().zip(&tubes).map(of_tube).sum()
                })
                .collect(),
            error: Vec::new(),
        };
        let grids = self.room.grids.iter().map(grid).collect();
        Some(Solution { grids, tubes, ..Solution::default() })
    }
}

/// Computes cos^4(theta) / V^2 = V^2 / d^4 at a sensor, in 1/m2; for a cell its mean, pi times the cell's form factor over its area.
fn shape(grid: &Grid, sensor: usize, tube: &Tube) -> f64 {
    let (x, y) = (grid.x_m[sensor % grid.cells[0]], grid.y_m[sensor / grid.cells[0]]);
    let (dx, dy, depth) = (x - tube.origin.x, y - tube.origin.y, tube.origin.z - grid.height_m);
    match grid.estimate {
        EstimateKind::Point => {
            let squared = dx * dx + dy * dy + depth * depth;
            depth * depth / (squared * squared)
        }
        EstimateKind::CellAverage => {
            let [width, height] = grid.cell_size_m;
            let range = |middle: f64, size: f64| [middle - 0.5 * size, middle + 0.5 * size];
            PI * parallel_factor(depth, range(dx, width), range(dy, height)) / (width * height)
        }
    }
}

/// Computes the transmittance of a diffuser, its zones weighted by their areas.
fn mean_transmittance(diffuser: &Diffuser, radius: f64) -> f64 {
    match *diffuser {
        // measured diffusers are refused
        Diffuser::Open | Diffuser::Measured(_) => 1.0,
        Diffuser::Clear { transmittance } | Diffuser::Lambertian { transmittance, .. } => transmittance[0],
        Diffuser::Mixed { lambertian_radius_m, inner, lambertian_transmittance, clear_transmittance, .. } => {
            let inside = (lambertian_radius_m / radius).min(1.0).powi(2);
            let lambertian = if inner == DiffuserZone::Lambertian { inside } else { 1.0 - inside };
            lambertian * lambertian_transmittance[0] + (1.0 - lambertian) * clear_transmittance[0]
        }
    }
}

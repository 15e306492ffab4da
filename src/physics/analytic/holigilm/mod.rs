//! HOLIGILM: hollow light guides without random walks, after the method of Kocifaj, Darula and Kittler (2008); formulated
//! here from the physics (docs/physics/measurement_equation.md#holigilm), not transcribed.
//!
//! * The flux that arrives at the diffuser: in closed form through straight tubes (Swift and Smith's series over the sky
//!   and the solar disc), by a low-discrepancy rule over directions and entry points through bent ones.
//! * Lambertian zones: the profile of illuminance on their upper side in rings and sectors, by rays followed backward into
//!   the sky and forward from the sun; then rings in closed form at every sensor.
//! * Clear zones: an integral over the opening, followed backward from every sensor into sky and sun; cell averages and
//!   the light on the room's faces by rays followed forward.
//! * The room's interreflection by radiosity.
//!
//! Every rule runs in independent randomisations of one low-discrepancy sequence, whose spread is the estimate of its error; rules
//! without points run at two resolutions. Rays are added until the requested accuracy or a cap is reached.

pub mod aperture;
mod beam;
mod coefficients;
mod first_reflection;
mod indirect;
mod landing;
mod levels;
mod light;
mod profile;
mod quadrature;

use std::sync::atomic::AtomicBool;

use glam::DVec3;
use rayon::prelude::*;

use self::aperture::Aperture;
use self::coefficients::clear_transmittance;
use self::first_reflection::FirstReflection;
use self::indirect::Indirect;
pub use self::levels::REPLICATES;
use self::levels::{FIRST_SENSOR_RAYS, LEVELS, MOST_RAYS, SUN_INTERVALS, SUN_TOLERANCE, quarterings};
use self::light::{Light, TubeLight};
use self::profile::Profile;
use self::quadrature::{cell_mean, centre, gauss};
use super::patches::Mesh;
use super::radiosity::Interreflection;
use super::{Ending, GridSolution, Installation, Solution, Solver, Tube, is_raised};
use crate::guide::Guide;
use crate::sampling::{Key, Stream};
use crate::scene::{EstimateKind, Grid};
use crate::statistics::Moments;

/// Ratio of the errors that more rays do not reduce to those that they do, above which no further level is computed.
const FIXED_SHARE: f64 = 3.0;

/// Fraction of a grid's mean below which values are judged as if they were as large, as in the stopping rule of jobs.
const LEAST_SHARE_OF_MEAN: f64 = 0.01;

/// Ratio of Student's quantile of 95 % for the spread of [`REPLICATES`] to the normal one, by which intervals are made from a solver's
/// errors.
const WIDENING: f64 = 2.3646 / 1.9600;

/// Solver by the method for one installation.
#[derive(Debug)]
pub struct Holigilm {
    room: Installation,
    lights: Vec<TubeLight>,
    /// Relative standard error that is requested.
    target: f64,
    seed: Key,
}

/// A value with the part of its error that more rays reduce, and the part that they do not.
#[derive(Clone, Copy, Default)]
struct Value {
    lux: f64,
    noise: f64,
    fixed: f64,
    rays: u64,
}

/// A solution and the relative errors of its worst grid.
struct Level {
    solution: Solution,
    noise: f64,
    fixed: f64,
}

impl Holigilm {
    /// Prepares the solver; `target`: relative standard error that is requested; `seed` chooses the randomisations.
    ///
    /// Tubes are straight or bent. A bent tube with a clear zone gets no sunlight at points, and its clear zone returns
    /// none of the light that goes up from the room.
    pub fn new(room: Installation, target: f64, seed: u64) -> Self {
        let lights = room.tubes.iter().map(|tube| TubeLight::new(&room, tube)).collect();
        Self { room, lights, target, seed: Key::new(seed) }
    }

    /// Computes level after level, until one is as accurate as requested, none would be better, or `cancel` is raised.
    ///
    /// `after_level` is called with the solution of every level that is done. When `cancel` is raised within a level, the one before it
    /// is the result; `None` when there is none.
    pub fn refine(&self, cancel: &AtomicBool, after_level: &mut dyn FnMut(&Solution)) -> Option<Solution> {
        let reflects = self.room.reflectance.iter().flatten().any(|reflectance| *reflectance > 0.0);
        let room = match self.room.interreflection && reflects {
            true => Some(indirect::room(&self.room, &self.lights, cancel)?),
            false => None,
        };
        let mesh = Mesh::fine(self.room.size);
        let mut done: Option<Solution> = None;
        let mut level = 0;
        let mut rays = 0;
        loop {
            let room = room.as_ref().ok_or(&mesh);
            let Some(Level { mut solution, noise, fixed }) = self.at_level(level, room, cancel) else {
                return done.map(|solution| Solution { ending: Ending::CutShort, ..solution });
            };
            let rays_of_level = solution.rays;
            rays += rays_of_level;
            solution.rays = rays;
            after_level(&solution);
            level += 1;
            let accurate = libm::hypot(noise, fixed) <= self.target || noise * FIXED_SHARE <= fixed;
            if accurate || level == LEVELS || 4 * rays_of_level > MOST_RAYS {
                return Some(solution);
            }
            done = Some(solution);
        }
    }

    /// Computes one level; `None` when cancelled.
    fn at_level(&self, level: u32, room: Result<&Interreflection, &Mesh>, cancel: &AtomicBool) -> Option<Level> {
        let mesh = room.map_or_else(|mesh| mesh, Interreflection::mesh);
        let light = Light::new(&self.room, &self.lights, self.seed, level, mesh, cancel)?;
        let direct = light.on_patches(&self.room.tubes, mesh, cancel);
        let beams =
            (!light.landed.is_empty()).then(|| FirstReflection::new(&light.landed, mesh, self.room.reflectance));
        let indirect = match room {
            Ok(room) => Some(Indirect::new(room, &direct, beams, cancel)?),
            Err(_) => None,
        };
        let mut balance = light.balance();
        indirect::add_room_balance(&self.room, mesh, &direct.mean(), indirect.as_ref(), &mut balance);
        let mut rays = light.rays();
        let mut grids = Vec::new();
        for (number, grid) in self.room.grids.iter().enumerate() {
            let values: Option<Vec<Value>> = (0..grid.len())
                .into_par_iter()
                .map(|sensor| {
                    (!is_raised(cancel)).then(|| self.sensor(level, number, sensor, &light, indirect.as_ref(), cancel))
                })
                .collect();
            let values = values?;
            rays += values.iter().map(|value| value.rays).sum::<u64>();
            grids.push(values);
        }
        // sensors that were cut short are among the values
        if is_raised(cancel) {
            return None;
        }
        let worst = |part: fn(&Value) -> f64| grids.iter().map(|grid| relative_error(grid, part)).fold(0.0, f64::max);
        let (noise, fixed) = (worst(|value| value.noise), worst(|value| value.fixed));
        let solution_of = |grid: &Vec<Value>| GridSolution {
            illuminance: grid.iter().map(|value| value.lux).collect(),
            error: grid.iter().map(|value| libm::hypot(value.noise, value.fixed)).collect(),
        };
        let grids = grids.iter().map(solution_of).collect();
        let solution = Solution { grids, tubes: light.tubes(), balance, rays, ending: Ending::Done };
        Some(Level { solution, noise, fixed })
    }

    /// Computes the light at one sensor of a grid; meaningless when cancelled.
    fn sensor(
        &self,
        level: u32,
        number: usize,
        sensor: usize,
        light: &Light,
        indirect: Option<&Indirect>,
        cancel: &AtomicBool,
    ) -> Value {
        let grid = &self.room.grids[number];
        let average = grid.estimate == EstimateKind::CellAverage;
        let fewer = quarterings(self.room.grids.iter().map(Grid::len).sum());
        let stream = self.seed.stream(Stream::SkyThroughApertures, 0).child(number as u64).child(sensor as u64);
        let mut replicas = vec![0.0; REPLICATES as usize];
        let mut value = Value::default();
        for (index, tube) in self.room.tubes.iter().enumerate().take_while(|_| !is_raised(cancel)) {
            if let Some(mean) = &light.profiles[index] {
                let at = |profile: &Profile, fewer| lambertian(tube, profile, grid, sensor, fewer, cancel);
                for (sum, replica) in replicas.iter_mut().zip(&light.replicas[index]) {
                    let profile = replica.profile.as_ref().unwrap_or(mean);
                    *sum += at(profile, 0);
                }
                let fine = at(mean, 0);
                value.fixed += (fine - at(&mean.coarse(), 0)).abs();
                if average {
                    value.fixed += (fine - at(mean, 1)).abs();
                }
            }
            let Some(zone) = tube.diffuser.specular_zone(tube.radius) else { continue };
            if average {
                for (sum, replica) in replicas.iter_mut().zip(&light.replicas[index]) {
                    *sum += replica.grids[number][sensor];
                }
                continue;
            }
            let aperture = Aperture { tube, sensor: centre(grid, sensor), zone };
            let transmittance = clear_transmittance(&tube.diffuser);
            if let Some(sky) = &self.room.sky {
                let count = (FIRST_SENSOR_RAYS >> (2 * fewer)) << (2 * level);
                for (replicate, sum) in replicas.iter_mut().enumerate().take_while(|_| !is_raised(cancel)) {
                    let stream = stream.child(index as u64).child(replicate as u64);
                    *sum += transmittance * aperture.sky(sky, stream, count);
                }
                value.rays += count * REPLICATES;
            }
            if let (Some(sun), Guide::Straight(guide)) = (&self.room.sun, &tube.guide) {
                let (lux, error, rays) = aperture.sun(guide, sun, SUN_TOLERANCE * self.target, SUN_INTERVALS >> fewer);
                value.lux += transmittance * lux;
                value.noise += transmittance * error;
                value.rays += rays;
            }
        }
        if let Some(first) = indirect.and_then(|indirect| indirect.first(grid, sensor)) {
            replicas.iter_mut().zip(first.replicas).for_each(|(sum, lux)| *sum += lux);
            value.fixed += first.error();
        }
        value.lux += replicas.iter().sum::<f64>() / REPLICATES as f64;
        if let Some(indirect) = indirect {
            let (lux, error) = indirect.at(grid, sensor);
            value.lux += lux;
            value.fixed += error;
            replicas.iter_mut().zip(indirect.spread(grid, sensor)).for_each(|(sum, lux)| *sum += lux);
        }
        let mut moments = Moments::default();
        replicas.iter().for_each(|replica| moments.push(*replica));
        value.noise = libm::hypot(value.noise, WIDENING * moments.standard_error());
        value
    }
}

impl Solver for Holigilm {
    fn solve(&self, cancel: &AtomicBool) -> Option<Solution> {
        self.refine(cancel, &mut |_| {})
    }
}

/// Computes the root mean square of a part of the error over max(value, 0.01 mean).
fn relative_error(values: &[Value], part: fn(&Value) -> f64) -> f64 {
    let mean = values.iter().map(|value| value.lux).sum::<f64>() / values.len() as f64;
    let square = |value: &Value| {
        let error = part(value);
        if error == 0.0 { 0.0 } else { (error / value.lux.max(LEAST_SHARE_OF_MEAN * mean)).powi(2) }
    };
    (values.iter().map(square).sum::<f64>() / values.len() as f64).sqrt()
}

/// Computes the illuminance from a Lambertian zone at a point, or averaged over a cell by Gauss' rule; `fewer` points per edge than
/// usual. Meaningless when cancelled.
fn lambertian(tube: &Tube, profile: &Profile, grid: &Grid, sensor: usize, fewer: usize, cancel: &AtomicBool) -> f64 {
    let centre = centre(grid, sensor);
    let depth = tube.origin.z - centre.z;
    // one point of a cell just below a wide opening takes a millisecond
    let at = |point: DVec3| match is_raised(cancel) {
        true => 0.0,
        false => profile.illuminance((point - tube.origin).truncate(), depth, DVec3::Z),
    };
    if grid.estimate == EstimateKind::Point {
        return at(centre);
    }
    // the light changes over lengths of the depth, or of the radius where that is larger
    let cells = grid.cell_size_m[0].max(grid.cell_size_m[1]) / depth;
    let points = (3 + (4.0 * cells) as usize).min(24) - fewer;
    cell_mean(grid, centre, &gauss(points), at)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::interval::two_sided_student_quantile;

    #[test]
    fn replicates_are_as_uncertain_as_student_says() {
        let [student, normal] = [REPLICATES as f64 - 1.0, 1e9].map(|degrees| two_sided_student_quantile(0.95, degrees));
        assert!((WIDENING - student / normal).abs() < 1e-4, "{WIDENING}, {}", student / normal);
    }
}

//! Point sensors so near to a surface that connections from photons give no reliable standard error, in rooms with traced light beside that
//! of Lambertian closures: bidirectional paths ([`bidirectional`]) find all of their light.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::guide::RayCount;
use crate::integrator::bidirectional::{self, Bidirectional};
use crate::integrator::diffuser_source::closure_source::Beside;
use crate::integrator::method::{Described, Refusal, Task};
use crate::integrator::photon::close_points::{close_sensors, dishonest_points};
use crate::integrator::{GridPass, Integrator};
use crate::scene::Grid;
use crate::traceable::TraceableScene;

/// Largest number of close sensors: where there are more, another method is faster.
const MOST: usize = 64;

/// Mask that changes the seed of a job into that of these sensors.
const SEED: u64 = 0x63_6c_6f_73_65;

/// Sensors close to a surface, and the method that computes them.
#[derive(Debug)]
pub struct CloseSensors<const C: usize> {
    /// Method in which each close sensor is a grid of its own.
    method: Bidirectional<C>,
    /// Number of the grid of each close sensor, and of the sensor in it.
    places: Vec<(usize, usize)>,
}

/// Returns the reason why the close sensors of a task cannot be computed, if there is one.
pub fn refuses_close(task: &Task) -> Option<Refusal> {
    let refusal = dishonest_points(task.traceable, task.grids)?;
    let serves = close_sensors(task.traceable, task.grids).take(MOST + 1).count() <= MOST;
    (!serves || bidirectional::Settings::default().refuses(task).is_some()).then_some(refusal)
}

impl<const C: usize> CloseSensors<C> {
    /// Finds the close sensors of a scene with traced light beside that of Lambertian closures; `None` where there is none. `target` is the
    /// relative standard error.
    pub fn new(
        (scene, beside): (&Arc<TraceableScene>, Beside),
        grids: &[Grid],
        seed: u64,
        target: f64,
    ) -> Option<Self> {
        if beside != Beside::Traced {
            return None;
        }
        let places: Vec<(usize, usize)> = close_sensors(scene, grids).collect();
        let alone = |(grid, sensor): &(usize, usize)| grids[*grid].alone(*sensor);
        let each: Vec<Grid> = places.iter().map(alone).collect();
        let counts = bidirectional::Settings::default().path_counts(target, false);
        let method = Bidirectional::new(scene.clone(), &each, &[], counts, seed ^ SEED);
        (!places.is_empty()).then_some(Self { method, places })
    }

    /// Computes a pass of the close sensors, replaces their values in the grids by it, and returns the number of rays; `None` when
    /// cancelled.
    pub fn replace(&self, pass: u64, grids: &mut [GridPass], cancel: &AtomicBool) -> Option<RayCount> {
        let found = self.method.pass(pass, cancel)?;
        for ((grid, sensor), of_sensor) in self.places.iter().zip(found.grids) {
            let grid = &mut grids[*grid];
            grid.illuminance[*sensor] = of_sensor.illuminance[0];
            for counts in grid.photons.get_mut(*sensor).into_iter() {
                *counts = of_sensor.photons.first().copied().unwrap_or_default();
            }
            for parts in [&mut grid.residual, &mut grid.gathered, &mut grid.contrasts] {
                parts.get_mut(*sensor).into_iter().for_each(|part| *part = 0.0);
            }
        }
        Some(found.totals.rays)
    }
}

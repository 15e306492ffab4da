//! Point sensors so near to a surface that connections from photons tell no honest error, where light comes in beside lamps: paths from
//! both ends ([`bidirectional`]) find all of their light.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::guide::RayCount;
use crate::integrator::bidirectional::{self, Bidirectional};
use crate::integrator::lamp::beside::all_lamps;
use crate::integrator::method::{Described, Refusal, Task};
use crate::integrator::photon::close_points::{close_sensors, dishonest_points};
use crate::integrator::{GridPass, Integrator};
use crate::scene::Grid;
use crate::traceable::TraceableScene;

/// Such sensors at most: of more of them another method serves better.
const MOST: usize = 64;

/// Changes the seed of a job into that of these sensors.
const SEED: u64 = 0x63_6c_6f_73_65;

/// Sensors close to a surface, and the method that computes them.
#[derive(Debug)]
pub struct Close<const C: usize> {
    /// Each sensor is a grid of its own.
    method: Bidirectional<C>,
    /// Number of the grid of each, and of the sensor in it.
    places: Vec<(usize, usize)>,
}

/// Reason why the close sensors of a task cannot be computed, if so.
pub fn refuses_close(task: &Task) -> Option<Refusal> {
    let refusal = dishonest_points(task.traceable, task.grids)?;
    let serves = close_sensors(task.traceable, task.grids).take(MOST + 1).count() <= MOST;
    (!serves || bidirectional::Settings::default().refuses(task).is_some()).then_some(refusal)
}

impl<const C: usize> Close<C> {
    /// Finds the close sensors of a scene in which light comes in beside lamps; `None` where there is none. `target`: relative standard error.
    pub fn new(scene: &Arc<TraceableScene>, grids: &[Grid], seed: u64, target: f64) -> Option<Self> {
        if all_lamps(&scene.tubes) {
            return None;
        }
        let places: Vec<(usize, usize)> = close_sensors(scene, grids).collect();
        let alone = |(grid, sensor): &(usize, usize)| grids[*grid].alone(*sensor);
        let each: Vec<Grid> = places.iter().map(alone).collect();
        let sizes = bidirectional::Settings::default().sizes(target, false);
        let method = Bidirectional::new(scene.clone(), &each, &[], sizes, seed ^ SEED);
        (!places.is_empty()).then_some(Self { method, places })
    }

    /// Puts a pass of these sensors in place of what the grids have of them, and returns the rays it took; `None` when cancelled.
    pub fn replace(&self, pass: u64, grids: &mut [GridPass], cancel: &AtomicBool) -> Option<RayCount> {
        let found = self.method.pass(pass, cancel)?;
        for ((grid, sensor), of_sensor) in self.places.iter().zip(found.grids) {
            let grid = &mut grids[*grid];
            grid.illuminance[*sensor] = of_sensor.illuminance[0];
            for counts in grid.photons.get_mut(*sensor).into_iter() {
                *counts = of_sensor.photons.first().copied().unwrap_or_default();
            }
            for parts in [&mut grid.residual, &mut grid.gathered] {
                parts.get_mut(*sensor).into_iter().for_each(|part| *part = 0.0);
            }
        }
        Some(found.account.rays)
    }
}

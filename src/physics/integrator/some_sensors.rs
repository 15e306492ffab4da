//! Passes of two methods: one computes all sensors, and another one some of them better.

use std::sync::atomic::AtomicBool;

use super::photon_map::progressive::Carried;
use super::{GridPass, Integrator, Pass};
use crate::scene::{EstimateKind, Grid};

/// A sensor of a grid: number of the grid, and of the sensor in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SensorPlace {
    /// Number of the grid among those of the scene.
    pub grid: usize,
    /// Number of the sensor, row by row from the south, west to east.
    pub sensor: usize,
}

impl SensorPlace {
    /// The point sensor alone as a grid of one.
    pub fn as_grid(&self, grids: &[Grid]) -> Option<Grid> {
        let grid = grids.get(self.grid).filter(|grid| grid.estimate == EstimateKind::Point)?;
        let (column, row) = (self.sensor % grid.cells[0], self.sensor / grid.cells[0]);
        Some(Grid { cells: [1, 1], x_m: vec![grid.x_m[column]], y_m: vec![grid.y_m[row]], free: None, ..grid.clone() })
    }
}

/// A method for all sensors, and one for some in its place.
pub struct SomeSensors {
    /// Computes all grids; keeps the books.
    pub all: Box<dyn Integrator>,
    /// Computes one grid of one sensor for each of `places`, in their order.
    pub some: Box<dyn Integrator>,
    /// Sensors whose values come from `some`.
    pub places: Vec<SensorPlace>,
}

impl Integrator for SomeSensors {
    fn pass(&self, pass: u64, cancel: &AtomicBool) -> Option<Pass> {
        self.pass_after(pass, &Carried::default(), cancel)
    }

    fn start(&self) -> Pass {
        self.all.start()
    }

    fn pass_after(&self, pass: u64, before: &Carried, cancel: &AtomicBool) -> Option<Pass> {
        let mut all = self.all.pass_after(pass, before, cancel)?;
        let some = self.some.pass(pass, cancel)?;
        all.account.rays += some.account.rays;
        all.photons += some.photons;
        for (place, of_one) in self.places.iter().zip(&some.grids) {
            if let Some(grid) = all.grids.get_mut(place.grid) {
                put(grid, place.sensor, of_one);
            }
        }
        Some(all)
    }
}

/// Takes everything that a pass says of one sensor from the pass of a grid that has it alone.
fn put(grid: &mut GridPass, sensor: usize, one: &GridPass) {
    fn replace<T: Copy + Default>(all: &mut [T], sensor: usize, one: &[T]) {
        if let Some(value) = all.get_mut(sensor) {
            *value = one.first().copied().unwrap_or_default();
        }
    }
    replace(&mut grid.illuminance, sensor, &one.illuminance);
    replace(&mut grid.bias, sensor, &one.bias);
    replace(&mut grid.photons, sensor, &one.photons);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::integrator::PhotonCount;

    /// A method that gives sensors their number plus a constant.
    struct Numbers {
        from: f64,
        grids: Vec<usize>,
    }

    impl Integrator for Numbers {
        fn pass(&self, pass: u64, _: &AtomicBool) -> Option<Pass> {
            let grid = |(number, sensors): (usize, &usize)| GridPass {
                illuminance: (0..*sensors)
                    .map(|s| self.from + (10 * number + s) as f64 + 100.0 * pass as f64)
                    .collect(),
                photons: vec![PhotonCount { found: self.from, one_lux: 1.0, brightest_lux: 1.0 }; *sensors],
                ..GridPass::default()
            };
            Some(Pass { grids: self.grids.iter().enumerate().map(grid).collect(), photons: 5, ..Pass::default() })
        }
    }

    #[test]
    fn some_sensors_are_replaced_and_no_others() {
        let all = Box::new(Numbers { from: 0.0, grids: vec![3, 4] });
        let some = Box::new(Numbers { from: 0.5, grids: vec![1, 1] });
        let places = vec![SensorPlace { grid: 1, sensor: 3 }, SensorPlace { grid: 0, sensor: 1 }];
        let pass = SomeSensors { all, some, places }.pass(2, &AtomicBool::new(false)).unwrap();
        assert_eq!(pass.grids[0].illuminance, [200.0, 210.5, 202.0]);
        assert_eq!(pass.grids[1].illuminance, [210.0, 211.0, 212.0, 200.5]);
        assert_eq!(pass.grids[1].photons.iter().map(|count| count.found).collect::<Vec<_>>(), [0.0, 0.0, 0.0, 0.5]);
        assert_eq!(pass.photons, 10);
    }
}

//! Illuminance grids: level sensors that look up, and sensors at any places that face any direction.

use std::sync::Arc;

use glam::{DVec2, DVec3};

/// A sensor of the illuminance on a plane at its position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensor {
    /// Place in the room in m.
    pub position: DVec3,
    /// Unit normal of the plane, to the side that light falls on.
    pub normal: DVec3,
}

/// A grid of sensors.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Name in the document, unique among the grids of a job; files of results carry it.
    pub name: String,
    /// Height of the sensors above the floor in m; for sensors at any places, that of the first.
    pub height_m: f64,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Centres of the columns, ascending, in m from the room's west wall.
    pub x_m: Vec<f64>,
    /// Centres of the rows, ascending, in m from the room's south wall.
    pub y_m: Vec<f64>,
    /// Size of a cell along x and y in metres.
    pub cell_size_m: [f64; 2],
    /// Distance of neighbouring columns and rows in cells: 1, except after [`Grid::thinned`].
    pub every: [usize; 2],
    /// Distance in m, >= 0, from walls within which sensors have no value, in rooms that are no boxes and in lattices of a given spacing.
    pub from_walls_m: f64,
    /// Meaning of values: illuminance at points, or means over cells.
    pub estimate: EstimateKind,
    /// True if results report the light by source and by tube, too.
    pub components: bool,
    /// Light of the openings per lumen that results report at each sensor, too.
    pub responses: Responses,
    /// Illuminance in lux that the mean is compared with in results.
    pub target_lux: Option<f64>,
    /// Sensors at any places, in the order of their numbers; `None` for level ones that look up, in columns and rows.
    pub placed: Option<Arc<[Sensor]>>,
    /// Fraction of each sensor that no solid takes, row by row: of a cell's area, 0..1; for a point 1, or 0 inside a solid. `None` where
    /// no solid takes anything.
    pub free: Option<Arc<[f64]>>,
    /// Fraction of each sensor's cell that lies in the room, row by row, by which statistics weigh the sensors: 0 outside. `None` where every
    /// cell lies in the room as a whole.
    pub area: Option<Arc<[f64]>>,
}

/// Meaning of a sensor's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EstimateKind {
    /// Illuminance at the cell's centre.
    Point,
    /// Mean illuminance over the cell.
    CellAverage,
}

/// Illuminance of sensors per lumen of white light that leaves openings as from Lambertian surfaces.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Responses {
    /// None is reported.
    #[default]
    None,
    /// Responses to each patch of the openings.
    ToPatches,
    /// Responses to whole openings with their first moments, and to all openings together.
    ToTubes,
}

impl Responses {
    /// True if any response is reported.
    pub fn are_reported(self) -> bool {
        self != Self::None
    }
}

impl Grid {
    /// True if all sensors look straight up.
    pub fn is_level(&self) -> bool {
        self.placed.iter().flat_map(|placed| placed.iter()).all(|sensor| sensor.normal == DVec3::Z)
    }

    /// Builds a grid of `cells` (each >= 1) over a floor of `room_size_m`, `margin_m` away from the walls.
    pub fn new(
        name: String,
        height_m: f64,
        cells: [usize; 2],
        margin_m: f64,
        room_size_m: [f64; 2],
        estimate: EstimateKind,
    ) -> Self {
        let cell_size_m = std::array::from_fn(|axis| (room_size_m[axis] - 2.0 * margin_m) / cells[axis] as f64);
        Self::lattice(name, height_m, cells, [margin_m; 2], cell_size_m, estimate)
    }

    /// Builds a grid of `cells` (each >= 1) of `cell_size_m` along x and y, the first of which begins at `corner_m`.
    pub fn lattice(
        name: String,
        height_m: f64,
        cells: [usize; 2],
        corner_m: [f64; 2],
        cell_size_m: [f64; 2],
        estimate: EstimateKind,
    ) -> Self {
        let centre = |axis: usize, number: usize| corner_m[axis] + (number as f64 + 0.5) * cell_size_m[axis];
        let centres = |axis: usize| (0..cells[axis]).map(|number| centre(axis, number)).collect::<Vec<_>>();
        Self {
            name,
            height_m,
            cells,
            x_m: centres(0),
            y_m: centres(1),
            cell_size_m,
            every: [1; 2],
            from_walls_m: 0.0,
            estimate,
            components: false,
            responses: Responses::None,
            target_lux: None,
            placed: None,
            free: None,
            area: None,
        }
    }

    /// Builds a grid of sensors (at least one) at any places that face any direction: one row of points.
    pub fn points(name: String, sensors: Vec<Sensor>) -> Self {
        let first = sensors[0].position;
        let grid = Self::new(name, first.z, [sensors.len(), 1], 0.0, [1.0; 2], EstimateKind::Point);
        Self {
            x_m: sensors.iter().map(|sensor| sensor.position.x).collect(),
            y_m: vec![first.y],
            placed: Some(sensors.into()),
            ..grid
        }
    }

    /// Returns a sample of this grid: every few columns and rows, about `most` sensors at most, each with its own cell.
    ///
    /// ```
    /// use skyduct_physics::scene::{EstimateKind, Grid};
    ///
    /// let grid = Grid::new("g".into(), 0.8, [9, 6], 0.0, [9.0, 6.0], EstimateKind::Point);
    /// let some = grid.thinned(9);
    /// assert_eq!((some.cells, some.x_m, some.y_m), ([3, 2], vec![1.5, 4.5, 7.5], vec![1.5, 4.5]));
    /// assert_eq!(grid.thinned(54).cells, grid.cells);
    /// ```
    pub fn thinned(&self, most: usize) -> Self {
        let mut step = 1;
        let left = |axis: usize, step: usize| (self.cells[axis] / step).max(1);
        while left(0, step) * left(1, step) > most.max(1) {
            step += 1;
        }
        let some = |axis: usize, centres: &[f64]| -> Vec<f64> {
            let step = step.min(self.cells[axis]);
            centres.iter().skip((step - 1) / 2).step_by(step).take(left(axis, step)).copied().collect()
        };
        let (x_m, y_m) = (some(0, &self.x_m), some(1, &self.y_m));
        let every = [0, 1].map(|axis| self.every[axis] * step.min(self.cells[axis]));
        let numbers = |axis: usize, count: usize| {
            let step = step.min(self.cells[axis]);
            (0..count).map(move |number| (step - 1) / 2 + number * step)
        };
        let some_of = |values: &Arc<[f64]>| {
            let rows = numbers(1, y_m.len()).map(|row| row * self.cells[0]);
            let sensors = rows.flat_map(|row| numbers(0, x_m.len()).map(move |column| row + column));
            sensors.map(|sensor| values[sensor]).collect()
        };
        let [free, area] = [&self.free, &self.area].map(|values| values.as_ref().map(some_of));
        let placed = self.placed.as_ref().map(|placed| numbers(0, x_m.len()).map(|number| placed[number]).collect());
        Self { name: self.name.clone(), cells: [x_m.len(), y_m.len()], x_m, y_m, every, placed, free, area, ..*self }
    }

    /// Returns one level sensor of this grid as a grid of its own.
    pub fn alone(&self, sensor: usize) -> Self {
        let (column, row) = (sensor % self.cells[0], sensor / self.cells[0]);
        let [free, area] = [&self.free, &self.area].map(|values| values.as_ref().map(|values| [values[sensor]].into()));
        let (x_m, y_m) = (vec![self.x_m[column]], vec![self.y_m[row]]);
        Self { name: self.name.clone(), cells: [1, 1], x_m, y_m, free, area, placed: None, ..*self }
    }

    /// Returns the number of sensors; sensor `j * cells[0] + i` is at (`x_m[i]`, `y_m[j]`).
    pub fn len(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    /// True if there is no sensor; documents have at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns sensor `index`; that of a cell is at its centre.
    #[inline]
    pub fn sensor(&self, index: usize) -> Sensor {
        match &self.placed {
            Some(placed) => placed[index],
            None => Sensor { position: self.centre(index), normal: DVec3::Z },
        }
    }

    /// Returns the position of sensor `index`; that of a cell is its centre.
    #[inline]
    pub fn centre(&self, index: usize) -> DVec3 {
        if let Some(placed) = &self.placed {
            return placed[index].position;
        }
        DVec3::new(self.x_m[index % self.cells[0]], self.y_m[index / self.cells[0]], self.height_m)
    }

    /// Returns the sensor nearest to a point of the plan among those that `counts` holds for.
    pub fn nearest(&self, point: DVec2, counts: impl Fn(usize) -> bool) -> Option<usize> {
        let away = |sensor: &usize| self.centre(*sensor).truncate().distance_squared(point);
        (0..self.len()).filter(|sensor| counts(*sensor)).min_by(|one, other| away(one).total_cmp(&away(other)))
    }

    /// True if a sensor lies inside a solid and has no value; a cell, if all of it does.
    #[inline]
    pub fn is_inside(&self, index: usize) -> bool {
        self.free.as_ref().is_some_and(|free| free[index] == 0.0)
    }

    /// True if the sensor is a mean over a cell of which a part lies outside the room.
    #[inline]
    pub fn is_cut(&self, index: usize) -> bool {
        self.estimate == EstimateKind::CellAverage && self.area.as_ref().is_some_and(|area| area[index] < 1.0)
    }

    /// Returns the number of sensors that have a value: all but those inside solids.
    pub fn valued(&self) -> usize {
        (0..self.len()).filter(|sensor| !self.is_inside(*sensor)).count()
    }

    /// Finds the sensor whose cell holds a point of the plane; `None` beside the grid, and for sensors that have no cells.
    #[inline]
    pub fn cell_at(&self, point: DVec2) -> Option<usize> {
        if self.placed.is_some() {
            return None;
        }
        let position = (point - DVec2::new(self.x_m[0], self.y_m[0])) / DVec2::from(self.cell_size_m) + 0.5;
        let cell = |k: usize, n: usize| match self.every[k] {
            1 => Some(n),
            every => n.is_multiple_of(every).then_some(n / every),
        };
        let axis = |k: usize| {
            let number = (position[k] >= 0.0).then_some(position[k] as usize);
            number.and_then(|n| cell(k, n)).filter(|n| *n < self.cells[k])
        };
        let (i, j) = (axis(0)?, axis(1)?);
        Some(j * self.cells[0] + i)
    }

    /// Returns the area of one cell in m2.
    #[inline]
    pub fn cell_area_m2(&self) -> f64 {
        self.cell_size_m[0] * self.cell_size_m[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A point lies in a cell of a thinned grid exactly if it lies in that cell of the whole grid.
    #[test]
    fn the_cells_of_a_thinned_grid_are_those_of_the_whole() {
        let grid = Grid::new("g".into(), 0.8, [7, 5], 0.25, [4.0, 3.0], EstimateKind::CellAverage);
        let some = grid.thinned(8);
        assert_eq!((some.cells, some.cell_size_m), ([3, 2], grid.cell_size_m));
        let halves = Grid { free: Some((0..35).map(|sensor| f64::from(sensor) / 35.0).collect()), ..grid.clone() };
        for (sensor, free) in halves.thinned(8).free.unwrap().iter().enumerate() {
            assert_eq!(
                grid.cell_at(some.centre(sensor).truncate()).map(|of_whole| of_whole as f64 / 35.0),
                Some(*free)
            );
        }
        let mut found = vec![0; some.len()];
        for number in 0..10_000 {
            let point = DVec2::new(0.04 * (number % 100) as f64, 0.03 * (number / 100) as f64);
            let whole = grid.cell_at(point).map(|sensor| grid.centre(sensor));
            let part = some.cell_at(point);
            let kept = whole.filter(|centre| (0..some.len()).any(|sensor| some.centre(sensor) == *centre));
            assert_eq!(part.map(|sensor| some.centre(sensor)), kept, "{point}");
            part.into_iter().for_each(|sensor| found[sensor] += 1);
        }
        assert!(found.iter().all(|points| *points > 100), "{found:?}");
    }
}

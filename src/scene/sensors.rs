//! Illuminance grids: horizontal sensors that look up.

use glam::{DVec2, DVec3};

/// A grid of horizontal sensors.
#[derive(Clone, Debug)]
pub struct Grid {
    /// Name in the document, unique among the grids of a job; files of results carry it.
    pub name: String,
    /// Height of the sensors above the floor.
    pub height_m: f64,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    /// Centres of the columns, ascending, from the room's west wall.
    pub x_m: Vec<f64>,
    /// Centres of the rows, ascending, from the room's south wall.
    pub y_m: Vec<f64>,
    /// Size of a cell along x and y in metres.
    pub cell_size_m: [f64; 2],
    /// Whether sensors are points or whole cells.
    pub estimate: EstimateKind,
    /// Whether results tell the light by source and by tube, too.
    pub components: bool,
}

/// Meaning of a sensor's value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EstimateKind {
    /// Illuminance at the cell's centre.
    Point,
    /// Mean illuminance over the cell.
    CellAverage,
}

impl Grid {
    /// `cells` (each >= 1) over a floor of `room_size_m`, `margin_m` away from the walls.
    pub fn new(
        name: String,
        height_m: f64,
        cells: [usize; 2],
        margin_m: f64,
        room_size_m: [f64; 2],
        estimate: EstimateKind,
    ) -> Self {
        let cell_size_m: [f64; 2] =
            std::array::from_fn(|axis| (room_size_m[axis] - 2.0 * margin_m) / cells[axis] as f64);
        let centres =
            |axis: usize| (0..cells[axis]).map(|i| margin_m + (i as f64 + 0.5) * cell_size_m[axis]).collect::<Vec<_>>();
        Self { name, height_m, cells, x_m: centres(0), y_m: centres(1), cell_size_m, estimate, components: false }
    }

    /// Number of sensors; sensor `j * cells[0] + i` is at (`x_m[i]`, `y_m[j]`).
    pub fn len(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    /// True if there is no sensor; documents have at least one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Centre of sensor `index` in the plane of the grid.
    #[inline]
    pub fn centre(&self, index: usize) -> DVec3 {
        DVec3::new(self.x_m[index % self.cells[0]], self.y_m[index / self.cells[0]], self.height_m)
    }

    /// The sensor whose cell holds a point of the plane; `None` beside the grid.
    #[inline]
    pub fn cell_at(&self, point: DVec2) -> Option<usize> {
        let position = (point - DVec2::new(self.x_m[0], self.y_m[0])) / DVec2::from(self.cell_size_m) + 0.5;
        let axis = |k: usize| (position[k] >= 0.0).then_some(position[k] as usize).filter(|n| *n < self.cells[k]);
        let (i, j) = (axis(0)?, axis(1)?);
        Some(j * self.cells[0] + i)
    }

    /// Area of one cell in m2.
    #[inline]
    pub fn cell_area_m2(&self) -> f64 {
        self.cell_size_m[0] * self.cell_size_m[1]
    }
}

//! Illuminance grids: horizontal sensors that look up.

/// A grid of horizontal sensors.
#[derive(Clone, Debug)]
pub struct Grid {
    pub name: String,
    pub height_m: f64,
    /// Number of cells along x and y.
    pub cells: [usize; 2],
    pub x_m: Vec<f64>,
    pub y_m: Vec<f64>,
    /// Size of a cell along x and y in metres.
    pub cell_size_m: [f64; 2],
    pub estimate: EstimateKind,
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
        Self { name, height_m, cells, x_m: centres(0), y_m: centres(1), cell_size_m, estimate }
    }

    /// Number of sensors; sensor `j * cells[0] + i` is at (`x_m[i]`, `y_m[j]`).
    pub fn len(&self) -> usize {
        self.cells[0] * self.cells[1]
    }

    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

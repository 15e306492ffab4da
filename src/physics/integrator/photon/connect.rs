//! Sensors of a plane, and what a vertex sends straight to them.

use glam::DVec3;

use crate::integrator::photon::path::Lobe;
use crate::scene::{EstimateKind, Grid};

/// Sensors that one vertex is connected to; larger sets are connected to a random subset of about this size.
const CONNECTIONS: usize = 1024;

/// A grid's sensors, row by row.
#[derive(Debug)]
pub struct SensorPlane {
    /// Coordinates of every sensor, so that the inner loop runs over plain arrays.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub height: f64,
    pub grid: Grid,
    pub average: bool,
    /// Squared distance within which cell averages count crossings.
    pub near_squared: f64,
    /// Number of its first sensor among all grids.
    pub first: usize,
    /// Every how many-th row-major sensor a vertex is connected to.
    pub stride: usize,
}

impl SensorPlane {
    pub fn new(grid: &Grid, first: usize) -> Self {
        let near = 0.5 * grid.cell_size_m[0].max(grid.cell_size_m[1]);
        Self {
            x: (0..grid.len()).map(|sensor| grid.x_m[sensor % grid.cells[0]]).collect(),
            y: (0..grid.len()).map(|sensor| grid.y_m[sensor / grid.cells[0]]).collect(),
            grid: grid.clone(),
            height: grid.height_m,
            average: grid.estimate == EstimateKind::CellAverage,
            near_squared: near * near,
            first,
            stride: grid.len().div_ceil(CONNECTIONS),
        }
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }
}

/// A Lambertian vertex seen from the sensors of one plane below it.
pub struct Connection {
    pub vertex: DVec3,
    pub normal: DVec3,
    pub depth: f64,
    /// Intensity along the normal in cd.
    pub per_sr: f64,
    pub near_squared: f64,
}

impl Connection {
    /// Adds the illuminance of all sensors at (`x`, `y`).
    pub fn add_to(&self, vectors: pulp::Arch, lux: &mut [f64], x: &[f64], y: &[f64]) {
        vectors.dispatch(
            #[inline(always)]
            || {
                for ((sum, x), y) in lux.iter_mut().zip(x).zip(y) {
                    *sum += self.illuminance(*x, *y);
                }
            },
        );
    }

    /// Illuminance at a horizontal sensor: I cos(theta) cos(theta') / d^2; branchless, for the inner loop.
    #[inline(always)]
    pub fn illuminance(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.vertex.x, y - self.vertex.y);
        let distance_squared = dx * dx + dy * dy + self.depth * self.depth;
        let out = (self.normal.x * dx + self.normal.y * dy - self.normal.z * self.depth).max(0.0);
        let factor = if distance_squared < self.near_squared { 0.0 } else { self.per_sr * self.depth };
        factor * out / (distance_squared * distance_squared)
    }

    /// Illuminance at a horizontal sensor by light in a lobe: I cos(theta') / d^2.
    pub fn lobe_illuminance<const C: usize>(&self, lobe: &Lobe<'_, C>, x: f64, y: f64) -> f64 {
        let way = DVec3::new(x - self.vertex.x, y - self.vertex.y, -self.depth);
        let distance_squared = way.length_squared();
        if distance_squared < self.near_squared {
            return 0.0;
        }
        let distance = distance_squared.sqrt();
        lobe.intensity(way / distance).luminance() * self.depth / (distance_squared * distance)
    }
}

//! Sensors of a grid's plane, and connections from a vertex to them.

use glam::DVec3;

use crate::integrator::photon::events::Lobe;
use crate::scene::{EstimateKind, Grid};
use crate::traceable::obstacles::Shadow;

/// Largest number of sensors of a grid that one vertex is connected to; of more sensors it is connected to a random subset of about this
/// size.
const CONNECTIONS: usize = 1024;

/// Number of sensors whose shadows are computed together.
pub const PACKET: usize = 128;

/// A grid's sensors, row by row.
#[derive(Debug)]
pub struct SensorPlane {
    /// Coordinates in m of every sensor, as plain arrays for the inner loop.
    pub x: Vec<f64>,
    pub y: Vec<f64>,
    pub height: f64,
    pub grid: Grid,
    pub average: bool,
    /// True if points of some cells lie outside the room.
    pub is_cut: bool,
    /// Squared distance in m2 within which cell averages count crossings of the plane instead of connections.
    pub near_squared: f64,
    /// Number of the grid's first sensor among all grids.
    pub first: usize,
    /// Step between the row-major sensors that a vertex is connected to: 1 connects all of them.
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
            is_cut: (0..grid.len()).any(|sensor| grid.is_cut(sensor)),
            near_squared: near * near,
            first,
            stride: grid.len().div_ceil(CONNECTIONS),
        }
    }

    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Returns the point where a flight crosses the plane downward, which counts `contact` m above it; `None` if it does not cross.
    pub fn crossing(&self, from: DVec3, to: DVec3, contact: f64) -> Option<DVec3> {
        let level = self.height + contact;
        let crosses = from.z > level && to.z <= level;
        crosses.then(|| from.lerp(to, (from.z - self.height) / (from.z - to.z)))
    }

    /// Adds the illuminance in lux that every [`Self::stride`]-th sensor from `start` on gets by a connection, times the stride, where
    /// `shadows` do not hide it; `sees` is that of [`Connection::add_visible`], for a sensor of the plane.
    pub fn add_visible(
        &self,
        connection: &Connection,
        vectors: pulp::Arch,
        shadows: &[Shadow],
        start: usize,
        sees: impl Fn(usize) -> bool,
        lux: &mut [f64],
    ) {
        let (mut x, mut y) = ([0.0; PACKET], [0.0; PACKET]);
        let mut first = start;
        while first < self.len() {
            let index = |place: usize| first + place * self.stride;
            let count = (self.len() - first).div_ceil(self.stride).min(PACKET);
            for place in 0..count {
                (x[place], y[place]) = (self.x[index(place)], self.y[index(place)]);
            }
            let add = |place: usize, value: f64| lux[index(place)] += value * self.stride as f64;
            connection.add_visible(vectors, shadows, [&x[..count], &y[..count]], |place| sees(index(place)), add);
            first = index(count);
        }
    }
}

/// A Lambertian vertex, as seen from the sensors of one plane below it.
pub struct Connection {
    pub vertex: DVec3,
    pub normal: DVec3,
    pub depth: f64,
    /// Intensity along the normal in cd.
    pub per_sr: f64,
    pub near_squared: f64,
}

impl Connection {
    /// Adds the illuminance in lux of all sensors at (`x`, `y`), in m.
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

    /// Calls `add` with the place and illuminance of each of at most [`PACKET`] sensors at (`x`, `y`), ordered by y, that `shadows` do
    /// not hide. `sees` decides for a sensor that only the shadow of a bounding volume covers: it returns true if the sensor sees the
    /// vertex.
    pub fn add_visible(
        &self,
        vectors: pulp::Arch,
        shadows: &[Shadow],
        [x, y]: [&[f64]; 2],
        sees: impl Fn(usize) -> bool,
        mut add: impl FnMut(usize, f64),
    ) {
        let [values, bounds] = vectors.dispatch(VisibleConnections { connection: self, shadows, x, y });
        if shadows.iter().all(|shadow| !shadow.is_bound) {
            values.into_iter().enumerate().take(x.len()).for_each(|(place, value)| add(place, value));
            return;
        }
        for (place, (value, bound)) in values.into_iter().zip(bounds).enumerate().take(x.len()) {
            if value > 0.0 && (bound == 0.0 || sees(place)) {
                add(place, value);
            }
        }
    }

    /// Returns the illuminance in lux at a horizontal sensor: I cos(theta) cos(theta') / d^2; branchless, for the inner loop.
    #[inline(always)]
    pub fn illuminance(&self, x: f64, y: f64) -> f64 {
        let (dx, dy) = (x - self.vertex.x, y - self.vertex.y);
        let distance_squared = dx * dx + dy * dy + self.depth * self.depth;
        let out = (self.normal.x * dx + self.normal.y * dy - self.normal.z * self.depth).max(0.0);
        let factor = if distance_squared < self.near_squared { 0.0 } else { self.per_sr * self.depth };
        factor * out / (distance_squared * distance_squared)
    }

    /// Returns the illuminance in lux at a horizontal sensor by light in a lobe: I cos(theta') / d^2.
    pub fn lobe_illuminance<const C: usize>(&self, lobe: &Lobe<'_, C>, x: f64, y: f64) -> f64 {
        let to_sensor = DVec3::new(x - self.vertex.x, y - self.vertex.y, -self.depth);
        let distance_squared = to_sensor.length_squared();
        if distance_squared < self.near_squared {
            return 0.0;
        }
        let distance = distance_squared.sqrt();
        lobe.intensity(to_sensor / distance).luminance() * self.depth / (distance_squared * distance)
    }
}

/// Illuminance by a connection at no more than [`PACKET`] sensors, ordered by y, 0 where a box hides the vertex; and for each sensor a
/// flag, not 0 if something inside a bounding volume may hide it.
struct VisibleConnections<'a> {
    connection: &'a Connection,
    shadows: &'a [Shadow],
    x: &'a [f64],
    y: &'a [f64],
}

impl pulp::NullaryFnOnce for VisibleConnections<'_> {
    type Output = [[f64; PACKET]; 2];

    #[inline(always)]
    fn call(self) -> [[f64; PACKET]; 2] {
        let Self { connection, shadows, x, y } = self;
        let vertex = connection.vertex;
        let (mut values, mut bounds) = ([0.0; PACKET], [0.0; PACKET]);
        for ((value, x), y) in values.iter_mut().zip(x).zip(y) {
            *value = connection.illuminance(*x, *y);
        }
        for shadow in shadows {
            let [south, north] = shadow.north.map(|north| vertex.y + north);
            let reached = y.partition_point(|y| *y < south)..y.partition_point(|y| *y <= north);
            if reached.is_empty() {
                continue;
            }
            let into = if shadow.is_bound { &mut bounds } else { &mut values };
            let (into, x, y) = (&mut into[reached.clone()], &x[reached.clone()], &y[reached]);
            for ((value, x), y) in into.iter_mut().zip(x).zip(y) {
                let hidden = shadow.hides(*x - vertex.x, *y - vertex.y);
                let by = if shadow.is_bound { 1.0 } else { 0.0 };
                *value = if hidden { by } else { *value };
            }
        }
        [values, bounds]
    }
}

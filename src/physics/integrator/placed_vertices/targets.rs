//! The sensors that light is connected to, and those that find some of it themselves.
//!
//! Connections from vertices very near to a sensor are rare and bright, and vertices are not placed on meshes. What comes
//! from there is found by paths that are followed from the sensor: each counts if the first thing that it meets is a mesh,
//! or nearer than the distance below which the sensor is not connected. Either way counts what the other leaves out.

use glam::DVec3;

use super::importance::Target;
use crate::integrator::photon::close_points::distance_to_surface;
use crate::integrator::photon::connect::{Connection, TOGETHER};
use crate::scene::Grid;
use crate::traceable::obstacles::Shadow;
use crate::traceable::{Place, RoomHit, TraceableScene};

/// Shares of the room's shortest edge: a sensor that is nearer to a surface is not connected below the other distance.
const BESIDE: f64 = 0.05;
const UNCONNECTED: f64 = 0.15;

/// All sensors of some grids, in an order of their own.
#[derive(Debug)]
pub struct Targets {
    rows: Vec<Row>,
    /// Number, among all sensors of the grids, of each.
    numbers: Vec<usize>,
    /// Those from which paths are followed.
    pub followed: Vec<Following>,
    vectors: pulp::Arch,
}

/// Sensors at one height that are connected from the same distance on.
#[derive(Debug)]
struct Row {
    height: f64,
    near_squared: f64,
    first: usize,
    x: Vec<f64>,
    y: Vec<f64>,
}

/// A sensor from which paths are followed.
#[derive(Clone, Copy, Debug)]
pub struct Following {
    /// Its place in the order of the targets.
    pub place: usize,
    pub position: DVec3,
    near_squared: f64,
}

/// A point that sends light down, as from a Lambertian surface.
#[derive(Clone, Copy, Debug)]
pub struct Sender {
    pub position: DVec3,
    /// Unit normal.
    pub normal: DVec3,
    /// Intensity along the normal in cd.
    pub intensity: f64,
    /// The box on which it is.
    pub of_box: Option<usize>,
}

/// Which sensors a sender is connected to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reach {
    /// All of them.
    All,
    /// Those that are not so near that they find it themselves.
    BeyondNear,
}

impl Targets {
    /// The sensors of `grids`.
    pub fn new(scene: &TraceableScene, grids: &[Grid]) -> Self {
        let shortest = scene.size.min_element();
        let near_squared = (UNCONNECTED * shortest).powi(2);
        let mut targets =
            Self { rows: Vec::new(), numbers: Vec::new(), followed: Vec::new(), vectors: pulp::Arch::new() };
        let mut before = 0;
        for grid in grids {
            let is_beside = |sensor: &usize| {
                let point = grid.centre(*sensor);
                !scene.is_in_box(point) && distance_to_surface(scene, point, BESIDE * shortest).is_some()
            };
            let (beside, free): (Vec<usize>, Vec<usize>) = (0..grid.len()).partition(is_beside);
            for (sensors, near_squared) in [(free, 0.0), (beside, near_squared)] {
                let centres: Vec<DVec3> = sensors.iter().map(|sensor| grid.centre(*sensor)).collect();
                let first = targets.numbers.len();
                if near_squared > 0.0 || scene.meshes.is_some() {
                    let following = |(place, position): (usize, &DVec3)| Following {
                        place: first + place,
                        position: *position,
                        near_squared,
                    };
                    targets.followed.extend(centres.iter().enumerate().map(following));
                }
                targets.numbers.extend(sensors.iter().map(|sensor| before + sensor));
                let (x, y) = centres.iter().map(|centre| (centre.x, centre.y)).unzip();
                targets.rows.push(Row { height: grid.height_m, near_squared, first, x, y });
            }
            before += grid.len();
        }
        targets
    }

    /// Positions of all sensors, in their order here.
    pub fn all(&self) -> impl Iterator<Item = Target> {
        self.rows.iter().flat_map(|row| {
            let places = row.x.iter().zip(&row.y).map(|(x, y)| DVec3::new(*x, *y, row.height));
            places.map(|position| Target { position, near_squared: row.near_squared })
        })
    }

    /// Values per sensor from this order to that of the grids.
    pub fn in_order_of_grids(&self, values: &[f64]) -> Vec<f64> {
        let mut ordered = vec![0.0; values.len()];
        self.numbers.iter().zip(values).for_each(|(number, value)| ordered[*number] = *value);
        ordered
    }

    /// Adds the illuminance in lx by a sender of all sensors that it reaches and that see it.
    pub fn connect(&self, scene: &TraceableScene, sender: &Sender, reach: Reach, lux: &mut [f64]) {
        for row in &self.rows {
            let depth = sender.position.z - row.height;
            if depth <= 0.0 {
                continue;
            }
            let near_squared = if reach == Reach::BeyondNear { row.near_squared } else { 0.0 };
            let (vertex, normal, per_sr) = (sender.position, sender.normal, sender.intensity);
            let connection = Connection { vertex, normal, depth, per_sr, near_squared };
            let lux = &mut lux[row.first..row.first + row.x.len()];
            let shadows: Vec<Shadow> = match scene.obstructed {
                true => scene.shadows(vertex, row.height, sender.of_box).collect(),
                false => Vec::new(),
            };
            if shadows.is_empty() {
                connection.add_to(self.vectors, lux, &row.x, &row.y);
                continue;
            }
            let groups = lux.chunks_mut(TOGETHER).zip(row.x.chunks(TOGETHER).zip(row.y.chunks(TOGETHER)));
            for (lux, (x, y)) in groups {
                self.add_seen(scene, &connection, &shadows, lux, [x, y]);
            }
        }
    }

    /// Adds to a few sensors what they see of a connection: [`TOGETHER`] at most.
    fn add_seen(
        &self,
        scene: &TraceableScene,
        connection: &Connection,
        shadows: &[Shadow],
        lux: &mut [f64],
        [x, y]: [&[f64]; 2],
    ) {
        let vertex = connection.vertex;
        let sees = |place: usize| {
            let sensor = DVec3::new(x[place], y[place], vertex.z - connection.depth);
            scene.visible(vertex, None, sensor, None)
        };
        connection.add_seen(self.vectors, shadows, [x, y], sees, |place, value| lux[place] += value);
    }
}

impl Following {
    /// True if a path from here counts whose first ray ends at this hit.
    pub fn counts(&self, scene: &TraceableScene, hit: &RoomHit) -> bool {
        is_on_mesh(scene, hit) || (hit.position - self.position).length_squared() < self.near_squared
    }
}

/// True if a ray ends on a mesh.
pub fn is_on_mesh(scene: &TraceableScene, hit: &RoomHit) -> bool {
    match hit.place {
        Place::Surface(surface) => scene.numbering.facet_of(surface).is_some(),
        Place::Opening(_) => false,
    }
}

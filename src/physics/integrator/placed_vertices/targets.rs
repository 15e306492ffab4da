//! The sensors that light is connected to, and those that find some of it themselves.
//!
//! Connections from vertices very near to a sensor are rare and bright. What comes from there is found by paths that are
//! followed from the sensor: each counts if the first thing that it meets is nearer than the distance below which the sensor is
//! not connected. Either way counts what the other leaves out.

use glam::{DVec2, DVec3};

use super::importance::cell_of_box;
use super::lines::{Lines, Scratch};
use super::penumbra::{BehindBoxes, Leaving};
use super::sent::Target;
use crate::guide::RayCount;
use crate::integrator::photon::chunks::Tally;
use crate::integrator::photon::connect::Connection;
use crate::scene::Grid;
use crate::traceable::obstacles::DiscView;
use crate::traceable::outlines::Casters;
use crate::traceable::{Place, RoomHit, TraceableScene};

/// Shares of the room's shortest edge: a sensor that is nearer to a surface is not connected below the other distance.
const BESIDE: f64 = 0.05;
const UNCONNECTED: f64 = 0.15;

/// The same for a box, in edges of its cells, where that is less: vertices are placed by cells.
const BESIDE_BOX: f64 = 0.8;

/// All sensors of some grids, in an order of their own.
#[derive(Debug)]
pub struct Targets {
    rows: Vec<Row>,
    /// Number, among all sensors of the grids, of each.
    numbers: Vec<usize>,
    /// Those from which paths are followed.
    pub followed: Vec<Following>,
    /// How each row sees each opening, tube by tube.
    of_openings: Vec<Vec<SeenFrom>>,
    /// What throws shadows.
    casters: Casters,
    vectors: pulp::Arch,
}

/// Sensors of a row that see an opening.
#[derive(Debug)]
struct SeenFrom {
    /// Those that nothing can hide any of it from.
    clear: Several,
    /// Those from which boxes may hide some of it.
    behind_boxes: Vec<BehindBoxes>,
    /// Those from which other obstacles may hide it, too, and these.
    partly: Several,
    casters: Casters,
}

/// Some sensors of a row.
#[derive(Debug)]
struct Several {
    /// Their places in the order of the targets.
    places: Vec<usize>,
    sensors: Lines,
}

/// Sensors at one height that are connected from the same distance on.
#[derive(Debug)]
struct Row {
    height: f64,
    near_squared: f64,
    first: usize,
    sensors: Lines,
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

/// What some vertices, or paths from some sensors, give.
#[derive(Debug)]
pub struct Sums {
    /// Illuminance in lx per target.
    pub lux: Vec<f64>,
    /// Rays that were traced.
    pub rays: RayCount,
}

impl Tally for Sums {
    fn is_finite(&self) -> bool {
        self.lux.iter().all(|lux| lux.is_finite())
    }
}

impl Targets {
    /// The sensors of `grids`.
    pub fn new(scene: &TraceableScene, grids: &[Grid]) -> Self {
        let shortest = scene.size.min_element();
        let near_squared = (UNCONNECTED * shortest).powi(2);
        let mut targets = Self {
            rows: Vec::new(),
            numbers: Vec::new(),
            followed: Vec::new(),
            of_openings: Vec::new(),
            casters: scene.casters(),
            vectors: pulp::Arch::new(),
        };
        let mut before = 0;
        for grid in grids {
            let is_beside = |sensor: &usize| is_beside(scene, grid.centre(*sensor), BESIDE * shortest);
            let (beside, free): (Vec<usize>, Vec<usize>) = (0..grid.len()).partition(is_beside);
            for (sensors, near_squared) in [(free, 0.0), (beside, near_squared)] {
                let centres: Vec<DVec3> = sensors.iter().map(|sensor| grid.centre(*sensor)).collect();
                let first = targets.numbers.len();
                if near_squared > 0.0 {
                    let following = |(place, position): (usize, &DVec3)| Following {
                        place: first + place,
                        position: *position,
                        near_squared,
                    };
                    targets.followed.extend(centres.iter().enumerate().map(following));
                }
                targets.numbers.extend(sensors.iter().map(|sensor| before + sensor));
                let (x, y) = centres.iter().map(|centre| (centre.x, centre.y)).unzip();
                targets.rows.push(Row { height: grid.height_m, near_squared, first, sensors: Lines::new(x, y) });
            }
            before += grid.len();
        }
        targets.of_openings = (0..scene.tubes.len())
            .map(|tube| targets.rows.iter().map(|row| row.seen_from_opening(scene, tube)).collect())
            .collect();
        targets
    }

    /// Positions of all sensors, in their order here.
    pub fn all(&self) -> impl Iterator<Item = Target> {
        self.rows.iter().flat_map(|row| {
            let places = row.sensors.x.iter().zip(&row.sensors.y).map(|(x, y)| DVec3::new(*x, *y, row.height));
            places.map(|position| Target { position, near_squared: row.near_squared })
        })
    }

    /// Whether each sensor, in its order here, lies inside a solid and has no value.
    pub fn are_inside(&self, grids: &[Grid]) -> Vec<bool> {
        let of_grid = |grid: &Grid| (0..grid.len()).map(|sensor| grid.is_inside(sensor)).collect::<Vec<_>>();
        let inside: Vec<bool> = grids.iter().flat_map(of_grid).collect();
        self.numbers.iter().map(|number| inside[*number]).collect()
    }

    /// Number of all sensors.
    pub fn count(&self) -> usize {
        self.numbers.len()
    }

    /// Values per sensor from this order to that of the grids.
    pub fn in_order_of_grids(&self, values: &[f64]) -> Vec<f64> {
        let mut ordered = vec![0.0; values.len()];
        self.numbers.iter().zip(values).for_each(|(number, value)| ordered[*number] = *value);
        ordered
    }

    /// Adds the illuminance in lx by a vertex of all sensors that see it, and that are not so near that they find it themselves.
    pub fn connect(&self, scene: &TraceableScene, sender: &Sender, scratch: &mut Scratch, lux: &mut [f64]) {
        for row in &self.rows {
            let depth = sender.position.z - row.height;
            if depth <= 0.0 {
                continue;
            }
            let (vertex, normal, per_sr) = (sender.position, sender.normal, sender.intensity);
            let connection = Connection { vertex, normal, depth, per_sr, near_squared: row.near_squared };
            self.casters.outlines(vertex, row.height, sender.of_box, &mut scratch.outlines);
            self.add(scene, &connection, scratch, &row.sensors, &mut lux[row.first..row.first + row.sensors.len()]);
        }
    }

    /// Adds the illuminance in lx by photons that leave the opening of a tube, each with its position and intensity straight
    /// down in cd, of all sensors that see them.
    pub fn connect_opening(
        &self,
        scene: &TraceableScene,
        tube: usize,
        photons: impl Iterator<Item = (DVec3, f64)> + Clone,
        lux: &mut [f64],
    ) {
        let mut scratch = Scratch::default();
        let leaving = Leaving::new(photons.clone(), scene.tubes[tube].origin);
        for (row, seen_from) in self.rows.iter().zip(&self.of_openings[tube]) {
            let SeenFrom { clear, behind_boxes, partly, casters } = seen_from;
            behind_boxes.iter().for_each(|sensor| lux[sensor.place] += sensor.lux(&leaving, self.vectors));
            let (mut of_clear, mut of_partly) = (vec![0.0; clear.places.len()], vec![0.0; partly.places.len()]);
            for (vertex, per_sr) in photons.clone() {
                let depth = vertex.z - row.height;
                if depth <= 0.0 {
                    continue;
                }
                let connection = Connection { vertex, normal: DVec3::NEG_Z, depth, per_sr, near_squared: 0.0 };
                connection.add_to(self.vectors, &mut of_clear, &clear.sensors.x, &clear.sensors.y);
                if !partly.places.is_empty() {
                    casters.outlines(vertex, row.height, None, &mut scratch.outlines);
                    self.add(scene, &connection, &mut scratch, &partly.sensors, &mut of_partly);
                }
            }
            for (places, sums) in [(&clear.places, of_clear), (&partly.places, of_partly)] {
                places.iter().zip(sums).for_each(|(place, sum)| lux[*place] += sum);
            }
        }
    }

    /// Adds to some sensors what they see of a connection past the outlines in `scratch`.
    fn add(
        &self,
        scene: &TraceableScene,
        connection: &Connection,
        scratch: &mut Scratch,
        sensors: &Lines,
        lux: &mut [f64],
    ) {
        let vertex = connection.vertex;
        let sees = |place: usize| {
            let sensor = DVec3::new(sensors.x[place], sensors.y[place], vertex.z - connection.depth);
            scene.visible_past_boxes(vertex, sensor)
        };
        sensors.add(self.vectors, connection, scratch, sees, lux);
    }
}

impl Row {
    /// How its sensors see the opening of a tube; those that see nothing of it are left out.
    fn seen_from_opening(&self, scene: &TraceableScene, tube: usize) -> SeenFrom {
        let (mut clear, mut behind_boxes, mut partly, mut obstacles) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let middle = scene.tubes[tube].origin;
        for (number, (x, y)) in self.sensors.x.iter().zip(&self.sensors.y).enumerate() {
            match scene.view_of_opening(DVec3::new(*x, *y, self.height), tube) {
                DiscView::Clear => clear.push(number),
                DiscView::Partly(in_the_way) => match scene.shadows_of(&in_the_way, tube, self.height) {
                    Some(shadows) => {
                        let (place, depth) = (self.first + number, middle.z - self.height);
                        let away = DVec2::new(*x, *y) - middle.truncate();
                        behind_boxes.push(BehindBoxes { place, away, depth, shadows });
                    }
                    None => {
                        obstacles.extend(in_the_way);
                        partly.push(number);
                    }
                },
                DiscView::Hidden => {}
            }
        }
        obstacles.sort_unstable();
        obstacles.dedup();
        let several = |numbers: Vec<usize>| {
            let (x, y) = numbers.iter().map(|number| (self.sensors.x[*number], self.sensors.y[*number])).unzip();
            Several { places: numbers.iter().map(|number| self.first + number).collect(), sensors: Lines::new(x, y) }
        };
        SeenFrom { clear: several(clear), behind_boxes, partly: several(partly), casters: scene.casters_of(&obstacles) }
    }
}

/// True if a point is so near, in m, to a surface that rises above it that light from there would be rare and bright.
fn is_beside(scene: &TraceableScene, point: DVec3, near: f64) -> bool {
    let of_room = (scene.size - point).min_element().min(point.truncate().min_element());
    let of_meshes = || {
        // a grid may lie on a mesh
        let level = scene.coinciding();
        scene.meshes.as_ref().is_some_and(|meshes| meshes.distance_beside(point, level, near).is_some())
    };
    let of_boxes =
        || scene.boxes.iter().any(|object| object.distance_beside(point) < near.min(BESIDE_BOX * cell_of_box(object)));
    scene.interreflection && !scene.is_in_box(point) && (of_room < near || of_boxes() || of_meshes())
}

impl Following {
    /// True if a path from here counts whose first ray ends at this hit.
    pub fn counts(&self, hit: &RoomHit) -> bool {
        (hit.position - self.position).length_squared() < self.near_squared
    }
}

/// The facet of a mesh on which a ray ends, if it is one.
pub fn facet_of(scene: &TraceableScene, hit: &RoomHit) -> Option<usize> {
    match hit.place {
        Place::Surface(surface) => scene.numbering.facet_of(surface),
        Place::Opening(_) => None,
    }
}

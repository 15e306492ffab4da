//! Where vertices are placed: on surfaces that are bright and near to sensors.
//!
//! Every face is divided into cells, and triangles of meshes go in runs ([`Runs`]). A cell's probability is its reflected flux, roughly, times the root mean square of what it
//! sends to the sensors relative to what they get in all. That is the density that gives the least sum of squared relative
//! errors for light that is known (Veach 1997, section 2.2); here both factors are estimates, so that a share is even.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec3;

use super::panels::{CELLS_OF_BOX, Panel, panels, surfaces};
use super::rough_light::Light;
use super::runs::Runs;
use super::sent::{Sensors, Target};
use crate::kept::Kept;
use crate::traceable::{Place, RoomHit, SurfaceId, TraceableBox, TraceableScene, TraceableTube};

/// Share of the mean probability that every cell has at least from which any sensor can be reached.
const EVEN_SHARE: f64 = 0.02;

/// Sensors that stand for all where there are more.
const MOST_SENSORS: usize = 256;

/// A place for a vertex.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Point of a surface, in m.
    pub position: DVec3,
    /// Unit normal toward the room.
    pub normal: DVec3,
    /// Area in m2 that the point stands for: one over its density.
    pub area_m2: f64,
    /// The box on which it is.
    pub of_box: Option<usize>,
    /// The facet of a mesh on which it is.
    pub of_facet: Option<usize>,
    /// The surface of room or box on which it is, if certainly nothing covers that but openings.
    pub bare: Option<SurfaceId>,
}

/// The distribution of vertices over the surfaces of a room.
#[derive(Debug)]
pub struct Importance {
    panels: Vec<Panel>,
    /// For each panel, its surface where certainly nothing covers it but openings.
    bare: Vec<Option<SurfaceId>>,
    runs: Runs,
    /// Every row of cells of every panel, and every run.
    rows: Vec<Row>,
    /// Bounds of the rows in 0..=1, by their probabilities; one more than rows.
    bounds: Vec<f64>,
    /// Mean over the sensors of the square of what a vertex at random gives them, relative to their light: the relative variance of
    /// one vertex if its light were known, nearly.
    pub spread: f64,
}

#[derive(Debug)]
struct Row {
    of: Of,
    /// Bounds of its cells or triangles in 0..=1; one more than of these.
    bounds: Vec<f64>,
}

/// What a row is a row of.
#[derive(Clone, Copy, Debug)]
enum Of {
    /// Cells of a panel, and the number of the row there.
    Panel(usize, usize),
    /// Triangles of a run.
    Run(usize),
}

/// Edge in m of a cell of the sides of a box, the narrower ones.
pub fn cell_of_box(object: &TraceableBox) -> f64 {
    let [a, b, c, _] = object.outline();
    let (low, high) = object.span();
    ((b - a).length().min((c - b).length()) * (high - low)).sqrt() / CELLS_OF_BOX as f64
}

/// Importances that the process keeps, of some hundred kilobytes at most.
const KEPT: usize = 32;

impl Importance {
    /// The distribution for some sensors; `None` where nothing that reflects can reach any of them.
    pub fn new(scene: &TraceableScene, sensors: &[Target]) -> Option<Arc<Self>> {
        static IMPORTANCES: Kept<Vec<u64>, Option<Arc<Importance>>> = Kept::new(KEPT);
        let panels = panels(scene);
        let light = Light::new(scene, &panels);
        let lowest = sensors.iter().map(|sensor| sensor.position.z).reduce(f64::min)?;
        // no divisor of a row's length, so that every column has its turn
        let step = match sensors.len().div_ceil(MOST_SENSORS) {
            0 | 1 => 1,
            step => step | 1,
        };
        let sensors: Vec<Target> = sensors.iter().copied().step_by(step).collect();
        match key(&light, &panels, lowest, &sensors) {
            Some(key) => IMPORTANCES.get(key, || Self::weighed(&light, &panels, lowest, &sensors).map(Arc::new)),
            None => Self::weighed(&light, &panels, lowest, &sensors).map(Arc::new),
        }
    }

    /// The distribution for these sensors alone; `lowest`: least height of any.
    fn weighed(light: &Light, panels: &[Panel], lowest: f64, sensors: &[Target]) -> Option<Self> {
        let scene = light.scene;
        let number = sensors.len() as f64;
        let sensors = Sensors::new(sensors.iter(), |position| light.need(position));
        // weights of the cells of a row; those of a run together
        let mut weights: Vec<(Of, Vec<f64>)> = Vec::new();
        for (index, panel) in panels.iter().enumerate() {
            for row in 0..panel.cells {
                let weigh = |column| light.weight_of_cell(panel, [row, column], &sensors);
                weights.push((Of::Panel(index, row), (0..panel.cells).map(weigh).collect()));
            }
        }
        let runs = scene.meshes.as_ref().map_or_else(Runs::default, |meshes| Runs::new(meshes));
        for (index, run) in runs.all.iter().enumerate() {
            weights.push((Of::Run(index), vec![light.weight_of_run(run, &sensors)]));
        }
        let count: usize = weights.iter().map(|(_, cells)| cells.len()).sum();
        let mean = weights.iter().flat_map(|(_, cells)| cells).sum::<f64>() / count.max(1) as f64;
        for (of, cells) in &mut weights {
            let can_reach = match *of {
                Of::Panel(panel, _) => panels[panel].can_reach(lowest),
                Of::Run(run) => light.reflectance(&runs.all[run]) > 0.0 && runs.all[run].highest > lowest,
            };
            if can_reach {
                cells.iter_mut().for_each(|weight| *weight += EVEN_SHARE * mean);
            }
        }
        let total: f64 = weights.iter().flat_map(|(_, cells)| cells).sum();
        if total.is_nan() || total <= 0.0 {
            return None;
        }
        // with probabilities in proportion to the weights
        let spread = total * total / (PI * PI * number);
        let bounds = cumulative(weights.iter().map(|(_, cells)| cells.iter().sum::<f64>()));
        let row = |(of, cells): (Of, Vec<f64>)| {
            let bounds = match (of, &scene.meshes) {
                (Of::Run(run), Some(meshes)) => cumulative(runs.areas(meshes, run)),
                _ => cumulative(cells),
            };
            Row { of, bounds }
        };
        let rows = weights.into_iter().map(row).collect();
        let bare = panels.iter().zip(surfaces(scene)).map(|(panel, surface)| panel.is_bare(scene).then_some(surface));
        Some(Self { panels: panels.to_vec(), bare: bare.collect(), runs, rows, bounds, spread })
    }

    /// A place by two numbers in 0..1; even points stay even within a row, and rows among each other.
    pub fn place(&self, scene: &TraceableScene, [s, t]: [f64; 2]) -> Placed {
        let (row, row_share, along) = find(&self.bounds, s);
        let Row { of, bounds } = &self.rows[row];
        let (column, column_share, across) = find(bounds, t);
        let share = row_share * column_share;
        match (*of, &scene.meshes) {
            (Of::Run(run), Some(meshes)) => {
                let (position, normal, area_m2, facet) = self.runs.place(meshes, run, column, [along, across]);
                Placed { position, normal, area_m2: area_m2 / share, of_box: None, of_facet: Some(facet), bare: None }
            }
            (Of::Run(_), None) => Placed::NOWHERE,
            (Of::Panel(panel, number), _) => {
                let (panel, bare) = (&self.panels[panel], self.bare[panel]);
                let cells = panel.cells as f64;
                let (u, v) = ((number as f64 + along) / cells, (column as f64 + across) / cells);
                Placed {
                    position: panel.corner + panel.u * u + panel.v * v,
                    normal: panel.normal,
                    area_m2: panel.area_m2() / (cells * cells * share),
                    of_box: panel.of_box,
                    of_facet: None,
                    bare,
                }
            }
        }
    }
}

/// Everything that an importance follows from, in bits; `None` of scenes that have more than faces, boxes and tubes.
fn key(light: &Light, panels: &[Panel], lowest: f64, sensors: &[Target]) -> Option<Vec<u64>> {
    let scene = light.scene;
    if scene.meshes.is_some() || !scene.luminaires.is_empty() {
        return None;
    }
    let of_panel = |panel: &Panel| {
        let Panel { corner, u, v, normal, reflectance, cells, of_box } = *panel;
        let vectors = [corner, u, v, normal].into_iter().flat_map(|vector| vector.to_array());
        let numbers: Vec<f64> = vectors.chain([reflectance, cells as f64, of_box.map_or(-1.0, |k| k as f64)]).collect();
        numbers
    };
    let of_tube = |tube: &TraceableTube| {
        let [x, y, z] = tube.origin.to_array();
        [x, y, z, tube.opening_radius]
    };
    let of_sensor = |Target { position, near_squared }: &Target| {
        let [x, y, z] = position.to_array();
        [x, y, z, *near_squared]
    };
    let counts = [panels.len(), scene.tubes.len(), sensors.len()].map(|count| count as f64);
    let numbers = counts.into_iter().chain([light.of_openings, light.ambient, lowest]);
    let numbers = numbers.chain(panels.iter().flat_map(of_panel)).chain(scene.tubes.iter().flat_map(of_tube));
    Some(numbers.chain(sensors.iter().flat_map(of_sensor)).map(f64::to_bits).collect())
}

impl Placed {
    /// What a ray meets there that comes upon its surface.
    pub fn hit(&self, surface: SurfaceId) -> RoomHit {
        RoomHit { position: self.position, normal: self.normal, place: Place::Surface(surface) }
    }

    /// Where nothing can be sent from.
    const NOWHERE: Self =
        Self { position: DVec3::ZERO, normal: DVec3::NEG_Z, area_m2: 0.0, of_box: None, of_facet: None, bare: None };
}

/// Bounds in 0..=1 by weights, of which not all are zero; even ones where they are.
fn cumulative(weights: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut bounds = vec![0.0];
    let mut sum = 0.0;
    for weight in weights {
        sum += weight;
        bounds.push(sum);
    }
    let count = (bounds.len() - 1) as f64;
    if sum > 0.0 {
        bounds.iter_mut().for_each(|bound| *bound /= sum);
    } else {
        bounds.iter_mut().enumerate().for_each(|(index, bound)| *bound = index as f64 / count);
    }
    bounds
}

/// The interval of `bounds` in which a number in 0..1 lies, its length, and where in it the number lies.
fn find(bounds: &[f64], number: f64) -> (usize, f64, f64) {
    let after = bounds.partition_point(|bound| *bound <= number);
    let index = after.saturating_sub(1).min(bounds.len() - 2);
    let length = bounds[index + 1] - bounds[index];
    (index, length, ((number - bounds[index]) / length).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::TriangleMesh;
    use crate::optics::Surface;
    use crate::sampling::{Key, PathRandom};
    use crate::scene::{BoxObject, Channels, EstimateKind, Grid, Luminaire, MeshObject, Room, Scene};
    use crate::statistics::Moments;
    use crate::traceable::Follow;

    /// The mean of f / p over placed vertices is the integral of f over all faces of the room and of a turned box, within four
    /// standard errors, for f that tells faces and places on them apart; places lie on their faces.
    #[test]
    fn densities_are_those_of_the_places() {
        let size = DVec3::new(4.0, 3.0, 2.5);
        let grey = |reflectance| Surface::diffuse([reflectance; 3]);
        let stool = BoxObject {
            base: DVec3::new(2.5, 1.5, 0.0),
            size: DVec3::new(0.8, 0.5, 0.6),
            rotation: 0.4,
            surface: grey(0.6),
        };
        let corners =
            [[0.5, 0.5, 1.0], [1.2, 0.6, 1.1], [0.6, 1.4, 1.6], [3.0, 2.0, 1.5], [3.5, 2.1, 1.2], [3.2, 2.8, 2.0]];
        let sails = TriangleMesh {
            positions: corners.map(DVec3::from_array).to_vec(),
            triangles: vec![[0, 1, 2], [5, 4, 3]],
            triangle_materials: vec![0; 2],
            materials: vec![String::new()],
            ..TriangleMesh::default()
        };
        let panel =
            Luminaire { corner: DVec3::new(1.0, 1.0, 2.5), edge_u: DVec3::Y, edge_v: DVec3::X, luminance: [1000.0; 3] };
        let scene = Scene {
            daylight: None,
            room: Room {
                size,
                surfaces: [0.5, 0.4, 0.6, 0.3, 0.2, 0.8].map(|reflectance| Some(grey(reflectance))),
                boxes: vec![stool],
                meshes: vec![MeshObject { mesh: sails, surfaces: vec![grey(0.7)] }],
                luminaires: vec![panel],
            },
            tubes: Vec::new(),
            grids: vec![Grid::new("floor".into(), 0.0, [6, 5], 0.1, [size.x, size.y], EstimateKind::Point)],
            views: Vec::new(),
            channels: Channels::Photopic,
        };
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        let traceable = TraceableScene::new(&scene, follow).unwrap();
        let target = |sensor: usize| Target { position: scene.grids[0].centre(sensor), near_squared: 0.01 };
        let targets: Vec<Target> = (0..scene.grids[0].len()).map(target).collect();
        let importance = Importance::new(&traceable, &targets).unwrap();
        // but for the floor, which sends nothing to a grid that lies on it, and the underside of the box
        let faces: Vec<Panel> = panels(&traceable).into_iter().filter(|panel| panel.can_reach(0.0)).collect();
        assert_eq!(faces.len(), 10);
        let at = |point: DVec3| 1.0 + point.x * point.y + point.z * point.z;
        // the integral of a polynomial of second degree over a rectangle, by Gauss' rule of two points
        let gauss = [0.5 - 0.5 / 3f64.sqrt(), 0.5 + 0.5 / 3f64.sqrt()];
        let integral = |panel: &Panel| {
            let points = gauss.iter().flat_map(|u| gauss.map(|v| panel.corner + panel.u * *u + panel.v * v));
            0.25 * panel.area_m2() * points.map(at).sum::<f64>()
        };
        // over both sides of a triangle, by the middles of its edges
        let of_triangle = |[a, b, c]: [DVec3; 3]| {
            2.0 * 0.5
                * (b - a).cross(c - a).length()
                * [a + b, b + c, c + a].map(|sum| at(0.5 * sum)).iter().sum::<f64>()
                / 3.0
        };
        let of_mesh: f64 =
            [[0, 1, 2], [3, 4, 5]].map(|corner| of_triangle(corner.map(|k| corners[k].into()))).iter().sum();
        let mut on_mesh = Moments::default();
        let mut sums = vec![Moments::default(); faces.len()];
        let mut random = PathRandom::new(Key::new(11));
        for _ in 0..100_000 {
            let placed = importance.place(&traceable, random.uniform2());
            let on = |panel: &Panel| {
                let away = placed.position - panel.corner;
                let [u, v] = [panel.u, panel.v].map(|edge| away.dot(edge) / edge.length_squared());
                placed.normal == panel.normal
                    && away.dot(panel.normal).abs() < 1e-12
                    && (-1e-12..=1.0 + 1e-12).contains(&u)
                    && (-1e-12..=1.0 + 1e-12).contains(&v)
            };
            let value = at(placed.position) * placed.area_m2;
            let face = faces.iter().position(on).filter(|_| placed.of_facet.is_none());
            assert_eq!(face.is_none(), placed.of_facet.is_some(), "{placed:?}");
            on_mesh.push(if face.is_none() { value } else { 0.0 });
            for (number, sum) in sums.iter_mut().enumerate() {
                sum.push(if Some(number) == face { value } else { 0.0 });
            }
        }
        let difference = on_mesh.mean - of_mesh;
        assert!(difference.abs() <= 4.0 * on_mesh.standard_error(), "{of_mesh} {on_mesh:?}");
        for (sum, panel) in sums.iter().zip(&faces) {
            let difference = sum.mean - integral(panel);
            assert!(difference.abs() <= 4.0 * sum.standard_error(), "{panel:?}: {difference} {sum:?}");
        }
    }

    #[test]
    fn numbers_find_their_intervals() {
        let bounds = cumulative([1.0, 0.0, 3.0]);
        assert_eq!(bounds, [0.0, 0.25, 0.25, 1.0]);
        assert_eq!(find(&bounds, 0.0), (0, 0.25, 0.0));
        // an empty interval is never found
        assert_eq!(find(&bounds, 0.25), (2, 0.75, 0.0));
        assert_eq!(find(&bounds, 0.625), (2, 0.75, 0.5));
        assert_eq!(cumulative([0.0, 0.0]), [0.0, 0.5, 1.0]);
    }
}

//! First reflection of sunbeams from clear zones, computed from the places where they land.
//!
//! A beam lights spots that are smaller than the patches of a radiosity solution, or cut by their borders. Spread over patches, its light
//! would come from wrong places, by errors that do not fall with the square of a patch's size. So it is counted in small cells: four
//! cells make a node of a tree, four of these the next larger node, up to the patch. For a receiver far from a node, four points
//! represent it, with its flux, its centroid and its second moments; for a receiver near it, its children are used, and finally the
//! cells, as evenly lit squares in closed form. A cell average takes the closed form from a point to its rectangle. Later reflections are
//! left to radiosity, which starts from the light of the first reflection on the patches.
//!
//! The place in a cell where light lands is not recorded: the change that cells of twice the size would make estimates the error.
//! Formulas: docs/physics/rooms.md#diffuse-interreflection.

use std::f64::consts::{FRAC_1_PI, SQRT_2};
use std::ops::Range;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::landing::{HALVINGS, Landed, axes};
use super::levels::REPLICATES;
use crate::analytic::is_raised;
use crate::analytic::patches::{Element, Mesh, Patch};
use crate::scene::{EstimateKind, Face, Grid};

/// Distance, in diagonals of a node, beyond which four points represent the node.
const FAR: f64 = 5.0;

/// Number of randomisations, as the length of an array.
const COUNT: usize = REPLICATES as usize;

/// Landed sunbeams, prepared for their first reflection.
#[derive(Debug)]
pub struct FirstReflection {
    trees: Vec<Tree>,
}

/// Light that one patch reflects.
#[derive(Debug)]
struct Tree {
    patch: Patch,
    /// Nodes; the children of a node are consecutive and stand before it, and the last node is the whole patch.
    nodes: Vec<Node>,
    /// Cells, the children of the smallest nodes.
    cells: Vec<ReflectingCell>,
}

/// Light that one square of a patch reflects.
#[derive(Clone, Debug)]
struct ReflectingCell {
    /// Reflected flux in lm by randomisation.
    flux: [f64; COUNT],
    /// Number of the quarter of the parent that this is: 2 in the upper half of the first axis, plus 1 in that of the second.
    quarter: u8,
}

/// Light that the cells of a larger square reflect.
#[derive(Clone, Debug)]
struct Node {
    sum: ReflectingCell,
    /// Four points of equal flux, from the patch's corner along its two axes, in metres.
    points: [DVec2; 4],
    /// Numbers of the children: of nodes, or of cells for the smallest nodes.
    children: Range<u32>,
}

/// Flux with its moments about the patch's corner.
#[derive(Clone, Copy, Default)]
struct FluxMoments {
    flux: f64,
    first: DVec2,
    /// Second moments: along the first axis, mixed, and along the second axis.
    second: [f64; 3],
}

/// Reflected illuminance in lux.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reflected {
    /// Illuminance by randomisation.
    pub replicas: [f64; COUNT],
    /// Mean over the randomisations, with cells of twice the size as the smallest.
    coarse: f64,
}

/// Receiver of reflected light.
#[derive(Clone, Copy, Debug)]
pub enum Receiver {
    /// A point that faces a direction.
    Point(Element),
    /// A rectangle, over which the light is averaged: a cell that looks up as if it were on the floor, or a patch of a face.
    Area(Patch),
}

impl Reflected {
    /// Computes the mean over the randomisations.
    pub fn lux(&self) -> f64 {
        self.replicas.iter().sum::<f64>() / REPLICATES as f64
    }

    /// Estimates the error: the change of the mean if the cells were twice as large.
    pub fn error(&self) -> f64 {
        (self.lux() - self.coarse).abs()
    }

    fn add(&mut self, light: &ReflectingCell, weight: f64) {
        self.replicas.iter_mut().zip(&light.flux).for_each(|(sum, flux)| *sum += flux * weight);
    }

    fn add_coarse(&mut self, light: &ReflectingCell, weight: f64) {
        self.coarse += light.flux.iter().sum::<f64>() * weight / REPLICATES as f64;
    }
}

impl FirstReflection {
    /// Builds the trees of all patches; `landed`: light by randomisation on `mesh`; `reflectance`: of each face, `None` where it is open.
    pub fn new(landed: &[Landed], mesh: &Mesh, reflectance: [Option<f64>; 6]) -> Self {
        let tree = |index: usize| {
            let patch = mesh.patches[index];
            let reflectance = reflectance[patch.face].filter(|reflectance| *reflectance > 0.0)?;
            landed.iter().any(|landed| landed.reaches(index)).then_some(())?;
            let mut tree = Tree { patch, nodes: Vec::new(), cells: Vec::new() };
            let (root, _) = tree.grow(0, [0, 0], &|cell| {
                let mut flux = [0.0; COUNT];
                flux.iter_mut().zip(landed).for_each(|(sum, landed)| *sum = reflectance * landed.flux(index, cell));
                flux
            })?;
            tree.nodes.push(root);
            Some(tree)
        };
        Self { trees: (0..mesh.patches.len()).into_par_iter().filter_map(tree).collect() }
    }

    /// Computes the illuminance of a receiver.
    pub fn at(&self, receiver: &Receiver) -> Reflected {
        let mut sum = Reflected::default();
        for tree in self.trees.iter().filter(|tree| receiver.may_see(&tree.patch)) {
            if let Some(root) = tree.nodes.last() {
                tree.add(root, tree.patch, 0, receiver, &mut sum);
            }
        }
        sum
    }

    /// Computes the illuminance of every patch; meaningless when cancelled.
    pub fn on_patches(&self, mesh: &Mesh, cancel: &AtomicBool) -> Vec<Reflected> {
        let at = |patch: &Patch| match is_raised(cancel) {
            true => Reflected::default(),
            false => self.at(&Receiver::Area(*patch)),
        };
        mesh.patches.par_iter().map(at).collect()
    }
}

impl Tree {
    /// Builds the node of a square from the flux of its cells, its children first; `None` where nothing lands.
    fn grow(
        &mut self,
        depth: u32,
        [i, j]: [usize; 2],
        flux_of: &impl Fn([usize; 2]) -> [f64; COUNT],
    ) -> Option<(Node, FluxMoments)> {
        let mut sum = ReflectingCell { flux: [0.0; COUNT], quarter: (2 * (i % 2) + j % 2) as u8 };
        let mut moments = FluxMoments::default();
        let quarters = (0..4u8).map(|quarter| (quarter, part([i, j], quarter)));
        let children = if depth + 1 == HALVINGS {
            let first = self.cells.len() as u32;
            for (quarter, index) in quarters {
                let flux = flux_of(index);
                let total: f64 = flux.iter().sum();
                if total > 0.0 {
                    moments.add_even(total, square(self.patch, HALVINGS, index), &self.patch);
                    self.cells.push(ReflectingCell { flux, quarter });
                }
            }
            self.cells[first as usize..].iter().for_each(|cell| sum.add(cell));
            first..self.cells.len() as u32
        } else {
            let parts: Vec<_> = quarters.filter_map(|(_, index)| self.grow(depth + 1, index, flux_of)).collect();
            let first = self.nodes.len() as u32;
            for (node, of_node) in parts {
                sum.add(&node.sum);
                moments.add(&of_node);
                self.nodes.push(node);
            }
            first..self.nodes.len() as u32
        };
        let extent = self.patch.high - self.patch.low;
        let [u, v] = axes(&self.patch);
        let points = moments.points()?.map(|point| point.clamp(DVec2::ZERO, DVec2::new(extent[u], extent[v])));
        Some((Node { sum, points, children }, moments))
    }

    /// Adds the light of a node that fills `whole` to the illuminance of a receiver.
    fn add(&self, node: &Node, whole: Patch, depth: u32, receiver: &Receiver, sum: &mut Reflected) {
        if receiver.is_far_from(&whole) {
            let [u, v] = axes(&whole);
            let weight = node.points.iter().map(|point| {
                let mut position = self.patch.low;
                (position[u], position[v]) = (position[u] + point.x, position[v] + point.y);
                receiver.of_point(position, &whole)
            });
            let weight = 0.25 * weight.sum::<f64>();
            sum.add(&node.sum, weight);
            sum.add_coarse(&node.sum, weight);
            return;
        }
        let children = node.children.start as usize..node.children.end as usize;
        let of = |child: &ReflectingCell| square(whole, 1, part([0, 0], child.quarter));
        if depth + 1 == HALVINGS {
            sum.add_coarse(&node.sum, receiver.of_even(&whole));
            self.cells[children].iter().for_each(|cell| sum.add(cell, receiver.of_even(&of(cell))));
        } else {
            for child in &self.nodes[children] {
                self.add(child, of(&child.sum), depth + 1, receiver, sum);
            }
        }
    }
}

impl ReflectingCell {
    fn add(&mut self, other: &Self) {
        self.flux.iter_mut().zip(&other.flux).for_each(|(sum, flux)| *sum += flux);
    }
}

/// Returns one of the squares into which `root` is divided by `depth` halvings of its edges.
fn square(root: Patch, depth: u32, index: [usize; 2]) -> Patch {
    let parts = f64::from(1u32 << depth);
    let extent = root.high - root.low;
    let (mut low, mut high) = (root.low, root.high);
    for (axis, n) in axes(&root).into_iter().zip(index) {
        low[axis] = root.low[axis] + extent[axis] * n as f64 / parts;
        high[axis] = root.low[axis] + extent[axis] * (n + 1) as f64 / parts;
    }
    Patch { low, high, ..root }
}

/// Returns the numbers of a quarter of a square after one more halving.
fn part([i, j]: [usize; 2], quarter: u8) -> [usize; 2] {
    let quarter = usize::from(quarter);
    [2 * i + quarter / 2, 2 * j + quarter % 2]
}

impl FluxMoments {
    /// Adds flux that is spread evenly over a square of a patch.
    fn add_even(&mut self, flux: f64, square: Patch, patch: &Patch) {
        let [u, v] = axes(patch);
        let along = |k: usize| [square.low[k] - patch.low[k], square.high[k] - patch.low[k]];
        let middle = |[a, b]: [f64; 2]| 0.5 * (a + b);
        let square_mean = |[a, b]: [f64; 2]| (a * a + a * b + b * b) / 3.0;
        let centre = DVec2::new(middle(along(u)), middle(along(v)));
        let second = [square_mean(along(u)), centre.x * centre.y, square_mean(along(v))];
        self.add(&Self { flux, first: flux * centre, second: second.map(|moment| flux * moment) });
    }

    fn add(&mut self, other: &Self) {
        self.flux += other.flux;
        self.first += other.first;
        self.second.iter_mut().zip(other.second).for_each(|(sum, moment)| *sum += moment);
    }

    /// Returns four points of equal flux with these moments; `None` without flux.
    fn points(&self) -> Option<[DVec2; 4]> {
        let Self { flux, first, second } = *self;
        if flux <= 0.0 {
            return None;
        }
        let mean = first / flux;
        let [along, across, beside] = second.map(|moment| moment / flux);
        // the columns of a root of the covariance: C = a a^T + b b^T
        let variance = (along - mean.x * mean.x).max(0.0);
        let covariance = across - mean.x * mean.y;
        let shear = if variance > 0.0 { covariance / variance.sqrt() } else { 0.0 };
        let a = SQRT_2 * DVec2::new(variance.sqrt(), shear);
        let b = SQRT_2 * DVec2::new(0.0, (beside - mean.y * mean.y - shear * shear).max(0.0).sqrt());
        Some([mean + a, mean - a, mean + b, mean - b])
    }
}

impl Receiver {
    /// Returns the receiver for the sensor of a grid at `centre`.
    pub fn sensor(grid: &Grid, centre: DVec3) -> Self {
        match grid.estimate {
            EstimateKind::Point => Self::Point(Element::looking_up(centre)),
            EstimateKind::CellAverage => {
                let half = DVec3::new(0.5 * grid.cell_size_m[0], 0.5 * grid.cell_size_m[1], 0.0);
                Self::Area(Patch { face: Face::Floor as usize, low: centre - half, high: centre + half })
            }
        }
    }

    /// False if no part of a patch lies before the receiver.
    fn may_see(&self, patch: &Patch) -> bool {
        match self {
            Self::Point(element) => element.is_before(patch.low) || element.is_before(patch.high),
            Self::Area(area) => before(area, patch.low) || before(area, patch.high),
        }
    }

    /// True if a square is so far away that four points represent it.
    fn is_far_from(&self, square: &Patch) -> bool {
        let (low, high) = match self {
            Self::Point(element) => (element.position, element.position),
            Self::Area(area) => (area.low, area.high),
        };
        let gap = (square.low - high).max(low - square.high).max(DVec3::ZERO);
        gap.length_squared() > FAR * FAR * (square.high - square.low).length_squared()
    }

    /// Computes the illuminance in lux for 1 lm that leaves a point of a face diffusely.
    fn of_point(&self, position: DVec3, face: &Patch) -> f64 {
        match self {
            Self::Point(element) => {
                let offset = position - element.position;
                let squared = offset.length_squared();
                let cosines = offset.dot(element.normal()).max(0.0) * (-offset.dot(face.normal())).max(0.0);
                FRAC_1_PI * cosines / (squared * squared)
            }
            Self::Area(area) if !before(area, position) => 0.0,
            Self::Area(area) => area.factor_from(Element::on(face, position)) / area.area(),
        }
    }

    /// Computes the illuminance in lux for 1 lm that leaves a square evenly and diffusely.
    fn of_even(&self, square: &Patch) -> f64 {
        match self {
            Self::Point(element) => square.factor_from(*element) / square.area(),
            Self::Area(area) => {
                // the part before the receiver, by Gauss' rule of 2 x 2 points
                let mut part = *square;
                let axis = area.axis();
                if square.axis() != axis {
                    let plane = area.low[axis];
                    if area.normal()[axis] > 0.0 {
                        part.low[axis] = part.low[axis].max(plane).min(part.high[axis]);
                    } else {
                        part.high[axis] = part.high[axis].min(plane).max(part.low[axis]);
                    }
                }
                let fraction = part.area() / square.area();
                let half = (0.5 / 3f64.sqrt()) * (part.high - part.low);
                let [u, v] = axes(square);
                let at = |signs: [f64; 2]| {
                    let mut position = part.centre();
                    position[u] += signs[0] * half[u];
                    position[v] += signs[1] * half[v];
                    self.of_point(position, square)
                };
                let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]];
                fraction * 0.25 * corners.into_iter().map(at).sum::<f64>()
            }
        }
    }
}

/// True if a point is on the side that an area faces.
fn before(area: &Patch, position: DVec3) -> bool {
    (position - area.low).dot(area.normal()) > 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Face;

    /// Counts one lumen on each of `places` in all randomisations, in a room of 2 x 3 x 2.5 m.
    fn landed(mesh: &Mesh, places: &[(Face, DVec3)]) -> Vec<Landed> {
        let mut landed = Landed::nowhere(mesh);
        places.iter().for_each(|(face, position)| landed.add(mesh, *face as usize, *position, 1.0));
        vec![landed; COUNT]
    }

    fn mesh() -> Mesh {
        Mesh::new(DVec3::new(2.0, 3.0, 2.5), [4, 6, 5])
    }

    /// A spot in the middle of a cell 2 m away gives the light of a point source, I cos / d^2, with an estimated error of zero.
    #[test]
    fn a_far_spot_is_a_point() {
        let (mesh, spot) = (mesh(), DVec3::new(0.0, 1.1015625, 1.8046875));
        let beams = FirstReflection::new(&landed(&mesh, &[(Face::West, spot)]), &mesh, [Some(0.7); 6]);
        let sensor = DVec3::new(1.9, 1.6, 0.3);
        let offset = spot - sensor;
        let exact = 0.7 * FRAC_1_PI * offset.z * -offset.x / offset.length_squared().powi(2);
        let found = beams.at(&Receiver::Point(Element::looking_up(sensor)));
        assert!((found.lux() / exact - 1.0).abs() < 1e-3, "{} {exact}", found.lux());
        assert!(found.error() < 1e-12 * exact);
        // nothing comes from below
        assert_eq!(beams.at(&Receiver::Point(Element::looking_up(sensor.with_z(2.0)))).lux(), 0.0);
    }

    /// An evenly lit patch gives the light that its form factor predicts, to points at any distance and to areas, whose means are those
    /// of their points; the estimated error is as small.
    #[test]
    fn an_even_patch_is_a_rectangle() {
        let mesh = mesh();
        let patch = mesh.patches[mesh.patch_at(Face::West as usize, DVec3::new(0.0, 1.1, 1.6))];
        let middles = |k: usize| {
            let edge = 1 << HALVINGS;
            (0..edge).map(move |n| patch.low[k] + (patch.high[k] - patch.low[k]) * (n as f64 + 0.5) / f64::from(edge))
        };
        let places: Vec<_> =
            middles(1).flat_map(|y| middles(2).map(move |z| (Face::West, DVec3::new(0.0, y, z)))).collect();
        let beams = FirstReflection::new(&landed(&mesh, &places), &mesh, [Some(0.5); 6]);
        let exitance = 0.5 * places.len() as f64 / patch.area();
        for (away, height) in [(0.001, 1.6), (0.01, 1.0), (0.1, 1.74), (0.5, 0.2), (1.9, 1.3)] {
            let sensor = DVec3::new(away, 1.2, height);
            let exact = exitance * patch.factor_from(Element::looking_up(sensor));
            let found = beams.at(&Receiver::Point(Element::looking_up(sensor)));
            assert!((found.lux() / exact - 1.0).abs() < 1e-3, "{away} {height}: {} {exact}", found.lux());
            assert!(found.error() < 1e-3 * exact);
        }
        // a cell at the foot of the patch, whose plane cuts a row of small cells
        let height = patch.low.z + 0.3 * (patch.high.z - patch.low.z);
        let (low, high) = (DVec3::new(0.0, 0.8, height), DVec3::new(0.4, 1.3, height));
        let found = beams.at(&Receiver::Area(Patch { face: Face::Floor as usize, low, high }));
        let rows = 400;
        let mean = (0..rows * rows).map(|k| {
            let at = |n: usize| (n as f64 + 0.5) / rows as f64;
            let fraction = DVec3::new(at(k % rows), at(k / rows), 0.0);
            exitance * patch.factor_from(Element::looking_up(low + (high - low) * fraction)) / (rows * rows) as f64
        });
        let mean: f64 = mean.sum();
        assert!((found.lux() / mean - 1.0).abs() < 2e-3, "{} {mean}", found.lux());
    }

    /// All light that is reflected arrives somewhere, also from spots in corners.
    #[test]
    fn no_light_is_lost() {
        let mesh = mesh();
        let places = [
            (Face::West, DVec3::new(0.0, 1.1, 1.6)),
            (Face::North, DVec3::new(0.004, 3.0, 0.003)),
            (Face::Floor, DVec3::new(1.99, 2.3, 0.0)),
        ];
        let beams = FirstReflection::new(&landed(&mesh, &places), &mesh, [Some(0.5); 6]);
        let on_patches = beams.on_patches(&mesh, &AtomicBool::new(false));
        let sum: f64 = on_patches.iter().zip(&mesh.patches).map(|(found, patch)| found.lux() * patch.area()).sum();
        assert!((sum / 1.5 - 1.0).abs() < 2e-3, "{sum}");
    }
}

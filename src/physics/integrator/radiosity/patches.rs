//! Patches of the surfaces of a room, and the patch to which a point of a surface belongs.

use std::collections::HashMap;

use glam::DVec3;

use super::area::Area;
use super::gradients::Gradients;
use crate::geometry::planar::Polygon;
use crate::sampling::warp;
use crate::traceable::mesh_objects::TraceableMeshes;
use crate::traceable::{Side, SurfaceId, TraceableScene, TraceableTube};

/// Largest number of patches of plane faces: edges are longer where there would be more.
const MOST_OF_FACES: f64 = 16_384.0;

/// Division of the surfaces of a scene into patches.
#[derive(Debug)]
pub struct Patches {
    /// Layouts, by the number of the surface.
    layouts: Vec<Layout>,
    planes: Vec<DividedRectangle>,
    /// Number of patches.
    pub count: usize,
}

/// Patches of one surface.
#[derive(Clone, Copy, Debug)]
enum Layout {
    /// Surface without patches.
    None,
    /// Surface that belongs to one patch as a whole.
    One(u32),
    /// Surface that is divided like this plane, with patches numbered from `first`.
    Divided { plane: u32, first: u32 },
}

/// Rectangle that is divided evenly into cells, and these into parts.
#[derive(Clone, Debug)]
struct DividedRectangle {
    corner: DVec3,
    /// Vectors along the edges, of the length of a cell.
    edges: [DVec3; 2],
    /// Vectors whose dot product with the distance from the corner is the number of the cell along an edge.
    along: [DVec3; 2],
    cells: [u32; 2],
    /// Parts of each cell; empty where each is one.
    parts: Vec<CellParts>,
}

/// Parts of a cell: `along_edge` squared, numbered from `first`.
#[derive(Clone, Copy, Debug)]
struct CellParts {
    along_edge: u32,
    first: u32,
}

impl DividedRectangle {
    /// Divides the rectangle of these edges from a corner into cells with edges of about `edge` m.
    fn new(corner: DVec3, edges: [DVec3; 2], edge: f64) -> Self {
        let cells = edges.map(|side| (side.length() / edge).round().max(1.0) as u32);
        let along = |axis: usize| {
            let squared = edges[axis].length_squared();
            if squared > 0.0 { edges[axis] * (f64::from(cells[axis]) / squared) } else { DVec3::ZERO }
        };
        let of_cell = [0, 1].map(|axis| edges[axis] / f64::from(cells[axis]));
        Self { corner, edges: of_cell, along: [along(0), along(1)], cells, parts: Vec::new() }
    }

    /// Returns the number of patches.
    fn count(&self) -> u32 {
        self.parts.last().map_or(self.cells[0] * self.cells[1], |last| last.first + last.along_edge * last.along_edge)
    }

    #[inline]
    fn at(&self, point: DVec3) -> u32 {
        let away = point - self.corner;
        let [u, v] = [0, 1].map(|axis| away.dot(self.along[axis]).max(0.0));
        let [row, column] = [u as u32, v as u32];
        let (row, column) = (row.min(self.cells[0] - 1), column.min(self.cells[1] - 1));
        let cell = row * self.cells[1] + column;
        let Some(CellParts { along_edge, first }) = self.parts.get(cell as usize) else { return cell };
        let within =
            |place: f64, cell: u32| (((place - f64::from(cell)) * f64::from(*along_edge)) as u32).min(along_edge - 1);
        first + within(u, row) * along_edge + within(v, column)
    }

    /// Returns the corner of a cell.
    fn corner_of(&self, cell: u32) -> DVec3 {
        let (row, column) = (cell / self.cells[1], cell % self.cells[1]);
        self.corner + self.edges[0] * f64::from(row) + self.edges[1] * f64::from(column)
    }

    /// Divides each cell into parts; `wanted` returns their number along an edge for the cell's corner and edges.
    fn divide_cells(&mut self, wanted: impl Fn(DVec3, [DVec3; 2]) -> u32) {
        let mut first = 0;
        let parts: Vec<CellParts> = (0..self.cells[0] * self.cells[1])
            .map(|cell| {
                let parts = CellParts { along_edge: wanted(self.corner_of(cell), self.edges), first };
                first += parts.along_edge * parts.along_edge;
                parts
            })
            .collect();
        if parts.iter().any(|parts| parts.along_edge > 1) {
            self.parts = parts;
        }
    }

    /// Returns the area of the patch with this number.
    fn area(&self, number: u32) -> Area {
        let cell = match self.parts.is_empty() {
            true => number,
            false => self.parts.partition_point(|parts| parts.first <= number).saturating_sub(1) as u32,
        };
        let CellParts { along_edge, first } =
            self.parts.get(cell as usize).copied().unwrap_or(CellParts { along_edge: 1, first: number });
        let edges = self.edges.map(|edge| edge / f64::from(along_edge));
        let [row, column] = [(number - first) / along_edge, (number - first) % along_edge].map(f64::from);
        Area { corner: self.corner_of(cell) + edges[0] * row + edges[1] * column, edges }
    }

    /// Iterates over the parts of the cell that has part `number`, with their middles; none where the part is the whole cell.
    fn beside(&self, number: u32) -> impl Iterator<Item = (u32, DVec3)> {
        let cell = self.parts.partition_point(|parts| parts.first <= number).saturating_sub(1);
        let parts = self.parts.get(cell).copied().filter(|parts| parts.along_edge > 1);
        parts.into_iter().flat_map(move |CellParts { along_edge, first }| {
            let corner = self.corner_of(cell as u32);
            let middle = move |part: u32| (f64::from(part) + 0.5) / f64::from(along_edge);
            (0..along_edge * along_edge).map(move |part| {
                let [u, v] = [part / along_edge, part % along_edge].map(middle);
                (first + part, corner + self.edges[0] * u + self.edges[1] * v)
            })
        })
    }
}

/// Key of the facets that share a patch: a piece of a mesh, a cell of space, the direction and the side that faces there, and their
/// reflectance.
type Cluster = (u32, [i32; 3], u8, [u64; 3]);

impl Patches {
    /// Divides all surfaces that reflect diffusely into patches with edges of about `edge` m, finer ones in sunbeams through clear zones if
    /// these count.
    pub fn new((scene, with_clear_zones): (&TraceableScene, bool), edge: f64) -> Self {
        let rectangles: Vec<(SurfaceId, DVec3, [DVec3; 2])> = rectangles(scene).collect();
        let area: f64 = rectangles.iter().map(|(.., [u, v])| u.cross(*v).length()).sum();
        let edge = edge.max((area / MOST_OF_FACES).sqrt());
        let mut patches = Self { layouts: vec![Layout::None; scene.surfaces_count()], planes: Vec::new(), count: 0 };
        let gradients = Gradients::new((scene, with_clear_zones), area);
        for (surface, corner, edges) in rectangles {
            let mut plane = DividedRectangle::new(corner, edges, edge);
            let normal = plane_normal(scene, surface);
            plane.divide_cells(|corner, edges| gradients.parts((corner, edges), normal, Some(surface)));
            patches.divide(scene, [surface], plane);
        }
        if let Some(meshes) = &scene.meshes {
            patches.divide_facets(scene, meshes, edge);
        }
        patches
    }

    /// Divides surfaces that lie in one plane, each separately.
    fn divide(
        &mut self,
        scene: &TraceableScene,
        surfaces: impl IntoIterator<Item = SurfaceId>,
        plane: DividedRectangle,
    ) {
        let number = self.planes.len() as u32;
        for surface in surfaces.into_iter().filter(|surface| reflects(scene, *surface)) {
            self.layouts[surface.index()] = Layout::Divided { plane: number, first: self.count as u32 };
            self.count += plane.count() as usize;
        }
        self.planes.push(plane);
    }

    /// Divides facets that are larger than a patch, and joins smaller ones.
    fn divide_facets(&mut self, scene: &TraceableScene, meshes: &TraceableMeshes, edge: f64) {
        let mut clusters: HashMap<Cluster, u32> = HashMap::new();
        for (facet, [corner, u, v]) in extents(meshes).into_iter().enumerate() {
            let surfaces = [Side::Front, Side::Back].map(|side| scene.numbering.facet_side(facet, side));
            if u.length().max(v.length()) > edge {
                self.divide(scene, surfaces, DividedRectangle::new(corner, [u, v], edge));
                continue;
            }
            let middle = (corner + (u + v) * 0.5) / edge;
            let normal = meshes.normal(facet);
            let axis =
                (0..3).fold(0, |axis, other| if normal[other].abs() > normal[axis].abs() { other } else { axis });
            let piece = meshes.piece(facet);
            for (side, surface) in surfaces.into_iter().enumerate().filter(|(_, surface)| reflects(scene, *surface)) {
                // the dark inside of a body is not its outside opposite
                let toward = 2 * axis + usize::from((normal[axis] < 0.0) != (side == 1)) + 6 * side;
                let reflectance = scene.optics(surface).map_or([0; 3], |optics| optics.reflectance.map(f64::to_bits));
                let cell = middle.floor().to_array().map(|coordinate| coordinate as i32);
                let next = self.count as u32;
                let patch = *clusters.entry((piece, cell, toward as u8, reflectance)).or_insert(next);
                self.count += usize::from(patch == next);
                self.layouts[surface.index()] = Layout::One(patch);
            }
        }
    }

    /// Returns the patch of a point of a surface; `None` where nothing is reflected diffusely.
    #[inline]
    pub fn at(&self, surface: SurfaceId, point: DVec3) -> Option<usize> {
        match self.layouts[surface.index()] {
            Layout::None => None,
            Layout::One(patch) => Some(patch as usize),
            Layout::Divided { plane, first } => Some((first + self.planes[plane as usize].at(point)) as usize),
        }
    }

    /// Returns the rectangle of a patch of a surface; `None` for a patch of facets.
    pub fn area(&self, surface: SurfaceId, patch: usize) -> Option<Area> {
        match self.layouts[surface.index()] {
            Layout::Divided { plane, first } => Some(self.planes[plane as usize].area(patch as u32 - first)),
            Layout::None | Layout::One(_) => None,
        }
    }

    /// Iterates over all parts of the cell to which a patch of a surface belongs, with their middles; none where the patch is the whole
    /// cell.
    pub fn beside(&self, surface: SurfaceId, patch: usize) -> impl Iterator<Item = (usize, DVec3)> {
        let divided = match self.layouts[surface.index()] {
            Layout::Divided { plane, first } => Some((&self.planes[plane as usize], first)),
            Layout::None | Layout::One(_) => None,
        };
        divided.into_iter().flat_map(move |(plane, first)| {
            let parts = plane.beside(patch as u32 - first);
            parts.map(move |(part, middle)| ((first + part) as usize, middle))
        })
    }
}

fn reflects(scene: &TraceableScene, surface: SurfaceId) -> bool {
    scene.optics(surface).is_some_and(|optics| optics.gathers())
}

/// Returns the unit normal of a face of the room or of a box, or of a closure, on its lit side.
pub fn plane_normal(scene: &TraceableScene, surface: SurfaceId) -> DVec3 {
    if let Some(tube) = scene.numbering.closure_of(surface) {
        return scene.tubes[tube].frame.normal();
    }
    match scene.numbering.box_of(surface) {
        None => scene.enclosure.normal(surface.index()),
        Some(number) => {
            let of_box = surface.index() - scene.numbering.box_face(number, 0).index();
            scene.boxes[number].normal(of_box)
        }
    }
}

/// Iterates over the faces of the room and the closures that reflect, with rectangles around them, and the faces of its boxes: a corner, and two
/// edges.
pub fn rectangles(scene: &TraceableScene) -> impl Iterator<Item = (SurfaceId, DVec3, [DVec3; 2])> {
    let of_face = |(face, polygon): (usize, &Polygon)| {
        let [corner, u, v] = polygon.rectangle();
        (SurfaceId::numbered(face), corner, [u, v])
    };
    let of_box = move |number: usize| {
        (0..6).map(move |face| {
            let [corner, u, v] = scene.boxes[number].face(face);
            (scene.numbering.box_face(number, face), corner, [u, v])
        })
    };
    let of_closure = |(number, tube): (usize, &TraceableTube)| {
        let closure = scene.numbering.closure(number);
        reflects(scene, closure).then(|| {
            let [corner, u, v] = tube.rectangle();
            (closure, corner, [u, v])
        })
    };
    let of_faces = scene.enclosure.polygons.iter().enumerate().map(of_face);
    let of_closures = scene.tubes.iter().enumerate().filter_map(of_closure);
    of_faces.chain((0..scene.boxes.len()).flat_map(of_box)).chain(of_closures)
}

/// Computes a rectangle around each facet, in its plane: a corner, and two edges.
fn extents(meshes: &TraceableMeshes) -> Vec<[DVec3; 3]> {
    let frame = |normal: DVec3| [DVec3::X, DVec3::Y].map(|axis| warp::around(normal, axis));
    let mut bounds = vec![[[f64::INFINITY, f64::NEG_INFINITY]; 2]; meshes.facet_count()];
    for (facet, corners) in meshes.triangles() {
        for (axis, [low, high]) in frame(meshes.normal(facet)).into_iter().zip(&mut bounds[facet]) {
            for corner in corners {
                let along = axis.dot(corner);
                (*low, *high) = (low.min(along), high.max(along));
            }
        }
    }
    let rectangle = |(facet, [[left, right], [low, high]]): (usize, [[f64; 2]; 2])| {
        let normal = meshes.normal(facet);
        let [u, v] = frame(normal);
        let height = normal.dot(meshes.point_of(facet));
        [u * left + v * low + normal * height, u * (right - left), v * (high - low)]
    };
    bounds.into_iter().enumerate().map(rectangle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Checks a plane of 3 x 2 cells of 1 m whose fourth cell has 2 x 2 parts: it has nine patches, each of which contains the points of
    /// its area; the cell of a part has four parts with their middles.
    #[test]
    fn cells_are_divided_into_parts() {
        let mut plane = DividedRectangle::new(DVec3::Z, [DVec3::X * 3.0, DVec3::Y * 2.0], 1.0);
        assert_eq!((plane.count(), plane.at(DVec3::new(1.2, 1.7, 1.0))), (6, 3));
        let fourth = DVec3::new(1.0, 1.0, 1.0);
        plane.divide_cells(|corner, _| if (corner - fourth).length() < 1e-9 { 2 } else { 1 });
        assert_eq!(plane.count(), 9);
        for number in 0..9 {
            let Area { corner, edges: [u, v] } = plane.area(number);
            for (along_u, along_v) in [(0.01, 0.01), (0.5, 0.99), (0.99, 0.5)] {
                assert_eq!(plane.at(corner + u * along_u + v * along_v), number);
            }
            let beside: Vec<(u32, DVec3)> = plane.beside(number).collect();
            assert_eq!(beside.len(), if (3..7).contains(&number) { 4 } else { 0 });
            for (part, middle) in beside {
                assert_eq!(plane.at(middle), part);
                let Area { corner, edges: [u, v] } = plane.area(part);
                assert!((corner + 0.5 * (u + v) - middle).length() < 1e-12);
            }
        }
        // points beyond the edges belong to the nearest patch
        assert_eq!([DVec3::NEG_ONE, DVec3::splat(9.0)].map(|point| plane.at(point)), [0, 8]);
    }
}

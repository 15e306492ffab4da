//! Patches of the surfaces of a room: which one a point of a surface belongs to.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::planar::Polygon;
use crate::sampling::warp;
use crate::traceable::mesh_objects::TraceableMeshes;
use crate::traceable::{Side, SurfaceId, TraceableScene};

/// Length of an edge of a patch, as a share of the room's shortest edge, for a relative standard error of 2.5 %. It goes with the third
/// root of the error: the error of patches goes with about the square of their edges, and their number grows as fast.
const SHARE_OF_ROOM: f64 = 1.0 / 6.0;
const USUAL_ERROR: f64 = 0.025;
const SMALLEST: f64 = 0.3;

/// Patches of plane faces, at most: edges are longer where there would be more.
const MOST_OF_FACES: f64 = 16_384.0;

/// Divides the surfaces of a scene.
#[derive(Debug)]
pub struct Patches {
    /// By number of the surface.
    layouts: Vec<Layout>,
    planes: Vec<Plane>,
    /// Number of patches.
    pub count: usize,
}

/// Patches of one surface.
#[derive(Clone, Copy, Debug)]
enum Layout {
    /// It has none.
    None,
    /// All of it belongs to one patch.
    One(u32),
    /// It is divided as this plane is, whose patches begin at this number.
    Divided { plane: u32, first: u32 },
}

/// A rectangle that is divided evenly.
#[derive(Clone, Copy, Debug)]
struct Plane {
    corner: DVec3,
    /// Vectors whose product with the way from the corner is the number of the patch along an edge.
    along: [DVec3; 2],
    cells: [u32; 2],
}

impl Plane {
    /// The rectangle of these edges from a corner, in patches of about `edge` m.
    fn new(corner: DVec3, edges: [DVec3; 2], edge: f64) -> Self {
        let cells = edges.map(|side| (side.length() / edge).round().max(1.0) as u32);
        let along = |axis: usize| {
            let squared = edges[axis].length_squared();
            if squared > 0.0 { edges[axis] * (f64::from(cells[axis]) / squared) } else { DVec3::ZERO }
        };
        Self { corner, along: [along(0), along(1)], cells }
    }

    fn count(&self) -> u32 {
        self.cells[0] * self.cells[1]
    }

    #[inline]
    fn at(&self, point: DVec3) -> u32 {
        let away = point - self.corner;
        let cell = |axis: usize| (away.dot(self.along[axis]).max(0.0) as u32).min(self.cells[axis] - 1);
        cell(0) * self.cells[1] + cell(1)
    }
}

/// Key of the facets that share a patch: a piece of a mesh, a cell of space, a side, and what they reflect.
type Cluster = (u32, [i32; 3], u8, [u64; 3]);

impl Patches {
    /// Divides all surfaces that reflect diffusely, for a relative standard error `target`.
    pub fn new(scene: &TraceableScene, target: f64) -> Self {
        let rectangles: Vec<(SurfaceId, DVec3, [DVec3; 2])> = rectangles(scene).collect();
        let area: f64 = rectangles.iter().map(|(.., [u, v])| u.cross(*v).length()).sum();
        let fine = libm::cbrt(target / USUAL_ERROR).clamp(SMALLEST, 1.0);
        let edge = (fine * SHARE_OF_ROOM * scene.enclosure.shortest_edge_m()).max((area / MOST_OF_FACES).sqrt());
        let mut patches = Self { layouts: vec![Layout::None; scene.surfaces_count()], planes: Vec::new(), count: 0 };
        for (surface, corner, edges) in rectangles {
            let plane = Plane::new(corner, edges, edge);
            patches.divide(scene, [surface], plane);
        }
        if let Some(meshes) = &scene.meshes {
            patches.divide_facets(scene, meshes, edge);
        }
        patches
    }

    /// Divides surfaces that lie in one plane, each for itself.
    fn divide(&mut self, scene: &TraceableScene, surfaces: impl IntoIterator<Item = SurfaceId>, plane: Plane) {
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
                self.divide(scene, surfaces, Plane::new(corner, [u, v], edge));
                continue;
            }
            let middle = (corner + (u + v) * 0.5) / edge;
            let normal = meshes.facets.normals[facet];
            let axis =
                (0..3).fold(0, |axis, other| if normal[other].abs() > normal[axis].abs() { other } else { axis });
            let piece = meshes.pieces[meshes.facets.largest[facet] as usize];
            for (side, surface) in surfaces.into_iter().enumerate().filter(|(_, surface)| reflects(scene, *surface)) {
                let toward = 2 * axis + usize::from((normal[axis] < 0.0) != (side == 1));
                let reflectance = scene.optics(surface).map_or([0; 3], |optics| optics.reflectance.map(f64::to_bits));
                let cell = middle.floor().to_array().map(|coordinate| coordinate as i32);
                let next = self.count as u32;
                let patch = *clusters.entry((piece, cell, toward as u8, reflectance)).or_insert(next);
                self.count += usize::from(patch == next);
                self.layouts[surface.index()] = Layout::One(patch);
            }
        }
    }

    /// The patch of a point of a surface; `None` where nothing is reflected diffusely.
    #[inline]
    pub fn at(&self, surface: SurfaceId, point: DVec3) -> Option<usize> {
        match self.layouts[surface.index()] {
            Layout::None => None,
            Layout::One(patch) => Some(patch as usize),
            Layout::Divided { plane, first } => Some((first + self.planes[plane as usize].at(point)) as usize),
        }
    }
}

fn reflects(scene: &TraceableScene, surface: SurfaceId) -> bool {
    scene.optics(surface).is_some_and(|optics| optics.gathers())
}

/// The faces of the room, with rectangles around them, and of its boxes: a corner, and two edges.
fn rectangles(scene: &TraceableScene) -> impl Iterator<Item = (SurfaceId, DVec3, [DVec3; 2])> {
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
    scene.enclosure.polygons.iter().enumerate().map(of_face).chain((0..scene.boxes.len()).flat_map(of_box))
}

/// A rectangle around each facet, in its plane: a corner, and two edges.
fn extents(meshes: &TraceableMeshes) -> Vec<[DVec3; 3]> {
    let frame = |normal: DVec3| [DVec3::X, DVec3::Y].map(|axis| warp::around(normal, axis));
    let mut bounds = vec![[[f64::INFINITY, f64::NEG_INFINITY]; 2]; meshes.facets.normals.len()];
    for (corners, facet) in meshes.triangles.iter().zip(&meshes.facets.of_triangle) {
        let facet = *facet as usize;
        for (axis, [low, high]) in frame(meshes.facets.normals[facet]).into_iter().zip(&mut bounds[facet]) {
            for corner in corners {
                let along = axis.dot(meshes.positions[*corner as usize]);
                (*low, *high) = (low.min(along), high.max(along));
            }
        }
    }
    let rectangle = |(facet, [[left, right], [low, high]]): (usize, [[f64; 2]; 2])| {
        let normal = meshes.facets.normals[facet];
        let [u, v] = frame(normal);
        let height = normal.dot(meshes.point_of(facet));
        [u * left + v * low + normal * height, u * (right - left), v * (high - low)]
    };
    bounds.into_iter().enumerate().map(rectangle).collect()
}

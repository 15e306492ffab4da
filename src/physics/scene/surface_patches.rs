//! Patches of the faces of a room: cells of a lattice in each face, clipped at its outline and holes.

use glam::{DVec2, DVec3};

use super::enclosure::Enclosure;
use super::sensors::{Grid, Sensor};
use crate::geometry::covered::{Edge, enclosed_area, polygon};
use crate::geometry::planar::Polygon;

/// Number of patches of equal area that all faces would be divided into if none were clipped.
const WANTED: f64 = 1000.0;

/// Largest number of patches of a room.
pub const MOST_PATCHES: usize = 4000;

/// Fraction of a cell below which a piece is lost in rounding.
const LEAST_PIECE: f64 = 1e-9;

/// Fraction of a cell below which a patch has no sensor of its own.
const LEAST_PATCH: f64 = 1e-6;

/// Distance of the sensors from their face, as a fraction of the room's scale.
const BEFORE_FACE: f64 = 1e-6;

/// Patch of a face.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfacePatch {
    /// Number of the face in its enclosure.
    pub face: usize,
    /// Convex polygons in m that make up the patch, counter-clockwise seen from inside the room.
    pub pieces: Vec<Vec<DVec3>>,
    /// Area in m2.
    pub area_m2: f64,
    /// Centroid in m of the largest piece.
    pub centre: DVec3,
}

/// Divides the faces of a room into about 1000 patches, at most [`MOST_PATCHES`], ordered by the numbers of their faces. Every face has one
/// at least.
pub fn surface_patches(enclosure: &Enclosure) -> Vec<SurfacePatch> {
    let area: f64 = enclosure.faces().iter().map(|face| face.polygon.area_m2()).sum();
    let mut edge_m = (area / WANTED).sqrt();
    loop {
        let faces = enclosure.faces().iter().enumerate();
        let patches: Vec<_> = faces.flat_map(|(number, face)| divided(number, &face.polygon, edge_m)).collect();
        // faces with holes and slanted sides cut many cells
        if patches.len() <= MOST_PATCHES || edge_m > enclosure.scale_m() {
            return patches;
        }
        edge_m *= 1.5;
    }
}

/// Returns the grid of a sensor in front of each patch, which looks into the room.
pub fn grid_of_patches(name: String, enclosure: &Enclosure, patches: &[SurfacePatch]) -> Grid {
    let before = BEFORE_FACE * enclosure.scale_m();
    let sensor = |patch: &SurfacePatch| {
        let normal = enclosure.faces()[patch.face].polygon.normal();
        Sensor { position: patch.centre + before * normal, normal }
    };
    Grid::points(name, patches.iter().map(sensor).collect())
}

/// Divides a face into patches with edges of about `edge_m`.
fn divided(face: usize, polygon: &Polygon, edge_m: f64) -> Vec<SurfacePatch> {
    let [corner, u, v] = polygon.rectangle();
    let (along, up) = (u.normalize_or_zero(), v.normalize_or_zero());
    let extent = DVec2::new(u.length(), v.length());
    // a hair less, so that rounding adds no column
    let count = |length: f64| (length / edge_m * (1.0 - 1e-9)).ceil().max(1.0);
    let counts = DVec2::new(count(extent.x), count(extent.y));
    let cell = extent / counts;
    let [columns, rows] = counts.to_array().map(|count| count as usize);
    let flat = |point: DVec3| DVec2::new((point - corner).dot(along), (point - corner).dot(up));
    let edges: Vec<Edge> = polygon.sides().map(|side| side.map(flat)).collect();
    let mut cells: Vec<Vec<Vec<DVec2>>> = vec![Vec::new(); columns * rows];
    let lines = (0..=rows).map(|row| row as f64 * cell.y);
    for trapezoid in trapezoids(&edges, lines) {
        let (low, high) = trapezoid
            .iter()
            .fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), corner| (low.min(*corner), high.max(*corner)));
        let number = |at: f64, size: f64, count: usize| ((at / size).max(0.0) as usize).min(count - 1);
        let row = number(0.5 * (low.y + high.y), cell.y, rows);
        for column in number(low.x, cell.x, columns)..=number(high.x, cell.x, columns) {
            let from = column as f64 * cell.x;
            let piece = left_of(&right_of(&trapezoid, from), from + cell.x);
            if enclosed_area(&self::polygon(&piece)) > LEAST_PIECE * cell.element_product() {
                cells[row * columns + column].push(piece);
            }
        }
    }
    let in_space = |point: &DVec2| corner + point.x * along + point.y * up;
    let patch = |pieces: Vec<Vec<DVec2>>| {
        let area = |piece: &Vec<DVec2>| enclosed_area(&self::polygon(piece));
        let area_m2: f64 = pieces.iter().map(area).sum();
        let largest = pieces.iter().max_by(|a, b| area(a).total_cmp(&area(b)))?;
        let centre = in_space(&centroid(largest));
        let pieces = pieces.iter().map(|piece| piece.iter().map(in_space).collect()).collect();
        Some(SurfacePatch { face, pieces, area_m2, centre })
    };
    let patches = cells.into_iter().filter_map(patch);
    patches.filter(|patch| patch.area_m2 > LEAST_PATCH * cell.element_product()).collect()
}

/// Splits a figure (inside by the even-odd rule) into trapezoids between levels: those of its corners, and the given ones.
fn trapezoids(edges: &[Edge], levels: impl Iterator<Item = f64>) -> Vec<[DVec2; 4]> {
    let mut levels: Vec<f64> = levels.chain(edges.iter().map(|[from, _]| from.y)).collect();
    levels.sort_by(f64::total_cmp);
    let at = |[a, b]: &Edge, y: f64| a.x + (y - a.y) / (b.y - a.y) * (b.x - a.x);
    let bands = levels.windows(2).map(|band| [band[0], band[1]]);
    bands
        .flat_map(|[low, high]| {
            let middle = 0.5 * (low + high);
            let mut crossed: Vec<&Edge> = edges.iter().filter(|[a, b]| (a.y > middle) != (b.y > middle)).collect();
            crossed.sort_by(|a, b| at(a, middle).total_cmp(&at(b, middle)));
            let pairs = crossed.chunks_exact(2).map(|pair| {
                let [left, right] = [pair[0], pair[1]].map(|edge| [at(edge, low), at(edge, high)]);
                [(left[0], low), (right[0], low), (right[1], high), (left[1], high)].map(DVec2::from)
            });
            pairs.collect::<Vec<_>>()
        })
        .collect()
}

/// Returns the part of a convex polygon with x >= `from`.
fn right_of(corners: &[DVec2], from: f64) -> Vec<DVec2> {
    let next = corners.iter().cycle().skip(1);
    let kept = corners.iter().zip(next).flat_map(|(a, b)| {
        let crossing = ((a.x < from) != (b.x < from)).then(|| a.lerp(*b, (from - a.x) / (b.x - a.x)));
        [(a.x >= from).then_some(*a), crossing]
    });
    kept.flatten().collect()
}

/// Returns the part of a convex polygon with x <= `to`.
fn left_of(corners: &[DVec2], to: f64) -> Vec<DVec2> {
    // half a turn keeps the sense of the corners
    let turned: Vec<DVec2> = corners.iter().map(|corner| -*corner).collect();
    right_of(&turned, -to).into_iter().map(|corner| -corner).collect()
}

/// Returns the centroid of a convex polygon with area.
fn centroid(corners: &[DVec2]) -> DVec2 {
    let first = corners[0];
    let triangles = corners.windows(2).skip(1).map(|pair| {
        let twice = (pair[0] - first).perp_dot(pair[1] - first);
        (twice, twice * (pair[0] + pair[1] - 2.0 * first) / 3.0)
    });
    let (twice, moment) = triangles.fold((0.0, DVec2::ZERO), |sum, of| (sum.0 + of.0, sum.1 + of.1));
    first + moment / twice
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patches_cover_a_box() {
        let patches = surface_patches(&Enclosure::cuboid(DVec3::new(4.0, 5.0, 3.0), [None; 6]));
        let area: f64 = patches.iter().map(|patch| patch.area_m2).sum();
        assert!((area - 94.0).abs() < 1e-9 && (1000..1200).contains(&patches.len()), "{area} {}", patches.len());
    }

    /// A sloped square with a hole: the areas add up, centres lie in the face, and pieces face the normal.
    #[test]
    fn patches_cover_a_face_with_a_hole() {
        let at = |x: f64, y: f64| DVec3::new(x, y, 1.0 + 0.75 * y);
        let outline = vec![at(0.0, 0.0), at(4.0, 0.0), at(4.0, 1.5), at(2.0, 4.0), at(0.0, 4.0)];
        let hole = vec![at(0.5, 0.6), at(0.7, 1.9), at(1.8, 1.2)];
        let face = Polygon::new(vec![outline, hole]).unwrap();
        for edge_m in [0.2, 0.37, 10.0] {
            let patches = divided(3, &face, edge_m);
            let area: f64 = patches.iter().map(|patch| patch.area_m2).sum();
            assert!((area - face.area_m2()).abs() < 1e-9, "{area} instead of {}", face.area_m2());
            for patch in &patches {
                assert!(patch.face == 3 && face.height(patch.centre).abs() < 1e-12 && face.contains(patch.centre));
                let of_pieces: f64 = patch
                    .pieces
                    .iter()
                    .map(|piece| Polygon::with_normal(vec![piece.clone()], face.normal()).area_m2())
                    .sum();
                assert!((of_pieces - patch.area_m2).abs() < 1e-9);
            }
            let longest = 2.0f64.sqrt() * edge_m + 1e-9;
            let corners = |patch: &SurfacePatch| patch.pieces.concat();
            assert!(patches.iter().all(|patch| {
                corners(patch).iter().all(|a| corners(patch).iter().all(|b| a.distance(*b) <= longest || edge_m > 1.0))
            }));
        }
    }
}

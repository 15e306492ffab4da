//! Search for the inner sides of a mesh pipe's triangles, however they are wound.

use glam::DVec3;

use crate::geometry::bvh::TriangleBvh;
use crate::geometry::welded::TriangleSide;

/// Number of rays from the opening that search for parts of the pipe (`RAYS`), and largest number of reflections of each.
const RAYS: u32 = 64;
const REFLECTIONS: u32 = 64;

/// Returns a sign for each triangle: 1 if the normal points into the pipe, -1 if it points out of it, 0 for triangles that are no mirrors,
/// and for parts that no ray from the opening reaches.
///
/// Light that is reflected up the pipe from the centre of the opening (the origin) meets inner sides only, and neighbours of a triangle
/// have consistent inner sides. `sides` are those of the mirrors among the triangles of `bvh`.
pub(super) fn inward(sides: &[TriangleSide], is_mirror: impl Fn(usize) -> bool, bvh: &TriangleBvh) -> Vec<i8> {
    let mut neighbours = vec![[None; 3]; bvh.len()];
    for edge in sides.chunk_by(|a, b| a.edge == b.edge) {
        let [a, b] = edge else { continue };
        // neighbours of one winding run along their edge in opposite senses
        let turned = a.forward == b.forward;
        for (one, other) in [(a, b), (b, a)] {
            neighbours[one.triangle as usize][usize::from(one.side)] =
                Some(Neighbour { triangle: other.triangle, turned });
        }
    }
    let mut signs = vec![0; bvh.len()];
    for ray in 0..RAYS {
        // even over the projected hemisphere, each a golden angle on
        let fraction = (f64::from(ray) + 0.5) / f64::from(RAYS);
        let (sin, cos) = libm::sincos(2.399_963_229_728_653 * f64::from(ray));
        let mut direction = DVec3::new(fraction.sqrt() * cos, fraction.sqrt() * sin, (1.0 - fraction).sqrt());
        let (mut position, mut left) = (DVec3::ZERO, None);
        for _ in 0..REFLECTIONS {
            let Some(hit) = bvh.nearest(position, direction, left) else { break };
            let triangle = hit.triangle as usize;
            if !is_mirror(triangle) {
                break;
            }
            let normal = bvh.normal(&hit);
            let cosine = direction.dot(normal);
            if signs[triangle] == 0 && cosine != 0.0 {
                spread(triangle, if cosine < 0.0 { 1 } else { -1 }, &neighbours, &mut signs);
            }
            position += direction * hit.distance;
            direction = (direction - normal * (2.0 * cosine)).normalize();
            left = Some(hit.triangle);
            if direction.z < 0.0 && position.z <= 0.0 {
                break;
            }
        }
    }
    signs
}

/// Triangle on the other side of an edge that exactly two triangles share.
#[derive(Clone, Copy, Debug)]
struct Neighbour {
    triangle: u32,
    /// True if its winding is opposite to the triangle's.
    turned: bool,
}

/// Sets the sign of a triangle, and of all triangles connected to it through edges that two triangles share.
fn spread(first: usize, sign: i8, neighbours: &[[Option<Neighbour>; 3]], signs: &mut [i8]) {
    signs[first] = sign;
    let mut waiting = vec![first];
    while let Some(triangle) = waiting.pop() {
        for other in neighbours[triangle].iter().flatten() {
            let next = other.triangle as usize;
            if signs[next] == 0 {
                signs[next] = if other.turned { -signs[triangle] } else { signs[triangle] };
                waiting.push(next);
            }
        }
    }
}

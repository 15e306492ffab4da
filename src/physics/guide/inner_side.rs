//! Which side of a mesh pipe's triangles is the inner one, however they are wound.

use glam::DVec3;

use crate::geometry::bvh::TriangleBvh;
use crate::geometry::welded::Side;

/// Rays from the opening that look for pieces of the pipe, and reflections that each of them may have.
const RAYS: u32 = 64;
const REFLECTIONS: u32 = 64;

/// Signs by triangle: 1 where the normal points into the pipe, -1 where it points out of it, 0 for triangles that are no
/// mirrors, and for pieces of which no light from the opening tells.
///
/// Light that is reflected up the pipe from the centre of the opening (the origin) meets inner sides only; what it tells of
/// one triangle holds for its neighbours. `sides`: of the mirrors among the triangles of `bvh`.
pub(super) fn inward(sides: &[Side], is_mirror: impl Fn(usize) -> bool, bvh: &TriangleBvh) -> Vec<i8> {
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
        let share = (f64::from(ray) + 0.5) / f64::from(RAYS);
        let (sin, cos) = libm::sincos(2.399_963_229_728_653 * f64::from(ray));
        let mut direction = DVec3::new(share.sqrt() * cos, share.sqrt() * sin, (1.0 - share).sqrt());
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

/// A triangle beyond an edge that two triangles share.
#[derive(Clone, Copy, Debug)]
struct Neighbour {
    triangle: u32,
    /// True if it is wound the other way.
    turned: bool,
}

/// Gives a triangle its sign, and all that are joined to it by edges of two triangles each.
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

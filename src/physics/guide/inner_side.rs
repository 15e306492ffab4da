//! Which side of a mesh pipe's triangles is the inner one, however they are wound.

use std::collections::HashMap;

use glam::DVec3;

use crate::geometry::bvh::TriangleBvh;

/// Rays from the opening that look for pieces of the pipe, and reflections that each of them may have.
const RAYS: u32 = 64;
const REFLECTIONS: u32 = 64;

/// An edge of a triangle, the same from either side.
type Edge = ([u64; 3], [u64; 3]);

/// Signs by triangle: 1 where the normal points into the pipe, -1 where it points out of it, 0 for triangles that are no
/// mirrors, and for pieces of which no light from the opening tells.
///
/// Light that is reflected up the pipe from the centre of the opening (the origin) meets inner sides only; what it tells of
/// one triangle holds for its neighbours. `normals`: unit, by the winding of `triangles`, which `bvh` was built from.
pub(super) fn inward(
    triangles: &[[DVec3; 3]],
    normals: &[DVec3],
    is_mirror: impl Fn(usize) -> bool,
    bvh: &TriangleBvh,
) -> Vec<f64> {
    let mut sharing: HashMap<Edge, Vec<usize>> = HashMap::new();
    for triangle in (0..triangles.len()).filter(|triangle| is_mirror(*triangle)) {
        for (edge, _) in edges(&triangles[triangle]) {
            sharing.entry(edge).or_default().push(triangle);
        }
    }
    let mut signs = vec![0.0; triangles.len()];
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
            let cosine = direction.dot(normals[triangle]);
            if signs[triangle] == 0.0 && cosine != 0.0 {
                spread(triangle, -cosine.signum(), triangles, &sharing, &mut signs);
            }
            position += direction * hit.distance;
            direction = (direction - normals[triangle] * (2.0 * cosine)).normalize();
            left = Some(hit.triangle);
            if direction.z < 0.0 && position.z <= 0.0 {
                break;
            }
        }
    }
    signs
}

/// Gives a triangle its sign, and all that are joined to it by edges of two triangles each.
fn spread(first: usize, sign: f64, triangles: &[[DVec3; 3]], sharing: &HashMap<Edge, Vec<usize>>, signs: &mut [f64]) {
    signs[first] = sign;
    let mut waiting = vec![first];
    while let Some(triangle) = waiting.pop() {
        for (edge, forward) in edges(&triangles[triangle]) {
            let Some([a, b]) = sharing.get(&edge).map(Vec::as_slice) else { continue };
            let other = if *a == triangle { *b } else { *a };
            if signs[other] != 0.0 {
                continue;
            }
            // neighbours of one winding run along their edge in opposite senses
            let same_sense = edges(&triangles[other]).contains(&(edge, forward));
            signs[other] = if same_sense { -signs[triangle] } else { signs[triangle] };
            waiting.push(other);
        }
    }
}

/// The edges of a triangle, and whether it runs along each from the lesser end to the greater.
fn edges(corners: &[DVec3; 3]) -> [(Edge, bool); 3] {
    // -0 and 0 are one place
    let name = |p: DVec3| (p + DVec3::ZERO).to_array().map(f64::to_bits);
    std::array::from_fn(|k| {
        let (a, b) = (name(corners[k]), name(corners[(k + 1) % 3]));
        ((a.min(b), a.max(b)), a < b)
    })
}

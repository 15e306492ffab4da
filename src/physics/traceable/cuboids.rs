//! Parts of meshes that are upright cuboids: boards, legs and cabinets are traced as boxes.
//!
//! A part is made of triangles that are joined edge by edge, and closed: an even number of them meets at each edge. It is a cuboid if
//! every triangle lies on a face of the smallest upright block around them, and these together cover each face once. A closed surface
//! covers all points of that block's surface either an odd number of times or an even one: so it is enough that the areas add up to those
//! of the faces, and that one point is covered once. What is so recognised is the same body; its shadows are known without
//! rays, and rays meet it sooner.

use std::borrow::Cow;
use std::collections::HashMap;

use glam::{DVec2, DVec3};

use crate::geometry::facets::pieces;
use crate::geometry::welded::{Side, sides};
use crate::geometry::{TriangleMesh, turn};
use crate::optics::Surface;
use crate::scene::{BoxObject, Luminaire, MeshObject, Scene};
use crate::traceable::box_object::TraceableBox;

/// Share of the room's diagonal within which corners are one, and lie on a face.
const TOLERANCE: f64 = 1e-9;

/// Share by which the areas of a face's triangles may differ from its own.
const AREA_TOLERANCE: f64 = 1e-7;

/// Most boxes of a scene up to which those of meshes are among them: rays go through a tree of triangles, and ask boxes one by one.
const MOST: usize = 64;

/// Most triangles at an edge of a cuboid, those of others that touch it there among them.
const MOST_AT_EDGE: usize = 32;

/// Fewest triangles of a cuboid.
const FEWEST: usize = 12;

/// Where it is asked how often a face is covered, in shares of its edges; on no line of a net.
const ASKED: DVec2 = DVec2::new(0.417_131_9, 0.583_647_3);

/// The boxes of a scene and those that parts of its meshes are, and what is left of the meshes.
pub fn boxes_and_meshes(scene: &Scene) -> (Cow<'_, [BoxObject]>, Cow<'_, [MeshObject]>) {
    let room = &scene.room;
    let as_they_are = (Cow::Borrowed(&room.boxes[..]), Cow::Borrowed(&room.meshes[..]));
    let near = TOLERANCE * room.size.length();
    let found: Vec<Found> = room.meshes.iter().map(|object| Found::of(object, near)).collect();
    let cuboids = || found.iter().flat_map(|found| &found.cuboids).copied();
    let count = cuboids().count();
    // from inside, a box is not seen, and what it holds is dark
    let has_inside = |cuboid: BoxObject| {
        let eyes = scene.views.iter().map(|view| view.eye);
        let openings = scene.tubes.iter().map(|tube| (tube.centre.extend(room.size.z), tube.opening_radius));
        let mut all = eyes.map(|point| (point, 0.0)).chain(openings);
        all.any(|(point, around)| holds(&cuboid, point, around + near))
            || room.luminaires.iter().any(|luminaire| may_meet(&cuboid, luminaire, near))
    };
    if count == 0 || room.boxes.len() + count > MOST || cuboids().any(has_inside) {
        return as_they_are;
    }
    let boxes = room.boxes.iter().copied().chain(cuboids()).collect();
    let rest = |(object, found): (&MeshObject, &Found)| {
        let mesh = of_triangles(&object.mesh, &found.rest);
        (!found.rest.is_empty()).then(|| MeshObject { mesh, surfaces: object.surfaces.clone() })
    };
    (Cow::Owned(boxes), Cow::Owned(room.meshes.iter().zip(&found).filter_map(rest).collect()))
}

/// True if a point is in a box, or within `around` m of it.
fn holds(cuboid: &BoxObject, point: DVec3, around: f64) -> bool {
    let away = point - cuboid.base;
    let across = turn::rotation(cuboid.rotation) * away.truncate();
    let beside = (across.abs() - 0.5 * cuboid.size.truncate()).extend((-away.z).max(away.z - cuboid.size.z));
    beside.max(DVec3::ZERO).length() <= around
}

/// False if a luminaire is farther than `near` m from a box, by the blocks along the room's axes around both.
fn may_meet(cuboid: &BoxObject, luminaire: &Luminaire, near: f64) -> bool {
    let Luminaire { corner, edge_u, edge_v, .. } = *luminaire;
    let [low, high] = TraceableBox::new(cuboid).bounds();
    let far = edge_u.max(DVec3::ZERO) + edge_v.max(DVec3::ZERO);
    let [from, to] = [corner + edge_u.min(DVec3::ZERO) + edge_v.min(DVec3::ZERO), corner + far];
    (low - near).cmple(to).all() && from.cmple(high + near).all()
}

/// Some triangles of a mesh, by their numbers.
fn of_triangles(mesh: &TriangleMesh, numbers: &[u32]) -> TriangleMesh {
    let mut of_corner = vec![u32::MAX; mesh.positions.len()];
    let mut positions = Vec::new();
    let mut corner = |corner: u32| {
        let number = &mut of_corner[corner as usize];
        if *number == u32::MAX {
            *number = positions.len() as u32;
            positions.push(mesh.positions[corner as usize]);
        }
        *number
    };
    let triangles = numbers.iter().map(|number| mesh.triangles[*number as usize].map(&mut corner)).collect();
    TriangleMesh {
        triangles,
        positions,
        triangle_materials: numbers.iter().map(|number| mesh.triangle_materials[*number as usize]).collect(),
        back_materials: match &mesh.back_materials[..] {
            [] => Vec::new(),
            backs => numbers.iter().map(|number| backs[*number as usize]).collect(),
        },
        materials: mesh.materials.clone(),
        dropped: mesh.dropped,
    }
}

/// Triangles that are joined edge by edge.
#[derive(Default)]
struct Part {
    triangles: Vec<u32>,
    /// An odd number of them share an edge.
    is_open: bool,
}

/// What a mesh is made of.
struct Found {
    cuboids: Vec<BoxObject>,
    /// Numbers of the triangles of all other parts.
    rest: Vec<u32>,
}

impl Found {
    /// `near`: distance in m within which corners are one.
    fn of(object: &MeshObject, near: f64) -> Self {
        let mesh = &object.mesh;
        let corners = welded(&mesh.positions, near);
        let numbered = mesh.triangles.iter().map(|triangle| triangle.map(|corner| corners[corner as usize]));
        let numbered = (0..mesh.triangles.len() as u32).zip(numbered);
        // triangles are joined where two of them alone share an edge; where boards touch, more may
        let sides = sides(numbered);
        let edges = || sides.chunk_by(|a, b| a.edge == b.edge);
        let alone = (0..mesh.triangles.len() as u32).map(|triangle| [triangle; 3]);
        let pair = |edge: &[Side]| match edge {
            [a, b] => Some([a.triangle, b.triangle, b.triangle]),
            _ => None,
        };
        let joined = pieces(mesh.triangles.len(), &alone.chain(edges().filter_map(pair)).collect::<Vec<_>>());
        let part = |triangle: u32| joined[triangle as usize] as usize;
        let mut parts: Vec<Part> = Vec::new();
        for triangle in 0..mesh.triangles.len() as u32 {
            parts.resize_with(parts.len().max(part(triangle) + 1), Part::default);
            parts[part(triangle)].triangles.push(triangle);
        }
        for edge in edges() {
            let is_open = |of: usize| {
                let of_part = || edge.iter().filter(|side| part(side.triangle) == of);
                // no board is joined by so many: they are not counted, whatever their number
                edge.len() > MOST_AT_EDGE || of_part().count() % 2 == 1
            };
            for side in edge {
                parts[part(side.triangle)].is_open |= is_open(part(side.triangle));
            }
        }
        let mut found = Self { cuboids: Vec::new(), rest: Vec::new() };
        for Part { triangles, is_open } in parts {
            let may_be = !is_open && triangles.len() >= FEWEST;
            match Some(()).filter(|()| may_be).and_then(|()| cuboid(object, &triangles, near)) {
                Some(cuboid) => found.cuboids.push(cuboid),
                None => found.rest.extend(triangles),
            }
        }
        found.rest.sort_unstable();
        found
    }
}

/// A number for each position, the same for those that are one within rounding.
fn welded(positions: &[DVec3], near: f64) -> Vec<u32> {
    let mut known: HashMap<[i64; 3], u32> = HashMap::with_capacity(positions.len());
    let mut place = |position: &DVec3| {
        let next = known.len() as u32;
        *known.entry((*position / near).to_array().map(|number| number.round() as i64)).or_insert(next)
    };
    positions.iter().map(&mut place).collect()
}

/// The box that a closed part of a mesh is, if so.
fn cuboid(object: &MeshObject, triangles: &[u32], near: f64) -> Option<BoxObject> {
    let MeshObject { mesh, surfaces } = object;
    // of front and back, that which faces away from the middle
    let middle =
        triangles.iter().flat_map(|triangle| corners(mesh, *triangle)).sum::<DVec3>() / (3 * triangles.len()) as f64;
    let surface_of = |triangle: u32| {
        let [a, b, c] = corners(mesh, triangle);
        let faces_inward = (b - a).cross(c - a).dot(a - middle) < 0.0;
        surfaces.get(mesh.sides(triangle as usize)[usize::from(faces_inward)] as usize)
    };
    let surface: Surface = *surface_of(triangles[0])?;
    if triangles.iter().any(|triangle| surface_of(*triangle) != Some(&surface)) {
        return None;
    }
    let along = triangles.iter().find_map(|triangle| standing_normal(corners(mesh, *triangle)))?;
    // into the frame of the block and back
    let inward = |position: DVec3| {
        let across = position.truncate();
        DVec3::new(across.dot(along), along.perp_dot(across), position.z)
    };
    let local = |triangle: u32| corners(mesh, triangle).map(inward);
    let all = || triangles.iter().flat_map(|triangle| local(*triangle));
    let (low, high) = (all().reduce(DVec3::min)?, all().reduce(DVec3::max)?);
    let size = high - low;
    if size.min_element() <= 4.0 * near {
        return None;
    }
    let mut areas = [0.0; 6];
    let mut covered = 0;
    for triangle in triangles {
        let corners = local(*triangle);
        let on = |face: &usize| {
            let level = [low, high][face % 2][face / 2];
            corners.iter().all(|corner| (corner[face / 2] - level).abs() <= near)
        };
        let face = (0..6).find(on)?;
        let axis = face / 2;
        let flat = corners.map(|corner| {
            let share = (corner - low) / size;
            DVec2::new(share[(axis + 1) % 3], share[(axis + 2) % 3])
        });
        let [a, b, c] = flat;
        areas[face] += 0.5 * (b - a).perp_dot(c - a).abs();
        covered += usize::from(face == 5 && is_within(ASKED, flat));
    }
    if covered != 1 || areas.iter().any(|area| (area - 1.0).abs() > AREA_TOLERANCE) {
        return None;
    }
    let middle = 0.5 * (low + high).truncate();
    let base = (along * middle.x + along.perp() * middle.y).extend(low.z);
    Some(BoxObject { size, base, rotation: turn::angle_between(along, DVec2::X), surface })
}

fn corners(mesh: &TriangleMesh, triangle: u32) -> [DVec3; 3] {
    mesh.triangles[triangle as usize].map(|corner| mesh.positions[corner as usize])
}

/// The horizontal unit normal of an upright triangle, to the east or, of two at right angles, the one that is nearer to it; `None` where it
/// lies or leans.
fn standing_normal([a, b, c]: [DVec3; 3]) -> Option<DVec2> {
    let normal = (b - a).cross(c - a).try_normalize()?;
    if normal.z.abs() > LEANING {
        return None;
    }
    let normal = normal.truncate().normalize();
    let turned = if normal.x.abs() < normal.y.abs() { normal.perp() } else { normal };
    // exactly along the axes where it is so but for rounding
    let turned = if turned.y.abs() < TOLERANCE { DVec2::X } else { turned };
    Some(if turned.x < 0.0 { -turned } else { turned })
}

/// Sine of the angle below which a side stands.
const LEANING: f64 = 1e-6;

/// True if a point lies within a triangle, or on its edge.
fn is_within(point: DVec2, [a, b, c]: [DVec2; 3]) -> bool {
    let sides = [(a, b), (b, c), (c, a)].map(|(from, to)| (to - from).perp_dot(point - from));
    sides.iter().all(|side| *side >= 0.0) || sides.iter().all(|side| *side <= 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::{Key, PathRandom, warp};
    use crate::scene::{Channels, Room, View};
    use crate::traceable::mesh_objects::TraceableMeshes;
    use crate::traceable::{Follow, TraceableScene};

    const SIZE: DVec3 = DVec3::new(4.0, 3.0, 2.5);

    /// Cuboids from a corner, by their sizes, their faces nets of squares with corners of their own; `turn` about a vertical axis.
    fn boards(boards: &[[[f64; 3]; 2]], net: u32, turn: f64) -> MeshObject {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for [corner, size] in boards.iter().map(|board| board.map(DVec3::from_array)) {
            for (axis, far) in (0..6).map(|face| (face / 2, face % 2 == 1)) {
                let edge = |k: usize| DVec3::AXES[(axis + k) % 3] * size;
                let origin = corner + if far { edge(0) } else { DVec3::ZERO };
                let first = positions.len() as u32;
                let share = |k: u32| f64::from(k) / f64::from(net);
                let places = (0..=net).flat_map(|i| (0..=net).map(move |j| (i, j)));
                let place = |(i, j): (u32, u32)| {
                    let place = origin + edge(1) * share(i) + edge(2) * share(j);
                    (turn::unit_vector(turn).rotate(place.truncate()) + DVec2::new(2.0, 1.5)).extend(place.z)
                };
                positions.extend(places.map(place));
                for (i, j) in (0..net).flat_map(|i| (0..net).map(move |j| (i, j))) {
                    let at = |i: u32, j: u32| first + i * (net + 1) + j;
                    triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
                    triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
                }
            }
        }
        let mesh = TriangleMesh {
            triangle_materials: vec![0; triangles.len()],
            positions,
            triangles,
            materials: vec![String::new(); 2],
            ..TriangleMesh::default()
        };
        MeshObject { mesh, surfaces: [0.3, 0.4].map(|reflectance| Surface::diffuse([reflectance; 3])).to_vec() }
    }

    /// A table that touches itself along edges and faces: a board over four legs, and one that stands on it.
    const TABLE: [[[f64; 3]; 2]; 6] = [
        [[0.0, 0.0, 0.0], [0.05, 0.05, 0.6]],
        [[0.75, 0.0, 0.0], [0.05, 0.05, 0.6]],
        [[0.0, 0.45, 0.0], [0.05, 0.05, 0.6]],
        [[0.75, 0.45, 0.0], [0.05, 0.05, 0.6]],
        [[0.0, 0.0, 0.6], [0.8, 0.5, 0.03]],
        [[0.0, 0.47, 0.63], [0.8, 0.03, 0.4]],
    ];

    fn scene(meshes: Vec<MeshObject>) -> Scene {
        let surfaces = [Some(Surface::diffuse([0.5; 3])); 6];
        let room = Room { size: SIZE, surfaces, boxes: Vec::new(), meshes, luminaires: Vec::new() };
        Scene {
            daylight: None,
            room,
            tubes: Vec::new(),
            grids: Vec::new(),
            views: Vec::new(),
            channels: Channels::Photopic,
        }
    }

    /// Rays meet boxes where they meet the triangles of the mesh, from the same side; no triangle is left.
    #[test]
    fn boards_are_boxes_of_the_same_shape() {
        let follow = Follow { interreflection: true, guide_return: true, objects: true };
        for (net, turned) in [(1, 0.0), (5, 0.0), (3, 0.7), (4, 2.5), (1, -1.9)] {
            let object = boards(&TABLE, net, turned);
            let (triangles, _) = TraceableMeshes::new(std::slice::from_ref(&object), SIZE).unwrap();
            let scene = TraceableScene::new(&scene(vec![object]), follow).unwrap();
            assert_eq!((scene.boxes.len(), scene.meshes.is_some()), (6, false), "{net} {turned}");
            let mut random = PathRandom::new(Key::new(5));
            let (mut met, mut passed) = (0, 0);
            while met < 500 || passed < 500 {
                let [u, v] = random.uniform2();
                let origin = SIZE * DVec3::new(u, v, random.uniform());
                if scene.is_in_box(origin) {
                    continue;
                }
                let direction = warp::cone(random.uniform2(), std::f64::consts::PI);
                let hit = scene.intersect(origin, direction, None);
                match triangles.intersect(origin, direction) {
                    Some(truth) => {
                        met += 1;
                        assert!((hit.position - truth.position).length() < 1e-8, "{net} {turned}: {hit:?} {truth:?}");
                        assert!((hit.normal - truth.normal).length() < 1e-8, "{net} {turned}: {hit:?} {truth:?}");
                    }
                    None => {
                        passed += 1;
                        assert!(hit.position.cmpeq(DVec3::ZERO).any() || hit.position.cmpeq(SIZE).any());
                    }
                }
            }
        }
    }

    /// What is no cuboid, or not of one surface, stays as it is, and what stands beside it in the same mesh is found all the same.
    #[test]
    fn other_parts_stay_meshes() {
        let count = |object: &MeshObject| {
            let scene = scene(vec![object.clone()]);
            let (boxes, meshes) = boxes_and_meshes(&scene);
            (boxes.len(), meshes.iter().map(|object| object.mesh.triangles.len()).sum::<usize>())
        };
        let two = || boards(&[TABLE[0], TABLE[1]], 2, 0.3);
        assert_eq!(count(&two()), (2, 0));
        // a hole
        let mut object = two();
        object.mesh.triangles.remove(17);
        object.mesh.triangle_materials.remove(17);
        assert_eq!(count(&object), (1, 47));
        // a triangle of another surface, and of another material of the same surface
        let mut object = two();
        object.mesh.triangle_materials[50] = 1;
        assert_eq!(count(&object), (1, 48));
        object.surfaces[1] = object.surfaces[0];
        assert_eq!(count(&object), (2, 0));
        // a dent in a face, and a corner that is drawn out
        for (corner, by) in [([1, 1, 1], DVec3::new(0.001, 0.0, 0.0)), ([0, 0, 0], DVec3::new(-0.01, 0.0, 0.0))] {
            let mut object = boards(&[TABLE[0]], 2, 0.0);
            let shares = DVec3::from_array(corner.map(|half| 0.5 * f64::from(half)));
            let place = DVec3::new(2.0, 1.5, 0.0) + DVec3::new(0.0, 0.05, 0.6) * shares;
            let moved = object.mesh.positions.iter_mut().filter(|position| (**position - place).length() < 1e-9);
            assert!(moved.map(|position| *position += by).count() > 0);
            assert_eq!(count(&object), (0, 48), "{by}");
        }
        // leaning
        let mut object = two();
        object.mesh.positions.iter_mut().for_each(|position| position.x += 0.001 * position.z);
        assert_eq!(count(&object), (0, 96));
        // two folded sheets: as large as a cuboid, and closed, but open to the sky
        let mut object = boards(&[TABLE[4]], 1, 0.0);
        let faces: Vec<_> = object.mesh.triangles.chunks(2).map(<[_]>::to_vec).collect();
        object.mesh.triangles = [0, 0, 2, 2, 4, 4].map(|face: usize| faces[face].clone()).concat();
        assert_eq!(count(&object).0, 0);
    }

    /// Boxes are asked one by one: there may not be too many. A camera inside sees the sides from within.
    #[test]
    fn crowds_and_what_is_seen_from_inside_stay_meshes() {
        let many = |count: usize| {
            let at = |k: usize| [[0.1 * (k % 10) as f64, 0.1 * (k / 10) as f64, 0.0], [0.05; 3]];
            let scene = scene(vec![boards(&(0..count).map(at).collect::<Vec<_>>(), 1, 0.0)]);
            let (boxes, meshes) = boxes_and_meshes(&scene);
            (boxes.len(), meshes.len())
        };
        assert_eq!([many(MOST), many(MOST + 1)], [(MOST, 0), (0, 1)]);
        // of a board that many fins meet at an edge nobody asks how often it is closed
        let fins = |count: usize| {
            let mut object = boards(&[TABLE[4]], 1, 0.0);
            let [a, b, _] = object.mesh.triangles[0];
            object.mesh.positions.push(DVec3::splat(1.0));
            let tip = object.mesh.positions.len() as u32 - 1;
            object.mesh.triangles.extend(vec![[a, b, tip]; count]);
            object.mesh.triangle_materials.extend(vec![0; count]);
            boxes_and_meshes(&scene(vec![object])).0.len()
        };
        assert_eq!([fins(0), fins(4), fins(MOST_AT_EDGE)], [1, 1, 0]);
        let mut scene = scene(vec![boards(&[TABLE[4]], 1, 0.4)]);
        let inside = DVec3::new(2.2, 1.7, 0.61);
        for (eye, boxes) in [(inside, 0), (inside - DVec3::Z * 0.1, 1)] {
            scene.views =
                vec![View::new("view".into(), eye, DVec3::new(3.0, 2.0, 1.0), DVec3::Z, 1.0, [8, 8]).unwrap()];
            assert_eq!(boxes_and_meshes(&scene).0.len(), boxes);
        }
        // a luminaire that goes through it, and one beside
        scene.views.clear();
        for (height, boxes) in [(0.5, 0), (0.7, 1)] {
            let corner = DVec3::new(1.0, 1.0, height);
            let [edge_u, edge_v] = [DVec3::new(2.0, 0.0, 0.2), DVec3::new(0.0, 1.5, 0.0)];
            scene.room.luminaires = vec![Luminaire { corner, edge_u, edge_v, luminance: [100.0; 3] }];
            assert_eq!(boxes_and_meshes(&scene).0.len(), boxes, "{height}");
        }
    }
}

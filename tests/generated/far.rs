//! Triangles are found from anywhere: what the tree of boxes says is what every triangle says by itself, wherever the mesh
//! lies, however small it is beside its distance from the ray's origin.

use glam::DVec3;
use proptest::prelude::*;
use skyduct::geometry::bvh::TriangleBvh;
use skyduct::geometry::triangle::ShearedRay;

use crate::render::{cases, config};

/// A point whose coordinates are multiples of 2^-20, so that it can be moved by whole metres without rounding.
fn point() -> impl Strategy<Value = DVec3> {
    proptest::array::uniform3(0..=1i32 << 20).prop_map(|it| DVec3::from(it.map(f64::from)) / f64::from(1 << 20))
}

/// Triangles in the unit cube: large ones, or a plate of small ones side by side, whose boxes touch.
fn triangles() -> impl Strategy<Value = Vec<[DVec3; 3]>> {
    let soup = proptest::collection::vec(proptest::array::uniform3(point()), 1..24);
    let plate = (1..=6i32, point()).prop_map(|(cells, corner)| {
        let at = |x: i32, y: i32| {
            let height = if (x + y) % 2 == 0 { 0.0 } else { 0.25 * corner.z };
            DVec3::new(f64::from(x) / 8.0, f64::from(y) / 8.0, height)
        };
        let of = |k: i32| {
            let (x, y) = (k % cells, k / cells);
            let [a, b, c, d] = [at(x, y), at(x + 1, y), at(x + 1, y + 1), at(x, y + 1)];
            [[a, b, c], [a, c, d]]
        };
        (0..cells * cells).flat_map(of).collect()
    });
    prop_oneof![1 => soup, 1 => plate]
}

/// Number and distance of the nearest triangle, each asked by itself; among equals the first.
fn one_by_one(triangles: &[[DVec3; 3]], origin: DVec3, direction: DVec3) -> Option<(u32, f64)> {
    let ray = ShearedRay::new(origin, direction);
    let hits = triangles
        .iter()
        .enumerate()
        .filter_map(|(number, corners)| Some((number as u32, ray.intersect(corners.each_ref())?)));
    hits.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The same as the tree says it.
fn by_tree(tree: &TriangleBvh, origin: DVec3, direction: DVec3) -> Option<(u32, f64)> {
    tree.nearest(origin, direction, None).map(|hit| (hit.triangle, hit.distance))
}

proptest! {
    #![proptest_config(config(cases(2000)))]

    /// From a distance of up to a million sizes of the mesh.
    #[test]
    fn a_mesh_is_found_from_far_away(triangles in triangles(), target in point(), toward in point(), exponent in -2.0..6.0f64) {
        let direction = (toward - DVec3::splat(0.5)).try_normalize().unwrap_or(DVec3::Z);
        // aimed at a point of a triangle, at its edges, too
        let [a, b, c] = triangles[0];
        let share = target.x.min(1.0 - target.y);
        let aim = a + (b - a) * target.x.min(1.0) * 0.5 + (c - a) * share.max(0.0) * 0.5;
        let origin = aim - direction * 10f64.powf(exponent);
        let tree = TriangleBvh::new(&triangles);
        let expected = one_by_one(&triangles, origin, direction);
        prop_assert_eq!(by_tree(&tree, origin, direction), expected);
        let reach = expected.map_or(1e7, |(_, distance)| distance);
        prop_assert!(!tree.any_within(origin, direction, reach));
        prop_assert_eq!(tree.any_within(origin, direction, reach * (1.0 + 1e-12)), expected.is_some());
    }

    /// A mesh and a ray that are moved together by whole metres, up to a million, meet in the same place.
    #[test]
    fn a_mesh_far_from_the_origin_is_the_same(
        triangles in triangles(), origin in point(), toward in point(), by in proptest::array::uniform3(-1_000_000..=1_000_000i32),
    ) {
        let by = DVec3::from(by.map(f64::from));
        let direction = (toward - DVec3::splat(0.5)).try_normalize().unwrap_or(DVec3::Z);
        let moved: Vec<_> = triangles.iter().map(|corners| corners.map(|corner| corner + by)).collect();
        let [here, there] = [(&triangles, origin), (&moved, origin + by)]
            .map(|(triangles, origin)| by_tree(&TriangleBvh::new(triangles), origin, direction));
        prop_assert_eq!(here, there);
        prop_assert_eq!(here, one_by_one(&triangles, origin, direction));
    }
}

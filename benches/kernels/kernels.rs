//! The kernels in which jobs spend their time, on one thread. `benches/run` runs them; rates are items a second.

#![allow(clippy::unwrap_used, reason = "a failure ends the benchmark")]

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use divan::counter::ItemsCount;
use divan::{Bencher, black_box};
use glam::DVec3;
use skyduct::geometry::bvh::TriangleBvh;
use skyduct::geometry::disc::{disc_irradiance, far_disc_illuminance};
use skyduct::integrator::Integrator;
use skyduct::integrator::photon_map::grid::{Photon, PhotonGrid};
use skyduct::integrator::placed_vertices::PlacedVertices;
use skyduct::optics::Spectrum;
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::sky::sampler::{SkySampler, SkyTable};
use skyduct_benches::{corners, mesh, scene};

/// Items of one measured round, so that the clock costs nothing.
const ITEMS: usize = 1024;

fn main() {
    divan::main();
}

/// Rays that meet the pipe of S3 one reflection after the other: origins, directions, and the triangle they come from.
fn chains(tree: &TriangleBvh, corners: &[[DVec3; 3]]) -> Vec<(DVec3, DVec3, Option<u32>)> {
    let mut random = PathRandom::new(Key::new(1));
    let mut rays = Vec::new();
    while rays.len() < ITEMS {
        let mut origin = (0.126 * warp::disc(random.uniform2())).extend(1e-6);
        let mut direction = warp::cosine_hemisphere(random.uniform2());
        let mut from = None;
        for _ in 0..20 {
            rays.push((origin, direction, from));
            let Some(hit) = tree.nearest(origin, direction, from) else { break };
            let [a, b, c] = corners[hit.triangle as usize];
            origin += direction * hit.distance;
            direction = direction.reflect((b - a).cross(c - a).normalize());
            from = Some(hit.triangle);
        }
    }
    rays.truncate(ITEMS);
    rays
}

#[divan::bench]
fn nearest_triangle_along_specular_chains(bencher: Bencher) {
    let corners = corners(&mesh("S3_tube.obj"));
    let tree = TriangleBvh::new(&corners);
    let rays = chains(&tree, &corners);
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        for (origin, direction, from) in &rays {
            black_box(tree.nearest(*origin, *direction, *from));
        }
    });
}

#[divan::bench]
fn any_triangle_within_reach(bencher: Bencher) {
    let corners = corners(&mesh("S3_tube.obj"));
    let tree = TriangleBvh::new(&corners);
    let rays = chains(&tree, &corners);
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        for (origin, direction, _) in &rays {
            black_box(tree.any_within(*origin + *direction * 1e-6, *direction, 0.05));
        }
    });
}

#[divan::bench]
fn tree_of_30_000_triangles(bencher: Bencher) {
    let corners = corners(&mesh("S3_tube.obj"));
    bencher.bench_local(|| TriangleBvh::new(black_box(&corners)));
}

/// Offsets of receivers from the axis of a disc.
fn offsets() -> Vec<f64> {
    (0..ITEMS).map(|k| 0.002 * k as f64).collect()
}

#[divan::bench]
fn light_of_a_disc_anywhere(bencher: Bencher) {
    let offsets = offsets();
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        offsets.iter().map(|offset| disc_irradiance(0.127, black_box(2.032), *offset).vertical).sum::<f64>()
    });
}

#[divan::bench]
fn light_of_a_disc_far_away(bencher: Bencher) {
    let offsets = offsets();
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        offsets.iter().map(|offset| far_disc_illuminance(0.127, black_box(2.032), *offset, [1.0, 0.0])).sum::<f64>()
    });
}

/// Gathers within radii in metres: some 40, 150 and 600 photons of 100 000 on a floor of 2 x 2 m.
#[divan::bench(args = [0.02, 0.04, 0.08])]
fn gather_photons(bencher: Bencher, radius: f64) {
    let mut random = PathRandom::new(Key::new(2));
    let mut point = || DVec3::new(2.0 * random.uniform(), 2.0 * random.uniform(), 0.0);
    let photons: Vec<_> =
        (0..100_000).map(|_| Photon { position: point(), on: (), flux: Spectrum([1.0; 3]) }).collect();
    let grid = PhotonGrid::<3, ()>::new(&photons, radius);
    let centres: Vec<_> = (0..ITEMS).map(|_| point()).collect();
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        for centre in &centres {
            black_box(grid.gather(*centre, radius, ()));
        }
    });
}

#[divan::bench]
fn sample_the_sky(bencher: Bencher) {
    let sky = scene("S1").1.sky.unwrap();
    let sampler = SkySampler::new(&sky, |direction| direction.z).unwrap();
    let mut random = PathRandom::new(Key::new(3));
    let points: Vec<_> = (0..ITEMS).map(|_| random.uniform2()).collect();
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        for point in &points {
            black_box(sampler.sample(*point));
        }
    });
}

#[divan::bench]
fn table_of_the_sky(bencher: Bencher) {
    let sky = scene("S1").1.sky.unwrap();
    bencher.bench_local(|| SkyTable::new(black_box(&sky)));
}

/// Light from the sky's upper half down a straight pipe, two bends in closed form, and the same as a mesh.
#[divan::bench(args = ["S1", "S3", "S3_mesh"])]
fn walk_down_a_guide(bencher: Bencher, name: &str) {
    let (_, traceable) = scene(name);
    let guide = &traceable.tubes[0].guide;
    let mut random = PathRandom::new(Key::new(4));
    let mut entries = Vec::new();
    while entries.len() < ITEMS {
        let direction = -warp::cosine_hemisphere(random.uniform2());
        entries.extend(guide.entry(random.uniform2(), direction).map(|entry| (entry.position, direction)));
    }
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        for (position, direction) in &entries {
            black_box(guide.down::<1>(*position, *direction, &mut random));
        }
    });
}

/// A pass with nearly no photons: vertices on the room's surfaces, their light found backward, connected to 81 sensors.
#[divan::bench]
fn vertices_placed_in_the_room(bencher: Bencher) {
    let (scene, traceable) = scene("S1");
    let integrator = PlacedVertices::<1>::new(Arc::new(traceable), &scene.grids, [64, ITEMS as u64], 0);
    let mut pass = 0;
    bencher.counter(ItemsCount::new(ITEMS)).bench_local(|| {
        pass += 1;
        integrator.pass(pass, &AtomicBool::new(false))
    });
}

//! Meshes in other units, with coincident, missing, sliver and flipped triangles; rooms with gaps, of a centimetre and of ten
//! kilometres; numbers that JSON has and lengths have not.

use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde_json::{Value, json};
use skyduct::analytic::Solver;
use skyduct::analytic::holigilm::Holigilm;
use skyduct::document::{FieldErrorCode, JobDocument};
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::bvh::TriangleBvh;
use skyduct::geometry::lambert::quadrilateral_irradiance;
use skyduct::integrator::deterministic::installation;
use skyduct::optics::Surface;
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::scene::{EstimateKind, Face, Grid, Luminaire, MeshObject, Scene, Tube};
use skyduct::statistics::Moments;
use skyduct::traceable::Place;

use crate::given::{base, refused, with};
use crate::jobs::{Obj, cube, lux, prepared_with, rendered};
use crate::scenes::{SIDE, disc_room, electric_room, light_tracing, panel, run, traceable, values};

/// A block of 0.6 x 0.4 x 0.5 m, a 16-sided pipe of 0.2 m and 1 m with a diffuser, in the file's units per metre.
fn obj(per_metre: f64) -> String {
    let mut text = String::from("usemtl block\n");
    for k in 0..8 {
        let bit = |bit: i32| f64::from(k >> bit & 1) * per_metre;
        text += &format!("v {} {} {}\n", 0.6 * bit(0), 0.4 * bit(1), 0.5 * bit(2));
    }
    text + "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n"
}

fn pipe(per_metre: f64) -> String {
    let sides = 12;
    let mut text = String::new();
    for height in [0.0, 1.0] {
        for k in 0..sides {
            let at = DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(sides)) * 0.1 * per_metre;
            text += &format!("v {} {} {}\n", at.x, at.y, height * per_metre);
        }
    }
    text += "usemtl diffuser\nf";
    (1..=sides).for_each(|k| text += &format!(" {k}"));
    text += "\nusemtl pipe\n";
    for k in 0..sides {
        let (a, b) = (k + 1, (k + 1) % sides + 1);
        text += &format!("f {a} {b} {} {}\n", b + sides, a + sides);
    }
    text
}

fn with_block(unit: &str) -> Value {
    let mut document = cube();
    document["room"]["objects"] = json!([{ "kind": "mesh", "mesh": "block", "unit": unit, "position_m": [0.5, 0.7, 0],
                                           "surfaces": { "block": { "reflectance": 0.6 } } }]);
    document
}

fn with_pipe(unit: &str) -> Value {
    let mut document = cube();
    document["tubes"] = json!([{
        "mesh": "pipe", "unit": unit, "centre_m": [1.016, 1.016], "opening_diameter_m": 0.2,
        "parts": { "pipe": { "role": "pipe", "reflectance": 0.95 },
                   "diffuser": { "role": "diffuser", "kind": "lambertian", "transmittance": 0.6 } }
    }]);
    document
}

/// Objects and tubes drawn in millimetres light like those in metres; the unit is asked for, and a wrong one leads out of the
/// room, or is no size that a building has.
#[test]
fn millimetres_are_metres() {
    type Make = fn(&str) -> Value;
    for (document, file) in [(with_block as Make, obj as fn(f64) -> String), (with_pipe, pipe)] {
        let of = |unit: &str, per_metre: f64| lux(&rendered(&prepared_with(&document(unit), &file(per_metre))).0);
        let metres = of("m", 1.0);
        // points under the block are dark
        assert!(metres.iter().filter(|lux| **lux > 0.0).count() >= 7);
        for (metres, other) in metres.iter().zip(of("mm", 1000.0)).chain(metres.iter().zip(of("ft", 1.0 / 0.3048))) {
            assert!((metres - other).abs() <= 1e-6 * metres, "{metres} {other}");
        }
    }
    let errors = |document: &Value, file: &str| {
        let parsed = JobDocument::parse(document.to_string().as_bytes());
        let errors = parsed.and_then(|parsed| {
            skyduct::document::to_scene(&parsed, &Obj(file.to_owned())).map(|(scene, ..)| scene.grids.len())
        });
        errors.unwrap_err().0
    };
    let wrong = errors(&with_block("m"), &obj(1000.0));
    assert!(wrong[0].pointer.starts_with("/room/objects/0/position_m/"), "{wrong:?}");
    // a pipe of 100 m through an opening of 0.2 m
    let wrong = errors(&with_pipe("m"), &pipe(1e8));
    assert_eq!(wrong[0].pointer, "/tubes/0/mesh", "{wrong:?}");
    let mut unsaid = with_block("m");
    unsaid["room"]["objects"][0].as_object_mut().unwrap().remove("unit");
    let missing = errors(&unsaid, &obj(1.0));
    let expected = ("/room/objects/0/unit", FieldErrorCode::Missing);
    assert_eq!((missing[0].pointer.as_str(), missing[0].code), expected, "{missing:?}");
}

/// A rectangle of one material.
fn sheet(corners: [DVec3; 4]) -> TriangleMesh {
    TriangleMesh {
        positions: corners.to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_materials: vec![0, 0],
        materials: vec![String::new()],
        ..TriangleMesh::default()
    }
}

fn level(low: DVec2, high: DVec2, height: f64) -> TriangleMesh {
    sheet([
        low.extend(height),
        DVec2::new(high.x, low.y).extend(height),
        high.extend(height),
        DVec2::new(low.x, high.y).extend(height),
    ])
}

/// A room with a panel, and sheets of the given reflectances.
fn sheets(meshes: Vec<(TriangleMesh, f64)>) -> Scene {
    let size = DVec3::new(2.0, 2.4, 2.5);
    let lamp = panel(DVec3::new(1.0, 1.2, 2.4), 0.4, 0.6, 1000.0);
    let mut scene = electric_room(size, 0.5, vec![lamp], [4, 4], EstimateKind::Point);
    scene.grids[0].height_m = 0.3;
    let object = |(mesh, reflectance)| MeshObject::new(mesh, vec![Surface::diffuse([reflectance; 3])]);
    scene.room.meshes = meshes.into_iter().map(object).collect();
    scene
}

fn traced(scene: &Scene) -> Vec<f64> {
    values(&run(scene, &*light_tracing(scene, 4096, 1), 4)).0
}

/// A table top in the middle of the room, again for good measure: light meets one of two sheets in one place, never both.
#[test]
fn coincident_sheets_reflect_once() {
    let top = || level(DVec2::new(0.6, 0.7), DVec2::new(1.4, 1.7), 0.8);
    let mut flipped = top();
    flipped.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
    let single = traced(&sheets(vec![(top(), 0.5)]));
    let bare = traced(&sheets(vec![]));
    assert!(single.iter().zip(&bare).any(|(single, bare)| (single / bare - 1.0).abs() > 0.1));
    for second in [top(), flipped] {
        let double = traced(&sheets(vec![(top(), 0.5), (second, 0.5)]));
        for (single, double) in single.iter().zip(&double) {
            assert!((single - double).abs() <= 1e-12 * single, "{single} {double}");
        }
    }
}

/// The triangles of a diffuser may be wound either way: light is sent to the side away from where it comes from.
#[test]
fn a_flipped_diffuser_sends_light_down_all_the_same() {
    let flipped: String = pipe(1.0)
        .lines()
        .map(|line| match line.strip_prefix("f ") {
            Some(corners) => format!("f {}\n", corners.split(' ').rev().collect::<Vec<_>>().join(" ")),
            None => format!("{line}\n"),
        })
        .collect();
    let bits = |file: &str| lux(&rendered(&prepared_with(&with_pipe("m"), file)).0);
    for (one, other) in bits(&pipe(1.0)).iter().zip(bits(&flipped)) {
        assert!(*one > 0.0 && (one - other).abs() <= 1e-12 * one, "{one} {other}");
    }
}

/// A rug of another reflectance in the plane of the floor is what light meets, always; 0.1 mm above it gives the same light to
/// 1e-3.
#[test]
fn a_rug_in_the_floor_s_plane_is_seen() {
    let on = |height: f64| sheets(vec![(level(DVec2::new(0.2, 0.3), DVec2::new(1.8, 2.1), height), 0.9)]);
    let (bare, flush) = (traced(&sheets(vec![])), traced(&on(0.0)));
    for (sensor, (flush, raised)) in flush.iter().zip(traced(&on(1e-4))).enumerate() {
        assert!((raised / flush - 1.0).abs() < 1e-3, "{sensor}: {raised} {flush}");
        assert!(flush / bare[sensor] > 1.02, "{sensor}: {flush} {}", bare[sensor]);
    }
    let room = traceable(&on(0.0));
    let mut random = PathRandom::new(Key::new(1));
    for _ in 0..10_000 {
        let from = DVec3::new(2.0 * random.uniform(), 2.4 * random.uniform(), 0.5 + random.uniform());
        let hit = room.intersect(from, -warp::cosine_hemisphere(random.uniform2()), None);
        let over_rug = (0.2..1.8).contains(&hit.position.x) && (0.3..2.1).contains(&hit.position.y);
        if hit.position.z < 1e-9 {
            let Place::Surface(surface) = hit.place else { panic!("no opening") };
            assert_eq!(surface.index() >= room.numbering.faces, over_rug, "{hit:?}");
        }
    }
}

/// Open faces: what leaves is counted, and of a room whose faces are all open the floor has direct light alone.
#[test]
fn what_leaves_a_room_is_counted() {
    let mut open = disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point);
    for face in [Face::West, Face::East, Face::South, Face::North, Face::Floor] {
        open.room.enclosure.paint(face as usize, None);
    }
    let black = disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point);
    let [open, black] = [open, black].map(|scene| run(&scene, &*light_tracing(&scene, 4096, 1), 2));
    assert_eq!(values(&open).0, values(&black).0);
    assert_eq!((open.energy.open_surfaces, open.energy.room), (black.energy.room, 0.0));

    // of a furnace with one face open, a large part leaves
    let mut furnace = disc_room(0.9, 0.9, 0.9, 0.9, EstimateKind::Point);
    furnace.room.enclosure.paint(Face::South as usize, None);
    let estimate = run(&furnace, &*light_tracing(&furnace, 4096, 1), 8);
    assert!(estimate.energy.open_surfaces > 0.3 * estimate.tubes[0].into_room.mean * 8.0);
    assert!(estimate.energy.relative_closure_error().abs() < 1e-12);
}

/// A wall of triangles with a gap of a millimetre, in a room that is open around it: through the gap goes what falls on it.
#[test]
fn a_gap_of_a_millimetre_lets_its_share_out() {
    /// A millimetre before the open face, so that what goes through meets nothing else.
    const WALL: f64 = 1.999;
    let gap = 1e-3;
    let size = DVec3::new(2.0, 2.4, 2.5);
    // a luminaire that faces the east, a wall of two parts before it
    let lamp = Luminaire {
        corner: DVec3::new(0.5, 0.9, 1.0),
        edge_u: DVec3::Y * 0.6,
        edge_v: DVec3::Z * 0.5,
        luminance: [1000.0; 3],
    };
    let upright = |low: DVec2, high: DVec2| {
        sheet([(low.x, low.y), (high.x, low.y), (high.x, high.y), (low.x, high.y)].map(|(y, z)| DVec3::new(WALL, y, z)))
    };
    let mut scene = electric_room(size, 0.0, vec![lamp], [1, 1], EstimateKind::Point);
    scene.room.enclosure.paint_all([Some(Surface::diffuse([0.0; 3])); 6]);
    scene.room.enclosure.paint(Face::East as usize, None);
    let middle = 1.25;
    let parts = [
        upright(DVec2::ZERO, DVec2::new(size.y, middle - 0.5 * gap)),
        upright(DVec2::new(0.0, middle + 0.5 * gap), DVec2::new(size.y, size.z)),
    ];
    scene.room.meshes = parts.map(|mesh| MeshObject::new(mesh, vec![Surface::diffuse([0.0; 3])])).into_iter().collect();
    let method = light_tracing(&scene, 65_536, 1);
    let (mut out, mut emitted) = (Moments::default(), 0.0);
    for pass in 0..24 {
        let energy = method.pass(pass, &AtomicBool::new(false)).unwrap().totals.energy;
        assert!(energy.relative_closure_error().abs() < 1e-12);
        out.push(energy.open_surfaces);
        emitted = energy.luminaires;
    }
    // Lambert's closed form along the gap
    let corners = [(0.9, 1.0), (0.9, 1.5), (1.5, 1.5), (1.5, 1.0)].map(|(y, z)| DVec3::new(0.5, y, z));
    let lux = |y: f64| 1000.0 * quadrilateral_irradiance(&corners, DVec3::new(WALL, y, middle), DVec3::NEG_X).abs();
    let steps = 2000;
    let on_gap: f64 = (0..steps).map(|k| lux(size.y * (f64::from(k) + 0.5) / f64::from(steps))).sum::<f64>()
        * (size.y / f64::from(steps))
        * gap;
    println!("{out:?} of {emitted}, {on_gap} on the gap");
    assert!((out.mean - on_gap).abs() < 4.0 * out.standard_error(), "{out:?} {on_gap}");
    assert!(out.standard_error() < 0.1 * on_gap && on_gap < 0.001 * emitted);
}

/// A square of slivers a million times as long as wide, between two whole triangles: of a million rays at their edges, to the
/// rounding of the ray, and half a million others, none gets through. Of rays that are spread evenly one in 10^9 comes as near
/// to an edge.
#[test]
fn slivers_have_no_cracks_between_them() {
    let count = 64u32;
    let width = 1e-6;
    let strip = width * f64::from(count);
    let mut triangles = Vec::new();
    let at = |x: f64, y: f64| DVec3::new(x, y, 0.1 * y - 0.05 * x);
    for k in 0..count {
        let (a, b) = (width * f64::from(k), width * f64::from(k + 1));
        triangles.extend([[at(a, 0.0), at(b, 0.0), at(b, 1.0)], [at(a, 0.0), at(b, 1.0), at(a, 1.0)]]);
    }
    for (from, to) in [(-1.0, 0.0), (strip, strip + 1.0)] {
        triangles.extend([[at(from, 0.0), at(to, 0.0), at(to, 1.0)], [at(from, 0.0), at(to, 1.0), at(from, 1.0)]]);
    }
    let bvh = TriangleBvh::new(&triangles);
    let rays: u64 = 1_500_000;
    let batches = 200;
    let leaks: u64 = (0..batches)
        .into_par_iter()
        .map(|batch| {
            let mut random = PathRandom::new(Key::new(2).child(batch));
            let mut leaks = 0;
            for k in 0..rays / batches {
                let x = match k % 6 {
                    0..4 => width * (f64::from(count - 1) * random.uniform() + 1.0).floor(),
                    4 => strip * random.uniform(),
                    _ => -0.5 + random.uniform(),
                };
                let y = 0.001 + 0.998 * random.uniform();
                let from = DVec3::new(2.0 * random.uniform() - 1.0, random.uniform(), 1.0 + random.uniform());
                leaks += u64::from(bvh.nearest(from, (at(x, y) - from).normalize(), None).is_none());
            }
            leaks
        })
        .sum();
    assert_eq!(leaks, 0);
}

/// Light in a room of 1 cm between walls of a millimetre's distance, and in a hall of 10 km: all of it ends on surfaces, none
/// through them.
#[test]
fn small_and_huge_rooms_keep_their_light() {
    for scale in [0.005, 1.0, 5000.0] {
        let size = DVec3::new(2.0, 2.4, 2.5) * scale;
        let lamp = panel(DVec3::new(1.0, 1.2, 2.4) * scale, 0.4 * scale, 0.6 * scale, 1000.0);
        let mut scene = electric_room(size, 0.7, vec![lamp], [2, 2], EstimateKind::Point);
        // a wall of triangles 1 mm from the wall of the room: outside of it all is open
        let x = if scale < 0.01 { 0.1 * size.x } else { 1e-3 };
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let mesh = sheet(corners.map(|(y, z)| DVec3::new(x, y * size.y, z * size.z)));
        scene.room.meshes = vec![MeshObject::new(mesh, vec![Surface::diffuse([0.7; 3])])];
        scene.room.enclosure.paint(Face::West as usize, None);
        let energy = run(&scene, &*light_tracing(&scene, 8192, 1), 4).energy;
        assert_eq!(energy.open_surfaces, 0.0, "{scale}");
        assert!((energy.room / energy.luminaires - 1.0).abs() < 1e-12, "{scale}: {energy:?}");
    }
}

/// The thesis' room with its disc, as large as a thimble and as large as a town: lux of 1000 lm go with the inverse square.
#[test]
fn illuminances_scale_with_the_inverse_square() {
    let at = |side: f64| {
        let scale = side / SIDE;
        let mut scene = disc_room(0.2, 0.5, 0.7, 0.7, EstimateKind::Point);
        let tube = scene.tubes.remove(0);
        scene.tubes = vec![Tube { centre: tube.centre * scale, opening_radius: tube.opening_radius * scale, ..tube }];
        if let skyduct::scene::TubeShape::Cylinders(shape) = &mut scene.tubes[0].shape {
            shape.segments[0].length_m *= scale;
        }
        // the sky that puts as many lumens through the disc
        let sky = scene.daylight.as_mut().unwrap().sky.as_mut().unwrap();
        sky.zenith_luminance_cd_m2 /= scale * scale;
        crate::scenes::resize(&mut scene, DVec3::splat(side));
        scene.grids = vec![Grid::new("floor".into(), 0.0, [3, 3], 0.0, [side; 2], EstimateKind::Point)];
        let method = Holigilm::new(installation(&traceable(&scene), &scene.grids), 1e-3, 0);
        let lux = method.solve(&AtomicBool::new(false)).unwrap().grids[0].illuminance.clone();
        lux.into_iter().map(|lux| lux * scale * scale).collect::<Vec<_>>()
    };
    let thesis = at(SIDE);
    for side in [0.01, 10_000.0] {
        for (one, other) in thesis.iter().zip(at(side)) {
            assert!((other / one - 1.0).abs() < 1e-6, "{side}: {other} {one}");
        }
    }
}

/// Lengths of -0, of less than any normal number and of more than any finite one: zero or refused, where they are meant to
/// be lengths.
#[test]
fn lengths_that_are_none_are_refused() {
    let text = |pointer: &str, number: &str| {
        let text = with(base(), pointer, json!(0.123_456_789)).to_string();
        assert!(text.contains("0.123456789"));
        text.replace("0.123456789", number)
    };
    for pointer in ["/tubes/0/segments/0/length_m", "/tubes/0/diameter_m", "/room/size_m/2"] {
        for number in ["-0.0", "-0", "0", "1e-320", "-1e-320", "4.9e-324", "1e999", "-1e999", "1e400"] {
            let errors = JobDocument::parse(text(pointer, number).as_bytes()).unwrap_err().0;
            assert!(errors.iter().any(|error| error.pointer == pointer), "{pointer} {number}: {errors:?}");
        }
    }
    for (pointer, number) in
        [("/grids/0/margin_m", "-0.0"), ("/grids/0/height_m", "-0.0"), ("/grids/0/margin_m", "1e-320")]
    {
        let document = JobDocument::parse(text(pointer, number).as_bytes()).unwrap();
        assert!(document.grids[0].margin_m == 0.0, "{pointer}");
    }
    refused(
        &with(base(), "/tubes/0/segments/0/length_m", json!(-0.0)),
        "/tubes/0/segments/0/length_m",
        FieldErrorCode::OutOfRange,
    );
}

//! Mesh objects: against box objects of the same shape, against leaks, and against what a document may say of them.

use crate::documents::Folder;
use crate::reference;
use crate::scenes;
use crate::scenes::{assert_grid, built, light_tracing, values};
use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, FieldErrorCode, JobDocument, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::integrator::bidirectional::{self, Bidirectional};
use skyduct::integrator::method::RefusalCode;
use skyduct::integrator::path_tracing;
use skyduct::integrator::two_stage;
use skyduct::optics::{Spectrum, Surface};
use skyduct::plan::{self, EffectRequests, Effects};
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::scene::{BoxObject, Channels, EstimateKind, Grid, MeshObject, Room, Scene};
use skyduct::traceable::{Place, TraceableScene};

/// A room with a panel and one block, `object`.
fn room(object: Value) -> Value {
    json!({
        "room": {
            "size_m": [3.0, 2.5, 2.2],
            "objects": [object],
            "luminaires": [{ "kind": "rectangle", "corner_m": [1.2, 0.9, 2.1], "edge_u_m": [0, 0.5, 0],
                             "edge_v_m": [0.6, 0, 0], "luminance_cd_m2": 3000 }]
        },
        "grids": [{ "name": "floor", "height_m": 0, "cells": [6, 5] }],
        "views": [{ "name": "room", "eye_m": [0.2, 0.2, 1.9], "look_at_m": [1.5, 1.3, 0.2], "up": [0, 0, 1],
                    "vertical_fov_deg": 60, "size_px": [48, 40] }]
    })
}

/// A hair's breadth more than the other sides reflect: so that a mesh is traced as one, although it is a cuboid.
const UNLIKE: f64 = 1e-9;

fn mesh_block() -> Value {
    json!({ "kind": "mesh", "mesh": "block.obj", "unit": "cm", "position_m": [1.2, 1.2, 0], "rotation_deg": 25,
            "surfaces": { "side": { "reflectance": 0.6 }, "top": { "reflectance": 0.6 + UNLIKE } } })
}

fn box_block() -> Value {
    json!({ "kind": "box", "size_m": [0.6, 0.4, 0.5], "position_m": [1.2, 1.2, 0], "rotation_deg": 25,
            "surface": { "reflectance": 0.6 } })
}

fn scene(document: &Value) -> Scene {
    to_scene(&JobDocument::parse(document.to_string().as_bytes()).unwrap(), &Folder).unwrap().0
}

fn traceable(scene: &Scene) -> std::sync::Arc<TraceableScene> {
    plan::compile(scene, &Effects::of(scene, &EffectRequests::new())).map(Into::into).unwrap()
}

/// The winding of the triangles does not count: photons fly the same ways.
#[test]
fn winding_does_not_count() {
    let good = scene(&room(mesh_block()));
    let mut turned = good.clone();
    for triangle in turned.room.meshes[0].mesh.triangles.iter_mut().step_by(3) {
        triangle.swap(1, 2);
    }
    let run = |scene: &Scene| {
        let only_grids = Scene { views: Vec::new(), ..scene.clone() };
        values(&scenes::run(&only_grids, &*light_tracing(&only_grids, 2048, 1), 2)).0
    };
    for (a, b) in run(&good).iter().zip(&run(&turned)) {
        assert!((a - b).abs() <= 1e-9 * a, "{a} {b}");
    }
}

/// A grid of one sensor.
fn point(sensor: DVec3) -> Grid {
    let mut grid = Grid::new("point".into(), sensor.z, [1, 1], 0.0, [3.0, 2.5], EstimateKind::Point);
    (grid.x_m, grid.y_m) = (vec![sensor.x], vec![sensor.y]);
    grid
}

/// The room of a block without its view, with one sensor beside the block: `beside` metres from its eastern side.
fn beside(object: Value, beside: f64) -> Scene {
    let mut object = object;
    object["rotation_deg"] = 0.into();
    let mut scene = scene(&room(object));
    scene.views.clear();
    scene.grids = vec![point(DVec3::new(1.2 + 0.3 + beside, 1.15, 0.2))];
    scene
}

/// A sensor 2 mm beside a mesh: photons that are connected to it are rare and bright, so that light tracing says no, names the
/// sensor and the surface, and the method that the plan takes, and paths of both ways, give what paths backward find beside a box of
/// that shape.
#[test]
fn points_beside_a_mesh_are_not_left_to_connections() {
    let choose = |scene: &Scene, request: &str| {
        let mut document = room(box_block());
        document["method"] = request.into();
        if request == "light_tracing" {
            document.as_object_mut().unwrap().remove("views");
        }
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        plan::Methods::choose(scene, &traceable(scene), &document.method.request())
    };
    let mesh = beside(mesh_block(), 0.002);
    let refusal = choose(&mesh, "light_tracing").unwrap_err();
    assert_eq!(refusal.code, RefusalCode::PointsNearSurfaces);
    assert!(refusal.detail.contains("row 0, column 0") && refusal.detail.contains("a mesh"), "{refusal}");
    let chosen = choose(&mesh, "auto").unwrap().grids.unwrap();
    assert_eq!(chosen.method.name(), "two_stage");
    let settings = two_stage::Settings { samples_per_sensor: Some(1024), ..Default::default() };
    let stages = built(&mesh, &settings, 3);
    let stages = scenes::run(&mesh, &*stages, 48);
    let sizes = bidirectional::PathCounts { photons: 1024, per_sensor: 64, per_pixel: 1 };
    let found = Bidirectional::<1>::new(traceable(&mesh), &mesh.grids, &[], sizes, 3);
    let found = scenes::run(&mesh, &found, 48);
    let block = beside(box_block(), 0.002);
    let settings = path_tracing::Settings { samples_per_sensor: 4096, ..Default::default() };
    let paths = built(&block, &settings, 2);
    let (truth, error) = values(&scenes::run(&block, &*paths, 48));
    for found in [stages, found] {
        assert_grid(&found, &truth, &error, 4.0, 0.0, "beside a mesh");
        assert!(found.grids[0].standard_error_lux(0) < 0.02 * truth[0] && error[0] < 0.02 * truth[0]);
    }
}

/// A sensor half a millimetre below the panel of a room with a block, which may hide it: nothing is left to connections.
#[test]
fn points_below_a_luminaire_are_not_left_to_connections() {
    let mut below = beside(box_block(), 0.3);
    below.grids = vec![point(DVec3::new(1.5, 1.15, 2.0995))];
    let request = JobDocument::parse(room(box_block()).to_string().as_bytes()).unwrap().method.request();
    let chosen = plan::Methods::choose(&below, &traceable(&below), &request).unwrap().grids.unwrap();
    assert_eq!(chosen.method.name(), "two_stage");
    let settings = two_stage::Settings { samples_per_sensor: Some(256), ..Default::default() };
    let found = scenes::run(&below, &*built(&below, &settings, 3), 32);
    let settings = path_tracing::Settings { samples_per_sensor: 4096, ..Default::default() };
    let (truth, error) = values(&scenes::run(&below, &*built(&below, &settings, 2), 32));
    assert_grid(&found, &truth, &error, 4.0, 0.0, "below a luminaire");
    assert!(found.grids[0].standard_error_lux(0) < 0.01 * truth[0] && error[0] < 0.01 * truth[0]);
}

/// A rug over the whole floor hides it, in its plane and just above.
#[test]
fn a_rug_hides_the_floor() {
    for height in [0.0, 1e-4] {
        let mut covered = scene(&room(box_block()));
        let corners = [(0.0, 0.0), (3.0, 0.0), (3.0, 2.5), (0.0, 2.5)];
        let mesh = TriangleMesh {
            positions: corners.map(|(x, y)| DVec3::new(x, y, height)).to_vec(),
            triangles: vec![[0, 1, 2], [0, 3, 2]],
            triangle_materials: vec![0, 0],
            materials: vec!["rug".into()],
            ..TriangleMesh::default()
        };
        covered.room.meshes.push(MeshObject::new(mesh, vec![Surface::diffuse([0.8; 3])]));
        let room = traceable(&covered);
        let floor = room.intersect(DVec3::new(0.3, 0.3, 1.0), DVec3::NEG_Z, None);
        assert!(
            matches!(floor.place, Place::Surface(surface) if room.numbering.facet_of(surface) == Some(0)),
            "{:?}",
            floor.place
        );
    }
}

/// A sheet of two surfaces, white above and dark below, is two sheets a hair apart, by paths either way;
/// turned over, it is another.
#[test]
fn a_sheet_has_a_surface_on_either_side() {
    let scene = |sheets: &[(f64, [u32; 2])], height: f64| {
        let mut scene = beside(box_block(), 0.3);
        let sheet = |(height, sides): &(f64, [u32; 2])| {
            let corners = [(0.6, 0.5), (2.4, 0.5), (2.4, 2.0), (0.6, 2.0)];
            let mut mesh = TriangleMesh {
                positions: corners.map(|(x, y)| DVec3::new(x, y, *height)).to_vec(),
                triangles: vec![[0, 1, 2], [0, 3, 2]],
                materials: vec![String::new(); 2],
                ..TriangleMesh::default()
            };
            // the second triangle is wound the other way
            mesh.set_sides([*sides, [sides[1], sides[0]]].into_iter());
            MeshObject::new(mesh, [0.8, 0.05].map(|grey| Surface::diffuse([grey; 3])).to_vec())
        };
        scene.room.boxes.clear();
        scene.room.meshes = sheets.iter().map(sheet).collect();
        scene.grids = vec![Grid::new("level".into(), height, [3, 3], 0.2, [3.0, 2.5], EstimateKind::Point)];
        scene
    };
    for height in [0.0, 1.5] {
        let apart = scene(&[(1.0, [0, 0]), (0.9999, [1, 1])], height);
        let settings = path_tracing::Settings { samples_per_sensor: 512, ..Default::default() };
        let paths = |scene: &Scene, seed: u64| built(scene, &settings, seed);
        let (truth, error) = values(&scenes::run(&apart, &*paths(&apart, 1), 32));
        let one = scene(&[(1.0, [0, 1])], height);
        let tracing = light_tracing(&one, 4096, 3);
        for (what, found) in [
            ("path_tracing", scenes::run(&one, &*paths(&one, 2), 32)),
            ("light_tracing", scenes::run(&one, &*tracing, 32)),
        ] {
            assert_grid(&found, &truth, &error, 4.5, 0.0, what);
        }
        let turned = scene(&[(1.0, [1, 0])], height);
        let turned = values(&scenes::run(&turned, &*paths(&turned, 2), 32)).0;
        let mean = |lux: &[f64]| lux.iter().sum::<f64>() / 9.0;
        assert!((mean(&turned) / mean(&truth) - 1.0).abs() > 0.05, "{turned:?} {truth:?}");
    }
}

/// A closed cube of 12 triangles from its lowest corner on, which is traced as such.
pub fn closed_cube(from: DVec3, side: f64) -> MeshObject {
    board(from, DVec3::splat(side), UNLIKE)
}

/// A closed cuboid of 12 triangles from its lowest corner on, one face of which reflects `unlike` more than the others.
fn board(from: DVec3, size: DVec3, unlike: f64) -> MeshObject {
    let corner = |k: usize| from + DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64) * size;
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let mesh = TriangleMesh {
        positions: (0..8).map(corner).collect(),
        triangles: faces.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect(),
        triangle_materials: [vec![0; 10], vec![1; 2]].concat(),
        materials: vec![String::new(); 2],
        ..TriangleMesh::default()
    };
    MeshObject::new(mesh, [0.5, 0.5 + unlike].map(|grey| Surface::diffuse([grey; 3])).to_vec())
}

/// A closed cube of 12 triangles in a room with a clear space of `gap` around.
fn cell(side: f64, gap: f64) -> Scene {
    let mut scene = scene(&room(mesh_block()));
    scene.room.meshes = vec![closed_cube(DVec3::splat(gap), side)];
    crate::scenes::resize(&mut scene, DVec3::splat(side + 2.0 * gap));
    scene.room.luminaires.clear();
    scene.views.clear();
    scene
}

/// Rays inside a closed mesh that aim at corners and edges never reach the room's faces, nor do paths that bounce in it:
/// in a room of metres, in a hall of 10 km with a gap of 1 mm, and in a box of centimetres.
#[test]
fn closed_meshes_do_not_leak() {
    for (side, gap) in [(2.0, 0.1), (1e4 - 0.002, 0.001), (0.02, 1e-5)] {
        let scene = cell(side, gap);
        let kernel = traceable(&scene);
        let mesh = &scene.room.meshes[0].mesh;
        let mut random = PathRandom::new(Key::new(8));
        let mut inside =
            || DVec3::new(random.uniform(), random.uniform(), random.uniform()) * (0.98 * side) + gap + 0.01 * side;
        for triangle in &mesh.triangles {
            for k in 0..3 {
                let [a, b] = [triangle[k], triangle[(k + 1) % 3]].map(|corner| mesh.positions[corner as usize]);
                for step in 0..100 {
                    let (origin, target) = (inside(), a.lerp(b, f64::from(step) / 99.0));
                    let hit = kernel.intersect(origin, (target - origin).normalize(), None);
                    let Place::Surface(surface) = hit.place else { panic!("no opening") };
                    assert!(surface.index() >= kernel.numbering.faces, "{side}: leak at {target}");
                    assert!((hit.position - target).length() < 1e-9 * side);
                    let beyond = kernel.enclosure.clamp(target + (target - origin) * 1e-3);
                    let outside = (beyond - target).length() > 0.1 * gap && (beyond - gap).min_element() < -1e-6 * gap;
                    assert!(!outside || !kernel.visible(origin, None, beyond, None));
                }
            }
        }
        let (mut position, mut direction, mut from) = (inside(), DVec3::X, None);
        for _ in 0..20_000 {
            let hit = kernel.intersect(position, direction, from);
            let Place::Surface(surface) = hit.place else { panic!("no opening") };
            assert!(surface.index() >= kernel.numbering.faces, "{side}: leak at {}", hit.position);
            (position, from) = (hit.position, Some(surface));
            direction = warp::around(hit.normal, warp::cosine_hemisphere(random.uniform2()));
        }
        // and between the mesh and the wall nothing of it is seen from within
        let mut position = DVec3::new(0.5 * gap, 0.5 * side, 0.5 * side);
        let mut direction = DVec3::NEG_X;
        let mut from = None;
        for _ in 0..20_000 {
            let hit = kernel.intersect(position, direction, from);
            let Place::Surface(surface) = hit.place else { panic!("no opening") };
            let depth = (hit.position - gap).min(side + gap - hit.position).min_element();
            assert!(depth <= 1e-9 * side, "{side}: inside at {}", hit.position);
            (position, from) = (hit.position, Some(surface));
            direction = warp::around(hit.normal, warp::cosine_hemisphere(random.uniform2()));
        }
    }
}

/// A table of boards lights a room alike as boxes and as meshes: both agree with paths backward among triangles, beside and below it,
/// within 4 standard errors.
#[test]
fn boards_light_a_room_as_their_triangles_do() {
    let scene = |as_boxes: bool| {
        let mut document = reference::json("scenes/S1.json");
        document["grids"][0]["cells"] = json!([3, 4]);
        let mut scene = scene(&document);
        let leg = |x: f64, y: f64| (DVec3::new(x, y, 0.0), DVec3::new(0.1, 0.08, 0.5));
        let top = (DVec3::new(0.4, 0.3, 0.5), DVec3::new(0.9, 1.1, 0.04));
        let boards = [leg(0.4, 0.3), leg(1.2, 0.3), leg(0.4, 1.32), leg(1.2, 1.32), top];
        scene.room.meshes = boards.map(|(from, size)| board(from, size, 0.0)).to_vec();
        if as_boxes {
            let surface = scene.room.meshes[0].surfaces[0];
            let middle = |from: DVec3, size: DVec3| from + DVec3::new(0.5 * size.x, 0.5 * size.y, 0.0);
            let of =
                |(from, size): (DVec3, DVec3)| BoxObject { size, base: middle(from, size), rotation: 0.0, surface };
            (scene.room.boxes, scene.room.meshes) = (boards.map(of).to_vec(), Vec::new());
        }
        scene
    };
    let (boxes, triangles) = (scene(true), scene(false));
    let settings = path_tracing::Settings { samples_per_sensor: 4096, ..Default::default() };
    let paths = built(&triangles, &settings, 2);
    let (truth, error) = values(&scenes::run(&triangles, &*paths, 32));
    for scene in [&boxes, &triangles] {
        let settings = two_stage::Settings { samples_per_sensor: Some(256), ..Default::default() };
        let found = scenes::run(scene, &*built(scene, &settings, 3), 32);
        assert_grid(&found, &truth, &error, 4.0, 0.0, "about a table");
        assert!((0..12).all(|sensor| found.grids[0].standard_error_lux(sensor) < 0.015 * truth[sensor]));
    }
    assert!(truth.iter().zip(&error).all(|(truth, error)| *error < 0.03 * truth), "{truth:?} {error:?}");
}

#[test]
fn documents() {
    let errors = |document: Value| -> DocumentErrors {
        JobDocument::parse(document.to_string().as_bytes())
            .and_then(|document| to_scene(&document, &Folder))
            .map(drop)
            .unwrap_err()
    };
    let with = |field: &str, value: Value| {
        let mut object = mesh_block();
        match field.split_once('/') {
            Some((outer, inner)) => object[outer][inner] = value,
            None => object[field] = value,
        }
        room(object)
    };
    for (field, value, pointer, code) in [
        ("mesh", json!("none.obj"), "mesh", FieldErrorCode::Invalid),
        ("unit", json!("m"), "position_m/0", FieldErrorCode::Invalid),
        ("position_m", json!([1.2, 1.2, 1.8]), "position_m/2", FieldErrorCode::Invalid),
        ("position_m", json!([1.2, 1e9, 0]), "position_m/1", FieldErrorCode::OutOfRange),
        ("rotation_deg", json!(400), "rotation_deg", FieldErrorCode::OutOfRange),
        ("surfaces", json!({ "top": { "reflectance": 0.5 } }), "surfaces", FieldErrorCode::Invalid),
        ("surfaces/lid", json!({ "reflectance": 0.5 }), "surfaces/lid", FieldErrorCode::Invalid),
        ("surfaces/top", json!({ "reflectance": 1.0 }), "surfaces/top/reflectance", FieldErrorCode::Invalid),
        ("surfaces/top", json!({ "open": true }), "surfaces/top/open", FieldErrorCode::Invalid),
    ] {
        let found = errors(with(field, value.clone())).0;
        let pointer = format!("/room/objects/0/{pointer}");
        let error = found.iter().find(|error| error.pointer == pointer);
        let error = error.unwrap_or_else(|| panic!("{field} {value}: nothing at {pointer}: {found:?}"));
        assert_eq!(error.code, code, "{error}");
    }
    let coloured = scene(&with("surfaces/top", json!({ "reflectance": [0.1, 0.2, 0.3] })));
    assert_eq!(coloured.channels, Channels::Rgb);
    let room: &Room = &coloured.room;
    assert_eq!(room.meshes[0].surfaces[1].reflectance, [0.1, 0.2, 0.3]);
    let (low, high) = room.meshes[0].mesh.bounds().unwrap();
    assert!(low.z == 0.0 && high.z == 0.5);
    // clockwise seen from above: the long side turns toward -y
    let turned =
        DVec3::new(1.2, 1.2, 0.0) + DVec3::new(0.3 * 0.906308 - 0.2 * 0.422618, -0.3 * 0.422618 - 0.2 * 0.906308, 0.0);
    assert!(room.meshes[0].mesh.positions.iter().any(|p| (*p - turned).length() < 1e-5));
    let one: Spectrum<3> = Spectrum::from_rgb(room.meshes[0].surfaces[0].reflectance);
    assert_eq!(one.max(), 0.6);
}

//! Rooms given by their faces: what they become, what is repaired and told, and the place of every fault.

use crate::given::{SquarePipe, errors, refused, with};
use crate::schema::parse;
use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, WarningCode, to_scene};
use skyduct::scene::{Channels, Enclosure, EnclosureFace, FaceKind, Scene};

/// Corners of a box of 4 m x 3 m x 2.7 m, from the south-western one around the floor, then around the ceiling.
fn corner(number: usize) -> [f64; 3] {
    let [x, y] = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [0.0, 3.0]][number % 4];
    [x, y, if number < 4 { 0.0 } else { 2.7 }]
}

fn face(name: &str, kind: &str, corners: &[[f64; 3]]) -> Value {
    json!({ "name": name, "kind": kind, "boundary_m": corners })
}

/// Faces of the box, counter-clockwise seen from outside.
pub fn box_faces() -> Vec<Value> {
    let of = |name, kind, corners: [usize; 4]| face(name, kind, &corners.map(corner));
    vec![
        of("floor", "floor", [3, 2, 1, 0]),
        of("south", "wall", [0, 1, 5, 4]),
        of("east", "wall", [1, 2, 6, 5]),
        of("north", "wall", [2, 3, 7, 6]),
        of("west", "wall", [3, 0, 4, 7]),
        of("roof", "ceiling", [4, 5, 6, 7]),
    ]
}

pub fn job(room: Value) -> Value {
    json!({
        "sky": { "cie_type": 5, "sun_position": { "altitude_deg": 45, "azimuth_deg": 180 } },
        "room": room,
        "tubes": [{ "centre_m": [2, 1.5], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.0 }],
                    "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }],
        "grids": [{ "name": "desk", "height_m": 0.85, "spacing_m": 0.5 }]
    })
}

pub fn of_faces(faces: Vec<Value>) -> Value {
    job(json!({ "faces": faces }))
}

/// The scene of a document, and the sentences about repairs of its room.
pub fn scene(document: &Value) -> (Scene, Vec<String>) {
    let (scene, warnings, _) = to_scene(&parse(document).unwrap(), &SquarePipe).unwrap();
    let of_room = warnings.into_iter().filter(|warning| warning.code == WarningCode::RepairedRoom);
    (scene, of_room.map(|warning| warning.detail).collect())
}

/// Volume, positive if the faces are seen from inside, and areas of floor, walls and ceiling.
pub fn measures(room: &Enclosure) -> [f64; 4] {
    let faces = || room.faces().iter();
    let pyramid = |face: &EnclosureFace| face.polygon.area_m2() * face.polygon.height(DVec3::ZERO) / 3.0;
    let volume = faces().map(pyramid).sum();
    let area = |kind| faces().filter(|face| face.kind == kind).map(|face| face.polygon.area_m2()).sum();
    [volume, area(FaceKind::Floor), area(FaceKind::Wall), area(FaceKind::Ceiling)]
}

#[track_caller]
pub fn assert_near(found: [f64; 4], expected: [f64; 4], tolerance: f64) {
    assert!(found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < tolerance), "{found:?}");
}

pub const OF_BOX: [f64; 4] = [32.4, 12.0, 37.8, 12.0];

#[test]
fn a_box_is_the_same_in_every_form() {
    let plan = json!({ "plan": { "outline_m": [[0, 0], [4, 0], [4, 3], [0, 3]] },
                       "ceiling": { "kind": "flat", "height_m": 2.7 } });
    let rooms = [json!({ "size_m": [4, 3, 2.7] }), plan, json!({ "faces": box_faces() })];
    let scenes = rooms.map(|room| scene(&job(room)));
    for (scene, repairs) in &scenes {
        assert_near(measures(&scene.room.enclosure), OF_BOX, 1e-12);
        assert_eq!(scene.room.enclosure.bounds(), scenes[0].0.room.enclosure.bounds());
        assert_eq!((&scene.grids[0].x_m, &scene.grids[0].y_m), (&scenes[0].0.grids[0].x_m, &scenes[0].0.grids[0].y_m));
        assert!(repairs.is_empty(), "{repairs:?}");
    }
    assert!(Enclosure::new(scenes[2].0.room.enclosure.faces().to_vec()).is_ok());
}

#[test]
fn surfaces_are_those_of_faces_names_and_kinds() {
    let mut document = of_faces(box_faces());
    document["room"]["faces"][1]["surface"] = json!({ "reflectance": 0.11 });
    document["room"]["surfaces"] =
        json!({ "east": { "reflectance": [0.1, 0.2, 0.3] }, "walls": { "reflectance": 0.4 } });
    let (scene, _) = scene(&document);
    let red = |face: &EnclosureFace| face.surface.unwrap().reflectance[0];
    let found: Vec<f64> = scene.room.enclosure.faces().iter().map(red).collect();
    assert_eq!(found, [0.2, 0.11, 0.1, 0.4, 0.4, 0.7]);
    assert_eq!(scene.channels, Channels::Rgb);
}

/// A wall of two faces, one of which has a third corner on the other's edge, below one ceiling and on one floor.
#[test]
fn edges_may_lie_on_edges_of_several_faces() {
    let mut faces = box_faces();
    faces[1] = face("south", "wall", &[corner(0), [1.5, 0.0, 0.0], [1.5, 0.0, 2.7], corner(4)]);
    faces.push(face("south_door", "wall", &[[1.5, 0.0, 0.0], corner(1), [4.0, 0.0, 2.0], [1.5, 0.0, 2.0]]));
    faces.push(face("south_above", "wall", &[[1.5, 0.0, 2.0], [4.0, 0.0, 2.0], corner(5), [1.5, 0.0, 2.7]]));
    // two floors adjoin, and a core stands between floor and ceiling
    faces[0] = face("floor", "floor", &[corner(3), [2.0, 3.0, 0.0], [2.0, 0.0, 0.0], corner(0)]);
    faces.push(face("floor_east", "floor", &[[2.0, 3.0, 0.0], corner(2), corner(1), [2.0, 0.0, 0.0]]));
    let core = [[3.0, 2.0], [3.0, 2.5], [3.5, 2.5], [3.5, 2.0]];
    let at = |k: usize, z: f64| [core[k % 4][0], core[k % 4][1], z];
    faces[5]["holes_m"] = json!([[at(0, 2.7), at(1, 2.7), at(2, 2.7), at(3, 2.7)]]);
    faces.last_mut().unwrap()["holes_m"] = json!([[at(0, 0.0), at(1, 0.0), at(2, 0.0), at(3, 0.0)]]);
    for k in 0..4 {
        faces.push(face(&format!("core_{k}"), "wall", &[at(k, 0.0), at(k + 1, 0.0), at(k + 1, 2.7), at(k, 2.7)]));
    }
    let document = of_faces(faces);
    let (scene, repairs) = scene(&document);
    assert!(repairs.is_empty(), "{repairs:?}");
    assert_near(measures(&scene.room.enclosure), [32.4 - 0.25 * 2.7, 11.75, 37.8 + 2.0 * 2.7, 11.75], 1e-12);
    let rings = parse(&document).unwrap().room.rings();
    let areas: Vec<f64> = rings.iter().map(|ring| area(ring)).collect();
    assert_eq!(areas, [6.0, 6.0, -0.25]);
}

fn area(ring: &[DVec2]) -> f64 {
    (0..ring.len()).map(|k| 0.5 * ring[k].perp_dot(ring[(k + 1) % ring.len()])).sum()
}

#[test]
fn faces_are_turned_and_told() {
    let turned = |faces: &mut Vec<Value>, number: usize| {
        faces[number]["boundary_m"].as_array_mut().unwrap().reverse();
    };
    for (numbers, told) in [(vec![2, 4], "2 faces run clockwise"), ((0..6).collect(), "inside out")] {
        let mut faces = box_faces();
        numbers.into_iter().for_each(|number| turned(&mut faces, number));
        let (scene, repairs) = scene(&of_faces(faces));
        assert_near(measures(&scene.room.enclosure), OF_BOX, 1e-12);
        assert!(repairs.len() == 1 && repairs[0].contains(told), "{repairs:?}");
    }
}

/// Corners apart by less than a millionth, repeated corners, and a corner a little out of its plane: repaired, told, and closed exactly.
#[test]
fn small_faults_are_repaired_and_told() {
    let mut faces = box_faces();
    faces[0]["boundary_m"][0] = json!([1e-6, 3.0, 0.0]);
    faces[1]["boundary_m"].as_array_mut().unwrap().push(json!(corner(4)));
    let (apart, repairs) = scene(&of_faces(faces));
    assert_near(measures(&apart.room.enclosure), OF_BOX, 1e-4);
    assert_eq!(repairs.len(), 2, "{repairs:?}");

    let mut faces = box_faces();
    for (face, corner) in [(5, 2), (2, 2), (3, 3)] {
        faces[face]["boundary_m"][corner][2] = json!(2.7004);
    }
    // the roof is no longer level
    let (bent, repairs) = scene(&with(of_faces(faces), "/tubes/0/drop_m", json!(0.01)));
    assert_near(measures(&bent.room.enclosure), OF_BOX, 1e-2);
    assert!(repairs.len() == 1 && repairs[0].contains("`roof` (1.0e-4 m)"), "{repairs:?}");
    assert!(Enclosure::new(bent.room.enclosure.faces().to_vec()).is_ok());
}

/// A box with a pocket from its western wall that reaches through the eastern one.
fn pierced() -> Vec<Value> {
    let pocket = |k: usize, x: f64| {
        let [y, z] = [[1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0]][k % 4];
        [x, y, z]
    };
    let mut faces = box_faces();
    faces[4]["holes_m"] = json!([[pocket(0, 0.0), pocket(1, 0.0), pocket(2, 0.0), pocket(3, 0.0)]]);
    for k in 0..4 {
        let corners = [pocket(k, 0.0), pocket(k + 1, 0.0), pocket(k + 1, 5.0), pocket(k, 5.0)];
        faces.push(face(&format!("pocket_{k}"), "wall", &corners));
    }
    faces.push(face("end", "wall", &[pocket(0, 5.0), pocket(1, 5.0), pocket(2, 5.0), pocket(3, 5.0)]));
    faces
}

/// Three squares and four triangles between the corners of an octahedron, two at each edge, which have no inside.
fn twisted() -> Vec<Value> {
    let (x, y, z) =
        ([[1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]], [[0.0, 1.0, 1.0], [0.0, -1.0, 1.0]], [[0.0, 0.0, 2.0], [0.0, 0.0, 0.0]]);
    vec![
        face("a", "wall", &[x[0], y[0], x[1], y[1]]),
        face("b", "wall", &[y[0], z[0], y[1], z[1]]),
        face("c", "wall", &[z[0], x[0], z[1], x[1]]),
        face("d", "wall", &[x[0], y[0], z[0]]),
        face("e", "wall", &[x[0], y[1], z[1]]),
        face("f", "wall", &[x[1], y[0], z[1]]),
        face("g", "wall", &[x[1], y[1], z[0]]),
    ]
}

/// A leaning square twice, divided along one diagonal and along the other.
fn flat() -> Vec<Value> {
    let c = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 2.0], [0.0, 2.0, 2.0]];
    let triangles = [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]];
    triangles.iter().enumerate().map(|(k, of)| face(&format!("{k}"), "wall", &of.map(|n: usize| c[n]))).collect()
}

#[test]
fn faults_of_faces_have_places() {
    let good = || of_faces(box_faces());
    let changed = |pointer: &str, value: Value| with(good(), pointer, value);
    let added = |more: Value| changed("/room/faces/-", more);
    let moved = |factor: f64, up: f64| {
        let mut faces = box_faces();
        for corner in faces.iter_mut().flat_map(|face| face["boundary_m"].as_array_mut().unwrap()) {
            let [x, y, z] = [0, 1, 2].map(|axis| corner[axis].as_f64().unwrap() * factor);
            *corner = json!([x, y, z + up]);
        }
        of_faces(faces)
    };
    let mut no_roof = box_faces();
    no_roof.pop();
    let mut apart = box_faces();
    for mut face in box_faces() {
        let corners = face["boundary_m"].as_array_mut().unwrap();
        for axis in corners.iter_mut().flat_map(|corner| corner.as_array_mut().unwrap()) {
            *axis = json!(1.0 + 0.2 * axis.as_f64().unwrap());
        }
        face["name"] = json!(format!("inner_{}", face["name"].as_str().unwrap()));
        apart.push(face);
    }
    let circle = |count: usize, radius: f64| -> Vec<[f64; 3]> {
        let at = |k: usize| std::f64::consts::TAU * k as f64 / count as f64;
        (0..count).map(|k| [2.0 + radius * at(k).cos(), 1.5 + radius * at(k).sin(), 0.0]).collect()
    };
    let mut twice = changed("/room/faces/2/surface", json!({ "reflectance": 0.3 }));
    twice["room"]["surfaces"] = json!({ "east": { "reflectance": 0.3 } });
    let faces = "/room/faces";
    let (floor, hole) = ("/room/faces/0/boundary_m", "/room/faces/0/holes_m");
    for (document, pointer, words) in [
        (of_faces(no_roof), faces, "4 edges: from (4, 0, 2.7) to (0, 0, 2.7) of `south`"),
        (added(box_faces()[2].clone()), "/room/faces/6/name", "must be unique"),
        (added(with(box_faces()[2].clone(), "/name", json!("copy"))), "/room/faces/6", "`east`"),
        (changed("/room/faces/0/name", json!("")), "/room/faces/0/name", "1..100"),
        (of_faces(box_faces()[..3].to_vec()), faces, "at least 4"),
        (of_faces(vec![box_faces()[0].clone(); 2001]), faces, "2000"),
        (changed(floor, json!(circle(257, 1.0))), floor, "3..256"),
        (changed(hole, json!([circle(253, 0.5)])), hole, "256 corners"),
        (changed(hole, json!(vec![circle(3, 0.5); 65])), hole, "64 holes"),
        (changed(hole, json!([[[5, 1, 0], [6, 1, 0], [6, 2, 0]]])), "/room/faces/0/holes_m/0", "outside the outline"),
        (changed(hole, json!([[[3, 1, 0], [6, 1, 0], [6, 2, 0]]])), "/room/faces/0/holes_m/0", "meet at (4."),
        (changed(hole, json!([[[3, 1, 0], [2, 1, 0], [3, 1, 0]]])), "/room/faces/0/holes_m/0", "fewer than 3"),
        (changed(floor, json!([[0, 0, 0], [4, 0, 0], [2, 0, 0]])), floor, "no area"),
        (changed(floor, json!([[0, 0, 0], [4, 0, 0], [1, 3, 0], [4, 2, 0]])), floor, "cross or touch"),
        (changed("/room/faces/5/boundary_m/2/2", json!(2.71)), "/room/faces/5/boundary_m", "from the face's plane"),
        (changed("/room/faces/0/boundary_m/1/0", json!(1e7)), "/room/faces/0/boundary_m/1/0", "1000000"),
        (moved(1.0, 3.5), faces, "subtract 3.5 from every z"),
        (moved(1000.0, 0.0), faces, "4000 looks like millimetres: 4"),
        (of_faces(apart), faces, "2 closed surfaces"),
        (of_faces(twisted()), faces, "twist"),
        (of_faces(flat()), faces, "no volume"),
        (of_faces(pierced()), "/room/faces/6", "crosses the face `east` at (4"),
        (changed("/room/size_m", json!([4, 3, 2.7])), faces, "size_m"),
        (changed("/room/ceiling", json!({ "kind": "flat", "height_m": 2 })), "/room/ceiling", "without a `plan`"),
        (twice, "/room/faces/2/surface", "must be left out"),
        (
            changed("/room/surfaces", json!({ "rof": { "reflectance": 0.3 } })),
            "/room/surfaces/rof",
            "did you mean `roof`",
        ),
        (changed("/room/faces/5/surface", json!({ "open": true })), "/room/faces/5/surface/open", "closed face"),
        (changed("/tubes/0/face", json!("east")), "/tubes/0/face", "`roof`"),
    ] {
        let found = errors(&document).0;
        assert!(found.len() == 1, "{pointer}: {found:?}");
        assert!(found[0].pointer == pointer && found[0].detail.contains(words), "{pointer}, {words}: {found:?}");
    }
    let inner = face("inner", "wall", &[corner(0), corner(2), corner(6), corner(4)]);
    let [open, crowded] = &errors(&added(inner)).0[..] else { panic!("two faults") };
    assert!(open.detail.contains("2 edges: from (0, 0, 0) to (4, 3, 0) of `inner`"), "{open}");
    assert!(crowded.detail.contains("(0, 0, 2.7) of `south`, `west`, `inner`"), "{crowded}");
    let many =
        (0..30).map(|k| face(&format!("{k}"), "wall", &[[0.0, 0.0, f64::from(k)], corner(1), corner(2)])).collect();
    let error = &errors(&of_faces(many)).0[0];
    assert!(error.detail.contains("60 edges") && error.detail.contains("and 40 more"), "{error}");
    let missing = errors(&job(json!({}))).0;
    assert_eq!((missing[0].pointer.as_str(), missing[0].code), ("/room/size_m", FieldErrorCode::Missing));
}

/// Faces that are level but for rounding are level: a tube needs no drop. With more than a millionth of the extent it does.
#[test]
fn level_faces_with_noise_are_level() {
    let with_noise = |noise: f64| {
        let mut faces = box_faces();
        let up = |at: &mut Value| {
            if *at == json!([4.0, 3.0, 2.7]) {
                at[2] = json!(2.7 + noise);
            }
        };
        faces.iter_mut().flat_map(|face| face["boundary_m"].as_array_mut().unwrap()).for_each(up);
        of_faces(faces)
    };
    for noise in [1e-7, -3e-6] {
        let (scene, repairs) = scene(&with_noise(noise));
        assert!(repairs.is_empty(), "{repairs:?}");
        assert_eq!(scene.room.enclosure.faces()[5].polygon.normal(), -DVec3::Z);
        assert_near(measures(&scene.room.enclosure), OF_BOX, 1e-4);
    }
    refused(&with_noise(1e-4), "/tubes/0/drop_m", FieldErrorCode::Invalid);
}

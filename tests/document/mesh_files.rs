//! Mesh objects from files as other programs write them: in other axes, far from their origin, with wrapped lines.

use std::collections::HashMap;
use std::sync::Arc;

use crate::given::{mesh_tube, with};
use crate::schema::parse;
use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{FieldError, FileSource, WarningCode, to_scene};
use skyduct::engine::prepare::prepare;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::scene::Scene;

/// Files by their names.
struct Files(HashMap<&'static str, Vec<u8>>);

impl FileSource for Files {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let bytes = self.0.get(id).ok_or("no such file")?;
        parse_obj(bytes, ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// The top of a table, drawn in a room of 4 m x 3 m x 2.7 m.
const TABLE: &str = "v 1.2 1.1 0.74\nv 2.8 1.1 0.74\nv 2.8 1.9 0.74\nv 1.2 1.9 0.74\nusemtl top\nf 1 2 3 4\n";

fn files() -> Files {
    let moved = "v 500001.200 5800001.100 0.740\nv 500002.800 5800001.100 0.740\nv 500002.800 5800001.900 0.740\n\
                 v 500001.200 5800001.900 0.740\nusemtl top\nf 1 2 3 4\n";
    let feet = "v 1500000.125 19000000.25 0.375\nv 1500001.125 19000000.25 0.375\nv 1500001.125 19000001.25 0.375\n\
                v 1500000.125 19000001.25 0.375\nusemtl top\nf 1 2 3 4\n";
    let turned = "v 1.2 0.74 -1.1\nv 2.8 0.74 -1.1\nv 2.8 0.74 -1.9\nv 1.2 0.74 -1.9\nusemtl top\nf 1 2 3 4\n";
    Files(HashMap::from([
        ("plain", TABLE.into()),
        ("flag", "v 0 0 0\nv 1 0 0\nv 0 0.5 0\nusemtl top\nf 1 2 3\n".into()),
        ("feet", feet.into()),
        ("survey", moved.into()),
        ("y_up", turned.into()),
        ("wrapped", TABLE.replace("2 3", "2 \\\n 3").into()),
        ("returns", TABLE.replace('\n', "\r").into()),
        (
            "utf16",
            "\u{feff}"
                .chars()
                .chain(TABLE.chars())
                .collect::<String>()
                .encode_utf16()
                .flat_map(u16::to_le_bytes)
                .collect(),
        ),
        ("nameless", TABLE.replace("usemtl top", "usemtl ").into()),
    ]))
}

fn room(mesh: &str) -> Value {
    json!({
        "sky": { "cie_type": 16, "sun_position": { "altitude_deg": 35, "azimuth_deg": 180 } },
        "room": { "size_m": [4, 3, 2.7], "objects": [{ "kind": "mesh", "mesh": mesh, "unit": "m", "position_m": [0, 0, 0],
                  "surfaces": { "top": { "reflectance": 0.5 } } }] },
        "tubes": [{ "centre_m": [2, 1.5], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
                    "collector": { "kind": "dome", "transmittance": 0.92 },
                    "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }],
        "grids": [{ "name": "g", "height_m": 0.5, "cells": [8, 6] }]
    })
}

fn scene(document: &Value) -> Result<Scene, Vec<FieldError>> {
    let scene = parse(document).and_then(|document| to_scene(&document, &files()));
    scene.map(|(scene, ..)| scene).map_err(|errors| errors.0)
}

/// Whatever the file, the table stands where it was drawn.
#[test]
fn every_file_is_the_same_table() {
    let in_survey = with(room("survey"), "/room/objects/0/position_m", json!([-500_000, -5_800_000, 0]));
    let y_up = with(room("y_up"), "/room/objects/0/up", json!("y"));
    let nameless = with(room("nameless"), "/room/objects/0/surfaces", json!({ "": { "reflectance": 0.5 } }));
    let plain = scene(&room("plain")).unwrap();
    for document in [in_survey, y_up, nameless, room("wrapped"), room("returns"), room("utf16")] {
        let scene = scene(&document).unwrap_or_else(|errors| panic!("{errors:?}"));
        let [mesh, table] = [&scene, &plain].map(|scene| &scene.room.meshes[0].mesh);
        assert_eq!((mesh.triangles.len(), &mesh.triangle_materials), (2, &table.triangle_materials));
        let corners = |mesh: &TriangleMesh| {
            mesh.triangles.concat().iter().map(|k| mesh.positions[*k as usize]).collect::<Vec<_>>()
        };
        for (found, drawn) in corners(mesh).into_iter().zip(corners(table)) {
            assert!(found.distance(drawn) < 2e-9, "{document}: {found} {drawn}");
        }
    }
}

/// What fits into the room with another axis up, or moved by millimetres, is told so.
#[test]
fn hints_at_other_axes_and_places() {
    let details = |document: &Value| -> String {
        let errors = scene(document).expect_err("a bad document");
        errors.into_iter().map(|error| format!("{}: {}\n", error.pointer, error.detail)).collect()
    };
    let turned = details(&room("y_up"));
    assert!(
        turned.contains("inside the room (0..2.7 m)") && turned.contains("`\"up\": \"y\"` it would fit"),
        "{turned}"
    );
    // neither axis helps here
    assert!(!details(&room("survey")).contains("would fit"));
    let moved = details(&with(room("plain"), "/room/objects/0/position_m", json!([0, 500, 0])));
    assert!(moved.contains("500 looks like millimetres: 0.5"), "{moved}");
    assert!(scene(&with(room("plain"), "/room/objects/0/up", json!("x"))).is_err());
}

/// A pipe whose file has y up, and one that is drawn beside its origin.
#[test]
fn tubes_in_other_axes() {
    let mut lines = String::new();
    for [x, y] in [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]] {
        lines += &format!("v {x} 0 {}\nv {x} 1 {}\n", -y, -y);
    }
    lines +=
        "usemtl a/b\nf 1 3 4 2\nf 3 5 6 4\nf 5 7 8 6\nf 7 1 2 8\nusemtl cover\nf 2 4 6 8\nusemtl diffuser\nf 1 3 5 7\n";
    let aside = lines.replace("v -0.1", "v 9.9").replace("v 0.1", "v 10.1");
    let files = Files(HashMap::from([("pipe", lines.into()), ("aside", aside.into())]));
    let mut document = room("none");
    document["room"]["objects"] = json!([]);
    document["tubes"] = json!([with(mesh_tube(), "/up", json!("y"))]);
    let found = |document: &Value| to_scene(&parse(document).unwrap(), &files);
    assert!(found(&document).is_ok());
    let refused = |pointer: &str, value: Value| found(&with(document.clone(), pointer, value)).unwrap_err().to_string();
    let lying = refused("/tubes/0/up", json!("z"));
    assert!(lying.contains("`\"up\": \"y\"` it would fit"), "{lying}");
    let aside = refused("/tubes/0/mesh", json!("aside"));
    assert!(aside.contains("origin must be the centre of the opening") && aside.contains("move the mesh"), "{aside}");
}

/// Corners of the triangles of a room's first mesh.
fn corners(document: &Value) -> Vec<DVec3> {
    let scene = scene(document).unwrap_or_else(|errors| panic!("{document}: {errors:?}"));
    let mesh = &scene.room.meshes[0].mesh;
    mesh.triangles.concat().iter().map(|corner| mesh.positions[*corner as usize]).collect()
}

fn object(fields: Value) -> Value {
    let mut document = room("flag");
    let object = document["room"]["objects"][0].as_object_mut().unwrap();
    object.remove("unit");
    object.extend(fields.as_object().unwrap().clone());
    document
}

/// Coordinates of a survey, in feet, lose no digit: the difference to the offset is taken before they are scaled.
#[test]
fn an_offset_is_subtracted_before_anything_rounds() {
    let document = object(
        json!({ "mesh": "feet", "unit": "ft", "scale": 2, "offset": [1.5e6, 19e6, 0], "position_m": [1, 1, 0.5] }),
    );
    let feet = |x: f64, y: f64| DVec3::new(1.0 + x * 0.6096, 1.0 + y * 0.6096, 0.5 + 0.375 * 0.6096);
    let square = [feet(0.125, 0.25), feet(1.125, 0.25), feet(1.125, 1.25), feet(0.125, 1.25)];
    for corner in corners(&document) {
        assert!(square.iter().any(|drawn| drawn.distance(corner) < 1e-15), "{corner} {square:?}");
    }
}

/// A mesh that stands on the floor is inside a room that is no box, too, though rounding of far coordinates puts its corners below.
#[test]
fn corners_may_lie_beyond_a_face_by_rounding() {
    for step in 0..40 {
        let floor = 19_144_117.0 + 0.37 * f64::from(step);
        let file = format!(
            "v 40 40 {floor}\nv 60 40 {floor}\nv 40 60 {floor}\nv 45 45 {}\nusemtl top\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 3 1 4\n",
            floor + 30.0
        );
        let mut document = room("post");
        let object = document["room"]["objects"][0].take();
        let outline = [[0, 0], [4, 0], [4, 3], [1, 3], [1, 2], [0, 2]];
        document["room"] = json!({ "plan": { "outline_m": outline }, "ceiling": { "kind": "flat", "height_m": 2.7 } });
        let to_nanometres = (-floor * 0.0254e9).round() / 1e9;
        let object = with(object, "/position_m", json!([0, 0, to_nanometres]));
        document["room"]["objects"] = json!([with(object, "/unit", json!("in"))]);
        let files = Files(HashMap::from([("post", file.into_bytes())]));
        to_scene(&parse(&document).unwrap(), &files).unwrap_or_else(|errors| panic!("{errors}"));
    }
}

/// Each angle is clockwise seen from the positive end of its axis, and the turns follow each other about x, y and z of the room.
#[test]
fn meshes_turn_about_all_axes() {
    let is_at = |fields: Value, expected: [[f64; 3]; 3]| {
        let mut fields = fields;
        fields["position_m"] = json!([2, 1.5, 1.25]);
        let found = corners(&object(fields.clone()));
        for (found, [x, y, z]) in found.iter().zip(expected) {
            let expected = DVec3::new(2.0 + x, 1.5 + y, 1.25 + z);
            assert!(found.distance(expected) < 1e-15, "{fields}: {found} {expected}");
        }
    };
    // the corners of the file: the origin, 1 m along x, and 0.5 m along y
    is_at(json!({ "unit": "m" }), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.5, 0.0]]);
    is_at(json!({ "scale": 0.5 }), [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0], [0.0, 0.25, 0.0]]);
    is_at(json!({ "unit": "m", "up": "y" }), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.5]]);
    for about_z in [json!(90), json!([0, 0, 90])] {
        is_at(json!({ "unit": "m", "rotation_deg": about_z }), [[0.0, 0.0, 0.0], [0.0, -1.0, 0.0], [0.5, 0.0, 0.0]]);
    }
    is_at(json!({ "unit": "m", "rotation_deg": [90, 0, 0] }), [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -0.5]]);
    is_at(json!({ "unit": "m", "rotation_deg": [0, 90, 0] }), [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.5, 0.0]]);
    // x goes up about y, and stays about z; y goes to -z about x, to x about y, to -y about z
    is_at(json!({ "unit": "m", "rotation_deg": [90, 90, 90] }), [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -0.5, 0.0]]);
}

/// What is out of bounds is refused at its place with the bound; a survey's coordinates bring the offset that helps.
#[test]
fn bad_frames_are_refused_with_their_bounds() {
    for (fields, pointer, words) in [
        (json!({}), "unit", "required"),
        (json!({ "scale": 0 }), "scale", "within 0.000000001..1000000"),
        (json!({ "scale": -1 }), "scale", "within"),
        (json!({ "unit": "m", "rotation_deg": [0, 0, 400] }), "rotation_deg/2", "within -360..360, but is 400"),
        (json!({ "unit": "m", "rotation_deg": [0, 90] }), "rotation_deg", "a number or [x, y, z]"),
        (json!({ "unit": "m", "rotation_deg": { "x": 1 } }), "rotation_deg", "a number or [x, y, z]"),
        (json!({ "unit": "m", "offset": [0, 1e13, 0] }), "offset/1", "within"),
        (
            json!({ "unit": "m", "back_surfaces": { "lid": { "reflectance": 0.5 } } }),
            "back_surfaces/lid",
            "no material",
        ),
        (json!({ "unit": "m", "back_surfaces": { "top": { "open": true } } }), "back_surfaces/top/open", "only a face"),
        (json!({ "unit": "m", "scale": 4.5 }), "position_m/0", "with the unit `m` and the scale 4.5, the mesh must be"),
        (json!({ "mesh": "survey", "scale": 1 }), "position_m/0", "with `\"offset\": [500001.2, 5800001.1, 0.74]`"),
    ] {
        let errors = scene(&object(fields.clone())).expect_err("a bad document");
        let pointer = format!("/room/objects/0/{pointer}");
        let found = errors.iter().find(|error| error.pointer == pointer);
        let found = found.unwrap_or_else(|| panic!("{fields}: nothing at {pointer}: {errors:?}"));
        assert!(found.detail.contains(words), "{fields}: {found}");
    }
}

/// An object that stands before an opening is named with what it covers; a table below it, and a cupboard beside it, are not.
#[test]
fn objects_before_an_opening_are_named() {
    let warnings = |objects: Value, drop_m: f64| -> Vec<String> {
        let mut document = with(room("plain"), "/room/objects", objects);
        document["tubes"][0]["drop_m"] = json!(drop_m);
        let job = prepare(document.to_string().as_bytes(), &files()).unwrap_or_else(|errors| panic!("{errors:?}"));
        let of_openings = job.warnings.iter().filter(|warning| warning.code == WarningCode::OpeningCovered);
        of_openings.map(|warning| warning.detail.clone()).collect()
    };
    let table = |height: f64| json!({ "kind": "mesh", "mesh": "plain", "unit": "m", "position_m": [0, 0, height - 0.74], "surfaces": { "top": { "reflectance": 0.5 } } });
    let cupboard = |x: f64| json!({ "kind": "box", "size_m": [0.6, 1, 2.2], "position_m": [x, 1.5, 0], "surface": { "reflectance": 0.5 } });
    assert_eq!(warnings(json!([table(0.74), cupboard(2.7)]), 0.0), Vec::<String>::new());
    let told = warnings(json!([cupboard(2.7), table(2.2)]), 0.0);
    assert!(told.len() == 1 && told[0].starts_with("/room/objects/1 stands under the opening of /tubes/0"), "{told:?}");
    assert!(told[0].contains("covers 100 % of it, 0.500 m from it"), "{told:?}");
    // a disc less a segment that begins at 2/7 of the radius is 68 % of it; the lattice has 64 points
    let told = warnings(json!([table(0.74), cupboard(2.25)]), 0.0);
    assert!(
        told.len() == 1 && told[0].starts_with("/room/objects/1 stands under") && told[0].contains("covers 69 %"),
        "{told:?}"
    );
    // the pipe of an opening that hangs comes through what is above it
    let told = warnings(json!([table(2.2)]), 1.0);
    assert!(told.len() == 1 && told[0].starts_with("/room/objects/0 stands over the opening of /tubes/0"), "{told:?}");
}

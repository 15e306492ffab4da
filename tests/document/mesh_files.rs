//! Mesh objects from files as other programs write them: in other axes, far from their origin, with wrapped lines.

use std::collections::HashMap;
use std::sync::Arc;

use crate::given::{mesh_tube, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::{FieldError, FileSource, to_scene};
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
    let turned = "v 1.2 0.74 -1.1\nv 2.8 0.74 -1.1\nv 2.8 0.74 -1.9\nv 1.2 0.74 -1.9\nusemtl top\nf 1 2 3 4\n";
    Files(HashMap::from([
        ("plain", TABLE.into()),
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

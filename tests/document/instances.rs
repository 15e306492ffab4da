//! Instances of mesh objects: what they become, and what is refused.

use std::sync::Arc;

use crate::given::{base, with};
use crate::schema::parse;
use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{FieldError, FieldErrorCode, FileSource, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::scene::MeshObject;

/// A closed block of 0.2 m x 0.1 m x 0.1 m, and a plate of 0.6 m x 0.6 m.
struct Files;

impl FileSource for Files {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        let block = "v 0 0 0\nv 0.2 0 0\nv 0 0.1 0\nv 0.2 0.1 0\nv 0 0 0.1\nv 0.2 0 0.1\nv 0 0.1 0.1\nv 0.2 0.1 0.1\n\
                     usemtl wood\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
        let plate = "v 0 0 0\nv 0.6 0 0\nv 0.6 0.6 0\nv 0 0.6 0\nusemtl wood\nf 1 2 3 4\n";
        let text = if id == "plate" { plate } else { block };
        parse_obj(text.as_bytes(), ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

fn mesh(name: &str, fields: Value) -> Value {
    let mut object =
        json!({ "kind": "mesh", "mesh": name, "unit": "m", "surfaces": { "wood": { "reflectance": 0.5 } } });
    object.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
    object
}

fn objects(objects: Value) -> Result<Vec<MeshObject>, Vec<FieldError>> {
    let document = parse(&with(base(), "/room/objects", objects)).map_err(|errors| errors.0)?;
    to_scene(&document, &Files).map(|(scene, ..)| scene.room.meshes).map_err(|errors| errors.0)
}

fn corners(objects: &[MeshObject]) -> Vec<DVec3> {
    objects.iter().flat_map(MeshObject::triangles).flat_map(|(corners, _)| corners).collect()
}

/// Each instance is the object turned by the rotation of both and put at its place; the mesh is there once.
#[test]
fn instances_are_objects_at_their_places() {
    let places = [([0.5, 0.5, 0.0], json!(30)), ([1.0, 1.5, 0.7], json!([40, 0, 10])), ([1.5, 0.4, 0.2], json!(0))];
    let place = |(position, turn): &([f64; 3], Value)| json!({ "position_m": position, "rotation_deg": turn });
    let once = objects(json!([mesh("block", json!({ "instances": places.each_ref().map(place) }))])).unwrap();
    let copies = places.each_ref().map(|at| mesh("block", place(at)));
    let copies = objects(json!(copies)).unwrap();
    assert_eq!((once.len(), once[0].mesh.triangles.len(), once[0].kept_triangles()), (1, 0, 12));
    let [found, expected] = [corners(&once), corners(&copies)];
    assert_eq!(found.len(), expected.len());
    assert!(found.iter().zip(&expected).all(|(found, expected)| found.distance(*expected) < 1e-15), "{found:?}");
    // the object's own rotation comes first
    let turned = mesh(
        "block",
        json!({ "rotation_deg": [90, 0, 0], "instances": [{ "position_m": [1, 1, 1], "rotation_deg": 90 }] }),
    );
    let both = mesh("block", json!({ "position_m": [1, 1, 1], "rotation_deg": [90, 0, 90] }));
    let [found, expected] = [turned, both].map(|object| corners(&objects(json!([object])).unwrap()));
    assert!(found.iter().zip(&expected).all(|(found, expected)| found.distance(*expected) < 1e-15), "{found:?}");
}

/// Where an instance stands on another mesh, its part there is hidden as that of a copy is; the others stay one mesh.
#[test]
fn instances_that_touch_are_copies() {
    let plate = mesh("plate", json!({ "position_m": [0.2, 0.2, 0.3] }));
    let places =
        json!([{ "position_m": [0.3, 0.3, 0.3] }, { "position_m": [1.5, 1.5, 0] }, { "position_m": [1.2, 0.5, 0.5] }]);
    let once = objects(json!([mesh("block", json!({ "instances": places })), plate])).unwrap();
    let copy = |place: &Value| mesh("block", place.clone());
    let mut all: Vec<Value> = places.as_array().unwrap().iter().map(copy).collect();
    all.push(plate);
    let copies = objects(json!(all)).unwrap();
    let [shared, _] = &once[..] else { panic!("two objects") };
    assert_eq!((shared.copied_triangles(), shared.mesh.triangles.len()), (24, copies[0].mesh.triangles.len()));
    let area = |objects: &[MeshObject]| -> f64 {
        objects.iter().flat_map(MeshObject::triangles).map(|([a, b, c], _)| 0.5 * (b - a).cross(c - a).length()).sum()
    };
    // the lower side of one block lies on the plate
    let expected = 0.36 + 3.0 * 2.0 * (0.02 + 0.02 + 0.01) - 0.02;
    assert!((area(&once) - expected).abs() < 1e-9 && (area(&copies) - expected).abs() < 1e-9, "{}", area(&once));
}

#[test]
fn bad_instances_are_refused() {
    let place = json!({ "position_m": [1, 1, 0] });
    let many = |count: usize| Value::from(vec![place.clone(); count]);
    for (objects_given, pointer, code, words) in [
        (json!([mesh("block", json!({}))]), "0/position_m", FieldErrorCode::Missing, "required"),
        (
            json!([mesh("block", json!({ "position_m": [1, 1, 0], "instances": [place] }))]),
            "0/position_m",
            FieldErrorCode::Invalid,
            "left out",
        ),
        (json!([mesh("block", json!({ "instances": [] }))]), "0/instances", FieldErrorCode::Invalid, "at least one"),
        (
            json!([mesh("block", json!({ "instances": many(1025) }))]),
            "0/instances",
            FieldErrorCode::TooMany,
            "at most 1024",
        ),
        (
            json!([mesh("block", json!({ "instances": [place, { "position_m": [1, 9, 0] }] }))]),
            "0/instances/1/position_m/1",
            FieldErrorCode::Invalid,
            "inside the room",
        ),
        (
            json!([mesh("block", json!({ "instances": [{ "position_m": [1, 1, 0], "rotation_deg": [0, 500, 0] }] }))]),
            "0/instances/0/rotation_deg/1",
            FieldErrorCode::OutOfRange,
            "-360..360",
        ),
        (
            json!([
                mesh("block", json!({ "instances": many(1000) })),
                mesh("block", json!({ "instances": many(1000) })),
                mesh("block", json!({ "instances": many(49) }))
            ]),
            "2/instances",
            FieldErrorCode::TooMany,
            "at most 2048",
        ),
    ] {
        let errors = objects(objects_given).unwrap_err();
        let pointer = format!("/room/objects/{pointer}");
        assert!(errors.len() == 1 && errors[0].pointer == pointer && errors[0].code == code, "{pointer}: {errors:?}");
        assert!(errors[0].detail.contains(words), "{words}: {errors:?}");
    }
}

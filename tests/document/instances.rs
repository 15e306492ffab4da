//! Instances of mesh objects: what they become, and what is refused.

use std::sync::Arc;

use crate::given::{base, with};
use crate::schema::parse;
use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::result::{MeshPartResult, MeshRole, MeshesResult};
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
        let net = net();
        let text = match id {
            "plate" => plate,
            "net" => &net,
            _ => block,
        };
        parse_obj(text.as_bytes(), ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

/// A net of 1 m x 1 m of 130 x 130 squares, in waves of 0.1 m.
fn net() -> String {
    let corner = |k: usize| {
        let [x, y] = [k % 131, k / 131].map(|at| at as f64 / 130.0);
        format!("v {x} {y} {}\n", 0.05 + 0.05 * (12.0 * x).sin())
    };
    let square = |k: usize| {
        let first = k / 130 * 131 + k % 130 + 1;
        format!("f {first} {} {} {}\n", first + 1, first + 132, first + 131)
    };
    let corners: String = (0..131 * 131).map(corner).collect();
    corners + "usemtl wood\n" + &(0..130 * 130).map(square).collect::<String>()
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

/// Meshes that are drawn stand where those stand that are traced, with the surfaces of both sides; of too many triangles some are merged, and
/// the mesh keeps its area and its place to a cell.
#[test]
fn meshes_are_drawn_where_they_stand() {
    let drawn = |objects: Value, numbers: &[usize]| {
        let document = parse(&with(base(), "/room/objects", objects)).unwrap();
        let (scene, ..) = to_scene(&document, &Files).unwrap();
        let found = MeshesResult::new(&scene, numbers);
        let triangles = |part: &MeshPartResult| {
            let at = |corner: u32| DVec3::from(part.corners_m[corner as usize].map(f64::from));
            part.triangles.iter().map(|corners| corners.map(at)).collect::<Vec<_>>()
        };
        let of_parts = found.meshes.iter().flat_map(|mesh| &mesh.parts).map(triangles).collect::<Vec<_>>();
        let traced: Vec<[DVec3; 3]> =
            scene.room.meshes.iter().flat_map(MeshObject::triangles).map(|(corners, _)| corners).collect();
        (found, of_parts.concat(), traced)
    };
    let [grey, black] = [0.5, 0.1].map(|reflectance| json!({ "reflectance": reflectance }));
    let block = json!({ "kind": "box", "size_m": [0.1, 0.1, 0.1], "position_m": [1.8, 1.8, 0], "surface": grey });
    let places = [0.3, 0.9].map(|x| json!({ "position_m": [x, 0.5, 0.4], "rotation_deg": [10, 20, 30] }));
    let copies = mesh("block", json!({ "instances": places }));
    let plate = mesh("plate", json!({ "position_m": [1.2, 1.2, 1.0], "back_surfaces": { "wood": black } }));
    let (found, shown, traced) = drawn(json!([block, copies, plate]), &[1, 2]);
    let pointers: Vec<&str> = found.meshes.iter().map(|mesh| mesh.pointer.as_str()).collect();
    assert_eq!((pointers, found.triangles, found.cell_m), (vec!["/room/objects/1", "/room/objects/2"], 26, None));
    assert_eq!(shown.len(), 26);
    let near = |a: &[DVec3; 3], b: &[DVec3; 3]| (0..3).all(|k| a[k].distance(b[k]) < 1e-6);
    assert!(traced.iter().all(|triangle| shown.iter().any(|other| near(triangle, other))));
    let [sides] = &found.meshes[1].parts[..] else { panic!("one part") };
    assert_eq!(
        (sides.role, sides.reflectance, sides.back_reflectance),
        (MeshRole::Object, Some([0.5; 3]), Some([0.1; 3]))
    );

    let area = |of: &[[DVec3; 3]]| of.iter().map(|[a, b, c]| 0.5 * (*b - *a).cross(*c - *a).length()).sum::<f64>();
    let (found, shown, traced) = drawn(json!([mesh("net", json!({ "position_m": [0.5, 0.5, 0.5] }))]), &[0]);
    let cell_m = found.cell_m.unwrap();
    assert!(found.triangles == 33_800 && shown.len() <= 30_000 && shown.len() > 3_000, "{} {cell_m}", shown.len());
    assert!(cell_m < 0.03 && (area(&shown) / area(&traced) - 1.0).abs() < 0.05, "{cell_m} {}", area(&shown));
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

//! Rooms of Honeybee models: what they become, what is repaired and told, and the place of every fault.

use std::sync::Arc;

use crate::faces::{OF_BOX, assert_near, box_faces, job, measures, of_faces, scene};
use crate::given::{errors, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::hbjson::read_room;
use skyduct::document::{DocumentErrors, FileSource, JobDocument, WarningCode, to_scene};
use skyduct::geometry::TriangleMesh;

/// A model in millimetres, on the second level, with a window, a door, a shade and an air boundary.
fn model() -> Value {
    let types = ["Floor", "Wall", "AirBoundary", "Wall", "Wall", "RoofCeiling"];
    let faces = box_faces().into_iter().zip(types).map(|(face, face_type)| {
        let corner = |corner: &Value| {
            let [x, y, z] = [0, 1, 2].map(|axis| 1000.0 * corner[axis].as_f64().unwrap());
            json!([x, y, z + 3450.0])
        };
        let boundary: Vec<Value> = face["boundary_m"].as_array().unwrap().iter().map(corner).collect();
        json!({ "type": "Face", "identifier": face["name"], "face_type": face_type, "boundary_condition": { "type": "Outdoors" },
                "geometry": { "type": "Face3D", "boundary": boundary } })
    });
    let mut faces: Vec<Value> = faces.collect();
    faces[1]["apertures"] = json!([{ "type": "Aperture" }, { "type": "Aperture" }]);
    faces[3]["doors"] = json!([{ "type": "Door" }]);
    // within the model's tolerance
    faces[5]["geometry"]["boundary"][0][0] = json!(0.008);
    let room = json!({ "type": "Room", "identifier": "Room_1", "display_name": "Office", "faces": faces,
                       "indoor_shades": [{ "type": "Shade" }] });
    let other = json!({ "type": "Room", "identifier": "Room_2", "faces": [] });
    json!({ "type": "Model", "identifier": "house", "units": "Millimeters", "tolerance": 0.01, "rooms": [room, other] })
}

#[test]
fn rooms_of_honeybee_models_are_rooms_of_faces() {
    let read = |model: &Value, name: Option<&str>| read_room(model.to_string().as_bytes(), name);
    let room = read(&model(), Some("Office")).unwrap();
    assert_eq!(read(&model(), Some("Room_1")).unwrap(), room);
    let document = of_faces(serde_json::from_value(json!(room.faces)).unwrap());
    let (scene, repairs) = scene(&document);
    assert!(repairs.is_empty(), "{repairs:?}");
    assert_near(measures(&scene.room.enclosure), OF_BOX, 1e-9);
    assert_eq!(document["room"]["faces"][1]["boundary_m"][2], json!([4.0, 0.0, 2.7]));
    let notes = room.notes.join("\n");
    for words in [
        "1 corners within the model's tolerance",
        "moved by -3.45 m along z",
        "2 apertures and 1 doors are opaque",
        "1 air boundaries are walls: `east`",
        "1 shades",
        "reflectances",
    ] {
        assert!(notes.contains(words), "{words}: {notes}");
    }
    let feet = with(model(), "/units", json!("Feet"));
    let in_feet = read(&feet, Some("Room_1")).unwrap_err().0;
    assert!(in_feet[0].detail.contains("extent along x"), "{in_feet:?}");
    for (model, name, pointer, words) in [
        (model(), None, "/rooms", "2 rooms, name one of them: `Room_1`, `Room_2`"),
        (model(), Some("attic"), "/rooms", "no room \"attic\""),
        (model(), Some("Room_2"), "/rooms/1/faces", "at least 4"),
        (with(model(), "/rooms", Value::Null), None, "/rooms", "no rooms"),
        (with(model(), "/units", json!("Furlongs")), None, "/units", "Furlongs"),
        (with(model(), "/tolerance", json!(-1)), Some("Office"), "/tolerance", ">= 0"),
        (with(model(), "/rooms/0/faces/0/face_type", json!("Roof")), None, "/rooms/0/faces/0/face_type", "Roof"),
    ] {
        let found = read(&model, name).unwrap_err().0;
        assert!(found.len() == 1 && found[0].pointer == pointer && found[0].detail.contains(words), "{found:?}");
    }
}

/// A model beside the job's file.
struct House;

impl FileSource for House {
    fn load(&self, id: &str) -> Result<Arc<TriangleMesh>, String> {
        Err(format!("no mesh {id}"))
    }

    fn model(&self, name: &str) -> Result<Vec<u8>, String> {
        match name {
            "house.hbjson" => Ok(model().to_string().into_bytes()),
            "broken.hbjson" => Ok(b"{ \"rooms\": [".to_vec()),
            _ => Err(format!("{name:?} cannot be read")),
        }
    }
}

/// A document that has the model, or the name of its file, is the document of the room's faces; what is left out is told.
#[test]
fn a_document_may_have_a_model() {
    let read = read_room(model().to_string().as_bytes(), Some("Office")).unwrap();
    let faces = job(json!({ "faces": read.faces, "surfaces": { "east": { "reflectance": 0.1 } } }));
    let of_faces = parse(&faces).unwrap();
    for (source, name) in [(model(), "Office"), (model(), "Room_1"), (json!("house.hbjson"), "Room_1")] {
        let room = json!({ "hbjson": source, "identifier": name, "surfaces": { "east": { "reflectance": 0.1 } } });
        let document = JobDocument::from_files(job(room), &House).unwrap();
        assert_eq!(serde_json::to_value(&document).unwrap(), serde_json::to_value(&of_faces).unwrap());
        let (scene, warnings, _) = to_scene(&document, &House).unwrap();
        assert_near(measures(&scene.room.enclosure), OF_BOX, 1e-9);
        let told: Vec<String> = warnings
            .into_iter()
            .map(|warning| {
                assert_eq!(warning.code, WarningCode::ModelChanged);
                warning.detail
            })
            .collect();
        assert_eq!(told, read.notes);
    }
    // a model of one room needs no name, and a repair is told once
    let mut single = model();
    single["rooms"].as_array_mut().unwrap().truncate(1);
    single["rooms"][0]["faces"][1]["geometry"]["boundary"].as_array_mut().unwrap().reverse();
    let document = parse(&job(json!({ "hbjson": single }))).unwrap();
    let (_, warnings, _) = to_scene(&document, &House).unwrap();
    let turned = warnings.iter().filter(|warning| warning.detail.contains("turned"));
    assert_eq!(turned.count(), 1, "{warnings:?}");
}

/// Faults of a model have their places in the document, beside faults of other fields.
#[test]
fn faults_of_a_model_have_their_places_in_the_document() {
    let with_model =
        |pointer: &str, value: Value| json!({ "hbjson": with(model(), pointer, value), "identifier": "Room_1" });
    let mut open_room = model();
    open_room["rooms"][0]["faces"].as_array_mut().unwrap().truncate(5);
    let without_roof = json!({ "hbjson": open_room, "identifier": "Office" });
    for (room, pointer, words) in [
        (json!({ "hbjson": model() }), "/room/identifier", "2 rooms, name one of them"),
        (json!({ "hbjson": model(), "identifier": "attic" }), "/room/identifier", "no room \"attic\""),
        (json!({ "hbjson": model(), "identifier": 1 }), "/room/identifier", "expected a string"),
        (json!({ "hbjson": model(), "size_m": [4, 3, 2.7] }), "/room/hbjson", "left out if there is a `size_m`"),
        (json!({ "hbjson": 7 }), "/room/hbjson", "must be a model"),
        (json!({ "hbjson": "none.hbjson" }), "/room/hbjson", "cannot be read"),
        (json!({ "hbjson": "broken.hbjson" }), "/room/hbjson", "EOF"),
        (json!({ "identifier": "Room_1", "size_m": [4, 3, 2.7] }), "/room/identifier", "unknown field"),
        (with_model("/units", json!("Furlongs")), "/room/hbjson/units", "Furlongs"),
        (
            with_model("/rooms/0/faces/2/geometry/boundary/1", json!("x")),
            "/room/hbjson/rooms/0/faces/2/geometry/boundary/1",
            "invalid",
        ),
        (without_roof, "/room/hbjson/rooms/0/faces", "4 edges"),
        (
            json!({ "hbjson": model(), "identifier": "Room_1", "surfaces": { "rof": { "reflectance": 0.3 } } }),
            "/room/surfaces/rof",
            "did you mean `roof`",
        ),
        (with_model("/rooms/0/faces/5/identifier", json!("")), "/room/hbjson/rooms/0/faces/5/identifier", "character"),
    ] {
        let DocumentErrors(found) = JobDocument::from_files(job(room), &House).expect_err(pointer);
        assert!(found.len() == 1, "{pointer}: {found:?}");
        assert!(found[0].pointer == pointer && found[0].detail.contains(words), "{pointer}, {words}: {found:?}");
    }
    let mut document = job(json!({ "hbjson": model(), "identifier": "attic", "rotation": 5 }));
    document["grids"][0]["cels"] = json!(3);
    let pointers: Vec<String> = errors(&document).0.into_iter().map(|error| error.pointer).collect();
    assert_eq!(pointers, ["/room/identifier", "/grids/0/cels", "/room/rotation"]);
    // a service has no file beside the document
    let DocumentErrors(found) = JobDocument::from_value(job(json!({ "hbjson": "house.hbjson" }))).unwrap_err();
    assert!(found[0].detail.contains("must be a model"), "{found:?}");
}

/// Faces that are planar and level within the model's tolerance are so, on all sides of an edge; others keep their corners.
#[test]
fn faces_are_planar_within_the_tolerance_of_the_model() {
    let raised = |raise: f64, tolerance: f64| {
        let mut model = with(model(), "/tolerance", json!(tolerance));
        let faces = model["rooms"][0]["faces"].as_array_mut().unwrap();
        for corner in faces.iter_mut().flat_map(|face| face["geometry"]["boundary"].as_array_mut().unwrap()) {
            if *corner == json!([4000.0, 3000.0, 6150.0]) {
                corner[2] = json!(6150.0 + raise);
            }
        }
        read_room(model.to_string().as_bytes(), Some("Office"))
    };
    let room = raised(4.0, 5.0).unwrap();
    assert!(room.notes.iter().any(|note| note.contains("moved by up to 2.0e-3 m into the planes")), "{:?}", room.notes);
    let (scene, repairs) = scene(&of_faces(serde_json::from_value(json!(room.faces)).unwrap()));
    assert!(repairs.is_empty(), "{repairs:?}");
    assert_near(measures(&scene.room.enclosure), [32.424, 12.0, 37.828, 12.0], 1e-9);
    let bent = raised(4.0, 0.5).unwrap_err().0;
    assert!(bent[0].pointer == "/rooms/0/faces/5/geometry/boundary" && bent[0].detail.contains("plane"), "{bent:?}");
}

//! Openings in the plane of their face: their places, the directions of their pipes, and the places of every fault.

use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::result::MeshesResult;
use skyduct::document::to_scene;
use skyduct::document::tube_flux::TubeFluxDocument;
use skyduct::scene::{OpeningPlane, Scene, TubeShape};

use crate::given::{SquarePipe, errors, mesh_tube, with};
use crate::schema::parse;

/// An attic of 5 m x 4 m below a slope of 35 degrees that rises toward the north, with a tube through the slope.
fn attic() -> Value {
    json!({
        "sky": { "cie_type": 5, "sun_position": { "altitude_deg": 45, "azimuth_deg": 180 } },
        "room": { "plan": { "outline_m": [[0, 0], [5, 0], [5, 4], [0, 4]] },
                  "ceiling": { "kind": "sloped", "point_m": [0, 0, 2.2], "rise_toward_deg": 0, "pitch_deg": 35 } },
        "tubes": [{ "centre_m": [2.5, 2.0], "normal": "face", "diameter_m": 0.35, "reflectance": 0.98,
                    "segments": [{ "length_m": 1.0 }], "collector": { "kind": "flat", "transmittance": 0.9 },
                    "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }],
        "grids": [{ "name": "desk", "height_m": 0.85, "spacing_m": 1.0 }]
    })
}

/// The attic with a tube through its south wall that bends up.
fn in_wall() -> Value {
    let mut document = attic();
    document["tubes"][0]["centre_m"] = json!([2.5, 0, 1.5]);
    document["tubes"][0]["segments"] = json!([{ "length_m": 0.5 }, { "length_m": 1.0 }]);
    document
}

fn scene(document: &Value) -> Scene {
    to_scene(&parse(document).unwrap(), &SquarePipe).unwrap().0
}

/// Returns the unit normal of an opening out of the room, its centre, and the axes of its segments.
fn place(document: &Value) -> (DVec3, DVec3, Vec<DVec3>) {
    let scene = scene(document);
    let frame = scene.tubes[0].frame(&scene.room.enclosure);
    let TubeShape::Cylinders(cylinders) = &scene.tubes[0].shape else { panic!("a tube of cylinders") };
    assert_eq!(cylinders.cut, None);
    (frame.outward(), frame.origin, cylinders.segments.iter().map(|segment| segment.axis()).collect())
}

/// The pipe runs along the normal of the slope, with its pane across it also where the tilt of the roof is written; of two segments the second
/// one is vertical.
#[test]
fn pipes_run_along_the_normals_of_their_faces() {
    let (sin, cos) = 35f64.to_radians().sin_cos();
    let normal = DVec3::new(0.0, -sin, cos);
    let (outward, origin, axes) = place(&attic());
    assert!(outward.distance(normal) < 1e-12 && axes.len() == 1 && axes[0].distance(normal) < 1e-12);
    assert!(origin.distance(DVec3::new(2.5, 2.0, 2.2 + 2.0 * sin / cos)) < 1e-12);
    let mut of_roof = attic();
    (of_roof["tubes"][0]["collector"]["tilt_deg"], of_roof["tubes"][0]["collector"]["azimuth_deg"]) =
        (json!(35), json!(180));
    assert_eq!(place(&of_roof).2, axes);
    // as many digits as people write
    let near = with(attic(), "/tubes/0/centre_m", json!([2.5, 2.0, 3.6004]));
    assert!(place(&near).1.distance(origin) < 1e-4);

    let (outward, origin, axes) = place(&in_wall());
    assert!(outward.distance(DVec3::NEG_Y) < 1e-12 && origin == DVec3::new(2.5, 0.0, 1.5));
    assert!(axes[0].distance(DVec3::NEG_Y) < 1e-12 && axes[1].distance(DVec3::Z) < 1e-12);
    let named = with(in_wall(), "/tubes/0/face", json!("wall_0"));
    assert_eq!(place(&named).1, origin);
}

/// Below a level ceiling both planes are one.
#[test]
fn a_level_face_has_level_openings() {
    let flat = with(attic(), "/room/ceiling", json!({ "kind": "flat", "height_m": 2.7 }));
    assert_eq!(scene(&flat).tubes[0].plane, OpeningPlane::Level { drop_m: 0.0 });
    let mut plumb = flat.clone();
    plumb["tubes"][0]["normal"] = json!("plumb");
    let written = serde_json::to_value(&parse(&plumb).unwrap().tubes[0]).unwrap();
    assert!(written.get("normal").is_none() && written["centre_m"] == json!([2.5, 2.0]));
    let written = serde_json::to_value(&parse(&in_wall()).unwrap().tubes[0]).unwrap();
    assert!(written["normal"] == "face" && written["centre_m"] == json!([2.5, 0.0, 1.5]));
}

#[test]
fn faults_have_their_places() {
    let wall = |field: &str, value: Value| with(in_wall(), &format!("/tubes/0/{field}"), value);
    let slope = |field: &str, value: Value| with(attic(), &format!("/tubes/0/{field}"), value);
    let mut plumb = in_wall();
    plumb["tubes"][0]["normal"] = json!("plumb");
    plumb["tubes"][0]["drop_m"] = json!(0.5);
    let mut two = in_wall();
    let tube = with(two["tubes"][0].clone(), "/centre_m", json!([2.7, 0, 1.6]));
    two["tubes"].as_array_mut().unwrap().push(tube);
    let surface = json!({ "reflectance": 0.5 });
    let mut cupboard = in_wall();
    cupboard["room"]["objects"] =
        json!([{ "kind": "box", "size_m": [1, 0.4, 2], "position_m": [2.5, 0.2, 0], "surface": surface }]);
    let mut lamp = attic();
    let [sin, cos] = [35f64.to_radians().sin(), 35f64.to_radians().cos()];
    lamp["room"]["luminaires"] = json!([{ "kind": "rectangle", "corner_m": [2.4, 2.0, 2.2 + 2.0 * sin / cos],
        "edge_u_m": [0, 0.3 * cos, 0.3 * sin], "edge_v_m": [0.3, 0, 0], "luminance_cd_m2": 1000 }]);
    let mut partition = in_wall();
    partition["room"]["partitions"] =
        json!([{ "from_m": [2.5, 0], "to_m": [2.5, 2], "height_m": 1.8, "surface": surface }]);
    let mut open = in_wall();
    open["room"]["surfaces"] = json!({ "wall_0": { "open": true } });
    for (document, pointer) in [
        (plumb, "/tubes/0/centre_m"),
        (slope("drop_m", json!(0.1)), "/tubes/0/drop_m"),
        (
            slope("segments", json!([{ "length_m": 1, "tilt_deg": 35, "azimuth_deg": 180 }])),
            "/tubes/0/segments/0/tilt_deg",
        ),
        (slope("centre_m", json!([2.5, 2.0, 3.59])), "/tubes/0/centre_m"),
        (slope("centre_m", json!([2.5, 0.1])), "/tubes/0/diameter_m"),
        (slope("centre_m", json!([2.5])), "/tubes/0/centre_m"),
        (slope("centre_m", json!([2.5, 1, 2, 3])), "/tubes/0/centre_m"),
        (slope("face", json!("roof")), "/tubes/0/face"),
        (slope("face", json!("floor")), "/tubes/0/face"),
        (slope("normal", json!("up")), "/tubes/0/normal"),
        (
            slope("segments", json!([{ "length_m": 0.5 }, { "length_m": 2, "tilt_deg": 120 }])),
            "/tubes/0/segments/1/tilt_deg",
        ),
        (with(wall("face", json!("wall_0")), "/tubes/0/centre_m", json!([2.5, 0.0])), "/tubes/0/centre_m"),
        (wall("centre_m", json!([2.5, 0.0, 0.1])), "/tubes/0/diameter_m"),
        (wall("centre_m", json!([2.5, 0.5, 1.5])), "/tubes/0/centre_m"),
        (wall("segments", json!([{ "length_m": 0.05 }, { "length_m": 1 }])), "/tubes/0/segments/0/length_m"),
        (two, "/tubes/1/centre_m"),
        (cupboard, "/room/objects/0"),
        (lamp, "/room/luminaires/0"),
        (partition, "/room/partitions/0"),
        (open, "/room/surfaces/wall_0/open"),
    ] {
        let found = errors(&document);
        assert!(found.0.iter().any(|error| error.pointer == pointer), "{pointer}: {found:?}");
    }
}

/// The flux of a tube without a room needs the direction of its face, and has the tube that a room with this face has.
#[test]
fn a_tube_without_a_room_has_the_direction_of_its_face() {
    let mut tube = attic()["tubes"][0].clone();
    tube.as_object_mut().unwrap().remove("centre_m");
    let sky = attic()["sky"].clone();
    let request = |face: Value| json!({ "tube": tube, "skies": [sky], "face": face });
    let refused = |request: Value| TubeFluxDocument::from_value(request).unwrap_err().0[0].pointer.clone();
    assert_eq!(refused(json!({ "tube": tube, "skies": [sky] })), "/face");
    assert_eq!(refused(request(json!({ "tilt_deg": 95 }))), "/face/tilt_deg");
    assert_eq!(refused(with(request(json!({ "tilt_deg": 35 })), "/tube/normal", json!("plumb"))), "/face");
    let mut near = request(json!({ "tilt_deg": 35 }));
    let house = json!({ "kind": "box", "size_m": [1, 1, 1], "position_m": [9, 9, 0] });
    near["surroundings"] = json!({ "obstructions": [house] });
    assert_eq!(refused(near), "/surroundings/obstructions");
    for (tilt_deg, azimuth_deg) in [(0.0f64, 0.0f64), (35.0, 180.0), (85.0, -30.0), (90.0, 90.0)] {
        let face = json!({ "tilt_deg": tilt_deg, "azimuth_deg": azimuth_deg });
        let found = TubeFluxDocument::from_value(request(face)).unwrap();
        let (scene, warnings, _) = to_scene(&found.pairs[0].job, &SquarePipe).unwrap();
        let [(level, up), (east, north)] = [tilt_deg, azimuth_deg].map(|angle| angle.to_radians().sin_cos());
        let outward = scene.tubes[0].frame(&scene.room.enclosure).outward();
        assert!(outward.distance(DVec3::new(level * east, level * north, up)) < 1e-12, "{outward}");
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

/// A mesh stands on the plane of its face: its upper end is behind the opening along the normal, and its triangles lie behind that plane.
#[test]
fn meshes_stand_on_their_faces() {
    let sin = 35f64.to_radians().sin();
    for (centre, outward) in
        [(json!([2.5, 2.0]), DVec3::new(0.0, -sin, (1.0 - sin * sin).sqrt())), (json!([2.5, 0, 1.5]), DVec3::NEG_Y)]
    {
        let mut tube = mesh_tube();
        tube["centre_m"] = centre;
        tube["normal"] = json!("face");
        tube["rotation_deg"] = json!(30);
        let scene = scene(&with(attic(), "/tubes/0", tube));
        let frame = scene.tubes[0].frame(&scene.room.enclosure);
        assert!(frame.outward().distance(outward) < 1e-9, "{}", frame.outward());
        let end = scene.tubes[0].upper_end(&scene.room.enclosure);
        let length = end.dot(outward);
        assert!(length > 0.1 && end.distance(length * outward) < 1e-9, "{end}");
        let meshes = MeshesResult::new(&scene, &[]);
        let corners = || meshes.meshes[0].parts.iter().flat_map(|part| &part.corners_m);
        let behind = |corner: &[f32; 3]| (DVec3::from(corner.map(f64::from)) - frame.origin).dot(outward);
        let low = corners().map(behind).fold(f64::INFINITY, f64::min);
        let high = corners().map(behind).fold(0.0, f64::max);
        assert!(low.abs() < 2e-6 && (high - length).abs() < 2e-6, "{low} {high}");
    }
    let mut beside = mesh_tube();
    beside["centre_m"] = json!([2.5, 0.5, 1.5]);
    beside["normal"] = json!("face");
    assert_eq!(errors(&with(attic(), "/tubes/0", beside)).0[0].pointer, "/tubes/0/centre_m");
}

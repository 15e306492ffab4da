//! Rooms above a plan: their faces, hanging openings, grids by spacing and at points, and the places of every fault.

use crate::given::{SquarePipe, errors, refused, with};
use crate::schema::parse;
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, WarningCode, to_scene};
use skyduct::scene::{FaceKind, OpeningPlane, Scene};

/// An L-shaped hall with two tubes and a lattice of sensors.
fn hall() -> Value {
    let tube = |x: f64, y: f64| {
        json!({ "centre_m": [x, y], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.0 }],
                "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 } })
    };
    json!({
        "sky": { "cie_type": 5, "sun_position": { "altitude_deg": 45, "azimuth_deg": 180 } },
        "room": { "plan": { "outline_m": [[0, 0], [8, 0], [8, 3], [4, 3], [4, 6], [0, 6]] },
                  "ceiling": { "kind": "flat", "height_m": 2.7 } },
        "tubes": [tube(2.0, 4.5), tube(6.0, 1.5)],
        "grids": [{ "name": "desk", "height_m": 0.85, "spacing_m": 1.0 }]
    })
}

/// A room of 5 m x 4 m below a ceiling that rises toward the north, with one hanging opening.
fn attic() -> Value {
    let mut attic = hall();
    attic["room"] = json!({ "plan": { "outline_m": [[0, 0], [5, 0], [5, 4], [0, 4]] },
        "ceiling": { "kind": "sloped", "point_m": [0, 0, 2.2], "rise_toward_deg": 0, "pitch_deg": 35 } });
    attic["tubes"] = json!([with(hall()["tubes"][0].clone(), "/drop_m", json!(0.7))]);
    attic["tubes"][0]["centre_m"] = json!([2.5, 2.0]);
    attic
}

fn scene(document: &Value) -> Scene {
    to_scene(&parse(document).unwrap(), &SquarePipe).unwrap().0
}

fn area(scene: &Scene, kind: FaceKind) -> f64 {
    let faces = scene.room.enclosure.faces().iter().filter(|face| face.kind == kind);
    faces.map(|face| face.polygon.area_m2()).sum()
}

#[test]
fn plans_have_the_faces_that_they_state() {
    let mut document = hall();
    document["room"]["surfaces"] = json!({ "walls": { "reflectance": 0.4 }, "wall_3": { "reflectance": 0.1 } });
    let l = scene(&document);
    for (kind, expected) in [(FaceKind::Floor, 36.0), (FaceKind::Wall, 28.0 * 2.7), (FaceKind::Ceiling, 36.0)] {
        assert!((area(&l, kind) - expected).abs() < 1e-9, "{kind:?}");
    }
    let reflectance = |name: &str| {
        let face = l.room.enclosure.faces().iter().find(|face| face.name == name).unwrap();
        face.surface.unwrap().reflectance[0]
    };
    assert_eq!(["floor", "wall_0", "wall_3", "ceiling"].map(reflectance), [0.2, 0.4, 0.1, 0.7]);
    assert!(l.room.enclosure.as_box().is_none());

    // the same sense or the other: the same numbers of walls
    let mut turned = document.clone();
    let outline = document["room"]["plan"]["outline_m"].as_array().unwrap();
    turned["room"]["plan"]["outline_m"] = outline.iter().rev().cloned().collect();
    let wall = |scene: &Scene, name: &str| {
        let face = scene.room.enclosure.faces().iter().find(|face| face.name == name).unwrap();
        face.polygon.normal()
    };
    // edge 3 from (4, 3) to (4, 6) is edge 1 the other way round
    assert_eq!(wall(&scene(&turned), "wall_1"), wall(&l, "wall_3"));

    let slope = 35f64.to_radians();
    let attic = scene(&attic());
    assert!((area(&attic, FaceKind::Ceiling) - 20.0 / slope.cos()).abs() < 1e-9);
    assert_eq!(attic.tubes[0].plane, OpeningPlane::Level { drop_m: 0.7 });

    let mut gable = self::attic();
    gable["room"]["ceiling"] = json!({ "kind": "gable", "eaves_m": 2.4, "ridge_m": 4.1, "ridge_azimuth_deg": 90 });
    gable["room"]["surfaces"] = json!({ "ceiling_1": { "reflectance": 0.3 } });
    gable["tubes"][0]["face"] = json!("ceiling_0");
    let gable = scene(&gable);
    let [low, high] = gable.room.enclosure.bounds();
    assert_eq!((low.z, high.z), (0.0, 4.1));
    let ceilings: Vec<&str> = gable.room.enclosure.faces().iter().map(|face| face.name.as_str()).collect();
    assert_eq!(ceilings[5..], ["ceiling_0", "ceiling_1"]);
}

/// A plan of four right angles, at the origin or elsewhere, is the box of its extent.
#[test]
fn a_rectangle_is_a_box() {
    let mut plan = hall();
    plan["room"]["plan"]["outline_m"] = json!([[0, 0], [8, 0], [8, 6], [0, 6]]);
    let mut cuboid = plan.clone();
    cuboid["room"] = json!({ "size_m": [8, 6, 2.7] });
    let [plan, cuboid] = [plan, cuboid].map(|document| scene(&document));
    assert_eq!(plan.room.enclosure.bounds(), cuboid.room.enclosure.bounds());
    assert_eq!((&plan.grids[0].x_m, &plan.grids[0].y_m), (&cuboid.grids[0].x_m, &cuboid.grids[0].y_m));
    for kind in [FaceKind::Floor, FaceKind::Wall, FaceKind::Ceiling] {
        assert!((area(&plan, kind) - area(&cuboid, kind)).abs() < 1e-9);
    }
}

/// Sensors outside have no value, cells are cut, points face any direction.
#[test]
fn grids_follow_the_plan() {
    let mut document = hall();
    document["grids"] = json!([
        { "name": "spaced", "height_m": 0.85, "spacing_m": 0.75, "margin_m": 0.5 },
        { "name": "cells", "height_m": 0.85, "cells": [8, 6], "estimate": "cell_average" },
        { "name": "eyes", "points_m": [[1, 1, 1.2, 0, 2, 0], [6, 5, 1.2, 0, 0, 1]] }
    ]);
    let job = parse(&document).unwrap();
    let (mut scene, ..) = to_scene(&job, &SquarePipe).unwrap();
    let warnings = skyduct::document::leave_out(&job, &mut scene, true).unwrap();
    let [spaced, cells, eyes] = [0, 1, 2].map(|grid| &scene.grids[grid]);
    assert_eq!((spaced.cells, spaced.cell_size_m), ([11, 8], [0.75, 0.75]));
    let is_within = |x: f64, y: f64| (0.5..=7.5).contains(&x) && (0.5..=5.5).contains(&y) && (x <= 3.5 || y <= 2.5);
    for sensor in 0..spaced.len() {
        let at = spaced.centre(sensor);
        assert_eq!(!spaced.is_inside(sensor), is_within(at.x, at.y), "{at}");
    }
    assert_eq!((cells.len(), cells.valued()), (48, 36));
    let directions: Vec<_> = (0..2).map(|sensor| eyes.sensor(sensor).normal.to_array()).collect();
    assert_eq!(directions, [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
    assert!(!eyes.is_inside(0) && eyes.is_inside(1));
    // the lattice of 0.75 m is cut at the east and the north: 8 m are 10.67 cells, 4 m are 5.33
    let area = spaced.area.as_ref().unwrap();
    let of_cell = |column: usize, row: usize| area[row * 11 + column];
    assert!((of_cell(4, 5) - 1.0).abs() < 1e-9 && of_cell(10, 1) == 0.0);
    let mut cut = document.clone();
    cut["grids"] = json!([{ "name": "cut", "height_m": 0.85, "spacing_m": 0.7 }]);
    let job = parse(&cut).unwrap();
    let (mut scene_of_cut, ..) = to_scene(&job, &SquarePipe).unwrap();
    skyduct::document::leave_out(&job, &mut scene_of_cut, true).unwrap();
    let grid = &scene_of_cut.grids[0];
    // 8 m are 11.43 cells: the last is cut to 0.3 m of 0.7 m, but its centre lies outside; the row at y = 3 is cut to 0.2 m
    let area = grid.area.as_ref().unwrap();
    assert_eq!((grid.cells, area[11]), ([12, 9], 0.0));
    assert!((area[4 * 12 + 6] - 0.0).abs() < 1e-9 && (area[8 * 12] - 4.0 / 7.0).abs() < 1e-9, "{area:?}");
    assert_eq!(warnings.iter().map(|warning| warning.code).collect::<Vec<_>>(), [WarningCode::PointsOutside]);
    // a plan has no cells that are not its own: areas add up to the floor's
    let free: f64 = (0..cells.len()).map(|sensor| cells.free.as_ref().unwrap()[sensor]).sum();
    assert!((free * cells.cell_area_m2() - 36.0).abs() < 1e-9);
}

/// A gable over an L, the ridge of which runs along a wall, closes the room.
#[test]
fn gables_stand_over_concave_plans() {
    for azimuth in [0, 30, 90, 180, 270] {
        let mut document = hall();
        document["room"]["ceiling"] =
            json!({ "kind": "gable", "eaves_m": 2.4, "ridge_m": 4.1, "ridge_azimuth_deg": azimuth });
        document["tubes"][0]["drop_m"] = json!(0.4);
        document["tubes"][1]["drop_m"] = json!(0.4);
        let scene = scene(&document);
        assert!((area(&scene, FaceKind::Floor) - 36.0).abs() < 1e-9, "{azimuth}");
    }
}

/// Tubes cross by the heights of their openings: a bent one passes below a higher opening, or through the tube above it.
#[test]
fn tubes_cross_where_they_are() {
    let mut document = attic();
    document["room"]["ceiling"]["pitch_deg"] = json!(35);
    let mut low = hall()["tubes"][0].clone();
    low["centre_m"] = json!([2.5, 0.5]);
    low["drop_m"] = json!(0.3);
    low["segments"] = json!([{ "length_m": 0.6 }, { "length_m": 3.0, "tilt_deg": 90, "azimuth_deg": 0 }]);
    document["tubes"][0]["centre_m"] = json!([2.5, 3.3]);
    document["tubes"][0]["drop_m"] = json!(0.3);
    document["tubes"].as_array_mut().unwrap().push(low);
    assert!(parse(&document).is_ok(), "passes below the opening, in the room: {:?}", parse(&document).err());
    document["tubes"][1]["segments"][0]["length_m"] = json!(2.6);
    let found = errors(&document).0;
    assert!(found.len() == 1 && found[0].pointer == "/tubes/1/segments/1", "{found:?}");
}

/// A repeated corner is merged, and told.
#[test]
fn repairs_are_told() {
    let mut document = hall();
    document["room"]["plan"]["outline_m"].as_array_mut().unwrap().insert(1, json!([8e-7, 0]));
    let (scene, warnings, _) = to_scene(&parse(&document).unwrap(), &SquarePipe).unwrap();
    assert_eq!(scene.room.enclosure.faces().len(), 8);
    assert!(warnings.iter().any(|warning| warning.code == WarningCode::RepairedRoom));
}

/// Heights are measured from the floor, whether a grid says so or not.
#[test]
fn grids_stand_on_the_floor() {
    let said = scene(&with(hall(), "/grids/0/on", json!("floor")));
    assert_eq!(format!("{:?}", said.grids), format!("{:?}", scene(&hall()).grids));
}

#[test]
fn faults_of_plans_have_places() {
    let outline = "/room/plan/outline_m";
    let hole = |corners: Value| with(hall(), "/room/plan/holes_m", json!([corners]));
    let changed = |pointer: &str, value: Value| with(hall(), pointer, value);
    let mut no_ceiling = hall();
    no_ceiling["room"].as_object_mut().unwrap().remove("ceiling");
    let mut partition = hall();
    let surface = json!({ "reflectance": 0.5 });
    partition["room"]["partitions"] =
        json!([{ "from_m": [1, 1], "to_m": [7, 4], "height_m": 1.4, "surface": surface }]);
    let mut tall = partition.clone();
    tall["room"]["partitions"][0]["to_m"] = json!([1, 4]);
    tall["room"]["partitions"][0]["height_m"] = json!(2.8);
    let mut chord = partition.clone();
    (chord["room"]["partitions"][0]["from_m"], chord["room"]["partitions"][0]["to_m"]) =
        (json!([4, 4.5]), json!([6, 3]));
    let mut gable = attic();
    gable["room"]["ceiling"] = json!({ "kind": "gable", "eaves_m": 2.4, "ridge_m": 4.1, "ridge_azimuth_deg": 90 });
    gable["tubes"][0]["centre_m"] = json!([2.5, 1.0]);
    gable["tubes"][0]["face"] = json!("ceiling_0");
    let mut in_notch = hall();
    in_notch["room"]["objects"] =
        json!([{ "kind": "box", "size_m": [1, 1, 1], "position_m": [4, 4, 0], "surface": surface }]);
    for (document, pointer) in [
        (changed(outline, json!([[0, 0], [8, 0], [8, 3], [0, 3], [4, 6], [4, -1]])), outline),
        (changed(outline, json!([[0, 0], [8, 0]])), outline),
        (changed(outline, json!([[0, 0], [8, 0], [4, 0]])), outline),
        (changed(outline, json!([[0, 0], [8, 0], [8, 1e-3], [0, 1e-3]])), outline),
        (hole(json!([[1, 1], [2, 1], [2, 7]])), "/room/plan/holes_m/0"),
        (hole(json!([[5, 4], [6, 4], [6, 5]])), "/room/plan/holes_m/0"),
        (hole(json!([[0, 1], [1, 1], [1, 2]])), "/room/plan/holes_m/0"),
        (no_ceiling, "/room/ceiling"),
        (changed("/room/size_m", json!([8, 6, 2.7])), "/room/size_m"),
        (changed("/room/ceiling", json!({ "kind": "flat", "height_m": 0 })), "/room/ceiling/height_m"),
        (with(attic(), "/room/ceiling/pitch_deg", json!(85)), "/room/ceiling/pitch_deg"),
        (with(attic(), "/room/ceiling/rise_toward_deg", json!(180)), "/room/ceiling"),
        (with(attic(), "/tubes/0/drop_m", json!(0)), "/tubes/0/drop_m"),
        (with(attic(), "/tubes/0/drop_m", json!(3.7)), "/tubes/0/drop_m"),
        (with(attic(), "/tubes/0/face", json!("roof")), "/tubes/0/face"),
        (changed("/tubes/0/centre_m", json!([6, 5])), "/tubes/0/centre_m"),
        (changed("/tubes/0/centre_m", json!([3.9, 4.5])), "/tubes/0/diameter_m"),
        (changed("/tubes/1/centre_m", json!([2, 4.4])), "/tubes/1/centre_m"),
        (changed("/room/surfaces", json!({ "wall_6": surface })), "/room/surfaces/wall_6"),
        (partition, "/room/partitions/0/to_m"),
        (tall, "/room/partitions/0/height_m"),
        (chord, "/room/partitions/0"),
        (gable, "/tubes/0/centre_m"),
        (in_notch, "/room/objects/0/position_m"),
        (changed("/grids/0/on", json!("ceiling")), "/grids/0/on"),
        (changed("/grids/0/cells", json!([3, 3])), "/grids/0/spacing_m"),
        (changed("/grids/0/spacing_m", json!(0.001)), "/grids/0/spacing_m"),
        (changed("/grids/0", json!({ "name": "g", "points_m": [[1, 1, 1, 0, 0, 0]] })), "/grids/0/points_m/0"),
        (
            changed("/grids/0", json!({ "name": "g", "points_m": [[1, 1, 1, 0, 0, 1]], "height_m": 1 })),
            "/grids/0/height_m",
        ),
    ] {
        let found = errors(&document).0;
        assert!(found.len() == 1 && found[0].pointer == pointer, "{pointer}: {found:?}");
    }
    let low = with(attic(), "/room/ceiling/rise_toward_deg", json!(180));
    let found = refused(&low, "/room/ceiling", FieldErrorCode::Invalid).detail;
    // 2.2 m down at 35 degrees
    assert!(found.contains("meets the floor on the line through (5, 3.141926) and (0, 3.141926)"), "{found}");
    for (field, pointer) in [("height_m", "/grids/0/height_m"), ("spacing_m", "/grids/0/cells")] {
        let mut document = hall();
        document["grids"][0].as_object_mut().unwrap().remove(field);
        let found = errors(&document).0;
        assert_eq!((found[0].pointer.as_str(), found[0].code), (pointer, FieldErrorCode::Missing));
    }
}

/// Refusals of what a user drew say where two edges meet, which hole lies in which, and the distance that is missing.
#[test]
fn refusals_of_plans_say_what_is_missing() {
    let changed = |pointer: &str, value: Value| with(hall(), pointer, value);
    let holes = |holes: Value| changed("/room/plan/holes_m", holes);
    let small = json!([[1, 1], [2, 1], [2, 2]]);
    for (document, pointer, words) in [
        (
            changed("/room/plan/outline_m", json!([[0, 0], [8, 0], [8, 3], [0, 3], [4, 6], [4, -1]])),
            "/room/plan/outline_m",
            "the edges 0 and 4 of the plan meet at (4",
        ),
        (
            holes(json!([small, [[2, 2], [3, 2], [3, 2.5]]])),
            "/room/plan/holes_m/1",
            "the edges 7 and 11 of the plan meet at (2",
        ),
        (
            holes(json!([[[0.5, 0.5], [2.5, 0.5], [2.5, 2.5], [0.5, 2.5]], small])),
            "/room/plan/holes_m/1",
            "lies within the hole 0",
        ),
        (changed("/tubes/0/centre_m", json!([3.9, 4.5])), "/tubes/0/diameter_m", "its rim is 0.075 m beyond a wall"),
        (changed("/tubes/1/centre_m", json!([2.1, 4.5])), "/tubes/1/centre_m", "moves away by 0.25 m"),
        (with(attic(), "/tubes/0/drop_m", json!(0.05)), "/tubes/0/drop_m", "must be at least 0."),
    ] {
        let found = errors(&document).0;
        assert!(
            found.len() == 1 && found[0].pointer == pointer && found[0].detail.contains(words),
            "{pointer}, {words}: {found:?}"
        );
    }
}

/// Sensors outside have no value, unless none is inside.
#[test]
fn a_grid_needs_a_sensor_in_the_room() {
    let outside = |points: Value| {
        let document = with(hall(), "/grids/0", json!({ "name": "eyes", "points_m": points }));
        let job = parse(&document).unwrap();
        let (mut scene, ..) = to_scene(&job, &SquarePipe).unwrap();
        skyduct::document::leave_out(&job, &mut scene, true)
    };
    let warnings = outside(json!([[6, 5, 1, 0, 0, 1], [1, 1, 1, 0, 0, 1]])).unwrap();
    assert!(warnings.iter().any(|warning| warning.code == WarningCode::PointsOutside), "{warnings:?}");
    let errors = outside(json!([[6, 5, 1, 0, 0, 1], [7, 5, 1, 0, 0, 1]])).unwrap_err().0;
    assert!(errors.len() == 1 && errors[0].pointer == "/grids/0", "{errors:?}");
    assert!(errors[0].detail.contains("all points lie outside the room"), "{errors:?}");
}

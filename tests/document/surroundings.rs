//! Horizon and ground of job documents: what is refused, and what they make of sky and sun.

use crate::given::{SquarePipe, base, errors, mesh_tube, refused, with};
use crate::schema;
use serde::Serialize;
use serde_json::{Value, json};
use skyduct::document::FieldErrorCode::{Invalid, OutOfRange, TooMany, UnknownField};
use skyduct::document::{WarningCode, to_scene};
use skyduct::plan::{EffectKind, EffectPlan, EffectRequest, EffectRequests, Effects};
use skyduct::scene::{Scene, TubeShape};
use skyduct::sky::sun::HALF_ANGLE;
use skyduct::sky::{Sky, Sun, direction};

fn within(surroundings: Value) -> Value {
    with(base(), "/surroundings", surroundings)
}

fn scene(document: &Value) -> Scene {
    assert_eq!(schema::faults(document), [""; 0]);
    to_scene(&schema::parse(document).unwrap(), &SquarePipe).unwrap().0
}

/// Sky and sun as the first tube sees them.
fn daylight(document: &Value) -> (Sky, Option<Sun>) {
    let scene = scene(document);
    let (sky, sun) = scene.daylight.unwrap().before(&scene.tubes[0]);
    (sky.unwrap(), sun)
}

/// The plan's entry on the horizon, for a request.
fn planned(document: &Value, request: EffectRequest) -> EffectPlan {
    let requests = EffectRequests::from([(EffectKind::Horizon, request)]);
    let effects = Effects::of(&scene(document), &requests);
    effects.list.into_iter().find(|effect| effect.kind == EffectKind::Horizon).unwrap()
}

fn of_box(size_m: [impl Serialize; 3], position_m: [impl Serialize; 3]) -> Value {
    json!({ "kind": "box", "size_m": size_m, "position_m": position_m })
}

#[test]
fn faults_name_their_place() {
    for (surroundings, pointer, code) in [
        (json!({ "horizon": [] }), "/horizon", Invalid),
        (json!({ "horizon": [[0, 91]] }), "/horizon/0/1", OutOfRange),
        (json!({ "horizon": [[0, 5], [90, -1]] }), "/horizon/1/1", OutOfRange),
        (json!({ "horizon": [[0, 5], [361, 5]] }), "/horizon/1/0", OutOfRange),
        (json!({ "horizon": [[-90, 5], [90, 5]] }), "/horizon/0/0", OutOfRange),
        (json!({ "horizon": [[90, 5], [80, 5], [100, 5]] }), "/horizon/1/0", Invalid),
        (json!({ "horizon": [[90, 5], [90, 6]] }), "/horizon/1/0", Invalid),
        (json!({ "horizon_pvgis": [[-180, 5], [200, 5]] }), "/horizon_pvgis/1/0", OutOfRange),
        (json!({ "horizon_pvgis": [[0, 5], [-90, 5]] }), "/horizon_pvgis/1/0", Invalid),
        (json!({ "horizon": [[0, 5]], "horizon_pvgis": [[0, 5]] }), "/horizon_pvgis", Invalid),
        (json!({ "luminance_ratio": 1.5 }), "/luminance_ratio", OutOfRange),
        (json!({ "ground_reflectance": -0.1 }), "/ground_reflectance", OutOfRange),
        (json!({ "hills": [] }), "/hills", UnknownField),
        (json!({ "obstructions": [of_box([4, 4, 0], [0, 20, 0])] }), "/obstructions/0/size_m/2", OutOfRange),
        (json!({ "obstructions": [of_box([4, 4, 9], [0, 2_000_000, 0])] }), "/obstructions/0/position_m/1", OutOfRange),
        (
            json!({ "obstructions": [{ "kind": "box", "size_m": [1, 1, 9], "position_m": [9, 9, 0], "rotation_deg": 400 }] }),
            "/obstructions/0/rotation_deg",
            OutOfRange,
        ),
        (
            json!({ "obstructions": [{ "kind": "tree", "size_m": [1, 1, 9], "position_m": [9, 9, 0] }] }),
            "/obstructions/0/kind",
            Invalid,
        ),
        (json!({ "obstructions": vec![of_box([1, 1, 9], [9, 9, 0]); 65] }), "/obstructions", TooMany),
    ] {
        refused(&within(surroundings), &format!("/surroundings{pointer}"), code);
    }
    let points = |count: u32| -> Vec<[f64; 2]> {
        (0..count).map(|number| [360.0 * f64::from(number) / f64::from(count), 5.0]).collect()
    };
    refused(&within(json!({ "horizon": points(362) })), "/surroundings/horizon", TooMany);
    scene(&within(json!({ "horizon": points(361) })));
    let all = json!({ "horizon": [[10, 95], [5, 2]], "luminance_ratio": 2, "ground_reflectance": 2 });
    assert_eq!(errors(&within(all)).0.len(), 4);
}

/// The ground is that of the document without a horizon; the illuminances outdoors are as without surroundings.
#[test]
fn illuminances_outdoors_stay_unobstructed() {
    let open = with(base(), "/sky/direct_normal_illuminance_lux", json!(50_000));
    let surroundings = json!({ "horizon": [[0, 50]], "luminance_ratio": 0.3 });
    let [without, behind] = [open.clone(), with(open, "/surroundings", surroundings)];
    let outdoors = |document: &Value| scene(document).daylight.unwrap().horizontal_illuminance_lux();
    let ((open, sun), (sky, covered)) = (daylight(&without), daylight(&behind));
    let (of_sky, of_sun) = outdoors(&without);
    assert_eq!(outdoors(&behind), (of_sky, of_sun));
    assert!(sun.is_some() && covered.is_none() && of_sun > 0.0);
    let luminance = |altitude_deg: f64| sky.luminance(direction(altitude_deg.to_radians(), 1.0));
    assert!((luminance(49.9) / (0.3 * of_sky / std::f64::consts::PI) - 1.0).abs() < 1e-12);
    assert_eq!(luminance(50.1), open.luminance(direction(50.1f64.to_radians(), 1.0)));
    assert!((luminance(-20.0) / (0.2 * (of_sky + of_sun) / std::f64::consts::PI) - 1.0).abs() < 1e-12);
    assert_eq!(open.luminance(direction(-0.3, 1.0)), 0.0);
}

/// The fraction of the disc that is above the horizon, in the middle of the profile's slope too.
#[test]
fn the_sun_is_covered_by_its_fraction() {
    let sunny = with(base(), "/sky/direct_normal_illuminance_lux", json!(50_000));
    let at = |altitude_deg: f64, horizon: Value| {
        let document = with(sunny.clone(), "/sky/sun_position/altitude_deg", json!(altitude_deg));
        daylight(&with(document, "/surroundings", json!({ "horizon": horizon }))).1
    };
    let disc_deg = HALF_ANGLE.to_degrees();
    assert!(at(20.0 - 1.1 * disc_deg, json!([[0, 20]])).is_none());
    assert_eq!(at(20.0 + 1.1 * disc_deg, json!([[0, 20]])).unwrap().normal_illuminance_lux, 50_000.0);
    for slope in [json!([[0, 20]]), json!([[215, 10], [235, 30]])] {
        let half = at(20.0, slope.clone()).unwrap().normal_illuminance_lux / 50_000.0;
        assert!((half - 0.5).abs() < 0.01, "{slope}: {half}");
    }
}

/// South is 0 in PVGIS, and the room's frame turns with the room.
#[test]
fn azimuths_are_those_of_the_compass() {
    let north = json!({ "horizon": [[0, 5], [90, 40], [200, 10], [270, 0]] });
    let pvgis = json!({ "horizon_pvgis": [[-180, 5], [-90, 40], [20, 10], [90, 0]] });
    let [sky, same] = [&north, &pvgis].map(|surroundings| daylight(&within(surroundings.clone())).0);
    let turned = daylight(&with(within(north), "/room/rotation_deg", json!(50))).0;
    let mut hidden = 0;
    for (altitude, azimuth) in (1..40).flat_map(|altitude| (0..120).map(move |azimuth| (altitude, azimuth))) {
        let [altitude, azimuth] = [f64::from(altitude) + 0.5, 3.0 * f64::from(azimuth) + 0.1].map(f64::to_radians);
        let luminance = sky.luminance(direction(altitude, azimuth));
        assert_eq!(luminance, same.luminance(direction(altitude, azimuth)));
        let in_room = turned.luminance(direction(altitude, azimuth - 50f64.to_radians()));
        assert!((in_room / luminance - 1.0).abs() < 1e-9, "{altitude} {azimuth}");
        hidden += usize::from(luminance == sky.surroundings.as_ref().unwrap().luminance_cd_m2);
    }
    assert!(hidden > 1000, "{hidden}");
    let east =
        |altitude_deg: f64| sky.horizon().unwrap().hides(direction(f64::to_radians(altitude_deg), 90f64.to_radians()));
    assert!(east(39.9) && !east(40.1));
}

/// The plan says what is hidden; nothing is where no part of the horizon is above 0, and what is there cannot be switched off.
#[test]
fn the_plan_tells_the_horizon() {
    let overcast = with(base(), "/sky/cie_type", json!(16));
    let ring = with(overcast.clone(), "/surroundings", json!({ "horizon": [[0, 30]] }));
    for request in [EffectRequest::Auto, EffectRequest::Off, EffectRequest::On] {
        let plan = planned(&ring, request);
        assert!(plan.on && plan.called_for && plan.reason.contains("up to 30.0 degrees hides 17.9 %"), "{plan:?}");
        for flat in [json!({ "horizon": [[0, 0], [180, 0]] }), json!({ "ground_reflectance": 0.5 }), Value::Null] {
            let plan = planned(&with(overcast.clone(), "/surroundings", flat), request);
            assert!(!plan.on && plan.bound == Some(0.0) && plan.reason.contains("above 0"), "{plan:?}");
        }
    }
    let mut night = base();
    night["tubes"] = json!([]);
    night["room"]["luminaires"] = json!([{ "kind": "rectangle", "corner_m": [0.2, 0.2, 2.0],
        "edge_u_m": [0, 0.4, 0], "edge_v_m": [0.4, 0, 0], "luminance_cd_m2": 1000 }]);
    let night = with(with(night, "/sky", Value::Null), "/surroundings", json!({ "horizon": [[0, 30]] }));
    let (_, warnings, _) = to_scene(&schema::parse(&night).unwrap(), &SquarePipe).unwrap();
    assert_eq!(warnings[0].code, WarningCode::PlaceWithoutSky);
    assert!(!planned(&night, EffectRequest::Auto).on);
}

/// The sky that each tube sees, room and tubes straight.
fn skies(document: &Value) -> Vec<Sky> {
    let scene = scene(document);
    let daylight = scene.daylight.unwrap();
    scene.tubes.iter().map(|tube| daylight.before(tube).0.unwrap()).collect()
}

/// Two straight tubes of 1 m, and surroundings.
fn two_tubes(surroundings: Value) -> Value {
    let mut document = within(surroundings);
    document["tubes"][0]["segments"] = json!([{ "length_m": 1.0 }]);
    let mut second = document["tubes"][0].clone();
    second["centre_m"] = json!([0.3, 1.7]);
    document["tubes"].as_array_mut().unwrap().push(second);
    document
}

fn hides(sky: &Sky, altitude: f64, azimuth: f64) -> bool {
    sky.horizon().is_some_and(|horizon| horizon.hides(direction(altitude, azimuth)))
}

/// A wall in the north, whose near side is 10 m from the origin and 8 m high, hides from each upper end what is behind its edge, in the
/// room's frame; the plan tells how far outlines shift across an end.
#[test]
fn obstructions_become_the_horizon_of_each_tube() {
    let wall = |rotation_deg: f64| json!({ "obstructions": [{ "kind": "box", "size_m": [2, 40, 8], "position_m": [1, 11, 0], "rotation_deg": rotation_deg }] });
    let document = with(two_tubes(wall(90.0)), "/room/rotation_deg", json!(30));
    for (sky, y) in skies(&document).iter().zip([1.016, 1.7]) {
        let edge = ((8.0 - 3.032f64) / (10.0 - y)).atan();
        assert!(hides(sky, edge - 1e-3, 0.0) && !hides(sky, edge + 1e-3, 0.0), "{y}");
        assert!(!hides(sky, 0.01, 3.0));
    }
    let shift = (0.254f64 / (10.0 - 1.7)).to_degrees();
    let reason = planned(&document, EffectRequest::Auto).reason;
    assert!(reason.contains("up to") && reason.contains(&format!("shift by up to {shift:.1} degrees")), "{reason}");
    // lower than the upper ends
    let low = two_tubes(json!({ "obstructions": [of_box([40, 2, 3], [1, 11, 0])] }));
    assert!(skies(&low).iter().all(|sky| sky.horizon().is_none()));
    let over = two_tubes(json!({ "obstructions": [of_box([1, 1, 9], [20, 20, 0]), of_box([4, 4, 8], [1, 1, 0])] }));
    let errors = to_scene(&schema::parse(&over).unwrap(), &SquarePipe).unwrap_err();
    assert_eq!(errors.0[0].pointer, "/surroundings/obstructions/1");
}

/// A tube's own horizon stands in place of the common one, and needs no `surroundings`.
#[test]
fn a_tube_can_have_its_own_horizon() {
    let document = with(two_tubes(json!({ "horizon": [[0, 10]] })), "/tubes/0/horizon", json!([[0, 30], [180, 30]]));
    let degrees = f64::to_radians;
    let found = skies(&document);
    assert!(hides(&found[0], degrees(29.9), 1.0) && !hides(&found[0], degrees(30.1), 1.0));
    assert!(hides(&found[1], degrees(9.9), 1.0) && !hides(&found[1], degrees(10.1), 1.0));
    let alone = skies(&with(document.clone(), "/surroundings", Value::Null));
    assert!(hides(&alone[0], degrees(29.9), 1.0) && alone[1].horizon().is_none());
    let mean = alone[0].horizontal_illuminance_lux() / std::f64::consts::PI;
    for sky in &alone {
        assert!((sky.luminance(direction(-0.5, 1.0)) / mean - 0.2).abs() < 1e-9);
    }
    assert!((alone[0].luminance(direction(0.2, 1.0)) / mean - 0.1).abs() < 1e-9);
    for (points, pointer, code) in [
        (json!([]), "", Invalid),
        (json!([[0, 90.5]]), "/0/1", OutOfRange),
        (json!([[-1, 9]]), "/0/0", OutOfRange),
        (json!([[9, 9], [8, 9]]), "/1/0", Invalid),
    ] {
        refused(&with(document.clone(), "/tubes/1/horizon", points), &format!("/tubes/1/horizon{pointer}"), code);
    }
    let mut mesh = base();
    mesh["tubes"] = json!([mesh_tube()]);
    let mesh = with(mesh, "/tubes/0/horizon", json!([[0, 30]]));
    assert!(hides(&skies(&mesh)[0], degrees(29.9), 1.0));
    refused(&with(mesh, "/tubes/0/horizon/0/1", json!(95)), "/tubes/0/horizon/0/1", OutOfRange);
}

/// A pane that lies across the axis changes nothing; one that is too steep for its tube or needs a longer one is refused.
#[test]
fn panes_are_tilted_within_bounds() {
    let pane = |tilt_deg: f64, azimuth_deg: f64| json!({ "kind": "flat", "transmittance": 0.9, "tilt_deg": tilt_deg, "azimuth_deg": azimuth_deg });
    let leaning = |collector: Value| with(base(), "/tubes/0/collector", collector);
    let straight = |collector: Value| with(leaning(collector), "/tubes/0/segments", json!([{ "length_m": 0.3 }]));
    let cut = |document: &Value| match &scene(document).tubes[0].shape {
        TubeShape::Cylinders(tube) => (tube.cut, tube.is_straight()),
        TubeShape::Mesh(_) => unreachable!(),
    };
    let across = json!({ "kind": "flat", "transmittance": 0.9 });
    assert_eq!(cut(&straight(pane(0.0, 20.0))), (None, true));
    assert_eq!(cut(&straight(across.clone())), (None, true));
    assert_eq!(cut(&leaning(pane(45.0, 90.0))), (None, false));
    assert_eq!(cut(&straight(pane(35.0, 180.0))), (Some(direction(55f64.to_radians(), std::f64::consts::PI)), false));
    refused(&straight(pane(91.0, 0.0)), "/tubes/0/collector/tilt_deg", OutOfRange);
    refused(&straight(pane(10.0, 400.0)), "/tubes/0/collector/azimuth_deg", OutOfRange);
    refused(&straight(pane(76.0, 0.0)), "/tubes/0/collector/tilt_deg", Invalid);
    refused(&leaning(pane(45.0, 270.0)), "/tubes/0/collector/tilt_deg", Invalid);
    // 0.127 m tan(70 degrees) = 0.349 m
    refused(&straight(pane(70.0, 0.0)), "/tubes/0/segments/0/length_m", Invalid);
    let mut untilted = across;
    untilted["azimuth_deg"] = json!(20);
    refused(&straight(untilted), "/tubes/0/collector/azimuth_deg", Invalid);
}

//! Tubes that are far from the origin, turned, bent, or beside each other.

use crate::given::{base, refused, with};
use crate::jobs::{cube, lux, prepared, prepared_with, rendered};
use crate::reference::{number, rows};
use crate::scenes::{self, RADIUS, daylight, lambertian, straight};
use crate::tube::{floor, guide, solved};
use glam::{DVec2, DVec3};
use serde_json::json;
use skyduct::document::FieldErrorCode;
use skyduct::geometry::bvh::TriangleBvh;
use skyduct::guide::{BentGuide, End};
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::scene::{EstimateKind, Tube};

/// A closed box of twelve triangles around `centre`.
fn closed_box(centre: DVec3, half: f64) -> Vec<[DVec3; 3]> {
    let corner = |k: usize| {
        let side = |bit: usize| if k >> bit & 1 == 1 { half } else { -half };
        centre + DVec3::new(side(0), side(1), side(2))
    };
    let faces = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles = |[a, b, c, d]: [usize; 4]| [[a, b, c], [a, c, d]];
    faces.into_iter().flat_map(triangles).map(|triangle| triangle.map(corner)).collect()
}

/// Where f32 has steps of 6 cm, triangles of 25 cm are met as near the origin: to the rounding of f64 there.
#[test]
fn triangles_far_from_the_origin_are_met_where_they_are() {
    let far = DVec3::new(1e6, -1e6, 1e6);
    let [near, moved] = [DVec3::ZERO, far].map(|centre| TriangleBvh::new(&closed_box(centre, 0.127)));
    let mut random = PathRandom::new(Key::new(4));
    for _ in 0..20_000 {
        let origin = DVec3::new(random.uniform(), random.uniform(), random.uniform()) * 0.25 - 0.125;
        let direction = warp::around(DVec3::X, warp::cosine_hemisphere(random.uniform2()));
        let [a, b] = [near.nearest(origin, direction, None), moved.nearest(origin + far, direction, None)];
        // half an ulp of 1e6 (5.8e-11) in the corners and as much in the origin, over the cosine to the face; and the same again
        // for the differences
        let (a, b) = (a.unwrap(), b.unwrap());
        let axis = 2 - a.triangle as usize / 4;
        let slope = 1.0 / direction[axis].abs();
        assert!((a.distance - b.distance).abs() < 4.0 * 5.8e-11 * slope, "{a:?} {b:?}");
    }
}

/// A block whose file has it 1000 km away, put back into the room: the same illuminance.
#[test]
fn a_mesh_drawn_far_away_gives_the_same_light() {
    let obj = |x: f64, y: f64, z: f64| {
        let mut text = String::new();
        for k in 0..8 {
            let bit = |bit: i32| f64::from(k >> bit & 1);
            text += &format!("v {} {} {}\n", x + 0.6 * bit(0), y + 0.4 * bit(1), z + 0.5 * bit(2));
        }
        text + "f 1 2 4 3\nf 5 6 8 7\nf 1 2 6 5\nf 3 4 8 7\nf 1 3 7 5\nf 2 4 8 6\n"
    };
    let document = |x: f64, y: f64, z: f64| {
        let mut document = cube();
        document["room"]["objects"] = json!([{ "kind": "mesh", "mesh": "block", "unit": "m",
            "position_m": [0.8 - x, 0.7 - y, -z], "surfaces": { "": { "reflectance": 0.6 } } }]);
        document
    };
    let [near, far] = [(0.0, 0.0, 0.0), (1e6, -1e6 + 1.0, 1e6)].map(|(x, y, z)| {
        let prepared = prepared_with(&document(x, y, z), &obj(x, y, z));
        lux(&rendered(&prepared).0)
    });
    assert!(near.iter().any(|lux| *lux > 0.0));
    for (near, far) in near.iter().zip(&far) {
        assert!((near - far).abs() <= 1e-6 * near, "{near} {far}");
    }
}

/// The axis 0.3, 0.4, 0.866 above a vertical segment, and the same scene turned: the same light at the same sensors of the
/// room's frame by the solver without random walks, and every ray turned along.
#[test]
fn a_leaning_tube_and_its_sky_turn_together() {
    let turned = |angle_deg: f64| {
        let mut document = cube();
        let tilt_deg = 0.5f64.asin().to_degrees();
        let azimuth_deg = 3f64.atan2(4.0).to_degrees();
        document["tubes"][0]["segments"] =
            json!([{ "length_m": 0.2 }, { "length_m": 0.5, "tilt_deg": tilt_deg, "azimuth_deg": azimuth_deg }]);
        document["sky"]["direct_normal_illuminance_lux"] = json!(0);
        document["room"]["rotation_deg"] = json!(angle_deg);
        document["sky"]["sun_position"]["azimuth_deg"] = json!(225.0 + angle_deg);
        document["method"] = json!("holigilm");
        document["stop"] = json!({ "relative_error": 0.05 });
        lux(&rendered(&prepared(&document)).0)
    };
    for (a, b) in turned(0.0).iter().zip(turned(97.0)) {
        assert!((a / b - 1.0).abs() < 1e-9, "{a} {b}");
    }
    let axis = DVec3::new(0.3, 0.4, 0.75f64.sqrt());
    let (mut random, turn) = (PathRandom::new(Key::new(5)), glam::DQuat::from_rotation_z(1.234));
    let bent = |axis: DVec3| BentGuide::new(RADIUS, &[(0.2, DVec3::Z), (0.5, axis)], [0.9; 3].into(), [1.0; 3]);
    let [one, other] = [bent(axis), bent(turn * axis)].map(skyduct::guide::Guide::Bent);
    for _ in 0..2000 {
        let from = (warp::disc(random.uniform2()) * RADIUS).extend(0.0);
        let up = warp::around(DVec3::Z, warp::cosine_hemisphere(random.uniform2()));
        let [a, b] = [one.up::<1>(from, up, &mut random), other.up::<1>(turn * from, turn * up, &mut random)];
        if a.rays < 20 {
            assert_eq!(a.end, b.end);
            assert!(
                (turn * a.position - b.position).length() < 1e-9 && (turn * a.direction - b.direction).length() < 1e-9
            );
        }
    }
}

/// A 90 degree mitre of perfect mirrors sends most of an axial beam back, and loses nothing: 0.0535 and 0.9465 of the table.
#[test]
fn a_mitre_of_ninety_degrees_sends_an_axial_beam_back() {
    let guide = BentGuide::new(RADIUS, &[(0.5, DVec3::Z), (0.5, DVec3::X)], [1.0; 3].into(), [1.0; 3]);
    let guide = skyduct::guide::Guide::Bent(guide);
    let mut random = PathRandom::new(Key::new(6));
    let samples = 50_000u32;
    let (mut forward, mut back, mut cut) = (0u32, 0u32, 0u32);
    for _ in 0..samples {
        let entry = guide.entry(random.uniform2(), DVec3::NEG_X).unwrap();
        let transit = guide.down::<1>(entry.position, DVec3::NEG_X, &mut random);
        match transit.end {
            End::Opening => forward += 1,
            End::Top => back += 1,
            End::Cut => cut += 1,
            End::Absorbed | End::Lost => panic!("a perfect mirror absorbs nothing: {entry:?}"),
        }
        assert_eq!(transit.mirrors.0, [1.0]);
    }
    let row =
        rows("elbow_transmission.csv").into_iter().find(|row| row[..3] == ["90", "collimated axial", "1.0"]).unwrap();
    let share = |count: u32| f64::from(count) / f64::from(samples);
    let error = (share(forward) * share(back) / f64::from(samples)).sqrt().hypot(number(&row[4]));
    assert!((share(forward) - number(&row[3])).abs() < 4.0 * error, "{}", share(forward));
    assert!((share(back) - number(&row[5])).abs() < 4.0 * error, "{}", share(back));
    assert!(forward + back + cut == samples && share(cut) <= 5e-5, "{cut} cut");
}

/// A bend of a millionth of a degree is none; one of 180 degrees is refused.
#[test]
fn a_bend_of_nothing_is_none() {
    let bend = 1e-6f64.to_radians();
    let axis = DVec3::new(bend.sin(), 0.0, bend.cos());
    let bent = BentGuide::new(RADIUS, &[(0.5, DVec3::Z), (0.5, axis)], [0.98; 3].into(), [1.0; 3]);
    let [bent, straight] = [skyduct::guide::Guide::Bent(bent), skyduct::guide::Guide::Straight(guide(1.0, 0.98))];
    let mut random = PathRandom::new(Key::new(7));
    let mut different = 0;
    for _ in 0..20_000 {
        let from = (warp::disc(random.uniform2()) * RADIUS).extend(0.0);
        let up = warp::cosine_hemisphere(random.uniform2());
        let [a, b] = [&bent, &straight].map(|guide| guide.up::<1>(from, up, &mut PathRandom::new(Key::new(0))));
        assert_eq!(a.end, b.end);
        different += u32::from((a.mirrors.0[0] - b.mirrors.0[0]).abs() > 1e-12);
    }
    // a ray may meet one mirror more: one in 1e5 at most
    assert!(different <= 4, "{different}");
    // the same photons, through the same steps: a bend of 1e-200 degrees is one by its kind alone
    let at = |tilt_deg: f64| {
        let mut document = cube();
        document["tubes"][0]["segments"] = json!([{ "length_m": 0.5 }, { "length_m": 0.5, "tilt_deg": tilt_deg }]);
        lux(&rendered(&prepared(&document)).0)
    };
    for (bent, straight) in at(1e-6).iter().zip(at(1e-200)) {
        assert!((bent / straight - 1.0).abs() < 1e-6, "{bent} {straight}");
    }
    let folded = json!([{ "length_m": 1 }, { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 0 },
                        { "length_m": 1, "tilt_deg": 90, "azimuth_deg": 180 }]);
    refused(&with(base(), "/tubes/0/segments", folded), "/tubes/0/segments/2/tilt_deg", FieldErrorCode::Invalid);
}

/// The light of two tubes is that of each, the other one dark, to 1e-9; openings that overlap are refused.
#[test]
fn two_tubes_give_the_sum_of_each() {
    let lit = |first: f64, second: f64| {
        let tubes = [(0.6, 0.7, first), (1.5, 1.3, second)].map(|(x, y, transmittance)| Tube {
            centre: DVec2::new(x, y),
            ..straight(0.6, 0.95, lambertian(transmittance, 0.2))
        });
        let day = daylight(12, 5000.0, 40.0, 120.0);
        let mut scene = scenes::cube(0.2, 0.5, 0.7, tubes.to_vec(), day, EstimateKind::Point);
        scene.grids = floor(3);
        solved(&scene)
    };
    let (both, first, second) = (lit(0.6, 0.5), lit(0.6, 0.0), lit(0.0, 0.5));
    for sensor in 0..9 {
        let sum = first[sensor] + second[sensor];
        assert!((both[sensor] / sum - 1.0).abs() < 1e-9, "{} {sum}", both[sensor]);
    }
    let mut second = base()["tubes"][0].clone();
    second["centre_m"] = json!([1.2, 1.016]);
    refused(&with(base(), "/tubes/-", second), "/tubes/1/centre_m", FieldErrorCode::Invalid);
}

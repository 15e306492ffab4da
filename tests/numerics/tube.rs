//! Tubes whose light is reflected never, seldom, or millions of times; rays along axes, walls and edges; tubes of no length.

use std::f64::consts::{FRAC_1_PI, FRAC_PI_4, PI, TAU};
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use serde_json::json;
use skyduct::analytic::Solver;
use skyduct::analytic::holigilm::Holigilm;
use skyduct::geometry::cylinder::traverse;
use skyduct::geometry::disc::disc_irradiance;
use skyduct::guide::transmittance::beam_transmission;
use skyduct::guide::{End, StraightGuide};
use skyduct::integrator::deterministic::installation;
use skyduct::optics::Diffuser;
use skyduct::sampling::{Key, PathRandom, warp};
use skyduct::scene::{EstimateKind, Grid, Scene};
use skyduct::sky::direction;
use skyduct::statistics::Moments;
use skyduct::traceable::Place;

use crate::jobs::{cube, lux, prepared, rendered};
use crate::scenes::{self, RADIUS, SIDE, daylight, lambertian, light_tracing, run, straight, traceable};

/// Tangent of the angle from the axis of light that is `elevation_deg` above the horizon.
fn tangent(elevation_deg: f64) -> f64 {
    1.0 / elevation_deg.to_radians().tan()
}

pub fn guide(length: f64, reflectance: f64) -> StraightGuide {
    let collector_transmittance = [1.0; 3];
    StraightGuide { radius: RADIUS, length, reflectance: [reflectance; 3].into(), collector_transmittance }
}

fn down(guide: StraightGuide, position: DVec3, direction: DVec3) -> skyduct::guide::Transit<1> {
    skyduct::guide::Guide::Straight(guide).down(position, direction, &mut PathRandom::new(Key::new(0)))
}

/// Illuminances of the only grid by the solver without random walks.
pub fn solved(scene: &Scene) -> Vec<f64> {
    let method = Holigilm::new(installation(&traceable(scene), &scene.grids), 1e-3, 0);
    method.solve(&AtomicBool::new(false)).unwrap().grids[0].illuminance.clone()
}

pub fn floor(cells: usize) -> Vec<Grid> {
    vec![Grid::new("floor".into(), 0.0, [cells; 2], 0.0, [SIDE; 2], EstimateKind::Point)]
}

/// Perfect mirrors and 100 diameters: everything leaves, however many the reflections are (at 1 degree (4/pi) A = 7294 on
/// average), and under a uniform sky the floor has pi L F, as if there was no tube.
#[test]
fn perfect_mirrors_lose_nothing_over_a_hundred_diameters() {
    let length = 100.0 * 2.0 * RADIUS;
    for elevation_deg in [1e-9, 0.1, 1.0, 10.0, 45.0, 89.0, 90.0] {
        assert_eq!(beam_transmission(100.0, tangent(elevation_deg), 1.0), 1.0);
    }
    let mut random = PathRandom::new(Key::new(1));
    let mut bounces = Moments::default();
    let (sin, cos) = 1f64.to_radians().sin_cos();
    for _ in 0..20_000 {
        let entry = (warp::disc(random.uniform2()) * RADIUS).extend(length);
        let passage = traverse(RADIUS, entry, DVec3::new(cos, 0.0, -sin), length);
        bounces.push(passage.bounces);
        let transit = down(guide(length, 1.0), entry, DVec3::new(cos, 0.0, -sin));
        assert_eq!((transit.end, transit.weight().0), (End::Opening, [1.0]));
        assert!(transit.position.truncate().length() <= RADIUS * (1.0 + 1e-12) && transit.rays == 1);
    }
    let expected = 100.0 * tangent(1.0) / FRAC_PI_4;
    assert!((bounces.mean - expected).abs() < 4.0 * bounces.standard_error(), "{} {expected}", bounces.mean);

    let tube = straight(length, 1.0, Diffuser::Open);
    let mut scene = scenes::cube(0.0, 0.0, 0.0, vec![tube], daylight(5, 1000.0, 35.0, 0.0), EstimateKind::Point);
    scene.grids = floor(3);
    for (sensor, lux) in solved(&scene).into_iter().enumerate() {
        let offset = DVec2::new(scene.grids[0].x_m[sensor % 3], scene.grids[0].y_m[sensor / 3]) - 0.5 * SIDE;
        let exact = PI * 1000.0 * disc_irradiance(RADIUS, SIDE, offset.length()).vertical;
        assert!((lux / exact - 1.0).abs() < 1e-10, "{lux} {exact}");
    }
    let estimate = run(&scene, &*light_tracing(&scene, 4096, 1), 2);
    let (emitted, energy) = (estimate.energy.emitted, estimate.energy);
    assert!(energy.guide == 0.0 && energy.guide_top == 0.0 && (energy.room / emitted - 1.0).abs() < 1e-12);
}

/// Black walls pass what does not meet them, (2/pi)(acos A - A sqrt(1 - A^2)): the series without a logarithm of 0, and rays
/// with 0^0 = 1.
#[test]
fn black_walls_pass_what_does_not_meet_them() {
    for (elevation_deg, aspect, exact) in
        [(85.0, 1.0, 0.888_748_244_1), (60.0, 1.0, 0.308_068_009_3), (45.0, 0.5, 0.391_002_219_0)]
    {
        let series = beam_transmission(aspect, tangent(elevation_deg), 0.0);
        assert!((series - exact).abs() < 0.5e-10, "{elevation_deg}: {series}");
        let guide = guide(2.0 * RADIUS * aspect, 0.0);
        let beam = direction(f64::to_radians(elevation_deg), 0.7);
        let (mut random, mut passed) = (PathRandom::new(Key::new(2)), Moments::default());
        for _ in 0..20_000 {
            let entry = (warp::disc(random.uniform2()) * RADIUS).extend(guide.length);
            let [weight] = down(guide.clone(), entry, -beam).weight().0;
            assert!(weight == 0.0 || weight == 1.0);
            passed.push(weight);
        }
        assert!((passed.mean - exact).abs() < 4.0 * passed.standard_error(), "{elevation_deg}: {}", passed.mean);
    }
    for aspect in [1.0, 1.0f64.next_up(), 1.5, 1e6] {
        assert_eq!(beam_transmission(aspect, 1.0, 0.0), 0.0);
    }
    assert!(beam_transmission(1.0f64.next_down(), 1.0, 0.0) < 1e-15);
}

/// Transmissions that have no place in f32, and one that has none in f64: right to the printed digits, never NaN, and never a
/// loop through products that are too small to be normal.
#[test]
fn faint_transmissions_keep_their_digits() {
    let at = |elevation_deg: f64, reflectance: f64| beam_transmission(100.0, tangent(elevation_deg), reflectance);
    for (elevation_deg, reflectance, printed, half_digit) in
        [(1.0, 0.98, 7.934e-52, 0.0005e-52), (1.0, 0.995, 9.5397e-14, 0.00005e-14), (0.1, 0.995, 1.75e-126, 0.005e-126)]
    {
        let transmission = at(elevation_deg, reflectance);
        assert!((transmission - printed).abs() <= half_digit, "{elevation_deg} {reflectance}: {transmission:e}");
        assert!(transmission.is_normal());
    }
    assert_eq!(at(0.1, 0.98), 0.0);
    for k in 1..2000 {
        let transmission = at(0.002 * f64::from(k), 0.98);
        assert!((0.0..1.0).contains(&transmission), "{k}: {transmission}");
    }
    // a ray of 1e-7 degrees elevation meets some 5e9 mirrors
    let entry = DVec3::new(0.03, 0.02, 25.4);
    let grazing = -direction(1e-7f64.to_radians(), 0.4);
    assert_eq!(down(guide(25.4, 0.98), entry, grazing).weight().0, [0.0]);
}

/// Light along the wall's normal: there is no time in which it would reach the end, or next to none.
#[test]
fn light_across_the_tube_never_arrives() {
    assert_eq!(beam_transmission(4.0, f64::INFINITY, 0.98), 0.0);
    assert_eq!(beam_transmission(0.0, f64::MAX, 0.98), 1.0);
    for tangent in [1e12, 1e100, 1e300] {
        assert_eq!(beam_transmission(4.0, tangent, 0.98), 0.0);
    }
    let entry = DVec3::new(0.05, 0.02, 1.0);
    let level = down(guide(1.0, 0.98), entry, DVec3::X);
    assert!(level.end == End::Lost && level.weight().0 == [0.0]);
    for vertical in [1e-12f64, 1e-100, 1e-300] {
        let nearly = DVec3::new((1.0 - vertical * vertical).sqrt(), 0.0, -vertical);
        assert_eq!(down(guide(1.0, 0.98), entry, nearly).weight().0, [0.0], "{vertical}");
        let mirror = down(guide(1.0, 1.0), entry, nearly);
        assert_eq!(mirror.weight().0, [1.0]);
        assert!(mirror.position.is_finite() && mirror.position.truncate().length() <= RADIUS * (1.0 + 1e-12));
        assert!(mirror.direction.is_finite());
    }
}

/// Rays whose reflections draw a regular polygon are back where they began after any number of rounds: 10^7 reflections in
/// one step. The turn of one reflection is rounded by half an ulp of an angle below 2 pi, so that 10^7 of them are off by at
/// most 1e7 x 4.4e-16; the quotient of path and chord by as much.
#[test]
fn ten_million_reflections_close_a_polygon() {
    for (corners, star) in [(3u32, 1.0), (5, 2.0), (7, 3.0), (12, 5.0)] {
        let half_turn = PI * star / f64::from(corners);
        let chord = 2.0 * RADIUS * half_turn.sin();
        for bounces in [f64::from(corners) * 1000.0, f64::from(corners) * (1e7 / f64::from(corners)).round()] {
            // from the middle of a chord, whose distance from the axis is r cos(half the turn)
            let from = DVec3::new(RADIUS * half_turn.cos(), 0.0, 0.0);
            let axial = 1.0;
            let transverse = bounces * chord / axial;
            let direction = DVec3::new(0.0, transverse, 1.0).normalize();
            let passage = traverse(RADIUS, from, direction, axial);
            assert!((passage.bounces - bounces).abs() <= 1.0, "{}", passage.bounces);
            let tolerance = bounces * 8.9e-16 * (RADIUS + chord);
            let off = (passage.position - from - DVec3::Z * axial).length();
            assert!(off < tolerance.max(1e-15), "{corners} {bounces}: {off:e} of {tolerance:e}");
            assert!((passage.direction - direction).length() < bounces * 8.9e-16 + 1e-15);
        }
    }
    // within an ulp of the wall: too many to count, along it all the same
    for gap in [1e-15, 1e-16, 0.0] {
        let from = DVec3::new(RADIUS * (1.0 - gap), 0.0, 0.0);
        let passage = traverse(RADIUS, from, DVec3::new(0.0, 0.6, 0.8), 2.0);
        let along_the_wall = DVec2::from_angle(2.0 * 0.75 / RADIUS) * RADIUS;
        assert!(passage.position.truncate().length() <= RADIUS * (1.0 + 1e-12));
        // half a chord of at most sqrt(2 gap) radii
        assert!((passage.position.truncate() - along_the_wall).length() < 1e-7 * RADIUS, "{gap}: {passage:?}");
    }
}

/// Rays from the rim outward meet the wall at once: one reflection, no escape, whatever an ulp does to the place.
#[test]
fn rays_from_the_rim_outward_are_reflected_at_once() {
    let mut random = PathRandom::new(Key::new(3));
    for _ in 0..10_000 {
        let azimuth = TAU * random.uniform();
        let rim = DVec2::from_angle(azimuth) * RADIUS;
        // up to 80 degrees from the normal of the wall
        let outward = DVec2::from_angle(azimuth + (2.0 * random.uniform() - 1.0) * 1.4);
        let direction = (outward * 0.6).extend(0.8);
        let passage = traverse(RADIUS, rim.extend(0.0), direction, 1e-3);
        let normal = rim.normalize();
        assert_eq!(passage.bounces, 1.0, "{rim} {outward}");
        assert!(passage.direction.truncate().dot(normal) < 0.0);
        assert!(passage.position.truncate().length() <= RADIUS * (1.0 + 1e-12));
    }
}

/// The circle where tube and diffuser meet belongs to one of them: light that ends on it from above passes the closure, from
/// below it meets the opening or the ceiling, and the energy balance of a job closes.
#[test]
fn the_edge_circle_is_counted_once() {
    let inner = skyduct::optics::DiffuserZone::Lambertian;
    let tube = straight(1.0, 0.95, scenes::mixed(inner));
    let scene = scenes::cube(0.3, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 40.0, 120.0), EstimateKind::Point);
    let room = traceable(&scene);
    let centre = DVec2::splat(0.5 * SIDE);
    let up = |at: DVec2| room.intersect(at.extend(0.3), DVec3::Z, None).place;
    for k in 0..1000 {
        let unit = DVec2::from_angle(TAU * f64::from(k) / 1000.0);
        // one of the two, and never anything else, within rounding; beyond, the right one
        let on_edge = up(centre + unit * RADIUS);
        assert!(matches!(on_edge, Place::Opening(0) | Place::Surface(_)));
        assert_eq!(up(centre + unit * (RADIUS * (1.0 - 1e-12))), Place::Opening(0));
        assert!(matches!(up(centre + unit * (RADIUS * (1.0 + 1e-12))), Place::Surface(_)));
        // down onto the edge, by a meridional ray that starts and ends on the rim
        let transit =
            down(guide(1.0, 0.95), (unit * RADIUS).extend(1.0), (-unit * 2.0 * RADIUS).extend(-1.0).normalize());
        assert_eq!(transit.end, End::Opening);
        let [weight] = transit.mirrors.0;
        assert!([1.0, 0.95, 0.95 * 0.95].contains(&weight), "{weight}");
    }
    let energy = run(&scene, &*light_tracing(&scene, 16_384, 1), 2).energy;
    assert!(energy.relative_closure_error().abs() < 1e-12, "{}", energy.relative_closure_error());
}

/// A tube of no length is no tube; one of a nanometre is none to 1e-9.
#[test]
fn a_tube_of_no_length_is_none() {
    for reflectance in [0.0, 0.5, 0.98] {
        assert_eq!(beam_transmission(0.0, tangent(5.0), reflectance), 1.0);
        // 1 - T is (1 - R)(4/pi) A
        let thin = beam_transmission(1e-9 / (2.0 * RADIUS), tangent(45.0), reflectance);
        assert!((1.0 - thin - (1.0 - reflectance) * 1e-9 / (2.0 * RADIUS) / FRAC_PI_4).abs() < 2e-16, "{thin}");
        assert!(1.0 - thin < 1e-8);
    }
    let (from, along) = (DVec3::new(0.05, 0.02, 1e-9), DVec3::new(0.6, 0.0, -0.8));
    let transit = down(guide(1e-9, 0.98), from, along);
    assert!((transit.position - from).length() < 2e-9 && transit.direction == along && transit.weight().0 == [1.0]);
    let passage = traverse(RADIUS, from, along, 0.0);
    assert_eq!((passage.position, passage.direction, passage.bounces), (from, along, 0.0));
    let at = |length: f64| {
        let tube = straight(length, 0.9, lambertian(0.5, 0.0));
        let mut scene = scenes::cube(0.2, 0.5, 0.7, vec![tube], daylight(5, 1000.0, 35.0, 0.0), EstimateKind::Point);
        scene.grids = floor(2);
        solved(&scene)
    };
    // the sheet of a sky without tube, with its reflection
    let bare = scenes::cube(
        0.2,
        0.5,
        0.7,
        vec![straight(1e-300, 0.9, lambertian(0.5, 0.0))],
        daylight(5, 1000.0, 35.0, 0.0),
        EstimateKind::Point,
    );
    let bare = Scene { grids: floor(2), ..bare };
    for (thin, none) in at(1e-9).iter().zip(solved(&bare)) {
        // (1 - R)(4/pi)(L/D) times the mean of tan theta over a uniform sky, pi/2
        assert!((thin / none - 1.0).abs() < 1e-9, "{thin} {none}");
    }
}

/// 1000 lm through a source of 1 mm, 100 m above.
#[test]
fn a_millimetre_is_seen_from_a_hundred_metres() {
    let (radius, height) = (0.0005, 100.0);
    let factor = disc_irradiance(radius, height, 0.0).vertical;
    // r^2 / (r^2 + H^2) on the axis
    assert!((factor / 2.499_999_999_94e-11 - 1.0).abs() < 3e-12, "{factor:e}");
    assert!((1000.0 / (PI * radius * radius) * factor - 0.031_830_988_6).abs() < 0.5e-10);
    assert!((1000.0 * FRAC_1_PI / (height * height) - 0.031_830_988_6).abs() < 1e-10);
    // a job: a sky of pi L = 1000 lm / area through a clear opening
    let mut document = cube();
    document["room"]["size_m"] = json!([100, 100, 100]);
    document["room"]["surfaces"] = json!({ "floor": { "reflectance": 0 }, "walls": { "reflectance": 0 },
                                           "ceiling": { "reflectance": 0 } });
    document["sky"] = json!({ "cie_type": 5, "sun_position": { "altitude_deg": 35, "azimuth_deg": 0 },
                              "zenith_luminance_cd_m2": 1e9 });
    let tube = &mut document["tubes"][0];
    tube["centre_m"] = json!([50, 50]);
    tube["diameter_m"] = json!(2.0 * radius);
    tube["reflectance"] = json!(1);
    tube["diffuser"] = json!({ "kind": "lambertian", "transmittance": 0.5 });
    document["method"] = json!("holigilm");
    document["grids"][0]["cells"] = json!([1, 1]);
    let (estimate, _) = rendered(&prepared(&document));
    let exact = 0.5 * PI * 1e9 * factor;
    assert!((lux(&estimate)[0] / exact - 1.0).abs() < 1e-9, "{} {exact}", lux(&estimate)[0]);
}

//! Horizon and ground around a room, through the engine.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use serde_json::json;
use skyduct::document::JobDocument;
use skyduct::engine::checkpoint::encode;
use skyduct::estimate::Estimate;
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::disc::disc_irradiance;
use skyduct::guide::mesh::Part;
use skyduct::guide::performance::Throughput;
use skyduct::guide::performance::sky as light_of_sky;
use skyduct::guide::{Guide, Section};
use skyduct::integrator::method::{Computation, RefusalCode, Task};
use skyduct::optics::Collector;
use skyduct::plan::MethodRequest;
use skyduct::sampling::Key;
use skyduct::scene::{EstimateKind, Grid, MeshTube, Scene, Tube, TubeShape};
use skyduct::sky::{Horizon, direction};

use crate::documents::{first_passes, prepare, refusal, render};
use crate::matrix::columns::{Work, column};
use crate::scenes::{self, RADIUS, SIDE, assert_grid, bent, cube, daylight, domed, lambertian, run, straight, values};

/// A horizon through points of azimuth and altitude in degrees.
fn horizon(points: &[(f64, f64)]) -> Option<Horizon> {
    let point = |(azimuth, altitude): &(f64, f64)| (azimuth.to_radians(), altitude.to_radians());
    Horizon::new(points.iter().map(point).collect(), 0.0)
}

/// Puts a horizon of this luminance ratio and ground of this reflectance around all tubes of a scene.
fn surround(scene: &mut Scene, horizon: Option<Horizon>, ratios: [f64; 2]) {
    let around = Arc::new(scene.daylight.as_ref().unwrap().surroundings(horizon, ratios, 0.0));
    scene.tubes.iter_mut().for_each(|tube| tube.surroundings = Some(around.clone()));
}

/// Altitudes from 0 to 45 degrees.
fn jagged() -> Option<Horizon> {
    horizon(&[(0.0, 5.0), (40.0, 45.0), (90.0, 0.0), (150.0, 35.0), (200.0, 30.0), (201.0, 2.0), (330.0, 12.0)])
}

/// The methods that compute a scene, with their settings.
const METHODS: [&str; 7] =
    ["light_tracing", "path_tracing", "bidirectional_path_tracing", "two_stage", "photon_mapping", "sppm", "ppm"];

/// Renders the points of a scene by a method of the matrix.
fn rendered(scene: &Scene, name: &str, passes: u64) -> Estimate {
    let MethodRequest::Method(method) = column(name).request(&Work::of(scene, 4.0, 1.0)) else { panic!("{name}") };
    let traceable = scenes::traceable(scene);
    match method.described().build(&Task::whole(scene, &traceable), 7, 0.02) {
        Computation::Passes(integrator) => run(scene, &*integrator, passes),
        Computation::Solution(_) => panic!("{name} has no passes"),
    }
}

/// Rings of 10, 20 and 30 degrees hide (3 sin^2 + 4 sin^3) / 7 of the traditional overcast sky, 1.6, 7.3 and 17.9 %, and give sin^2 times
/// their luminance relative to the mean.
#[test]
fn rings_take_their_part_of_an_overcast_sky() {
    let (transmittance, level) = (0.5, 1e4);
    for (altitude_deg, percent, ratio) in [(10.0f64, 1.6, 0.0), (20.0, 7.3, 0.0), (30.0, 17.9, 0.0), (30.0, 17.9, 0.4)]
    {
        let z = altitude_deg.to_radians().sin();
        let hidden = (3.0 * z * z + 4.0 * z * z * z) / 7.0;
        assert!((100.0 * hidden - percent).abs() < 0.05);
        let tube = straight(1e-9, 1.0, lambertian(transmittance, 0.0));
        let mut scene = cube(0.0, 0.0, 0.0, vec![tube], daylight(16, level, 35.0, 0.0), EstimateKind::Point);
        surround(&mut scene, horizon(&[(0.0, altitude_deg)]), [ratio, 0.2]);
        let exitance = transmittance * (1.0 - hidden + ratio * z * z) * level * 7.0 * PI / 9.0;
        let sensors = &scene.grids[0];
        let truth: Vec<f64> = (0..sensors.len())
            .map(|sensor| {
                let offset = (sensors.centre(sensor).truncate() - DVec2::splat(0.5 * SIDE)).length();
                exitance * disc_irradiance(RADIUS, SIDE, offset).vertical
            })
            .collect();
        for name in ["light_tracing", "path_tracing", "bidirectional_path_tracing"] {
            let estimate = rendered(&scene, name, 64);
            assert_grid(&estimate, &truth, &vec![0.0; truth.len()], 4.0, 0.0, name);
            let (lux, errors) = values(&estimate);
            let middle = lux.len() / 2;
            assert!(errors[middle] < 0.005 * lux[middle], "{name}: {} {}", lux[middle], errors[middle]);
        }
    }
}

/// A tube whose upper end leans by 0.8 rad.
fn leaning() -> Tube {
    let mut tube = bent(lambertian(0.6, 0.2));
    if let TubeShape::Cylinders(cylinders) = &mut tube.shape {
        cylinders.segments.pop();
    }
    tube
}

/// Transmittance of panes.
const PANE: f64 = 0.8;

/// A straight tube whose pane is tilted toward an azimuth, both in radians.
fn with_pane(reflectance: f64, tilt: f64, azimuth: f64) -> Tube {
    let mut tube = straight(0.6, reflectance, lambertian(0.6, 0.2));
    if let TubeShape::Cylinders(cylinders) = &mut tube.shape {
        cylinders.cut = Some(direction(0.5 * PI - tilt, azimuth));
        cylinders.collector = Collector::Flat { transmittance: [PANE; 3] };
    }
    tube
}

/// The tube of [`with_pane`] as a prism of the same area of its section, and a clear cap.
fn prism(reflectance: f64, tilt: f64, azimuth: f64) -> Tube {
    const SIDES: u32 = 96;
    let step = 2.0 * PI / f64::from(SIDES);
    let radius = RADIUS * (step / step.sin()).sqrt();
    let facing = direction(0.0, azimuth) * tilt.tan();
    let corner = |k: u32| DVec3::new(radius * (f64::from(k) * step).cos(), radius * (f64::from(k) * step).sin(), 0.0);
    let upper = |foot: DVec3| foot.with_z(0.6 - facing.dot(foot));
    let positions = (0..SIDES).map(corner).chain((0..SIDES).map(|k| upper(corner(k)))).collect();
    let side = |k: u32| {
        let next = (k + 1) % SIDES;
        [[k, next, next + SIDES], [k, next + SIDES, k + SIDES]]
    };
    let triangles: Vec<[u32; 3]> = (0..SIDES).flat_map(side).collect();
    let triangle_materials = vec![0; triangles.len()];
    let materials = vec!["pipe".to_owned()];
    let mesh =
        Arc::new(TriangleMesh { positions, triangles, triangle_materials, materials, ..TriangleMesh::default() });
    let parts = vec![Part::Pipe { reflectance: [reflectance; 3].into() }];
    let section = Section::Facets { sides: None, reason: "a prism" };
    let shape = TubeShape::Mesh(MeshTube { mesh, parts, rotation: 0.0, section });
    Tube { shape, ..straight(0.6, reflectance, lambertian(0.6, 0.2)) }
}

/// Nine points below tubes under a clear sky behind a jagged horizon, above bright ground.
fn hilly(tubes: Vec<Tube>) -> Scene {
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(12, 5000.0, 40.0, 120.0), EstimateKind::Point);
    surround(&mut scene, jagged(), [0.1, 0.5]);
    // one tube has a horizon of its own
    let own = scene.daylight.as_ref().unwrap().surroundings(horizon(&[(0.0, 25.0)]), [0.1, 0.5], 0.0);
    scene.tubes[0].surroundings = Some(Arc::new(own));
    scene.grids = vec![Grid::new("grid".into(), 0.5, [3, 3], 0.1, [SIDE, SIDE], EstimateKind::Point)];
    scene
}

/// Light that is followed from the sky and light that is followed to it agree within 4 combined errors; density estimates within their
/// bias of 3 % beside.
#[test]
fn methods_agree_behind_a_jagged_horizon() {
    let diffuser = || lambertian(0.6, 0.2);
    let at = |x: f64, y: f64, tube: Tube| Tube { centre: DVec2::new(x, y), ..tube };
    let level = hilly(vec![at(0.6, 0.7, straight(0.6, 0.9, diffuser())), at(1.5, 1.3, straight(0.6, 0.9, diffuser()))]);
    // these see the ground
    let others = hilly(vec![
        at(0.5, 0.5, leaning()),
        at(1.5, 1.5, domed(diffuser())),
        at(0.5, 1.5, with_pane(0.9, 0.9, 2.0)),
        at(1.5, 0.5, prism(0.9, 0.9, 2.0)),
    ]);
    for (scene, what) in [(&level, "level"), (&others, "above the ground")] {
        let (truth, errors) = values(&rendered(scene, "light_tracing", 32));
        for name in &METHODS[1..] {
            let biased = ["photon_mapping", "sppm", "ppm"].contains(name);
            let estimate = rendered(scene, name, 16);
            assert_grid(&estimate, &truth, &errors, 4.0, if biased { 0.03 } else { 0.0 }, &format!("{what} {name}"));
        }
    }
}

/// Light of the sky of a scene with one tube, with its guide.
fn light(scene: &Scene, rays: u64) -> (Throughput, Guide) {
    let traceable = scenes::traceable(scene);
    let tube = &traceable.tubes[0];
    (light_of_sky(&tube.guide, tube.sky.as_ref().unwrap(), Key::new(3), rays), tube.guide.clone())
}

/// A tilted opening under a uniform sky sees (1 + cos tilt) / 2 of it and (1 - cos tilt) / 2 of the ground: across a leaning tube, and
/// in the plane of a pane, whose area is that of the tube's section over the cosine.
#[test]
fn tilted_openings_see_sky_and_ground_by_their_view_factors() {
    let level = PI * RADIUS * RADIUS * PI * 1000.0;
    for (tube, tilt, area) in [
        (leaning(), 0.8f64, 1.0),
        (with_pane(0.9, 0.5, 1.0), 0.5, 1.0 / 0.5f64.cos()),
        (with_pane(1.0, 1.2, 4.0), 1.2, 1.0 / 1.2f64.cos()),
        (prism(0.9, 0.9, 2.0), 0.9, 1.0 / 0.9f64.cos()),
    ] {
        for ground in [0.0, 0.2, 1.0] {
            let day = daylight(5, 1000.0, 40.0, 120.0);
            let mut scene = cube(0.3, 0.5, 0.7, vec![tube.clone()], day, EstimateKind::Point);
            surround(&mut scene, None, [0.1, ground]);
            let expected = level * area * ((1.0 + tilt.cos()) / 2.0 + ground * (1.0 - tilt.cos()) / 2.0);
            let entering = light(&scene, 4096).0.entering();
            let error = entering.standard_error();
            assert!(
                (entering.mean - expected).abs() < 4.0 * error + 1e-12 * expected,
                "{tilt} {ground}: {entering:?} {expected}"
            );
            assert!(error < 3e-3 * expected, "{tilt} {ground}: {error} {expected}");
        }
    }
}

/// A pane cuts a tube as it cuts the facets of a prism, within 4 combined errors and the 0.1 % by which 96 sides reflect more often.
#[test]
fn a_cut_tube_passes_what_a_cut_mesh_passes() {
    for (reflectance, tilt, azimuth) in [(0.9, 0.6, 2.0), (0.95, 1.1, 5.0), (0.8, 0.3, 0.5)] {
        let of = |tube: Tube| {
            let mut scene = hilly(vec![tube]);
            surround(&mut scene, jagged(), [0.1, 0.5]);
            light(&scene, 4096)
        };
        let (cut, of_cylinder) = of(with_pane(reflectance, tilt, azimuth));
        let (mesh, of_mesh) = of(prism(reflectance, tilt, azimuth));
        assert!(matches!(of_cylinder, Guide::Bent(_)) && matches!(of_mesh, Guide::Mesh(_)));
        let pairs = [(cut.entering(), mesh.entering(), 1.0), (cut.arriving(), mesh.arriving(), PANE)];
        for (cut, mesh, pane) in pairs {
            let tolerance = 4.0 * cut.standard_error().hypot(mesh.standard_error()) + 2e-3 * cut.mean;
            assert!((cut.mean - pane * mesh.mean).abs() < tolerance, "{tilt}: {cut:?} {mesh:?}");
        }
    }
}

/// Without a part above 0 a level tube has the bits that it has without surroundings.
#[test]
fn a_flat_horizon_changes_no_bit_of_a_level_tube() {
    for method in
        [json!("auto"), json!({ "kind": "light_tracing" }), json!({ "kind": "path_tracing" }), json!("holigilm")]
    {
        let [without, flat] = [json!(null), json!({ "horizon": [[0, 0], [180, 0]] })].map(|surroundings| {
            let prepared = prepare("S1", |document| {
                document["method"] = method.clone();
                document["stop"] = json!({ "relative_error": 0.05, "max_passes": 2 });
                if !surroundings.is_null() {
                    document["surroundings"] = surroundings;
                }
            });
            encode(&first_passes(&prepared, 2))
        });
        assert!(without == flat, "{method}");
    }
}

/// A room that is turned with sky and horizon has the values that it has unturned.
#[test]
fn a_horizon_turns_with_the_room() {
    let points = |turn: f64| -> Vec<[f64; 2]> {
        [(10.0, 5.0), (50.0, 45.0), (90.0, 0.0), (150.0, 35.0), (230.0, 12.0)]
            .map(|(azimuth, altitude)| [azimuth + turn, altitude])
            .into()
    };
    let [values, turned] = [0.0, 70.0].map(|turn| {
        let prepared = prepare("S1", |document| {
            document["method"] = json!({ "kind": "light_tracing" });
            document["sky"]["sun_position"] = json!({ "altitude_deg": 40, "azimuth_deg": 100.0 + turn });
            document["sky"]["direct_normal_illuminance_lux"] = json!(0);
            document["room"]["rotation_deg"] = json!(turn);
            document["surroundings"] = json!({ "horizon": points(turn), "luminance_ratio": 0.05 });
            document.as_object_mut().unwrap().remove("location");
            document.as_object_mut().unwrap().remove("time");
        });
        values(&first_passes(&prepared, 4)).0
    });
    for (value, turned) in values.iter().zip(&turned) {
        assert!((turned / value - 1.0).abs() < 1e-6, "{value} {turned}");
    }
}

/// Fluxes that `holigilm` traces through a leaning tube have the light of the ground, within 4 combined errors: it is a quarter of all.
#[test]
fn holigilm_follows_the_light_of_the_ground() {
    let rendered = |method: &str, ground: f64| {
        let prepared = prepare("S1", |document| {
            document["method"] = json!(method);
            document["tubes"][0]["segments"] =
                json!([{ "length_m": 0.4 }, { "length_m": 0.4, "tilt_deg": 75, "azimuth_deg": 180 }]);
            document["surroundings"] = json!({ "ground_reflectance": ground });
        });
        // a solver ends by itself
        values(&if method == "holigilm" { first_passes(&prepared, 1) } else { render(&prepared) })
    };
    let (dark, _) = rendered("holigilm", 0.0);
    let [(solved, of_solved), (traced, of_traced)] = ["holigilm", "light_tracing"].map(|method| rendered(method, 0.8));
    for (sensor, (solved, traced)) in solved.iter().zip(&traced).enumerate() {
        let error = of_solved[sensor].hypot(of_traced[sensor]);
        assert!((solved - traced).abs() < 4.0 * error && error < 0.02 * traced, "{sensor}: {solved} {traced} {error}");
        assert!(dark[sensor] < 0.8 * solved, "{sensor}: {} {solved}", dark[sensor]);
    }
}

/// Closed forms that need a sky without a horizon refuse it by name, and the empirical formula tilted upper ends.
#[test]
fn closed_forms_refuse_a_horizon() {
    for method in ["holigilm", "jenkins"] {
        let prepared = |altitude: f64| {
            let mut document = crate::reference::json("scenes/S1.json");
            document["method"] = json!(method);
            document["surroundings"] = json!({ "horizon": [[0, altitude]] });
            let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
            refusal(&document).map(|refusal| refusal.code)
        };
        assert_eq!((prepared(20.0), prepared(0.0)), (Some(RefusalCode::Horizon), None), "{method}");
    }
    let mut document = crate::reference::json("scenes/S1.json");
    document["method"] = json!("jenkins");
    document["tubes"][0]["collector"] = json!({ "kind": "flat", "transmittance": 0.9, "tilt_deg": 30 });
    let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    assert_eq!(refusal(&document).map(|refusal| refusal.code), Some(RefusalCode::TiltedEnds));
}

/// A sun that is half above the horizon gives half its light.
#[test]
fn half_a_sun_gives_half_its_light() {
    let lux = |altitude_deg: f64| {
        let tube = straight(0.6, 0.9, lambertian(0.6, 0.2));
        let mut sunny = cube(0.3, 0.5, 0.7, vec![tube], daylight(12, 0.0, 40.0, 0.0), EstimateKind::Point);
        scenes::with_sun(&mut sunny, 60_000.0, 40.0);
        surround(&mut sunny, horizon(&[(0.0, altitude_deg)]), [0.1, 0.0]);
        values(&rendered(&sunny, "light_tracing", 8)).0[40]
    };
    let (free, half) = (lux(30.0), lux(40.0));
    assert!(free > 0.0 && (half / free - 0.5).abs() < 0.01, "{free} {half}");
}

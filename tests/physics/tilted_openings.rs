//! Openings in the plane of a slope or a wall: closed forms, and methods against each other.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use skyduct::geometry::OpeningFrame;
use skyduct::geometry::disc::disc_irradiance;
use skyduct::integrator::method::{Described, RefusalCode, Task};
use skyduct::integrator::{
    Integrator, bidirectional, holigilm, jenkins, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage,
};
use skyduct::optics::{Collector, Diffuser, Surface};
use skyduct::sampling::{Key, PathRandom};
use skyduct::scene::{
    BoxObject, Enclosure, EstimateKind, Face, Grid, OpeningPlane, Scene, Segment, Sensor, StraightOrBent, Tube,
    TubeShape,
};
use skyduct::sky::{Sun, direction};

use crate::scenes::{
    RADIUS, SIDE, assert_grid, built, clear, cube, daylight, lambertian, peaked, run, straight, traceable, values,
};

/// Combined standard errors within which values agree: of some hundred comparisons by 24 passes, one in a hundred runs would be farther off.
pub const SIGMAS: f64 = 5.0;

/// Returns a segment along an axis.
pub fn along(length_m: f64, axis: DVec3) -> Segment {
    Segment { length_m, tilt: axis.truncate().length().atan2(axis.z), azimuth: axis.x.atan2(axis.y) }
}

/// Returns settings of two stages with few samples.
pub fn two_stages() -> two_stage::Settings {
    two_stage::Settings { photons_per_pass: Some(512), samples_per_sensor: Some(64), ..Default::default() }
}

/// An attic of 3 m x 4 m below a slope of 35 degrees, 1.8 m high in the south, with an opening in the slope and a grid on a desk.
fn attic(diffuser: Diffuser, surface: f64, estimate: EstimateKind) -> Scene {
    use skyduct::scene::prism::{CeilingPlane, KindSurfaces};
    let outline = [[0.0, 0.0], [3.0, 0.0], [3.0, 4.0], [0.0, 4.0]].map(DVec2::from).to_vec();
    let tangent = 35f64.to_radians().tan();
    let slope = CeilingPlane { height_m: 1.8, rise: DVec2::new(0.0, tangent) };
    let of = Some(Surface::diffuse([surface; 3]));
    let surfaces = KindSurfaces { floor: of, walls: of, ceiling: of };
    let mut scene = cube(0.0, 0.0, 0.0, vec![straight(0.5, 1.0, diffuser)], daylight(5, 5000.0, 45.0, 0.0), estimate);
    scene.room.enclosure = Enclosure::prism(&[outline], 1e-9, &[slope], surfaces).unwrap();
    let face = scene.room.enclosure.faces().iter().position(|face| face.name.starts_with("ceiling")).unwrap();
    let centre = DVec2::new(1.3, 1.4);
    let outward = -scene.room.enclosure.faces()[face].polygon.normal();
    let shape = StraightOrBent {
        reflectance: [1.0; 3].into(),
        segments: vec![along(0.5, outward)],
        collector: Collector::Open,
        cut: None,
    };
    scene.tubes[0] = Tube {
        face,
        centre,
        plane: OpeningPlane::OfFace { height_m: 1.8 + tangent * centre.y },
        shape: TubeShape::Cylinders(shape),
        ..scene.tubes[0].clone()
    };
    scene.grids = vec![Grid::new("desk".into(), 0.7, [3, 4], 0.0, [3.0, 4.0], estimate)];
    scene
}

fn frame(scene: &Scene) -> OpeningFrame {
    scene.tubes[0].frame(&scene.room.enclosure)
}

/// Methods of level grids that compute a scene, small.
fn methods(scene: &Scene, seed: u64) -> Vec<(&'static str, Box<dyn Integrator>)> {
    let compiled = traceable(scene);
    let task = Task::whole(scene, &compiled);
    let photons = Some(2048);
    let tracing = light_tracing::Settings { photons_per_pass: photons };
    let map = sppm::Settings { photons_per_pass: 4096, ..Default::default() };
    let paths = bidirectional::Settings { photons_per_pass: photons, ..Default::default() };
    let gathered = photon_mapping::Settings { photons_per_pass: photons, gather_rays: Some(64), ..Default::default() };
    let points = ppm::Settings { photons_per_pass: 4096, ..Default::default() };
    let all: [(&str, &dyn Described, Box<dyn Integrator>); 5] = [
        ("light tracing", &tracing, built(scene, &tracing, seed)),
        ("bidirectional", &paths, built(scene, &paths, seed)),
        ("photon mapping", &gathered, built(scene, &gathered, seed)),
        ("ppm", &points, built(scene, &points, seed)),
        ("sppm", &map, built(scene, &map, seed)),
    ];
    let accepted = all.into_iter().filter(|(_, settings, _)| settings.refuses(&task).is_none());
    accepted.map(|(name, _, method)| (name, method)).collect()
}

/// In a black attic the desk gets what the disc in the slope sends it in closed form, by every method; the pipe loses nothing under a sky and
/// above a ground of one luminance.
#[test]
fn a_disc_in_a_slope_has_a_closed_form() {
    let luminance = 5000.0;
    let mut scene = attic(lambertian(0.6, 0.0), 0.0, EstimateKind::Point);
    let around = Arc::new(scene.daylight.as_ref().unwrap().surroundings(None, [1.0, 1.0], 0.0));
    scene.tubes[0].surroundings = Some(around);
    let frame = frame(&scene);
    let of_sensor = |sensor: usize| {
        let Sensor { position, normal } = scene.grids[0].sensor(sensor);
        let (away, facing) = (frame.origin - position, frame.outward());
        let depth = away.dot(facing);
        let across = away - depth * facing;
        let components = [normal.dot(facing), normal.dot(across.normalize())];
        let seen = disc_irradiance(RADIUS, depth, across.length());
        0.6 * PI * luminance * (components[0] * seen.vertical + components[1] * seen.toward_axis)
    };
    let truth: Vec<f64> = (0..12).map(of_sensor).collect();
    let none = vec![0.0; 12];
    let paths = path_tracing::Settings { samples_per_sensor: 64, samples_per_pixel: 1 };
    let both: [(&str, Box<dyn Integrator>); 2] =
        [("path tracing", built(&scene, &paths, 3)), ("two stages", built(&scene, &two_stages(), 3))];
    for (name, method) in methods(&scene, 3).into_iter().chain(both) {
        assert_grid(&run(&scene, &*method, 24), &truth, &none, SIGMAS, 1e-9, name);
    }
}

/// In a grey attic with a cupboard, which hides the opening from some sensors in part, all methods agree with path tracing, at points below an
/// even sky, whose light comes through a closure that scatters evenly or by a table.
#[test]
fn methods_agree_below_a_slope() {
    for (name, diffuser, is_even) in [("even", lambertian(0.6, 0.3), true), ("measured", peaked(), false)] {
        let mut scene = attic(diffuser, 0.6, EstimateKind::Point);
        let object = BoxObject {
            size: DVec3::new(0.6, 0.5, 1.5),
            base: DVec3::new(1.6, 1.9, 0.0),
            rotation: 0.3,
            surface: Surface::diffuse([0.5; 3]),
        };
        scene.room.boxes.push(object);
        let paths = path_tracing::Settings { samples_per_sensor: 128, samples_per_pixel: 1 };
        let (truth, errors) = values(&run(&scene, &*built(&scene, &paths, 8), 24));
        let stages = is_even.then(|| ("two stages", built(&scene, &two_stages(), 8)));
        for (method, found) in methods(&scene, 8).into_iter().chain(stages) {
            assert_grid(&run(&scene, &*found, 24), &truth, &errors, SIGMAS, 0.0, &format!("{name}, {method}"));
        }
    }
}

/// The sun through a clear pane at the end of a pipe of no length lights one spot of a black floor: with the flux and the middle of a beam
/// through a tilted disc.
#[test]
fn a_sunbeam_falls_where_it_must() {
    let mut scene = attic(clear(), 0.0, EstimateKind::CellAverage);
    let outward = frame(&scene).outward();
    if let TubeShape::Cylinders(cylinders) = &mut scene.tubes[0].shape {
        cylinders.segments = vec![along(1e-9, outward)];
    }
    let sun = Sun { direction: direction(70f64.to_radians(), 170f64.to_radians()), normal_illuminance_lux: 80_000.0 };
    scene.daylight.as_mut().unwrap().sun = Some(sun);
    scene.daylight.as_mut().unwrap().sky = None;
    scene.grids = vec![Grid::new("floor".into(), 0.0, [60, 80], 0.0, [3.0, 4.0], EstimateKind::CellAverage)];
    let origin = frame(&scene).origin;
    let flux = 0.8 * 80_000.0 * PI * RADIUS * RADIUS * sun.direction.dot(outward);
    let middle = origin - sun.direction * (origin.z / sun.direction.z);
    for (name, method) in
        methods(&scene, 5).into_iter().filter(|(name, _)| !name.contains("pp") && *name != "photon mapping")
    {
        let found = run(&scene, &*method, 24);
        let (mut sum, mut moment) = (0.0, DVec2::ZERO);
        for sensor in 0..found.grids[0].sensors.len() {
            let lumens = scene.grids[0].cell_area_m2() * found.grids[0].illuminance_lux(sensor);
            sum += lumens;
            moment += lumens * scene.grids[0].centre(sensor).truncate();
        }
        // light counts at the centres of cells of 5 cm
        println!("{name}: {sum} of {flux} lm at {} of {middle}", moment / sum);
        assert!((sum / flux - 1.0).abs() < 2e-3, "{name}: {sum} {flux}");
        assert!((moment / sum).distance(middle.truncate()) < 5e-3, "{name}: {} {middle}", moment / sum);
    }
}

/// From nowhere where nothing is said to stand before a leaning opening is a point of it hidden, and from nowhere where it is said to be hidden
/// is one seen.
#[test]
fn nothing_hides_what_is_clear() {
    let mut scene = attic(lambertian(0.6, 0.0), 0.0, EstimateKind::Point);
    let object = |x: f64, y: f64, size: DVec3| BoxObject {
        size,
        base: DVec3::new(x, y, 0.0),
        rotation: 0.4 * x,
        surface: Surface::diffuse([0.5; 3]),
    };
    scene.room.boxes = vec![object(1.2, 1.9, DVec3::new(1.2, 0.2, 2.0)), object(2.3, 0.8, DVec3::new(0.4, 0.4, 1.4))];
    let scene = traceable(&scene);
    let tube = &scene.tubes[0];
    let mut random = PathRandom::new(Key::new(3));
    let [mut clear, mut hidden, mut in_part] = [0; 3];
    for _ in 0..4000 {
        let place = DVec3::new(3.0 * random.uniform(), 4.0 * random.uniform(), random.uniform());
        if scene.is_in_solid(place) {
            continue;
        }
        let is_clear = scene.leaves_clear(place, 0.05, None, &tube.frame, RADIUS);
        let is_hidden = scene.hides(&[place], &tube.frame, RADIUS);
        let seen: Vec<bool> =
            (0..20).map(|_| scene.visible(place, None, tube.point(random.uniform2()), None)).collect();
        assert!(!is_clear || seen.iter().all(|seen| *seen), "{place}");
        assert!(!is_hidden || !seen.iter().any(|seen| *seen), "{place}");
        clear += usize::from(is_clear);
        hidden += usize::from(is_hidden);
        in_part += usize::from(seen.contains(&true) && seen.contains(&false));
    }
    assert!(clear > 1000 && hidden > 100 && in_part > 50, "{clear} {hidden} {in_part}");
}

/// Sky and sun come through a clear pane below a leaning pipe that reflects, to cells of a grey room: photons that cross cells, and maps of
/// photons, find the same.
#[test]
fn methods_agree_on_a_clear_pane_in_the_sun() {
    let mut scene = attic(clear(), 0.5, EstimateKind::CellAverage);
    let outward = frame(&scene).outward();
    let shape = StraightOrBent {
        reflectance: [0.9; 3].into(),
        segments: vec![along(0.4, outward), along(0.5, DVec3::Z)],
        collector: Collector::Flat { transmittance: [0.9; 3] },
        cut: None,
    };
    scene.tubes[0].shape = TubeShape::Cylinders(shape);
    let sun = Sun { direction: direction(50f64.to_radians(), 170f64.to_radians()), normal_illuminance_lux: 20_000.0 };
    scene.daylight.as_mut().unwrap().sun = Some(sun);
    let found = methods(&scene, 9);
    assert!(found.len() >= 4);
    let [(_, truth), others @ ..] = &found[..] else { panic!("no methods") };
    let (truth, errors) = values(&run(&scene, &**truth, 48));
    for (name, method) in others {
        assert_grid(&run(&scene, &**method, 24), &truth, &errors, SIGMAS, 0.0, name);
    }
}

/// An opening in the wall of a box, whose pipe bends up outside: it faces the room, and methods with formulas for level openings refuse it by
/// name.
#[test]
fn openings_in_walls_are_computed_or_refused() {
    let shape = StraightOrBent {
        reflectance: [0.95; 3].into(),
        segments: vec![along(0.4, DVec3::X), along(0.8, DVec3::Z)],
        collector: Collector::Flat { transmittance: [0.9; 3] },
        cut: None,
    };
    let tube = Tube {
        face: Face::East as usize,
        centre: DVec2::new(SIDE, 1.1),
        plane: OpeningPlane::OfFace { height_m: 1.5 },
        shape: TubeShape::Cylinders(shape),
        ..straight(0.4, 0.9, lambertian(0.6, 0.3))
    };
    let mut scene = cube(0.3, 0.5, 0.7, vec![tube], daylight(1, 9000.0, 45.0, 0.0), EstimateKind::Point);
    scene.grids = vec![Grid::new("desk".into(), 0.5, [3, 3], 0.0, [SIDE, SIDE], EstimateKind::Point)];
    assert_eq!(frame(&scene).normal(), DVec3::NEG_X);
    let compiled = traceable(&scene);
    let task = Task::whole(&scene, &compiled);
    let jenkins = jenkins::Settings { bend_factor: Some(0.8), ..Default::default() };
    for refusal in [holigilm::Settings {}.refuses(&task), jenkins.refuses(&task)] {
        assert_eq!(refusal.map(|refusal| refusal.code), Some(RefusalCode::RoomShape));
    }
    let paths = path_tracing::Settings { samples_per_sensor: 128, samples_per_pixel: 1 };
    let (truth, errors) = values(&run(&scene, &*built(&scene, &paths, 2), 24));
    assert!(truth.iter().all(|lux| *lux > 0.0));
    let stages = ("two stages", built(&scene, &two_stages(), 2));
    for (name, method) in methods(&scene, 2).into_iter().chain([stages]) {
        assert_grid(&run(&scene, &*method, 24), &truth, &errors, SIGMAS, 0.0, name);
    }
}

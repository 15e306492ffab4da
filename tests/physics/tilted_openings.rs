//! Openings in the plane of a slope or a wall: a room that is turned as a whole, closed forms, and methods against each other.

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DMat3, DVec2, DVec3};
use skyduct::geometry::disc::far_disc_illuminance;
use skyduct::geometry::planar::Polygon;
use skyduct::geometry::{OpeningFrame, TriangleMesh};
use skyduct::guide::mesh::Part;
use skyduct::guide::recognise::RecognisedBend;
use skyduct::guide::{End, RecognisedCylinder, Section, Transit};
use skyduct::integrator::method::{Described, RefusalCode, Task};
use skyduct::integrator::{
    Integrator, bidirectional, holigilm, jenkins, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage,
};
use skyduct::optics::{Collector, Diffuser, DiffuserZone, Surface};
use skyduct::sampling::{Key, PathRandom};
use skyduct::scene::{
    BoxObject, Enclosure, EstimateKind, Face, Grid, MeshTube, OpeningPlane, Responses, Scene, Segment, Sensor,
    StraightOrBent, Transition, Tube, TubeShape,
};
use skyduct::sky::{Sun, direction};

use crate::scenes::{
    RADIUS, SIDE, assert_grid, bent, built, clear, cube, daylight, lambertian, mixed, peaked, run, straight, traceable,
    values,
};

/// Combined standard errors within which values agree: of some hundred comparisons by 24 passes, one in a hundred runs would be farther off.
const SIGMAS: f64 = 5.0;

/// Turn by 30 degrees about x, after which the ceiling of a box faces north and down.
fn turn() -> DMat3 {
    let (sin, cos) = (0.5, 0.75f64.sqrt());
    DMat3::from_cols(DVec3::X, DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos))
}

/// Returns a segment along an axis.
fn along(length_m: f64, axis: DVec3) -> Segment {
    Segment { length_m, tilt: axis.truncate().length().atan2(axis.z), azimuth: axis.x.atan2(axis.y) }
}

/// Turns a room in box form with its tubes and placed sensors.
fn turned(scene: &Scene) -> Scene {
    let mut turned = scene.clone();
    let mut faces = scene.room.enclosure.faces().to_vec();
    for face in &mut faces {
        let ring = |ring: &Vec<DVec3>| ring.iter().map(|corner| turn() * *corner).collect();
        let rings = face.polygon.rings().iter().map(ring).collect();
        face.polygon = Polygon::with_normal(rings, turn() * face.polygon.normal());
    }
    turned.room.enclosure = Enclosure::new(faces).unwrap();
    for (tube, level) in turned.tubes.iter_mut().zip(&scene.tubes) {
        let centre = turn() * level.frame(&scene.room.enclosure).origin;
        (tube.centre, tube.plane) = (centre.truncate(), OpeningPlane::OfFace { height_m: centre.z });
        // the frame of a turned opening is that of the level one, turned: a mesh stays as it is
        if let TubeShape::Cylinders(cylinders) = &mut tube.shape {
            cylinders.segments.iter_mut().for_each(|of| *of = along(of.length_m, turn() * of.axis()));
        }
    }
    for grid in &mut turned.grids {
        let placed = grid.placed.as_ref().unwrap().iter();
        let sensor = |of: &Sensor| Sensor { position: turn() * of.position, normal: turn() * of.normal };
        let sensors: Vec<Sensor> = placed.map(sensor).collect();
        *grid = Grid { responses: grid.responses, ..Grid::points(grid.name.clone(), sensors) };
    }
    turned
}

/// The cube below a sky and above a ground of one luminance, which look the same from all directions, with sensors that face up, sideways and
/// askew.
fn evenly_lit(tubes: Vec<Tube>) -> Scene {
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(5, 5000.0, 45.0, 0.0), EstimateKind::Point);
    let around = Arc::new(scene.daylight.as_ref().unwrap().surroundings(None, [1.0, 1.0], 0.0));
    scene.tubes.iter_mut().for_each(|tube| tube.surroundings = Some(around.clone()));
    let sensor = |x: f64, y: f64, z: f64, normal: DVec3| Sensor { position: DVec3::new(x, y, z), normal };
    let sensors = vec![
        sensor(0.4, 0.5, 0.3, DVec3::Z),
        sensor(1.1, 1.5, 0.8, DVec3::Z),
        sensor(1.7, 0.9, 1.1, DVec3::NEG_X),
        sensor(0.6, 1.6, 0.2, DVec3::new(0.3, -0.4, 0.8).normalize()),
    ];
    scene.grids = vec![Grid::points("sensors".into(), sensors)];
    scene
}

fn two_stages() -> two_stage::Settings {
    two_stage::Settings { photons_per_pass: Some(512), samples_per_sensor: Some(64), ..Default::default() }
}

/// A room that is turned as a whole has the light that it had, below every kind of closure and guide: by both methods that compute sensors of
/// any direction.
#[test]
fn a_turned_room_has_the_same_light() {
    let square = Some(Transition { side_m: 0.3, azimuth: 0.4, transmittance: 0.8 });
    let paths = path_tracing::Settings { samples_per_sensor: 192, samples_per_pixel: 1 };
    let tubes: [(&str, Tube, bool); 6] = [
        ("straight", straight(0.4, 0.9, lambertian(0.6, 0.2)), true),
        ("bent", bent(lambertian(0.5, 0.4)), true),
        ("square", Tube { transition: square, ..straight(0.4, 0.9, lambertian(0.6, 0.2)) }, true),
        ("clear", straight(0.4, 0.9, clear()), false),
        ("measured", bent(peaked()), false),
        ("mixed", straight(0.4, 0.9, mixed(DiffuserZone::Clear)), false),
    ];
    for (number, (name, tube, is_even)) in tubes.into_iter().enumerate() {
        let level = evenly_lit(vec![tube]);
        let turned = turned(&level);
        assert!(!traceable(&turned).tubes[0].frame.is_level());
        let seed = number as u64;
        let (truth, errors) = values(&run(&level, &*built(&level, &paths, seed), 24));
        let found = run(&turned, &*built(&turned, &paths, seed + 50), 24);
        assert_grid(&found, &truth, &errors, SIGMAS, 0.0, &format!("{name}, path tracing"));
        if is_even {
            let found = run(&turned, &*built(&turned, &two_stages(), seed), 24);
            assert_grid(&found, &truth, &errors, SIGMAS, 0.0, &format!("{name}, two stages"));
        }
    }
}

/// A tube that is a mesh, turned about its axis: a pipe of eight sides that leans, open above; or what was recognised in another one.
fn meshed(section: Section, diffuser: Diffuser) -> Tube {
    const SIDES: u32 = 8;
    let corner = |k: u32| (DVec2::from_angle(PI / 4.0 * f64::from(k)) * RADIUS).extend(0.0);
    let positions = (0..SIDES).map(corner).chain((0..SIDES).map(|k| corner(k) + DVec3::new(0.15, 0.25, 0.4)));
    let side = |k: u32| {
        let next = (k + 1) % SIDES;
        [[k, next, next + SIDES], [k, next + SIDES, k + SIDES]]
    };
    let triangles: Vec<[u32; 3]> = (0..SIDES).flat_map(side).collect();
    let mesh = TriangleMesh {
        positions: positions.collect(),
        triangle_materials: vec![0; triangles.len()],
        triangles,
        materials: vec!["pipe".to_owned()],
        ..TriangleMesh::default()
    };
    let parts = vec![Part::Pipe { reflectance: [0.9; 3].into() }];
    let shape = TubeShape::Mesh(MeshTube { mesh: Arc::new(mesh), parts, rotation: 0.7, section });
    Tube { shape, ..straight(0.4, 0.9, diffuser) }
}

/// Sections of meshes: facets, a cylinder, and a bend.
fn sections() -> [(&'static str, Section); 3] {
    let (radius, sides, deviation, collector_transmittance) = (RADIUS, 24, 0.0, [0.8; 3]);
    let reflectance = || [0.9; 3].into();
    let cylinder = RecognisedCylinder {
        radius,
        length: 0.4,
        sides,
        deviation,
        reflectance: reflectance(),
        collector_transmittance,
    };
    let segments = vec![(0.3, DVec3::Z), (0.4, direction(0.9, 0.5))];
    let bend =
        RecognisedBend { radius, segments, sides, deviation, reflectance: reflectance(), collector_transmittance };
    [
        ("facets", Section::Facets { sides: None, reason: "it leans" }),
        ("cylinder", Section::Cylinder(cylinder)),
        ("bend", Section::Bend(bend)),
    ]
}

/// In a turned room rays take the turned way through a tube that is a mesh, up and down, and the room has the same light: below a clear pane,
/// whose light shows where the pipe leans.
#[test]
fn meshes_turn_with_the_room() {
    for (name, section) in sections() {
        let level = evenly_lit(vec![meshed(section, clear())]);
        let turned = turned(&level);
        let tubes = [&level, &turned].map(|scene| traceable(scene).tubes[0].clone());
        let mut random = PathRandom::new(Key::new(7));
        let mut downward = 0;
        for _ in 0..400 {
            let from = tubes[0].point(random.uniform2());
            let up = direction(random.uniform() * 0.5 * PI, random.uniform() * 2.0 * PI);
            let ways = [(&tubes[0], from, up), (&tubes[1], turn() * from, turn() * up)].map(|(tube, from, up)| {
                let seen: Transit<1> = tube.up(from, up, &mut PathRandom::new(Key::new(1)));
                // light that leaves goes back down the way that it came
                let back = (seen.end == End::Top)
                    .then(|| tube.down::<1>(seen.position, -seen.direction, &mut PathRandom::new(Key::new(1))));
                [Some(seen), back]
            });
            let [level, turned] = ways;
            assert_eq!(level[1].is_some(), turned[1].is_some(), "{name}");
            downward += usize::from(level[1].is_some_and(|back| back.end == End::Opening));
            for (level, turned) in level.into_iter().flatten().zip(turned.into_iter().flatten()) {
                assert_eq!(level.end, turned.end, "{name}");
                let apart = (turn() * level.position).distance(turned.position);
                assert!(apart < 1e-9, "{name}: {apart} m");
                assert!((turn() * level.direction).distance(turned.direction) < 1e-9, "{name}");
                assert!((level.weight().max() - turned.weight().max()).abs() < 1e-12, "{name}");
            }
        }
        assert!(downward > 100, "{name}: {downward}");
        let paths = path_tracing::Settings { samples_per_sensor: 192, samples_per_pixel: 1 };
        let (truth, errors) = values(&run(&level, &*built(&level, &paths, 3), 24));
        let found = run(&turned, &*built(&turned, &paths, 53), 24);
        assert_grid(&found, &truth, &errors, SIGMAS, 0.0, name);
    }
}

/// Responses to the tubes of a turned room are those of the level one, each part of its own: the axes of an opening turn with it.
#[test]
fn responses_turn_with_the_room() {
    let mut level = evenly_lit(vec![straight(0.4, 0.9, lambertian(0.6, 0.2))]);
    level.grids[0].responses = Responses::ToTubes;
    let rooms = [level.clone(), turned(&level)];
    let found = rooms.map(|scene| {
        let method = built(&scene, &two_stages(), 4);
        let mut estimate = skyduct::estimate::Estimate::empty(&scene);
        estimate.begin(Some(&method.start()), None);
        (0..24).for_each(|pass| estimate.push(method.pass(pass, &AtomicBool::new(false)).as_ref(), None));
        estimate.grids.swap_remove(0)
    });
    let [level, turned] = found;
    assert_eq!(level.companions.len(), 4);
    for (column, (level, turned)) in level.companions.iter().zip(&turned.companions).enumerate() {
        for sensor in 0..4 {
            let [a, b] = [level, turned].map(|of| (of.illuminance_lux(sensor), of.standard_error_lux(sensor)));
            let error = a.1.hypot(b.1) + 1e-9 * a.0.abs();
            assert!((a.0 - b.0).abs() < SIGMAS * error, "{column} {sensor}: {a:?} {b:?}");
        }
    }
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
        0.6 * PI * luminance * far_disc_illuminance(RADIUS, depth, across.length(), components)
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

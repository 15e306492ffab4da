//! Rooms that are turned as a whole, so that their openings lean: they have the light that they had.

use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::{DMat3, DVec2, DVec3};
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::planar::Polygon;
use skyduct::guide::mesh::Part;
use skyduct::guide::recognise::RecognisedBend;
use skyduct::guide::{End, RecognisedCylinder, Section, Transit};
use skyduct::integrator::path_tracing;
use skyduct::optics::{Diffuser, DiffuserZone};
use skyduct::sampling::{Key, PathRandom};
use skyduct::scene::{
    Enclosure, EstimateKind, Grid, MeshTube, OpeningPlane, Responses, Scene, Sensor, Transition, Tube, TubeShape,
};
use skyduct::sky::direction;

use crate::scenes::{
    RADIUS, assert_grid, bent, built, clear, cube, daylight, lambertian, mixed, peaked, run, straight, traceable,
    values,
};
use crate::tilted_openings::{SIGMAS, along, two_stages};

/// Turn by 30 degrees about x, after which the ceiling of a box faces north and down.
fn turn() -> DMat3 {
    let (sin, cos) = (0.5, 0.75f64.sqrt());
    DMat3::from_cols(DVec3::X, DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos))
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
    assert_eq!(level.companions.len(), 3);
    for (column, (level, turned)) in level.companions.iter().zip(&turned.companions).enumerate() {
        for sensor in 0..4 {
            let [a, b] = [level, turned].map(|of| (of.illuminance_lux(sensor), of.standard_error_lux(sensor)));
            let error = a.1.hypot(b.1) + 1e-9 * a.0.abs();
            assert!((a.0 - b.0).abs() < SIGMAS * error, "{column} {sensor}: {a:?} {b:?}");
        }
    }
}

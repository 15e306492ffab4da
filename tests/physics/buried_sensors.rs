//! Sensors inside boxes: no light comes there, whatever else stands in the room, by any method.

use std::ops::Range;

use glam::{DVec2, DVec3};
use skyduct::integrator::method::{Computation, Task};
use skyduct::integrator::{Method, bidirectional, light_tracing, path_tracing, photon_mapping, ppm, sppm, two_stage};
use skyduct::optics::{Diffuser, DiffuserZone, Surface};
use skyduct::scene::EstimateKind::Point;
use skyduct::scene::{BoxObject, Face, Grid, Scene, Tube};

use crate::mesh_objects::closed_cube;
use crate::scenes::{SIDE, cube, daylight, lambertian, mixed, panel, run, specular, straight, traceable, with_sun};

fn methods() -> Vec<Method> {
    vec![
        Method::LightTracing(light_tracing::Settings::default()),
        Method::PathTracing(path_tracing::Settings::default()),
        Method::Bidirectional(bidirectional::Settings::default()),
        Method::TwoStage(two_stage::Settings::default()),
        Method::PhotonMapping(photon_mapping::Settings::default()),
        Method::Ppm(ppm::Settings::default()),
        Method::Sppm(sppm::Settings::default()),
    ]
}

/// Two boxes that lie in each other, one of them turned, below two tubes; of 36 points some are in them.
fn room(second: Diffuser) -> Scene {
    let tube = |x: f64, diffuser: Diffuser| Tube { centre: DVec2::new(x, 1.0), ..straight(0.6, 0.95, diffuser) };
    let tubes = vec![tube(0.5, lambertian(0.6, 0.2)), tube(1.5, second)];
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(12, 5000.0, 40.0, 120.0), Point);
    let object = |base: [f64; 2], size: [f64; 3], rotation: f64| BoxObject {
        size: size.into(),
        base: DVec3::new(base[0], base[1], 0.0),
        rotation,
        surface: Surface::diffuse([0.6; 3]),
    };
    scene.room.boxes = vec![object([0.7, 0.8], [0.7, 0.9, 0.8], 0.0), object([1.0, 1.2], [0.8, 0.5, 1.1], 0.6)];
    scene.grids = vec![Grid::new("grid".into(), 0.5, [6, 6], 0.2, [SIDE, SIDE], Point)];
    scene
}

fn check(name: &str, scene: &Scene, expected: Range<usize>) {
    let compiled = traceable(scene);
    let task = Task::whole(scene, &compiled);
    let buried: Vec<bool> =
        (0..scene.grids[0].len()).map(|sensor| compiled.is_in_solid(scene.grids[0].centre(sensor))).collect();
    let count = buried.iter().filter(|buried| **buried).count();
    assert!(expected.contains(&count), "{name}: {count}");
    let mut computed = 0;
    for method in methods() {
        let described = method.described();
        if described.refuses(&task).is_some() {
            continue;
        }
        let Computation::Passes(passes) = described.build(&task, 5, 0.1) else { continue };
        let found = run(scene, &*passes, 2);
        for (sensor, buried) in buried.iter().enumerate() {
            let lux = found.grids[0].illuminance_lux(sensor);
            assert_eq!(lux == 0.0, *buried, "{name}, {}: {lux} at {sensor}", method.name());
        }
        computed += 1;
    }
    assert!(computed >= 4, "{name}: {computed}");
}

/// Below Lambertian closures, and below partly Lambertian ones; with a mesh around and beside the boxes, a luminaire, a glossy wall and the
/// sun.
#[test]
fn sensors_in_boxes_stay_dark() {
    check("Lambertian", &room(lambertian(0.5, 0.1)), 6..30);
    check("partly Lambertian", &room(mixed(DiffuserZone::Lambertian)), 6..30);
    let mut meshed = room(lambertian(0.5, 0.1));
    meshed.room.meshes.push(closed_cube(DVec3::new(0.5, 0.5, 0.3), 0.5));
    meshed.room.meshes.push(closed_cube(DVec3::new(1.6, 0.3, 0.2), 0.1));
    // between the sensors that the mesh alone holds, which are dark as well
    let grid = &mut meshed.grids[0];
    (grid.x_m, grid.y_m, grid.cells) = (vec![0.7, 1.3, 1.8], vec![0.7, 1.2, 1.8], [3, 3]);
    check("meshes around boxes and beside", &meshed, 3..6);
    let mut lit = room(lambertian(0.5, 0.1));
    lit.room.luminaires.push(panel(DVec3::new(1.0, 0.4, 1.9), 0.3, 0.3, 500.0));
    lit.room.enclosure.paint(Face::East as usize, Some(specular(0.2, 0.5, 0.4)));
    with_sun(&mut lit, 40_000.0, 50.0);
    check("a luminaire, a glossy wall and the sun", &lit, 6..30);
}

/// A grid all of which is in a box.
#[test]
fn a_grid_in_a_box_is_dark() {
    let mut scene = room(lambertian(0.5, 0.1));
    (scene.grids[0].x_m, scene.grids[0].y_m, scene.grids[0].cells) = (vec![0.5, 0.7, 0.9], vec![0.6, 0.8], [3, 2]);
    check("all in a box", &scene, 6..7);
}

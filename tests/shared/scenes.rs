//! Scenes and runs that several tests share.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use crate::reference::{self, number};
use glam::{DVec2, DVec3};
use skyduct::estimate::Estimate;
use skyduct::integrator::method::{Computation, Described, Task};
use skyduct::integrator::{Integrator, light_tracing, sppm};
use skyduct::optics::{Collector, Diffuser, DiffuserZone, MeasuredDiffuser, Specular, Surface};
use skyduct::plan::{self, EffectRequests, Effects};
use skyduct::scene::{
    BoxObject, BoxShape, Channels, Daylight, Enclosure, EstimateKind, Face, Grid, Luminaire, OpeningPlane, Room, Scene,
    Segment, StraightOrBent, Tube, TubeShape,
};
use skyduct::sky::zenith::ZenithFormula;
use skyduct::sky::{CieType, Sky, SkyDistribution, Sun, direction};
use skyduct::traceable::TraceableScene;

pub const SIDE: f64 = 2.032;
pub const RADIUS: f64 = 0.127;

/// A CIE sky of given zenith luminance, the sun (without a beam) at an altitude and azimuth in degrees.
pub fn daylight(cie_type: u8, zenith_luminance_cd_m2: f64, altitude_deg: f64, azimuth_deg: f64) -> Daylight {
    let sun = direction(altitude_deg.to_radians(), azimuth_deg.to_radians());
    let distribution = SkyDistribution::new(CieType::new(cie_type).unwrap(), sun);
    let sky = Some(Sky::new(distribution, zenith_luminance_cd_m2));
    Daylight { sky, sun: None, formula: ZenithFormula::GivenZenithLuminance }
}

/// A vertical straight tube.
pub fn straight(length_m: f64, reflectance: f64, diffuser: Diffuser) -> Tube {
    let segments = vec![Segment { length_m, tilt: 0.0, azimuth: 0.0 }];
    Tube {
        centre: DVec2::splat(0.5 * SIDE),
        opening_radius: RADIUS,
        transition: None,
        face: Face::Ceiling as usize,
        plane: OpeningPlane::Level { drop_m: 0.0 },
        shape: TubeShape::Cylinders(StraightOrBent {
            reflectance: [reflectance; 3].into(),
            segments,
            collector: Collector::Open,
            cut: None,
        }),
        diffuser,
        surroundings: None,
    }
}

pub fn lambertian(transmittance: f64, reflectance: f64) -> Diffuser {
    Diffuser::Lambertian { transmittance: [transmittance; 3], reflectance: [reflectance; 3] }
}

/// The 2.032 m cube with a 9 x 9 grid on the floor.
pub fn cube(
    floor: f64,
    walls: f64,
    ceiling: f64,
    tubes: Vec<Tube>,
    daylight: Daylight,
    estimate: EstimateKind,
) -> Scene {
    let surface = |reflectance| Some(Surface::diffuse([reflectance; 3]));
    let surfaces = [surface(walls), surface(walls), surface(walls), surface(walls), surface(floor), surface(ceiling)];
    Scene {
        daylight: Some(daylight),
        moments: None,
        room: Room {
            enclosure: Enclosure::cuboid(DVec3::splat(SIDE), surfaces),
            boxes: Vec::new(),
            meshes: Vec::new(),
            luminaires: Vec::new(),
        },
        tubes,
        grids: vec![Grid::new("floor".into(), 0.0, [9, 9], 0.0, [SIDE, SIDE], estimate)],
        views: Vec::new(),
        channels: Channels::Photopic,
    }
}

/// The cube under a uniform Lambertian disc of 1000 lm: a uniform sky over an aperture of no length.
pub fn disc_room(floor: f64, walls: f64, ceiling: f64, disc: f64, estimate: EstimateKind) -> Scene {
    let transmittance = 0.1;
    let horizontal_lux = 1000.0 / (transmittance * PI * RADIUS * RADIUS);
    let tube = straight(1e-9, 1.0, lambertian(transmittance, disc));
    cube(floor, walls, ceiling, vec![tube], daylight(5, horizontal_lux / PI, 35.0, 0.0), estimate)
}

/// Illuminances of the floor of such a room by radiosity with exact form factors (`reference/room_radiosity.csv`), and the
/// largest relative error of each (`reference/README.md`).
pub fn radiosity(case: &str, estimate: EstimateKind) -> (Vec<f64>, f64) {
    let (column, error) = match (estimate, case) {
        (EstimateKind::CellAverage, _) => (7, 4e-5),
        (EstimateKind::Point, "S3r") => (6, 2.5e-6),
        (EstimateKind::Point, _) => (6, 4.4e-7),
    };
    let mut truth = vec![f64::NAN; 81];
    for row in reference::rows("room_radiosity.csv").iter().filter(|row| row[0].starts_with(case)) {
        truth[number(&row[2]) as usize * 9 + number(&row[1]) as usize] = number(&row[column]);
    }
    (truth, error)
}

pub fn traceable(scene: &Scene) -> Arc<TraceableScene> {
    Arc::new(plan::compile(scene, &Effects::of(scene, &EffectRequests::new())).unwrap())
}

/// A method of these settings on all of a scene, as jobs have it: of the photopic or the colour channel, with the optimisation that
/// the crate of physics is built with, which a method of a test's own does not get.
pub fn built(scene: &Scene, settings: &impl Described, seed: u64) -> Box<dyn Integrator> {
    built_to(scene, settings, seed, 0.02)
}

/// Builds a method as [`built`] does, for a relative standard error `target`.
pub fn built_to(scene: &Scene, settings: &impl Described, seed: u64, target: f64) -> Box<dyn Integrator> {
    let traceable = traceable(scene);
    match settings.build(&Task::whole(scene, &traceable), seed, target) {
        Computation::Passes(integrator) => integrator,
        Computation::Solution(_) => panic!("no method of passes"),
    }
}

pub fn light_tracing(scene: &Scene, photons_per_pass: u64, seed: u64) -> Box<dyn Integrator> {
    built(scene, &light_tracing::Settings { photons_per_pass: Some(photons_per_pass) }, seed)
}

pub fn sppm(scene: &Scene, settings: &sppm::Settings, seed: u64) -> Box<dyn Integrator> {
    built(scene, settings, seed)
}

/// Adds up passes 0..`passes` of one method.
pub fn run(scene: &Scene, method: &dyn Integrator, passes: u64) -> Estimate {
    let mut estimate = Estimate::empty(scene);
    let start = method.start();
    estimate.begin(Some(&start), Some(&start));
    for pass in 0..passes {
        let pass = method.pass_after(pass, &estimate.carried, &AtomicBool::new(false)).unwrap();
        estimate.push(Some(&pass), Some(&pass));
    }
    assert_eq!(estimate.first_not_finite(), None);
    estimate
}

/// Fails unless every sensor agrees with its reference within `sigmas` combined standard errors plus `systematic` times
/// the reference; prints the worst.
#[track_caller]
pub fn assert_grid(estimate: &Estimate, truth: &[f64], truth_error: &[f64], sigmas: f64, systematic: f64, what: &str) {
    let grid = &estimate.grids[0];
    assert_eq!(grid.sensors.len(), truth.len());
    let z = |sensor: usize| {
        let error = grid.standard_error_lux(sensor).hypot(truth_error[sensor]);
        let excess = ((grid.illuminance_lux(sensor) - truth[sensor]).abs() - systematic * truth[sensor]).max(0.0);
        // where no light is, nothing is random
        if excess == 0.0 { 0.0 } else { excess / error }
    };
    let worst = (0..truth.len()).max_by(|a, b| z(*a).total_cmp(&z(*b))).unwrap();
    let rms = ((0..truth.len()).map(|s| z(s).powi(2)).sum::<f64>() / truth.len() as f64).sqrt();
    println!("{what}: worst z {:.2} at sensor {worst}, rms z {rms:.2}", z(worst));
    assert!(
        z(worst) < sigmas,
        "{what}: sensor {worst}: {} +- {} is not {} +- {}",
        grid.illuminance_lux(worst),
        grid.standard_error_lux(worst),
        truth[worst],
        truth_error[worst]
    );
}

pub fn values(estimate: &Estimate) -> (Vec<f64>, Vec<f64>) {
    let grid = &estimate.grids[0];
    (0..grid.sensors.len()).map(|sensor| (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor))).unzip()
}

pub fn bent(diffuser: Diffuser) -> Tube {
    let segment = |tilt: f64| Segment { length_m: 0.4, tilt, azimuth: 1.0 };
    Tube {
        shape: TubeShape::Cylinders(StraightOrBent {
            reflectance: [0.9; 3].into(),
            segments: vec![segment(0.0), segment(0.8), segment(0.0)],
            collector: Collector::Dome { transmittance: [0.9; 3] },
            cut: None,
        }),
        ..straight(1.0, 0.9, diffuser)
    }
}

/// A straight tube under a dome that refracts: some light from below comes back.
pub fn domed(diffuser: Diffuser) -> Tube {
    let collector = Collector::DielectricDome { refractive_index: 1.49, thickness_m: 0.003, absorption_per_m: 0.0 };
    let segments = vec![Segment { length_m: 0.6, tilt: 0.0, azimuth: 0.0 }];
    let shape = StraightOrBent { reflectance: [0.95; 3].into(), segments, collector, cut: None };
    Tube { shape: TubeShape::Cylinders(shape), ..straight(1.0, 0.9, diffuser) }
}

pub fn clear() -> Diffuser {
    Diffuser::Clear { transmittance: [0.8; 3] }
}

/// A closure with a clear and a Lambertian zone.
pub fn mixed(inner: DiffuserZone) -> Diffuser {
    Diffuser::Mixed {
        lambertian_radius_m: 0.6 * RADIUS,
        inner,
        lambertian_transmittance: [0.5; 3],
        lambertian_reflectance: [0.3; 3],
        clear_transmittance: [0.8; 3],
    }
}

/// A mirror (`roughness` 0) or glossy surface over a diffuse one.
pub fn specular(diffuse: f64, specular: f64, roughness: f64) -> Surface {
    let specular = Specular { reflectance: [specular; 3], roughness };
    Surface { reflectance: [diffuse; 3], specular: Some(specular) }
}

pub fn peaked() -> Diffuser {
    let angles = [0.0, 0.4, 0.9, FRAC_PI_2];
    let btdf = [vec![0.9, 0.3, 0.1, 0.0], vec![0.6, 0.4, 0.1, 0.0], vec![0.2, 0.2, 0.2, 0.1], vec![0.05; 4]];
    let brdf = vec![vec![0.06; 4]; 4];
    Diffuser::Measured(Arc::new(MeasuredDiffuser::new(&angles, &angles, &btdf, Some(&brdf)).unwrap()))
}

pub fn with_sun(scene: &mut Scene, lux: f64, altitude_deg: f64) {
    let sun = Sun { direction: direction(altitude_deg.to_radians(), 2.0), normal_illuminance_lux: lux };
    scene.daylight.as_mut().unwrap().sun = Some(sun);
}

/// Sky and sun through two tubes whose closures scatter, a box, a glossy wall, a luminaire that hangs in the room: cell
/// averages on a plane that cuts the box.
pub fn furnished(tubes: [Tube; 2], estimate: EstimateKind) -> Scene {
    let [a, b] = tubes;
    let tubes = vec![Tube { centre: DVec2::new(0.6, 0.7), ..a }, Tube { centre: DVec2::new(1.5, 1.3), ..b }];
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(12, 5000.0, 40.0, 120.0), estimate);
    let glossy = Specular { reflectance: [0.5; 3], roughness: 0.4 };
    scene.room.enclosure.paint(Face::East as usize, Some(Surface { reflectance: [0.2; 3], specular: Some(glossy) }));
    scene.room.boxes.push(BoxObject {
        size: DVec3::new(0.4, 0.5, 0.9),
        base: DVec3::new(1.2, 0.6, 0.0),
        rotation: 0.3,
        surface: Surface::diffuse([0.6; 3]),
    });
    scene.room.luminaires.push(Luminaire {
        corner: DVec3::new(0.3, 1.4, 1.6),
        edge_u: DVec3::new(0.0, 0.3, 0.0),
        edge_v: DVec3::new(0.2, 0.0, 0.05),
        luminance: [2000.0; 3],
    });
    scene.grids = vec![Grid::new("grid".into(), 0.5, [4, 4], 0.1, [SIDE, SIDE], estimate)];
    scene
}

/// A room without a window, of one reflectance, with luminaires and a grid on the floor.
pub fn electric_room(
    size: DVec3,
    reflectance: f64,
    luminaires: Vec<Luminaire>,
    cells: [usize; 2],
    estimate: EstimateKind,
) -> Scene {
    let surfaces = [Some(Surface::diffuse([reflectance; 3])); 6];
    Scene {
        daylight: None,
        moments: None,
        room: Room { enclosure: Enclosure::cuboid(size, surfaces), boxes: Vec::new(), meshes: Vec::new(), luminaires },
        tubes: Vec::new(),
        grids: vec![Grid::new("floor".into(), 0.0, cells, 0.0, [size.x, size.y], estimate)],
        views: Vec::new(),
        channels: Channels::Photopic,
    }
}

/// Gives a room in box form another size.
pub fn resize(scene: &mut Scene, size: DVec3) {
    if let Some(BoxShape { surfaces, .. }) = scene.room.enclosure.as_box() {
        scene.room.enclosure = Enclosure::cuboid(size, surfaces);
    }
}

/// A horizontal panel that emits `flux` lm downward.
pub fn panel(centre: DVec3, width: f64, depth: f64, flux: f64) -> Luminaire {
    Luminaire {
        corner: centre - DVec3::new(0.5 * width, 0.5 * depth, 0.0),
        edge_u: DVec3::Y * depth,
        edge_v: DVec3::X * width,
        luminance: [flux / (PI * width * depth); 3],
    }
}

/// Half of a symmetric room.
const HALF: DVec3 = DVec3::new(2.0, 2.4, 2.2);

/// A room with a mirror in the east that loses nothing that is seen, or the room of twice the length with the image of its
/// tube; one 4 x 4 grid over the western half.
pub fn mirrored(diffuser: Diffuser, image: bool, estimate: EstimateKind) -> Scene {
    let tube = |x: f64| Tube { centre: DVec2::new(x, 0.9), ..straight(0.5, 0.95, diffuser.clone()) };
    let mut tubes = vec![tube(1.2)];
    if image {
        tubes.push(tube(2.0 * HALF.x - 1.2));
    }
    // an overcast sky looks the same from both sides
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(1, 9000.0, 40.0, 0.0), estimate);
    resize(&mut scene, if image { DVec3::new(2.0 * HALF.x, HALF.y, HALF.z) } else { HALF });
    if !image {
        scene.room.enclosure.paint(Face::East as usize, Some(specular(0.0, 1.0 - 1e-7, 0.0)));
    }
    scene.grids = vec![Grid::new("grid".into(), 0.5, [4, 4], 0.0, [HALF.x, HALF.y], estimate)];
    scene
}

/// A mirrored room with a panel in the ceiling (and its image) in place of tubes.
pub fn mirrored_panel(image: bool, estimate: EstimateKind) -> Scene {
    let mut scene = mirrored(lambertian(0.6, 0.3), image, estimate);
    (scene.tubes, scene.daylight) = (Vec::new(), None);
    let panel = |x: f64| Luminaire {
        corner: DVec3::new(x - 0.2, 0.8, HALF.z),
        edge_u: DVec3::Y * 0.6,
        edge_v: DVec3::X * 0.4,
        luminance: [3000.0; 3],
    };
    scene.room.luminaires.push(panel(1.2));
    if image {
        scene.room.luminaires.push(panel(2.0 * HALF.x - 1.2));
    }
    scene
}

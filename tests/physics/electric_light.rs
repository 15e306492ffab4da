//! Luminaires against closed forms, published numbers and each other's method.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use crate::scenes::{
    assert_grid, cube, daylight, electric_room, lambertian, light_tracing, panel, run, sppm, straight, traceable,
};
use glam::{DVec2, DVec3};
use skyduct::estimate::Estimate;
use skyduct::geometry::lambert::quadrilateral_irradiance;
use skyduct::integrator::Integrator;
use skyduct::integrator::photon::emission::Emission;
use skyduct::integrator::photon::energy_balance::PhotonTotals;
use skyduct::integrator::photon::events::{Flight, Origin, Scattering, Visitor};
use skyduct::integrator::photon::path::trace;
use skyduct::integrator::sppm::Settings;
use skyduct::integrator::two_stage;
use skyduct::optics::Spectrum;
use skyduct::sampling::{Key, PathSamples};
use skyduct::scene::{EstimateKind, Grid, Luminaire, Scene};
use skyduct::traceable::{Place, SurfaceId, TraceableScene};

fn values(estimate: &Estimate) -> Vec<f64> {
    (0..estimate.grids[0].sensors.len()).map(|sensor| estimate.grids[0].illuminance_lux(sensor)).collect()
}

/// What goes up a tube from the room and comes back is no flux of the tube: under a panel that sends a hundred times more into the
/// pipe than the sky does, light tracing finds the flux of two stages, which follow daylight alone there.
#[test]
fn light_of_the_room_is_no_flux_of_a_tube() {
    let tube = straight(0.3, 0.95, lambertian(0.6, 0.2));
    let mut scene = cube(0.5, 0.5, 0.5, vec![tube], daylight(12, 100.0, 40.0, 120.0), EstimateKind::Point);
    let up = Luminaire {
        corner: DVec3::new(0.9, 0.9, 1.0),
        edge_u: DVec3::X * 0.2,
        edge_v: DVec3::Y * 0.2,
        luminance: [1e5; 3],
    };
    scene.room.luminaires = vec![up];
    let traced = run(&scene, &*light_tracing(&scene, 16_384, 1), 32);
    scene.room.luminaires.clear();
    let settings = two_stage::Settings { photons_per_pass: Some(16_384), ..Default::default() };
    let stages = run(&scene, &*crate::scenes::built(&scene, &settings, 2), 32);
    let [traced, stages] = [traced, stages].map(|estimate| estimate.tubes[0].into_room);
    let error = DVec2::new(traced.standard_error(), stages.standard_error()).length();
    assert!((traced.mean - stages.mean).abs() < 4.0 * error, "{traced:?} {stages:?}");
    assert!(error < 0.01 * stages.mean);
}

/// A panel of 1 m x 1 m and 10 000 lm in the ceiling of a black room of 4 m x 4 m x 3 m, the geometry of case 5.3 of
/// CIE 171:2006 (docs/physics/rooms.md#lambertian-rectangles-and-polygons).
#[test]
fn published_area_source() {
    let published = [341.07, 324.08, 279.89, 223.62, 169.11];
    // 9 cells of half a metre around the middle: the sensors are 0.5 m apart
    let scene = |z: f64| {
        let mut scene = electric_room(
            DVec3::new(4.0, 4.0, 3.0),
            0.0,
            vec![panel(DVec3::new(2.0, 2.0, z), 1.0, 1.0, 1e4)],
            [1, 1],
            EstimateKind::Point,
        );
        let mut grid = Grid::new("floor".into(), 0.0, [5, 1], 0.0, [4.0, 4.0], EstimateKind::Point);
        grid.x_m = (0..5).map(|k| 2.0 + 0.5 * f64::from(k)).collect();
        // the last sensor lies on the wall's plane
        grid.y_m = vec![2.0];
        scene.grids = vec![grid];
        scene
    };
    let ceiling = scene(3.0);
    for method in [&*light_tracing(&ceiling, 1024, 1) as &dyn Integrator, &*sppm(&ceiling, &Settings::default(), 1)] {
        let found = values(&run(&ceiling, method, 2));
        for (found, published) in found.iter().zip(published) {
            assert!((found - published).abs() < 0.006, "{found} {published}");
        }
    }
    // in the plane of the ceiling or a millionth of a metre below: the same
    let below = scene(3.0 - 1e-6);
    let found = values(&run(&below, &*light_tracing(&below, 1024, 1), 2));
    let exact = values(&run(&ceiling, &*light_tracing(&ceiling, 1024, 1), 2));
    found.iter().zip(&exact).for_each(|(a, b)| assert!((a / b - 1.0).abs() < 1e-5));
}

/// Adds up what arrives at surfaces.
struct Arrivals(f64);

impl Visitor<1> for Arrivals {
    fn scattered(&mut self, _: &Scattering<1>, _: &mut PathSamples) {}
    fn emitted(&mut self, _: &Scattering<1>, _: &mut PathSamples) {}
    fn flew(&mut self, _: &Flight<1>) {}
    fn arrived(&mut self, _: SurfaceId, _: DVec3, flux: Spectrum<1>, _: Origin) {
        self.0 += flux.luminance();
    }
}

fn mean_illuminance(kernel: &TraceableScene, area: f64, passes: u64, photons: u64) -> (f64, f64) {
    let emission = Emission::new(kernel, photons);
    let means: Vec<f64> = (0..passes)
        .map(|pass| {
            let (mut arrivals, mut totals) = (Arrivals(0.0), PhotonTotals::new(0));
            for number in 0..photons {
                let (photon, mut samples) = emission.photon(kernel, Key::new(11).child(pass), number);
                trace::<1>(kernel, &photon.unwrap(), &mut samples, &mut arrivals, &mut totals);
            }
            assert!(totals.energy.relative_closure_error().abs() < 1e-9);
            assert!((totals.energy.luminaires - 1e4).abs() < 1e-6);
            arrivals.0 / area
        })
        .collect();
    let n = passes as f64;
    let mean = means.iter().sum::<f64>() / n;
    (mean, (means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / (n * (n - 1.0))).sqrt())
}

/// In a closed convex room of one reflectance rho (docs/physics/rooms.md#diffuse-interreflection; the geometry of case 5.8
/// of CIE 171:2006), the mean illuminance of all surfaces is
/// flux / (area (1 - rho)), whatever the light's distribution. The source of 1 mm x 1 mm absorbs less than 1e-6 of it.
#[test]
fn white_furnace() {
    let side = 4.0;
    for rho in [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 0.95] {
        let source = panel(DVec3::new(1.0, 1.7, side), 1e-3, 1e-3, 1e4);
        let scene = electric_room(DVec3::splat(side), rho, vec![source], [1, 1], EstimateKind::Point);
        let area = 6.0 * side * side;
        let (mean, error) = mean_illuminance(&traceable(&scene), area, 16, 4096);
        let exact = 1e4 / (area * (1.0 - rho));
        assert!((mean - exact).abs() < 4.0 * error + 1e-6 * exact, "rho {rho}: {mean} +- {error}, {exact}");
        assert!(error < 0.01 * exact);
    }
}

/// A black sheet of 2 m2 in the ceiling takes its share: arrivals at it are absorbed, and the energy balance closes.
#[test]
fn luminaires_absorb() {
    let rho: f64 = 0.5;
    let lit = panel(DVec3::new(1.0, 1.0, 4.0), 1.0, 1.0, 1e4);
    let dark = Luminaire { luminance: [0.0; 3], ..panel(DVec3::new(3.0, 2.0, 4.0), 1.0, 2.0, 1.0) };
    let scene = electric_room(DVec3::splat(4.0), rho, vec![lit, dark], [4, 4], EstimateKind::Point);
    let with_sheet = run(&scene, &*light_tracing(&scene, 8192, 5), 16);
    let empty = electric_room(DVec3::splat(4.0), rho, vec![lit], [4, 4], EstimateKind::Point);
    let without = run(&empty, &*light_tracing(&empty, 8192, 5), 16);
    assert!(with_sheet.energy.relative_closure_error().abs() < 1e-9);
    assert_eq!(with_sheet.energy.emitted, 0.0);
    assert!((with_sheet.energy.luminaires / 16.0 - 1e4).abs() < 1e-6);
    // about 3 % less: far outside the errors
    let loss = 1.0 - with_sheet.grids[0].mean.mean / without.grids[0].mean.mean;
    assert!(loss > 0.01 && loss < 0.1, "{loss}");
    assert!(with_sheet.grids[0].mean.standard_error() < 0.002 * with_sheet.grids[0].mean.mean);
}

/// The closed form and the connection of emission vertices are two estimators of one number: a dark sheet far from every
/// line between panel and sensors makes the room obstructed, and changes nothing else in a black room.
#[test]
fn closed_form_equals_connections() {
    let lit = panel(DVec3::new(1.5, 1.0, 2.0), 0.5, 0.4, 1000.0);
    let dark = Luminaire { luminance: [0.0; 3], ..panel(DVec3::new(1.5, 1.5, 2.9), 0.1, 0.1, 1.0) };
    for estimate in [EstimateKind::Point, EstimateKind::CellAverage] {
        let free = electric_room(DVec3::new(4.0, 3.0, 3.0), 0.0, vec![lit], [5, 4], estimate);
        let obstructed = electric_room(DVec3::new(4.0, 3.0, 3.0), 0.0, vec![lit, dark], [5, 4], estimate);
        assert!(!traceable(&free).luminaires_obstructed && traceable(&obstructed).luminaires_obstructed);
        let exact = run(&free, &*light_tracing(&free, 1024, 1), 64);
        let errors: Vec<f64> = (0..20).map(|sensor| exact.grids[0].standard_error_lux(sensor)).collect();
        if estimate == EstimateKind::Point {
            let corners = [(1.25, 0.8), (1.75, 0.8), (1.75, 1.2), (1.25, 1.2)].map(|(x, y)| DVec3::new(x, y, 2.0));
            for (sensor, lux) in values(&exact).into_iter().enumerate() {
                let point = DVec3::new(exact_x(sensor), 0.375 + 0.75 * (sensor / 5) as f64, 0.0);
                let expected = 1000.0 / (PI * 0.2) * quadrilateral_irradiance(&corners, point, DVec3::Z);
                assert!((lux / expected - 1.0).abs() < 1e-12);
            }
        }
        let connected = run(&obstructed, &*light_tracing(&obstructed, 8192, 2), 64);
        assert_grid(&connected, &values(&exact), &errors, 4.5, 0.0, "connections");
        let gathered = run(&obstructed, &*sppm(&obstructed, &Settings::default(), 3), 16);
        assert_grid(&gathered, &values(&exact), &errors, 4.5, 0.0, "sppm");
    }
}

fn exact_x(sensor: usize) -> f64 {
    0.4 + 0.8 * (sensor % 5) as f64
}

/// Back to back, two sheets act as one panel that emits on both sides; light of neither is lost in the other.
#[test]
fn back_to_back() {
    let down = panel(DVec3::new(2.0, 1.5, 1.5), 0.8, 0.6, 1000.0);
    let up = Luminaire { corner: down.corner, edge_u: down.edge_v, edge_v: down.edge_u, luminance: down.luminance };
    let black = electric_room(DVec3::new(4.0, 3.0, 3.0), 0.0, vec![down, up], [3, 3], EstimateKind::Point);
    let alone = electric_room(DVec3::new(4.0, 3.0, 3.0), 0.0, vec![down], [3, 3], EstimateKind::Point);
    let both = run(&black, &*light_tracing(&black, 8192, 1), 32);
    let exact = values(&run(&alone, &*light_tracing(&alone, 1024, 1), 2));
    // nothing of the upper sheet's light reaches the floor of a black room
    assert_grid(&both, &exact, &[0.0; 9], 4.5, 0.0, "back to back");
    let kernel = traceable(&black);
    for (from, toward, front) in [(0.1, DVec3::Z, down), (2.9, DVec3::NEG_Z, up)] {
        let hit = kernel.intersect(DVec3::new(2.0, 1.5, from), toward, None);
        let surface = kernel.numbering.luminaire(usize::from(front != down));
        assert_eq!(hit.place, Place::Surface(surface));
        assert_eq!(kernel.luminaire(surface).unwrap().seen::<1>(toward).0[0], down.luminance[0]);
    }
}

/// Daylight and electric light add up: each alone, and both (4.5 standard errors at 81 sensors), with one energy balance.
#[test]
fn daylight_and_electric_light_add_up() {
    let lamp = panel(DVec3::new(0.5, 0.6, 1.9), 0.3, 0.2, 300.0);
    let scene = |tube: bool, lamp_on: bool| {
        let tubes = if tube { vec![straight(1.0, 0.98, lambertian(0.6, 0.2))] } else { Vec::new() };
        let mut scene = cube(0.2, 0.5, 0.7, tubes, daylight(12, 5000.0, 35.0, 180.0), EstimateKind::Point);
        let luminance = if lamp_on { lamp.luminance } else { [0.0; 3] };
        scene.room.luminaires.push(Luminaire { luminance, ..lamp });
        scene
    };
    // an opening of no tube is a piece of ceiling: the lamp alone stays in the room with the dark tube
    let mut lamp_scene = scene(true, true);
    lamp_scene.daylight.as_mut().unwrap().sky = None;
    let (day, both) = (scene(true, false), scene(true, true));
    let result = |scene: &Scene, seed: u64| run(scene, &*light_tracing(scene, 16_384, seed), 24);
    let (day, lamp, both) = (result(&day, 1), result(&lamp_scene, 2), result(&both, 3));
    let sum: Vec<f64> = values(&day).iter().zip(values(&lamp)).map(|(a, b)| a + b).collect();
    let errors: Vec<f64> =
        (0..81).map(|s| day.grids[0].standard_error_lux(s).hypot(lamp.grids[0].standard_error_lux(s))).collect();
    assert_grid(&both, &sum, &errors, 4.5, 0.0, "day and lamp");
    assert!(both.energy.emitted > 0.0 && (both.energy.luminaires / 24.0 - 300.0).abs() < 1e-6);
    assert!(both.energy.relative_closure_error().abs() < 1e-9);
}

/// A luminaire on a wall is seen with its luminance from the front; a ray from behind meets a black sheet.
#[test]
fn eyes_see_front_and_back() {
    use skyduct::scene::View;
    let sheet =
        Luminaire { corner: DVec3::new(1.0, 1.0, 1.0), edge_u: DVec3::X, edge_v: DVec3::Z, luminance: [700.0; 3] };
    let mut scene = electric_room(DVec3::new(3.0, 3.0, 3.0), 0.0, vec![sheet], [1, 1], EstimateKind::Point);
    let view = |name: &str, y: f64| {
        let eye = DVec3::new(1.5, y, 1.5);
        View::new(name.into(), eye, DVec3::new(1.5, 1.0, 1.5), DVec3::Z, 0.2, [4, 4]).unwrap()
    };
    // u x v points to -y
    scene.views = vec![view("front", 0.2), view("back", 1.8)];
    let pass = sppm(&scene, &Settings::default(), 1).pass(0, &AtomicBool::new(false)).unwrap();
    assert!(pass.views[0].luminance.iter().all(|luminance| *luminance == 700.0));
    assert!(pass.views[1].luminance.iter().all(|luminance| *luminance == 0.0));
}

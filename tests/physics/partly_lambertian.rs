//! Closures that are Lambertian in part: responses of the part, and the rest beside it. The methods that cut paths there agree with others
//! in `matrix`.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, JobDocument};
use skyduct::estimate::Estimate;
use skyduct::geometry::disc::disc_irradiance;
use skyduct::integrator::Integrator;
use skyduct::integrator::diffuser_source::flux::patched_flux;
use skyduct::integrator::method::{Described, RefusalCode, Task};
use skyduct::integrator::path_tracing;
use skyduct::integrator::photon::close_points::close_sensors;
use skyduct::integrator::room_matrix::PATCHES;
use skyduct::integrator::two_stage::Settings;
use skyduct::optics::{Diffuser, DiffuserZone, MeasuredDiffuser, Surface};
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::present::reader::ResultReader as _;
use skyduct::sampling::Key;
use skyduct::scene::EstimateKind::{self, CellAverage, Point};
use skyduct::scene::{BoxObject, Grid, Responses, Scene};

use crate::documents::{Folder, render};
use crate::reference;
use crate::scenes::{
    self, RADIUS, SIDE, assert_grid, bent, cube, daylight, disc_room, furnished, lambertian, light_tracing, mixed, run,
    straight, traceable, values, with_sun,
};

fn built(scene: &Scene, seed: u64) -> Box<dyn Integrator> {
    let settings = Settings { photons_per_pass: Some(2048), samples_per_sensor: Some(128), ..Settings::default() };
    scenes::built_to(scene, &settings, seed, 0.01)
}

/// The scene with responses told of all grids.
fn told(mut scene: Scene) -> Scene {
    scene.grids.iter_mut().for_each(|grid| grid.responses = Responses::ToPatches);
    scene
}

/// Passes with their responses.
fn passes(scene: &Scene, method: &dyn Integrator, count: u64) -> Estimate {
    let mut estimate = Estimate::empty(scene);
    estimate.begin(Some(&method.start()), None);
    for pass in 0..count {
        estimate.push(method.pass(pass, &AtomicBool::new(false)).as_ref(), None);
    }
    assert_eq!(estimate.first_not_finite(), None);
    estimate
}

/// A table that is a Lambertian sheet with a peak straight on, which is higher the steeper light comes in.
fn peak_on_a_sheet() -> Diffuser {
    let angles = [0.0, 0.5, 1.0, FRAC_PI_2];
    let row = |peak: f64| vec![0.1 + peak, 0.1 + 0.4 * peak, 0.1, 0.1];
    let (btdf, brdf) = ([row(0.5), row(0.3), row(0.1), row(0.0)], vec![vec![0.06; 4]; 4]);
    Diffuser::Measured(Arc::new(MeasuredDiffuser::new(&angles, &angles, &btdf, Some(&brdf)).unwrap()))
}

/// A closure of which nothing but the clear zone passes light.
fn clear_zone(inner: DiffuserZone) -> Diffuser {
    match mixed(inner) {
        Diffuser::Mixed { lambertian_radius_m, inner, lambertian_reflectance, clear_transmittance, .. } => {
            let lambertian_transmittance = [0.0; 3];
            Diffuser::Mixed {
                lambertian_radius_m,
                inner,
                lambertian_transmittance,
                lambertian_reflectance,
                clear_transmittance,
            }
        }
        _ => unreachable!(),
    }
}

/// All parts of patches together, each by its area, are a uniform disc or ring: Lambert's closed form in a black room. Patches that lie
/// in the clear zone answer nothing.
#[test]
fn parts_of_patches_make_up_the_zone() {
    for (inner, zone) in [(DiffuserZone::Lambertian, [0.0, 0.6]), (DiffuserZone::Clear, [0.6, 1.0])] {
        let mut scene = told(disc_room(0.0, 0.0, 0.0, 0.0, Point));
        scene.tubes[0].diffuser = mixed(inner);
        let found = passes(&scene, &*built(&scene, 5), 2);
        let [from, to] = zone.map(|share: f64| share * share);
        // squared radii of the part of each ring
        let parts: Vec<f64> = (0..4)
            .map(|ring| (f64::min(f64::from(ring + 1) / 4.0, to) - f64::max(f64::from(ring) / 4.0, from)).max(0.0))
            .collect();
        for sensor in 0..scene.grids[0].len() {
            let at = scene.grids[0].centre(sensor);
            let offset = (at - scene.tubes[0].centre.extend(0.0)).truncate().length();
            let disc = |share: f64| disc_irradiance(share * RADIUS, SIDE, offset).vertical;
            let truth = (disc(zone[1]) - disc(zone[0])) / (PI * RADIUS * RADIUS * (to - from));
            let mut sum = 0.0;
            for patch in 0..PATCHES {
                let (part, response) = (parts[patch / 6], found.grids[0].companions[patch].illuminance_lux(sensor));
                assert_eq!(part > 0.0, response > 0.0, "{inner:?} {patch}");
                sum += part / (6.0 * (to - from)) * response;
            }
            // 256 even points of a patch of 4 cm, from 2 m
            assert!((sum / truth - 1.0).abs() < 1e-4, "{inner:?} {sensor}: {sum} {truth}");
        }
    }
}

/// The lumens that leave evenly times the responses are the light, but for what passes the clear zone, which light tracing finds by
/// itself: below a mixed closure and a Lambertian one, sky and sun, past a box.
#[test]
fn lumens_times_responses_and_the_rest_are_the_light() {
    for (inner, estimate) in [(DiffuserZone::Lambertian, CellAverage), (DiffuserZone::Clear, Point)] {
        let of = |diffuser: Diffuser| {
            let tubes = [straight(0.8, 0.95, diffuser), straight(0.4, 0.97, lambertian(0.5, 0.1))];
            let mut scene = furnished(tubes, estimate);
            scene.room.luminaires.clear();
            with_sun(&mut scene, 4_000.0, 50.0);
            scene
        };
        let scene = told(of(mixed(inner)));
        let found = passes(&scene, &*built(&scene, 3), 32);
        let fluxes = |tube: usize| {
            let mut one = scene.clone();
            one.tubes.swap(0, tube);
            patched_flux(&traceable(&one), Key::new(9), 1e-4, &AtomicBool::new(false)).unwrap()
        };
        let fluxes = [fluxes(0), fluxes(1)];
        for (tube, flux) in found.tubes.iter().zip(&fluxes) {
            for (own, other) in [(tube.into_room, flux.into_room), (tube.evenly, flux.evenly)] {
                let error = own.standard_error().hypot(other.standard_error());
                assert!((own.mean - other.mean).abs() <= 4.0 * error, "{own:?} {other:?}");
            }
        }
        let evenly = |tube: usize| found.tubes[tube].evenly.mean / found.tubes[tube].into_room.mean;
        assert!((0.1..0.9).contains(&evenly(0)) && evenly(1) == 1.0, "{} {}", evenly(0), evenly(1));
        let patches: Vec<_> = fluxes.iter().flat_map(|flux| flux.patches_evenly.clone()).collect();
        let mut rest = of(clear_zone(inner));
        rest.tubes[1].diffuser = lambertian(0.0, 0.1);
        let rest = run(&rest, &*light_tracing(&rest, 4096, 77), 32);
        let grid = &found.grids[0];
        for sensor in 0..scene.grids[0].len() {
            let (mut sum, mut error) =
                (rest.grids[0].illuminance_lux(sensor), rest.grids[0].standard_error_lux(sensor));
            for (patch, flux) in grid.companions.iter().zip(&patches) {
                let (response, its_error) = (patch.illuminance_lux(sensor), patch.standard_error_lux(sensor));
                sum += flux.mean * response;
                // all errors may go together
                error += flux.mean * its_error + flux.standard_error() * response;
            }
            let (lux, own) = (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor));
            assert!((sum - lux).abs() <= 4.0 * (error + own), "{inner:?} {sensor}: {sum} +- {error}, {lux} +- {own}");
            let inside = traceable(&scene).is_in_solid(scene.grids[0].centre(sensor)) && estimate == Point;
            assert!(if inside { lux == 0.0 } else { error + own < 0.3 * lux }, "{sensor}: {error} {own} of {lux}");
        }
    }
}

/// Points 5 mm beside a box are no reason to compute a whole grid otherwise: they get their light by paths from both ends, and all others
/// theirs as ever. Path tracing agrees.
#[test]
fn points_beside_a_box_are_computed_alone() {
    let tube = straight(0.8, 0.95, mixed(DiffuserZone::Lambertian));
    let mut scene = cube(0.3, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 40.0, 120.0), Point);
    scene.grids = vec![Grid::new("grid".into(), 0.5, [5, 5], 0.1, [SIDE, SIDE], Point)];
    let size = DVec3::new(0.4, 0.5, 0.9);
    let base = DVec3::new(scene.grids[0].x_m[2] + 0.005 + 0.5 * size.x, 0.5 * SIDE, 0.0);
    let surface = Surface::diffuse([0.6; 3]);
    scene.room.boxes.push(BoxObject { size, base, rotation: 0.0, surface });
    let traceable = traceable(&scene);
    let close: Vec<_> = close_sensors(&traceable, &scene.grids).collect();
    assert!(close.contains(&(0, 12)) && close.len() < 4, "{close:?}");
    assert!(Settings::default().refuses(&Task::whole(&scene, &traceable)).is_none());
    let found = run(&scene, &*scenes::built(&scene, &Settings::default(), 5), 64);
    let paths = path_tracing::Settings::default();
    let (truth, error) = values(&run(&scene, &*scenes::built(&scene, &paths, 6), 512));
    assert_grid(&found, &truth, &error, 4.0, 0.0, "beside a box");
    for (grid, sensor) in close {
        let (lux, own) = (found.grids[grid].illuminance_lux(sensor), found.grids[grid].standard_error_lux(sensor));
        assert!(lux > 0.0 && own.hypot(error[sensor]) < 0.1 * lux, "{sensor}: {lux} +- {own}, {}", error[sensor]);
    }
}

/// Checks that sensors placed one by one, whose paths are connected to sky and sun through clear zones, get what light tracing brings to
/// the level grid at the same places, below closures that are clear in part and as a whole; fluxes agree too, and the energy balance closes.
#[test]
fn placed_sensors_see_sky_and_sun_through_clear_zones() {
    let clear = Diffuser::Clear { transmittance: [0.9; 3] };
    for (number, diffuser) in
        [mixed(DiffuserZone::Clear), mixed(DiffuserZone::Lambertian), clear].into_iter().enumerate()
    {
        let mut scene =
            cube(0.3, 0.5, 0.7, vec![straight(0.8, 0.95, diffuser)], daylight(12, 5000.0, 40.0, 120.0), Point);
        with_sun(&mut scene, 6_000.0, 65.0);
        scene.grids = vec![Grid::new("level".into(), 0.3, [5, 5], 0.1, [SIDE, SIDE], Point)];
        let level = run(&scene, &*light_tracing(&scene, 16_384, 7), 64);
        let placed = (0..scene.grids[0].len()).map(|sensor| scene.grids[0].sensor(sensor)).collect();
        scene.grids = vec![Grid::points("placed".into(), placed)];
        assert!(Settings::default().refuses(&Task::whole(&scene, &traceable(&scene))).is_none());
        let found = run(&scene, &*scenes::built(&scene, &Settings::default(), 5), 64);
        let (truth, error) = values(&level);
        assert_grid(&found, &truth, &error, 4.0, 0.0, &format!("placed {number}"));
        for (flux, other) in found.tubes.iter().zip(&level.tubes) {
            let error = flux.into_room.standard_error().hypot(other.into_room.standard_error());
            assert!((flux.into_room.mean - other.into_room.mean).abs() <= 4.0 * error, "{number}");
        }
        assert!(found.energy.relative_closure_error().abs() < 1e-12, "{number}: {:?}", found.energy);
    }
}

fn bits(method: &dyn Integrator, passes: u64) -> Vec<u64> {
    let of = |pass| method.pass(pass, &AtomicBool::new(false)).unwrap().grids[0].illuminance.clone();
    let values = (0..passes).flat_map(of).map(f64::to_bits);
    values.chain(responses(method, passes)).collect()
}

/// Bits of the responses of all patches.
fn responses(method: &dyn Integrator, passes: u64) -> Vec<u64> {
    let of = |pass| {
        let pass = method.pass(pass, &AtomicBool::new(false)).unwrap();
        pass.grids[0].companions.iter().flat_map(|part| part.illuminance.clone()).collect::<Vec<_>>()
    };
    (0..passes).flat_map(of).map(f64::to_bits).collect()
}

fn room(diffuser: Diffuser, estimate: EstimateKind) -> Scene {
    let tube = straight(0.8, 0.95, diffuser);
    told(cube(0.2, 0.5, 0.7, vec![tube], daylight(12, 5000.0, 40.0, 120.0), estimate))
}

/// The responses of the room below a closure that is Lambertian in part are the same whatever comes down the tube and passes either zone;
/// the zones themselves, and what the closure reflects, belong to the room. Kept or not, all bits are the same.
#[test]
fn responses_are_those_of_the_room_below_a_part() {
    let of = |edit: fn(&mut Scene)| {
        let mut scene = room(mixed(DiffuserZone::Lambertian), Point);
        edit(&mut scene);
        scene
    };
    let zones = |scene: &mut Scene, edit: fn(&mut [f64; 3], &mut [f64; 3], &mut f64)| {
        if let Diffuser::Mixed {
            lambertian_radius_m,
            lambertian_transmittance,
            lambertian_reflectance,
            clear_transmittance,
            ..
        } = &mut scene.tubes[0].diffuser
        {
            edit(lambertian_transmittance, lambertian_reflectance, lambertian_radius_m);
            clear_transmittance[0] *= 0.9;
        }
    };
    let with_zones = |edit: fn(&mut [f64; 3], &mut [f64; 3], &mut f64)| {
        let mut scene = of(|_| {});
        zones(&mut scene, edit);
        scene
    };
    let same = [
        ("another sky", of(|scene| scene.daylight = Some(daylight(1, 9000.0, 20.0, 10.0)))),
        ("sun", of(|scene| with_sun(scene, 6_000.0, 55.0))),
        ("longer", of(|scene| scene.tubes[0].shape = straight(1.6, 0.9, lambertian(0.6, 0.2)).shape)),
        ("transmittances", with_zones(|through, _, _| *through = [0.3; 3])),
    ];
    let other = [
        ("a larger zone", with_zones(|_, _, radius| *radius *= 1.1)),
        ("reflectance", with_zones(|_, back, _| *back = [0.1; 3])),
        ("the other zone", room(mixed(DiffuserZone::Clear), Point)),
        ("a table", room(peak_on_a_sheet(), Point)),
        ("light that comes back", {
            let mut scene = room(mixed(DiffuserZone::Lambertian), CellAverage);
            scene.tubes[0] = bent(mixed(DiffuserZone::Lambertian));
            scene
        }),
    ];
    let first = responses(&*built(&of(|_| {}), 3), 2);
    for (name, scene) in &same {
        assert_eq!(responses(&*built(scene, 3), 2), first, "{name}");
    }
    for (name, scene) in &other {
        assert_ne!(responses(&*built(scene, 3), 2), first, "{name}");
    }
    // what passes a table is nothing to the room
    let table = |through: f64| {
        let of = |value: f64| vec![vec![value / PI; 2]; 2];
        let ends = [0.0, FRAC_PI_2];
        let table = MeasuredDiffuser::new(&ends, &ends, &of(through), Some(&of(0.1))).unwrap();
        room(Diffuser::Measured(Arc::new(table)), Point)
    };
    assert_eq!(responses(&*built(&table(0.5), 3), 1), responses(&*built(&table(0.6), 3), 1));
}

/// The same bits on any number of threads.
#[test]
fn bits_do_not_depend_on_threads() {
    let tubes = [straight(0.8, 0.95, mixed(DiffuserZone::Clear)), bent(peak_on_a_sheet())];
    let mut scene = told(furnished(tubes, CellAverage));
    with_sun(&mut scene, 40_000.0, 50.0);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bits(&*built(&scene, 11), 2))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

/// A table with a peak on a sheet: the sheet is the Lambertian source, and the whole is what light tracing finds of the table, in a bare
/// room and a furnished one.
#[test]
fn a_table_is_its_sheet_and_the_rest() {
    for (scene, share) in [
        (room(peak_on_a_sheet(), Point), 0.5..0.95),
        (told(furnished([bent(peak_on_a_sheet()), straight(0.4, 0.9, peak_on_a_sheet())], CellAverage)), 0.5..0.95),
    ] {
        let found = passes(&scene, &*built(&scene, 3), 32);
        let evenly = found.tubes[0].evenly.mean / found.tubes[0].into_room.mean;
        assert!(share.contains(&evenly), "{evenly}");
        let truth = run(&scene, &*light_tracing(&scene, 16_384, 7), 32);
        let (own, other) = (&found.grids[0], &truth.grids[0]);
        for sensor in 0..own.sensors.len() {
            let error = own.standard_error_lux(sensor).hypot(other.standard_error_lux(sensor));
            let (lux, other) = (own.illuminance_lux(sensor), other.illuminance_lux(sensor));
            assert!((lux - other).abs() <= 4.0 * error && error < 0.06 * lux, "{sensor}: {lux} {other} +- {error}");
        }
    }
}

fn prepared(edit: impl FnOnce(&mut Value)) -> Result<Prepared, DocumentErrors> {
    let mut document = reference::json("scenes/S1.json");
    document["grids"][0]["responses"] = json!(true);
    document["tubes"][0]["diffuser"] = json!({ "kind": "mixed", "lambertian_radius_m": 0.05, "inner": "lambertian",
                                               "lambertian_transmittance": 0.6, "clear_transmittance": 0.9 });
    edit(&mut document);
    prepare_document(&JobDocument::parse(document.to_string().as_bytes())?, &Folder)
}

/// Checks that sensors placed below a mixed closure of a bent tube are refused in the sun, which no method would bring to them, and computed
/// below a straight one.
#[test]
fn placed_sensors_below_clear_zones_of_bent_tubes_are_refused() {
    let placed = |segments: Value| {
        prepared(|document| {
            document["sky"]["direct_normal_illuminance_lux"] = json!(50_000);
            document["tubes"][0]["segments"] = segments;
            document["grids"] = json!([{ "name": "wall", "points_m": [[0.0, 1.0, 1.0, 1, 0, 0]] }]);
        })
    };
    let straight = placed(json!([{ "length_m": 0.8 }])).unwrap();
    assert_eq!(straight.plan.methods.names(), ["two_stage"]);
    let bent = placed(json!([{ "length_m": 0.5 }, { "length_m": 0.4, "tilt_deg": 30 }])).err().unwrap().0.remove(0);
    assert_eq!((&*bent.pointer, bent.refusal.unwrap().0), ("/method", RefusalCode::SunThroughClearClosures));
}

/// Who asks for responses below a mixed closure reads of which share of the flux they speak; where its rest cannot be followed, why not.
#[test]
fn documents_ask_for_responses_of_parts() {
    let job = prepared(|document| document["stop"] = json!({ "relative_error": 0.05 })).unwrap();
    assert_eq!(job.plan.methods.names(), ["two_stage"]);
    let estimate = render(&job);
    let grid = json!(job.results(&estimate).grid("floor").unwrap().unwrap());
    let lit = |patch: usize| grid["responses"][patch]["lux_per_lumen"][4][4].as_f64().unwrap();
    assert!(lit(0) > 0.0 && lit(PATCHES - 1) == 0.0);
    let flux = &estimate.tubes[0];
    assert!((0.01..0.5).contains(&(flux.evenly.mean / flux.into_room.mean)));
    let refused = |edit: &dyn Fn(&mut Value)| {
        let error = prepared(edit).err().unwrap().0.remove(0);
        assert_eq!(error.pointer, "/grids/0/responses", "{error}");
        error.refusal.unwrap().0
    };
    let bend = json!([{ "length_m": 0.5 }, { "length_m": 0.4, "tilt_deg": 30 }]);
    let bent = refused(&|document| document["tubes"][0]["segments"] = bend.clone());
    assert_eq!(bent, RefusalCode::ClearClosuresOfBentTubes);
    let clear = refused(&|document| document["tubes"][0]["diffuser"]["lambertian_radius_m"] = json!(0.0));
    assert_eq!(clear, RefusalCode::ClearClosures);
    let cells = refused(&|document| {
        document["method"] = json!("light_tracing");
        document["grids"][0]["estimate"] = json!("cell_average");
    });
    assert_eq!(cells, RefusalCode::NoResponses);
}

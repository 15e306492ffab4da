//! The matrix of a room: closed forms, what it adds up to, and what it depends on.

use std::f64::consts::PI;
use std::sync::atomic::AtomicBool;

use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, JobDocument};
use skyduct::estimate::{Estimate, GridEstimate};
use skyduct::geometry::lambert::quadrilateral_irradiance;
use skyduct::integrator::Integrator;
use skyduct::integrator::diffuser_source::flux::patched_flux;
use skyduct::integrator::method::RefusalCode;
use skyduct::integrator::room_matrix::PATCHES;
use skyduct::integrator::two_stage::Settings;
use skyduct::optics::Surface;
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::present::reader::ResultReader as _;
use skyduct::sampling::Key;
use skyduct::scene::{BoxObject, EstimateKind, Face, Grid, Responses, Scene, Sensor, Transition};
use skyduct::statistics::Moments;
use skyduct::traceable::TraceableScene;

use crate::documents::Folder;
use crate::reference;
use crate::scenes::{
    self, RADIUS, SIDE, bent, cube, daylight, disc_room, furnished, lambertian, radiosity, straight, traceable,
    with_sun,
};

/// The method with so many photons of a pass and paths of a sensor.
fn sized(scene: &Scene, photons: u64, paths: u32, seed: u64) -> Box<dyn Integrator> {
    let settings = Settings { photons_per_pass: Some(photons), samples_per_sensor: Some(paths), ..Settings::default() };
    scenes::built_to(scene, &settings, seed, 0.01)
}

fn built(scene: &Scene, seed: u64) -> Box<dyn Integrator> {
    sized(scene, 512, 64, seed)
}

/// Adds up passes with their responses.
fn run(scene: &Scene, method: &dyn Integrator, passes: u64) -> Estimate {
    let mut estimate = Estimate::empty(scene);
    estimate.begin(Some(&method.start()), None);
    for pass in 0..passes {
        estimate.push(method.pass(pass, &AtomicBool::new(false)).as_ref(), None);
    }
    assert_eq!(estimate.first_not_finite(), None);
    estimate
}

/// The scene with responses told of all grids.
fn told(mut scene: Scene) -> Scene {
    scene.grids.iter_mut().for_each(|grid| grid.responses = Responses::ToPatches);
    scene
}

/// Mean over the patches of what each gives to a sensor per lumen, and its standard error where the errors of all patches go together.
fn evenly_lit(estimate: &Estimate, sensor: usize) -> (f64, f64) {
    let patches = &estimate.grids[0].companions[..PATCHES];
    let mean = |of: &dyn Fn(usize) -> f64| (0..PATCHES).map(of).sum::<f64>() / PATCHES as f64;
    (mean(&|patch| patches[patch].illuminance_lux(sensor)), mean(&|patch| patches[patch].standard_error_lux(sensor)))
}

/// All patches together are a uniform disc: 1000 lm of it give what radiosity with exact form factors gives, in
/// rooms of all reflectances, at points and in cells.
#[test]
fn patches_together_are_a_uniform_disc() {
    for (case, [floor, walls, ceiling, disc], estimate) in
        [("S1r", [0.2, 0.5, 0.7, 0.2], EstimateKind::Point), ("S1r", [0.2, 0.5, 0.7, 0.2], EstimateKind::CellAverage)]
    {
        let scene = told(disc_room(floor, walls, ceiling, disc, estimate));
        let found = run(&scene, &*built(&scene, 5), 32);
        let (truth, error) = radiosity(case, estimate);
        for (sensor, truth) in truth.iter().enumerate() {
            let (mean, mean_error) = evenly_lit(&found, sensor);
            let tolerance = 4.0 * mean_error + error * truth;
            assert!(
                (1000.0 * mean - truth).abs() <= 1000.0 * tolerance,
                "{case} {estimate:?} {sensor}: {mean} {truth}"
            );
            assert!(mean_error < 0.01 * mean, "{sensor}: {mean_error}");
        }
    }
}

/// In a black room all patches of a square together light sensors like an even square, by its closed form. Each sensor's value is a mean over
/// few nodes of each of 24 patches, whose distances from sensors vary by some percent: its error is below 1e-3.
#[test]
fn patches_of_a_square_are_the_square() {
    let mut scene = told(disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point));
    scene.tubes[0].transition = Some(Transition { side_m: 0.3, azimuth: 0.4, transmittance: 1.0 });
    let found = run(&scene, &*built(&scene, 5), 2);
    let opening = &traceable(&scene).tubes[0];
    let (corners, area) = (opening.corners().unwrap(), opening.opening.area_m2());
    for sensor in 0..81 {
        let seen = quadrilateral_irradiance(&corners, scene.grids[0].centre(sensor), DVec3::Z) / (PI * area);
        let (mean, _) = evenly_lit(&found, sensor);
        assert!((mean / seen - 1.0).abs() < 1e-3, "{sensor}: {mean} {seen}");
    }
}

/// Straight light of each patch alone, in a black room: an integral over the patch by the midpoint rule.
#[test]
fn light_straight_from_a_patch_is_its_integral() {
    let scene = told(disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point));
    let found = run(&scene, &*built(&scene, 5), 2);
    let (rings, sectors, steps) = (4, 6, 24);
    // by ring and sector, whatever their order
    let mut integrals = vec![Vec::new(); 81];
    for (sensor, integrals) in integrals.iter_mut().enumerate() {
        let at = scene.grids[0].centre(sensor);
        for ring in 0..rings {
            for sector in 0..sectors {
                let mut sum = 0.0;
                for i in 0..steps {
                    for k in 0..steps {
                        let r = RADIUS
                            * ((f64::from(ring) + (f64::from(i) + 0.5) / f64::from(steps)) / f64::from(rings)).sqrt();
                        let turn = (f64::from(sector) + (f64::from(k) + 0.5) / f64::from(steps)) / f64::from(sectors);
                        let (sin, cos) = (2.0 * PI * turn).sin_cos();
                        let way = DVec3::new(0.5 * SIDE + r * cos, 0.5 * SIDE + r * sin, SIDE) - at;
                        sum += way.z * way.z / (PI * way.length_squared().powi(2));
                    }
                }
                integrals.push(sum / f64::from(steps * steps));
            }
        }
    }
    for (sensor, integrals) in integrals.iter_mut().enumerate() {
        let mut responses: Vec<f64> =
            found.grids[0].companions[..PATCHES].iter().map(|patch| patch.illuminance_lux(sensor)).collect();
        responses.sort_by(f64::total_cmp);
        integrals.sort_by(f64::total_cmp);
        for (response, integral) in responses.iter().zip(integrals) {
            // a 24 by 24 rule and 256 even points of a patch of 4 cm, from 2 m: each is better than 1e-4
            assert!((response / *integral - 1.0).abs() < 2e-4, "{sensor}: {response} {integral}");
        }
    }
}

/// Mean, and its standard error where the errors of all patches go together, of what the patches of a tube give to a sensor per lumen, times
/// a factor of each.
fn of_patches(estimate: &Estimate, (tube, sensor): (usize, usize), factor: &dyn Fn(usize) -> f64) -> [f64; 2] {
    let patches = &estimate.grids[0].companions[tube * PATCHES..(tube + 1) * PATCHES];
    let mean = |of: &dyn Fn(usize) -> f64| (0..PATCHES).map(of).sum::<f64>() / PATCHES as f64;
    let value = mean(&|patch| factor(patch) * patches[patch].illuminance_lux(sensor));
    [value, mean(&|patch| factor(patch).abs() * patches[patch].standard_error_lux(sensor))]
}

/// Centroid of a patch of a disc in its radii: six sectors of each of four rings of equal area, from -180 degrees on, and back in every other
/// ring.
fn centroid(patch: usize) -> DVec2 {
    let [inner, outer] = [patch / 6, patch / 6 + 1].map(|ring| (ring as f64 / 4.0).sqrt());
    let (half, sector) = (PI / 6.0, patch % 6);
    let sector = if (patch / 6).is_multiple_of(2) { sector } else { 5 - sector };
    let away = 2.0 / 3.0 * half.sin() / half * (outer.powi(3) - inner.powi(3)) / (outer.powi(2) - inner.powi(2));
    DVec2::from_angle(sector as f64 * PI / 3.0 + half - PI) * away
}

/// Checks that the responses of a scene to whole openings, which count coarse solutions and share residuals, are within four standard errors
/// sums of those to their patches, which do neither: those to evenly spread light, its moments, and all tubes together.
fn openings_are_sums_of_patches(scene: &Scene, settings: &[Settings]) {
    let mut whole = scene.clone();
    whole.grids[0].responses = Responses::ToTubes;
    let by_patches = run(scene, &*sized(scene, 256, 256, 6), 32);
    for settings in settings {
        let by_tubes = run(&whole, &*scenes::built_to(&whole, settings, 5, 0.005), 24);
        are_sums_of_patches(&traceable(scene), &by_tubes.grids[0], &by_patches);
    }
}

/// Checks the responses of a grid to whole openings against those to their patches.
fn are_sums_of_patches(room: &TraceableScene, by_tubes: &GridEstimate, by_patches: &Estimate) {
    let (to_all, moments) = by_tubes.companions.split_first().unwrap();
    assert_eq!([to_all.companions.len(), moments.len()], [room.tubes.len(), 2 * room.tubes.len()]);
    // moments of the centroids of patches alone are too small
    let squares = (0..PATCHES).map(|patch| centroid(patch).length_squared()).sum::<f64>() / PATCHES as f64;
    let (mut errors, mut told) = (Moments::default(), Moments::default());
    // those in solids are dark
    for sensor in (0..by_tubes.sensors.len()).filter(|sensor| to_all.illuminance_lux(*sensor) > 0.0) {
        let mut sum = 0.0;
        for (tube, part) in to_all.companions.iter().enumerate() {
            sum += part.illuminance_lux(sensor);
            let of = |factor: &dyn Fn(usize) -> f64| of_patches(by_patches, (tube, sensor), factor);
            let [even, error] = of(&|_| 1.0);
            let (value, own) = (part.illuminance_lux(sensor), part.standard_error_lux(sensor));
            assert!((value - even).abs() <= 4.0 * error.hypot(own), "{sensor}: {value} +- {own}, {even} +- {error}");
            errors.push(((value - even) / value).powi(2));
            told.push((error.powi(2) + own.powi(2)) / value.powi(2));
            for (axis, moment) in [DVec2::X, DVec2::Y].into_iter().zip(&moments[2 * tube..]) {
                let [expected, error] = of(&|patch| axis.dot(centroid(patch)) * 0.5 / squares);
                let (value, own) = (moment.illuminance_lux(sensor), moment.standard_error_lux(sensor));
                let tolerance = 4.0 * error.hypot(own) + 0.002 * even;
                assert!(
                    (value - expected).abs() <= tolerance,
                    "{sensor} {axis}: {value} +- {own}, {expected} +- {error}"
                );
            }
        }
        let all = to_all.illuminance_lux(sensor);
        assert!((sum / all - 1.0).abs() < 1e-12, "{sensor}: {sum} is not {all}");
    }
    // all sensors together; errors of patches as if they went together are too large
    assert!(errors.mean < 1.3 * told.mean && told.mean.sqrt() < 0.04, "{} {}", errors.mean.sqrt(), told.mean.sqrt());
}

#[test]
fn responses_to_whole_openings() {
    for estimate in [EstimateKind::Point, EstimateKind::CellAverage] {
        openings_are_sums_of_patches(&told(disc_room(0.2, 0.5, 0.7, 0.2, estimate)), &[Settings::default()]);
    }
    let tubes = || [straight(0.8, 0.95, lambertian(0.6, 0.2)), bent(lambertian(0.5, 0.1))];
    // a box that hides parts of the openings, a glossy wall, light that comes back by a bent tube
    let mut behind = told(furnished(tubes(), EstimateKind::Point));
    behind.room.luminaires.clear();
    let paths = Settings { samples_per_sensor: Some(64), ..Settings::default() };
    openings_are_sums_of_patches(&behind, &[Settings::default(), paths]);
}

/// In a black room a disc that is brighter on one side lights sensors by its moments, as an integral by the midpoint rule does; light that
/// surfaces reflect evens out, but keeps the sides.
#[test]
fn moments_of_an_opening_are_integrals() {
    let to_tubes = |scene: Scene| {
        let mut scene = told(scene);
        scene.grids[0].responses = Responses::ToTubes;
        scene
    };
    let whole = to_tubes(disc_room(0.2, 0.5, 0.7, 0.2, EstimateKind::Point));
    let of_whole = run(&whole, &*built(&whole, 5), 4);
    let [_, across, along] = &of_whole.grids[0].companions[..] else { panic!("not three") };
    let black = to_tubes(disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point));
    let found = run(&black, &*built(&black, 5), 2);
    let [to_all, across_black, along_black] = &found.grids[0].companions[..] else { panic!("not three") };
    let even = &to_all.companions[0];
    let (steps, centroid, mut largest_shift) = (48, DVec2::new(0.3, -0.2), 0.0);
    for sensor in 0..black.grids[0].len() {
        let at = black.grids[0].centre(sensor);
        let mut sum = 0.0;
        for i in 0..steps {
            for k in 0..steps {
                let r = ((f64::from(i) + 0.5) / f64::from(steps)).sqrt();
                let point = DVec2::from_angle(2.0 * PI * (f64::from(k) + 0.5) / f64::from(steps)) * r;
                let way = (DVec2::splat(0.5 * SIDE) + RADIUS * point).extend(SIDE) - at;
                let density = 1.0 + 4.0 * centroid.dot(point);
                sum += density * way.z * way.z / (PI * way.length_squared().powi(2)) / f64::from(steps * steps);
            }
        }
        let moments = DVec2::new(across_black.illuminance_lux(sensor), along_black.illuminance_lux(sensor));
        let response = even.illuminance_lux(sensor) + 4.0 * centroid.dot(moments);
        // what is not linear in the place on the disc is left out
        assert!((response / sum - 1.0).abs() < 5e-4, "{sensor}: {response} {sum}");
        largest_shift = f64::max(largest_shift, 4.0 * centroid.dot(moments).abs() / sum);
    }
    // the moments are seen
    assert!(largest_shift > 0.01, "{largest_shift}");
    assert!(across.illuminance_lux(0) < 0.0 && across.illuminance_lux(8) > 0.0);
    assert!(along.illuminance_lux(0) < 0.0 && along.illuminance_lux(72) > 0.0);
}

/// In a black room a sensor that faces away from an opening gets none of its light, and never less than none; one that faces it gets some.
#[test]
fn sensors_that_face_away_get_nothing() {
    let mut scene = told(disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point));
    let at = DVec3::new(0.3, 1.0, 1.0);
    let sensors = [DVec3::X, DVec3::NEG_X, DVec3::NEG_Z].map(|normal| Sensor { position: at, normal });
    scene.grids = vec![Grid { responses: Responses::ToPatches, ..Grid::points("walls".into(), sensors.to_vec()) }];
    let found = run(&scene, &*built(&scene, 5), 2);
    let lux = [0, 1, 2].map(|sensor| evenly_lit(&found, sensor).0);
    assert!(lux[0] > 0.0 && lux[1..] == [0.0, 0.0], "{lux:?}");
}

/// The lumens of the patches times the responses are the light, in a furnished room with a box that hides parts of the
/// openings, a glossy wall, sun and sky.
#[test]
fn lumens_times_responses_are_the_light() {
    let mut scene = told(furnished(
        [straight(0.8, 0.95, lambertian(0.6, 0.2)), straight(0.4, 0.97, lambertian(0.5, 0.1))],
        EstimateKind::Point,
    ));
    scene.room.luminaires.clear();
    with_sun(&mut scene, 40_000.0, 50.0);
    let passes = 64;
    let found = run(&scene, &*sized(&scene, 2048, 128, 3), passes);
    // the flux of each tube alone: the first of a scene counts
    let fluxes = |tube: usize| {
        let mut one = scene.clone();
        one.tubes.swap(0, tube);
        patched_flux(&traceable(&one), Key::new(9), 1e-5, &AtomicBool::new(false)).unwrap().patches
    };
    let fluxes = [fluxes(0), fluxes(1)].concat();
    let grid = &found.grids[0];
    let patches = || grid.companions[..2 * PATCHES].iter().zip(&fluxes);
    for sensor in 0..scene.grids[0].len() {
        if traceable(&scene).is_in_solid(scene.grids[0].centre(sensor)) {
            assert_eq!(grid.illuminance_lux(sensor), 0.0);
            continue;
        }
        // all errors may go together
        let sum: f64 = patches().map(|(patch, flux)| patch.illuminance_lux(sensor) * flux.mean).sum();
        let of_patch = |(patch, flux): (&GridEstimate, &Moments)| {
            patch.standard_error_lux(sensor) * flux.mean + patch.illuminance_lux(sensor) * flux.standard_error()
        };
        let error: f64 = patches().map(of_patch).sum();
        let (lux, own) = (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor));
        assert!((sum - lux).abs() <= 4.0 * (error + own), "{sensor}: {sum} +- {error}, {lux} +- {own}");
        assert!(lux > 0.0 && error + own < 0.08 * lux, "{sensor}: {error} {own} of {lux}");
    }
}

fn bits(method: &dyn Integrator, passes: u64) -> Vec<u64> {
    let of = |pass| {
        let pass = method.pass(pass, &AtomicBool::new(false)).unwrap();
        let beside = pass.grids[0].companions.iter().flat_map(|part| part.illuminance.clone());
        beside.map(f64::to_bits).collect::<Vec<_>>()
    };
    (0..passes).flat_map(of).collect()
}

/// Sky, sun, and what is above the openings touch no response, to the same bits. Whatever stands in the room, the openings, the sensors
/// and the seed do.
#[test]
fn responses_are_those_of_the_room_alone() {
    let tube = || straight(0.8, 0.95, lambertian(0.6, 0.2));
    let base = told(cube(0.2, 0.5, 0.7, vec![tube()], daylight(12, 5000.0, 40.0, 120.0), EstimateKind::Point));
    let mut sunny = base.clone();
    with_sun(&mut sunny, 60_000.0, 55.0);
    let with_tube = |tube| Scene { tubes: vec![tube], ..base.clone() };
    let same = [
        ("another sky", Scene { daylight: Some(daylight(1, 9000.0, 20.0, 10.0)), ..base.clone() }),
        ("sun", sunny),
        ("longer", with_tube(straight(1.6, 0.95, lambertian(0.6, 0.2)))),
        ("duller", with_tube(straight(0.8, 0.8, lambertian(0.6, 0.2)))),
        ("less transmittance", with_tube(straight(0.8, 0.95, lambertian(0.3, 0.2)))),
        ("night", Scene { daylight: None, ..base.clone() }),
    ];
    let mut floor = base.clone();
    floor.room.enclosure.paint(Face::Floor as usize, Some(Surface::diffuse([0.21; 3])));
    let mut boxed = base.clone();
    boxed.room.boxes.push(BoxObject {
        size: DVec3::splat(0.3),
        base: DVec3::new(1.0, 0.4, 0.0),
        rotation: 0.1,
        surface: Surface::diffuse([0.5; 3]),
    });
    let mut higher = base.clone();
    higher.grids[0].height_m = 0.1;
    let mut wider = base.clone();
    wider.tubes[0].opening_radius *= 1.1;
    let mut averages = base.clone();
    averages.grids[0].estimate = EstimateKind::CellAverage;
    let other = [
        ("floor", floor),
        ("box", boxed),
        ("grid", higher),
        ("opening", wider),
        ("cells", averages),
        ("reflectance of the closure", with_tube(straight(0.8, 0.95, lambertian(0.6, 0.3)))),
        ("light that comes back", with_tube(bent(lambertian(0.6, 0.2)))),
    ];
    let passes = 2;
    let first = bits(&*built(&base, 3), passes);
    for (name, scene) in &same {
        assert_eq!(bits(&*built(scene, 3), passes), first, "{name}");
    }
    assert_ne!(bits(&*built(&base, 4), passes), first, "another seed");
    for (name, scene) in &other {
        assert_ne!(bits(&*built(scene, 3), passes), first, "{name}");
    }
}

/// The same bits on any number of threads.
#[test]
fn bits_do_not_depend_on_threads() {
    let tubes = [straight(0.8, 0.95, lambertian(0.6, 0.2)), bent(lambertian(0.5, 0.1))];
    let scene = told(furnished(tubes, EstimateKind::CellAverage));
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| bits(&*built(&scene, 11), 2))
    };
    let one = on(1);
    assert_eq!(one, on(2));
    assert_eq!(one, on(5));
}

fn prepared(edit: impl FnOnce(&mut Value)) -> Result<Prepared, DocumentErrors> {
    let mut document = reference::json("scenes/S1.json");
    document["grids"][0]["responses"] = json!(true);
    edit(&mut document);
    prepare_document(&JobDocument::parse(document.to_string().as_bytes())?, &Folder)
}

/// Kind of refusal of the responses, if a method refuses them; another kind of error has none.
fn refused(edit: impl FnOnce(&mut Value)) -> Option<RefusalCode> {
    let error = prepared(edit).err().unwrap().0.remove(0);
    assert_eq!(error.pointer, "/grids/0/responses", "{error}");
    error.refusal.map(|refusal| refusal.0)
}

/// Who asks for responses gets the method that tells them, and reads 24 of each tube; who asks for another method reads why not.
#[test]
fn documents_ask_for_responses() {
    let job = prepared(|document| document["stop"] = json!({ "relative_error": 0.02 })).unwrap();
    assert_eq!(job.plan.methods.names(), ["two_stage"]);
    let estimate = crate::documents::render(&job);
    let grid = json!(job.results(&estimate).grid("floor").unwrap().unwrap());
    let responses = grid["responses"].as_array().unwrap();
    assert_eq!(responses.len(), PATCHES);
    for (number, response) in responses.iter().enumerate() {
        assert_eq!((&response["tube"], &response["patch"]), (&json!(0), &json!(number)));
        for key in ["lux_per_lumen", "standard_error"] {
            assert_eq!(response[key].as_array().unwrap().len(), 9, "{key}");
        }
        assert!(response["lux_per_lumen"][4][4].as_f64().unwrap() > 0.0);
    }
    let by_light_tracing = refused(|document| document["method"] = json!("light_tracing"));
    assert_eq!(by_light_tracing, Some(RefusalCode::NoResponses));
    let clear = json!({ "kind": "clear", "transmittance": 0.9 });
    let through_glass = refused(|document| document["tubes"][0]["diffuser"] = clear);
    assert_eq!(through_glass, Some(RefusalCode::ClearClosures));
    assert_eq!(refused(|document| document["grids"][0]["components"] = json!(true)), None);
    let at_openings = refused(|document| document["grids"][0]["height_m"] = json!(2.0));
    assert_eq!(at_openings, Some(RefusalCode::PointsNearSurfaces));
}

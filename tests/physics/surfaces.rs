//! Glossy and mirror surfaces in rooms: energy, agreement of methods, images of mirrors.

use crate::reference;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use crate::documents::{Folder, refusal};
use crate::scenes::{
    RADIUS, assert_grid, cube, daylight, disc_room, kernel, lambertian, light_tracing, run, sppm, straight,
};
use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, JobDocument, ValidJob, to_scene};
use skyduct::estimate::{Estimate, GridEstimate};
use skyduct::integrator::method::RefusalCode;
use skyduct::integrator::photon::emission::Emission;
use skyduct::integrator::photon::ledger::Account;
use skyduct::integrator::photon::path::{Flight, Origin, Scattering, Visitor, trace};
use skyduct::integrator::sppm::Settings;
use skyduct::job::prepare::{Prepared, prepare_document};
use skyduct::optics::{Diffuser, Glossy, MeasuredDiffuser, Spectrum, Specular, Surface};
use skyduct::plan::EffectKind;
use skyduct::sampling::{Key, PathSamples, warp};
use skyduct::scene::{BoxObject, Channels, EstimateKind, Face, Grid, Luminaire, Room, Scene, Tube, View};
use skyduct::statistics::Moments;
use skyduct::traceable::SurfaceId;

/// Reflectance so close to 1 that a wall counts as a perfect mirror.
const PERFECT: f64 = 1.0 - 1e-7;

fn specular(diffuse: f64, specular: f64, roughness: f64) -> Surface {
    let specular = Specular { reflectance: [specular; 3], roughness };
    Surface { reflectance: [diffuse; 3], specular: Some(specular) }
}

/// Flux of all flights in lm.
#[derive(Default)]
struct Flown(f64);

impl<const C: usize> Visitor<C> for Flown {
    fn scattered(&mut self, _: &Scattering<'_, C>, _: &mut PathSamples) {}
    fn emitted(&mut self, _: &Scattering<'_, C>, _: &mut PathSamples) {}
    fn flew(&mut self, flight: &Flight<C>) {
        self.0 += flight.flux.luminance();
    }
    fn arrived(&mut self, _: SurfaceId, _: DVec3, _: Spectrum<C>, _: Origin) {}
}

/// A closed room whose surfaces, the disc and a box in it all have the albedo 0.5, diffuse, mirror and glossy: the flux
/// that arrives anywhere, as often as it arrives, is the flux into the room / (1 - 0.5), however it is distributed.
#[test]
fn white_furnace() {
    let mut scene = disc_room(0.5, 0.5, 0.5, 0.5, EstimateKind::CellAverage);
    let glossy = |diffuse, roughness| specular(diffuse, 0.5 - diffuse, roughness);
    scene.room.surfaces = [
        Some(glossy(0.0, 0.0)),
        Some(glossy(0.2, 0.0)),
        Some(glossy(0.1, 0.3)),
        Some(glossy(0.0, 1.0)),
        Some(glossy(0.25, 0.6)),
        Some(Surface::diffuse([0.5; 3])),
    ];
    scene.room.boxes.push(BoxObject {
        size: DVec3::new(0.5, 0.7, 0.4),
        base: DVec3::new(0.7, 0.6, 0.0),
        rotation: 0.4,
        surface: glossy(0.0, 0.1),
    });
    let kernel = kernel(&scene);
    let emission = Emission::new(&kernel, 4096);
    let mut arrived = Moments::default();
    for pass in 0..16 {
        let mut flown = Flown::default();
        let mut account = Account::new(1);
        for number in 0..emission.photons() {
            let (photon, mut samples) = emission.photon(&kernel, Key::new(9).child(pass), number);
            trace::<1>(&kernel, &photon.unwrap(), &mut samples, &mut flown, &mut account);
        }
        assert!(account.ledger.relative_closure_error().abs() < 1e-9, "{:?}", account.ledger);
        arrived.push(flown.0 / account.tubes[0].into_room);
    }
    println!("{} +- {}", arrived.mean, arrived.standard_error());
    assert!((arrived.mean - 2.0).abs() < 4.0 * arrived.standard_error(), "{arrived:?}");
    assert!(arrived.standard_error() < 0.01);
}

/// Means of blocks of `per_side` x `per_side` sensors of the first grid, with their standard errors from the passes of
/// the whole, which are those of the sensors when errors of neighbours are one.
fn blocks(estimate: &Estimate, cells: usize, per_side: usize) -> (Vec<f64>, Vec<f64>) {
    let grid = &estimate.grids[0];
    let fine = cells * per_side;
    (0..cells * cells)
        .map(|block| {
            let (x, y) = (block % cells * per_side, block / cells * per_side);
            let sensors = || (0..per_side * per_side).map(|k| (y + k / per_side) * fine + x + k % per_side);
            let mean = |f: &dyn Fn(usize) -> f64| sensors().map(f).sum::<f64>() / (per_side * per_side) as f64;
            (mean(&|sensor| grid.illuminance_lux(sensor)), mean(&|sensor| grid.standard_error_lux(sensor)))
        })
        .unzip()
}

fn values(grid: &GridEstimate) -> (Vec<f64>, Vec<f64>) {
    (0..grid.sensors.len()).map(|sensor| (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor))).unzip()
}

/// The disc room with one special wall and a grid of `cells` x `cells` at 0.4 m, 0.2 m away from the walls.
fn room_with(east: Surface, cells: usize, estimate: EstimateKind) -> Scene {
    let mut scene = disc_room(0.3, 0.4, 0.6, 0.3, estimate);
    scene.room.surfaces[Face::East as usize] = Some(east);
    let side = scene.room.size.x;
    scene.grids = vec![Grid::new("grid".into(), 0.4, [cells, cells], 0.2, [side, side], estimate)];
    scene
}

fn quick_sppm() -> Settings {
    Settings { photons_per_pass: 16_384, initial_radius_m: Some(0.1), ..Settings::default() }
}

/// Connections to a glossy wall, flights from it and photon mapping give the same illuminance: 4.5 combined standard
/// errors, and 0.2 % for the midpoint rule of points in cells.
#[test]
fn methods_agree_on_a_glossy_wall() {
    for (wall, seed) in [(specular(0.2, 0.6, 0.5), 1), (specular(0.0, 0.8, 0.8), 2)] {
        let averages = room_with(wall, 3, EstimateKind::CellAverage);
        let (truth, error) = values(&run(&averages, &light_tracing(&averages, 16_384, seed), 32).grids[0]);
        let points = room_with(wall, 12, EstimateKind::Point);
        let connected = run(&points, &light_tracing(&points, 4_096, seed + 10), 24);
        let (lux, lux_error) = blocks(&connected, 3, 4);
        for cell in 0..9 {
            let tolerance = 4.5 * error[cell].hypot(lux_error[cell]) + 0.002 * truth[cell];
            println!("{} +- {}, {} +- {}", lux[cell], lux_error[cell], truth[cell], error[cell]);
            assert!((lux[cell] - truth[cell]).abs() < tolerance, "{cell}");
        }
        let mapped = run(&averages, &sppm(&averages, &quick_sppm(), seed + 20), 48);
        assert_grid(&mapped, &truth, &error, 4.5, 0.0, "sppm");
        // the wall matters: without its lobe the cells beside it are darker by far more than the tolerance
        let dull = room_with(Surface::diffuse(wall.reflectance), 3, EstimateKind::CellAverage);
        let (dull, _) = values(&run(&dull, &light_tracing(&dull, 16_384, seed), 8).grids[0]);
        assert!(dull[5] < 0.97 * truth[5], "{} {}", dull[5], truth[5]);
    }
}

#[test]
fn methods_agree_on_a_mirror() {
    let averages = room_with(specular(0.1, 0.8, 0.0), 4, EstimateKind::CellAverage);
    let (truth, error) = values(&run(&averages, &light_tracing(&averages, 16_384, 4), 32).grids[0]);
    let mapped = run(&averages, &sppm(&averages, &quick_sppm(), 5), 48);
    assert_grid(&mapped, &truth, &error, 4.5, 0.0, "sppm");
}

const HALF: DVec3 = DVec3::new(2.0, 2.4, 2.2);

fn tube_at(x: f64, y: f64, diffuser: Diffuser) -> Tube {
    Tube { centre: DVec2::new(x, y), opening_radius: RADIUS, ..straight(0.5, 0.95, diffuser) }
}

/// A room with a perfect mirror in the east, or the room of twice the length with the image of the tube; one 4 x 4 grid
/// over the (western) half.
fn mirrored(diffuser: Diffuser, image: bool, estimate: EstimateKind) -> Scene {
    let mut tubes = vec![tube_at(1.2, 0.9, diffuser.clone())];
    if image {
        tubes.push(tube_at(2.0 * HALF.x - 1.2, 0.9, diffuser));
    }
    // an overcast sky looks the same from both sides
    let mut scene = cube(0.3, 0.5, 0.7, tubes, daylight(1, 9000.0, 40.0, 0.0), estimate);
    let east = if image { scene.room.surfaces[Face::West as usize] } else { Some(specular(0.0, PERFECT, 0.0)) };
    let size = if image { DVec3::new(2.0 * HALF.x, HALF.y, HALF.z) } else { HALF };
    scene.room = Room { size, ..scene.room };
    scene.room.surfaces[Face::East as usize] = east;
    scene.grids = vec![Grid::new("grid".into(), 0.5, [4, 4], 0.0, [HALF.x, HALF.y], estimate)];
    scene
}

/// A mirrored room with a panel in the ceiling (and its image) in place of tubes.
fn mirrored_panel(image: bool, estimate: EstimateKind) -> Scene {
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

/// A mirror shows the other half of a symmetric room twice as long: cells and points, scattering and clear closures.
#[test]
fn a_mirror_doubles_the_room() {
    let clear = Diffuser::Clear { transmittance: [0.8; 3] };
    for (diffuser, what) in [(lambertian(0.6, 0.3), "lambertian"), (clear, "clear")] {
        let [mirror, image] = [false, true].map(|image| mirrored(diffuser.clone(), image, EstimateKind::CellAverage));
        let (truth, error) = values(&run(&image, &light_tracing(&image, 16_384, 1), 32).grids[0]);
        assert_grid(&run(&mirror, &light_tracing(&mirror, 16_384, 2), 32), &truth, &error, 4.5, 0.0, what);
        // one half alone is darker: the image is worth seeing
        let mut half = image.clone();
        half.tubes.pop();
        let (dark, _) = values(&run(&half, &light_tracing(&half, 16_384, 1), 8).grids[0]);
        assert!(dark[3] < 0.9 * truth[3], "{} {}", dark[3], truth[3]);
    }
    let [mirror, image] = [false, true].map(|image| mirrored_panel(image, EstimateKind::CellAverage));
    let (truth, error) = values(&run(&image, &light_tracing(&image, 16_384, 5), 32).grids[0]);
    assert_grid(&run(&mirror, &light_tracing(&mirror, 16_384, 6), 32), &truth, &error, 4.5, 0.0, "panel");
    let [mirror, image] = [false, true].map(|image| mirrored(lambertian(0.6, 0.3), image, EstimateKind::Point));
    let (truth, error) = values(&run(&image, &light_tracing(&image, 8_192, 3), 24).grids[0]);
    assert_grid(&run(&mirror, &sppm(&mirror, &quick_sppm(), 4), 48), &truth, &error, 4.5, 0.0, "points");
}

/// An eye that looks into the mirror sees what it would see in the room of twice the length.
#[test]
fn an_eye_sees_the_image_in_a_mirror() {
    let tubes = |image| mirrored(lambertian(0.6, 0.3), image, EstimateKind::Point);
    let panels = |image| mirrored_panel(image, EstimateKind::Point);
    for scene in [&tubes as &dyn Fn(bool) -> Scene, &panels] {
        let films = [false, true].map(|image| {
            let mut scene = scene(image);
            scene.grids = Vec::new();
            let (eye, target) = (DVec3::new(0.3, 0.4, 1.1), DVec3::new(2.0, 1.2, 1.2));
            scene.views = vec![View::new("view".into(), eye, target, DVec3::Z, 1.0, [24, 16]).unwrap()];
            run(&scene, &sppm(&scene, &quick_sppm(), 6 + u64::from(image)), 64).views.remove(0)
        });
        for block in 0..films[0].blocks.len() {
            let [(a, error_a), (b, error_b)] =
                films.each_ref().map(|film| (film.blocks[block].mean, film.block_standard_error_cd_m2(block)));
            println!("{a} +- {error_a}, {b} +- {error_b}");
            assert!((a - b).abs() < 4.5 * error_a.hypot(error_b) && error_a < 0.15 * a, "block {block}");
        }
    }
}

/// The disc alone in a black room, seen in a glossy wall: L = integral of L_disc times BRDF times cosine over the disc; the
/// disc Lambertian, and a table of the same.
#[test]
fn an_eye_sees_the_disc_in_a_glossy_wall() {
    for (roughness, measured) in [(0.3, false), (0.6, false), (1.0, false), (0.6, true)] {
        let mut scene = disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point);
        scene.room.surfaces[Face::East as usize] = Some(specular(0.0, 0.7, roughness));
        scene.grids = Vec::new();
        if measured {
            let ends = [0.0, FRAC_PI_2];
            let table = MeasuredDiffuser::new(&ends, &ends, &[vec![0.1 / PI; 2], vec![0.1 / PI; 2]], None).unwrap();
            scene.tubes[0].diffuser = Diffuser::Measured(Arc::new(table));
        }
        let side = scene.room.size.x;
        let (eye, target) = (DVec3::new(0.9, 0.8, 0.8), DVec3::new(side, 1.1, 1.3));
        let view = View::new("view".into(), eye, target, DVec3::Z, 0.1, [8, 8]).unwrap();
        let n = 32;
        let points = || (0..n * n).map(|k| [((k % n) as f64 + 0.5) / n as f64, ((k / n) as f64 + 0.5) / n as f64]);
        let lobe = Glossy::new(roughness);
        let disc_luminance = 1000.0 / (PI * PI * RADIUS * RADIUS);
        let mut truth = 0.0;
        for [x, y] in (0..64).map(|k| [f64::from(k % 8) + 0.5, f64::from(k / 8) + 0.5]) {
            let direction = view.ray_direction(x, y);
            let wall = eye + direction * ((side - eye.x) / direction.x);
            for point in points() {
                let on_disc = (warp::disc(point) * RADIUS + DVec2::splat(0.5 * side)).extend(side);
                let way = on_disc - wall;
                let solid_angle = PI * RADIUS * RADIUS * way.z / way.length().powi(3);
                truth += lobe.density(DVec3::NEG_X, -direction, way.normalize()) * solid_angle;
            }
        }
        truth *= 0.7 * disc_luminance / (64 * n * n) as f64;
        scene.views = vec![view];
        let estimate = run(&scene, &sppm(&scene, &Settings { photons_per_pass: 4096, ..quick_sppm() }, 3), 512);
        let film = &estimate.views[0];
        let error = film.block_standard_error_cd_m2(0);
        println!("{roughness}: {} +- {error}, {truth}", film.blocks[0].mean);
        // the photons on the disc are stratified well below their shares of 2 %
        assert!((film.blocks[0].mean - truth).abs() < 4.0 * error, "{roughness}");
        assert!(error < 0.1 * truth);
    }
}

/// Colours: two parts of different hues split the light, and the ledger still closes; the channels are independent.
#[test]
fn colours_are_independent() {
    let coloured = |diffuse: [f64; 3], reflectance: [f64; 3]| {
        let mut scene = room_with(Surface::diffuse([0.0; 3]), 2, EstimateKind::CellAverage);
        let specular = Specular { reflectance, roughness: 0.4 };
        let surface = Some(Surface { reflectance: diffuse, specular: Some(specular) });
        scene.room.surfaces = [surface; 6];
        scene
    };
    let mut scene = coloured([0.5, 0.1, 0.3], [0.1, 0.6, 0.3]);
    scene.channels = Channels::Rgb;
    let kernel = kernel(&scene);
    let settings = skyduct::integrator::light_tracing::Settings { photons_per_pass: 16_384 };
    let method = skyduct::integrator::light_tracing::LightTracing::<3>::new(kernel, &scene.grids, &settings, 1);
    let all = run(&scene, &method, 32);
    assert!(all.ledger.relative_closure_error().abs() < 1e-9, "{:?}", all.ledger);
    let (lux, error) = values(&all.grids[0]);
    let (mut truth, mut truth_error) = (vec![0.0; 4], vec![0.0f64; 4]);
    for (weight, diffuse, reflectance) in [(0.2126, 0.5, 0.1), (0.7152, 0.1, 0.6), (0.0722, 0.3, 0.3)] {
        let channel = coloured([diffuse; 3], [reflectance; 3]);
        let (lux, error) = values(&run(&channel, &light_tracing(&channel, 16_384, 2), 32).grids[0]);
        for cell in 0..4 {
            truth[cell] += weight * lux[cell];
            truth_error[cell] += weight * error[cell];
        }
    }
    for cell in 0..4 {
        let tolerance = 4.5 * error[cell].hypot(truth_error[cell]);
        assert!((lux[cell] - truth[cell]).abs() < tolerance, "{} {} +- {tolerance}", lux[cell], truth[cell]);
    }
}

/// Narrow lobes are mirrors to all that is measured: cell averages of roughness 0.02 against 0.
#[test]
fn a_narrow_lobe_is_a_mirror() {
    let [truth, narrow] = [0.0, 0.02].map(|roughness| {
        let scene = room_with(specular(0.0, 0.8, roughness), 4, EstimateKind::CellAverage);
        run(&scene, &light_tracing(&scene, 16_384, 7 + u64::from(roughness > 0.0)), 24)
    });
    let (lux, error) = values(&truth.grids[0]);
    assert_grid(&narrow, &lux, &error, 4.5, 0.0, "narrow");
}

/// A ray along -x that meets the face of a turned box at 45 degrees goes on along y.
#[test]
fn a_turned_mirror_box_reflects() {
    let mut scene = disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::CellAverage);
    scene.room.boxes.push(BoxObject {
        size: DVec3::new(0.5, 0.5, 1.2),
        base: DVec3::new(0.6, 1.016, 0.0),
        rotation: std::f64::consts::FRAC_PI_4,
        surface: specular(0.0, PERFECT, 0.0),
    });
    let kernel = kernel(&scene);
    let hit = kernel.intersect(DVec3::new(1.9, 1.1, 0.5), DVec3::NEG_X, None);
    let specular = kernel.optics(kernel.numbering.box_face(0, 0)).unwrap().specular.as_ref().unwrap();
    let onward = specular.reflect(hit.normal, DVec3::X, [0.0; 2], &mut skyduct::sampling::PathRandom::new(Key::new(0)));
    // the face toward north-east, seen from the east at 45 degrees, sends the ray north
    assert!((onward - DVec3::Y).length() < 1e-12, "{onward} {hit:?}");
    assert!((hit.normal.truncate().angle_to(onward.truncate()).abs() - 0.5 * FRAC_PI_2).abs() < 1e-12);
}

/// Scene S1 with a floor, a grid of points and perhaps effects.
fn document(floor: Value, effects: Value) -> Result<ValidJob, DocumentErrors> {
    document_by("auto", floor, effects)
}

fn document_by(method: &str, floor: Value, effects: Value) -> Result<ValidJob, DocumentErrors> {
    let mut document = reference::json("scenes/S1.json");
    document["room"]["surfaces"]["floor"] = floor;
    document["effects"] = effects;
    document["method"] = method.into();
    document["grids"][0]["estimate"] = "point".into();
    JobDocument::parse(document.to_string().as_bytes())
}

#[test]
fn specular_bounds_name_their_field() {
    let floor =
        |specular: Value, roughness: Value| json!({ "reflectance": 0.3, "specular": specular, "roughness": roughness });
    let cases = [
        (floor(json!(0.7), json!(0)), "specular", "reflectance + specular must be < 1, but is 1"),
        (floor(json!([0.1, 0.71, 0.1]), json!(0)), "specular", "must be < 1"),
        (floor(json!(-0.1), json!(0)), "specular", "within 0..1"),
        (floor(json!([0.1, 1.5, 0.1]), json!(0)), "specular/1", "within 0..1"),
        (floor(json!("shiny"), json!(0)), "specular", "invalid type"),
        (floor(json!(0.5), json!(0.01)), "roughness", "0 (a mirror) or within 0.02..1"),
        (floor(json!(0.5), json!(1.01)), "roughness", "within 0..1"),
        (json!({ "open": true, "specular": 0.5 }), "specular", "reflects nothing"),
    ];
    for (floor, field, detail) in cases {
        let errors = document(floor, json!({})).unwrap_err().0;
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert_eq!(errors[0].pointer, format!("/room/surfaces/floor/{field}"));
        assert!(errors[0].detail.contains(detail), "{}", errors[0].detail);
    }
    for good in [floor(json!(0.69), json!(0)), floor(json!(0), json!(0.5)), floor(json!([0, 0.6, 0.1]), json!(0.02))] {
        assert!(document(good, json!({})).is_ok());
    }
}

#[test]
fn documents_become_specular_surfaces() {
    let scene = |floor: Value| to_scene(&document(floor, json!({})).unwrap(), &Folder).unwrap().0;
    let mirror = scene(json!({ "reflectance": 0.1, "specular": 0.8 }));
    assert_eq!(mirror.room.surfaces[Face::Floor as usize], Some(specular(0.1, 0.8, 0.0)));
    assert_eq!(mirror.channels, Channels::Photopic);
    let coloured = scene(json!({ "reflectance": 0.1, "specular": [0.8, 0.7, 0.6], "roughness": 0.4 }));
    let lobe = Specular { reflectance: [0.8, 0.7, 0.6], roughness: 0.4 };
    assert_eq!(coloured.room.surfaces[Face::Floor as usize].unwrap().specular, Some(lobe));
    assert_eq!(coloured.channels, Channels::Rgb);
    let none = scene(json!({ "reflectance": 0.1, "specular": 0, "roughness": 0.4 }));
    assert_eq!(none.room.surfaces[Face::Floor as usize], Some(Surface::diffuse([0.1; 3])));
}

/// Points next to mirrors and narrow lobes are computed by photon mapping, with the reason; what is switched off counts
/// as black.
#[test]
fn the_plan_names_what_is_glossy() {
    let plan = |floor: Value, effects: Value| -> Prepared {
        prepare_document(&document(floor, effects).unwrap(), &Folder).unwrap()
    };
    let glossy =
        |prepared: &Prepared| prepared.plan.effects.list.iter().find(|e| e.kind == EffectKind::Glossy).cloned();
    let floor = |roughness: f64| json!({ "reflectance": 0.1, "specular": 0.5, "roughness": roughness });
    for (roughness, method, reason, effect) in [
        (0.0, "sppm", "mirror", "mirrors among the surfaces"),
        (0.1, "sppm", "rare and bright", "roughness 0.1"),
        (0.5, "light_tracing", "unbiased", "up to 50 %"),
    ] {
        let prepared = plan(floor(roughness), json!({}));
        let choice = prepared.plan.methods.grids.clone().unwrap();
        assert_eq!(choice.method.name(), method);
        assert!(choice.reason.contains(reason), "{}", choice.reason);
        let glossy = glossy(&prepared).unwrap();
        assert!(glossy.on && glossy.reason.contains(effect), "{glossy:?}");
    }
    let off = plan(floor(0.0), json!({ "glossy": "off" }));
    assert_eq!(off.plan.methods.grids.as_ref().unwrap().method.name(), "light_tracing");
    let effect = glossy(&off).unwrap();
    assert!(!effect.on && effect.bound.is_none() && effect.reason.contains("absorb"), "{effect:?}");
    let diffuse = glossy(&plan(json!({ "reflectance": 0.1 }), json!({}))).unwrap();
    assert!(!diffuse.on && diffuse.bound == Some(0.0));
    // the solvers without passes know diffuse faces only
    let holigilm = |effects: Value| {
        let document = document_by("holigilm", floor(0.5), effects).unwrap();
        refusal(&document).map(|refusal| refusal.code)
    };
    assert_eq!(holigilm(json!({})), Some(RefusalCode::SpecularSurfaces));
    assert_eq!(holigilm(json!({ "glossy": "off" })), None);
    // light tracing alone cannot
    let refused = document_by("light_tracing", floor(0.0), json!({})).unwrap();
    assert_eq!(refusal(&refused).unwrap().code, RefusalCode::MirrorsAtPoints);
    assert_eq!(prepare_document(&refused, &Folder).err().unwrap().0[0].pointer, "/method");
}

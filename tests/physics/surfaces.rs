//! Glossy and mirror surfaces in rooms: energy, agreement of methods, images of mirrors.

use crate::reference;
use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use crate::documents::{Folder, refusal};
use crate::scenes::{RADIUS, assert_grid, disc_room, light_tracing, run, specular, sppm, traceable, values};
use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::{DocumentErrors, FieldErrorCode, JobDocument, ValidJob, to_scene};
use skyduct::integrator::method::RefusalCode;
use skyduct::integrator::photon::emission::Emission;
use skyduct::integrator::photon::energy_balance::PhotonTotals;
use skyduct::integrator::photon::events::{Flight, Origin, Scattering, Visitor};
use skyduct::integrator::photon::path::trace;
use skyduct::integrator::sppm::Settings;
use skyduct::optics::{Diffuser, Glossy, MeasuredDiffuser, Spectrum, Specular, Surface};
use skyduct::plan::EffectKind;
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::sampling::{Key, PathSamples, warp};
use skyduct::scene::{BoxObject, Channels, EstimateKind, Face, Grid, Scene, View};
use skyduct::statistics::Moments;
use skyduct::traceable::SurfaceId;

/// Reflectance so close to 1 that a wall counts as a perfect mirror.
const PERFECT: f64 = 1.0 - 1e-7;

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
    scene.room.enclosure.paint_all([
        Some(glossy(0.0, 0.0)),
        Some(glossy(0.2, 0.0)),
        Some(glossy(0.1, 0.3)),
        Some(glossy(0.0, 1.0)),
        Some(glossy(0.25, 0.6)),
        Some(Surface::diffuse([0.5; 3])),
    ]);
    scene.room.boxes.push(BoxObject {
        size: DVec3::new(0.5, 0.7, 0.4),
        base: DVec3::new(0.7, 0.6, 0.0),
        rotation: 0.4,
        surface: glossy(0.0, 0.1),
    });
    let kernel = traceable(&scene);
    let emission = Emission::new(&kernel, 4096);
    let mut arrived = Moments::default();
    for pass in 0..16 {
        let mut flown = Flown::default();
        let mut totals = PhotonTotals::new(1);
        for number in 0..emission.photons() {
            let (photon, mut samples) = emission.photon(&kernel, Key::new(9).child(pass), number);
            trace::<1>(&kernel, &photon.unwrap(), &mut samples, &mut flown, &mut totals);
        }
        assert!(totals.energy.relative_closure_error().abs() < 1e-9, "{:?}", totals.energy);
        arrived.push(flown.0 / totals.tubes[0].into_room);
    }
    println!("{} +- {}", arrived.mean, arrived.standard_error());
    assert!((arrived.mean - 2.0).abs() < 4.0 * arrived.standard_error(), "{arrived:?}");
    assert!(arrived.standard_error() < 0.01);
}

/// The disc room with one special wall and a grid of `cells` x `cells` at 0.4 m, 0.2 m away from the walls.
fn room_with(east: Surface, cells: usize, estimate: EstimateKind) -> Scene {
    let mut scene = disc_room(0.3, 0.4, 0.6, 0.3, estimate);
    scene.room.enclosure.paint(Face::East as usize, Some(east));
    let side = scene.room.enclosure.extent().x;
    scene.grids = vec![Grid::new("grid".into(), 0.4, [cells, cells], 0.2, [side, side], estimate)];
    scene
}

/// The disc alone in a black room, seen in a glossy wall: L = integral of L_disc times BRDF times cosine over the disc; the
/// disc Lambertian, and a table of the same.
#[test]
fn an_eye_sees_the_disc_in_a_glossy_wall() {
    for (roughness, measured) in [(0.3, false), (0.6, false), (1.0, false), (0.6, true)] {
        let mut scene = disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point);
        scene.room.enclosure.paint(Face::East as usize, Some(specular(0.0, 0.7, roughness)));
        scene.grids = Vec::new();
        if measured {
            let ends = [0.0, FRAC_PI_2];
            let table = MeasuredDiffuser::new(&ends, &ends, &[vec![0.1 / PI; 2], vec![0.1 / PI; 2]], None).unwrap();
            scene.tubes[0].diffuser = Diffuser::Measured(Arc::new(table));
        }
        let side = scene.room.enclosure.extent().x;
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
        let settings = Settings { photons_per_pass: 4096, initial_radius_m: Some(0.1), ..Settings::default() };
        let estimate = run(&scene, &*sppm(&scene, &settings, 3), 96);
        let film = &estimate.views[0];
        let error = film.block_standard_error_cd_m2(0);
        println!("{roughness}: {} +- {error}, {truth}", film.blocks[0].mean);
        // the photons on the disc are stratified well below their shares of 2 %
        assert!((film.blocks[0].mean - truth).abs() < 4.0 * error, "{roughness}");
        assert!(error < 0.1 * truth);
    }
}

/// Colours: two parts of different hues split the light, and the energy balance still closes; the channels are independent.
#[test]
fn colours_are_independent() {
    let coloured = |diffuse: [f64; 3], reflectance: [f64; 3]| {
        let mut scene = room_with(Surface::diffuse([0.0; 3]), 2, EstimateKind::CellAverage);
        let specular = Specular { reflectance, roughness: 0.4 };
        let surface = Some(Surface { reflectance: diffuse, specular: Some(specular) });
        scene.room.enclosure.paint_all([surface; 6]);
        scene
    };
    let mut scene = coloured([0.5, 0.1, 0.3], [0.1, 0.6, 0.3]);
    scene.channels = Channels::Rgb;
    let all = run(&scene, &*light_tracing(&scene, 8192, 1), 32);
    assert!(all.energy.relative_closure_error().abs() < 1e-9, "{:?}", all.energy);
    let (lux, error) = values(&all);
    let (mut truth, mut truth_error) = (vec![0.0; 4], vec![0.0f64; 4]);
    for (weight, diffuse, reflectance) in [(0.2126, 0.5, 0.1), (0.7152, 0.1, 0.6), (0.0722, 0.3, 0.3)] {
        let channel = coloured([diffuse; 3], [reflectance; 3]);
        let (lux, error) = values(&run(&channel, &*light_tracing(&channel, 8192, 2), 32));
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
        run(&scene, &*light_tracing(&scene, 16_384, 7 + u64::from(roughness > 0.0)), 24)
    });
    let (lux, error) = values(&truth);
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
    let kernel = traceable(&scene);
    let hit = kernel.intersect(DVec3::new(1.9, 1.1, 0.5), DVec3::NEG_X, None);
    let optics = kernel.optics(kernel.numbering.box_face(0, 0)).unwrap();
    let mut random = skyduct::sampling::PathRandom::new(Key::new(0));
    let onward = optics.reflect(hit.normal, DVec3::X, [0.0; 2], &mut random).unwrap();
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
        (floor(json!(0.7), json!(0)), "specular", FieldErrorCode::Invalid),
        (floor(json!([0.1, 0.71, 0.1]), json!(0)), "specular", FieldErrorCode::Invalid),
        (floor(json!(-0.1), json!(0)), "specular", FieldErrorCode::OutOfRange),
        (floor(json!([0.1, 1.5, 0.1]), json!(0)), "specular/1", FieldErrorCode::OutOfRange),
        (floor(json!("shiny"), json!(0)), "specular", FieldErrorCode::Invalid),
        (floor(json!(0.5), json!(0.01)), "roughness", FieldErrorCode::Invalid),
        (floor(json!(0.5), json!(1.01)), "roughness", FieldErrorCode::OutOfRange),
        (json!({ "open": true, "specular": 0.5 }), "specular", FieldErrorCode::Invalid),
    ];
    for (floor, field, code) in cases {
        let errors = document(floor, json!({})).unwrap_err().0;
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert_eq!((&errors[0].pointer, errors[0].code), (&format!("/room/surfaces/floor/{field}"), code));
    }
    for good in [floor(json!(0.69), json!(0)), floor(json!(0), json!(0.5)), floor(json!([0, 0.6, 0.1]), json!(0.02))] {
        assert!(document(good, json!({})).is_ok());
    }
}

#[test]
fn documents_become_specular_surfaces() {
    let scene = |floor: Value| to_scene(&document(floor, json!({})).unwrap(), &Folder).unwrap().0;
    let mirror = scene(json!({ "reflectance": 0.1, "specular": 0.8 }));
    assert_eq!(mirror.room.enclosure.faces()[Face::Floor as usize].surface, Some(specular(0.1, 0.8, 0.0)));
    assert_eq!(mirror.channels, Channels::Photopic);
    let coloured = scene(json!({ "reflectance": 0.1, "specular": [0.8, 0.7, 0.6], "roughness": 0.4 }));
    let lobe = Specular { reflectance: [0.8, 0.7, 0.6], roughness: 0.4 };
    assert_eq!(coloured.room.enclosure.faces()[Face::Floor as usize].surface.unwrap().specular, Some(lobe));
    assert_eq!(coloured.channels, Channels::Rgb);
    let none = scene(json!({ "reflectance": 0.1, "specular": 0, "roughness": 0.4 }));
    assert_eq!(none.room.enclosure.faces()[Face::Floor as usize].surface, Some(Surface::diffuse([0.1; 3])));
}

/// Points next to mirrors and lobes are computed by two stages, with the reason; what is switched off counts as black.
#[test]
fn the_plan_names_what_is_glossy() {
    let plan = |floor: Value, effects: Value| -> Prepared {
        prepare_document(&document(floor, effects).unwrap(), &Folder).unwrap()
    };
    let glossy =
        |prepared: &Prepared| prepared.plan.effects.list.iter().find(|e| e.kind == EffectKind::Glossy).cloned();
    let floor = |roughness: f64| json!({ "reflectance": 0.1, "specular": 0.5, "roughness": roughness });
    for (roughness, effect) in [(0.0, "mirrors among the surfaces"), (0.1, "roughness 0.1"), (0.5, "up to 50 %")] {
        let prepared = plan(floor(roughness), json!({}));
        assert_eq!(prepared.plan.methods.names(), ["two_stage"]);
        let glossy = glossy(&prepared).unwrap();
        assert!(glossy.on && glossy.reason.contains(effect), "{glossy:?}");
    }
    let off = plan(floor(0.0), json!({ "glossy": "off" }));
    assert_eq!(off.plan.methods.grids.as_ref().unwrap().method.name(), "two_stage");
    let effect = glossy(&off).unwrap();
    assert!(!effect.on && effect.called_for, "{effect:?}");
    // half of the light is mirrored once at the most, and seven tenths go on at the brightest surface
    // (docs/physics/left_out.md, reflections)
    let bound = 0.5 / (0.5 + 1.0 - 0.7);
    assert!((effect.bound.unwrap() - bound).abs() < 1e-12, "{effect:?}");
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

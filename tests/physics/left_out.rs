//! Effects that are switched off: what is missing is what the plan says of it. Effects that are on in vain: the same bits.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use serde_json::json;
use skyduct::engine::checkpoint::encode;
use skyduct::guide::performance;
use skyduct::integrator::method::{Computation, Described as _, Task};
use skyduct::integrator::{Pass, light_tracing};
use skyduct::optics::Surface;
use skyduct::plan::left_out::left_out;
use skyduct::plan::{self, EffectKind, EffectRequest, Effects};
use skyduct::sampling::Key;
use skyduct::scene::{EstimateKind, Luminaire, Scene, Tube};
use skyduct::sky::{Sun, direction};
use skyduct::statistics::Moments;

use crate::documents::{first_passes, prepare};
use crate::scenes::{RADIUS, SIDE, bent, clear, cube, daylight, domed, lambertian, specular, straight, traceable};

/// Deviations beyond this many standard errors fail: each with a probability of 3e-5 by chance, of some 20 comparisons here.
const SIGMAS: f64 = 4.0;

/// Passes of light tracing, each by itself, without the effects in `without`.
fn passes(scene: &Scene, without: &[EffectKind]) -> Vec<Pass> {
    let requests: BTreeMap<_, _> = without.iter().map(|kind| (*kind, EffectRequest::Off)).collect();
    let traceable = Arc::new(plan::compile(scene, &Effects::of(scene, &requests)).unwrap());
    let settings = light_tracing::Settings { photons_per_pass: Some(4096) };
    let Computation::Passes(method) = settings.build(&Task::whole(scene, &traceable), 7, 0.01) else {
        panic!("light tracing has passes")
    };
    let pass = |pass| method.pass_after(pass, &Default::default(), &AtomicBool::new(false)).unwrap();
    (0..16).map(pass).collect()
}

fn moments(values: impl Iterator<Item = f64>) -> Moments {
    let mut moments = Moments::default();
    values.for_each(|value| moments.push(value));
    moments
}

/// The share of `part` in `whole`, with its standard error to first order.
fn share(part: &Moments, whole: &Moments) -> (f64, f64) {
    let share = part.mean / whole.mean;
    (share, part.standard_error().hypot(share * whole.standard_error()) / whole.mean)
}

/// The share of the light on the surfaces, all with the same albedos, that an effect adds, with its standard error.
fn added(scene: &Scene, kind: EffectKind) -> (f64, f64) {
    let surface = scene.room.enclosure.faces()[0].surface.unwrap();
    let albedo = |without: &[EffectKind]| match without {
        [EffectKind::Interreflection] => 0.0,
        [EffectKind::Glossy] => surface.reflectance[0],
        _ => surface.albedo()[0],
    };
    // of what falls on them, surfaces keep a share of one minus their albedo
    let falls = |without: &[EffectKind]| {
        let passes = passes(scene, without);
        moments(passes.iter().map(|pass| pass.totals.energy.room / (1.0 - albedo(without))))
    };
    let (with, without) = (falls(&[]), falls(&[kind]));
    let (kept, error) = share(&without, &with);
    (1.0 - kept, error)
}

fn room(tubes: Vec<Tube>, surface: Surface) -> Scene {
    let mut scene = cube(0.0, 0.0, 0.0, tubes, daylight(12, 5000.0, 35.0, 45.0), EstimateKind::CellAverage);
    scene.room.enclosure.paint_all([Some(surface); 6]);
    scene
}

/// In a room of equal surfaces the bound is the share itself, but for what goes out through the opening: of the light from a point at
/// least d from its centre at most (r/d)^2.
#[test]
fn reflections_are_bounded_and_the_bound_is_near() {
    let through_opening = (RADIUS / (0.5 * SIDE)).powi(2);
    for (surface, kind) in [
        (Surface::diffuse([0.3; 3]), EffectKind::Interreflection),
        (Surface::diffuse([0.8; 3]), EffectKind::Interreflection),
        (specular(0.4, 0.3, 0.5), EffectKind::Interreflection),
        (specular(0.4, 0.3, 0.5), EffectKind::Glossy),
    ] {
        let scene = room(vec![straight(1.0, 0.98, lambertian(0.6, 0.0))], surface);
        let told = left_out(&scene, &traceable(&scene).tubes, kind);
        let (found, error) = added(&scene, kind);
        println!("{kind:?}: {told:?}, found {found:.4} +- {error:.4}");
        let (about, most) = (told.about.unwrap(), told.at_most.unwrap());
        assert!((about - most).abs() < 1e-12);
        assert!(found < most + SIGMAS * error);
        if surface.specular.is_none() {
            assert!(found > most * (1.0 - through_opening) - SIGMAS * error);
        }
    }
}

#[test]
fn light_that_tubes_return_is_bounded() {
    for (name, tube) in [
        ("bent", bent(lambertian(0.5, 0.4))),
        ("bent and bright", bent(lambertian(0.1, 0.9))),
        ("bent and clear", bent(clear())),
        ("domed", domed(lambertian(0.6, 0.2))),
    ] {
        let scene = room(vec![tube], Surface::diffuse([0.6; 3]));
        let most = left_out(&scene, &traceable(&scene).tubes, EffectKind::GuideReturn).at_most.unwrap();
        let (found, error) = added(&scene, EffectKind::GuideReturn);
        println!("{name}: at most {most:.5}, found {found:.5} +- {error:.5}");
        assert!(most < 1.0 && found < most + SIGMAS * error, "{name}");
    }
}

/// Sun, sky and a luminaire, each against the flux that light tracing finds.
#[test]
fn shares_of_sources_are_those_of_their_flux() {
    let toward_sun = direction(35f64.to_radians(), 45f64.to_radians());
    let sun = Sun { direction: toward_sun, normal_illuminance_lux: 30_000.0 };
    let panel = Luminaire {
        corner: glam::DVec3::new(0.2, 0.2, SIDE),
        edge_u: glam::DVec3::Y * 0.3,
        edge_v: glam::DVec3::X * 0.3,
        luminance: [500.0; 3],
    };
    for tube in [straight(1.0, 0.98, lambertian(0.6, 0.0)), bent(lambertian(0.6, 0.0))] {
        let mut scene = room(vec![tube], Surface::diffuse([0.5; 3]));
        scene.daylight.as_mut().unwrap().sun = Some(sun);
        scene.room.luminaires.push(panel);
        let tubes = &traceable(&scene).tubes;
        // what the plan's few rays leave open
        let sky = scene.daylight.as_ref().unwrap().sky.clone().unwrap();
        let [by_sky, by_sun] = [
            performance::sky(&tubes[0].guide, &sky, Key::new(0), 64).arriving(),
            performance::beam(&tubes[0].guide, toward_sun, Key::new(0), 64).arriving(),
        ];
        let told_error = by_sky.standard_error().hypot(sun.normal_illuminance_lux * by_sun.standard_error())
            / (by_sky.mean + sun.normal_illuminance_lux * by_sun.mean);
        let flux = |without: EffectKind| {
            let passes = passes(&scene, &[without, EffectKind::GuideReturn]);
            moments(passes.iter().map(|pass| pass.totals.tubes[0].into_room + pass.totals.energy.luminaires))
        };
        let sources = [EffectKind::Sky, EffectKind::Sun, EffectKind::Luminaires];
        let [no_sky, no_sun, no_panel] = sources.map(flux);
        // each is missing in one of three
        let all = 0.5 * (no_sky.mean + no_sun.mean + no_panel.mean);
        for (kind, without) in sources.into_iter().zip([no_sky, no_sun, no_panel]) {
            let told = left_out(&scene, tubes, kind);
            let found = 1.0 - without.mean / all;
            let error = without.standard_error().hypot(no_sky.standard_error()).hypot(no_sun.standard_error()) / all;
            println!("{kind:?}: {told:?}, found {found:.4} +- {error:.4}, rays {told_error:.4}");
            assert!((told.about.unwrap() - found).abs() < SIGMAS * error.hypot(told_error), "{kind:?}");
            assert!(told.at_most.is_none_or(|most| found < most + SIGMAS * error), "{kind:?}");
        }
        scene.room.luminaires.clear();
        scene.daylight.as_mut().unwrap().sky = None;
        assert_eq!(left_out(&scene, tubes, EffectKind::Sun).at_most, Some(1.0));
    }
}

/// Makes of S1 (a straight tube with a Lambertian sheet, no beam, an empty matt room, one channel) a scene that does not call for an
/// effect, where it does.
fn does_not_call_for(kind: EffectKind, document: &mut serde_json::Value) {
    match kind {
        EffectKind::Interreflection => {
            let black = json!({ "reflectance": 0 });
            document["room"]["surfaces"] = json!({ "floor": black, "walls": black, "ceiling": black });
        }
        EffectKind::Sky => {
            document.as_object_mut().unwrap().remove("sky");
            document["tubes"] = json!([]);
            document["room"]["luminaires"] = json!([{ "kind": "rectangle", "corner_m": [0.2, 0.2, 2.0],
                "edge_u_m": [0, 0.4, 0], "edge_v_m": [0.4, 0, 0], "luminance_cd_m2": 1000 }]);
        }
        _ => {}
    }
}

#[test]
fn effects_that_are_on_in_vain_change_no_bit() {
    let methods = ["auto", "light_tracing", "path_tracing", "bidirectional_path_tracing", "photon_mapping", "sppm"];
    for kind in EffectKind::ALL {
        for method in methods {
            let with = |effects: serde_json::Value| {
                let prepared = prepare("S1", |document| {
                    does_not_call_for(kind, document);
                    document["grids"] = json!([{ "name": "points", "height_m": 0.5, "cells": [3, 2] }]);
                    if method != "light_tracing" {
                        document["views"] = json!([{ "name": "room", "eye_m": [1.9, 0.1, 0.3],
                            "look_at_m": [0.9, 1.2, 1.3], "vertical_fov_deg": 90, "size_px": [8, 6] }]);
                    }
                    document["method"] = match method {
                        "auto" => json!("auto"),
                        "path_tracing" => json!({ "kind": method }),
                        _ => json!({ "kind": method, "photons_per_pass": 256 }),
                    };
                    document["stop"] = json!({ "relative_error": 0.05, "max_passes": 2 });
                    document["effects"] = effects;
                });
                let mut estimate = first_passes(&prepared, 8);
                // rays that look for what is not there count as rays
                estimate.rays = 0;
                (prepared, encode(&estimate))
            };
            let (auto, on) = (with(json!({})), with(json!({ kind.name(): "on" })));
            let [of_auto, of_on] = [&auto, &on].map(|(prepared, _)| {
                prepared.plan.effects.list.iter().find(|effect| effect.kind == kind).unwrap().clone()
            });
            assert!(!of_auto.called_for && !of_auto.on && of_auto.bound == Some(0.0), "{of_auto:?}");
            assert_eq!(of_on.on, kind.can_be_followed_in_vain(), "{of_on:?}");
            assert_eq!(auto.0.method_names(), on.0.method_names());
            assert!(auto.1 == on.1, "{kind:?} by {method}: other bits");
        }
    }
}

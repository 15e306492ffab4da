//! Copies of one mesh that is kept once, against objects of their own at the same places.

use std::sync::Arc;

use glam::DVec3;
use serde_json::{Value, json};
use skyduct::document::{FileSource, JobDocument, to_scene};
use skyduct::geometry::TriangleMesh;
use skyduct::geometry::obj::{ObjLimits, parse_obj};
use skyduct::integrator::{bidirectional, path_tracing, photon_mapping, ppm, two_stage};
use skyduct::plan::{self, EffectRequests, Effects};
use skyduct::sampling::{Key, PathRandom};
use skyduct::scene::Scene;
use skyduct::traceable::{Place, TraceableScene};

use crate::scenes::{self, assert_grid, built, light_tracing, values};

/// A stool: a closed block of 0.4 m x 0.3 m x 0.45 m, and a leaf above it that leans.
struct Stool;

impl FileSource for Stool {
    fn load(&self, _: &str) -> Result<Arc<TriangleMesh>, String> {
        let corner = |k: usize| {
            let [x, y, z] = [k & 1, k >> 1 & 1, k >> 2].map(|side| side as f64);
            format!("v {} {} {}\n", 0.4 * x - 0.2, 0.3 * y - 0.15, 0.45 * z)
        };
        let faces = "usemtl wood\nf 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
        let leaf = "v -0.2 0.15 0.5\nv 0.2 0.15 0.5\nv 0.2 0.25 0.9\nv -0.2 0.25 0.9\nusemtl leaf\nf 9 10 11 12\n";
        let text = (0..8).map(corner).collect::<String>() + faces + leaf;
        // corners of the leaf come after those of the block
        parse_obj(text.as_bytes(), ObjLimits::default()).map(Arc::new).map_err(|error| error.to_string())
    }
}

const PLACES: [([f64; 3], f64); 3] = [([0.8, 0.7, 0.0], 20.0), ([2.1, 0.9, 0.0], -75.0), ([1.4, 1.9, 0.0], 190.0)];

/// A room with three stools, as instances or as objects.
fn room(instances: bool) -> Scene {
    let stool = json!({ "kind": "mesh", "mesh": "stool", "unit": "m",
                        "surfaces": { "wood": { "reflectance": 0.6 }, "leaf": { "reflectance": 0.8 } },
                        "back_surfaces": { "leaf": { "reflectance": 0.1 } } });
    let place = |(position, turn): ([f64; 3], f64)| json!({ "position_m": position, "rotation_deg": turn });
    let with = |fields: Value| {
        let mut object = stool.clone();
        object.as_object_mut().unwrap().extend(fields.as_object().unwrap().clone());
        object
    };
    let objects = match instances {
        true => vec![with(json!({ "instances": PLACES.map(place) }))],
        false => PLACES.map(|at| with(place(at))).to_vec(),
    };
    let document = json!({
        "room": {
            "size_m": [3.0, 2.5, 2.2], "objects": objects,
            "luminaires": [{ "kind": "rectangle", "corner_m": [1.2, 0.9, 2.1], "edge_u_m": [0, 0.5, 0],
                             "edge_v_m": [0.6, 0, 0], "luminance_cd_m2": 3000 }]
        },
        "grids": [{ "name": "floor", "height_m": 0.1, "cells": [5, 4], "margin_m": 0.1 }]
    });
    let (mut scene, warnings, _) =
        to_scene(&JobDocument::parse(document.to_string().as_bytes()).unwrap(), &Stool).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let occupied = skyduct::traceable::OccupiedParts::of(&scene, &scene.grids[0]);
    scene.grids[0].free = Some(occupied.free.into());
    scene
}

fn traceable(scene: &Scene) -> Arc<TraceableScene> {
    Arc::new(plan::compile(scene, &Effects::of(scene, &EffectRequests::new())).unwrap())
}

/// The mesh is in memory once, and every copy takes what an object takes of a grid.
#[test]
fn instances_are_kept_once() {
    let [once, copies] = [room(true), room(false)];
    assert_eq!((once.room.meshes.len(), copies.room.meshes.len()), (1, 3));
    let kept = |scene: &Scene| scene.room.meshes.iter().map(|object| object.kept_triangles()).sum::<usize>();
    assert_eq!((kept(&once), kept(&copies)), (14, 42));
    assert_eq!(once.room.meshes[0].copied_triangles(), 42);
    let free = once.grids[0].free.as_ref().unwrap();
    assert_eq!(Some(free), copies.grids[0].free.as_ref());
    assert!(free.contains(&0.0) && free.contains(&1.0), "{free:?}");
}

/// Rays meet the same places, objects and sides, segments are blocked alike, and facets have the same areas and patches.
#[test]
fn rays_meet_instances_as_they_meet_copies() {
    let [once, copies] = [room(true), room(false)].map(|scene| traceable(&scene));
    assert_eq!(once.surfaces_count(), copies.surfaces_count());
    let mut random = PathRandom::new(Key::new(12));
    let (mut on_leaf, mut met, mut hidden) = (0, 0, 0);
    for _ in 0..20_000 {
        let mut point = || DVec3::new(random.uniform(), random.uniform(), random.uniform()) * DVec3::new(3.0, 2.5, 2.2);
        let (origin, target) = (point(), point());
        let direction = (target - origin).normalize();
        let [a, b] = [&once, &copies].map(|scene| scene.intersect(origin, direction, None));
        assert!((a.position - b.position).length() < 1e-12 && (a.normal - b.normal).length() < 1e-12, "{a:?} {b:?}");
        assert_eq!(once.visible(origin, None, target, None), copies.visible(origin, None, target, None));
        hidden += usize::from(!once.visible(origin, None, target, None));
        let (Place::Surface(a), Place::Surface(b)) = (a.place, b.place) else { panic!("no opening") };
        let reflectance = |scene: &TraceableScene, surface| scene.optics(surface).unwrap().reflectance[0];
        assert_eq!(reflectance(&once, a), reflectance(&copies, b));
        assert_eq!(once.object_of(a).is_some(), copies.object_of(b).is_some());
        let facets = [(&once, a), (&copies, b)].map(|(scene, surface)| {
            let meshes = scene.meshes.as_ref().unwrap();
            scene.numbering.facet_of(surface).map(|facet| meshes.area_m2(facet))
        });
        assert!(facets[0].is_some() == facets[1].is_some());
        if let [Some(a_m2), Some(b_m2)] = facets {
            assert!((a_m2 - b_m2).abs() < 1e-12);
            met += 1;
            on_leaf += usize::from([0.1, 0.8].contains(&reflectance(&once, a)));
        }
        let near = |scene: &TraceableScene| scene.meshes.as_ref().unwrap().horizontal_distance(origin, 1e-9, 0.3);
        assert!((near(&once).unwrap_or(1.0) - near(&copies).unwrap_or(1.0)).abs() < 1e-12);
    }
    assert!(met > 1500 && on_leaf > 200 && hidden > 1500, "{met} {on_leaf} {hidden}");
}

/// Photons fly the same ways, within rounding.
#[test]
fn photons_meet_instances_as_they_meet_copies() {
    let lux = |scene: &Scene| values(&scenes::run(scene, &*light_tracing(scene, 2048, 1), 2)).0;
    for (once, copy) in lux(&room(true)).iter().zip(&lux(&room(false))) {
        assert!((once - copy).abs() <= 1e-9 * copy, "{once} {copy}");
    }
}

/// Every other kind of method finds among instances what paths find among copies, within 4.5 standard errors.
#[test]
fn methods_agree_on_instances_and_copies() {
    let [once, copies] = [room(true), room(false)];
    let settings = path_tracing::Settings { samples_per_sensor: 1024, ..Default::default() };
    let (truth, error) = values(&scenes::run(&copies, &*built(&copies, &settings, 5), 32));
    let two_stage = two_stage::Settings { samples_per_sensor: Some(128), ..Default::default() };
    for (what, method) in [
        ("path_tracing", built(&once, &settings, 6)),
        ("two_stage", built(&once, &two_stage, 7)),
        ("bidirectional", built(&once, &bidirectional::Settings::default(), 8)),
        ("photon_mapping", built(&once, &photon_mapping::Settings::default(), 9)),
        ("ppm", built(&once, &ppm::Settings::default(), 10)),
    ] {
        assert_grid(&scenes::run(&once, &*method, 16), &truth, &error, 4.5, 0.0, what);
    }
}

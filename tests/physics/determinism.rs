//! Same input, same bits: on any number of threads, across a checkpoint, and where passes are computed ahead.

use std::time::Duration;

use crate::documents::{add_pass, prepare};
use serde_json::json;
use skyduct::engine::ahead::{RangeAhead, stored_outcomes};
use skyduct::engine::cancel::Stop;
use skyduct::engine::checkpoint::{decode, encode};
use skyduct::engine::spent::Spent;
use skyduct::estimate::stopping::Wanted;
use skyduct::integrator::photon_map::progressive::Carried;
use skyduct::present::prepared::Prepared;

/// The first passes on a pool of `threads`; through a checkpoint after each when `interrupted`.
fn bits(prepared: &Prepared, passes: u64, threads: usize, interrupted: bool) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    let mut merged = prepared.empty_estimate();
    for _ in 0..passes {
        pool.install(|| add_pass(prepared, &mut merged));
        if interrupted {
            merged = decode(prepared.empty_estimate(), &encode(&merged)).unwrap();
        }
    }
    encode(&merged)
}

/// The first pass, and then the two after it, which were computed ahead, stored and read: added in their order, and in the other one.
fn bits_ahead(prepared: &Prepared) -> [Vec<u8>; 2] {
    let stored = [1, 2].map(|pass| {
        let range = RangeAhead { passes: pass..pass + 1, wanted: Wanted::ALL };
        let outcomes = prepared.compute_ahead(&range, &Stop::default(), Duration::ZERO).unwrap();
        assert_eq!(outcomes.passes, range.passes);
        // by this the bytes of a range are bounded
        assert!(outcomes.bytes.len() <= encode(&prepared.empty_estimate()).len(), "{} bytes", outcomes.bytes.len());
        outcomes.bytes
    });
    [[0, 1], [1, 0]].map(|order| {
        let mut merged = prepared.empty_estimate();
        add_pass(prepared, &mut merged);
        for number in order {
            let (outcome, spent) = (stored_outcomes(stored[number].clone()).next(), &mut Spent::NOTHING.clone());
            prepared.add_pass((&mut merged, spent), outcome, &Stop::default(), &mut |_, _| {}).unwrap();
        }
        encode(&merged)
    })
}

/// Reference scenes and what is done to them.
const CASES: [&str; 15] = [
    "S1",
    "S2",
    "S3",
    "S3_mesh",
    "S4",
    "S1 glossy",
    "S2 glossy",
    "S3 paths",
    "S3 stages",
    "S2 fixed",
    "S1 ppm",
    "S2 sppm",
    "S2 gathering",
    "S1 parts",
    "S3 responses",
];

/// Every kind of guide, closure, luminaire, object and output, small.
fn scenes() -> Vec<(&'static str, Prepared)> {
    let view = json!([{ "name": "room", "eye_m": [1.9, 0.1, 0.3], "look_at_m": [0.9, 1.2, 1.3], "up": [0, 0, 1],
                        "vertical_fov_deg": 90, "size_px": [40, 24] }]);
    let grids = json!([{ "name": "points", "height_m": 0.5, "cells": [5, 4] },
                       { "name": "cells", "height_m": 0.0, "cells": [3, 3], "estimate": "cell_average" }]);
    let objects = json!([{ "kind": "box", "size_m": [0.5, 0.4, 0.3], "position_m": [0.6, 0.7, 0], "rotation_deg": 20,
                           "surface": { "reflectance": [0.3, 0.5, 0.4] } }]);
    let mesh = json!({ "kind": "mesh", "mesh": "block.obj", "unit": "cm", "position_m": [0.5, 0.4, 0], "rotation_deg": 5,
                       "surfaces": { "side": { "reflectance": 0.4 }, "top": { "reflectance": [0.2, 0.5, 0.7] } } });
    CASES
        .into_iter()
        .map(|case| {
            let (scene, kind) = case.split_once(' ').unwrap_or((case, ""));
            let glossy = matches!(kind, "glossy" | "gathering");
            let prepared = prepare(scene, |document| {
                document["views"] = view.clone();
                document["grids"] = grids.clone();
                document["stop"] = json!({ "relative_error": 1e-6, "max_passes": 12 });
                if kind == "paths" || kind == "stages" {
                    let kind = if kind == "paths" { "path_tracing" } else { "two_stage" };
                    document["room"]["objects"] = objects.clone();
                    document["sky"]["direct_normal_illuminance_lux"] = json!(50_000);
                    document["method"] = json!({ "kind": kind, "samples_per_sensor": 8 });
                }
                if scene == "S4" {
                    document["room"]["objects"][0] = mesh.clone();
                }
                if scene == "S2" {
                    document["room"]["objects"] = objects.clone();
                    document["method"] = json!({ "kind": "sppm", "photons_per_pass": 5000 });
                }
                if kind == "fixed" {
                    document["method"] = json!({ "kind": "ppm", "photons_per_pass": 5000 });
                }
                if kind == "ppm" || kind == "sppm" {
                    document["method"] = json!({ "kind": kind, "photons_per_pass": 5000, "radius": "per_point" });
                }
                if kind == "parts" {
                    document["grids"][0]["components"] = json!(true);
                    document["cross_check"] = json!(true);
                }
                if kind == "responses" {
                    document["room"]["objects"] = objects.clone();
                    document["grids"][0]["responses"] = json!(true);
                    document["stop"]["view_relative_error"] = json!(1e-6);
                }
                if kind == "gathering" {
                    document["method"] =
                        json!({ "kind": "photon_mapping", "photons_per_pass": 5000, "gather_rays": 8 });
                }
                if glossy {
                    // points are connected to this lobe
                    document["room"]["surfaces"]["walls"] = json!({ "reflectance": 0.1, "specular": [0.3, 0.4, 0.5],
                                                                    "roughness": 0.3 });
                }
                if glossy && scene == "S2" {
                    document["room"]["surfaces"]["wall_east"] = json!({ "reflectance": 0, "specular": 0.9 });
                }
            });
            (case, prepared)
        })
        .collect()
}

#[test]
fn bits_do_not_depend_on_threads_or_checkpoints() {
    for (scene, prepared) in scenes() {
        let calm = bits(&prepared, 3, 1, false);
        assert_eq!(calm, bits(&prepared, 3, 5, true), "{scene}: 5 threads, interrupted");
        assert_eq!(prepared.passes_are_independent(), !["S1 ppm", "S2 sppm"].contains(&scene), "{scene}");
        if prepared.passes_are_independent() {
            let [ahead, swapped] = bits_ahead(&prepared);
            assert_eq!(calm, ahead, "{scene}: ahead");
            assert_ne!(calm, swapped, "{scene}: what was computed ahead is not what is added");
        }
    }
}

/// Statistics of points go on from pass to pass, and through a checkpoint; radii have shrunk with what was found.
#[test]
fn statistics_of_points_go_on() {
    for (scene, prepared) in scenes().into_iter().filter(|(case, _)| case.ends_with("ppm")) {
        let mut merged = prepared.empty_estimate();
        let start = merged.carried.clone();
        let mut half = None;
        for _ in 0..2 {
            for _ in 0..8 {
                add_pass(&prepared, &mut merged);
            }
            merged = decode(prepared.empty_estimate(), &encode(&merged)).unwrap();
            half.get_or_insert_with(|| merged.carried.clone());
        }
        let points =
            |carried: &Carried| carried.grids.iter().chain(&carried.views).flatten().copied().collect::<Vec<_>>();
        let (start, half, end) = (points(&start), points(&half.unwrap()), points(&merged.carried));
        assert!(start.len() == half.len() && start.len() >= 20 + 9 + 960, "{scene}: {}", start.len());
        let mut shrunk = 0;
        for point in 0..start.len() {
            let [first, then, last] = [&start, &half, &end].map(|points| points[point]);
            assert!(first.photons == 0.0 && then.photons <= last.photons, "{scene}");
            assert!(first.radius_squared >= then.radius_squared && then.radius_squared >= last.radius_squared);
            shrunk +=
                usize::from(then.radius_squared > last.radius_squared && first.radius_squared > then.radius_squared);
        }
        assert!(2 * shrunk > start.len(), "{scene}: {shrunk} of {}", start.len());
    }
}

#[test]
fn seeds_are_different_streams() {
    let with_seed = |seed: u64| prepare("S1", |document| document["seed"] = seed.into());
    let first = bits(&with_seed(0), 4, 2, false);
    assert_ne!(first, bits(&with_seed(u64::MAX), 4, 2, false));
    assert_eq!(first, bits(&with_seed(0), 4, 2, false));
}

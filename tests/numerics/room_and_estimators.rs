//! Rooms that absorb everything or next to nothing, sums of very many small numbers, radii after very many passes, sensors that
//! no photon finds, and lights too bright for short floats.

use std::f64::consts::PI;
use std::io::Cursor;
use std::sync::atomic::AtomicBool;

use exr::prelude::{ReadChannels, ReadLayers};
use glam::DVec3;
use serde_json::json;
use skyduct::analytic::holigilm::Holigilm;
use skyduct::analytic::{Solution, Solver};
use skyduct::document::{FieldErrorCode, JobDocument};
use skyduct::engine::checkpoint::encode;
use skyduct::estimate::{EnergyBalance, Estimate};
use skyduct::integrator::deterministic::installation;
use skyduct::integrator::photon::chunks::MOST_CHUNK;
use skyduct::integrator::photon_map::progressive::{Radii, Radius};
use skyduct::integrator::sppm;
use skyduct::optics::Diffuser;
use skyduct::scene::{EstimateKind, Scene};
use skyduct::statistics::Moments;

use crate::given::{base, refused, with};
use crate::jobs::{cube, lux, prepared, rendered};
use crate::scenes::{self, SIDE, assert_grid, disc_room, light_tracing, radiosity, run, straight, traceable, values};

fn solved(scene: &Scene) -> Solution {
    let method = Holigilm::new(installation(&traceable(scene), &scene.grids), 1e-3, 0);
    method.solve(&AtomicBool::new(false)).unwrap()
}

/// A black room has the closed form of its disc, and all light of the disc ends on its faces but what the ceiling, in whose
/// plane it is, gets: nothing.
#[test]
fn a_black_room_has_direct_light_alone() {
    let scene = disc_room(0.0, 0.0, 0.0, 0.0, EstimateKind::Point);
    let solution = solved(&scene);
    let (centre, error) = (solution.grids[0].illuminance[40], solution.grids[0].error[40]);
    assert!((centre - 76.790_865_423_735).abs() < 4.0 * error && error < 1e-3 * centre, "{centre} +- {error}");
    let estimate = run(&scene, &*light_tracing(&scene, 16_384, 1), 32);
    let truth = radiosity("S0", EstimateKind::Point).0;
    assert_grid(&estimate, &truth, &[0.0; 81], 4.5, 0.0, "black room");
    let into_room: f64 = estimate.tubes[0].into_room.mean * 32.0;
    assert!((estimate.energy.room / into_room - 1.0).abs() < 1e-12);
}

/// Mean of all surfaces of a closed room of one reflectance, in lux, for 1000 lm.
fn furnace(reflectance: f64) -> f64 {
    1000.0 / (6.0 * SIDE * SIDE * (1.0 - reflectance))
}

/// Share of the light in a room that ends by being cut, and the mean of the floor in lux with its standard error.
fn traced(reflectance: f64, photons: u64, passes: u64) -> (f64, Moments) {
    let scene = disc_room(reflectance, reflectance, reflectance, reflectance, EstimateKind::CellAverage);
    let estimate = run(&scene, &*light_tracing(&scene, photons, 1), passes);
    assert!(estimate.energy.relative_closure_error().abs() < 1e-9);
    let into_room = estimate.tubes[0].into_room.mean * passes as f64;
    // what is absorbed by all, and leaves through the disc as if it was absorbed, is the furnace's mean
    let EnergyBalance { emitted, collector, guide, guide_top, diffuser, room, .. } = estimate.energy;
    let from_above = emitted - collector - guide - into_room;
    let mean = 1000.0 * (room + guide_top + diffuser - from_above) / into_room;
    let of_surfaces = mean / (6.0 * SIDE * SIDE * (1.0 - reflectance));
    println!("{reflectance}: mean of the surfaces {of_surfaces}, floor {:?}", estimate.grids[0].mean);
    assert!((of_surfaces / furnace(reflectance) - 1.0).abs() < 1e-8);
    (estimate.energy.cut.abs() / into_room, estimate.grids[0].mean)
}

/// White furnaces of 0.5 and 0.9: the means of all surfaces, and the floor against radiosity; the solver within its own error.
#[test]
fn white_furnaces_have_their_mean() {
    assert!((furnace(0.5) - 80.729_328).abs() < 5e-7 && (furnace(0.9) - 403.646_7).abs() < 1e-4);
    for (case, reflectance, floor) in [("S2r", 0.5, 95.5579), ("S3r", 0.9, 417.315)] {
        let (cut, mean) = traced(reflectance, 4096, 64);
        assert!((mean.mean - floor).abs() < 4.0 * mean.standard_error(), "{case}: {mean:?}");
        assert!(mean.standard_error() < 0.01 * floor && cut < 1e-9, "{cut}");
        let (truth, error) = radiosity(case, EstimateKind::Point);
        let solution = solved(&disc_room(reflectance, reflectance, reflectance, reflectance, EstimateKind::Point));
        let grid = &solution.grids[0];
        for (sensor, truth) in truth.into_iter().enumerate() {
            // the error that the solver estimates, or a thousandth where that is less
            let off = (grid.illuminance[sensor] - truth).abs();
            assert!(off <= (grid.error[sensor] + error * truth).max(1e-3 * truth), "{case} {sensor}: {off}");
        }
    }
}

/// A thousand reflections on average: a path that ended after 64 would leave 6.3 % of the light. The energy balance shows that
/// nothing is cut, and the floor has what radiosity gives it.
#[test]
fn a_thousand_reflections_are_followed() {
    assert!((furnace(0.999) - 40_364.7).abs() < 0.05);
    assert!((1.0 - 0.999f64.powi(65) - 0.063).abs() < 5e-4 && (0.9f64.powi(9) - 0.387).abs() < 5e-4);
    let (cut, mean) = traced(0.999, 256, 16);
    assert!(cut < 1e-9, "{cut}");
    let scene = disc_room(0.999, 0.999, 0.999, 0.999, EstimateKind::CellAverage);
    let solution = solved(&scene);
    let floor = solution.grids[0].illuminance.iter().sum::<f64>() / 81.0;
    assert!((floor / furnace(0.999) - 1.0).abs() < 0.01, "{floor}");
    assert!((mean.mean - floor).abs() < 4.0 * mean.standard_error() + 1e-3 * floor, "{floor} {mean:?}");
    assert!(mean.standard_error() < 0.1 * floor);
}

/// In a white room under an opening to a uniform sky of luminance L all light is in balance: it is pi L everywhere, and leaves
/// as it came. A document has no white surfaces: without the opening there would be no limit.
#[test]
fn a_white_room_with_an_opening_is_in_balance() {
    let tube = straight(1e-9, 1.0, Diffuser::Open);
    let mut scene =
        scenes::cube(1.0, 1.0, 1.0, vec![tube], scenes::daylight(5, 1000.0, 35.0, 0.0), EstimateKind::CellAverage);
    scene.grids.truncate(1);
    let estimate = run(&scene, &*light_tracing(&scene, 1024, 1), 16);
    let mean = estimate.grids[0].mean;
    assert!((mean.mean - PI * 1000.0).abs() < 4.0 * mean.standard_error(), "{mean:?}");
    assert!(mean.standard_error() < 0.05 * mean.mean);
    let EnergyBalance { emitted, guide_top, .. } = estimate.energy;
    assert!((guide_top / emitted - 1.0).abs() < 1e-9, "{guide_top} {emitted}");
    for surface in ["floor", "walls", "ceiling"] {
        let pointer = format!("/room/surfaces/{surface}/reflectance");
        refused(&with(base(), &pointer, json!(1)), &pointer, FieldErrorCode::Invalid);
    }
}

#[test]
fn reflectances_that_no_surface_has_are_refused() {
    let pointer = "/room/surfaces/floor/reflectance";
    for (value, code) in [
        (json!(1.2), FieldErrorCode::OutOfRange),
        (json!(-0.1), FieldErrorCode::OutOfRange),
        (json!(1), FieldErrorCode::Invalid),
        (json!("NaN"), FieldErrorCode::Invalid),
    ] {
        refused(&with(base(), pointer, value), pointer, code);
    }
    let text = with(base(), pointer, json!(0.125)).to_string().replace("0.125", "NaN");
    assert!(JobDocument::parse(text.as_bytes()).is_err());
    let almost = with(base(), pointer, json!(1f64.next_down()));
    assert!(JobDocument::parse(almost.to_string().as_bytes()).is_ok());
}

/// A thousand million deposits of 1e-6 lm are 1000 lm: photons are added up in f64 by chunks, chunks by passes, and passes by
/// jobs. One sum in f32 would stop at 32.
#[test]
fn a_thousand_million_deposits_add_up() {
    let deposit = 1e-6;
    let deposits = 1_000_000_000u64;
    let per_pass = 1 << 20;
    let (mut job, mut left) = (EnergyBalance::default(), deposits);
    // chunks of equally many photons have equal sums
    let chunk = |photons: u64| (0..photons).fold(0.0, |room, _| room + deposit);
    let whole_chunk = chunk(MOST_CHUNK);
    while left > 0 {
        let photons = per_pass.min(left);
        left -= photons;
        let mut pass = EnergyBalance::default();
        for first in (0..photons).step_by(MOST_CHUNK as usize) {
            let room = if photons - first < MOST_CHUNK { chunk(photons - first) } else { whole_chunk };
            pass.add(&EnergyBalance { room, ..EnergyBalance::default() });
        }
        job.add(&pass);
    }
    assert!((job.room - 1000.0).abs() < 1e-6, "{}", job.room);
    let mut single = 0f32;
    while single + deposit as f32 > single {
        single += deposit as f32;
    }
    assert_eq!(single, 32.0);
}

/// Photons are counted one by one beyond 2^24, where a count in f32 stays, and beyond 2^32.
#[test]
fn photons_are_counted_beyond_short_floats() {
    assert_eq!(16_777_216f32 + 1.0, 16_777_216.0);
    for photons in [1u64 << 24, 1 << 32, 1 << 53] {
        let mut all = Estimate { photons, ..Estimate::default() };
        all.push(Some(&skyduct::integrator::Pass { photons: 1, ..Default::default() }), None);
        assert_eq!(all.photons, photons + 1);
    }
    // replicates are counted in f64, whole up to 2^53
    let mut moments = Moments { count: 16_777_216.0, mean: 1.0, m2: 0.0 };
    moments.push(1.0);
    assert_eq!(moments.count, 16_777_217.0);
}

/// The schedule after a million passes, and after the most that a job may have, is what its product is: far from zero.
#[test]
fn radii_stay_after_a_million_passes() {
    for alpha in [0.8, 2.0 / 3.0, 1e-6, 1.0 - 1e-6] {
        let radii = Radii::new(Radius::Schedule, Some(0.3), alpha, DVec3::ONE);
        let (mut squared, mut checked) = (0.09, 0);
        for pass in 0..=1_000_000u64 {
            if pass % 100_000 == 0 {
                let radius = radii.scheduled(pass);
                assert!((radius / f64::sqrt(squared) - 1.0).abs() < 1e-8, "{alpha} {pass}: {radius}");
                checked += 1;
            }
            let before = pass as f64 + 1.0;
            squared *= (before + alpha) / (before + 1.0);
        }
        assert_eq!(checked, 11);
        let last = radii.scheduled(1_000_000_000);
        assert!(last.is_normal() && last > 0.3 * 1e-5 && last < radii.scheduled(1_000_000));
    }
}

/// Points that no photon finds: by radii of a tenth of a millimetre and 64 photons.
fn starved(radius: Radius) -> Estimate {
    let settings = sppm::Settings { photons_per_pass: 64, initial_radius_m: Some(1e-4), radius, ..Default::default() };
    let mut scene = disc_room(0.2, 0.5, 0.7, 0.7, EstimateKind::Point);
    scenes::resize(&mut scene, DVec3::new(40.0, 40.0, scenes::SIDE));
    run(&scene, &*scenes::sppm(&scene, &settings, 1), 4)
}

/// They have the light that does not need photons, finite, with counts of zero and the radius that they began with.
#[test]
fn points_without_photons_are_numbers() {
    for radius in [Radius::Schedule, Radius::PerPoint] {
        let estimate = starved(radius);
        let (lux, error) = values(&estimate);
        assert!(lux.iter().chain(&error).all(|value| value.is_finite() && *value >= 0.0));
        for point in estimate.carried.grids.iter().flatten() {
            assert!(point.photons == 0.0 && (point.radius_m() - 1e-4).abs() < 1e-18, "{point:?}");
        }
    }
}

/// What no photon has told is unknown: an interval that covers the truth is as wide as the light that may be missing.
#[test]
fn points_without_photons_have_wide_intervals() {
    let truth = radiosity("S1r", EstimateKind::Point).0;
    let settings = sppm::Settings { photons_per_pass: 64, initial_radius_m: Some(1e-4), ..Default::default() };
    let scene = disc_room(0.2, 0.5, 0.7, 0.7, EstimateKind::Point);
    let (lux, error) = values(&run(&scene, &*scenes::sppm(&scene, &settings, 1), 64));
    let covered = (0..81).filter(|sensor| (lux[*sensor] - truth[*sensor]).abs() <= 4.0 * error[*sensor]).count();
    assert!(covered >= 80, "{covered} of 81: {} +- {}, {}", lux[40], error[40], truth[40]);
}

/// Cells' centres lie inside of the room, whatever a document asks for: heights up to the ceiling, margins up to the middle,
/// and no grid without points; one point is a grid.
#[test]
fn sensors_stand_inside_the_room() {
    for (pointer, value, code) in [
        ("/grids/0/height_m", json!(2.032), FieldErrorCode::Invalid),
        ("/grids/0/height_m", json!(-1e-9), FieldErrorCode::Invalid),
        ("/grids/0/margin_m", json!(1.016), FieldErrorCode::Invalid),
        ("/grids/0/margin_m", json!(-0.1), FieldErrorCode::Invalid),
        ("/grids/0/cells", json!([0, 4]), FieldErrorCode::OutOfRange),
    ] {
        let at = if pointer == "/grids/0/cells" { "/grids/0/cells/0" } else { pointer };
        refused(&with(base(), pointer, value), at, code);
    }
    for (height, margin) in [(0.0, 0.0), (2.032f64.next_down(), 0.0), (0.0, 1.016f64.next_down()), (1e-300, 1e-300)] {
        let mut document = cube();
        document["grids"][0] = json!({ "name": "one", "height_m": height, "cells": [1, 1], "margin_m": margin });
        document["method"] = json!("auto");
        let (estimate, _) = rendered(&prepared(&document));
        assert!(lux(&estimate)[0] > 0.0, "{height} {margin}: {:?}", lux(&estimate));
    }
}

fn bits(prepared: &skyduct::present::prepared::Prepared, threads: usize) -> Vec<u8> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    encode(&pool.install(|| rendered(prepared)).0)
}

/// One seed gives the same bits on 1, 2 and 16 threads.
#[test]
fn sixteen_threads_change_no_bit() {
    for kind in ["light_tracing", "sppm"] {
        let prepared = prepared(&with(cube(), "/method/kind", json!(kind)));
        let one = bits(&prepared, 1);
        assert!(one == bits(&prepared, 2) && one == bits(&prepared, 16), "{kind}");
    }
}

/// Halves of a run of other seeds agree with it within errors, and the smallest and the largest seed are different streams.
#[test]
fn halves_of_a_run_agree_with_the_whole() {
    let scene = disc_room(0.2, 0.5, 0.7, 0.7, EstimateKind::Point);
    let whole = run(&scene, &*light_tracing(&scene, 1024, 3), 64);
    let others = [0, u64::MAX].map(|seed| values(&run(&scene, &*light_tracing(&scene, 1024, seed), 32)));
    assert_ne!(others[0].0, others[1].0);
    let mean: Vec<f64> = (0..81).map(|k| 0.5 * (others[0].0[k] + others[1].0[k])).collect();
    let error: Vec<f64> = (0..81).map(|k| 0.5 * others[0].1[k].hypot(others[1].1[k])).collect();
    // 81 sensors, which share photons: 4.5 standard errors
    assert_grid(&whole, &mean, &error, 4.5, 0.0, "halves of other seeds");
}

/// The sun's disc fills a view up a clear tube: 1.5e9 cd/m2 in every pixel of the EXR file, where half floats end at 65 504,
/// and a picture of it.
#[test]
fn the_sun_in_a_view_is_no_overflow() {
    let mut document = cube();
    document["sky"] = json!({ "cie_type": 12, "sun_position": { "altitude_deg": 90, "azimuth_deg": 0 },
                              "direct_normal_illuminance_lux": 130_000 });
    document["tubes"][0]["diffuser"] = json!({ "kind": "clear", "transmittance": 0.8 });
    document["views"] = json!([{ "name": "up", "eye_m": [1.016, 1.016, 0.2], "look_at_m": [1.016, 1.016, 1], "up": [0, 1, 0],
                                 "vertical_fov_deg": 0.2, "size_px": [4, 4] }]);
    document["grids"] = json!([]);
    document["method"] = json!({ "kind": "sppm", "photons_per_pass": 256 });
    let prepared = prepared(&document);
    let (estimate, _) = rendered(&prepared);
    let half_angle = (959.63f64 / 3600.0).to_radians();
    let sun = 0.8 * 130_000.0 / (PI * half_angle.sin().powi(2));
    let files = prepared.results(&estimate).files(|_| true).unwrap();
    let file = |suffix: &str| files.iter().find(|file| file.name.ends_with(suffix)).unwrap().bytes.clone();
    let image = exr::prelude::read().no_deep_data().largest_resolution_level().all_channels().first_valid_layer();
    let layer = image.all_attributes().non_parallel().from_buffered(Cursor::new(file(".exr"))).unwrap().layer_data;
    for channel in &layer.channel_data.list {
        let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
        assert!(values.iter().all(|value| value.is_finite()), "{}: {values:?}", channel.name);
        if channel.name.to_string() == "Y" {
            // the sky beside the disc's is some thousands of cd/m2
            assert!(values.iter().all(|value| (f64::from(*value) / sun - 1.0).abs() < 1e-4), "{values:?} {sun}");
        }
    }
    let mut png = png::Decoder::new(Cursor::new(file("up.png"))).read_info().unwrap();
    let mut pixels = vec![0; png.output_buffer_size().unwrap()];
    png.next_frame(&mut pixels).unwrap();
    // what is no number is drawn in magenta
    assert!(pixels.chunks(3).all(|pixel| pixel[0] == pixel[1] && pixel[1] == pixel[2]), "{pixels:?}");
}

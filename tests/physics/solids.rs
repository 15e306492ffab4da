//! Points and cells of grids inside solids: they have no value, and are in no statistic.

use glam::{DVec2, DVec3};
use serde_json::{Value, json};
use skyduct::document::{JobDocument, WarningCode};
use skyduct::optics::Surface;
use skyduct::present::prepared::{Prepared, prepare_document};
use skyduct::present::reader::ResultReader as _;
use skyduct::scene::{BoxObject, EstimateKind, Grid};
use skyduct::traceable::{OccupiedParts, RoomObject};

use crate::documents::{Folder, first_passes, prepare};
use crate::mesh_objects::closed_cube;
use crate::scenes::{cube, daylight, lambertian, straight};

/// Part of each sensor that two boxes in each other and a mesh leave free at a height, and who takes it.
fn occupied(height: f64, cells: [usize; 2], estimate: EstimateKind) -> (Grid, OccupiedParts) {
    let mut scene =
        cube(0.3, 0.5, 0.7, vec![straight(0.5, 0.9, lambertian(0.5, 0.1))], daylight(5, 1e3, 35.0, 0.0), estimate);
    let object = |x: f64, width: f64| BoxObject {
        size: DVec3::new(width, 1.0, 0.5),
        base: DVec3::new(x, 1.0, 0.0),
        rotation: 0.0,
        surface: Surface::diffuse([0.5; 3]),
    };
    scene.room.boxes = vec![object(0.5, 0.5), object(0.75, 0.5)];
    scene.room.meshes = vec![closed_cube(DVec3::new(1.5, 0.5, 0.0), 0.25)];
    let grid = Grid::new("grid".into(), height, cells, 0.0, [2.0, 2.0], estimate);
    let occupied = OccupiedParts::of(&scene, &grid);
    (grid, occupied)
}

/// Boxes from (0.25, 0.5) to (1, 1.5) and a cube of a quarter of a metre at (1.5, 0.5): points in them, on the sides, on top.
#[test]
fn points_in_solids_are_taken_and_those_on_them_are_not() {
    for (height, below_top, below_cube) in
        [(0.0, true, true), (0.2, true, true), (0.3, true, false), (0.5, false, false)]
    {
        let (grid, occupied) = occupied(height, [32, 32], EstimateKind::Point);
        for sensor in 0..occupied.free.len() {
            let DVec2 { x, y } = grid.centre(sensor).truncate();
            let in_boxes = below_top && x > 0.25 && x < 1.0 && y > 0.5 && y < 1.5;
            let in_cube = below_cube && x > 1.5 && x < 1.75 && y > 0.5 && y < 0.75;
            assert_eq!(occupied.free[sensor] == 0.0, in_boxes || in_cube, "{height} {x} {y}");
        }
        let mut by = vec![RoomObject::Box(0), RoomObject::Box(1), RoomObject::Mesh(0)];
        by.truncate(if below_cube {
            3
        } else if below_top {
            2
        } else {
            0
        });
        assert_eq!(occupied.by, by, "{height}");
    }
    // on the sides
    let (_, on_sides) = occupied(0.2, [4, 2], EstimateKind::Point);
    assert_eq!(on_sides, OccupiedParts::default());
}

/// Cells of 0.4 m, of which boxes together take rectangles.
#[test]
fn cells_know_which_part_of_them_is_free() {
    let (grid, occupied) = occupied(0.2, [5, 5], EstimateKind::CellAverage);
    let overlap = |centre: f64, low: f64, high: f64| ((centre + 0.2).min(high) - (centre - 0.2).max(low)).max(0.0);
    for (sensor, free) in occupied.free.iter().enumerate() {
        let DVec2 { x, y } = grid.centre(sensor).truncate();
        let covered = overlap(x, 0.25, 1.0) * overlap(y, 0.5, 1.5) + overlap(x, 1.5, 1.75) * overlap(y, 0.5, 0.75);
        assert!((1.0 - free - covered / 0.16).abs() < 1e-6, "{sensor}: {free} {}", covered / 0.16);
    }
    assert!(occupied.without_value() > 0 && occupied.partly() > 0, "{occupied:?}");
}

/// Half of S1's floor under a box.
fn half_covered(estimate: &str, cells: [usize; 2]) -> Prepared {
    prepare("S1", |document| {
        let [width, depth] = [0, 1].map(|axis| document["room"]["size_m"][axis].as_f64().unwrap());
        document["room"]["objects"] = json!([{ "kind": "box", "size_m": [0.5 * width, depth, 0.4],
            "position_m": [0.25 * width, 0.5 * depth, 0], "surface": { "reflectance": 0.3 } }]);
        document["grids"] = json!([{ "name": "g", "height_m": 0.2, "cells": cells, "estimate": estimate }]);
        document["stop"] = json!({ "max_passes": 16 });
        document["method"] = json!("light_tracing");
    })
}

fn result(prepared: &Prepared) -> Value {
    let merged = first_passes(prepared, 8);
    json!(prepared.results(&merged).grid("g").unwrap().unwrap())
}

#[test]
fn values_inside_are_null_and_in_no_statistic() {
    let prepared = half_covered("point", [4, 3]);
    let told = prepared.warnings.iter().find(|warning| warning.code == WarningCode::PointsInsideSolids).unwrap();
    assert!(told.detail.contains("/room/objects/0"), "{}", told.detail);
    let grid = result(&prepared);
    let rows = |field: &str| grid[field].as_array().unwrap().clone();
    for field in ["illuminance_lux", "standard_error_lux", "illuminance_ratio_percent"] {
        for row in rows(field) {
            let known: Vec<bool> = row.as_array().unwrap().iter().map(Value::is_number).collect();
            assert_eq!(known, [false, false, true, true], "{field}");
        }
    }
    let known: Vec<f64> = rows("illuminance_lux")
        .iter()
        .flat_map(|row| row.as_array().unwrap().clone())
        .filter_map(|lux| lux.as_f64())
        .collect();
    let statistics = &grid["statistics"];
    assert_eq!(statistics["points_inside_solids"], 6);
    let mean = known.iter().sum::<f64>() / 6.0;
    assert!((statistics["mean_lux"].as_f64().unwrap() / mean - 1.0).abs() < 1e-12);
    assert_eq!(statistics["min_lux"].as_f64().unwrap(), known.iter().copied().fold(f64::INFINITY, f64::min));
    assert!(statistics["uniformity"].as_f64().unwrap() > 0.0);
}

/// One cell over a floor of which a half is covered has the mean of the other half, in which two cells lie.
#[test]
fn a_cell_covered_in_part_has_the_mean_of_what_is_free() {
    let [whole, halves] = [[1, 1], [2, 1]].map(|cells| result(&half_covered("cell_average", cells)));
    let (of_whole, of_half) = (&whole["illuminance_lux"][0][0], &halves["illuminance_lux"][0]);
    assert!(of_half[0].is_null());
    let (of_whole, of_half) = (of_whole.as_f64().unwrap(), of_half[1].as_f64().unwrap());
    assert!((of_whole / of_half - 1.0).abs() < 0.05, "{of_whole} {of_half}");
}

/// A grid of which nothing is left is refused by its pointer, with the object that takes it.
#[test]
fn a_grid_inside_solids_as_a_whole_is_refused() {
    let mut document = half_covered("point", [4, 3]).document.clone();
    document["grids"][0]["cells"] = json!([1, 1]);
    document["room"]["objects"][0]["size_m"][0] = document["room"]["size_m"][0].clone();
    document["room"]["objects"][0]["position_m"][0] = json!(0.5 * document["room"]["size_m"][0].as_f64().unwrap());
    let parsed = JobDocument::parse(document.to_string().as_bytes()).unwrap();
    let refused = prepare_document(&parsed, &Folder).map(|_| ()).unwrap_err();
    assert_eq!(refused.0[0].pointer, "/grids/0");
    assert!(refused.0[0].detail.contains("/room/objects/0"), "{}", refused.0[0].detail);
}

/// Nothing is seen from within a solid: methods would not agree on what is between it and the light. From on top of it, all is.
#[test]
fn an_eye_inside_a_solid_is_refused() {
    let refused = |eye: [f64; 3]| {
        let mut document = half_covered("point", [4, 3]).document.clone();
        document["views"] = json!([{ "name": "v", "eye_m": eye, "look_at_m": [1.9, 1.0, 1.0], "size_px": [8, 8] }]);
        document["method"] = json!("path_tracing");
        let parsed = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        prepare_document(&parsed, &Folder).map(|_| ()).err().map(|errors| errors.0[0].clone())
    };
    let error = refused([0.5, 1.0, 0.2]).unwrap();
    assert_eq!(error.pointer, "/views/0/eye_m");
    assert!(error.detail.contains("/room/objects/0"), "{}", error.detail);
    assert_eq!(refused([0.5, 1.0, 0.4]), None);
    assert_eq!(refused([1.5, 1.0, 0.2]), None);
}

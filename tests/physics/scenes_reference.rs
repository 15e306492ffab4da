//! Job documents S1, S2, S3 against grids by an independent light tracer (`reference/scenes`).

use crate::documents::{prepare, render};
use crate::reference;
use crate::scenes::assert_grid;

fn compare(scene: &str, truth: &str, systematic: f64, edit: impl FnOnce(&mut serde_json::Value)) {
    let truth = reference::json(&format!("scenes/{truth}.reference.json"));
    let values = |key: &str| {
        let rows = truth[key].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
        rows.map(|value| value.as_f64().unwrap()).collect::<Vec<_>>()
    };
    let merged = render(&prepare(scene, edit));
    assert_grid(&merged, &values("illuminance_lux"), &values("standard_error_lux"), 4.5, systematic, scene);
    assert!(merged.ledger.relative_closure_error().abs() < 1e-9);
}

fn cell_average(document: &mut serde_json::Value) {
    document["grids"][0]["estimate"] = "cell_average".into();
}

#[test]
fn s1_points() {
    compare("S1", "S1.exact.point", 0.0, |_| {});
}

#[test]
fn s1_cell_averages() {
    compare("S1", "S1.exact.cell_average", 0.0, cell_average);
}

#[test]
fn s2_points() {
    compare("S2", "S2.exact.point", 0.0, |_| {});
}

#[test]
fn s2_cell_averages() {
    compare("S2", "S2.exact.cell_average", 0.0, cell_average);
}

/// The reference has facets, this scene has cylinders: 0.3 % are allowed.
#[test]
fn s3_points() {
    compare("S3", "S3.mesh.point", 0.003, |_| {});
}

#[test]
fn s3_cell_averages() {
    compare("S3", "S3.mesh.cell_average", 0.003, cell_average);
}

#[test]
fn s3_mesh_points() {
    compare("S3_mesh", "S3.mesh.point", 0.0, |_| {});
}

#[test]
fn s3_mesh_cell_averages() {
    compare("S3_mesh", "S3.mesh.cell_average", 0.0, cell_average);
}

/// SPPM agrees with the same references within its error bars, its estimated bias included.
#[test]
fn sppm_agrees() {
    for (scene, truth, systematic) in [("S1", "S1.exact.point", 0.0), ("S2", "S2.exact.point", 0.0)] {
        compare(scene, truth, systematic, |document| {
            document["method"] = "sppm".into();
            document["stop"]["relative_error"] = 0.03.into();
        });
    }
}

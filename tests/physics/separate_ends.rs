//! Grids and views by methods of their own end each when it is as accurate as asked.

use serde_json::json;
use skyduct::engine::cancel::Stop;
use skyduct::engine::progress::StoppedBy;
use skyduct::engine::spent::Spent;
use skyduct::estimate::Estimate;

use crate::documents::prepare;

/// The cube of S1 with a view, until both are as accurate as asked.
fn render(grid_error: f64, view_error: f64) -> Estimate {
    let prepared = prepare("S1", |document| {
        document["views"] = json!([{
            "name": "view", "eye_m": [0.3, 0.3, 1.2], "look_at_m": [1.5, 1.5, 0.6], "vertical_fov_deg": 60, "size_px": [32, 32]
        }]);
        document["method"] = json!("auto");
        document["stop"] = json!({ "relative_error": grid_error, "view_relative_error": view_error });
    });
    let rendered = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap();
    assert_eq!(rendered.stopped_by, StoppedBy::RelativeError);
    // had the other one run out of time, the results would say so of it alone
    let estimate = rendered.estimate;
    let accuracy = prepared.summary(&estimate, Spent::NOTHING, StoppedBy::MaxSeconds).accuracy.unwrap();
    let ended = |passes: u64| if passes < estimate.passes { "relative_error" } else { "max_seconds" };
    assert_eq!(accuracy.stopped_by.as_deref(), Some(ended(estimate.passes_of_grids())));
    assert_eq!(accuracy.view_stopped_by.as_deref(), Some(ended(estimate.passes_of_views())));
    estimate
}

/// The grid alone, for as many passes.
fn grid_alone(grid_error: f64, passes: u64) -> Estimate {
    let prepared = prepare("S1", |document| {
        document["method"] = json!("auto");
        document["stop"] = json!({ "relative_error": grid_error, "max_passes": passes });
    });
    prepared.render_all_passes(&mut |_, _| {}).unwrap()
}

fn lux(estimate: &Estimate) -> Vec<u64> {
    let grid = &estimate.grids[0];
    (0..grid.sensors.len()).map(|sensor| grid.illuminance_lux(sensor).to_bits()).collect()
}

/// A grid that is accurate before the view has the passes that it needs, and the bits that it has alone.
#[test]
fn a_grid_ends_before_a_view() {
    let estimate = render(0.05, 0.01);
    let passes = estimate.passes_of_grids();
    println!("{passes} passes of the grid, {} of the view", estimate.passes_of_views());
    assert!(passes < estimate.passes_of_views());
    assert_eq!(estimate.passes_of_views(), estimate.passes);
    let alone = grid_alone(0.05, passes);
    assert_eq!(lux(&estimate), lux(&alone));
    // so have the fluxes
    assert_eq!(estimate.tubes[0].into_room.mean.to_bits(), alone.tubes[0].into_room.mean.to_bits());
    assert_eq!(estimate.passes_of_energy(), passes);
}

/// A view that is accurate before the grid.
#[test]
fn a_view_ends_before_a_grid() {
    let estimate = render(0.0007, 0.5);
    println!("{} passes of the grid, {} of the view", estimate.passes_of_grids(), estimate.passes_of_views());
    assert!(estimate.passes_of_views() < estimate.passes_of_grids());
    assert_eq!(estimate.passes_of_grids(), estimate.passes);
    // chunks of passes, which views make shorter, are added up in another order
    let alone = grid_alone(0.0007, estimate.passes);
    for (with_view, alone) in lux(&estimate).into_iter().zip(lux(&alone)) {
        assert!((f64::from_bits(with_view) / f64::from_bits(alone) - 1.0).abs() < 1e-12);
    }
}

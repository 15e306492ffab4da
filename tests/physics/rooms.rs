//! Light tracing in closed rooms against radiosity with exact form factors (`room_radiosity.csv`).

use crate::reference::{number, rows};
use crate::scenes::{assert_grid, disc_room, light_tracing, run};
use skyduct::scene::EstimateKind;

/// Case, reflectances of floor, walls, ceiling and disc.
const CASES: [(&str, [f64; 4]); 6] = [
    ("S0", [0.0, 0.0, 0.0, 0.0]),
    ("S1_", [0.2, 0.5, 0.7, 0.0]),
    ("S1r", [0.2, 0.5, 0.7, 0.7]),
    ("S2_", [0.5, 0.5, 0.5, 0.0]),
    ("S2r", [0.5, 0.5, 0.5, 0.5]),
    ("S3r", [0.9, 0.9, 0.9, 0.9]),
];

fn compare(estimate: EstimateKind, column: usize, relative_error: fn(&str) -> f64) {
    for (case, [floor, walls, ceiling, disc]) in CASES {
        let mut truth = vec![f64::NAN; 81];
        for row in rows("room_radiosity.csv").iter().filter(|row| row[0].starts_with(case)) {
            truth[number(&row[2]) as usize * 9 + number(&row[1]) as usize] = number(&row[column]);
        }
        let truth_error: Vec<f64> = truth.iter().map(|lux| relative_error(case) * lux).collect();
        let scene = disc_room(floor, walls, ceiling, disc, estimate);
        let result = run(&scene, &light_tracing(&scene, 16_384, 3), 32);
        // 486 comparisons: 4.5 standard errors have a false alarm rate of 0.3 % (normal)
        assert_grid(&result, &truth, &truth_error, 4.5, 0.0, case);
        assert!(result.ledger.relative_closure_error().abs() < 1e-9, "{:?}", result.ledger);
    }
}

#[test]
fn points_agree_with_radiosity() {
    compare(EstimateKind::Point, 6, |case| if case == "S3r" { 2.5e-6 } else { 4.4e-7 });
}

#[test]
fn cell_averages_agree_with_radiosity() {
    compare(EstimateKind::CellAverage, 7, |_| 4e-5);
}

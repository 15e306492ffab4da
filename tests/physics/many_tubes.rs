//! Any number of tubes: light adds up.

use crate::scenes::{SIDE, assert_grid, cube, daylight, lambertian, light_tracing, run, straight, values};
use glam::DVec2;
use skyduct::scene::{EstimateKind, Scene, Tube};

/// `count` tubes in rows of five, those that `lit` names with a diffuser that passes light.
fn room(count: usize, lit: impl Fn(usize) -> bool) -> Scene {
    let rows = count.div_ceil(5);
    let tubes = (0..count).map(|k| {
        let place = DVec2::new((k % 5) as f64 + 0.5, (k / 5) as f64 + 0.5) / DVec2::new(5.0, rows as f64);
        let transmittance = if lit(k) { 0.6 } else { 0.0 };
        Tube { centre: place * SIDE, opening_radius: 0.1, ..straight(1.0, 0.95, lambertian(transmittance, 0.3)) }
    });
    cube(0.3, 0.5, 0.7, tubes.collect(), daylight(12, 5000.0, 40.0, 120.0), EstimateKind::Point)
}

/// All tubes give what two halves of them give together, the others dark (4.5 standard errors at 81 sensors).
#[test]
fn halves_add_up() {
    for count in [2, 20] {
        let trace = |lit: &dyn Fn(usize) -> bool, seed| {
            let scene = room(count, lit);
            run(&scene, &*light_tracing(&scene, 16_384, seed), 32)
        };
        let (all, even, odd) = (trace(&|_| true, 1), trace(&|k| k % 2 == 0, 2), trace(&|k| k % 2 == 1, 3));
        let ((a, a_error), (b, b_error)) = (values(&even), values(&odd));
        let sum: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + b).collect();
        let errors: Vec<f64> = a_error.iter().zip(&b_error).map(|(a, b)| a.hypot(*b)).collect();
        assert_grid(&all, &sum, &errors, 4.5, 0.0, "all tubes");
        assert!(all.energy.relative_closure_error().abs() < 1e-9);
        let relative = all.grids[0].mean.standard_error() / all.grids[0].mean.mean;
        assert!(all.tubes.len() == count && relative < 0.01, "{relative}");
        let into_room: f64 = all.tubes.iter().map(|tube| tube.into_room.mean).sum();
        let first = all.tubes[0].into_room.mean;
        assert!((into_room / (first * count as f64) - 1.0).abs() < 0.02);
    }
}

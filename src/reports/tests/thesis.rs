//! The pieces of the report on the thesis: the printed update and its faults, distances of images, the page itself.

#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::disallowed_methods,
    reason = "a failure is what tests are for"
)]

use skyduct::sampling::Key;
use skyduct_reports::markdown;
use skyduct_reports::thesis::distance::{Spread, difference, euclidean, lengths, logarithmic_slope};
use skyduct_reports::thesis::update::{Faults, HitPoint, uniform};
use skyduct_reports::thesis::{Settings, run};

const ALPHA: f64 = 0.8;
const DISCS: u64 = 32_768;

/// Under uniform light, 200 passes: an independent simulation of the printed update has these means over the true value. Both
/// have a standard error; the other one had at least as many discs.
#[test]
fn the_printed_update_is_too_bright_where_photons_are_few() {
    for (expected, ratio) in [(0.44, 1.0229), (0.1, 1.0855), (0.02, 1.5202)] {
        let found = uniform(expected, 200, ALPHA, Faults::PRINTED, DISCS, Key::new(5)).ratio;
        let error = std::f64::consts::SQRT_2 * found.standard_error();
        assert!((found.mean - ratio).abs() < 4.0 * error, "{expected}: {} +- {error}, {ratio}", found.mean);
        assert!(found.mean - 1.0 > 8.0 * error, "{expected}: the excess must be seen");
    }
}

/// The right update has no bias at any number of photons, and the printed one is low by 1 - alpha after its first pass.
#[test]
fn the_right_update_is_unbiased_and_the_first_printed_pass_dark() {
    for expected in [0.44, 0.1, 0.02] {
        let found = uniform(expected, 200, ALPHA, Faults::NONE, DISCS, Key::new(6)).ratio;
        assert!((found.mean - 1.0).abs() < 4.0 * found.standard_error(), "{expected}: {}", found.mean);
        let first = uniform(expected, 1, ALPHA, Faults::PRINTED, DISCS, Key::new(7)).ratio;
        assert!((first.mean - ALPHA).abs() < 4.0 * first.standard_error(), "{expected}: {}", first.mean);
    }
}

/// With many photons in every pass the radius follows R_n / R_0 = sqrt(Gamma(n + alpha) / (Gamma(alpha) Gamma(n + 1))), and
/// what is left of the printed fault is 1 - (1 - alpha) / n in the n-th pass.
#[test]
fn radius_and_remaining_fault_of_even_passes() {
    let (mut right, mut printed) = (HitPoint::default(), HitPoint::default());
    for pass in 1..=200u32 {
        // what a disc of this area gets of an even light of 1000 photons
        let found = 1000.0 * right.radius() * right.radius();
        right.update(found, found, f64::from(pass), ALPHA, Faults::NONE);
        printed.update(found, found, f64::from(pass), ALPHA, Faults::PRINTED);
        assert!((right.shown() - 1000.0).abs() < 1e-9);
        let left = 1.0 - (1.0 - ALPHA) / f64::from(pass);
        assert!((printed.shown() / 1000.0 - left).abs() < 1e-12, "{pass}");
    }
    assert!((right.radius() - 0.545495).abs() < 1e-6);
}

/// A pass that finds nothing leaves the printed value as it was, and divides the right one by more photons.
#[test]
fn an_empty_pass_keeps_the_printed_value() {
    let (mut right, mut printed, mut whole) = (HitPoint::default(), HitPoint::default(), HitPoint::default());
    for point in [(&mut right, Faults::NONE), (&mut printed, Faults::PRINTED), (&mut whole, Faults::PRINTED_WHOLE)] {
        point.0.update(1.0, 1.0, 1.0, ALPHA, point.1);
        point.0.update(0.0, 0.0, 2.0, ALPHA, point.1);
    }
    assert!((right.shown() - 0.5).abs() < 1e-15 && (printed.shown() - ALPHA).abs() < 1e-15);
    // a whole count forgets a single photon: the second one shrinks the disc as much as the first
    whole.update(1.0, 1.0, 3.0, ALPHA, Faults::PRINTED_WHOLE);
    printed.update(1.0, 1.0, 3.0, ALPHA, Faults::PRINTED);
    assert!((whole.radius() - ALPHA).abs() < 1e-15 && printed.radius() > ALPHA);
}

#[test]
fn distances_of_a_synthetic_pair() {
    // three pixels: alike, one channel off, all channels off
    let reference = [1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 0.0, 0.0, 0.0];
    let image = [1.0, 2.0, 3.0, 1.0, 2.5, 3.0, 2.0, -3.0, 6.0];
    let distances = euclidean(&image, &reference);
    assert_eq!(distances, [0.0, 0.5, 7.0]);
    assert_eq!(difference(&image, &reference, 1), [0.0, 0.5, -3.0]);
    assert_eq!(lengths(&[2.0, 3.0, 6.0]), [7.0]);
    assert_eq!(Spread::of(&distances, |_| true), Spread { lowest: 0.0, highest: 7.0, mean: 2.5 });
    assert_eq!(Spread::of(&distances, |pixel| pixel > 0), Spread { lowest: 0.5, highest: 7.0, mean: 3.75 });
    let points: Vec<(f64, f64)> = (0..5).map(|k| (4f64.powi(k), 3.0 * 4f64.powi(k).powf(-1.0 / 3.0))).collect();
    assert!((logarithmic_slope(&points) + 1.0 / 3.0).abs() < 1e-12);
}

/// A report of tiny jobs, twice: the same page and the same pictures, with every part in it.
#[test]
fn a_tiny_report_is_the_same_every_time() {
    let settings = Settings { passes: 2, photons_per_pass: 256, size_px: 8, cells: 3, points: 8, discs: 64 };
    let folder = |name: &str| std::env::temp_dir().join(format!("skyduct-thesis-{name}-{}", std::process::id()));
    let folders = ["first", "second"].map(folder);
    for folder in &folders {
        let report = run(&settings, |_| {}).unwrap();
        markdown::write(&report, folder).unwrap();
    }
    let read = |file: &str| folders.each_ref().map(|folder| std::fs::read(folder.join(file)).unwrap());
    let [page, again] = read("thesis.md");
    assert_eq!(page, again);
    let page = String::from_utf8(page).unwrap();
    for section in 1..=7 {
        assert!(page.contains(&format!("\n## {section}. ")), "section {section} is missing");
    }
    assert!(page.contains("This is a short run"));
    let figures: Vec<&str> = page.split("](thesis/").skip(1).filter_map(|rest| rest.split(')').next()).collect();
    assert!(figures.len() >= 10, "{figures:?}");
    for figure in figures {
        let [first, second] = read(&format!("thesis/{figure}"));
        assert!(!first.is_empty() && first == second, "{figure}");
    }
    folders.iter().for_each(|folder| std::fs::remove_dir_all(folder).unwrap());
}

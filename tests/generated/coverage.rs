//! Intervals of 95 % hold the truth in 95 % of cases: of sensors and of the means of grids, by every method, in generated
//! rooms.
//!
//! The truth is a long render by a method of another kind. Its error widens the interval as it does in a comparison; it is a
//! small part of it.

use std::collections::BTreeMap;

use serde_json::Value;
use skyduct::statistics::interval::two_sided_student_quantile;

use crate::generator::{self, Kind};
use crate::judge::Measured;
use crate::render::{Effort, Found, METHODS, cases, render};

/// Number of rooms, and renders of each with random numbers of their own.
const ROOMS: u32 = 40;
const RENDERS: u64 = 8;

const EFFORT: Effort = Effort { passes: 32, size: 0.5, fixed: 1 };

/// About 32 times the work of a render: its error makes an interval 2 % wider.
const LONG: Effort = Effort { passes: 256, size: 2.0, fixed: 1 };

/// Methods that tell the truth: the first that is of another kind than the one that is judged, and accepts the room.
const TRUTHS: [&str; 5] =
    ["placed_vertices", "light_tracing", "bidirectional_path_tracing", "path_tracing", "two_stage"];

/// Intervals that held, and all.
#[derive(Clone, Copy, Debug, Default)]
struct Held {
    held: f64,
    all: f64,
}

impl Held {
    fn add(&mut self, found: &[Measured], truth: &[Measured]) {
        for (found, truth) in found.iter().zip(truth) {
            let degrees = found.degrees.clamp(1.0, 1e9);
            let quantile = two_sided_student_quantile(0.95, degrees);
            let difference = (found.value - truth.value).abs();
            // where no light can come nothing is random
            let holds = difference <= quantile * found.error.hypot(truth.error) + 1e-9 * truth.value.abs();
            self.held += f64::from(u8::from(holds));
            self.all += 1.0;
        }
    }

    fn share(self) -> f64 {
        self.held / self.all
    }
}

/// Long renders of a room by the first two methods that accept it.
fn truths(document: &Value) -> Vec<(&'static str, Found)> {
    TRUTHS.iter().filter_map(|name| Some((*name, render(document, name, LONG, 7).ok()?))).take(2).collect()
}

#[test]
#[ignore = "half an hour: long renders of 40 rooms"]
fn intervals_hold_as_often_as_they_say() {
    let mut sensors: BTreeMap<&str, Held> = BTreeMap::new();
    let mut means: BTreeMap<&str, Held> = BTreeMap::new();
    for (number, document) in generator::drawn(cases(ROOMS), generator::document(Kind::Plain)).enumerate() {
        let truths = truths(&document);
        for method in METHODS {
            let Some((_, truth)) = truths.iter().find(|(name, _)| *name != method) else { continue };
            let (mut of_sensors, mut of_means) = (Held::default(), Held::default());
            for seed in 0..if method == "holigilm" { 1 } else { RENDERS } {
                let Ok(found) = render(&document, method, EFFORT, 100 + seed) else { break };
                of_sensors.add(&found.values, &truth.values);
                of_means.add(&found.means, &truth.means);
            }
            if of_sensors.all > 0.0 {
                let (of_sensor, of_mean) = (of_sensors.share(), of_means.share());
                println!(
                    "room {number}, {method}: {:.1} % of sensors, {:.1} % of means",
                    100.0 * of_sensor,
                    100.0 * of_mean
                );
                if of_sensor < 0.8 {
                    println!("{document}");
                }
            }
            for (all, room) in [(&mut sensors, of_sensors), (&mut means, of_means)] {
                let all = all.entry(method).or_default();
                all.held += room.held;
                all.all += room.all;
            }
        }
    }
    let mut failures = Vec::new();
    for method in METHODS {
        let (of_sensors, of_means) = (sensors[method], means[method]);
        let (sensor, mean) = (of_sensors.share(), of_means.share());
        let line = format!(
            "{method}: {:.1} % of {} sensors, {:.1} % of {} means",
            100.0 * sensor,
            of_sensors.all,
            100.0 * mean,
            of_means.all
        );
        println!("{line}");
        // a solver's errors are bounds
        let most = if method == "holigilm" { 1.0 } else { 0.97 };
        if !(0.93..=most).contains(&sensor) || !(0.90..=most.max(0.99)).contains(&mean) {
            failures.push(line);
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

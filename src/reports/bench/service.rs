//! Latency and throughput of the service for jobs over HTTP.

use serde_json::{Value, json};

use super::measure::{Quartiles, time};
use super::scenes;
use super::settings::Settings;
use crate::page::{ReportError, Section, Table};
use skyduct::figure::ticks::significant;

/// Wall-clock seconds from requests to answers, and throughput.
pub struct Latencies {
    /// Latencies of S1 to 1 %, one client.
    pub one: Vec<f64>,
    /// Latencies of a room with a tube that is dragged, one client.
    pub dragged: Vec<f64>,
    /// Number of concurrent clients, whose answered jobs `jobs_per_second` counts.
    pub clients: usize,
    pub jobs_per_second: f64,
}

/// Returns the document of S1 to 1 %, with a seed.
pub fn small_job(settings: &Settings, seed: u64) -> Result<Value, ReportError> {
    Ok(scenes::stored(settings, "S1")?.to(0.01, settings.longest_job()).seed(seed).document)
}

/// Returns the document of a room of 4 x 6 x 2.7 m with two tubes, one of them at a step of its path across the room, as the
/// page requests it while a user drags the tube: 16 x 24 points to 5 %, no picture.
pub fn dragged(step: u32) -> Value {
    let tube = |x: f64, y: f64| {
        json!({
            "centre_m": [x, y], "diameter_m": 0.35, "reflectance": 0.98, "segments": [{ "length_m": 1.2 }],
            "collector": { "kind": "dome", "transmittance": 0.92 },
            "diffuser": { "kind": "lambertian", "transmittance": 0.6 },
        })
    };
    json!({
        "location": { "latitude_deg": 55.68, "longitude_deg": 12.57 }, "time": "2026-03-21T12:00:00+01:00",
        "sky": { "cie_type": 12 },
        "room": { "size_m": [4.0, 6.0, 2.7] },
        "tubes": [tube(1.0 + 0.02 * f64::from(step % 100), 1.5), tube(2.0, 4.5)],
        "grids": [{ "name": "workplane", "height_m": 0.85, "cells": [16, 24] }],
        "stop": { "relative_error": 0.05, "max_seconds": 20 },
    })
}

pub fn section(latencies: &Latencies) -> Section {
    let Latencies { one, dragged, clients, jobs_per_second } = latencies;
    let row = |name: &str, seconds: &[f64]| {
        let spread = Quartiles::of(seconds.iter().copied());
        let longest = seconds.iter().copied().fold(0.0, f64::max);
        let cells = [time(spread.median), time(spread.lower), time(spread.upper), time(longest)];
        [name.to_owned(), seconds.len().to_string()].into_iter().chain(cells).collect()
    };
    Section {
        title: "The service".to_owned(),
        text: format!(
            "Wall-clock seconds from `POST /v1/jobs` with `Prefer: wait` to the answer with the grids, over the \
             loopback interface; the client runs in the process of the service and on its processors. No two jobs are \
             equal (the seed or the place of the tube differs). {clients} clients at the same time got answers to {} \
             jobs of S1 to 1 % per second.",
            significant(*jobs_per_second, 3)
        ),
        tables: vec![Table {
            caption: "From request to grid".to_owned(),
            head: ["job", "requests", "median", "lower quartile", "upper quartile", "longest"]
                .map(str::to_owned)
                .into(),
            rows: vec![row("S1 to 1 %", one), row("dragged tube, two tubes, 16 x 24 points to 5 % at 95 %", dragged)],
        }],
        ..Section::default()
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::bench::case::Case;

    #[test]
    fn the_dragged_tube_stays_a_job() {
        let places: Vec<f64> = [0, 1, 99, 100]
            .map(|step| {
                let document = dragged(step);
                assert!(Case::beside(document.clone(), Path::new(".")).prepare().is_ok());
                document["tubes"][0]["centre_m"][0].as_f64().unwrap()
            })
            .into();
        assert_eq!(places[0], places[3]);
        assert!(places[1] > places[0] && places[2] > places[1]);
    }

    #[test]
    fn latencies_become_rows() {
        let latencies =
            Latencies { one: vec![0.03, 0.01, 0.02], dragged: vec![0.05], clients: 4, jobs_per_second: 123.0 };
        let section = section(&latencies);
        assert_eq!(section.tables[0].rows[0][5], "30.0 ms");
    }
}

//! A generated document by a method: what must hold of any render, and its values with their errors.

use std::fmt;

use proptest::prelude::*;
use proptest::test_runner::RngSeed;
use serde_json::{Value, json};
use skyduct::document::{FieldErrorCode, JobDocument, WarningCode};
use skyduct::engine::cancel::Stop;
use skyduct::estimate::Estimate;
use skyduct::estimate::grid_statistics::GridStatistics;
use skyduct::integrator::Method;
use skyduct::present::prepared::{Prepared, prepare_document};

use crate::generator::Meshes;
use crate::judge::Measured;
use crate::measured_values::{degrees, grid};

/// A document that is printed as JSON when a test fails.
#[derive(Clone)]
pub struct Case(pub Value);

impl fmt::Debug for Case {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        write!(formatter, "{}", self.0)
    }
}

/// Number of cases of a property: as the environment says, or `usual`.
pub fn cases(usual: u32) -> u32 {
    std::env::var("GENERATED_CASES").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

/// What proptest does: `cases` of a fixed seed, and few steps toward a simpler failure, since each renders anew.
pub fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(20),
        max_shrink_iters: 100,
        ..ProptestConfig::default()
    }
}

/// Methods that are compared, with their variants.
pub const METHODS: [&str; 10] = [
    "light_tracing",
    "path_tracing",
    "bidirectional_path_tracing",
    "two_stage",
    "photon_mapping",
    "ppm",
    "ppm per_point",
    "sppm",
    "sppm per_point",
    "holigilm",
];

/// Size of a render.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    pub passes: u64,
    /// Photons and paths of a pass, relative to those that tell a difference of some percent.
    pub size: f64,
    /// Points of a sensor and rays of a pixel that are the same in every pass, relative to few: what they miss no pass finds.
    pub fixed: u64,
}

/// Reason why a document has no values by a method.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Left {
    Refused,
    /// It warns that it finds by chance what a mirror shows: its error does not know what was not found.
    ByChance,
}

/// What a method finds.
pub struct Found {
    /// Sensors of all grids, blocks of all views.
    pub values: Vec<Measured>,
    /// Means of all grids.
    pub means: Vec<Measured>,
    /// Flux into the room through every tube; empty where the method does not know it.
    pub tubes: Vec<Measured>,
}

/// The method of a document with settings for its outputs.
fn method(document: &Value, name: &str, Effort { size, fixed, .. }: Effort) -> Value {
    let count = |outputs: &str, field: &str| -> f64 {
        let of = |output: &Value| output[field][0].as_f64().unwrap() * output[field][1].as_f64().unwrap();
        document[outputs].as_array().unwrap().iter().map(of).sum::<f64>().max(1.0)
    };
    let (sensors, pixels) = (count("grids", "cells"), count("views", "size_px"));
    let photons = |photons: f64| (photons * size) as u64;
    let each = |paths: f64, of: f64| (paths * size / of).ceil().max(2.0) as u64;
    let (kind, radius) = name.split_once(' ').unwrap_or((name, "schedule"));
    match kind {
        "light_tracing" => json!({ "kind": kind, "photons_per_pass": photons(4096.0) }),
        "path_tracing" => json!({ "kind": kind, "samples_per_sensor": each(1024.0, sensors),
            "samples_per_pixel": each(1024.0, pixels) }),
        "bidirectional_path_tracing" => json!({ "kind": kind, "photons_per_pass": photons(1024.0),
            "samples_per_sensor": each(512.0, sensors), "samples_per_pixel": each(512.0, pixels) }),
        "two_stage" => json!({ "kind": kind, "photons_per_pass": photons(2048.0),
            "samples_per_sensor": each(1024.0, sensors), "samples_per_pixel": each(1024.0, pixels) }),
        "photon_mapping" => json!({ "kind": kind, "photons_per_pass": photons(4096.0),
            "gather_rays": each(1024.0, sensors.max(pixels)) }),
        "ppm" => {
            json!({ "kind": kind, "photons_per_pass": photons(4096.0), "radius": radius, "samples_per_sensor": 64 * fixed,
            "samples_per_pixel": 4 * fixed })
        }
        "sppm" => json!({ "kind": kind, "photons_per_pass": photons(4096.0), "radius": radius }),
        _ => json!({ "kind": kind }),
    }
}

/// The document with a method, which ends after its passes.
pub fn job(document: &Value, name: &str, effort: Effort, seed: u64) -> Value {
    let mut job = document.clone();
    if ["light_tracing", "holigilm"].contains(&name) {
        // they compute grids only, and are compared on these
        job["views"] = json!([]);
    }
    job["method"] = method(document, name, effort);
    // a solver has no passes
    let relative_error = if name == "holigilm" { 5e-3 } else { 1e-12 };
    job["stop"] = json!({ "max_passes": effort.passes, "relative_error": relative_error,
        "view_relative_error": 1e-12, "max_seconds": 3600 });
    job["seed"] = json!(seed ^ document["seed"].as_u64().unwrap());
    job
}

/// Renders a valid document, and checks what must hold of every render: values are finite and not below zero by more than noise, and
/// balances of the energy close.
pub fn render(document: &Value, name: &str, effort: Effort, seed: u64) -> Result<Found, Left> {
    let job = job(document, name, effort, seed);
    let valid = JobDocument::parse(job.to_string().as_bytes()).unwrap_or_else(|errors| panic!("{errors}\n{job}"));
    let prepared = match prepare_document(&valid, &Meshes) {
        Ok(prepared) => prepared,
        Err(errors) => {
            assert!(errors.0.iter().all(|error| error.code == FieldErrorCode::MethodRefuses), "{errors}\n{job}");
            return Err(Left::Refused);
        }
    };
    if prepared.warnings.iter().any(|warning| warning.code == WarningCode::MirrorsByChance) {
        return Err(Left::ByChance);
    }
    let rendered = prepared.render(&Stop::default(), &mut |_, _| {}).unwrap_or_else(|error| panic!("{error}\n{job}"));
    let mut estimate = rendered.estimate;
    sound(&prepared, &mut estimate, &job);

    // fixed points are brought down by no pass: their error is told by few contrasts
    let certain = |degrees: f64| if name.starts_with("ppm") { degrees.min(15.0) } else { degrees };
    let mut values = Vec::new();
    let mut means = Vec::new();
    for of_grid in &estimate.grids {
        values.extend(grid(of_grid).0.iter().map(|it| Measured { degrees: certain(it.degrees), ..*it }));
        if let Some(statistics) = GridStatistics::new(of_grid) {
            let degrees = certain(degrees(&of_grid.mean, of_grid.numerical));
            means.push(Measured { value: statistics.mean.value, error: statistics.mean.standard_error, degrees });
        }
    }
    for film in &estimate.views {
        values.extend(film.blocks.iter().enumerate().map(|(block, moments)| Measured {
            value: moments.mean,
            error: film.block_standard_error_cd_m2(block),
            degrees: certain(moments.count - 1.0),
        }));
    }
    let outputs = method_of(&prepared).is_some_and(|method| method.described().outputs().tube_fluxes);
    let fluxes = estimate.tubes.iter().filter(|_| outputs).map(|tube| Measured {
        value: tube.into_room.mean,
        error: tube.into_room.standard_error(),
        degrees: degrees(&tube.into_room, name == "holigilm"),
    });
    let tubes = fluxes.collect();
    Ok(Found { values, means, tubes })
}

fn method_of(prepared: &Prepared) -> Option<&Method> {
    let methods = &prepared.plan.methods;
    methods.grids.as_ref().or(methods.views.as_ref()).map(|choice| &choice.method)
}

/// Number of standard errors below zero that noise of few passes may reach.
const BELOW_ZERO: f64 = 8.0;

/// Fails on values that no light can have, and on energy balances that do not close.
pub fn sound(prepared: &Prepared, estimate: &mut Estimate, job: &Value) {
    let mut finite = true;
    estimate.for_each_value(&mut |value| finite &= value.is_finite());
    assert!(finite, "not finite: {job}");
    // residuals have either sign: noise, but nothing else, may be below zero
    let is_light = |value: f64, error: f64| value >= -BELOW_ZERO * error;
    for grid in &estimate.grids {
        for sensor in grid.valued() {
            let (lux, error) = (grid.illuminance_lux(sensor), grid.standard_error_lux(sensor));
            assert!(is_light(lux, error), "sensor {sensor} has {lux} +- {error} lx: {job}");
        }
    }
    for view in &estimate.views {
        for (block, moments) in view.blocks.iter().enumerate() {
            let error = view.block_standard_error_cd_m2(block);
            assert!(is_light(moments.mean, error), "block {block} has {} +- {error} cd/m2: {job}", moments.mean);
        }
    }
    let Some(method) = method_of(prepared) else { return };
    if method.described().outputs().energy {
        let numerical = estimate.grids.iter().any(|grid| grid.numerical);
        let closure = estimate.energy.relative_closure_error();
        // a solver's balance is numerical
        let most = if numerical { 2e-3 } else { 1e-9 };
        assert!(closure.abs() < most, "energy balance does not close by {closure}: {:?}\n{job}", estimate.energy);
    }
}

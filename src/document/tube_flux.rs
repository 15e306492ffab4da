//! Request for the fluxes through a tube without a room, under a list of skies at a list of times.

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};
use utoipa::ToSchema;

use super::errors::{Checks, DocumentErrors, FieldError, FieldErrorCode};
use super::limits::{RELATIVE_FLUX_ERROR, SKIES, SKIES_TIMES_TIMES, TIMES};
use super::read::shape;
use super::sky::{LocationDocument, SkyDocument};
use super::tube::{OpeningNormal, TubeDocument};
use super::{JobDocument, ValidJob};

/// Largest number of errors that are reported.
const MOST_ERRORS: usize = 100;

/// Request for the flux that a tube delivers under each of several skies at each of several times.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct TubeFluxDocument {
    /// The tube, as in a job. `centre_m` may be absent, because its place in the ceiling has no effect.
    pub tube: TubeDocument,
    /// Location on Earth, as in a job; given together with `times`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub location: Option<LocationDocument>,
    /// Skies as in a job, 1 to 100; the sun's position comes from `location` and `times`, or else from each sky's `sun_position`.
    pub skies: Vec<SkyDocument>,
    /// Times as in a job (RFC 3339 with an offset), at most 1000. Every sky is computed at every time, at most 5000 pairs. Absent
    /// or empty: every sky is computed once, with its own `sun_position`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub times: Vec<String>,
    /// Relative error of the flux into the room to be reached, at 95 % confidence, for the light of the sky and of the sun each.
    #[serde(default = "one_percent")]
    #[schema(default = 0.01)]
    pub relative_error: f64,
    /// Seed of the random numbers; equal documents with equal seeds give bitwise equal results.
    #[serde(default)]
    #[schema(maximum = 18_446_744_073_709_551_615u64)]
    pub seed: u64,
}

fn one_percent() -> f64 {
    0.01
}

/// A request that was read and checked, with a job for each pair of a sky and a time.
#[derive(Debug)]
pub struct ValidTubeFlux {
    /// Requested relative error at 95 % confidence.
    pub relative_error: f64,
    /// Seed of the random numbers.
    pub seed: u64,
    /// All pairs, in the order of skies and then of times. The job of the first has the requested tube; those of the others have
    /// a placeholder, and only their sky and sun are used.
    pub pairs: Vec<Pair>,
}

/// A sky at a time, as a job.
#[derive(Debug)]
pub struct Pair {
    /// Number of the sky in the request, from 0.
    pub sky: usize,
    /// Number of the time in the request, from 0; `None` if the sky gives the sun's position.
    pub time: Option<usize>,
    /// Job with an empty room below the sky at the time.
    pub job: ValidJob,
}

impl TubeFluxDocument {
    /// Checks a request that was read as JSON. Errors report every fault, with pointers into the request.
    pub fn from_value(mut value: Value) -> Result<ValidTubeFlux, DocumentErrors> {
        if let Some(tube) = value.get_mut("tube").and_then(Value::as_object_mut) {
            tube.entry("centre_m").or_insert(json!([0.0, 0.0]));
        }
        let mut checks = Checks::default();
        let Some((request, _)) = shape::read::<Self>(value.clone(), &mut checks) else {
            return Err(DocumentErrors(checks.errors));
        };
        request.check(&mut checks);
        if !checks.errors.is_empty() {
            return Err(DocumentErrors(checks.errors));
        }
        let pairs = request.pairs(&value)?;
        Ok(ValidTubeFlux { relative_error: request.relative_error, seed: request.seed, pairs })
    }

    fn check(&self, checks: &mut Checks) {
        let mut count = |field: &str, count: usize, range: &std::ops::RangeInclusive<usize>| {
            if !range.contains(&count) {
                let detail = format!("must have {} to {} entries, but has {count}", range.start(), range.end());
                let code = if count > *range.end() { FieldErrorCode::TooMany } else { FieldErrorCode::Invalid };
                checks.refuse_as(code, field, detail);
            }
        };
        count("/skies", self.skies.len(), &SKIES);
        count("/times", self.times.len(), &TIMES);
        if self.tube.normal() == OpeningNormal::Face {
            checks.not_supported(
                "/tube/normal",
                "an opening in the plane of a face, which a tube without a room does not have",
            );
        }
        let pairs = self.skies.len().saturating_mul(self.times.len());
        if pairs > SKIES_TIMES_TIMES {
            let detail =
                format!("the number of skies times the number of times must be <= {SKIES_TIMES_TIMES}, but is {pairs}");
            checks.refuse_as(FieldErrorCode::TooMany, "/times", detail);
        }
        if !RELATIVE_FLUX_ERROR.contains(self.relative_error) {
            let detail = format!("must be {RELATIVE_FLUX_ERROR}, but is {}", self.relative_error);
            checks.refuse_as(FieldErrorCode::OutOfRange, "/relative_error", detail);
        }
    }

    fn pairs(&self, value: &Value) -> Result<Vec<Pair>, DocumentErrors> {
        let times: Vec<Option<usize>> = match self.times.len() {
            0 => vec![None],
            count => (0..count).map(Some).collect(),
        };
        let (mut pairs, mut errors): (_, Vec<FieldError>) = (Vec::new(), Vec::new());
        for sky in 0..self.skies.len() {
            for time in &times {
                let tube = if pairs.is_empty() && errors.is_empty() { &value["tube"] } else { &Value::Null };
                match JobDocument::from_value(job(value, tube, sky, *time)) {
                    Ok(job) => pairs.push(Pair { sky, time: *time, job }),
                    Err(DocumentErrors(found)) => {
                        let found = found.into_iter().map(|error| in_request(error, sky, *time));
                        errors.extend(found.filter(|error| !error.pointer.starts_with("/room")));
                        errors.dedup();
                    }
                }
                if errors.len() >= MOST_ERRORS {
                    return Err(DocumentErrors(errors));
                }
            }
        }
        if errors.is_empty() { Ok(pairs) } else { Err(DocumentErrors(errors)) }
    }
}

/// Returns the document of a job: an empty room with `tube`, or with a plain tube where it is null, below one sky of the request.
fn job(request: &Value, tube: &Value, sky: usize, time: Option<usize>) -> Value {
    let mut tube = tube.clone();
    if tube.is_null() {
        tube = json!({
            "diameter_m": 0.3, "reflectance": 0.9, "segments": [{ "length_m": 1.0 }], "collector": { "kind": "open" },
            "diffuser": { "kind": "lambertian", "transmittance": 0.5 }
        });
    }
    let diameter = ["diameter_m", "opening_diameter_m"].iter().find_map(|field| tube[*field].as_f64());
    // a room that any valid tube fits into
    let edge = (2.0 * diameter.unwrap_or(1.0)).clamp(0.1, 200.0);
    tube["centre_m"] = json!([0.5 * edge, 0.5 * edge]);
    if let Some(fields) = tube.as_object_mut() {
        // the place in a room has no effect
        fields.remove("face");
        fields.remove("drop_m");
    }
    let mut job = Map::new();
    job.insert("room".into(), json!({ "size_m": [edge, edge, edge] }));
    job.insert("tubes".into(), json!([tube]));
    job.insert("grids".into(), json!([{ "name": "floor", "height_m": 0.0, "cells": [1, 1] }]));
    job.insert("sky".into(), request["skies"][sky].clone());
    if let Some(location) = request.get("location") {
        job.insert("location".into(), location.clone());
    }
    if let Some(time) = time {
        job.insert("time".into(), request["times"][time].clone());
    }
    Value::Object(job)
}

/// Converts an error of a pair's job to one of the request, by its pointer.
fn in_request(error: FieldError, sky: usize, time: Option<usize>) -> FieldError {
    let pointer = match (error.pointer.as_str(), time) {
        ("/time", Some(time)) => format!("/times/{time}"),
        ("/time", None) => "/times".to_owned(),
        (pointer, _) => match (pointer.strip_prefix("/sky"), pointer.strip_prefix("/tubes/0")) {
            (Some(rest), _) => format!("/skies/{sky}{rest}"),
            (_, Some(rest)) => format!("/tube{rest}"),
            _ => pointer.to_owned(),
        },
    };
    FieldError { pointer, ..error }
}

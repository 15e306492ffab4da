//! Data of a job that figures print beside their values: its name, place, time, sky and methods.

use glam::DVec3;
use jiff::Timestamp;
use serde::Deserialize;
use serde_json::Value;

use crate::VERSION;
use crate::document::canonical::canonical_hash;
use crate::document::result::{MeshesResult, PlanResult};
use crate::document::{JobDocument, ValidJob};
use crate::figure::Heading;
use crate::figure::heading::SEPARATOR;
use crate::predict::predictions::Predictions;
use crate::sky::SkyType;

/// Sky under which a job with a year computes its grids.
const OF_DAYLIGHT_FACTORS: &str = "CIE standard overcast sky of 10 000 lx, for daylight factors";

/// Job as figures describe it, from the data that are kept of every job.
pub struct Subject {
    /// Document; `None` for a job that an older version accepted and this one would refuse.
    pub document: Option<ValidJob>,
    /// Triangles of the meshes of objects and tubes; `None` for a job without meshes, and where they are not known.
    pub meshes: Option<MeshesResult>,
    /// Times that each method would take, where a pilot was requested before the job ran.
    pub predictions: Option<Predictions>,
    /// Method of the grids, in words.
    pub grids_method: Option<String>,
    /// Method of the views, in words.
    pub views_method: Option<String>,
    /// Name and version of the program, and the beginning of the hash of the document.
    pub origin: String,
}

/// Digits of the hash of a document that figures and reports have.
const DIGITS_OF_HASH: usize = 12;

impl Subject {
    /// Reads a document with its defaults filled in and its plan, both as the service returns them.
    pub fn new(document: &Value, plan: &Value) -> Self {
        let methods = PlanResult::deserialize(plan).ok().map(|plan| plan.methods);
        let [grids_method, views_method] = methods.map_or([None, None], |methods| [methods.grids, methods.views]);
        let [grids_method, views_method] =
            [grids_method, views_method].map(|method| method.map(|method| in_words(&method.name)));
        let hash = canonical_hash(document).ok().and_then(|hash| Some(hash.get(..DIGITS_OF_HASH)?.to_owned()));
        let origin =
            hash.map_or_else(|| format!("skyduct {VERSION}"), |hash| format!("skyduct {VERSION} · document {hash}"));
        let document = JobDocument::from_value(document.clone()).ok();
        Self { document, meshes: None, predictions: None, grids_method, views_method, origin }
    }

    /// Makes the heading of a figure of the job.
    pub fn heading(&self, title: impl Into<String>, lines: Vec<String>) -> Heading {
        Heading { title: title.into(), lines, origin: self.origin.clone() }
    }

    /// Adds the meshes of the job.
    #[must_use]
    pub fn with_meshes(self, meshes: Option<MeshesResult>) -> Self {
        Self { meshes, ..self }
    }

    /// Adds the times that were predicted for the job.
    #[must_use]
    pub fn foretold(self, predictions: Option<Predictions>) -> Self {
        Self { predictions, ..self }
    }

    /// Returns the name of the job, or "unnamed job".
    pub fn name(&self) -> &str {
        self.document.as_ref().and_then(|document| document.name.as_deref()).unwrap_or("unnamed job")
    }

    /// Describes place, time and sky in one line.
    pub fn circumstances(&self) -> String {
        let Some(document) = &self.document else { return String::new() };
        let sky = document.sky.as_ref();
        let sun = sky.and_then(|sky| sky.sun_position.as_ref());
        let sun = sun.map(|sun| format!("sun at altitude {}°, azimuth {}°", sun.altitude_deg, sun.azimuth_deg));
        let pieces = [
            document.location.as_ref().map(|location| place(location.latitude_deg, location.longitude_deg)),
            document.time.as_deref().map(time),
            sun,
            Some(match sky.and_then(|sky| sky.sky_type(DVec3::Z, None)) {
                Some(sky) => sky_in_words(sky),
                None if document.annual.is_some() => OF_DAYLIGHT_FACTORS.to_owned(),
                None => "no sky".to_owned(),
            }),
        ];
        pieces.into_iter().flatten().collect::<Vec<_>>().join(SEPARATOR)
    }
}

/// Names the method after something that it computed; returns no text where it is not known.
pub fn by(method: &Option<String>) -> String {
    method.as_ref().map_or_else(String::new, |method| format!("{SEPARATOR}by {method}"))
}

fn in_words(name: &str) -> String {
    name.replace('_', " ")
}

/// Formats a latitude and a longitude in degrees, north and east positive.
pub(super) fn place(latitude_deg: f64, longitude_deg: f64) -> String {
    let side = |degrees: f64, positive: &str, negative: &str| {
        format!("{:.2}° {}", degrees.abs(), if degrees < 0.0 { negative } else { positive })
    };
    format!("{}, {}", side(latitude_deg, "N", "S"), side(longitude_deg, "E", "W"))
}

/// Formats date, time and offset as they are written, without seconds where these are zero.
fn time(text: &str) -> String {
    // what is no time was refused when the document was read
    if text.parse::<Timestamp>().is_err() {
        return text.to_owned();
    }
    let (date, rest) = text.split_at_checked(10).unwrap_or((text, ""));
    let rest = rest.trim_start_matches(['T', 't', ' ']);
    let begins_offset = |character: char| matches!(character, '+' | '-' | 'Z' | 'z');
    let (clock, offset) = rest.split_at(rest.find(begins_offset).unwrap_or(rest.len()));
    let clock = if clock.len() == 8 { clock.strip_suffix(":00").unwrap_or(clock) } else { clock };
    let offset = if matches!(offset, "Z" | "z") { "UTC" } else { offset };
    format!("{date} {clock} {offset}").trim_end().to_owned()
}

fn sky_in_words(sky: SkyType) -> String {
    match sky {
        SkyType::Cie(cie) => format!("{} (CIE type {})", cie.description(), cie.number()),
        SkyType::Ies(ies) => format!("{} sky", in_words(ies.name())),
        SkyType::Free(_) => sky.to_string(),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use serde_json::json;

    use super::*;

    /// Returns the document of a room with a tube, a grid and a location.
    pub fn document() -> Value {
        json!({
            "name": "bath", "location": { "latitude_deg": 55.676, "longitude_deg": -12.568 },
            "time": "2026-03-21T12:00:00+01:00", "sky": { "cie_type": 12 }, "room": { "size_m": [4, 6, 2.7] },
            "grids": [{ "name": "floor", "height_m": 0.8, "cells": [2, 2] }], "stop": { "relative_error": 0.01 },
            "tubes": [{ "centre_m": [1.5, 1.5], "diameter_m": 0.3, "reflectance": 0.98, "segments": [{ "length_m": 1 }],
                        "collector": { "kind": "open" }, "diffuser": { "kind": "lambertian", "transmittance": 0.6 } }]
        })
    }

    #[test]
    fn a_job_is_named_by_what_explains_its_numbers() {
        let document = document();
        let method = |name: &str| json!({ "name": name, "settings": {}, "reason": "" });
        let plan =
            json!({ "effects": [], "guides": [], "methods": { "grids": method("light_tracing"), "views": null } });
        let subject = Subject::new(&document, &plan);
        assert_eq!(subject.name(), "bath");
        assert_eq!((subject.grids_method.as_deref(), &subject.views_method), (Some("light tracing"), &None));
        let words = subject.circumstances();
        assert!(words.starts_with("55.68° N, 12.57° W · 2026-03-21 12:00 +01:00 · "), "{words}");
        assert!(words.ends_with("(CIE type 12)"), "{words}");
        let mut of_a_year = document.clone();
        let fields = of_a_year.as_object_mut().unwrap();
        fields.retain(|field, _| !["sky", "location", "time"].contains(&field.as_str()));
        fields.insert("annual".to_owned(), json!({ "weather": "a.epw" }));
        assert_eq!(Subject::new(&of_a_year, &plan).circumstances(), OF_DAYLIGHT_FACTORS);
        let unknown = Subject::new(&json!({ "no": "job" }), &json!(null));
        assert_eq!((unknown.name(), unknown.circumstances().as_str()), ("unnamed job", ""));
    }

    #[test]
    fn times_are_written_short() {
        for (text, written) in [
            ("2011-09-15T15:00:00+02:00", "2011-09-15 15:00 +02:00"),
            ("2011-09-15T15:00:30Z", "2011-09-15 15:00:30 UTC"),
            ("2011-09-15T15:00:00Z", "2011-09-15 15:00 UTC"),
            ("noon", "noon"),
        ] {
            assert_eq!(time(text), written);
        }
    }
}

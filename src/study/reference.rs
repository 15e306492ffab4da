//! Reference that the runs of a study are compared with: a job of its own, or given values.

use serde::{Deserialize, Serialize};
use serde_json::Value;
use utoipa::ToSchema;

use super::compare::Values;
use crate::document::limits::LIGHT;
use crate::document::{FieldError, FieldErrorCode, MethodKind};

/// Reference of a study: a job by a method at an error, or `grids` alone with values from another source.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct ReferenceRequest {
    /// Name of the method; default: `auto`. A method without bias is best. The seed differs from those of all runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(value_type = Option<MethodKind>)]
    pub method: Option<String>,
    /// Relative error at the job's confidence; default: a quarter of the smallest one of the runs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0, exclusive_maximum = 1)]
    pub relative_error: Option<f64>,
    /// Seconds of rendering after which the reference ends in any case; default: ten times those of a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schema(exclusive_minimum = 0)]
    pub seconds: Option<f64>,
    /// Given values of every grid, in the job's order; no reference is rendered then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grids: Option<Vec<KnownGrid>>,
}

/// Given values of a grid, as in results: row j from south to north, column i from west to east.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, ToSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownGrid {
    /// Illuminance of each sensor in lux, row by row; null inside solids, as in results.
    pub illuminance_lux: Vec<Vec<Option<f64>>>,
    /// Standard error of each illuminance in lux; absent if they are exact.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub standard_error_lux: Option<Vec<Vec<Option<f64>>>>,
}

impl ReferenceRequest {
    /// Returns the given values; `None` if a job is to compute them.
    pub fn known(&self) -> Option<Values> {
        self.grids.as_deref().map(values)
    }

    /// Adds the faults of the reference of a study of `job` to `errors`, with pointers into the request.
    pub fn check(&self, job: &Value, errors: &mut Vec<FieldError>) {
        let out_of_range = |pointer: &str, detail: String| {
            FieldError::new(format!("/reference/{pointer}"), detail).coded(FieldErrorCode::OutOfRange)
        };
        if let Some(error) = self.relative_error.filter(|error| !(*error > 0.0 && *error < 1.0)) {
            errors.push(out_of_range("relative_error", format!("must be > 0 and < 1, but is {error}")));
        }
        if let Some(seconds) = self.seconds.filter(|seconds| !(*seconds > 0.0 && seconds.is_finite())) {
            errors.push(out_of_range("seconds", format!("must be > 0, but is {seconds}")));
        }
        let Some(grids) = &self.grids else { return };
        for (name, is_given) in [
            ("method", self.method.is_some()),
            ("relative_error", self.relative_error.is_some()),
            ("seconds", self.seconds.is_some()),
        ] {
            if is_given {
                let detail = "must be left out, because /reference/grids gives the values of the reference and nothing \
                              is rendered for it";
                errors.push(FieldError::new(format!("/reference/{name}"), detail));
            }
        }
        let of_job = job["grids"].as_array().map_or(&[][..], Vec::as_slice);
        if grids.len() != of_job.len() {
            let detail =
                format!("must have one entry for each of the job's {} grids, but has {}", of_job.len(), grids.len());
            errors.push(FieldError::new("/reference/grids", detail));
        }
        for (index, (grid, of_job)) in grids.iter().zip(of_job).enumerate() {
            let lists = [("illuminance_lux", Some(&grid.illuminance_lux))]
                .into_iter()
                .chain([("standard_error_lux", grid.standard_error_lux.as_ref())]);
            for (name, rows) in lists.filter_map(|(name, rows)| Some((name, rows?))) {
                errors.extend(wrong(rows, &of_job["cells"], &format!("/reference/grids/{index}/{name}")));
            }
        }
    }
}

/// Converts given values of grids; values inside solids become NaN, and absent errors zero.
pub fn values(grids: &[KnownGrid]) -> Values {
    let numbers =
        |rows: &[Vec<Option<f64>>]| rows.concat().into_iter().map(|value| value.unwrap_or(f64::NAN)).collect();
    let errors = |grid: &KnownGrid| match &grid.standard_error_lux {
        Some(errors) => numbers(errors),
        None => vec![0.0; grid.illuminance_lux.iter().map(Vec::len).sum()],
    };
    Values {
        lux: grids.iter().flat_map(|grid| -> Vec<f64> { numbers(&grid.illuminance_lux) }).collect(),
        errors: grids.iter().flat_map(errors).collect(),
        grids: grids.iter().map(|grid| grid.illuminance_lux.iter().map(Vec::len).sum()).collect(),
        degrees_of_freedom: f64::INFINITY,
    }
}

/// Returns the first fault of the rows of a grid of `cells`: a wrong number of values, or a value out of its range.
fn wrong(rows: &[Vec<Option<f64>>], cells: &Value, pointer: &str) -> Option<FieldError> {
    let [columns, lines] = [0, 1].map(|axis| cells[axis].as_u64().unwrap_or(0) as usize);
    if rows.len() != lines || rows.iter().any(|row| row.len() != columns) {
        return Some(FieldError::new(
            pointer,
            format!("must have {lines} rows of {columns} numbers, one for each cell of the grid"),
        ));
    }
    let places = rows.iter().enumerate().flat_map(|(j, row)| row.iter().enumerate().map(move |(i, lux)| (j, i, *lux)));
    places.filter_map(|(j, i, lux)| Some((j, i, lux?))).find(|(.., lux)| !LIGHT.contains(*lux)).map(|(j, i, lux)| {
        FieldError::new(format!("{pointer}/{j}/{i}"), format!("must be {LIGHT}, but is {lux}"))
            .coded(FieldErrorCode::OutOfRange)
    })
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn request(reference: Value) -> ReferenceRequest {
        serde_json::from_value(reference).unwrap()
    }

    #[test]
    fn known_values_have_the_shape_of_the_grids() {
        let job = json!({ "grids": [{ "cells": [2, 1] }] });
        let pointers = |reference: Value| {
            let mut errors = Vec::new();
            request(reference).check(&job, &mut errors);
            errors.into_iter().map(|error| error.pointer).collect::<Vec<_>>()
        };
        let good = json!({ "grids": [{ "illuminance_lux": [[1, 2]], "standard_error_lux": [[0.1, 0.2]] }] });
        assert_eq!(pointers(good.clone()), [""; 0]);
        let values = request(good).known().unwrap();
        assert_eq!((values.lux, values.errors, values.grids), (vec![1.0, 2.0], vec![0.1, 0.2], vec![2]));
        assert_eq!(
            pointers(json!({ "grids": [{ "illuminance_lux": [[1], [2]] }] })),
            ["/reference/grids/0/illuminance_lux"]
        );
        assert_eq!(
            pointers(json!({ "grids": [{ "illuminance_lux": [[1, -2]] }] })),
            ["/reference/grids/0/illuminance_lux/0/1"]
        );
        assert_eq!(pointers(json!({ "grids": [] })), ["/reference/grids"]);
        let both = json!({ "method": "auto", "grids": [{ "illuminance_lux": [[1, 2]] }] });
        assert_eq!(pointers(both), ["/reference/method"]);
        assert_eq!(
            pointers(json!({ "relative_error": 1, "seconds": 0 })),
            ["/reference/relative_error", "/reference/seconds"]
        );
    }
}

//! JSON values in words, as a report prints them: names without underscores, and units after their numbers.

use serde_json::Value;

use crate::figure::sheet::NO_VALUE;
use crate::figure::ticks::{significant, with_error};

/// Suffixes of field names that are units, each with its written form; a suffix stands before shorter ones with which it ends.
const UNITS: [(&str, &str); 8] = [
    ("_cd_m2", " cd/m²"),
    ("_per_m", " per m"),
    ("_percent", " %"),
    ("_seconds", " s"),
    ("_deg", "°"),
    ("_lux", " lx"),
    ("_lm", " lm"),
    ("_m", " m"),
];

/// Names of angles that are left out when they are zero, since nothing is turned then.
const QUIET_AT_ZERO: [&str; 3] = ["tilt_deg", "azimuth_deg", "rotation_deg"];

/// Largest number of list entries that are printed.
const MOST: usize = 6;

/// Returns the items of a JSON list; none of another value.
pub fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

/// Returns a JSON text; empty for another value.
pub fn text(value: &Value) -> &str {
    value.as_str().unwrap_or("")
}

/// Writes a value with half the width of its interval, unless that is only the rounding of an exact value.
pub fn with_interval(value: &Value, standard_error: &Value, coverage_factor: &Value) -> String {
    let Some(value) = value.as_f64() else { return NO_VALUE.to_owned() };
    let half = standard_error.as_f64().zip(coverage_factor.as_f64()).map(|(error, factor)| factor * error);
    half.filter(|half| *half > 1e-9 * value.abs()).map_or_else(|| significant(value, 4), |half| with_error(value, half))
}

/// Writes a JSON value in words: of an object its `kind` first, then its other fields; null fields are left out.
///
/// A dome of transmittance 0.9 is "dome, transmittance 0.9".
pub fn in_words(value: &Value) -> String {
    match value {
        Value::Object(fields) => {
            let kind = fields.get("kind").and_then(Value::as_str).map(words_of);
            let is_said = |name: &str, value: &Value| {
                name != "kind" && !value.is_null() && !(QUIET_AT_ZERO.contains(&name) && value.as_f64() == Some(0.0))
            };
            let others = fields.iter().filter(|(name, value)| is_said(name, value));
            kind.into_iter().chain(others.map(|(name, value)| quantity(name, value))).collect::<Vec<_>>().join(", ")
        }
        Value::Array(values) => {
            let told: Vec<String> = values.iter().take(MOST).map(in_words).collect();
            let more = values.len().saturating_sub(MOST);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            format!("{}{more}", told.join(if values.iter().all(Value::is_number) { ", " } else { " + " }))
        }
        Value::String(text) => words_of(text),
        Value::Number(number) => number.as_f64().map_or_else(|| number.to_string(), number_in_words),
        Value::Bool(true) => "yes".to_owned(),
        Value::Bool(false) => "no".to_owned(),
        Value::Null => NO_VALUE.to_owned(),
    }
}

/// Writes a field in words: `diameter_m` of 0.3 is "diameter 0.3 m".
pub fn quantity(name: &str, value: &Value) -> String {
    if value.is_number() {
        for (end, unit) in UNITS {
            if let Some(name) = name.strip_suffix(end) {
                return format!("{} {}{unit}", words_of(name), in_words(value));
            }
        }
    }
    match value {
        Value::Bool(true) => words_of(name),
        Value::Bool(false) => format!("not {}", words_of(name)),
        Value::Object(_) => format!("{} ({})", words_of(name), in_words(value)),
        Value::Array(values) if !values.iter().all(Value::is_number) => {
            format!("{} ({})", words_of(name), in_words(value))
        }
        other => format!("{} {}", words_of(name), in_words(other)),
    }
}

fn words_of(name: &str) -> String {
    name.replace("dv_ev", "Dv/Ev").replace('_', " ")
}

/// Writes a number with at most five significant digits.
fn number_in_words(value: f64) -> String {
    let rounded = format!("{value:.4e}").parse().unwrap_or(value);
    if rounded == 0.0 || rounded.abs() >= 1e-4 { rounded.to_string() } else { format!("{rounded:e}") }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn objects_are_told_with_their_units() {
        let tube = json!({
            "diameter_m": 0.35, "reflectance": 0.98, "rotation": null, "rotation_deg": 0,
            "segments": [{ "length_m": 0.5 }, { "length_m": 1.25, "tilt_deg": 30.0 }],
            "collector": { "kind": "dielectric_dome", "thickness_m": 0.003, "absorption_per_m": 12.34567 }
        });
        assert_eq!(
            in_words(&tube),
            "collector (dielectric dome, absorption 12.346 per m, thickness 0.003 m), diameter 0.35 m, reflectance 0.98, \
             segments (length 0.5 m + length 1.25 m, tilt 30°)"
        );
        assert_eq!(in_words(&json!([1, 2, 3, 4, 5, 6, 7])), "1, 2, 3, 4, 5, 6 and 1 more");
        assert_eq!(quantity("max_seconds", &json!(600.0)), "max 600 s");
        assert_eq!(
            [json!(1e-7), json!(18234.56789), json!(0), json!(true)].map(|value| in_words(&value)),
            ["1e-7", "18235", "0", "yes"]
        );
    }
}

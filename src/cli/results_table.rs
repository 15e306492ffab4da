//! What came out of a job, as a small table for a terminal.

use std::io::Write as _;

use serde_json::Value;

/// Prints the table to standard output.
pub fn print_results(job: &Value) {
    // whoever reads it may have gone away
    let _ = std::io::stdout().write_all(results_table(job).as_bytes());
}

/// The grids and tubes of a finished job, of its resource or its `result.json`; empty when nothing was computed.
fn results_table(job: &Value) -> String {
    let mut text = String::new();
    let grids = list(&job["grids"]);
    let with_factors = grids.iter().any(|grid| grid["statistics"]["daylight_factor_percent"].is_object());
    let mut head = vec!["grid", "mean, lux", "median, lux", "minimum, lux", "uniformity"];
    if with_factors {
        head.push("daylight factor, %: mean, median, minimum");
    }
    let rows = grids.iter().map(|grid| {
        let statistics = &grid["statistics"];
        let of = |name: &str| with_error(&statistics[name], &statistics[format!("{name}_standard_error")]);
        let mut row = vec![text_of(&grid["name"]), of("mean_lux"), of("median_lux"), of("min_lux"), of("uniformity")];
        if with_factors {
            let factors = &statistics["daylight_factor_percent"];
            let all = ["mean", "median", "minimum"].map(|name| with_error(&factors[name], &Value::Null));
            row.push(all.join(", "));
        }
        row
    });
    table(&mut text, head, rows.collect());
    let tubes = list(&job["tubes"]).iter().enumerate().map(|(index, tube)| {
        let flux = &tube["into_room"];
        let efficiency = tube["transmission_efficiency"].as_f64().map(|efficiency| (100.0 * efficiency).into());
        let efficiency = with_error(&efficiency.unwrap_or(Value::Null), &Value::Null);
        vec![index.to_string(), with_error(&flux["flux_lm"], &flux["standard_error_lm"]), efficiency]
    });
    if let Some(verdict) = job["cross_check"]["verdict"].as_str() {
        text.push_str(&format!("second opinion: {verdict}\n"));
    }
    table(&mut text, vec!["tube", "into the room, lm", "efficiency, %"], tubes.collect());
    text
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn text_of(value: &Value) -> String {
    value.as_str().unwrap_or("?").to_owned()
}

/// Adds a head and rows in columns; nothing without rows.
pub(super) fn table(text: &mut String, head: Vec<&str>, rows: Vec<Vec<String>>) {
    if rows.is_empty() {
        return;
    }
    let head = head.into_iter().map(str::to_owned).collect::<Vec<_>>();
    let width = |column: usize| rows.iter().chain([&head]).map(|row| row[column].len()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    for row in [&head].into_iter().chain(&rows) {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, width)| format!("{cell:<width$}")).collect();
        text.push_str(cells.join("  ").trim_end());
        text.push('\n');
    }
}

/// A number with as many digits as its error leaves it: two of the error are shown. `-` when there is no number.
fn with_error(value: &Value, error: &Value) -> String {
    let Some(value) = value.as_f64() else { return "-".to_owned() };
    match error.as_f64() {
        Some(error) if error > 0.0 => {
            let decimals = decimals(error, 2);
            format!("{value:.decimals$} +- {error:.decimals$}")
        }
        _ => format!("{value:.0$}", decimals(value, 4)),
    }
}

/// Decimals that show `digits` significant digits of `value`, at most 6.
fn decimals(value: f64, digits: i32) -> usize {
    let first = if value == 0.0 { 0 } else { libm::log10(value.abs()).floor() as i32 };
    (digits - 1 - first).clamp(0, 6) as usize
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn digits_follow_the_error() {
        for (value, error, text) in [
            (json!(211.0437), json!(0.3142), "211.04 +- 0.31"),
            (json!(2884.3), json!(41.7), "2884 +- 42"),
            (json!(0.2431), json!(0.00123), "0.2431 +- 0.0012"),
            (json!(70.12345), json!(null), "70.12"),
            (json!(70.12345), json!(0.0), "70.12"),
            (json!(0.0), json!(null), "0.000"),
            (json!(null), json!(null), "-"),
        ] {
            assert_eq!(with_error(&value, &error), text);
        }
    }

    #[test]
    fn grids_and_tubes_stand_in_columns() {
        let job = json!({
            "grids": [
                { "name": "floor", "statistics": { "mean_lux": 211.04, "mean_lux_standard_error": 0.31, "median_lux": 187.2,
                    "median_lux_standard_error": 1.1, "min_lux": 51.0, "min_lux_standard_error": 0.9, "uniformity": 0.242,
                    "uniformity_standard_error": 0.0047,
                    "daylight_factor_percent": { "mean": 0.407, "median": 0.403, "minimum": 0.255 } } },
                { "name": "a", "statistics": { "mean_lux": 0.0, "uniformity": null } } ],
            "tubes": [{ "into_room": { "flux_lm": 2884.0, "standard_error_lm": 4.2 }, "transmission_efficiency": 0.481 },
                      { "into_room": null, "transmission_efficiency": null }]
        });
        let text = results_table(&job);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 6, "{text}");
        assert_eq!(
            lines[1],
            "floor  211.04 +- 0.31  187.2 +- 1.1  51.00 +- 0.90  0.2420 +- 0.0047  0.4070, 0.4030, 0.2550"
        );
        assert_eq!(lines[2], "a      0.000           -             -              -                 -, -, -");
        assert_eq!(lines[4], "0     2884.0 +- 4.2      48.10");
        assert_eq!(lines[5], "1     -                  -");
        assert_eq!(results_table(&json!({ "status": "cancelled" })), "");
    }
}

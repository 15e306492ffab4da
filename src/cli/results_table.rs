//! Results of a job as a small table for a terminal.

use std::io::Write as _;

use serde_json::Value;

/// Prints the table to standard output.
pub fn print_results(job: &Value) {
    // the reader of the pipe may be gone
    let _ = std::io::stdout().write_all(results_table(job).as_bytes());
}

/// Formats the grids and tubes of a finished job, from its resource or its `result.json`; empty when nothing was computed.
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
        let of = |name: &str| {
            with_interval(
                &statistics[name],
                &statistics[format!("{name}_standard_error")],
                &statistics["coverage_factor"],
            )
        };
        let mut row = vec![text_of(&grid["name"]), of("mean_lux"), of("median_lux"), of("min_lux"), of("uniformity")];
        if with_factors {
            let factors = &statistics["daylight_factor_percent"];
            let all =
                ["mean", "median", "minimum"].map(|name| with_interval(&factors[name], &Value::Null, &Value::Null));
            row.push(all.join(", "));
        }
        row
    });
    table(&mut text, head, rows.collect());
    let tubes = list(&job["tubes"]).iter().map(|tube| {
        let flux = &tube["into_room"];
        let percent = |name: &str| tube[name].as_f64().map_or(Value::Null, |share| (100.0 * share).into());
        let [efficiency, error] = ["transmission_efficiency", "transmission_efficiency_standard_error"].map(percent);
        let efficiency = with_interval(&efficiency, &error, &flux["coverage_factor"]);
        let lm = with_interval(&flux["flux_lm"], &flux["standard_error_lm"], &flux["coverage_factor"]);
        (flux["flux_lm"].as_f64().unwrap_or_default(), [lm, efficiency])
    });
    if let Some(verdict) = job["cross_check"]["verdict"].as_str() {
        text.push_str(&format!("cross-check: {verdict}\n"));
    }
    table_of_tubes(&mut text, ["into the room, lm", "efficiency, %"], tubes.collect());
    if text.contains(" +- ") {
        text.push_str("+- is the half-width of the 95 % confidence interval\n");
    }
    text
}

fn list(value: &Value) -> &[Value] {
    value.as_array().map_or(&[], Vec::as_slice)
}

fn text_of(value: &Value) -> String {
    value.as_str().unwrap_or("?").to_owned()
}

/// Adds a header and rows in aligned columns; adds nothing without rows.
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

/// Largest number of tubes of which each has a row.
const MOST_TUBES: usize = 12;

/// Adds a table of the tubes, counted from 1, each with its light and the cells of its row: of many only those with the least and the most
/// light.
pub(super) fn table_of_tubes<const N: usize>(text: &mut String, head: [&str; N], tubes: Vec<(f64, [String; N])>) {
    let light = |number: &usize| tubes[*number].0;
    let row = |number: usize, remark: &str| {
        let cells = tubes[number].1.iter().cloned();
        std::iter::once(format!("{}{remark}", number + 1)).chain(cells).collect::<Vec<_>>()
    };
    let by_light = |one: &usize, other: &usize| light(one).total_cmp(&light(other));
    let ends = [(0..tubes.len()).min_by(by_light), (0..tubes.len()).max_by(by_light)];
    let is_long = tubes.len() > MOST_TUBES;
    let rows = match ends {
        [Some(least), Some(most)] if is_long => vec![row(least, ", least"), row(most, ", most")],
        _ => (0..tubes.len()).map(|number| row(number, "")).collect(),
    };
    table(text, std::iter::once("tube").chain(head).collect(), rows);
    if is_long {
        text.push_str(&format!("the results have each of the {} tubes\n", tubes.len()));
    }
}

/// Formats a number with the half width of its 95 % confidence interval, to two significant digits of the latter; with four
/// significant digits where there is none, and as `-` without a number.
fn with_interval(value: &Value, error: &Value, coverage_factor: &Value) -> String {
    let Some(value) = value.as_f64() else { return "-".to_owned() };
    match error.as_f64().zip(coverage_factor.as_f64()) {
        Some((error, factor)) if error * factor > 1e-9 * value.abs() => {
            let half = error * factor;
            let decimals = decimals(half, 2);
            format!("{value:.decimals$} +- {half:.decimals$}")
        }
        _ => format!("{value:.0$}", decimals(value, 4)),
    }
}

/// Returns the number of decimals that show `digits` significant digits of `value`, at most 6.
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
            (json!(211.0437), json!(0.3142), "211.04 +- 0.63"),
            (json!(2884.3), json!(41.7), "2884 +- 83"),
            (json!(0.2431), json!(0.00123), "0.2431 +- 0.0025"),
            (json!(70.12345), json!(null), "70.12"),
            (json!(70.12345), json!(0.0), "70.12"),
            (json!(0.0), json!(null), "0.000"),
            (json!(null), json!(null), "-"),
        ] {
            assert_eq!(with_interval(&value, &error, &json!(2.0)), text);
        }
    }

    #[test]
    fn grids_and_tubes_stand_in_columns() {
        let job = json!({
            "grids": [
                { "name": "floor", "statistics": { "mean_lux": 211.04, "mean_lux_standard_error": 0.31, "median_lux": 187.2,
                    "median_lux_standard_error": 1.1, "min_lux": 51.0, "min_lux_standard_error": 0.9, "uniformity": 0.242,
                    "uniformity_standard_error": 0.0047, "coverage_factor": 2.0,
                    "daylight_factor_percent": { "mean": 0.407, "median": 0.403, "minimum": 0.255 } } },
                { "name": "a", "statistics": { "mean_lux": 0.0, "uniformity": null } } ],
            "tubes": [{ "into_room": { "flux_lm": 2884.0, "standard_error_lm": 4.2, "coverage_factor": 2.0 }, "transmission_efficiency": 0.481 },
                      { "into_room": null, "transmission_efficiency": null }]
        });
        let text = results_table(&job);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 7, "{text}");
        assert_eq!(lines[6], "+- is the half-width of the 95 % confidence interval");
        assert_eq!(
            lines[1],
            "floor  211.04 +- 0.62  187.2 +- 2.2  51.0 +- 1.8   0.2420 +- 0.0094  0.4070, 0.4030, 0.2550"
        );
        assert_eq!(lines[2], "a      0.000           -             -             -                 -, -, -");
        assert_eq!(lines[4], "1     2884.0 +- 8.4      48.10");
        assert_eq!(lines[5], "2     -                  -");
        assert_eq!(results_table(&json!({ "status": "cancelled" })), "");
    }

    #[test]
    fn of_many_tubes_two_have_a_row() {
        let tube = |number: usize| (((number + 20) % 40) as f64, [number.to_string()]);
        let mut text = String::new();
        table_of_tubes(&mut text, ["lm"], (0..40).map(tube).collect());
        let lines = ["tube       lm", "21, least  20", "20, most   19", "the results have each of the 40 tubes"];
        assert_eq!(text.lines().collect::<Vec<_>>(), lines);
    }
}

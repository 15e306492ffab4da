//! Predicted time of each method to each accuracy, as a table for a terminal.

use std::fmt::Write as _;

use super::results_table::table;
use crate::figure::ticks::FARTHEST_SECONDS;
use crate::predict::predictions::{
    MethodPredictions, OutputPredictions, PREDICTED_ACCURACIES, PredictedTime, Predictions,
};

/// Formats the tables of the grids and of the views, each followed by the methods without a prediction and their reasons.
pub fn predictions_table(predictions: &Predictions) -> String {
    let Predictions { pilot_seconds, threads, confidence, grids, views } = predictions;
    let mut text = String::new();
    // writing to a string cannot fail
    let _ = writeln!(
        text,
        "predicted seconds to each relative error (at {:.0} % confidence) on {threads} otherwise idle threads, from \
         trials of {pilot_seconds:.2} s; * cheapest",
        100.0 * confidence
    );
    for (name, output) in [("grids", grids), ("views", views)] {
        if let Some(output) = output {
            add_output(&mut text, name, output);
        }
    }
    text
}

fn add_output(text: &mut String, output_name: &str, output: &OutputPredictions) {
    let head: Vec<String> = [output_name.to_owned(), "first value".to_owned()]
        .into_iter()
        .chain(PREDICTED_ACCURACIES.iter().map(|accuracy| format!("{} %", percent(*accuracy))))
        .collect();
    let name = |row: &MethodPredictions| format!("{}{}", row.method, if row.planned { " (planned)" } else { "" });
    let rows = output.methods.iter().filter(|row| is_known(row)).map(|row| {
        let first = row.seconds_to_first_number.map_or("?".to_owned(), seconds);
        [name(row), first].into_iter().chain(row.accuracies.iter().map(cell)).collect()
    });
    let rows: Vec<Vec<String>> = rows.collect();
    if rows.is_empty() {
        text.push_str(&format!("{output_name}\n"));
    }
    table(text, head.iter().map(String::as_str).collect(), rows);
    let unknown = output.methods.iter().filter_map(|row| {
        let (from, reason) = first_reason(row)?;
        let from = if is_known(row) { format!(" from {} % on", percent(from)) } else { String::new() };
        Some((if is_known(row) { row.method.clone() } else { name(row) }, format!("unknown{from}: {reason}")))
    });
    let refused = output.methods.iter().filter_map(|row| {
        let refusal = row.refusal.as_ref()?;
        Some((name(row), format!("refused ({}): {}", refusal.code.0, refusal.detail)))
    });
    for (methods, reason) in by_reason(unknown).into_iter().chain(by_reason(refused)) {
        let _ = writeln!(text, "  {}: {reason}", methods.join(", "));
    }
    if let Some(cheapest) = &output.cheapest {
        let _ = writeln!(text, "  cheapest to the requested {} %: {cheapest}", percent(output.asked_relative_error));
    }
}

/// True if any time of the method was predicted.
fn is_known(row: &MethodPredictions) -> bool {
    row.seconds_to_first_number.is_some() || row.accuracies.iter().any(|time| time.seconds.is_some())
}

/// Groups methods by their reason, in the order of the first method of each reason.
fn by_reason(said: impl Iterator<Item = (String, String)>) -> Vec<(Vec<String>, String)> {
    let mut groups: Vec<(Vec<String>, String)> = Vec::new();
    for (method, reason) in said {
        match groups.iter_mut().find(|(_, known)| *known == reason) {
            Some((methods, _)) => methods.push(method),
            None => groups.push((vec![method], reason)),
        }
    }
    groups
}

/// Returns the first accuracy whose time could not be predicted, and the reason.
fn first_reason(row: &MethodPredictions) -> Option<(f64, &str)> {
    row.accuracies.iter().find_map(|time| Some((time.relative_error, time.reason.as_deref()?)))
}

fn cell(time: &PredictedTime) -> String {
    let Some(expected) = time.seconds else { return "?".to_owned() };
    let from = time.seconds_from.map_or(String::new(), seconds);
    let to = time.seconds_to.map_or(String::new(), seconds);
    format!("{} ({from}..{to}){}", seconds(expected), if time.cheapest { " *" } else { "" })
}

/// Formats seconds with two significant digits, or as `> 1 h` beyond an hour.
fn seconds(value: f64) -> String {
    if value > FARTHEST_SECONDS {
        return "> 1 h".to_owned();
    }
    let first = if value > 0.0 { libm::log10(value).floor() as i32 } else { 0 };
    let decimals = (1 - first).clamp(0, 4) as usize;
    format!("{value:.decimals$}")
}

fn percent(share: f64) -> f64 {
    // 0.001 is 0.1 %, without a rounding error
    (1e6 * share).round() / 1e4
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::document::RefusalName;
    use crate::integrator::method::RefusalCode;
    use crate::predict::predictions::RefusalResult;

    #[test]
    fn the_cheapest_is_marked_and_what_is_not_known_has_its_reason() {
        let row = |method: &str, seconds: f64| MethodPredictions {
            method: method.to_owned(),
            planned: method == "light_tracing",
            refusal: None,
            seconds_to_first_number: Some(0.1 * seconds),
            asked: Some(PredictedTime::known(0.02, seconds, seconds, None, Some(8))),
            accuracies: PREDICTED_ACCURACIES
                .iter()
                .map(|accuracy| match *accuracy > 0.001 {
                    true => PredictedTime::known(*accuracy, seconds, 0.5 * seconds, Some(2.0 * seconds), Some(8)),
                    false => PredictedTime::unknown(*accuracy, "no time"),
                })
                .collect(),
        };
        let refusal = RefusalResult { code: RefusalName(RefusalCode::Colours), detail: "it sees none".to_owned() };
        let refused = MethodPredictions {
            refusal: Some(refusal),
            seconds_to_first_number: None,
            asked: None,
            accuracies: Vec::new(),
            ..row("holigilm", 1.0)
        };
        let untried = |method: &str, reason: &str| MethodPredictions {
            seconds_to_first_number: None,
            accuracies: PREDICTED_ACCURACIES.map(|accuracy| PredictedTime::unknown(accuracy, reason)).to_vec(),
            ..row(method, 1.0)
        };
        let output = OutputPredictions::new(
            0.02,
            vec![
                row("light_tracing", 0.031),
                row("sppm", 1.2),
                refused.clone(),
                untried("ppm", "no trial"),
                untried("two_stage", "no trial"),
                MethodPredictions { method: "jenkins".to_owned(), ..refused },
            ],
        );
        let predictions =
            Predictions { pilot_seconds: 0.16, threads: 2, confidence: 0.95, grids: Some(output), views: None };
        let text = predictions_table(&predictions);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 8, "{text}");
        assert!(lines[1].starts_with("grids") && lines[1].ends_with("0.1 %"), "{text}");
        assert!(lines[2].starts_with("light_tracing (planned)  0.0031       0.031 (0.015..0.062) *"), "{text}");
        assert!(lines[3].contains("1.2 (0.60..2.4)") && !lines[3].contains('*') && lines[3].ends_with('?'), "{text}");
        // what is said of several methods is said once
        assert_eq!(lines[4], "  light_tracing, sppm: unknown from 0.1 % on: no time");
        assert_eq!(lines[5], "  ppm, two_stage: unknown: no trial");
        assert_eq!(lines[6], "  holigilm, jenkins: refused (colours): it sees none");
    }
}

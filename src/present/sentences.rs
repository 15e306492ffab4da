//! Sentences of a report: what the light in the room is, and whether it is enough.

use serde_json::Value;

use super::phrases::{list, text, with_interval};
use super::target::{JudgedTarget, TargetPart};
use crate::document::result::Verdict;
use crate::figure::sheet::Tone;
use crate::figure::ticks::{fixed, short, significant};

/// Largest number of grids that have a sentence.
const MOST: usize = 3;

/// Returns a sentence for each of the first grids of a job, which is given as the service returns it; `targets` are those of its grids.
pub fn sentences(job: &Value, targets: &[Option<JudgedTarget>]) -> Vec<(Tone, String)> {
    let outdoors = &job["external_horizontal_illuminance_lux"];
    let outdoors = outdoors["sky"].as_f64().zip(outdoors["sun"].as_f64()).map(|(sky, sun)| sky + sun);
    let of_grid = |(grid, target): (&Value, &Option<JudgedTarget>)| {
        let of = &grid["statistics"];
        let (place, whole) = place(&job["document"], text(&grid["name"]));
        let mean = with_interval(&of["mean_lux"], &of["mean_lux_standard_error"], &of["coverage_factor"]);
        let mean = format!("{mean} lx{}", if mean.contains('±') { " (95 % interval)" } else { "" });
        let (tone, found) = match target {
            Some(target) => on_target(target, (&place, whole), &mean, outdoors),
            None => (Tone::Plain, without_target(of, &place, &mean)),
        };
        (tone, found + &daylight_factor(of))
    };
    list(&job["grids"]).iter().zip(targets).take(MOST).map(of_grid).collect()
}

/// Describes a grid by its name and its height above the floor or the number of its points, and returns what parts of it are parts of.
fn place(document: &Value, name: &str) -> (String, &'static str) {
    let grid = list(&document["grids"]).iter().find(|grid| grid["name"] == name);
    let points = grid.and_then(|grid| grid["points_m"].as_array());
    match (points, grid.and_then(|grid| grid["height_m"].as_f64())) {
        (Some(points), _) => (format!("{name}, {} points,", points.len()), "points"),
        (None, Some(height)) => (format!("{name}, {} m above the floor,", short(height)), "area"),
        (None, None) => (name.to_owned(), "area"),
    }
}

fn on_target(target: &JudgedTarget, (place, whole): (&str, &str), mean: &str, outdoors: Option<f64>) -> (Tone, String) {
    let JudgedTarget { part: of, result: target } = target;
    let (lux, part) = (short(target.lux), of.in_words());
    let part_of_it = match target.area_percent {
        0.0 => "none".to_owned(),
        100.0 => "all".to_owned(),
        percent => format!("{} %", fixed(percent.clamp(1.0, 99.0), 0)),
    };
    let has = if whole == "points" { "have" } else { "has" };
    let (mean, area) =
        (format!("the mean at {place} is {mean}"), format!("{part_of_it} of the {whole} {has} {lux} lx"));
    let found = match of {
        TargetPart::Mean => format!("{mean}, and {area}"),
        TargetPart::Half | TargetPart::Most => format!("{area}, and {mean}"),
    };
    match target.verdict {
        Verdict::Met => (Tone::Good, format!("The target of {lux} lx{part} is met: {found}.")),
        Verdict::NotMet => {
            let needed = target.external_lux.zip(outdoors).map(|(needed, outdoors)| {
                let [needed, outdoors] = [needed, outdoors].map(|lux| significant(lux, 3));
                format!(" It would take {needed} lx outdoors, in place of {outdoors} lx.")
            });
            (Tone::Bad, format!("The target of {lux} lx{part} is not met: {found}.{}", needed.unwrap_or_default()))
        }
        Verdict::Undecided => {
            let text = format!("Whether the target of {lux} lx{part} is met is not decided at this accuracy: {found}.");
            (Tone::Plain, text)
        }
    }
}

fn without_target(statistics: &Value, place: &str, mean: &str) -> String {
    let number = |name: &str| statistics[name].as_f64();
    let ends = number("min_lux").zip(number("max_lux"));
    let ends = ends.map(|ends| <[f64; 2]>::from(ends).map(|lux| significant(lux, 3)));
    let ends = ends.map_or_else(String::new, |[least, most]| format!(", from {least} lx to {most} lx"));
    format!("The mean at {place} is {mean}{ends}.")
}

/// Tells the mean daylight factor in a further sentence; empty without one.
fn daylight_factor(statistics: &Value) -> String {
    let factor = statistics["daylight_factor_percent"]["mean"].as_f64();
    factor
        .map_or_else(String::new, |factor| format!(" The daylight factor is {} % on average.", significant(factor, 2)))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;
    use crate::document::result::TargetResult;

    fn said(statistics: Value) -> (Tone, String) {
        let job = json!({
            "document": { "grids": [{ "name": "desk", "height_m": 0.75 }] },
            "external_horizontal_illuminance_lux": { "sky": 9000.0, "sun": 1000.0 },
            "grids": [{ "name": "desk", "statistics": statistics }]
        });
        let target = JudgedTarget::of_document(&job["grids"][0]["statistics"]);
        sentences(&job, &[target]).remove(0)
    }

    #[test]
    fn each_verdict_has_its_sentence() {
        let of = |verdict: &str, area_percent: f64| {
            let target =
                json!({ "lux": 150.0, "verdict": verdict, "area_percent": area_percent, "external_lux": null });
            said(json!({ "mean_lux": 200.0, "mean_lux_standard_error": 1.0, "coverage_factor": 2.0, "target": target }))
        };
        let found = "the mean at desk, 0.75 m above the floor, is 200.0 ± 2.0 lx (95 % interval), and";
        assert_eq!(
            of("met", 99.9),
            (Tone::Good, format!("The target of 150 lx is met: {found} 99 % of the area has 150 lx."))
        );
        assert_eq!(
            of("not_met", 0.0),
            (Tone::Bad, format!("The target of 150 lx is not met: {found} none of the area has 150 lx."))
        );
        assert_eq!(of("undecided", 50.0).0, Tone::Plain);
        let target = json!({ "lux": 25.0, "verdict": "met", "area_percent": 100.0, "external_lux": null });
        let (_, words) =
            said(json!({ "mean_lux": 40.0, "target": target, "daylight_factor_percent": { "mean": 0.4 } }));
        assert!(words.ends_with(" The daylight factor is 0.40 % on average."), "{words}");
    }

    #[test]
    fn a_target_of_a_part_of_the_area_tells_the_area_first() {
        let job = json!({ "document": {}, "grids": [{ "name": "desk", "statistics": { "mean_lux": 200.0 } }] });
        let result = TargetResult { lux: 150.0, verdict: Verdict::Met, area_percent: 61.6, external_lux: None };
        let said = sentences(&job, &[Some(JudgedTarget { part: TargetPart::Half, result })]);
        let words = "The target of 150 lx on half of the area is met: 62 % of the area has 150 lx, and the mean at desk is 200.0 lx.";
        assert_eq!(said, [(Tone::Good, words.to_owned())]);
    }

    #[test]
    fn without_a_target_the_light_is_told() {
        let factors = json!({ "mean": 2.134, "median": null, "minimum": null });
        let (tone, words) =
            said(json!({ "mean_lux": 213.4, "min_lux": 51.0, "max_lux": 484.0, "daylight_factor_percent": factors }));
        assert_eq!(tone, Tone::Plain);
        let told = "The mean at desk, 0.75 m above the floor, is 213.4 lx, from 51.0 lx to 484 lx. The daylight factor is 2.1 % on average.";
        assert_eq!(words, told);
    }
}

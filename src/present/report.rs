//! Report on a job: a page of its results and inputs for who lives with the light, and a page of methods, effects and warnings.

use serde::Deserialize;
use serde_json::Value;

use super::grid_figure::{GridWishes, plan_map};
use super::inputs::inputs;
use super::outdoor_words;
use super::phrases::{list, quantity, text, with_interval};
use super::reader::{ResultReader, failed};
use super::sentences::sentences;
use super::site_figure::telling_section;
use super::target::{JudgedTarget, WantedTarget};
use super::verdict_words::verdict_in_words;
use crate::document::result::Verdict;
use crate::document::result::annual::VerdictResult;
use crate::engine::passes::RenderError;
use crate::figure::plan_map::PlanMap;
use crate::figure::sheet::{NO_VALUE, Sheet, SheetFigure, SheetPart};
use crate::figure::ticks::{duration, short, significant};
use crate::figure::view_picture;

/// Name of the file with the report.
pub const REPORT: &str = "report.pdf";

/// Name of the figure that has plan, section and picture side by side, among those of the site.
pub const OVERVIEW: &str = "overview";

/// Confidence of the intervals of a report.
const CONFIDENCE: f64 = 0.95;

/// Largest number of rows of a table: a hundred tubes are a list, not a report.
const MOST_ROWS: usize = 8;

/// Makes the report on a job with the first of its grids and views, as far as they are computed.
///
/// `job` is the job as the service returns it (document, plan, warnings, `stopped_by`, and the results as far as they are known), `footer`
/// names the program that made the report. The first grid is compared with `wanted`, if given, in place of its document's target.
pub fn report(
    results: &dyn ResultReader,
    job: &Value,
    wanted: Option<WantedTarget>,
    footer: String,
) -> Result<Sheet, RenderError> {
    let (subject, document) = (results.subject(), &job["document"]);
    let mut figures = Vec::new();
    let mut targets = targets(job);
    let year = results.year()?;
    let [grid, view] = ["grids", "views"].map(|outputs| document[outputs][0]["name"].as_str());
    let mut of_year = year.iter().flat_map(|year| year.report_figures(subject, wanted));
    if let Some(figure) = of_year.next() {
        figures.push(figure);
    } else if let Some(grid) = grid.map_or(Ok(None), |name| results.grid(name))? {
        let heading = subject.heading(grid.place_in_words(), Vec::new());
        let map = plan_map(subject, &grid, GridWishes::default());
        let drawing = PlanMap { heading, ..map }.draw().map_err(|error| failed(REPORT, error))?;
        figures.push(SheetFigure { name: format!("grids/{}", grid.name), drawing });
        if let (Some(wanted), Some(target), false) = (wanted, targets.first_mut(), has_year(job)) {
            *target = Some(JudgedTarget::of_reader(wanted, &grid, daylight_alone(job)));
        }
    }
    if let Some((section, drawing)) = telling_section(subject, job) {
        figures.push(SheetFigure { name: format!("figures/{}", section.name()), drawing });
    }
    figures.extend(of_year);
    if let Some(name) = view
        && let Some(picture) = results.picture(name)?
    {
        let drawing = view_picture::captioned(&subject.heading(name, Vec::new()), picture, "");
        figures.push(SheetFigure { name: format!("views/{name}"), drawing });
    }
    Ok(Sheet {
        title: subject.name().to_owned(),
        lines: vec![year.as_ref().map_or_else(|| subject.circumstances(), |year| year.circumstances())],
        sentences: year.as_ref().map_or_else(|| sentences(job, &targets), |year| year.sentences(wanted)),
        figures,
        parts: year
            .iter()
            .map(|year| year.metrics_table())
            .chain([grids(job, &targets), inputs(subject, job)])
            .collect(),
        details: year
            .iter()
            .map(|year| year.criteria_table())
            .chain([criteria(job), tubes(job), method(job), effects(job), notes(job)])
            .collect(),
        footer,
    })
}

/// Compares each grid of a job with the target of its document. A year is compared by its hours: its grids have the light of an overcast
/// sky.
fn targets(job: &Value) -> Vec<Option<JudgedTarget>> {
    let of_grid = |grid: &Value| JudgedTarget::of_document(&grid["statistics"]).filter(|_| !has_year(job));
    list(&job["grids"]).iter().map(of_grid).collect()
}

/// Returns true for a job with a year, also before it is computed.
fn has_year(job: &Value) -> bool {
    job["document"]["annual"].is_object()
}

/// Returns the unobstructed horizontal illuminance in lux if the room has no other light.
fn daylight_alone(job: &Value) -> Option<f64> {
    let outdoors = &job["external_horizontal_illuminance_lux"];
    let lux = outdoors["sky"].as_f64()? + outdoors["sun"].as_f64()?;
    (lux > 0.0 && list(&job["document"]["room"]["luminaires"]).is_empty()).then_some(lux)
}

/// Writes an efficiency of a tube with half the width of its interval.
fn percent(tube: &Value, name: &str) -> String {
    let times_hundred = |share: &Value| share.as_f64().map_or(Value::Null, |share| (100.0 * share).into());
    let (share, error) = (times_hundred(&tube[name]), times_hundred(&tube[format!("{name}_standard_error")]));
    let words = with_interval(&share, &error, &tube["into_room"]["coverage_factor"]);
    if share.is_null() { words } else { format!("{words} %") }
}

/// Makes a table of the first rows, with the number of the others.
fn table(title: String, head: &[&str], rows: impl ExactSizeIterator<Item = Vec<String>>) -> SheetPart {
    let more = rows.len().saturating_sub(MOST_ROWS);
    let mut rows: Vec<_> = rows.take(MOST_ROWS).collect();
    if more > 0 {
        rows.push(vec![format!("and {more} more")]);
    }
    SheetPart::table(title, head.iter().map(|name| (*name).to_owned()).collect(), rows)
}

fn grids(job: &Value, targets: &[Option<JudgedTarget>]) -> SheetPart {
    let rows = list(&job["grids"]).iter().zip(targets).map(|(grid, target)| {
        let of = &grid["statistics"];
        let of_name =
            |name: &str| with_interval(&of[name], &of[format!("{name}_standard_error")], &of["coverage_factor"]);
        let factor = |name: &str| {
            let factor = of["daylight_factor_percent"][name].as_f64();
            factor.map_or_else(|| NO_VALUE.to_owned(), |factor| significant(factor, 3))
        };
        vec![
            text(&grid["name"]).to_owned(),
            of_name("mean_lux"),
            of_name("median_lux"),
            of_name("min_lux"),
            of_name("max_lux"),
            of_name("uniformity"),
            factor("mean"),
            target.map_or_else(|| NO_VALUE.to_owned(), target_in_words),
        ]
    });
    let head =
        ["grid", "mean, lx", "median, lx", "minimum, lx", "maximum, lx", "uniformity", "daylight factor, %", "target"];
    let sky = if job["document"]["annual"].is_object() { " below an overcast sky of 10 000 lx" } else { "" };
    table(format!("Illuminance{sky}; ± is the half-width of the 95 % confidence interval"), &head, rows)
}

fn target_in_words(JudgedTarget { part, result }: JudgedTarget) -> String {
    let verdict = match result.verdict {
        Verdict::Met => "met",
        Verdict::NotMet => "not met",
        Verdict::Undecided => "undecided",
    };
    format!("{} lx{}: {verdict}", short(result.lux), part.in_words())
}

/// Makes the table of the criteria that name the moment of the job.
fn criteria(job: &Value) -> SheetPart {
    let row = |verdict: &Value| VerdictResult::deserialize(verdict).ok().map(|of| verdict_in_words(&of).to_vec());
    let of_grid = |grid: &Value| list(&grid["verdicts"]).iter().filter_map(row).collect::<Vec<_>>();
    let rows: Vec<Vec<String>> = list(&job["grids"]).iter().take(1).flat_map(of_grid).collect();
    let head = ["criterion of this moment", "found", "asked", "outcome"];
    table("Criteria that name this moment".to_owned(), &head, rows.into_iter())
}

fn tubes(job: &Value) -> SheetPart {
    let rows = list(&job["tubes"]).iter().enumerate().map(|(index, tube)| {
        let flux = |place: &str| {
            let of = &tube[place];
            with_interval(&of["flux_lm"], &of["standard_error_lm"], &of["coverage_factor"])
        };
        vec![
            (index + 1).to_string(),
            flux("at_collector"),
            flux("at_diffuser"),
            flux("into_room"),
            percent(tube, "transmission_efficiency"),
            percent(tube, "level_aperture_efficiency"),
        ]
    });
    let head = [
        "tube",
        "at the collector, lm",
        "at the diffuser, lm",
        "into the room, lm",
        "efficiency",
        "efficiency of a level aperture",
    ];
    table("Light through the tubes; ± is the half-width of the 95 % confidence interval".to_owned(), &head, rows)
}

fn fact(name: &str, words: impl Into<String>) -> (String, String) {
    (name.to_owned(), words.into())
}

fn method(job: &Value) -> SheetPart {
    let methods = &job["plan"]["methods"];
    let mut facts = Vec::new();
    for name in ["grids", "views", "year"] {
        let method = &methods[name];
        if let Some(kind) = method["name"].as_str() {
            facts.push(fact(name, format!("{}: {}", kind.replace('_', " "), text(&method["reason"]))));
        }
    }
    let stop = &job["document"]["stop"];
    let limits = ["relative_error", "view_relative_error", "confidence", "max_passes", "max_seconds"];
    let limits = limits.iter().filter(|name| stop[**name].is_number()).map(|name| quantity(name, &stop[*name]));
    facts.push(fact("requested", limits.collect::<Vec<_>>().join(", ")));
    let (accuracy, timing) = (&job["accuracy"], &job["timing"]);
    let reached = [("relative_error", "grids"), ("view_relative_error", "views")];
    let reached = reached.iter().filter_map(|(error, of)| {
        let error = accuracy[*error].as_f64()?;
        Some(format!("{of} ± {} %", significant(100.0 * error, 2)))
    });
    let reached: Vec<String> = reached.collect();
    if let (Some(passes), Some(seconds)) = (timing["passes"].as_u64(), timing["seconds"].as_f64()) {
        let stopped = text(&job["stopped_by"]).replace('_', " ");
        let confidence = accuracy["confidence"].as_f64().unwrap_or(CONFIDENCE);
        let reached = if reached.is_empty() { "not known".to_owned() } else { reached.join(", ") };
        let (seconds, confidence) = (duration(seconds, 2), short(100.0 * confidence));
        facts.push(fact(
            "accuracy",
            format!(
                "{reached} at a confidence of {confidence} %, after {passes} passes and {seconds}; stopped by \
                 {stopped}"
            ),
        ));
    }
    let provenance = &job["provenance"];
    let outdoors = [("sky", outdoor_words::sky(provenance)), ("sun", outdoor_words::sun(provenance))];
    facts.extend(outdoors.into_iter().filter_map(|(name, words)| Some(fact(name, words?))));
    SheetPart::Facts { title: "Method".to_owned(), facts }
}

fn effects(job: &Value) -> SheetPart {
    let facts = list(&job["plan"]["effects"]).iter().map(|effect| {
        let on = if effect["on"].as_bool() == Some(true) { "simulated" } else { "not simulated" };
        (text(&effect["name"]).replace('_', " "), format!("{on}: {}", text(&effect["reason"])))
    });
    SheetPart::Facts { title: "Effects of light, simulated or not".to_owned(), facts: facts.collect() }
}

fn notes(job: &Value) -> SheetPart {
    let warnings = list(&job["warnings"]).iter().chain(list(&job["render_warnings"]));
    let facts =
        warnings.map(|warning| (text(&warning["code"]).replace(['_', '-'], " "), text(&warning["detail"]).to_owned()));
    SheetPart::Facts { title: "Warnings".to_owned(), facts: facts.collect() }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use serde_json::json;

    use super::*;
    use crate::document::NoFiles;
    use crate::figure::sheet::Tone;
    use crate::present::prepared::prepare;
    use crate::present::reader::Kept;
    use crate::present::subject::Subject;
    use crate::present::subject::tests::document;

    fn job() -> Value {
        let mut document = document();
        let mut second = document["tubes"][0].clone();
        second["centre_m"] = json!([2.0, 3.0]);
        document["tubes"].as_array_mut().unwrap().push(second);
        json!({
            "document": document, "stopped_by": "relative_error",
            "plan": { "effects": [{ "name": "guide_return", "on": false, "reason": "no light comes back" }],
                      "methods": { "grids": { "name": "placed_vertices", "reason": "because" }, "views": null } },
            "accuracy": { "relative_error": 0.0123, "confidence": 0.95, "passes": 8 },
            "timing": { "passes": 8, "seconds": 0.0021 },
            "grids": [{ "name": "floor", "statistics": { "mean_lux": 211.0437, "mean_lux_standard_error": 0.3, "coverage_factor": 2.3646,
                        "min_lux": 51.0, "max_lux": 484.0, "uniformity": null,
                        "target": { "lux": 300.0, "verdict": "not_met", "area_percent": 12.6, "external_lux": 14215.0 } } }],
            "external_horizontal_illuminance_lux": { "sky": 10000.0, "sun": 0.0 },
            "tubes": [{ "into_room": { "flux_lm": 2884.0, "standard_error_lm": null, "coverage_factor": 2.0 },
                        "transmission_efficiency": 0.481, "transmission_efficiency_standard_error": 0.0012 }],
            "provenance": { "zenith": { "formula": "given_horizontal_illuminance", "zenith_luminance_cd_m2": 3183.1,
                                        "horizontal_illuminance_lux": 10000.0 }, "sun": null },
            "warnings": [{ "code": "low_sun", "detail": "the sun is low" }]
        })
    }

    #[test]
    fn a_report_tells_inputs_method_results_and_errors() {
        let job = job();
        let subject = Subject::new(&job["document"], &job["plan"]);
        let prepare = || prepare(b"", &NoFiles);
        let nothing = Kept {
            subject: subject.into(),
            files: HashMap::new(),
            tubes: Vec::new(),
            prepare: Box::new(prepare),
            year: None,
            years: None,
        };
        let sheet = report(&nothing, &job, None, "skyduct".to_owned()).unwrap();
        let said: Vec<String> = sheet
            .parts
            .iter()
            .chain(&sheet.details)
            .flat_map(|part| match part {
                SheetPart::Table { rows, .. } => rows.concat(),
                SheetPart::Facts { facts, .. } => {
                    facts.iter().map(|(name, words)| format!("{name}: {words}")).collect()
                }
            })
            .collect();
        let (tone, sentence) = &sheet.sentences[0];
        assert_eq!(*tone, Tone::Bad);
        assert_eq!(
            sentence,
            "The target of 300 lx is not met: the mean at floor, 0.8 m above the floor, is 211.04 ± 0.71 lx (95 % interval), and 13 % of \
             the area has 300 lx. It would take 14\u{a0}200 lx outdoors, in place of 10\u{a0}000 lx."
        );
        for words in [
            // Student's quantile for seven degrees of freedom, 2.3646, times the standard error
            "211.04 ± 0.71",
            "2884",
            "48.10 ± 0.24 %",
            "300 lx: not met",
            "tubes 1 and 2: 0.3 m wide, 1 m long; mirror of 98 %; open at the top; opal diffuser that passes 60 %; at (1.5, 1.5), (2, 3) m",
            "floor of 24 m², 4 m × 6 m, 2.7 m high",
            "outdoors: 10\u{a0}000 lx on level ground: 10\u{a0}000 lx of the sky, 0 lx of the sun",
            "grids: placed vertices: because",
            "grids ± 1.2 % at a confidence of 95 %, after 8 passes and 2.1 ms; stopped by relative error",
            "guide return: not simulated: no light comes back",
            "low sun: the sun is low",
            "sky: Open level ground has 10\u{a0}000 lx of the sky, and the zenith 3180 cd/m²: the document gives the illuminance.",
        ] {
            assert!(said.iter().any(|part| part.contains(words)), "{words} is not in {said:#?}");
        }
    }
}

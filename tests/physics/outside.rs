//! Rooms and views against another program: Mitsuba 3 [Jakob 2022], which shares nothing with this one but the job documents
//! and the formulas of docs/physics. `tests/reference/mitsuba` has the documents, the numbers with their standard errors, and
//! what made them.
//!
//! Each scene has one thing that boxes with matt walls do not have. Every sensor, every block of 8 x 8 pixels and every mean
//! is compared by Student's t with the standard errors of both sides; all comparisons of this file share [`FALSE_ALARM`]
//! (Sidak). Nothing else is allowed for. Beside the methods that a scene names, what users get who name none renders its grids and
//! its views, until a job would end or for some hundred passes.

use std::sync::LazyLock;

use serde_json::Value;
use skyduct::document::{JobDocument, to_scene};
use skyduct::scene::Scene;

use crate::documents::Beside;
use crate::judge::{self, Measured, Whole, sigmas};
use crate::matrix::columns::column;
use crate::matrix::compare_all;
use crate::matrix::render::{Effort, Left, render, seed};
use crate::matrix::row::{Mirrors, Row, Values};
use crate::reference;

/// Probability that a change of the random numbers alone lets any comparison fail.
const FALSE_ALARM: f64 = 0.01;

/// Largest relative standard error, of both sides together, of the mean of an output: a comparison with more would say
/// little. Density estimates of steep edges have most.
const LARGEST_ERROR: f64 = 0.05;

/// Size of a pass, relative to the matrix' methods: errors of a few tenths of a per cent in half a second.
const FACTOR: f64 = 4.0;

/// A document, and the methods that render its grids and its views.
struct Outside {
    name: &'static str,
    grids: &'static [&'static str],
    views: &'static [&'static str],
}

const OUTSIDE: &[Outside] = &[
    Outside { name: "glossy_floor", grids: &["light_tracing", "path_tracing"], views: &[] },
    Outside {
        name: "mirror_walls",
        grids: &["bidirectional_path_tracing", "photon_mapping"],
        views: &["path_tracing", "sppm"],
    },
    Outside { name: "mirror_things", grids: &["photon_mapping"], views: &["sppm"] },
    Outside { name: "coloured_room", grids: &["light_tracing", "two_stage"], views: &["sppm"] },
    Outside { name: "meshes_meet", grids: &["light_tracing", "two_stage"], views: &["path_tracing"] },
    Outside { name: "nine_tubes", grids: &["light_tracing"], views: &[] },
    Outside {
        name: "turned_room",
        grids: &["light_tracing", "photon_mapping"],
        views: &["bidirectional_path_tracing"],
    },
    Outside { name: "mixed_sheet", grids: &["light_tracing"], views: &["bidirectional_path_tracing"] },
    Outside { name: "sun_on_gloss", grids: &[], views: &["photon_mapping", "sppm"] },
    Outside { name: "up_the_pipe", grids: &[], views: &["path_tracing", "photon_mapping"] },
    Outside { name: "office_of_desks", grids: &["light_tracing", "path_tracing"], views: &["path_tracing"] },
    Outside { name: "measured_sheet", grids: &["light_tracing"], views: &["path_tracing"] },
    Outside { name: "glass_dome", grids: &["bidirectional_path_tracing", "photon_mapping"], views: &["path_tracing"] },
];

impl Outside {
    fn scene(&self) -> Scene {
        let mut document = reference::json(&format!("mitsuba/{}.json", self.name));
        if self.name == "mixed_sheet" {
            // one sensor sees the rim of the opening across the sun: `translate.py` lays sensors 1e-4 m above the grid, and Mitsuba moves
            // rays off them by 1500 2^-24 of a metre and of their largest coordinate
            document["grids"][0]["height_m"] = (0.75 + 1e-4 + (1.0 + 2.25) * 1500.0 * f64::exp2(-24.0)).into();
        }
        let document = JobDocument::parse(document.to_string().as_bytes()).unwrap();
        to_scene(&document, &Beside("mitsuba")).unwrap().0
    }

    fn result(&self) -> Value {
        reference::json(&format!("mitsuba/{}.result.json", self.name))
    }

    /// The methods, each with what it renders of the scene, and Mitsuba's values of that.
    fn comparisons(&self) -> Vec<(&'static str, Scene, Values)> {
        let (scene, result) = (self.scene(), self.result());
        let grids = Scene { views: Vec::new(), ..scene.clone() };
        let views = Scene { grids: Vec::new(), ..scene };
        let of = |methods: &[&'static str], scene: &Scene, key: &str, unit: &str| -> Vec<_> {
            let by_default = result[key].as_array().is_some_and(|outputs| !outputs.is_empty()).then_some("auto");
            let methods = methods.iter().copied().chain(by_default);
            methods.map(|method| (method, scene.clone(), values(&result, key, unit))).collect()
        };
        [of(self.grids, &grids, "grids", "lux"), of(self.views, &views, "views", "cd_m2")]
            .into_iter()
            .flatten()
            .collect()
    }

    fn row(&self, scene: Scene) -> Row {
        Row::new(scene).mirrors(Mirrors::Paths(1.0))
    }
}

/// Mitsuba's grids or views.
fn values(result: &Value, key: &str, unit: &str) -> Values {
    let degrees = result["renders"].as_f64().unwrap() - 1.0;
    let output = |output: &Value| {
        let list = |key: &str| -> Vec<f64> {
            let rows = output[key].as_array().unwrap().iter().flat_map(|row| row.as_array().unwrap());
            rows.map(|value| value.as_f64().unwrap()).collect()
        };
        let (values, errors) = (list(unit), list(&format!("standard_error_{unit}")));
        let each = values.into_iter().zip(errors).map(|(value, error)| Measured { value, error, degrees });
        let of = |key: String| output[key].as_f64().unwrap();
        let noise = of(format!("mean_standard_error_{unit}"));
        (each.collect(), Whole { value: of(format!("mean_{unit}")), noise, bias: 0.0, degrees })
    };
    Values { outputs: result[key].as_array().unwrap().iter().map(output).collect(), tubes: Vec::new() }
}

/// Probability below which a comparison fails.
static LIMIT: LazyLock<f64> = LazyLock::new(|| {
    let of = |values: &Values| values.outputs.iter().map(|(each, _)| each.len() + 1).sum::<usize>();
    let all = OUTSIDE.iter().flat_map(Outside::comparisons);
    judge::each(FALSE_ALARM, all.map(|(.., values)| of(&values)).sum())
});

#[track_caller]
fn agrees(name: &str) {
    let outside = OUTSIDE.iter().find(|outside| outside.name == name).unwrap();
    let mut failures = Vec::new();
    for (method, scene, truth) in outside.comparisons() {
        let begun = std::time::Instant::now();
        // a job by default may take four times as many to its accuracy
        let passes = if method == "auto" { 24 } else { 32 };
        let effort = Effort { passes, factor: FACTOR, long: false };
        let row = outside.row(scene);
        let by = |method| render(&row, &row.scene, column(method), effort, seed(&[name, method]));
        let (_, found) = match by(method) {
            // in its own column it has the settings that users get
            Err(Left::Elsewhere) => by("two_stage"),
            found => found,
        }
        .unwrap();
        for (output, ((_, found), (_, truth))) in found.outputs.iter().zip(&truth.outputs).enumerate() {
            let error = found.measured().error.hypot(truth.noise) / truth.value;
            println!(
                "{name}, {method}, output {output}: mean {:+.3} % +- {:.3} %, of which here {:.3} %",
                100.0 * (found.value / truth.value - 1.0),
                100.0 * error,
                100.0 * found.measured().error / truth.value,
            );
            // a job by default is as accurate as its points are, few of which a sunbeam meets
            assert!(error < LARGEST_ERROR || method == "auto", "{name}, {method}: {error}");
        }
        let verdicts = compare_all(&found, &truth, 0.0);
        let worst = verdicts.iter().map(|(_, verdict)| verdict.probability).fold(1.0, f64::min);
        println!(
            "{name}, {method}: worst {:.2} of {:.2} in {} comparisons, {:.2} s",
            sigmas(worst),
            sigmas(*LIMIT),
            verdicts.len(),
            begun.elapsed().as_secs_f64()
        );
        let wrong = verdicts.into_iter().filter(|(_, verdict)| verdict.probability < *LIMIT);
        failures.extend(wrong.map(|(what, verdict)| format!("{method}: {what}, {:.2} standard errors", verdict.t)));
    }
    assert!(failures.is_empty(), "{name}: {failures:#?}");
}

macro_rules! scenes {
    ($($name:ident)*) => {
        $(#[test] fn $name() { agrees(stringify!($name)); })*
    };
}

scenes! {
    glossy_floor mirror_walls mirror_things coloured_room meshes_meet nine_tubes turned_room mixed_sheet sun_on_gloss up_the_pipe
    office_of_desks measured_sheet glass_dome
}

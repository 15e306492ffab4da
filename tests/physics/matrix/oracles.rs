//! Long renders that are stored (`reference/oracles`): written by `reference/oracles/make`, read by every run of the tests.

use std::path::PathBuf;

use serde_json::{Value, json};
use skyduct::integrator::Method;
use skyduct::plan::MethodRequest;

use super::columns::{Family, Work, column};
use super::compare_all;
use super::render::{Effort, render, seed};
use super::row::{Oracle, Row, Values};
use crate::judge::{Measured, Verdict, Whole};
use crate::reference;

/// About twelve times what a cell of the matrix takes: less than a third of its error.
const EFFORT: Effort = Effort { passes: 96, factor: 8.0, long: true };

/// What a row's values are, for a method of `family`; with the bound of their systematic error.
pub fn values(name: &str, row: &Row, family: Family) -> (Values, f64) {
    let (methods, same) = match &row.oracle {
        Oracle::Given { values, bound } => {
            let outputs = values.outputs.iter().map(|(each, whole)| (each.clone(), *whole)).collect();
            return (Values { outputs, tubes: values.tubes.clone() }, *bound);
        }
        Oracle::Stored(methods) => (methods, false),
        Oracle::Same(_, methods) => (methods, true),
    };
    let work = Work::of(&row.scene, EFFORT.factor, 1.0);
    let of_another = |name: &str| match column(name).request(&work) {
        MethodRequest::Method(method) => Family::of(&method) != family,
        MethodRequest::Auto | MethodRequest::InPlaceOf(..) => false,
    };
    let independent = |method: &&&str| same || of_another(method);
    let method = methods.iter().find(independent).unwrap_or_else(|| panic!("{name}: nothing to judge {family:?} by"));
    let mut values = stored(name, method);
    // beside an image of every tube
    values.tubes.truncate(row.scene.tubes.len());
    (values, 0.0)
}

/// The stored render of a row by a method.
fn stored(name: &str, method: &str) -> Values {
    let file = reference::json(&format!("oracles/{name}.json"));
    let render = file["renders"].as_array().unwrap().iter().find(|render| render["column"] == method);
    read(render.unwrap_or_else(|| panic!("{name}: no render by {method}")))
}

fn read(render: &Value) -> Values {
    let of = |value: &Value| value.as_f64().unwrap();
    let degrees = of(&render["passes"]) - 1.0;
    let pairs = |value: &Value, value_key: &str, error_key: &str| -> Vec<Measured> {
        let [values, errors] = [value_key, error_key].map(|key| value[key].as_array().unwrap().iter().map(of));
        let measured = |(value, error): (f64, f64)| Measured { value, error: error.hypot(ROUNDED * value), degrees };
        values.zip(errors).map(measured).collect()
    };
    let output = |output: &Value| {
        let mean = &output["mean"];
        let [value, noise, bias] = ["value", "standard_error", "bias"].map(|key| of(&mean[key]));
        (pairs(output, "values", "standard_errors"), Whole { value, noise, bias, degrees })
    };
    Values {
        outputs: render["outputs"].as_array().unwrap().iter().map(output).collect(),
        tubes: pairs(&render["tubes"], "flux_lm", "standard_errors_lm"),
    }
}

fn file(name: &str) -> PathBuf {
    reference::folder().join("oracles").join(format!("{name}.json"))
}

/// Renders what is stored of a row; nothing where its values are independent of this program.
fn renders(name: &str, row: &Row, purpose: &str) -> Vec<(&'static str, Method, u64, Values)> {
    let (methods, scene) = match &row.oracle {
        Oracle::Given { .. } => return Vec::new(),
        Oracle::Stored(methods) => (*methods, &row.scene),
        Oracle::Same(scene, methods) => (*methods, scene.as_ref()),
    };
    let render = |method: &&'static str| {
        let seed = seed(&[purpose, name, method]);
        let (settings, values) = render(row, scene, column(method), EFFORT, seed)
            .unwrap_or_else(|refusal| panic!("{name}: {method} does not: {refusal:?}"));
        (*method, settings, seed, values)
    };
    methods.iter().map(render).collect()
}

/// Writes the file of a row.
pub fn make(name: &str, row: &Row) {
    let renders = renders(name, row, "oracle");
    if renders.is_empty() {
        return;
    }
    let renders: Vec<Value> =
        renders.iter().map(|(method, settings, seed, values)| json_of(method, settings, *seed, values)).collect();
    let command = format!("tests/reference/oracles/make {name}");
    let text = json!({ "row": name, "command": command, "renders": renders });
    std::fs::write(file(name), serde_json::to_string(&text).unwrap().replace("{\"", "\n{\"") + "\n").unwrap();
}

/// Compares the file of a row with renders that have other random numbers.
pub fn check(name: &str, row: &Row) -> Vec<(String, Verdict)> {
    let compare = |(method, _, _, again): (&'static str, Method, u64, Values)| {
        let verdicts = compare_all(&again, &stored(name, method), 0.0);
        verdicts.into_iter().map(move |(what, verdict)| (format!("{name}, {method}: {what}"), verdict))
    };
    renders(name, row, "again").into_iter().flat_map(compare).collect()
}

fn json_of(column: &str, settings: &Method, seed: u64, values: &Values) -> Value {
    let lists = |measured: &[Measured]| -> [Vec<f64>; 2] {
        [measured.iter().map(|it| digits(it.value)).collect(), measured.iter().map(|it| digits(it.error)).collect()]
    };
    let outputs = values.outputs.iter().map(|(each, whole)| {
        let [values, errors] = lists(each);
        let mean =
            json!({ "value": digits(whole.value), "standard_error": digits(whole.noise), "bias": digits(whole.bias) });
        json!({ "values": values, "standard_errors": errors, "mean": mean })
    });
    let [flux, errors] = lists(&values.tubes);
    json!({
        "column": column, "settings": format!("{settings:?}"), "seed": seed, "passes": EFFORT.passes,
        "outputs": outputs.collect::<Vec<_>>(),
        "tubes": { "flux_lm": flux, "standard_errors_lm": errors },
    })
}

/// Largest share of a number that its eighth digit rounds away: values of closed forms have no error but that.
const ROUNDED: f64 = 5e-8;

/// Eight digits: far below every error.
fn digits(value: f64) -> f64 {
    format!("{value:.7e}").parse().unwrap()
}

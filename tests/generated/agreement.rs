//! Any two methods that accept a document find the same light in it.
//!
//! Nothing is allowed beside the standard errors of both sides, which contain estimated biases. Errors that few passes tell
//! miss what is rare and bright; therefore a difference is a suspicion at first, and the verdict is that of renders with other
//! random numbers and [`AGAIN`] passes. All comparisons of all cases together have [`FALSE_ALARM`] by Sidak's correction.

use proptest::prelude::*;
use serde_json::Value;

use crate::generator::{self, Kind, MOST_TUBES, MOST_VALUES};
use crate::judge::{self, Measured, compare};
use crate::render::{Case, Effort, Found, METHODS, cases, config, render};

/// Probability that a change of the random numbers alone lets any comparison of a run fail.
const FALSE_ALARM: f64 = 0.01;

/// Methods that are compared with each other in each case.
const COMPARED: usize = 3;

const FIRST: Effort = Effort { passes: 24, size: 1.0, fixed: 1 };

/// Renders that decide: 16 times as many passes, and fixed points.
const AGAIN: Effort = Effort { passes: 384, size: 1.0, fixed: 16 };

/// The first difference of two methods beyond `limit`, in words.
fn difference(a: (&str, &Found), b: (&str, &Found), limit: f64) -> Option<String> {
    let tubes = |found: &Found, other: &Found| if other.tubes.is_empty() { Vec::new() } else { found.tubes.clone() };
    let lists: [(&str, Vec<Measured>, Vec<Measured>); 3] = [
        ("value", a.1.values.clone(), b.1.values.clone()),
        ("mean of grid", a.1.means.clone(), b.1.means.clone()),
        ("flux through tube", tubes(a.1, b.1), tubes(b.1, a.1)),
    ];
    lists.into_iter().find_map(|(what, of_a, of_b)| {
        let mut pairs = of_a.iter().zip(&of_b).enumerate();
        pairs.find_map(|(place, (x, y))| {
            let verdict = compare(*x, *y, 0.0);
            (verdict.probability < limit).then(|| {
                let [s, u] = [x, y].map(|it| format!("{:.6e} +- {:.2e}", it.value, it.error));
                format!("{what} {place}: {} {s}, {} {u}, {:.1} standard errors", a.0, b.0, verdict.t)
            })
        })
    })
}

/// Differences of the first methods of `order` that accept a document, each confirmed.
fn differences(document: &Value, order: &[&'static str], limit: f64) -> Vec<String> {
    let accepted = order.iter().filter_map(|name| Some((*name, render(document, name, FIRST, 1).ok()?)));
    let found: Vec<_> = accepted.take(COMPARED).collect();
    let mut confirmed = Vec::new();
    for (k, (name, values)) in found.iter().enumerate() {
        for (other, others) in &found[..k] {
            let Some(suspicion) = difference((name, values), (other, others), limit) else { continue };
            println!("suspicion: {suspicion}\n{document}");
            let again = |name: &str| render(document, name, AGAIN, 2);
            if let (Ok(a), Ok(b)) = (again(name), again(other)) {
                confirmed.extend(difference((name, &a), (other, &b), limit));
            }
        }
    }
    confirmed
}

fn limit(cases: u32) -> f64 {
    let pairs = COMPARED * (COMPARED - 1) / 2;
    judge::each(FALSE_ALARM, cases as usize * pairs * (MOST_VALUES + 2 + MOST_TUBES))
}

fn orders() -> impl Strategy<Value = Vec<&'static str>> {
    Just(METHODS.to_vec()).prop_shuffle()
}

proptest! {
    #![proptest_config(config(cases(12)))]

    #[test]
    fn methods_agree(case in generator::document(Kind::Any).prop_map(Case), order in orders()) {
        let differences = differences(&case.0, &order, limit(cases(12)));
        prop_assert!(differences.is_empty(), "{differences:#?}");
    }
}

/// All differences are told at the end, each with its document, so that one does not hide the others.
#[test]
#[ignore = "an hour: 2000 documents"]
fn methods_agree_on_many_documents() {
    let cases = cases(2000);
    let mut failures = Vec::new();
    for (number, (document, order)) in generator::drawn(cases, (generator::document(Kind::Any), orders())).enumerate() {
        let attempt = std::panic::catch_unwind(|| differences(&document, &order, limit(cases)));
        let differences = attempt.unwrap_or_else(|_| vec!["it panicked".to_owned()]);
        if !differences.is_empty() {
            println!("case {number}: {differences:#?}\n{document}");
            failures.push(number);
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// Prints what every method finds in the document of a file, by few and by many passes, to look at what a failure printed:
/// `GENERATED_DOCUMENT=/tmp/it.json cargo test --test generated what_methods_find -- --ignored --nocapture`. A number in place of a
/// file is that of a case of [`methods_agree_on_many_documents`].
#[test]
#[ignore = "a tool: it asserts nothing of its own"]
fn what_methods_find() {
    let Ok(path) = std::env::var("GENERATED_DOCUMENT") else { return };
    let document: Value = match path.parse() {
        Ok(number) => generator::drawn(cases(2000), (generator::document(Kind::Any), orders())).nth(number).unwrap().0,
        Err(_) => serde_json::from_slice(&std::fs::read(path).unwrap()).unwrap(),
    };
    println!("{document}");
    for name in METHODS {
        for effort in [FIRST, AGAIN] {
            match render(&document, name, effort, 1) {
                Err(left) => println!("{name}: {left:?}"),
                Ok(found) => {
                    let values = found.values.iter().map(|it| format!("{:.4e} +- {:.1e}", it.value, it.error));
                    println!("{name}, {} passes: {}", effort.passes, values.collect::<Vec<_>>().join(", "));
                }
            }
        }
    }
}

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

/// Illuminance in lx, or flux in lm, below which a value is darkness: photons that come by a handful have no normal errors.
const DARK: f64 = 1e-6;

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
            let is_dark = x.value.max(y.value) < DARK;
            (!is_dark && verdict.probability < limit).then(|| {
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
            let again = |name: &str| {
                render(document, name, AGAIN, 2).unwrap_or_else(|left| panic!("{name} has now {left:?}: {document}"))
            };
            confirmed.extend(difference((name, &again(name)), (other, &again(other)), limit));
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

/// All methods that accept one document agree, by many passes; what each finds is printed, to look into a failure. The document is that
/// of a file: `GENERATED_DOCUMENT=/tmp/it.json cargo test --test generated agree_on_one -- --ignored --nocapture`; a number in place of a
/// file, 2 by default, is that of a case of [`methods_agree_on_many_documents`].
#[test]
#[ignore = "a minute: many passes of all methods"]
fn methods_agree_on_one_document() {
    let place = std::env::var("GENERATED_DOCUMENT").unwrap_or_else(|_| "2".to_owned());
    let document: Value = match place.parse() {
        Ok(number) => generator::drawn(cases(2000), (generator::document(Kind::Any), orders())).nth(number).unwrap().0,
        Err(_) => serde_json::from_slice(&std::fs::read(place).unwrap()).unwrap(),
    };
    println!("{document}");
    let mut found: Vec<(&str, Found)> = Vec::new();
    for name in METHODS {
        match render(&document, name, AGAIN, 1) {
            Err(left) => println!("{name}: {left:?}"),
            Ok(values) => {
                let printed = values.values.iter().map(|it| format!("{:.4e} +- {:.1e}", it.value, it.error));
                println!("{name}: {}", printed.collect::<Vec<_>>().join(", "));
                found.push((name, values));
            }
        }
    }
    let pairs: Vec<_> = (0..found.len()).flat_map(|a| (0..a).map(move |b| (a, b))).collect();
    assert!(!pairs.is_empty(), "one method at most accepts it");
    let limit = judge::each(FALSE_ALARM, pairs.len() * (MOST_VALUES + 2 + MOST_TUBES));
    let differences = pairs.into_iter().filter_map(|(a, b)| {
        let [a, b] = [&found[a], &found[b]].map(|(name, values)| (*name, values));
        difference(a, b, limit)
    });
    assert_eq!(differences.collect::<Vec<_>>(), Vec::<String>::new());
}

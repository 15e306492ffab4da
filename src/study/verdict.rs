//! Conclusions of a study in words.

use super::outcome::{Cell, RenderedReference, Study};
use crate::figure::ticks::{duration, significant};

impl Study {
    /// Returns the conclusions as a paragraph: the cheapest method for each error, the ratio of actual errors to reported ones,
    /// and the errors and methods that failed.
    pub fn verdict(&self) -> String {
        let cells = self.cells();
        if cells.is_empty() {
            return "No run has computed any values.".to_owned();
        }
        let mut sentences = vec![costs(&cells)];
        sentences.extend(others(&cells));
        sentences.extend(honesty(self, &cells));
        sentences.extend(not_met(&cells));
        sentences.extend(formulas(&cells));
        let refused: Vec<&str> = self.refused.iter().map(|refused| refused.method.as_str()).collect();
        if !refused.is_empty() {
            sentences.push(format!("These methods cannot compute this job: {}.", refused.join(", ")));
        }
        let error = self.reference_error().map_or("unknown".to_owned(), percent);
        sentences.push(match &self.reference {
            Some(RenderedReference { method, seconds }) => format!(
                "Errors are deviations from a reference by {method} with a standard error of {error}, which took {}.",
                duration(*seconds, 3)
            ),
            None => format!("Errors are deviations from given values with a standard error of {error}."),
        });
        sentences.join(" ")
    }
}

fn percent(share: f64) -> String {
    format!("{} %", significant(100.0 * share, 2))
}

/// Returns the requested errors in descending order, each once.
fn asked(cells: &[Cell]) -> Vec<f64> {
    let mut asked: Vec<f64> = cells.iter().map(|cell| cell.asked).collect();
    asked.sort_by(|a, b| b.total_cmp(a));
    asked.dedup();
    asked
}

fn costs(cells: &[Cell]) -> String {
    let cost = |asked: f64| {
        let cheapest = cells.iter().find(|cell| cell.asked == asked && cell.cheapest)?;
        Some((
            cheapest.method.as_str(),
            format!("{} takes {}", percent(asked), duration(cheapest.cpu_seconds.median, 3)),
        ))
    };
    let known: Vec<(&str, String)> = asked(cells).into_iter().filter_map(cost).collect();
    let Some((first, _)) = known.first() else { return "No method met any of the errors.".to_owned() };
    if known.iter().all(|(method, _)| method == first) {
        let told: Vec<&str> = known.iter().map(|(_, cost)| cost.as_str()).collect();
        return format!("The cheapest method is {first}: {} of one core.", told.join(", "));
    }
    let told: Vec<String> = known.iter().map(|(method, cost)| format!("{cost} by {method}")).collect();
    format!("Cheapest, on one core: {}.", told.join(", "))
}

/// Returns how many times longer the other methods take to reach the smallest error that the cheapest one reached.
fn others(cells: &[Cell]) -> Option<String> {
    let best = cells.iter().filter(|cell| cell.cheapest).min_by(|a, b| a.asked.total_cmp(&b.asked))?;
    let others = cells.iter().filter(|cell| cell.asked == best.asked && cell.met && !cell.cheapest);
    let mut factors: Vec<(f64, &str)> =
        others.map(|cell| (cell.cpu_seconds.median / best.cpu_seconds.median, cell.method.as_str())).collect();
    factors.sort_by(|a, b| a.0.total_cmp(&b.0));
    let told: Vec<String> =
        factors.iter().map(|(factor, method)| format!("{method} {} times as long", significant(*factor, 2))).collect();
    (!told.is_empty())
        .then(|| format!("To reach {}, the others take longer: {}.", percent(best.asked), told.join(", ")))
}

/// Returns the range of the ratios of actual errors (root mean squares) to reported ones, and the fraction of intervals that
/// contain the reference.
fn honesty(study: &Study, cells: &[Cell]) -> Option<String> {
    let shares = cells.iter().filter_map(|cell| Some(cell.actual / cell.reported?)).filter(|share| share.is_finite());
    let (least, most) =
        shares.fold((f64::INFINITY, 0.0_f64), |(least, most), share| (least.min(share), most.max(share)));
    let covered: Vec<f64> = cells.iter().filter_map(|cell| cell.covered).collect();
    let held = covered.iter().sum::<f64>() / covered.len().max(1) as f64;
    least.is_finite().then(|| {
        let [least, most] = [least, most].map(|share| significant(share, 2));
        let shares = if least == most { least } else { format!("{least} to {most}") };
        format!(
            "Actual errors (root mean square) are {shares} times those reported at a confidence of {}; {} of the \
             confidence intervals contain the reference.",
            percent(study.confidence),
            percent(held)
        )
    })
}

fn not_met(cells: &[Cell]) -> Option<String> {
    let mut of_methods: Vec<(&str, Vec<f64>)> = Vec::new();
    for cell in cells.iter().filter(|cell| !cell.met && !cell.formula) {
        match of_methods.iter_mut().find(|(method, _)| *method == cell.method) {
            Some((_, asked)) => asked.push(cell.asked),
            None => of_methods.push((&cell.method, vec![cell.asked])),
        }
    }
    let words = |(method, mut asked): (&str, Vec<f64>)| {
        asked.sort_by(|a, b| b.total_cmp(a));
        format!("{method} ({})", asked.into_iter().map(percent).collect::<Vec<_>>().join(", "))
    };
    let told: Vec<String> = of_methods.into_iter().map(words).collect();
    (!told.is_empty()).then(|| format!("Not met within the seconds allowed: {}.", told.join(", ")))
}

/// Returns the actual errors of formulas, which report no errors of their own.
fn formulas(cells: &[Cell]) -> Option<String> {
    let mut told: Vec<String> = cells
        .iter()
        .filter(|cell| cell.formula)
        .map(|cell| format!("{} is off by {} and reports no error.", cell.method, percent(cell.actual)))
        .collect();
    told.dedup();
    (!told.is_empty()).then(|| told.join(" "))
}

#[cfg(test)]
mod tests {
    use super::super::outcome::tests::run;
    use super::super::outcome::{Refused, Run};
    use super::*;
    use crate::engine::progress::StoppedBy;

    #[test]
    fn the_cheapest_is_named_with_what_the_others_cost() {
        let mut late = run("c", 0.01, 9.0, 0.02);
        late.met = false;
        let formula = Run { reported: None, met: false, stopped_by: StoppedBy::Exact, ..run("e", 0.01, 0.001, 0.3) };
        let study = Study {
            reference: Some(RenderedReference { method: "a".to_owned(), seconds: 3.0 }),
            confidence: 0.95,
            runs: vec![
                run("a", 0.05, 0.25, 0.025),
                run("a", 0.01, 1.0, 0.005),
                run("b", 0.01, 4.0, 0.006),
                late,
                formula,
            ],
            refused: vec![Refused { method: "d".to_owned(), reason: "no".to_owned() }],
            ..Study::default()
        };
        let words = study.verdict();
        for part in
            ["The cheapest method is a: 5.0 % takes", "1.0 % takes", "b 4.0 times", "c (1.0 %)", "compute this job: d."]
        {
            assert!(words.contains(part), "{part}: {words}");
        }
        assert!(words.contains("e is off by 30 % and reports no error.") && !words.contains("e (1.0 %)"), "{words}");
        assert!(words.contains("0.50 to 2.0 times those reported at a confidence of 95 %"), "{words}");
        assert_eq!(Study::default().verdict(), "No run has computed any values.");
    }
}

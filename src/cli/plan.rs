//! `skyduct plan`: prints the plan of a job with its reasons, and on request the predicted time of each method.

use std::fmt::Write as _;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use super::mesh_files::MeshFiles;
use super::predictions_table::predictions_table;
use super::print::print;
use super::render::read_job;
use crate::document::Warning;
use crate::document::result::{MethodResult, PlanResult};
use crate::engine::memory::default_limit_bytes;
use crate::predict::pilot;
use crate::present::prepared::prepare;

#[derive(Debug, clap::Args)]
pub struct PlanArgs {
    /// Job document (JSON); its meshes may be files at or below its folder
    #[arg(value_name = "JOB.json")]
    pub job: PathBuf,
    /// Print the plan as JSON
    #[arg(long)]
    pub json: bool,
    /// Try every method for less than 0.2 s of each processor beside the set-up of the planned one, and print its predicted time to
    /// accuracies from 10 to 0.1 %
    #[arg(long)]
    pub predict: bool,
}

/// Prints the plan of a job. Errors of the document are [`DocumentErrors`](crate::document::DocumentErrors).
pub fn run(args: PlanArgs) -> anyhow::Result<()> {
    let prepared = prepare(&read_job(&args.job)?, &MeshFiles::beside(&args.job))?;
    prepared.check_memory(default_limit_bytes())?;
    let predictions = args.predict.then(|| pilot::predict(&prepared, &AtomicBool::new(false)));
    let text = if args.json {
        let mut plan = prepared.plan_json();
        if let (Some(plan), Some(predictions)) = (plan.as_object_mut(), &predictions) {
            plan.insert("predictions".to_owned(), serde_json::to_value(predictions)?);
        }
        format!("{}\n", serde_json::to_string_pretty(&plan)?)
    } else {
        let mut text = describe(&PlanResult::from(&prepared.plan), &prepared.warnings);
        text += &predictions.as_ref().map(predictions_table).unwrap_or_default();
        text
    };
    print(&text)
}

fn describe(plan: &PlanResult, warnings: &[Warning]) -> String {
    let mut text = "effects\n".to_owned();
    for effect in &plan.effects {
        let switch = if effect.on { "on " } else { "off" };
        let bound = effect.bound.filter(|bound| *bound > 0.0);
        let bound = bound.map_or(String::new(), |bound| format!(" (at most {:.2} %)", 100.0 * bound));
        // writing to a string cannot fail
        let _ = writeln!(text, "  {switch} {:<18} {}{bound}", effect.name, effect.reason);
    }
    text += "guides\n";
    for (tubes, told) in guides(plan) {
        let _ = writeln!(text, "  {}: {told}", tubes_in_words(&tubes));
    }
    text += "methods\n";
    for (outputs, method) in [("grids", &plan.methods.grids), ("views", &plan.methods.views)] {
        if let Some(MethodResult { name, settings, reason }) = method {
            let settings = settings.as_object().into_iter().flatten().filter(|(_, value)| !value.is_null());
            let settings: Vec<String> = settings.map(|(name, value)| format!("{name} {value}")).collect();
            let _ = writeln!(text, "  {outputs}: {name} ({}): {reason}", settings.join(", "));
        }
    }
    if let Some(year) = &plan.methods.year {
        let _ = writeln!(text, "  year: {}: {}", year.name, year.reason);
    }
    for warning in warnings {
        let _ = writeln!(text, "warning: {}: {}", warning.code, warning.detail);
    }
    text
}

/// Returns how light is followed through the tubes: the numbers, from 1, of those of which the same is said.
fn guides(plan: &PlanResult) -> Vec<(Vec<usize>, String)> {
    let mut groups: Vec<(Vec<usize>, String)> = Vec::new();
    for (index, guide) in plan.guides.iter().enumerate() {
        let told = format!("{}: {}", guide.kind, guide.reason);
        match groups.iter_mut().find(|(_, other)| *other == told) {
            Some((numbers, _)) => numbers.push(index + 1),
            None => groups.push((vec![index + 1], told)),
        }
    }
    groups
}

/// Writes numbers in ascending order, such as `tubes 1 to 3, 7`.
fn tubes_in_words(numbers: &[usize]) -> String {
    let runs = numbers.chunk_by(|a, b| a + 1 == *b).map(|run| match run {
        [first, .., last] if run.len() > 2 => format!("{first} to {last}"),
        few => few.iter().map(usize::to_string).collect::<Vec<_>>().join(", "),
    });
    let noun = if numbers.len() == 1 { "tube" } else { "tubes" };
    format!("{noun} {}", runs.collect::<Vec<_>>().join(", "))
}

#[cfg(test)]
mod tests {
    #[test]
    fn tubes_are_counted_from_1_in_runs() {
        for (numbers, words) in [
            (&[1][..], "tube 1"),
            (&[1, 2], "tubes 1, 2"),
            (&[1, 2, 3, 7], "tubes 1 to 3, 7"),
            (&[2, 4, 5, 6, 8, 9], "tubes 2, 4 to 6, 8, 9"),
        ] {
            assert_eq!(super::tubes_in_words(numbers), words);
        }
    }
}

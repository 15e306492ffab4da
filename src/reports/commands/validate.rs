//! `skyduct-reports validate`: the validation report from live runs.

use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::{markdown, validation};

#[derive(Debug, clap::Args)]
pub struct ValidateArgs {
    /// Folder for the report: validation.md, and its figures in validation/
    #[arg(long, default_value = "docs")]
    out: PathBuf,
    /// Folder of the reference numbers
    #[arg(long, default_value = "tests/reference")]
    reference: PathBuf,
}

pub fn run(args: ValidateArgs) -> anyhow::Result<()> {
    let report = validation::run(&args.reference, |title| eprintln!("{title} ..."))?;
    markdown::write(&report, &args.out)
        .with_context(|| format!("the report cannot be written to {}", args.out.display()))?;
    let failed: Vec<_> = report.checks().filter(|check| !check.passed()).map(|check| check.name.as_str()).collect();
    eprintln!(
        "{} checks, {} failed; the report is {}",
        report.checks().count(),
        failed.len(),
        args.out.join("validation.md").display()
    );
    if !failed.is_empty() {
        bail!("failed: {}", failed.join("; "));
    }
    Ok(())
}

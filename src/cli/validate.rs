//! `skyduct validate`: the validation report from live runs.

use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::validation;

#[derive(Debug, clap::Args)]
pub struct ValidateArgs {
    /// Folder that the report goes to: validation.md, and its figures in validation/
    #[arg(long, default_value = "docs")]
    out: PathBuf,
    /// Folder of the reference numbers
    #[arg(long, default_value = "tests/reference")]
    reference: PathBuf,
}

pub fn run(args: ValidateArgs) -> anyhow::Result<()> {
    let sections = validation::run(&args.reference, |title| eprintln!("{title} ..."))?;
    validation::write(&sections, &args.out)
        .with_context(|| format!("the report cannot be written to {}", args.out.display()))?;
    let checks = || sections.iter().flat_map(|section| &section.checks);
    let failed: Vec<_> = checks().filter(|check| !check.passed()).map(|check| check.name.as_str()).collect();
    eprintln!(
        "{} checks, {} failed; the report is {}",
        checks().count(),
        failed.len(),
        args.out.join("validation.md").display()
    );
    if !failed.is_empty() {
        bail!("failed: {}", failed.join("; "));
    }
    Ok(())
}

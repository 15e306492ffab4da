//! `skyduct-reports thesis`: the experiments of A. Schou's thesis, repeated.

use std::path::PathBuf;

use anyhow::{Context, bail};

use crate::{markdown, thesis};

#[derive(Debug, clap::Args)]
pub struct ThesisArgs {
    /// Folder for the report: thesis.md, and its figures in thesis/
    #[arg(long, default_value = "docs")]
    out: PathBuf,
    /// Passes of the longest series; all other numbers of passes are proportional to it
    #[arg(long, default_value_t = 1024, value_parser = clap::value_parser!(u64).range(1..=65_536))]
    passes: u64,
}

pub fn run(args: ThesisArgs) -> anyhow::Result<()> {
    let settings = thesis::Settings::new(args.passes);
    let report = thesis::run(&settings, |part| eprintln!("{part} ..."))?;
    markdown::write(&report, &args.out)
        .with_context(|| format!("the report cannot be written to {}", args.out.display()))?;
    eprintln!("the report is {}", args.out.join("thesis.md").display());
    let failed: Vec<_> = report.checks().filter(|check| !check.passed()).map(|check| check.name.as_str()).collect();
    if !failed.is_empty() {
        bail!("failed: {}", failed.join("; "));
    }
    Ok(())
}

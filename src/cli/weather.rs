//! `skyduct weather`: reads a weather file and prints the report that an upload would give.

use std::path::PathBuf;

use super::mesh_files::read_at;
use super::print::print;
use crate::document::limits::WEATHER_BYTES;
use crate::document::weather::read_weather;
use crate::document::{DocumentErrors, FieldError};

#[derive(Debug, clap::Args)]
pub(super) struct WeatherArgs {
    /// Weather file (EPW or WEA)
    #[arg(value_name = "FILE")]
    pub file: PathBuf,
}

/// Prints the report as JSON, and its warnings to standard error. Faults of the file, which name line and field, are [`DocumentErrors`].
pub(super) fn run(args: WeatherArgs) -> anyhow::Result<()> {
    let refused = |detail: String| DocumentErrors::from(FieldError::new("", detail));
    let path = args.file.display();
    let bytes = read_at(&args.file, &path.to_string(), WEATHER_BYTES).map_err(refused)?;
    let (_, report) = read_weather(&bytes).map_err(|error| refused(format!("{path}: {error}")))?;
    for warning in &report.warnings {
        eprintln!("warning: {}", warning.detail);
    }
    let text = format!("{}\n", serde_json::to_string_pretty(&report)?);
    print(&text)
}

//! The commands.

mod bench;
mod thesis;
mod validate;

use skyduct::cli::telemetry;

/// Reports of live runs of skyduct: validation, benchmarks, the experiments of the thesis.
#[derive(Debug, clap::Parser)]
#[command(name = "skyduct-reports", version = skyduct::VERSION)]
pub struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Run the validation cases and write the report
    Validate(validate::ValidateArgs),
    /// Repeat the experiments of the thesis that the project starts from, and write the report
    Thesis(thesis::ThesisArgs),
    /// Measure what accuracy and effects cost on this machine, and write the pages on it
    Bench(bench::BenchArgs),
}

impl Arguments {
    /// Runs the command to its end.
    pub fn run(self) -> anyhow::Result<()> {
        telemetry::start(&telemetry::OF_COMMANDS);
        match self.command {
            Command::Validate(args) => validate::run(args),
            Command::Thesis(args) => thesis::run(args),
            Command::Bench(args) => bench::run(args),
        }
    }
}

//! Reports of live runs: `cargo run --release -p skyduct-reports -- validate`, `thesis` or `bench`.

use std::process::ExitCode;

use clap::Parser;
use skyduct_reports::commands::Arguments;

fn main() -> ExitCode {
    match Arguments::parse().run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

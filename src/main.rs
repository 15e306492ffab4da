//! Arguments and telemetry; picks the command.
//!
//! Exit status: 0 done, 2 the input is bad (standard error names the field by its JSON pointer), 1 anything else.

use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::process::ExitCode;

use clap::Parser;
use skyduct::cli::Arguments;
use skyduct::document::DocumentErrors;
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_env_filter(EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn")))
        .init();
    std::panic::set_hook(Box::new(log_in_one_line));
    let arguments = Arguments::parse();
    match catch_unwind(AssertUnwindSafe(|| arguments.command.run())) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            eprintln!("error: {error:#}");
            if error.is::<DocumentErrors>() { ExitCode::from(2) } else { ExitCode::FAILURE }
        }
        // the hook has logged it
        Err(_) => ExitCode::FAILURE,
    }
}

/// A failure of ours as one line of the log.
fn log_in_one_line(info: &PanicHookInfo) {
    let payload = info.payload();
    let message = payload.downcast_ref::<&str>().copied().or(payload.downcast_ref::<String>().map(String::as_str));
    let message = message.unwrap_or("no message").lines().next().unwrap_or_default();
    let place = info.location().map(ToString::to_string).unwrap_or_default();
    tracing::error!(place, "internal error: {message}");
}

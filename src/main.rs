//! Arguments and exit status; picks the command.
//!
//! Exit status: 0 done, 2 the input is bad (standard error names the field by its JSON pointer), 1 anything else.

use std::panic::{AssertUnwindSafe, PanicHookInfo, catch_unwind};
use std::process::ExitCode;

use clap::Parser;
use skyduct::cli::Arguments;
use skyduct::document::DocumentErrors;

fn main() -> ExitCode {
    std::panic::set_hook(Box::new(log_in_one_line));
    let arguments = Arguments::parse();
    match catch_unwind(AssertUnwindSafe(|| arguments.run())) {
        Ok(Ok(())) => ExitCode::SUCCESS,
        Ok(Err(error)) => {
            let Some(DocumentErrors(errors)) = error.downcast_ref() else {
                eprintln!("error: {error:#}");
                return ExitCode::FAILURE;
            };
            errors.iter().for_each(|error| eprintln!("error: {error}"));
            ExitCode::from(2)
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

use std::process::ExitCode;

use clap::Parser;
use skyduct::cli::{Arguments, Command, demo, serve, submit};
use skyduct::document::DocumentErrors;

fn main() -> ExitCode {
    tracing_subscriber::fmt()
        .with_writer(std::io::stderr)
        .with_env_filter(tracing_subscriber::EnvFilter::try_from_default_env().unwrap_or_else(|_| "warn".into()))
        .init();
    let result = match Arguments::parse().command {
        Command::Serve(args) => serve::run(args),
        Command::Submit(args) => submit::run(args),
        Command::Demo(args) => demo::run(args),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.is::<DocumentErrors>() => {
            eprintln!("{error:#}");
            ExitCode::from(2)
        }
        Err(error) => {
            eprintln!("{error:#}");
            ExitCode::FAILURE
        }
    }
}

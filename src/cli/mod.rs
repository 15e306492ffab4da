//! Commands of the command line.

mod backup;
pub mod client;
pub mod config;
mod demo;
mod figures;
mod hbjson;
mod healthcheck;
pub mod mesh_files;
mod metrics;
mod plan;
mod predictions_table;
mod print;
mod progress;
mod render;
mod results_table;
pub mod serve;
mod study;
mod study_progress;
mod submit;
pub mod telemetry;
pub mod temporary_folder;
mod weather;
mod year_table;

use std::io::IsTerminal;

use clap::CommandFactory;
use clap::error::ErrorKind;

/// Daylight through tubular daylight devices: illuminance grids and views with their errors.
#[derive(Debug, clap::Parser)]
#[command(name = "skyduct", version = crate::VERSION)]
pub struct Arguments {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, clap::Subcommand)]
enum Command {
    /// Start a service, submit the example room, and save its grid and pictures
    Demo(demo::DemoArgs),
    /// Run the service: web page, HTTP interface, job queue and renderer; the default without a command on a terminal
    Serve(serve::ServeArgs),
    /// Copy the data folder of a running service to a folder from which a service can be started
    Backup(backup::BackupArgs),
    /// Render a job document without a server
    #[command(visible_alias = "annual")]
    Render(render::RenderArgs),
    /// Print the plan of a job document: effects, guides and methods, each with its reason
    Plan(plan::PlanArgs),
    /// Print a room of a Honeybee model (HBJSON) as the `room` of a job document
    Hbjson(hbjson::HbjsonArgs),
    /// Check a weather file (EPW or WEA) and print what it has: site, records, faults, and the moments that its records stand for
    Weather(weather::WeatherArgs),
    /// Compare methods on a job: the time that each takes to each accuracy, against a reference
    Study(study::StudyArgs),
    /// Send job documents to a service, follow them, and save their results
    Submit(submit::SubmitArgs),
    /// Check that a service is ready (exit status 0)
    Healthcheck(healthcheck::HealthcheckArgs),
}

impl Arguments {
    /// Runs the requested command to its end (the service to its shutdown). Without a command, starts the service if standard
    /// output is a terminal, and exits with an error otherwise.
    pub fn run(self) -> anyhow::Result<()> {
        let command = match self.command {
            Some(command) => command,
            None if std::io::stdout().is_terminal() => Command::Serve(serve::ServeArgs::default()),
            None => {
                let why = "a command is required unless standard output is a terminal";
                Self::command().error(ErrorKind::MissingSubcommand, why).exit()
            }
        };
        // the service configures its log; other commands log only warnings and errors
        if !matches!(command, Command::Serve(_)) {
            telemetry::start(&telemetry::OF_COMMANDS);
        }
        match command {
            Command::Demo(args) => demo::run(args),
            Command::Serve(args) => serve::run(args),
            Command::Backup(args) => backup::run(args),
            Command::Render(args) => render::run(args),
            Command::Plan(args) => plan::run(args),
            Command::Hbjson(args) => hbjson::run(args),
            Command::Weather(args) => weather::run(args),
            Command::Study(args) => study::run(args),
            Command::Submit(args) => submit::run(args),
            Command::Healthcheck(args) => healthcheck::run(args),
        }
    }
}

//! The commands.

mod backup;
pub mod client;
pub mod config;
mod demo;
mod figures;
mod healthcheck;
pub mod mesh_files;
mod metrics;
mod plan;
mod predictions_table;
mod progress;
mod render;
mod results_table;
pub mod serve;
mod study;
mod study_progress;
mod submit;
pub mod telemetry;
pub mod temporary_folder;

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
    /// Do the main job in one go: start the service, submit the example room, save its grid and pictures
    Demo(demo::DemoArgs),
    /// Run the service: page, HTTP interface, job queue and renderer; what happens without a command, on a terminal
    Serve(serve::ServeArgs),
    /// Copy the data folder of a service while it serves, to a folder that a service can start on
    Backup(backup::BackupArgs),
    /// Render a job document without a server
    Render(render::RenderArgs),
    /// Say what of a job document would be simulated and what not, and why
    Plan(plan::PlanArgs),
    /// Compare methods on a job: what each takes to each accuracy, against a reference
    Study(study::StudyArgs),
    /// Send a job document to a service, follow it, and save its results
    Submit(submit::SubmitArgs),
    /// Ask a service whether it is ready (exit status 0)
    Healthcheck(healthcheck::HealthcheckArgs),
}

impl Arguments {
    /// Runs the command that was asked for, to its end; of the service, to its shutdown. On a terminal, none means the
    /// service, which prints the address of its page.
    pub fn run(self) -> anyhow::Result<()> {
        let command = match self.command {
            Some(command) => command,
            None if std::io::stdout().is_terminal() => Command::Serve(serve::ServeArgs::default()),
            None => {
                let why = "without a command, the service starts on a terminal only";
                Self::command().error(ErrorKind::MissingSubcommand, why).exit()
            }
        };
        // the service is configured, all others only tell what went wrong
        if !matches!(command, Command::Serve(_)) {
            telemetry::start(&telemetry::OF_COMMANDS);
        }
        match command {
            Command::Demo(args) => demo::run(args),
            Command::Serve(args) => serve::run(args),
            Command::Backup(args) => backup::run(args),
            Command::Render(args) => render::run(args),
            Command::Plan(args) => plan::run(args),
            Command::Study(args) => study::run(args),
            Command::Submit(args) => submit::run(args),
            Command::Healthcheck(args) => healthcheck::run(args),
        }
    }
}

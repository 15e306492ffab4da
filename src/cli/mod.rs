//! The commands.

pub mod client;
pub mod config;
pub mod demo;
pub mod healthcheck;
pub mod mesh_files;
pub mod plan;
pub mod progress;
pub mod render;
mod results_table;
pub mod serve;
pub mod submit;
pub mod telemetry;
pub mod thesis;
pub mod validate;

/// Daylight through tubular daylight devices: illuminance grids and views with their errors.
#[derive(Debug, clap::Parser)]
#[command(name = "skyduct", version)]
pub struct Arguments {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Debug, clap::Subcommand)]
pub enum Command {
    /// Do the main job in one go: start the service, submit the example room, save its grid and pictures
    Demo(demo::DemoArgs),
    /// Run the service: HTTP interface, job queue and renderer
    Serve(serve::ServeArgs),
    /// Render a job document without a server
    Render(render::RenderArgs),
    /// Say what of a job document would be simulated and what not, and why
    Plan(plan::PlanArgs),
    /// Run the validation cases and write the report
    Validate(validate::ValidateArgs),
    /// Repeat the experiments of the thesis that the project starts from, and write the report
    Thesis(thesis::ThesisArgs),
    /// Send a job document to a service, follow it, and save its results
    Submit(submit::SubmitArgs),
    /// Ask a service whether it is ready (exit status 0)
    Healthcheck(healthcheck::HealthcheckArgs),
}

impl Command {
    pub fn run(self) -> anyhow::Result<()> {
        // the service is configured, all others only tell what went wrong
        if !matches!(self, Self::Serve(_)) {
            telemetry::start(&telemetry::OF_COMMANDS);
        }
        match self {
            Self::Demo(args) => demo::run(args),
            Self::Serve(args) => serve::run(args),
            Self::Render(args) => render::run(args),
            Self::Plan(args) => plan::run(args),
            Self::Validate(args) => validate::run(args),
            Self::Thesis(args) => thesis::run(args),
            Self::Submit(args) => submit::run(args),
            Self::Healthcheck(args) => healthcheck::run(args),
        }
    }
}
